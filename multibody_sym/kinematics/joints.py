"""What each joint lets happen: rotation, position, free directions and their rates, over any scalar.

Frame F is fixed on the parent, frame M on the child; at zero coordinates they coincide. Vectors that describe the
motion of M relative to F are in M's axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

from multibody_sym.kinematics.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    scale,
)
from multibody_sym.model.elements import Fixed, Joint, Planar, Prismatic, Revolute, Spherical
from multibody_sym.scalars.functions import cos, sin


@dataclass(frozen=True)
class JointMotion:
    """The motion of M relative to F.

    `rotation` R_FM, `position` of M in F's axes; `linear[k]`, `angular[k]`: velocity and angular velocity of M for a
    unit speed u[k], in M's axes; `linear_bias`, `angular_bias`: what the derivatives of both contain besides udot
    (the linear one as an acceleration relative to F).
    """

    rotation: Mat
    position: Vec
    linear: tuple[Vec, ...]
    angular: tuple[Vec, ...]
    linear_bias: Vec = ZERO_VECTOR
    angular_bias: Vec = ZERO_VECTOR


@singledispatch
def motion(joint: Joint, axis: Vec, q: Sequence[S], u: Sequence[S]) -> JointMotion:
    """Return the joint's motion at coordinates `q` and speeds `u`; `axis` is its unit axis where it has one."""
    raise TypeError(f"no kinematics for {type(joint).__name__}")


@motion.register
def _(joint: Fixed, axis: Vec, q: Sequence[S], u: Sequence[S]) -> JointMotion:
    return JointMotion(UNIT_MATRIX, ZERO_VECTOR, (), ())


@motion.register
def _(joint: Revolute, axis: Vec, q: Sequence[S], u: Sequence[S]) -> JointMotion:
    return JointMotion(turned(axis, q[0]), ZERO_VECTOR, (ZERO_VECTOR,), (axis,))


@motion.register
def _(joint: Prismatic, axis: Vec, q: Sequence[S], u: Sequence[S]) -> JointMotion:
    return JointMotion(UNIT_MATRIX, scale(q[0], axis), (axis,), (ZERO_VECTOR,))


@motion.register
def _(joint: Planar, axis: Vec, q: Sequence[S], u: Sequence[S]) -> JointMotion:
    rotation = turned((0, 0, 1), q[2])
    x_axis, y_axis = rotation[0], rotation[1]  # rows of R_FM: F's axes in M
    return JointMotion(
        rotation,
        (q[0], q[1], 0),
        (x_axis, y_axis, ZERO_VECTOR),
        (ZERO_VECTOR, ZERO_VECTOR, (0, 0, 1)),
    )


@motion.register
def _(joint: Spherical, axis: Vec, q: Sequence[S], u: Sequence[S]) -> JointMotion:
    return JointMotion(quaternion_rotation(q), ZERO_VECTOR, (ZERO_VECTOR,) * 3, UNIT_MATRIX)


def turned(axis: Vec, angle: S) -> Mat:
    """Return the rotation by `angle` about a unit axis a (Rodrigues: a a^T + cos (E - a a^T) + sin [a])."""
    c, s = cos(angle), sin(angle)
    x, y, z = axis
    xy, xz, yz = x * y, x * z, y * z
    return (
        (x * x + c * (1 - x * x), xy - c * xy - s * z, xz - c * xz + s * y),
        (xy - c * xy + s * z, y * y + c * (1 - y * y), yz - c * yz - s * x),
        (xz - c * xz - s * y, yz - c * yz + s * x, z * z + c * (1 - z * z)),
    )


def quaternion_rotation(q: Sequence[S]) -> Mat:
    """Return the rotation of a quaternion (w first), normalised here: R = E + 2 (w [v] + [v]^2) / |q|^2."""
    w, x, y, z = q
    s = 2 / (w * w + x * x + y * y + z * z)
    return (
        (1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)),
    )


@singledispatch
def rates(joint: Joint, q: Sequence[S], u: Sequence[S]) -> tuple[S, ...]:
    """Return qdot = N(q) u of a joint."""
    return tuple(u)


@rates.register
def _(joint: Spherical, q: Sequence[S], u: Sequence[S]) -> tuple[S, ...]:
    """qdot = q * (0, omega) / 2 with omega in the child's axes (Wittenburg, section 2.1; Diebel 2006)."""
    w, x, y, z = q
    a, b, c = u
    return (
        -(x * a + y * b + z * c) / 2,
        (w * a + y * c - z * b) / 2,
        (w * b + z * a - x * c) / 2,
        (w * c + x * b - y * a) / 2,
    )
