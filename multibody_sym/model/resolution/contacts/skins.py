"""What the ends of a contact stand for: corners of a box, ends of a rod, a rim, a ball, a plane, a point."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Final

from multibody_sym.errors import ModelError, suggestion
from multibody_sym.model.declaration.bodies import Body, Shape
from multibody_sym.model.declaration.surfaces import Surface
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.contact_rows import Flat, Rim, Round, Skin
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import OWN_POINTS, Pose, unit_vector
from multibody_sym.model.resolution.references import BARE, References
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.scalars.node import ONE, ZERO, Node, negate

NamedSkin = tuple[str, Skin]
"""A part of a body that touches by itself, and what it is called beside others: `corner1`; empty where it is alone."""

_SQUARE: Final = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_Z: Final[Point] = (ZERO, ZERO, ONE)


def skins_of(reference: str, references: References, *, flat: bool) -> list[NamedSkin]:
    """Return what `body`, `body.surface` or `body.point` touches with, in a `flat` model or in space.

    A body by itself is what its shape is, or its only round surface, or its point.
    """
    name, part = body_part(reference, references.system.bodies)
    body = references.system.bodies.get(name, BARE)
    if part in body.surfaces:
        return _of_surface(reference, body.surfaces[part], references.numbers[name], flat=flat)
    if part:
        if part not in (*body.points, *body.frames, *OWN_POINTS):
            known = [f"{name}.{x}" for x in (*body.surfaces, *body.points, *body.frames)]
            raise ModelError(f"{reference!r} is no surface and no point{suggestion(reference, known)}")
        return [("", Round(references.marker(reference)))]
    if body.shape is not None:
        return _of_shape(name, body.shape, references.numbers[name], flat=flat)
    return _of_body(name, body, references, flat=flat)


def _of_body(name: str, body: Body, references: References, *, flat: bool) -> list[NamedSkin]:
    solid = [part for part, surface in body.surfaces.items() if surface.kind in ("sphere", "disc", "segment")]
    if len(solid) > 1:
        raise ModelError(f"{name} has several surfaces; say which: {', '.join(f'{name}.{part}' for part in solid)}")
    if solid:
        return skins_of(f"{name}.{solid[0]}", references, flat=flat)
    return [("", Round(references.marker(name)))]


def _of_surface(reference: str, surface: Surface, body: int, *, flat: bool) -> list[NamedSkin]:
    def marker(place: Point) -> Marker:
        return Marker(reference, body, Pose(place))

    if surface.kind == "plane":
        assert surface.plane is not None
        ends = None if surface.between is None else (marker(surface.between[0]), marker(surface.between[1]))
        if ends is not None and not flat:
            raise ModelError(f"{reference} ends between two places, and in space a plane has none; leave out between")
        return [("", Flat(marker(surface.plane), unit_vector(surface.normal), ends))]
    if surface.kind == "segment":
        assert surface.segment is not None
        return _points([marker(place) for place in surface.segment], "end")
    if surface.kind == "point":
        assert surface.point is not None
        return [("", Round(marker(surface.point)))]
    centre = marker(surface.centre)
    if surface.sphere is not None or flat:
        return [("", Round(centre, surface.radius, surface.inside))]
    if surface.inside:
        raise ModelError(f"{reference} is a rim, which in space has no inside; a bowl is {{sphere: r, inside: true}}")
    return [("", Rim(centre, surface.radius, unit_vector(surface.axis)))]


def _of_shape(name: str, shape: Shape, body: int, *, flat: bool) -> list[NamedSkin]:
    sizes = shape.sizes

    def marker(x: Node, y: Node, z: Node) -> Marker:
        return Marker(name, body, Pose((x, y, z)))

    if shape.kind == "box":
        x, y, z = (size / 2 for size in sizes)
        levels = (ZERO,) if flat else (negate(z), z)
        return _points([marker(a * x, b * y, level) for level, (a, b) in product(levels, _SQUARE)], "corner")
    if shape.kind == "rod":
        return _points([marker(ZERO, ZERO, ZERO), marker(sizes[0], ZERO, ZERO)], "end")
    if flat or shape.kind in ("sphere", "shell"):
        return [("", Round(marker(ZERO, ZERO, ZERO), sizes[0]))]
    if shape.kind == "cylinder":
        half = sizes[1] / 2
        return [(f"rim{k}", Rim(marker(ZERO, ZERO, z), sizes[0], _Z)) for k, z in enumerate((negate(half), half), 1)]
    return [("", Rim(marker(ZERO, ZERO, ZERO), sizes[0], _Z))]


def _points(markers: Sequence[Marker], what: str) -> list[NamedSkin]:
    return [(f"{what}{k}", Round(marker)) for k, marker in enumerate(markers, 1)]
