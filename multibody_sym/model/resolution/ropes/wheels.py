"""Wheels that turn with their ropes: by which coordinates they turn about their axes, and relative to what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Pose, unit_vector
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.model.mechanism.rope_path import Bend, Grip
from multibody_sym.model.resolution.references import References
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot
from multibody_sym.scalars.vectors import apply, apply_transposed, cross, dot

_PARALLEL: Final = 1e-12


def pulley_bends(references: References) -> dict[str, Bend]:
    """Return every declared pulley; those that turn with their ropes with what turns them."""
    made = {}
    for name, pulley in references.system.pulleys.items():
        with at("pulleys", name, "at" if pulley.body is None else "body"):
            centre = references.marker(pulley.at or pulley.body or "")
            bend = Bend(centre, pulley.radius, unit_vector(pulley.axis), name)
            bend = replace(bend, massless=pulley.is_held, rough=pulley.rough is not None)
            made[name] = bend if pulley.body is None else replace(bend, grip=grip_of(references.bodies, bend))
    return made


def grip_of(bodies: Sequence[TreeBody], wheel: Bend) -> Grip:
    """Return how a wheel turns: the sum of the angles of all hinges about its axis between it and a body that keeps it.

    Raises ModelError where its own joint turns it otherwise, so that no coordinate tells whole turns.
    """
    index, axis, angle = wheel.at.body, wheel.axis, ZERO
    if index < 0 or bodies[index].name == GROUND:
        raise ModelError("ground turns with no rope; a pulley that stands still is {at: ..}", number="M115")
    while index >= 0:
        turned = _turned(bodies[index], axis)
        if turned is None:
            break
        own, axis = turned
        angle = angle + own
        index = bodies[index].parent
    if angle is ZERO:
        body = bodies[wheel.at.body]
        raise ModelError(
            f"joint {body.joint_name} does not turn {body.name} by an angle about the axis of the wheel, and nothing "
            "counts its turns; join it by a revolute or planar joint about that axis",
            number="M115",
        )
    return Grip(Marker(wheel.at.name, index, Pose()), axis, _across(axis), angle, ZERO)


def _turned(body: TreeBody, axis: Point) -> tuple[Node, Point] | None:
    """Return by what angle a joint turns its body about an axis of it, and that axis in the parent's; else None."""
    here: Point = _nodes(apply_transposed(body.frame_on_body.rotation, axis))
    angle, free = ZERO, iter(body.free_steps)
    for step in body.steps:
        places = next(free).q if step.motion is None else ()
        if not step.turns:
            continue
        if not step.is_hinge:
            return None
        factor = _parallel(step.turns[0], here)
        if factor is None:
            return None
        own = slot("q", places[0]) if step.motion is None else step.motion
        angle = angle + own if factor > 0 else angle - own
    return angle, _nodes(apply(body.frame_on_parent.rotation, here))


def _parallel(a: Point, b: Point) -> int | None:
    """Return 1 or -1 for unit vectors that are equal or opposite whatever parameters are, else None."""
    if a == b:
        return 1
    across = [as_node(x).shadow for x in cross(a, b)]
    along = as_node(dot(a, b)).shadow
    if along is None or any(x is None or abs(x) > _PARALLEL for x in across):
        return 1 if a == b else None
    return 1 if along > 0 else -1


def _across(axis: Point) -> Point:
    """Return a unit vector that is normal to an axis: x where that is, else what is left of x, y or z."""
    units = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))
    sizes = [x.shadow if x.shadow is not None else 0.5 for x in axis]
    k = min(range(3), key=lambda i: (round(abs(sizes[i]), 6), i))
    part = dot(axis, units[k])
    rest = [u - part * x for u, x in zip(units[k], axis, strict=True)]
    return unit_vector(_nodes(rest))


def _nodes(vector: Sequence[object]) -> Point:
    x, y, z = (as_node(v) for v in vector)
    return x, y, z
