"""What do the ends of a contact stand for: corners and faces of a box, ends and sides of a rod, a rim, a ball, a point?

A body with faces and corners touches with both: corners touch the other's faces, faces its corners and round surfaces.
In space bars touch balls and other bars with their sides; edges of boxes touch balls, and other bars where they are
named (box.bottom_front). In: a reference. Out: its surfaces, in parameters; how they move is in `contact_geometry`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, permutations, product
from typing import Any, Final

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.mechanism import ARRAY, ParameterVector
from multibody_sym.mechanics.references import BARE, References
from multibody_sym.mechanics.row_records import (
    LOCAL,
    NOWHERE,
    Bent,
    BodyFace,
    ContactSurface,
    Edge,
    Level,
    Marker,
    PlaneSurface,
    Rim,
    RoundSurface,
)
from multibody_sym.mechanics.spanning_tree import body_part
from multibody_sym.model.bodies import FROM_AXIS, GROUND, ORIGIN, OWN_POINTS, Body, Pose, Shape, Surface, unit_vector
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_upright
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, negate
from multibody_sym.scalars.vectors import add, cross, dot, scale, subtract
from multibody_sym.scalars.vectors import negate as opposite

_X, _Y, _Z = (ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE)
_SQUARE: Final = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_SIDES: Final = ("right", "top", "left", "bottom", "front", "back")
"""The faces of a box to which x, y, -x, -y, z, -z point."""
_DEEPEST: Final = 100
"""How many parameters may follow from one another; a circle of them is an error elsewhere."""


@dataclass(frozen=True)
class Solid:
    """The surfaces with which an end of a contact touches, by name (empty where there is one), in the body's order.

    `inner` is a place inside it, for those with faces that end or corners. `edges`, of boxes in space, touch balls.
    """

    skins: tuple[tuple[str, ContactSurface], ...]
    inner: Marker | None = None
    edges: tuple[tuple[str, ContactSurface], ...] = ()


@dataclass(frozen=True)
class _Place:
    """A body in whose axes places are given, under the name that errors use."""

    name: str
    body: int
    flat: bool

    def at(self, place: Point) -> Marker:
        return Marker(self.name, self.body, Pose(place))

    def points(self, places: Sequence[Point], what: str) -> Iterator[tuple[str, ContactSurface]]:
        yield from ((f"{what}{k}", RoundSurface(self.at(place))) for k, place in enumerate(places, 1))

    def verify_flat(self, what: str = "ends at two places", advice: str = "in space planes have no ends") -> None:
        if not self.flat:
            raise ModelError(f"{self.name} {what}, and this model is not plane; {advice}", number="M114")


def solid_of(reference: str, references: References, *, flat: bool) -> Solid:
    """Return the surfaces of `body`, `body.surface` or `body.point`, in a `flat` model or in space.

    A body by itself touches with its shape, or its only surface that is no plane, or its point; ground with its only
    surface. A box has the faces right, top, left, bottom, front and back, corner1, .., and in space edges by two of its
    faces, such as bottom_front; a rod has end1, end2 and its side.
    """
    name, part = body_part(reference, references.system.bodies)
    body = references.system.bodies.get(name, BARE)
    place = _Place(reference, references.numbers[name], flat)
    if part in body.surfaces:
        return _surface_solid(place, body.surfaces[part], body)
    if part and part not in (*body.points, *body.frames):
        parts = {} if body.shape is None else {x: skin for x, skin in _shape_solid(place, body.shape).skins if x}
        if body.shape is not None and body.shape.kind == "box" and not flat:
            parts |= dict(_edges(place, body.shape, permutations))
        if part in parts:
            skin = parts[part]
            side = skin.plane if part in _SIDES else None
            if side is None or not (side.beside and side.ends):
                return Solid((("", skin),))
            corners = ((corner, parts[corner]) for corner in corners_of(part))  # a box in a plane model
            return Solid(((part, skin), *corners), place.at(ORIGIN))
        if part not in OWN_POINTS:
            known = [f"{name}.{x}" for x in (*body.surfaces, *body.points, *body.frames, *parts)]
            raise ModelError(f"{reference!r} is no surface and no point", number="M106", word=reference, known=known)
    if not part and body.shape is not None:
        return _shape_solid(place, body.shape)
    if not part:
        plain = "point" if name == GROUND else "plane"  # a body's planes carry others; ground has no point of its own
        solid = [x for x, surface in body.surfaces.items() if surface.kind != plain]
        if len(solid) > 1:
            names = ", ".join(f"{name}.{x}" for x in solid)
            raise ModelError(f"{name} has several surfaces; say which: {names}", number="M114")
        if solid:
            return solid_of(f"{name}.{solid[0]}", references, flat=flat)
    return Solid((("", RoundSurface(references.marker(reference))),))


def corners_of(face: str) -> tuple[str, str]:
    """Return the names of the corners of a box in a plane model at which a face ends, in the order of its ends."""
    k = _SIDES.index(face) + 1
    return f"corner{k % 4 + 1}", f"corner{(k + 1) % 4 + 1}"


# --- surfaces that a model declares ---


def _surface_solid(place: _Place, surface: Surface, body: Body) -> Solid:
    if surface.plane is not None:
        between = None if surface.between is None else body.ends(surface.between)
        return _plane(place, surface.plane, unit_vector(surface.normal), between)
    if surface.segment is not None:
        p, q = body.ends(surface.segment)
        return _bar(place, p, q, unit_vector(surface.normal))
    if surface.point is not None:
        return Solid((("", RoundSurface(place.at(surface.point))),))
    centre = place.at(surface.centre)
    if surface.guide is not None:
        place.verify_flat("is a curve", "it is touched where all moves in the xy-plane; on_curve guides points")
        closed = surface.outline is not None
        return Solid((("", Bent(centre, NOWHERE, surface.touched_on_left, closed)),))
    if surface.revolution is not None:
        return Solid((("", _level(centre, surface.revolution, unit_vector(surface.axis), flat=place.flat)),))
    if surface.sphere is not None or place.flat:
        return Solid((("", RoundSurface(centre, surface.radius, surface.inside)),))
    if surface.inside:
        message = "is a rim, which in space has no inside; a bowl is {sphere: r, inside: true}"
        raise ModelError(f"{place.name} {message}", number="M114")
    return Solid((("", Rim(centre, surface.radius, unit_vector(surface.axis))),))


def _level(centre: Marker, profile: Node, axis: Point, *, flat: bool) -> Level:
    """Return the surface of a profile about an axis: the height over it of the LOCAL coordinates is zero there."""
    height, square = dot(axis, LOCAL), dot(LOCAL, LOCAL)
    across = [x for x, a in zip(LOCAL, axis, strict=True) if a is ZERO]
    away = sqrt(dot((*across, ZERO), (*across, ZERO)) if len(across) == 2 else square - height**2)
    if flat:
        away = dot(cross(axis, _Z), LOCAL)
    function: Node = height - evaluate([profile], lambda leaf: away if leaf is FROM_AXIS else leaf)[0]
    gx, gy, gz = (derivative(function, x) for x in LOCAL)
    x, y, z = LOCAL
    second = [derivative(g, leaf) for g, leaf in ((gx, x), (gy, y), (gz, z), (gx, y), (gx, z), (gy, z))]
    return Level(centre, function, (gx, gy, gz), tuple(second))


def _plane(place: _Place, through: Point, normal: Point, between: tuple[Point, ...] | None) -> Solid:
    """Return a plane; where it ends its ends are corners, and a place below its middle is inside."""
    if between is None:
        return Solid((("", PlaneSurface(place.at(through), normal)),))
    place.verify_flat()
    p, q = between
    middle, apart = scale(ONE / 2, add(p, q)), subtract(q, p)
    inner = place.at(subtract(middle, scale(sqrt(dot(apart, apart)) / 2, normal)))
    face = PlaneSurface(place.at(through), normal, (place.at(p), place.at(q)))
    return Solid((("", face), *place.points(between, "end")), inner)


# --- shapes of bodies ---


def _shape_solid(place: _Place, shape: Shape) -> Solid:
    sizes = shape.sizes
    centre = place.at(ORIGIN)
    if shape.kind == "box":
        x, y, z = (size / 2 for size in sizes)
        levels = (ZERO,) if place.flat else (negate(z), z)
        corners = [(a * x, b * y, level) for level, (a, b) in product(levels, _SQUARE)]
        edges = () if place.flat else tuple(_edges(place, shape, combinations))
        return Solid((*place.points(corners, "corner"), *_faces(place, shape)), centre, edges)
    if shape.kind == "rod":
        return _bar(place, ORIGIN, (sizes[0], ZERO, ZERO), _Z)
    if place.flat or shape.kind in ("sphere", "shell"):
        return Solid((("", RoundSurface(centre, sizes[0])),))
    if shape.kind == "cylinder":
        rims = [Rim(place.at((ZERO, ZERO, z)), sizes[0], _Z) for z in (negate(sizes[1] / 2), sizes[1] / 2)]
        return Solid(tuple((f"rim{k}", rim) for k, rim in enumerate(rims, 1)))
    return Solid((("", Rim(centre, sizes[0], _Z)),))


def _bar(place: _Place, p: Point, q: Point, normal: Point) -> Solid:
    """Return a thin bar: its ends, and its side with a normal; in a plane model both its sides where that is z."""
    ends = place.at(p), place.at(q)
    skins: list[tuple[str, ContactSurface]]
    if not place.flat:
        skins = [("side", Edge(*ends, normal))]
    elif is_upright(normal):
        left = cross(_Z, unit_vector(subtract(q, p)))
        faces = {"left": left, "right": opposite(left)}
        skins = [(name, PlaneSurface(ends[0], n, ends, (BodyFace(ends[0], opposite(n)),))) for name, n in faces.items()]
    else:
        skins = [("side", PlaneSurface(ends[0], normal, ends))]
    return Solid((*skins, *place.points((p, q), "end")))


def _faces(place: _Place, shape: Shape) -> Iterator[tuple[str, ContactSurface]]:
    """Yield the faces of a box, each of which is touched where it is nearer than those beside it."""
    halves = [size / 2 for size in shape.sizes]
    normals = [(n, half) for n, half in zip((_X, _Y, _Z), halves, strict=True)][: 2 if place.flat else 3]
    turned = [*normals[:2], *((opposite(n), half) for n, half in normals[:2])]
    turned += [(n, half) for n, half in normals[2:]] + [(opposite(n), half) for n, half in normals[2:]]
    faces = [BodyFace(place.at(scale(half, n)), n) for n, half in turned]
    for name, face in zip(_SIDES, faces, strict=False):
        ends = None
        if place.flat:
            along, middle = cross(_Z, face.normal), face.place.pose.position
            step = scale(halves[0] if along[1] is ZERO else halves[1], along)
            ends = place.at(subtract(middle, step)), place.at(add(middle, step))
        yield name, PlaneSurface(face.place, face.normal, ends, tuple(other for other in faces if other is not face))


def _edges(
    place: _Place, shape: Shape, pairs: type[combinations[Any] | permutations[Any]]
) -> Iterator[tuple[str, ContactSurface]]:
    """Yield the edges of a box in space by the faces that meet there, with `permutations` either way round."""
    halves = [scale(size / 2, axis) for size, axis in zip(shape.sizes, (_X, _Y, _Z), strict=True)]
    x, y, z = halves
    towards = dict(zip(_SIDES, (x, y, opposite(x), opposite(y), z, opposite(z)), strict=True))
    normals = dict(zip(_SIDES, (_X, _Y, opposite(_X), opposite(_Y), _Z, opposite(_Z)), strict=True))
    for (name, n), (other_name, m) in pairs(normals.items(), 2):
        along = next((half for half, axis in zip(halves, (_X, _Y, _Z), strict=True) if not _leads(axis, n, m)), x)
        if _leads(n, m):
            continue
        middle = add(towards[name], towards[other_name])
        ends = place.at(subtract(middle, along)), place.at(add(middle, along))
        yield f"{name}_{other_name}", Edge(*ends, add(n, m), (n, m))


def _leads(axis: Point, *normals: Point) -> bool:
    """Return whether some of these axes are along one, either way."""
    return any(dot(axis, normal) is not ZERO for normal in normals)


# --- values ---


def sample_value(node: Node, parameters: ParameterVector, depth: int = 0) -> float:
    """Return the value of an expression of parameters in slots at their sample values, nan where it has none.

    That is enough to tell one side from the other.
    """
    if node.shadow is not None:
        return node.shadow
    values = {}
    for leaf in leaves([node], "slot"):
        array, place = leaf.data
        value = parameters[place].value if array == ARRAY else None
        values[leaf] = math.nan if value is None or depth > _DEEPEST else sample_value(value, parameters, depth + 1)
    try:
        return evaluate_float([node], values)[0]
    except UNDEFINED:
        return math.nan
