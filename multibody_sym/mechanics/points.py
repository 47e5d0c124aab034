"""Points on bodies: position, velocity and acceleration in world axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from multibody_sym.mechanics.mechanism import TangentAngle
from multibody_sym.mechanics.motion import BodyMotion, Motion, pose, spread
from multibody_sym.mechanics.row_records import Marker, Sliding
from multibody_sym.model.bodies import GROUND, Pose
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import atan2
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    negate,
    product,
    subtract,
)


def as_point(vector: Sequence[object]) -> Point:
    """Return the components of a vector as Nodes."""
    x, y, z = map(as_node, vector)
    return x, y, z


def position(motion: Motion, marker: Marker) -> Vec:
    """Return a marker's position in world axes, computed once."""
    if marker.body < 0:
        return motion.point(marker)
    key = marker.body, marker.pose.position
    found = motion.places.get(key)
    if found is None:
        R_WB, p_WB = motion.poses[marker.body]
        found = motion.places[key] = add(p_WB, apply(R_WB, motion.point(marker)))
    return found


def axes(motion: Motion, marker: Marker) -> Mat:
    """Return the rotation from a marker's axes to those of the world."""
    return product(motion.rotation(marker.body), pose(motion.state, marker.pose)[0])


def velocity(motion: Motion, marker: Marker) -> Vec:
    """Return a marker's velocity in world axes: v = R (v_B + omega x r)."""
    if marker.body < 0:
        return ZERO_VECTOR
    body = motion.bodies[marker.body]
    return apply(motion.rotation(marker.body), add(body.v_WB, cross(body.w_WB, motion.point(marker))))


def acceleration(motion: Motion, marker: Marker, bodies: Sequence[tuple[Vec, Vec]]) -> Vec:
    """Return a marker's acceleration in world axes, given those of the bodies (`motion.accelerations`)."""
    if marker.body < 0:
        return ZERO_VECTOR
    body, r = motion.bodies[marker.body], motion.point(marker)
    a, alpha = bodies[marker.body]
    return apply(motion.rotation(marker.body), add(a, apply(spread(alpha, body.w_WB), r)))


# ----------------------------------------------------------------------------------------------------------------------
# Relative motion of two frames on bodies, in world axes.


Accelerations = Sequence[tuple[Vec, Vec]]
"""Each body's (acceleration of its origin, angular acceleration), as `motion.accelerations` returns them."""

STARTING: Final = 1e-5
"""The speed (m/s) up to which what slips from rest keeps the direction in which it starts, of one of length 1.

Slower slip turns faster, at mu g over its speed: a load that turns as it grows took thousands of steps below 1e-7 m/s.
"""


def direction(motion: Motion, frame: Marker, components: Point) -> Vec:
    """Return the vector with these components along a frame's axes, in world axes, computed once."""
    key = frame.body, frame.pose.rotation, components
    found = motion.directions.get(key)
    if found is None:
        rotation, _ = pose(motion.state, frame.pose)
        along = apply(motion.rotation(frame.body), apply(rotation, motion.state.vector(components)))
        found = motion.directions[key] = along
    return found


def angular_velocity(motion: Motion, body: int) -> Vec:
    """Return a body's angular velocity in world axes."""
    return apply(motion.rotation(body), motion.bodies[body].w_WB) if body >= 0 else ZERO_VECTOR


def angular_acceleration(motion: Motion, body: int, bodies: Accelerations) -> Vec:
    """Return a body's angular acceleration in world axes."""
    return apply(motion.rotation(body), bodies[body][1]) if body >= 0 else ZERO_VECTOR


@dataclass(frozen=True)
class UnitVector:
    """A unit vector and its rate, in world axes."""

    vector: Vec
    rate: Vec

    @property
    def reversed(self) -> UnitVector:
        return UnitVector(negate(self.vector), negate(self.rate))

    def cross(self, other: UnitVector) -> UnitVector:
        """Return the vector product with another one, which is no unit vector, and its rate."""
        rate = add(cross(self.rate, other.vector), cross(self.vector, other.rate))
        return UnitVector(cross(self.vector, other.vector), rate)


def separation(motion: Motion, first: Marker, second: Marker) -> tuple[Vec, Vec]:
    """Return how far one marker is from another one (m), and the rate of that, in world axes."""
    away = subtract(position(motion, first), position(motion, second))
    return away, subtract(velocity(motion, first), velocity(motion, second))


def slip_velocity(sliding: Sliding, velocity: Sequence[S], motion: Motion) -> list[S]:
    """Return a vector against which friction acts, by the velocity (m/s) along each row.

    What started from rest stops where this is zero, and not where the velocity is: there friction has no direction.
    """
    if sliding.starts is None:
        return list(velocity)
    return [v + STARTING * d for v, d in zip(velocity, motion.state.values(sliding.starts), strict=True)]


# ----------------------------------------------------------------------------------------------------------------------
# Angles on planes that turn: where ground's axes, seen on a plane, lead.


def tangent_components(motion: Motion, measure: TangentAngle, axis: Point) -> tuple[S, S]:
    """Return the components of an axis of ground along `across` of a plane, and along normal x across."""
    ground = motion.mechanism.body_index(GROUND)
    seen = direction(motion, Marker(GROUND, ground, Pose()), axis)
    along = direction(motion, measure.plane, measure.across)
    return dot(seen, along), dot(seen, cross(direction(motion, measure.plane, measure.normal), along))


def tangent_angle(motion: Motion, measure: TangentAngle, axis: Point) -> S:
    """Return the angle by which an axis of ground, seen on a plane, leads `across` about the normal there."""
    along, ahead = tangent_components(motion, measure, axis)
    return atan2(ahead, along)


# ----------------------------------------------------------------------------------------------------------------------
# Wrenches on bodies and their projection on the speeds (virtual power), in one backward recursion.


Wrench = tuple[Vec, Vec]
"""(force, moment about the body's origin), in body axes."""
NO_WRENCH: Final[Wrench] = (ZERO_VECTOR, ZERO_VECTOR)


def power(linear: Vec, angular: Vec, wrench: Wrench) -> S:
    """Return F . v + M . omega, of virtual velocities too."""
    return dot(linear, wrench[0]) + dot(angular, wrench[1])


class Wrenches:
    """Wrenches collected body by body while forces are gathered; ground takes and forgets."""

    def __init__(self, count: int) -> None:
        self.of_body: list[Wrench] = [NO_WRENCH] * count

    def add(self, body: int, force: Vec, moment: Vec) -> None:
        """Add a wrench in body axes about the body's origin."""
        if body >= 0:
            f, m = self.of_body[body]
            self.of_body[body] = (add(f, force), add(m, moment))


def add_force(wrenches: Wrenches, motion: Motion, marker: Marker, force: Vec) -> None:
    """Add a force with world components that acts at a marker."""
    if marker.body >= 0:
        in_body = apply_transposed(motion.rotation(marker.body), force)
        wrenches.add(marker.body, in_body, cross(motion.point(marker), in_body))


def add_force_at(wrenches: Wrenches, motion: Motion, body: int, place: Vec, force: Vec) -> None:
    """Add a force that acts on a body at a place in space (world axes)."""
    if body >= 0:
        R_WB, p_WB = motion.poses[body]
        in_body = apply_transposed(R_WB, force)
        wrenches.add(body, in_body, cross(apply_transposed(R_WB, subtract(place, p_WB)), in_body))


def add_moment(wrenches: Wrenches, motion: Motion, body: int, moment: Vec) -> None:
    """Add a moment (world axes) on a body."""
    wrenches.add(body, ZERO_VECTOR, apply_transposed(motion.rotation(body), moment))


def add_pair(wrenches: Wrenches, motion: Motion, ends: Sequence[Marker], force: Vec) -> None:
    """Add a force (world components) on the first of two markers and its opposite on the second."""
    add_force(wrenches, motion, ends[0], force)
    add_force(wrenches, motion, ends[1], negate(force))


def generalized_forces(motion: Motion, of_body: Sequence[Wrench]) -> list[S]:
    """Return the generalised forces of wrenches: Q_k = sum F . dv/du_k + M . domega/du_k."""
    return joint_projection(motion, carried_wrenches(motion, of_body))


def carried_wrenches(motion: Motion, of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return, for each body, the sum of the wrenches on it and on all bodies it carries, about its origin.

    Rows act on few bodies: where none is carried it stays NO_WRENCH.
    """
    total = list(of_body)
    for index in range(len(total) - 1, -1, -1):
        if total[index] is NO_WRENCH:
            continue
        parent = motion.mechanism.bodies[index].parent
        if parent >= 0:
            force, moment = to_parent(motion.bodies[index], total[index])
            total[parent] = (add(total[parent][0], force), add(total[parent][1], moment))
    return total


def to_parent(moved: BodyMotion, wrench: Wrench) -> Wrench:
    """Return a wrench about the parent's origin, in the parent's axes."""
    force = apply(moved.R_PB, wrench[0])
    return force, add(apply(moved.R_PB, wrench[1]), cross(moved.p_PB, force))


def joint_projection(motion: Motion, wrenches: Sequence[Wrench]) -> list[S]:
    """Return A^T R: the components of each body's wrench along the free directions of its joint."""
    projected: list[S] = []
    for moved, wrench in zip(motion.bodies, wrenches, strict=True):
        if wrench is NO_WRENCH:
            projected += [0] * len(moved.linear)
            continue
        projected += [power(v, w, wrench) for v, w in zip(moved.linear, moved.angular, strict=True)]
    return projected
