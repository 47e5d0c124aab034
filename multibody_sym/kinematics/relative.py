"""Relative motion of two frames on bodies, in world axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from multibody_sym.kinematics.motion import Motion, pose
from multibody_sym.kinematics.points import acceleration, position, velocity
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.sliding_rows import Sliding
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, apply, cross, negate, scale, subtract

Accelerations = Sequence[tuple[Vec, Vec]]
"""Each body's (acceleration of its origin, angular acceleration), as `motion.accelerations` returns them."""

STARTING: Final = 1e-5
"""The speed (m/s) up to which what slips from rest keeps the direction in which it starts, of one of length 1.

Slower slip turns faster, at mu g over its speed: a load that turns as it grows took thousands of steps below 1e-7 m/s.
"""


def direction(motion: Motion, frame: Marker, components: Point) -> Vec:
    """Return the vector with these components along a frame's axes, in world axes."""
    rotation, _ = pose(motion.state, frame.pose)
    x, y, z = motion.state.values(components)
    return apply(motion.rotation(frame.body), apply(rotation, (x, y, z)))


def angular_velocity(motion: Motion, body: int) -> Vec:
    """Return a body's angular velocity in world axes."""
    return apply(motion.rotation(body), motion.bodies[body].w_WB) if body >= 0 else ZERO_VECTOR


def angular_acceleration(motion: Motion, body: int, bodies: Accelerations) -> Vec:
    """Return a body's angular acceleration in world axes."""
    return apply(motion.rotation(body), bodies[body][1]) if body >= 0 else ZERO_VECTOR


@dataclass(frozen=True)
class Direction:
    """A unit vector and its rate, in world axes."""

    vector: Vec
    rate: Vec

    @property
    def reversed(self) -> Direction:
        return Direction(negate(self.vector), negate(self.rate))

    def cross(self, other: Direction) -> Direction:
        """Return the vector product with another one, which is no unit vector, and its rate."""
        rate = add(cross(self.rate, other.vector), cross(self.vector, other.rate))
        return Direction(cross(self.vector, other.vector), rate)


@dataclass(frozen=True)
class Seen:
    """A point as a body sees it: how far it is from a frame's origin, its velocity and acceleration (world axes)."""

    distance: Vec
    velocity: Vec
    acceleration: Vec


def separation(motion: Motion, first: Marker, second: Marker) -> tuple[Vec, Vec]:
    """Return how far one marker is from another one (m), and the rate of that, in world axes."""
    away = subtract(position(motion, first), position(motion, second))
    return away, subtract(velocity(motion, first), velocity(motion, second))


def seen(motion: Motion, frame: Marker, point: Marker, bodies: Accelerations) -> Seen:
    """Return the motion of a marker relative to the body of a frame: v' = v - v_F - w x d, a' = a - a_F - ...."""
    w, alpha = angular_velocity(motion, frame.body), angular_acceleration(motion, frame.body, bodies)
    d = subtract(position(motion, point), position(motion, frame))
    v = subtract(subtract(velocity(motion, point), velocity(motion, frame)), cross(w, d))
    carried = add(cross(alpha, d), cross(w, add(cross(w, d), scale(2, v))))
    a = subtract(acceleration(motion, point, bodies), acceleration(motion, frame, bodies))
    return Seen(d, v, subtract(a, carried))


def slip_velocity(sliding: Sliding, velocity: Sequence[S], motion: Motion) -> list[S]:
    """Return what has the direction against which friction acts, by the velocity (m/s) along each row.

    What started from rest stops where this is zero, and not where the velocity is: there friction has no direction.
    """
    if sliding.starts is None:
        return list(velocity)
    return [v + STARTING * d for v, d in zip(velocity, motion.state.values(sliding.starts), strict=True)]
