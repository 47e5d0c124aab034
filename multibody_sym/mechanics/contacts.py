"""Which contacts does a system have: elements that hold one way only, each with a normal row and rows of friction?

Also the rows of what rolls, and the feet that follow curves which are touched. How surfaces touch is in
`contact_geometry`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import combinations, permutations, product
from typing import Any, Final

from multibody_sym.errors import ModelError, at, gathered
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, coulomb_coefficients
from multibody_sym.mechanics.mechanism import ARRAY, ParameterVector, TangentAngle
from multibody_sym.mechanics.references import BARE, References, in_plane, moves_in_plane, no_part, surface_tangents
from multibody_sym.mechanics.row_records import (
    LOCAL,
    NOWHERE,
    AngleRow,
    Bent,
    BodyFace,
    ContactDirection,
    ContactRow,
    ContactSurface,
    Edge,
    Level,
    Marker,
    PlaneSurface,
    PositionRow,
    Rim,
    RoundSurface,
    Row,
    SurfacePair,
    TurningRow,
    is_curved,
    is_point,
    plane_of,
)
from multibody_sym.mechanics.spanning_tree import body_part, coordinate_names, speed_names
from multibody_sym.model.bodies import (
    FROM_AXIS,
    GROUND,
    IDENTITY,
    ORIGIN,
    OWN_POINTS,
    Body,
    Pose,
    Shape,
    Surface,
    unit_vector,
)
from multibody_sym.model.constraints import OnCurve, Rolling, row_names
from multibody_sym.model.contacts_and_impacts import Contact, copies, without_number
from multibody_sym.model.fields import Names, Point
from multibody_sym.model.joints import Fixed, Foot, Joint
from multibody_sym.model.steps import Curve, is_upright
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import cos, evaluate_float, sin, sqrt, substitute
from multibody_sym.scalars.node import ONE, ZERO, Node, negate
from multibody_sym.scalars.vectors import add, cross, dot, scale, subtract
from multibody_sym.scalars.vectors import negate as opposite

# ----------------------------------------------------------------------------------------------------------------------
# Rows of feet: each is where the other end is nearest to its curve.

_X, _Y, _Z = IDENTITY


def surfaces_with_feet(owner: str, skins: SurfacePair, references: References) -> SurfacePair:
    """Return the skins of a contact, curves with their feet."""
    feet = {joint.end: name for name, joint in feet_of(owner, references).items()}
    first, second = (
        replace(skin, foot=_foot(feet[k], references)) if isinstance(skin, Bent) else skin
        for k, skin in enumerate(skins)
    )
    return first, second


def feet_of(owner: str, references: References) -> Mapping[str, Foot]:
    """Return the joints of the feet of a contact or constraint, by their names."""
    joints = references.system.joints.items()
    return {name: joint for name, joint in joints if isinstance(joint, Foot) and joint.owner == owner}


def _foot(joint: str, references: References) -> Marker:
    return references.marker(references.system.joints[joint].child)


def foot_rows(references: References) -> Iterator[Row]:
    """Yield the rows of all feet that touch: across the way to the other end, or along a plane."""
    owners = {joint.owner: joint for joint in references.system.joints.values() if isinstance(joint, Foot)}
    for owner, joint in owners.items():
        if isinstance(references.system.constraints.get(owner), OnCurve):
            continue
        solids = (solid_of(end, references, flat=True) for end in joint.between)
        first, second = (solid.skins[0][1] for solid in solids)
        skins = surfaces_with_feet(owner, (first, second), references)
        names = list(feet_of(owner, references))
        bent = [skin for skin in skins if isinstance(skin, Bent)]
        if len(bent) == 2:
            facing = _facing_frame(bent[0].foot, _Y if bent[0].left != bent[1].left else opposite(_Y))
            yield AngleRow(f"{names[0]}.t", (facing, bent[1].foot), (_Y, _X), shared=_Y)
            yield PositionRow(f"{names[1]}.t", (bent[1].foot, bent[0].foot), _X)
            continue
        other = next(skin for skin in skins if not isinstance(skin, Bent))
        if (plane := other.plane) is not None:
            facing = _facing_frame(plane.place, opposite(plane.normal) if bent[0].left else plane.normal)
            yield AngleRow(f"{names[0]}.t", (facing, bent[0].foot), (_Y, _X), shared=_Y)
        else:
            yield PositionRow(f"{names[0]}.t", (bent[0].foot, other.place), _X)


def _facing_frame(marker: Marker, normal: Point) -> Marker:
    """Return a frame at a marker of which y is a unit vector of the marker's axes, in the plane.

    What faces a curve does so from one side: of two places where the tangent is along it, the one where y is y.
    """
    x, y, _ = normal
    rotation = ((y, x, ZERO), (negate(x), y, ZERO), _Z)
    return replace(marker, pose=replace(marker.pose, rotation=rotation))


def rows_on_curve(name: str, element: OnCurve, references: References) -> list[Row]:
    """Return the rows that keep a point at its foot on a curve, along the axes of the curve's body."""
    with at("point"):
        point = references.marker(element.point)
    (joint,) = feet_of(name, references)
    rows = zip(row_names(name, element), (_X, _Y, _Z), strict=True)
    made: list[Row] = [PositionRow(row, (_foot(joint, references), point), axis) for row, axis in rows]
    return made[:2] if in_plane(references.system) else made


# ----------------------------------------------------------------------------------------------------------------------

_TANGENTS: Final[tuple[ContactDirection, ...]] = ("t1", "t2")
_ROLLING: Final[tuple[ContactDirection, ...]] = ("normal", "t1", "t2")
_TURNS: Final[tuple[ContactDirection, ...]] = ("roll1", "roll2")
_ALONG_NORMAL: Final = 1e-9
_ALONE: Final = "face"
"""The word for the face of a plane that ends, beside the words for its ends."""
_HOLLOW: Final = "name points, discs or spheres of the other one"


@dataclass(frozen=True)
class _Meeting:
    """Two surfaces that may touch: the name of their contact, and a row from which all others follow."""

    name: str
    row: ContactRow

    def rows(self, word: str, along: tuple[ContactDirection, ...], kind: type[ContactRow]) -> tuple[ContactRow, ...]:
        if self.row.upright:
            along = along[:1]
        names = [f"{self.name}.{word}" + (str(k) if len(along) > 1 else "") for k in range(1, len(along) + 1)]
        r = self.row
        return tuple(kind(name, r.skins, d, r.across, r.upright, r.inner) for name, d in zip(names, along, strict=True))


def contacts(references: References) -> tuple[LawElement, ...]:
    """Return the contacts of a system. Raises ModelError, with the place, for surfaces that cannot touch."""
    system = references.system
    found: list[LawElement] = []
    taken = {*system.constraints, *system.joints}
    for declared, contact in system.contacts.items():
        with at("contacts", declared):
            every = []
            for _, name, copy in copies({declared: contact}):
                if name in taken:
                    raise ModelError(
                        f"{name!r} is something else too, and results tell both by name; rename one", number="M108"
                    )
                taken.add(name)
                every.append(tuple(_elements(name, ("contacts", declared), copy, references)))
            found += _together(without_number(declared), every, taken)
    for name, element in system.constraints.items():
        if isinstance(element, Rolling) and element.contact is not None:
            with at("constraints", name):
                _rolling_skins(name, element, references)
                found += _elements(name, ("constraints", name), element.contact, references)
    return tuple(found)


def _together(declared: str, copies: Sequence[tuple[LawElement, ...]], taken: set[str]) -> Iterator[LawElement]:
    """Yield contacts that repeat, as the legs of one table: those of one part each between the same two bodies.

    Like corners their forces have a sum, under the name that is declared.
    """
    bodies = {tuple(x.place.body for x in element.surfaces or ()) for copy in copies for element in copy}
    legs = len(copies) > 1 and all(len(copy) == 1 for copy in copies) and len(bodies) == 1 and declared not in taken
    for element in (element for copy in copies for element in copy):
        yield replace(element, group=declared) if legs else element


def rolling_rows(name: str, element: Rolling, references: References) -> Iterator[ContactRow]:
    """Yield the rows of a ball or disc that rolls: along the normal, and along both tangents."""
    skins = _rolling_skins(name, element, references)
    across = _across(name, None, skins, references)
    for row, along in zip(row_names(name, element), _ROLLING, strict=True):
        yield ContactRow(row, skins, along, across, references.flat)


def _rolling_skins(name: str, element: Rolling, references: References) -> SurfacePair:
    """Return the surfaces of a wheel and of its track. Raises ModelError for a body that does not roll there."""
    wrong = gathered()
    with wrong, at("body"):
        wheels = [skin for _, skin in solid_of(element.body, references, flat=references.flat).skins]
        if len(wheels) != 1 or not (is_curved(wheels[0]) or isinstance(wheels[0], (Rim, Bent))):
            what = "a plane" if wheels[0].plane is not None else "neither a ball nor a disc"
            raise ModelError(f"{element.body} is {what}; a ball or a disc rolls", number="M112")
    with wrong, at("on"):
        word, under = solid_of(element.on, references, flat=references.flat).skins[0]
        if word or is_point(under):
            raise ModelError(f"{element.on} is neither a plane nor round; name a surface to roll on", number="M114")
    wrong.told()
    with at("on"):
        if not _may_touch(wheels[0], under):
            raise ModelError(_cannot_touch(wheels[0], under, f"{element.body} and {element.on}"), number="M114")
    wheel = replace(wheels[0], rolls=True) if isinstance(wheels[0], Rim) else wheels[0]
    return surfaces_with_feet(name, (wheel, under), references)


def _elements(name: str, path: tuple[str, str], contact: Contact, references: References) -> Iterator[LawElement]:
    """Yield the contacts of all parts of both ends that may meet."""
    with at("between"):
        verify_bodies(contact.between, references.system)
        solids = []
        for k, reference in enumerate(contact.between):
            with at(k):
                solids.append(solid_of(reference, references, flat=references.flat))
                _verify_crossed(reference, solids[-1], references.system)
        meeting = list(_meetings(solids[0], solids[1], contact.between))
        if len(meeting) > 1 and any(isinstance(skin, Bent) for _, skins, _ in meeting for skin in skins):
            names = ", ".join(filter(None, (word for words, _, _ in meeting for word in words)))
            message = f"one part touches a curve in a contact, and here are {names}; give each a contact of its own"
            raise ModelError(message, number="M114")
    # fields that have no meaning for these surfaces
    pairs = [skins for _, skins, _ in meeting]
    if contact.tangent is not None and all(plane_of(skins) is None for skins in pairs):
        raise ModelError("a tangent is given for planes; other surfaces have none that stays", number="M114").under(
            "tangent"
        )
    if contact.rolling_resistance is not None and not any(map(_rolls, pairs)):
        message = "discs and spheres roll; nothing here does: give them a radius, or leave rolling_resistance out"
        raise ModelError(message, number="M114").under("rolling_resistance")
    both_end = all(len(solid.skins) > 1 and "" in dict(solid.skins) for solid in solids)
    unnamed = _ALONE if both_end else ""
    for words, skins, inner in meeting:
        first, second = (word or unnamed for word in words)
        words, skins = (first, second), surfaces_with_feet(name, skins, references)
        part = name if len(meeting) == 1 else ".".join((name, *(list(filter(None, words)) or [_ALONE])))
        across = _across(name, contact.tangent, skins, references)
        both = _Meeting(part, ContactRow(part, skins, "normal", across, references.flat, inner))
        yield LawElement(
            part,
            "contact",
            path,
            (replace(both.row, name=f"{part}.normal"),),
            frictions=tuple(_frictions(both, contact)),
            restitution=contact.restitution or ZERO,
            collides=contact.restitution is not None,
            tangential_restitution=contact.tangential_restitution or ZERO,
            group=name,
            open=contact.open,
        )


def _meetings(
    first: Solid, second: Solid, between: tuple[str, ...]
) -> Iterator[tuple[tuple[str, str], SurfacePair, Marker | None]]:
    """Yield pairs of parts of two solids that may touch: names, surfaces, and a place inside the body of a corner."""
    pairs = list(product(first.skins, second.skins))
    if len(pairs) == 1 and all(is_point(skin) for _, skin in pairs[0]):
        (_, a), (_, b) = pairs[0]
        yield ("", ""), (a, b), None
        return
    if not any(_may_touch(a, b) for (_, a), (_, b) in pairs):
        raise ModelError(_cannot_touch(pairs[0][0][1], pairs[0][1][1], " and ".join(between)), number="M114")
    for (word, a), (other_word, b) in pairs:
        if _may_touch(a, b):
            inner = None
            for face, corner, solid in ((a, b, second), (b, a, first)):
                if (plane := face.plane) is not None and (plane.ends or plane.beside) and is_point(corner):
                    inner = solid.inner
            yield (word, other_word), _facing_once(a, b), inner
    for (word, edge), (other_word, ball) in product(first.edges, second.skins):
        if is_curved(ball) and _may_touch(edge, ball):
            yield (word, other_word), (edge, ball), None
    for (word, ball), (other_word, edge) in product(first.skins, second.edges):
        if is_curved(ball) and _may_touch(ball, edge):
            yield (word, other_word), (ball, edge), None


def _facing_once(a: ContactSurface, b: ContactSurface) -> SurfacePair:
    """Return two skins of which, if they are edges, one says on which side of it the other is.

    It is the second, unless its normal is the usual z and that of the first is another one.
    """
    if not (isinstance(a, Edge) and isinstance(b, Edge)):
        return a, b
    first_usual, second_usual = (edge.facing is None or is_upright(edge.facing) for edge in (a, b))
    if second_usual and not first_usual:
        return a, replace(b, facing=None)
    return replace(a, facing=None), b


def _rolls(skins: SurfacePair) -> bool:
    return any(is_curved(skin) or isinstance(skin, Rim) for skin in skins)


def _frictions(meeting: _Meeting, contact: Contact) -> Iterator[FrictionPart]:
    coefficients = coulomb_coefficients(contact.static, contact.kinetic)
    if coefficients is not None:
        yield FrictionPart(meeting.name, meeting.rows("friction", _TANGENTS, ContactRow), *coefficients)
    if contact.rolling_resistance is not None and _rolls(meeting.row.skins):
        rows = meeting.rows("rolling", _TURNS, TurningRow)
        yield FrictionPart(f"{meeting.name}.rolling", rows, contact.rolling_resistance, contact.rolling_resistance)


def _across(name: str, tangent: Point | None, skins: SurfacePair, references: References) -> Point | None:
    """Return t1 in the axes of the plane, as declared or as the start finds it; None where neither skin is a plane."""
    plane, flat = plane_of(skins), references.flat
    if plane is None:
        return None
    constant = references.constants.get(name)
    if tangent is None and constant is not None:
        assert isinstance(constant.measure, TangentAngle)
        across, angle = constant.measure.across, constant.slot  # t1 leads `across` by the angle about the normal
        return add(scale(cos(angle), across), scale(sin(angle), cross(plane.normal, across)))
    normal = plane.normal if plane is skins[1] else opposite(plane.normal)
    usual, _ = surface_tangents(normal, flat=flat)
    if tangent is None:
        return usual
    lying = subtract(tangent, scale(dot(tangent, normal), normal))
    side = sample_value(dot(tangent, usual) if flat else dot(lying, lying), references.parameters)
    with at("tangent"):
        if not abs(side) > (_ALONG_NORMAL if flat else _ALONG_NORMAL**2):
            raise ModelError("it leads along the normal; give a direction along the surface", number="M114")
    if not flat:
        return unit_vector(lying)
    return usual if side > 0 else opposite(usual)


def verify_bodies(between: tuple[str, ...], system: System) -> None:
    """Raise ModelError for a body against itself, or against one that it is welded to."""
    names = []
    for k, reference in enumerate(between):
        with at(k):
            names.append(body_part(reference, system.bodies)[0])
    first, second = names
    if first == second:
        raise ModelError(f"{first} cannot touch itself; name two bodies", number="M114")
    welds = {
        body_part(joint.child, system.bodies)[0]: body_part(joint.parent, system.bodies)[0]
        for joint in system.joints.values()
        if isinstance(joint, Fixed) and not joint.cut
    }
    if _rigid(first, welds) == _rigid(second, welds):
        raise ModelError(f"{first} and {second} are welded to each other and can neither touch nor part", number="M114")


def _verify_crossed(reference: str, solid: Solid, system: System) -> None:
    """Raise ModelError for a plane with the normal z where nothing moves along z, and so nothing can leave it."""
    (_, skin), *others = solid.skins
    if not others and skin.plane is not None and is_upright(skin.plane.normal) and moves_in_plane(system):
        raise ModelError(
            f"{reference} has the normal z, and all joints here move in the xy-plane: nothing can leave it or press on "
            "it. Give it the normal that it has in that plane (surfaces: {..: {plane: .., normal: y}}; without one it "
            "is z), or a joint with a coordinate along z",
            number="M114",
        )


def _rigid(body: str, welds: Mapping[str, str]) -> str:
    seen: set[str] = set()
    while body in welds and body not in seen:
        seen.add(body)
        body = welds[body]
    return body


def _may_touch(a: ContactSurface, b: ContactSurface) -> bool:
    """Return whether two skins have a normal between them, and one place where they touch."""
    flats = a.plane is not None, b.plane is not None
    hollow = [isinstance(x, RoundSurface) and x.inside for x in (a, b)]
    if isinstance(a, Level) or isinstance(b, Level):
        return is_point(a) or is_point(b)
    if isinstance(a, Edge) or isinstance(b, Edge):
        other = b if isinstance(a, Edge) else a
        return isinstance(other, Edge) or (is_curved(other) and not any(hollow))
    if isinstance(a, Bent) or isinstance(b, Bent):
        other = a if isinstance(b, Bent) else b
        endless = other.plane is not None and other.plane.ends is None
        outlines = all(x.closed for x in (a, b) if isinstance(x, Bent))
        return endless or (isinstance(other, (RoundSurface, Bent)) and (outlines or not any(hollow)))
    if any(flats):
        return not all(flats) and not any(hollow)
    if isinstance(a, Rim) or isinstance(b, Rim):
        return False
    return not all(hollow) and not (is_point(a) and is_point(b))


def _cannot_touch(a: ContactSurface, b: ContactSurface, both: str) -> str:
    if a.plane is not None and b.plane is not None:
        return (
            f"{both} are two planes, which have no one place where they touch; name points or a round surface of one "
            "body, or give it shape: {box: ..}, whose corners touch"
        )
    if all(isinstance(x, Edge) or x.plane is not None for x in (a, b)):
        return (
            f"{both}: a plane is touched by points and round surfaces, not by an edge; name its body by itself, whose "
            "corners or ends touch"
        )
    if isinstance(a, Edge) or isinstance(b, Edge):
        return (
            f"{both}: in space the side of a bar and an edge touch other bars, edges and balls; name one of these, "
            "or give the other one {sphere: r}"
        )
    if isinstance(a, Bent) or isinstance(b, Bent):
        return (
            f"{both}: a curve is touched by points, discs and outlines of bodies, and by planes that do not end; the "
            "inside of a disc is touched by outlines, not by curves that end nowhere; name one of these"
        )
    if isinstance(a, Rim) or isinstance(b, Rim):
        return f"{both}: in space the rim of a disc touches planes only; name a plane, or give it a sphere"
    if isinstance(a, Level) or isinstance(b, Level):
        return f"{both}: points lie on a surface of revolution, nothing else does; name a point"
    return f"{both}: one of them is hollow, and what is inside it is touched from outside; {_HOLLOW}"


# ----------------------------------------------------------------------------------------------------------------------
# Feet: massless frames that follow the places where curves are touched, each with the curve's parameter as coordinate.
#
# The contact of a curve with something else takes the curve's tangent and normal from its foot, whose row says that it
# is where the other one is nearest. So all is made of known rows with exact derivatives, and nothing is solved for
# within.


def with_feet(system: System) -> System:
    """Return a system with the feet of all curves that are touched or guide points, each a body and a joint."""
    made = _Made(system, dict(system.bodies), dict(system.joints))
    constraints = system.constraints.items()
    pairs = [(name, contact.between) for _, name, contact in copies(system.contacts)]
    pairs += [(name, (element.body, element.on)) for name, element in constraints if isinstance(element, Rolling)]
    for owner, between in pairs:
        found = [(end, *guide) for end, reference in enumerate(between) if (guide := _guide(reference, system))]
        for end, body, surface in found:
            assert surface.guide is not None
            (x, y, _), (cx, cy, _) = surface.guide.place, surface.centre
            name, unit = surface.guide.leaf.data[1]
            curve = Curve(x=x + cx, y=y + cy, parameter=name, unit=unit)
            word = f"foot{end + 1}" if len(found) > 1 else "foot"
            made.add(owner, word, body, curve, between, end, turns="tangent")
    for owner, element in constraints:
        if isinstance(element, OnCurve):
            with at("constraints", owner, "on"):
                name, part = body_part(element.on, system.bodies)
                carrier = system.bodies.get(name, BARE)
                if part and part not in (*OWN_POINTS, *carrier.points, *carrier.frames):
                    raise no_part(name, part, carrier)
            made.add(owner, "foot", element.on, element.curve, (element.point, element.on), 1, turns=None)
    if len(made.joints) == len(system.joints):
        return system
    return replace(system, bodies=Names(made.bodies), joints=Names(made.joints))


def _guide(reference: str, system: System) -> tuple[str, Surface] | None:
    """Return the body and the surface of an end that is a curve: named, or the only one that its body has."""
    try:
        name, part = body_part(reference, system.bodies)
    except ModelError:  # raised where the contact is made of both ends
        return None
    body = system.bodies.get(name)
    if body is None:
        return None
    surface = body.surfaces.get(part)
    if not part and body.shape is None:
        plain = "point" if name == GROUND else "plane"
        solid = [each for each in body.surfaces.values() if each.kind != plain]
        surface = solid[0] if len(solid) == 1 else None
    return None if surface is None or surface.guide is None else (name, surface)


@dataclass(frozen=True)
class _Made:
    """The bodies and joints of a system with those of its feet."""

    system: System
    bodies: dict[str, Body]
    joints: dict[str, Joint]
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        for name, joint in self.system.joints.items():
            self.taken.update((*coordinate_names(name, joint), *speed_names(name, joint)))
        self.taken.update((*self.system.parameters, *self.system.inputs, *self.system.outputs, "t"))

    def add(
        self, owner: str, word: str, parent: str, curve: Curve, between: tuple[str, ...], end: int, *, turns: str | None
    ) -> None:
        """Add the foot of one end, whose coordinate is called after its owner and the curve's parameter."""
        plain = re.sub(r"[^A-Za-z0-9_]", "_", owner)
        q = f"{plain if plain[0].isalpha() else f'at_{plain}'}_{curve.leaf.data[1][0]}{word.removeprefix('foot')}"
        while not self.taken.isdisjoint((q, f"u_{q}")):
            q += "_foot"
        self.taken.update((q, f"u_{q}"))
        body = f"{word} of {owner}"
        self.bodies[body] = Body()
        self.joints[f"{owner}.{word}"] = Foot(
            parent=parent, child=body, curve=curve, turns=turns, q=(q,), owner=owner, between=between, end=end
        )


# ----------------------------------------------------------------------------------------------------------------------
# What do the ends of a contact stand for: corners and faces of a box, ends and sides of a rod, a rim, a ball, a point?


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
    function: Node = height - substitute(profile, {FROM_AXIS: away})
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
