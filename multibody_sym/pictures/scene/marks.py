"""What a figure names beside its parts: lengths by their letters, angles, and the coordinates of joints."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.mechanics.motion import JointMotion, after_step
from multibody_sym.mechanics.spanning_tree import coordinate_names
from multibody_sym.model.bodies import GROUND, SHAPES
from multibody_sym.model.constraints import Distance
from multibody_sym.model.fields import Point
from multibody_sym.model.joints import MovingJoint
from multibody_sym.model.parameters import in_letters, letters_of
from multibody_sym.pictures.scene.items import (
    Anchor,
    AngleMark,
    Item,
    NamedLength,
    Stop,
    TurnStop,
    Vector,
    across,
    unit,
    vector,
)
from multibody_sym.pictures.scene.joints import PlacedJoint, placed_joint
from multibody_sym.pictures.scene.stage import Stage, same
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import text

_LONGEST: Final = 9
"""The longest expression (characters) that is written at a length; longer ones, unless names, are read in the model."""
_SIZES: Final[Mapping[str, tuple[tuple[Vector, Vector], ...]]] = {
    "rod": (((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),),
    "box": tuple(
        (vector(-0.5 * np.eye(3)[k]), vector(0.5 * np.eye(3)[k])) for k in range(3)
    ),
}
"""Between which places (from the centre, in units of a size) sizes of a shape lie; those of round ones are radii."""


def dimensions(stage: Stage, places: Mapping[str, Sequence[Vector]]) -> tuple[NamedLength, ...]:
    """Return the lengths that the model names, each letter once: plain letters first, where they are radii."""
    found = [*_sizes(stage), *_points(stage), *_radii(stage)]
    order = sorted(range(len(found)), key=lambda k: (len(found[k].label), not found[k].radius, k))
    taken: set[str] = set()
    kept = []
    for k in order:
        words = set(re.findall("[A-Za-z_][A-Za-z_0-9]*", found[k].label))
        ends = (vector(stage.world(end.body, end.point)) for end in (found[k].a, found[k].b))
        if not words <= taken and not same(*ends):
            taken |= words
            kept.append(k)
    return tuple(found[k] for k in sorted(kept))


def letters(node: Node) -> str:
    """Return how a length is named in a figure: its expression if that names parameters and is short, else nothing."""
    if not leaves([node], "symbol"):
        return ""
    found = text(node).removeprefix("-")
    if found.isidentifier():
        return found
    return found if len(found) <= _LONGEST and "(" not in found else ""


def _sizes(stage: Stage) -> Iterator[NamedLength]:
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
                yield NamedLength(f"{name}.{SHAPES[kind][k]}", label, ends[0], ends[1])
            elif k == 0:
                yield _radius(f"{name}.radius", label, number, stage.centre(name), stage.number(size))


def _radius(
    name: str, label: str, body: int, centre: Vector, radius: float, angle: float = 0.7, axis: Vector = (0.0, 0.0, 1.0)
) -> NamedLength:
    """Return a radius about an axis at an angle from x, or from what is across the axis beside x and y."""
    e1 = np.array(across(axis))
    e2 = np.cross(unit(axis), e1)
    rim = vector(np.array(centre) + radius * (np.cos(angle) * e1 + np.sin(angle) * e2))
    return NamedLength(name, label, Anchor(body, centre), Anchor(body, rim), radius=True)


def _radii(stage: Stage) -> Iterator[NamedLength]:
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
            yield NamedLength(name, letters(element.value), first, second)


def _points(stage: Stage) -> Iterator[NamedLength]:
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
                    yield NamedLength(f"{name}.{word}", label, *ends, component=text(point[k]))


# --- coordinates and angles ----------------------------------------------------------------------------------------


def ways(stage: Stage) -> Iterator[NamedLength]:
    """Yield the coordinates of sliders: from the place on the parent to that on the child."""
    for name, joint in stage.system.joints.items():
        steps = [free.step for free in joint.free_steps]
        if len(steps) != 1 or len(steps[0].slides) != 1 or steps[0].turns:
            continue
        made = placed_joint(stage, name)
        (label,) = coordinate_names(name, joint)
        a, b = Anchor(made.parent.body, made.parent.point), Anchor(made.child.body, made.child.point)
        yield NamedLength(label, label, a, b, coordinate=True)


def angles(stage: Stage, places: Mapping[str, Sequence[Vector]]) -> Iterator[AngleMark]:
    """Yield the angles of hinges and of frames on ground."""
    own_names = {coordinate.name for coordinate in stage.mechanism.coordinates}
    for name, joint in stage.system.joints.items():
        if len(joint.free_steps) != 1 or not joint.free_steps[0].step.is_hinge:
            continue
        (label,), made = coordinate_names(name, joint), placed_joint(stage, name)
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
            first: Vector = (0.0, 1.0, 0.0) if abs(axis[0]) > 0.9 else (1.0, 0.0, 0.0)
            place = stage.place(f"{name}.{word}")
            at = Anchor(place.body, place.point)
            start, stop = Anchor(place.body, first), Anchor(place.body, place.turned(first))
            yield AngleMark(f"{name}.{word}", letters(frame.rotate[0].angle), at, start, stop, axis, coordinate=False)


# ----------------------------------------------------------------------------------------------------------------------
# Stops: the limits of joints that hold, where they stand on the parent and which way of the child they bar.


_SIDES: Final = (("lower", -1.0, "≥"), ("upper", 1.0, "≤"))
_STILL: Final = 1e-9


def stop_items(
    stage: Stage, bodies: Sequence[Item], places: Mapping[str, Sequence[Vector]]
) -> Iterator[Item]:
    """Yield the stops of each joint, on its parent; `bodies` are the items of bodies, whose fronts meet them.

    Limits that do not act are no stops, and one that nothing of a body would show, such as of a disc about its middle,
    is not seen.
    """
    book = letters_of(stage.system.parameters)
    for name, joint in stage.system.joints.items():
        limits = joint.stops if isinstance(joint, MovingJoint) else None
        for word, side, sign in _SIDES if limits is not None else ():
            node: Node | None = getattr(limits, word)
            value = math.nan if node is None else stage.number(node, math.nan)
            if node is None or not math.isfinite(value):
                continue
            made = placed_joint(stage, name)
            form = _form(made, value, side, bodies, places)
            if form is not None:
                limit = in_letters(letters(node), book) or _number_with_unit(value, joint.coordinate_units[0])
                label, path = f"{coordinate_names(name, joint)[0]} {sign} {limit}", ("joints", name, "limits", word)
                on_ground = stage.is_ground(joint.parent)
                yield Item("stop", f"{name}.{word}", label, path, made.parent.body, form, made.bodies, on_ground)


def _number_with_unit(value: float, unit_of: str) -> str:
    """Return a limit in digits, of angles in degrees."""
    if value == 0.0:
        return "0"
    number = f"{math.degrees(value):.4g}°" if unit_of == "rad" else f"{value:.4g} {unit_of}".rstrip()
    return number.replace("-", "−")


def _form(
    made: PlacedJoint, value: float, side: float, bodies: Sequence[Item], places: Mapping[str, Sequence[Vector]]
) -> Stop | TurnStop | None:
    """Return where a stop stands: across the way on which the joint goes there, or beside the rod that turns."""
    (free,) = made.joint.free_steps
    moved = after_step(free.step, JointMotion(), [value], [0.0], made.stage.motion.state)
    rotation = np.array(moved.rotation, dtype=float)
    way = rotation @ np.array(moved.linear[0], dtype=float)
    axis = rotation @ np.array(moved.angular[0], dtype=float)
    base, turned = np.array(made.parent.point), made.parent.turned
    if float(np.linalg.norm(way)) > _STILL:
        at = vector(base + turned(np.array(moved.position, dtype=float)))
        ahead = side * np.array(turned(unit(way)))
        return Stop(at, vector(ahead), made.child.point, _front(made, ahead, bodies))
    there = away(made.stage, made.stage.body(made.joint.child), made.child.point, places)
    if there is None:
        return None
    own = made.child.rotation.T @ there
    own = own - float(own @ unit(axis)) * np.array(unit(axis))
    reach = float(np.linalg.norm(own))
    if reach < _STILL:
        return None
    spin = vector(side * np.array(turned(unit(axis))))
    return TurnStop(vector(base), spin, turned(unit(rotation @ own)), made.child.turned(unit(own)), reach)


def _front(made: PlacedJoint, ahead: Floats, bodies: Sequence[Item]) -> float:
    """Return how far what has a size reaches ahead of the joint's place on the child (m), zero where nothing does."""
    stage, child = made.stage, made.child.body
    way = stage.turned(made.parent.body, vector(ahead))
    at = stage.world(child, made.child.point)
    reaches = [0.0]
    for item in bodies:
        rod = not getattr(item.form, "closed", True)
        if item.body == child and not rod and item.form.sized:
            reaches += [float((stage.world(child, point) - at) @ way) for point in item.form.bounds]
    return max(reaches)
