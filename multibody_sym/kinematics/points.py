"""Points on bodies: position, velocity and acceleration in world axes."""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.kinematics.motion import Motion, spread
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.scalars.vectors import ZERO_VECTOR, Vec, add, apply, cross


def position(motion: Motion, marker: Marker) -> Vec:
    """Return a marker's position in world axes."""
    point = motion.point(marker)
    if marker.body < 0:
        return point
    R_WB, p_WB = motion.poses[marker.body]
    return add(p_WB, apply(R_WB, point))


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
