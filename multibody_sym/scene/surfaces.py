"""Surfaces of bodies and of ground as they are seen. A new kind of surface is one entry in _FORMS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.curves.curve import Curve
from multibody_sym.model.declaration.surfaces import FROM_AXIS, Surface
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.resolution.plane import moves_in_plane
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.scene.forms import Bowl, Disc, Face, Form, Polyline, Sphere, Symbol, Vector, across, unit, vector
from multibody_sym.scene.items import Item
from multibody_sym.scene.stage import Stage

_SAMPLES: Final = 121


def surface_items(stage: Stage, name: str) -> Iterator[Item]:
    """Yield the surfaces of a body."""
    body = stage.declared(name)
    for word, surface in body.surfaces.items():
        path = ("bodies", name, "surfaces", word)
        form = _FORMS[surface.kind](stage, body, surface)
        yield Item("surface", f"{name}.{word}", word, path, stage.number_of(name), form, on_ground=name == GROUND)


def is_solid(item: Item) -> bool:
    """Return whether a surface shows the whole of its body: what is round, a bar, or the face of a wedge."""
    return not item.on_ground and isinstance(item.form, (Disc, Sphere, Polyline, Face))


def _disc(stage: Stage, body: Body, surface: Surface) -> Form:
    centre, axis = stage.vector(surface.centre), unit(stage.vector(surface.axis))
    return Disc(centre, axis, stage.number(surface.radius), hollow=surface.inside)


def _sphere(stage: Stage, body: Body, surface: Surface) -> Form:
    return Sphere(stage.vector(surface.centre), stage.number(surface.radius), hollow=surface.inside)


def _plane(stage: Stage, body: Body, surface: Surface) -> Form:
    assert surface.plane is not None
    ends = None if surface.between is None else _ends(stage, body, surface.between)
    return Face(stage.vector(surface.plane), unit(stage.vector(surface.normal)), ends)


def _segment(stage: Stage, body: Body, surface: Surface) -> Form:
    assert surface.segment is not None
    return Polyline(_ends(stage, body, surface.segment))


def _point(stage: Stage, body: Body, surface: Surface) -> Form:
    assert surface.point is not None
    return Symbol("place", stage.vector(surface.point))


def _ends(stage: Stage, body: Body, places: tuple[object, ...]) -> tuple[Vector, Vector]:
    first, second = body.ends(places)  # type: ignore[arg-type]
    return stage.vector(first), stage.vector(second)


def _revolution(stage: Stage, body: Body, surface: Surface) -> Form:
    """Return the section through the axis, the profile on both sides; in space the profile to be turned about it."""
    assert surface.revolution is not None
    axis: Floats = np.array(unit(stage.vector(surface.axis)))
    side: Floats = np.array(across(axis))
    centre, reach = stage.vector(surface.centre), _reach(stage)
    ways = np.linspace(-reach, reach, _SAMPLES)
    if not moves_in_plane(stage.system):
        ways = np.linspace(0.0, reach, 25)
        heights = [_value(stage, surface.revolution, FROM_AXIS, way) for way in ways]
        known = [(float(w), h) for w, h in zip(ways, heights, strict=True) if np.isfinite(h)]
        return Bowl(centre, vector(axis), tuple(known))
    heights = [_value(stage, surface.revolution, FROM_AXIS, way) for way in ways]
    if side[0] < 0.0:
        side = -side
    points = [vector(np.array(centre) + way * side + h * axis) for way, h in zip(ways, heights, strict=True)]
    return Polyline(tuple(point for point in points if np.all(np.isfinite(point))))


def _guide(stage: Stage, body: Body, surface: Surface) -> Form:
    assert surface.guide is not None
    points = curve_points(stage, surface.guide, None, once=surface.outline is not None)
    centre = np.array(stage.vector(surface.centre))
    return Polyline(tuple(vector(centre + point) for point in points), closed=surface.outline is not None)


_FORMS: Final[Mapping[str, Callable[[Stage, Body, Surface], Form]]] = {
    "disc": _disc,
    "sphere": _sphere,
    "plane": _plane,
    "segment": _segment,
    "point": _point,
    "revolution": _revolution,
    "curve": _guide,
    "outline": _guide,
}
"""The form of each kind of surface."""


def _reach(stage: Stage) -> float:
    """Return how far from its middle a curve is drawn that has no ends (m)."""
    return 1.2 * stage.lengths.get("size", 1.0)


def curve_points(stage: Stage, curve: Curve, near: float | None, *, once: bool = False) -> list[Vector]:
    """Return points of a curve around the parameter `near`, or `once` around; where it is defined, from there on."""
    if curve.unit_of_parameter == "rad":
        middle = np.pi if once or near is None else near
        low, high = middle - np.pi, middle + np.pi
        if not once and near is not None:
            wider = _defined(stage, curve, (middle - 2.0 * np.pi, middle + 2.0 * np.pi), near)
            if all(_cusps(*wider)):  # a whole arch
                return _between_cusps(*wider)
    else:
        reach = max(_reach(stage), 1.3 * abs(near or 0.0))
        low, high = -reach, reach
    if once:
        return _defined(stage, curve, (low, high), low)[0]
    return _between_cusps(*_defined(stage, curve, (low, high), near))


def _defined(
    stage: Stage, curve: Curve, ends: tuple[float, float], near: float | None
) -> tuple[list[Vector], int]:
    """Return points of a curve where it is defined, and how many of them come before the parameter `near`."""
    found: list[Vector] = []
    start = 0
    for way in np.linspace(*ends, _SAMPLES):
        point = [_value(stage, node, curve.leaf, float(way)) for node in curve.place]
        if np.all(np.isfinite(point)):
            found.append(vector(point))
            start += way < (near if near is not None else ends[0])
    return found, start


def _between_cusps(points: list[Vector], start: int) -> list[Vector]:
    """Return the part of a curve around a place of it that ends where the curve turns straight back."""
    before, after = _cusps(points, start)
    return points[max(before, default=0) : min(after, default=len(points) - 1) + 1]


def _cusps(points: list[Vector], start: int) -> tuple[list[int], list[int]]:
    """Return where a curve turns straight back, before a place of it and after."""
    chords = np.diff(np.array(points), axis=0)
    back = [k + 1 for k in range(len(chords) - 1) if float(chords[k] @ chords[k + 1]) < 0.0]
    return [k for k in back if k <= start], [k for k in back if k > start]


def _value(stage: Stage, node: Node, leaf: Node, value: float) -> float:
    """Return an expression of a leaf at a value of it, nan where it has none."""
    try:
        return float(evaluate_float([node], {**stage.known, leaf: value})[0])
    except (*UNDEFINED, KeyError):
        return float("nan")
