"""What a figure names beside its parts: lengths by their letters, angles, and the coordinates of joints."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.bodies import SHAPES
from multibody_sym.model.declaration.constraints import Distance
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.resolution.spanning_tree import coordinate_names
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scene.forms import Vector, across, unit, vector
from multibody_sym.scene.items import GROUND as WORLD
from multibody_sym.scene.items import Anchor, AngleMark, Dimension
from multibody_sym.scene.joints import held
from multibody_sym.scene.places import same
from multibody_sym.scene.stage import Stage

_LONGEST: Final = 9
"""The longest expression (characters) that is written at a length; longer ones, unless names, are read in the model."""
_SIZES: Final[Mapping[str, tuple[tuple[Vector, Vector], ...]]] = {
    "rod": (((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),),
    "box": tuple(
        (vector(-0.5 * np.eye(3)[k]), vector(0.5 * np.eye(3)[k])) for k in range(3)
    ),
}
"""Between which places (from the centre, in units of a size) sizes of a shape lie; those of round ones are radii."""


def dimensions(stage: Stage, places: Mapping[str, Sequence[Vector]]) -> tuple[Dimension, ...]:
    """Return the lengths that the model names, each letter once: plain letters first, where they are radii."""
    found = [*_sizes(stage), *_points(stage), *_radii(stage)]
    order = sorted(range(len(found)), key=lambda k: (len(found[k].label), not found[k].radius, k))
    taken: set[str] = set()
    kept = []
    for k in order:
        words = set(re.findall("[A-Za-z_][A-Za-z_0-9]*", found[k].label))
        if not words <= taken and not _is_point(stage, found[k]):
            taken |= words
            kept.append(k)
    return tuple(found[k] for k in sorted(kept))


def _is_point(stage: Stage, dimension: Dimension) -> bool:
    a, b = dimension.a, dimension.b
    return same(vector(stage.world(a.body, a.point)), vector(stage.world(b.body, b.point)))


def letters(node: Node) -> str:
    """Return how a length is named in a figure: its expression if that names parameters and is short, else nothing."""
    if not leaves([node], "symbol"):
        return ""
    found = text(node).removeprefix("-")
    if found.isidentifier():
        return found
    return found if len(found) <= _LONGEST and "(" not in found else ""


def _sizes(stage: Stage) -> Iterator[Dimension]:
    for name, body in stage.system.bodies.items():
        if body.shape is None:
            continue
        kind, sizes, number = body.shape.kind, body.shape.sizes, stage.number_of(name)
        for k, size in enumerate(sizes):
            label = letters(size)
            if not label:
                continue
            if kind in _SIZES:
                centre = np.array(stage.centre(name))
                ends = [Anchor(number, vector(centre + stage.number(size) * np.array(end))) for end in _SIZES[kind][k]]
                yield Dimension(f"{name}.{SHAPES[kind][k]}", label, ends[0], ends[1])
            elif k == 0:
                yield _radius(f"{name}.radius", label, number, stage.centre(name), stage.number(size))


def _radius(
    name: str, label: str, body: int, centre: Vector, radius: float, angle: float = 0.7, axis: Vector = (0.0, 0.0, 1.0)
) -> Dimension:
    """Return a radius about an axis at an angle from x, or from what is across the axis beside x and y."""
    e1 = np.array(across(axis))
    e2 = np.cross(unit(axis), e1)
    rim = vector(np.array(centre) + radius * (np.cos(angle) * e1 + np.sin(angle) * e2))
    return Dimension(name, label, Anchor(body, centre), Anchor(body, rim), radius=True)


def _radii(stage: Stage) -> Iterator[Dimension]:
    """Yield the radii of surfaces and pulleys."""
    for name, body in stage.system.bodies.items():
        for word, surface in body.surfaces.items():
            if surface.kind in ("disc", "sphere") and letters(surface.radius):
                centre, radius = stage.vector(surface.centre), stage.number(surface.radius)
                number = stage.number_of(name)
                angle = -2.3 if surface.inside else 0.7  # a bowl is drawn below its middle
                axis = unit(stage.vector(surface.axis)) if surface.kind == "disc" else (0.0, 0.0, 1.0)
                yield _radius(f"{name}.{word}", letters(surface.radius), number, centre, radius, angle, axis)
    for name, pulley in stage.system.pulleys.items():
        if letters(pulley.radius):
            place = stage.place(pulley.at or pulley.body or GROUND)
            yield _radius(name, letters(pulley.radius), place.body, place.point, stage.number(pulley.radius))
    for name, element in stage.system.constraints.items():
        if isinstance(element, Distance) and letters(element.value):
            first, second = (Anchor(end.body, end.point) for end in map(stage.place, element.between))
            yield Dimension(name, letters(element.value), first, second)


def _points(stage: Stage) -> Iterator[Dimension]:
    """Yield the ways along a body's axes to its points and its centre of mass, where each is one expression."""
    for name, body in stage.system.bodies.items():
        number = stage.number_of(name)
        declared: dict[str, Point] = dict(body.points)
        if body.com is not None and body.shape is None:
            declared = {**declared, "com": body.com}
        for word, point in declared.items():
            given = [k for k in range(3) if point[k].shadow != 0]
            for k in given if len(given) <= 2 else ():
                label, start = letters(point[k]), list(stage.vector(point))
                if label:
                    start[k] = 0.0
                    ends = Anchor(number, vector(start)), Anchor(number, stage.vector(point))
                    yield Dimension(f"{name}.{word}", label, *ends, component=text(point[k]))


# --- coordinates and angles ----------------------------------------------------------------------------------------


def ways(stage: Stage) -> Iterator[Dimension]:
    """Yield the coordinates of sliders: from the place on the parent to that on the child."""
    for name, joint in stage.system.joints.items():
        steps = [free.step for free in joint.free_steps]
        if len(steps) != 1 or len(steps[0].slides) != 1 or steps[0].turns:
            continue
        made = held(stage, name)
        (label,) = coordinate_names(name, joint)
        a, b = Anchor(made.parent.body, made.parent.point), Anchor(made.child.body, made.child.point)
        yield Dimension(label, label, a, b, coordinate=True)


def angles(stage: Stage, places: Mapping[str, Sequence[Vector]]) -> Iterator[AngleMark]:
    """Yield the angles of hinges and of frames on ground."""
    own_names = {coordinate.name for coordinate in stage.mechanism.coordinates}
    for name, joint in stage.system.joints.items():
        if len(joint.free_steps) != 1 or not joint.free_steps[0].step.is_hinge:
            continue
        (label,), made = coordinate_names(name, joint), held(stage, name)
        if label not in own_names and stage.mechanism.relative is None:
            continue
        axis: Floats = np.array(unit(stage.vector(joint.free_steps[0].step.turns[0])))
        there = away(stage, stage.body(joint.child), made.child.point, places)
        if there is None:
            continue
        own = made.child.rotation.T @ there  # in frame M, which is F's at zero
        own = own - (own @ axis) * axis
        if np.linalg.norm(own) < 1e-9:
            continue
        start, stop = made.parent.turned(unit(own)), made.child.turned(unit(own))
        at = Anchor(made.parent.body, made.parent.point)
        yield AngleMark(
            label, label, at, Anchor(made.parent.body, start), Anchor(made.child.body, stop), made.parent.turned(axis)
        )
    yield from _slopes(stage)


def away(stage: Stage, body: str, place: Vector, places: Mapping[str, Sequence[Vector]]) -> Floats | None:
    """Return the direction from a joint's place to what is farthest of its child: the way that its rod goes."""
    candidates = [*places.get(body, ()), stage.centre(body)]
    shape = stage.declared(body).shape
    if shape is not None and shape.kind == "rod":
        candidates.append((stage.number(shape.sizes[0]), 0.0, 0.0))
    ways_there = [np.subtract(other, place) for other in candidates]
    farthest = max(ways_there, key=lambda way: float(np.linalg.norm(way)))
    return farthest if np.linalg.norm(farthest) > 1e-9 else None


def _slopes(stage: Stage) -> Iterator[AngleMark]:
    """Yield the angles by which frames of bodies are turned, named by a letter."""
    for name, body in stage.system.bodies.items():
        for word, frame in body.frames.items():
            if len(frame.rotate) != 1 or not letters(frame.rotate[0].angle):
                continue
            axis = unit(stage.vector(frame.rotate[0].axis))
            if abs(axis[0]) > 0.9:
                first: Vector = (0.0, 1.0, 0.0)
            else:
                first = (1.0, 0.0, 0.0)
            place = stage.place(f"{name}.{word}")
            at = Anchor(place.body, place.point)
            start, stop = Anchor(place.body, first), Anchor(place.body, place.turned(first))
            yield AngleMark(f"{name}.{word}", letters(frame.rotate[0].angle), at, start, stop, axis, coordinate=False)


def world_anchor(point: Sequence[float]) -> Anchor:
    """Return a place in the world."""
    return Anchor(WORLD, vector(point))
