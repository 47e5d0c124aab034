"""Rotations over any scalar: matrices of turns about axes, unit quaternions (w first) and their rates."""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.scalars.functions import absolute, cos, sin, sqrt
from multibody_sym.scalars.vectors import Mat, S, Vec, add, cross, dot, scale


def turned(axis: Vec, angle: S) -> Mat:
    """Return the rotation by `angle` about a unit axis a (Rodrigues: a a^T + cos (E - a a^T) + sin [a])."""
    return turned_by(axis, cos(angle), sin(angle))


def turned_by(axis: Vec, c: S, s: S) -> Mat:
    """Return the rotation about a unit axis by the angle with the cosine c and the sine s."""
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


def unit_quaternion(q: Sequence[S]) -> tuple[list[S], S]:
    """Return q / |q| and how much |q| deviates from 1."""
    w, x, y, z = q
    norm = sqrt(w**2 + x**2 + y**2 + z**2)
    return [part / norm for part in q], absolute(norm - 1)


def quaternion_rates(q: Sequence[S], w: Sequence[S]) -> tuple[S, ...]:
    """Return qdot = q * (0, omega) / 2 with omega in the turned axes (Diebel 2006, Representing Attitude)."""
    q0, x, y, z = q
    a, b, c = w
    return (
        -(x * a + y * b + z * c) / 2,
        (q0 * a + y * c - z * b) / 2,
        (q0 * b + z * a - x * c) / 2,
        (q0 * c + x * b - y * a) / 2,
    )


def quaternion_product(a: Sequence[S], b: Sequence[S]) -> tuple[S, S, S, S]:
    """Return a b: the rotation b followed, in the axes in which a is given, by a."""
    v = add(add(scale(a[0], b[1:]), scale(b[0], a[1:])), cross(a[1:], b[1:]))
    return (a[0] * b[0] - dot(a[1:], b[1:]), *v)


def conjugate(q: Sequence[S]) -> tuple[S, S, S, S]:
    """Return the quaternion of the opposite rotation."""
    return q[0], -q[1], -q[2], -q[3]
