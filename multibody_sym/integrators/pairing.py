"""How coordinates follow speeds: displacements along speeds, and their second derivatives where a ball turns.

A ball's displacement from orientation R_0 is the rotation vector phi in R = R_0 exp([phi]); with the body's angular
velocity w in its own axes and s = |phi|^2

    w = phi' - b phi x phi' + d phi x (phi x phi'),     b = (1 - cos |phi|) / s,   d = (|phi| - sin |phi|) / |phi|^3
    phi' = w + phi x w / 2 + c phi x (phi x w),         c = (1 - |phi|/2 cot(|phi|/2)) / s

Source: any text on rotation vectors; the series are those of the functions.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

Vector = tuple[float, float, float]

SERIES: Final = 0.5  # |phi|^2 below which series are summed
# |B_2k| / (2k)!: the series of c in s
C_SERIES: Final = (
    *(1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160),
    *(691 / 1307674368000, 1 / 74724249600, 3617 / 10670622842880000, 43867 / 5109094217170944000),
)
# (-1)^k / (2 k + 3)!: the series of d in s
D_SERIES: Final = (
    *(1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800, 1 / 1307674368000),
    *(-1 / 355687428096000, 1 / 121645100408832000),
)


@dataclass(frozen=True)
class Pairing:
    """Which speeds are rates of which coordinates, in x = (q, u) with nq coordinates.

    `plain`: pairs (a, b), q[a]' = u[b]; `balls`: pairs (a, b) of the first indices of a unit quaternion in q and of the
    body's angular velocity in u.
    """

    nq: int
    plain: tuple[tuple[int, int], ...]
    balls: tuple[tuple[int, int], ...] = ()

    @staticmethod
    def of_equals(n: int) -> Pairing:
        """Return the pairing of n coordinates with their n rates."""
        return Pairing(n, tuple((k, k) for k in range(n)))

    def moved(self, q: Floats, displacement: Floats) -> Floats:
        """Return the coordinates q after a displacement (nu,)."""
        new = q.copy()
        for a, b in self.plain:
            new[a] = q[a] + displacement[b]
        for a, b in self.balls:
            new[a : a + 4] = _turned(q[a : a + 4].tolist(), _vector(displacement, b))
        return new

    def displacement(self, q: Floats, other: Floats, nu: int) -> Floats:
        """Return the displacement (nu,) that leads from the coordinates q to the other ones."""
        found = np.zeros(nu)
        for a, b in self.plain:
            found[b] = other[a] - q[a]
        for a, b in self.balls:
            found[b : b + 3] = _rotation_vector(q[a : a + 4].tolist(), other[a : a + 4].tolist())
        return found

    def accelerations(self, displacement: Floats, u: Floats, udot: Floats) -> Floats:
        """Return the second derivatives (nu,) of displacements that have got this far, for speeds u with rates udot."""
        found = udot.copy()
        for _, b in self.balls:
            phi, w, wdot = _vector(displacement, b), _vector(u, b), _vector(udot, b)
            found[b : b + 3] = _second_derivative(phi, w, wdot)
        return found

    def speeds(self, displacement: Floats, rates: Floats) -> Floats:
        """Return the speeds (nu,) of displacements that have got this far and change at these rates."""
        found = rates.copy()
        for _, b in self.balls:
            found[b : b + 3] = _angular_velocity(_vector(displacement, b), _vector(rates, b))
        return found

    def farthest_turn(self, displacement: Floats) -> float:
        """Return the largest angle by which a ball is displaced."""
        return max((math.sqrt(_square(_vector(displacement, b))) for _, b in self.balls), default=0.0)


def _vector(values: Floats, first: int) -> Vector:
    return float(values[first]), float(values[first + 1]), float(values[first + 2])


def _square(v: Vector) -> float:
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _turned(q: list[float], phi: Vector) -> list[float]:
    """Return the quaternion q times that of the rotation vector phi."""
    angle = math.sqrt(_square(phi))
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    x, y, z = s * phi[0], s * phi[1], s * phi[2]
    return [
        q[0] * c - q[1] * x - q[2] * y - q[3] * z,
        q[0] * x + q[1] * c + q[2] * z - q[3] * y,
        q[0] * y - q[1] * z + q[2] * c + q[3] * x,
        q[0] * z + q[1] * y - q[2] * x + q[3] * c,
    ]


def _rotation_vector(q: list[float], p: list[float]) -> Vector:
    """Return the rotation vector of at most half a turn that leads from the quaternion q to p."""
    w = q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] * p[3]
    x = q[0] * p[1] - q[1] * p[0] - q[2] * p[3] + q[3] * p[2]
    y = q[0] * p[2] + q[1] * p[3] - q[2] * p[0] - q[3] * p[1]
    z = q[0] * p[3] - q[1] * p[2] + q[2] * p[1] - q[3] * p[0]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(sine, w) / sine if sine > 0.0 else 2.0
    return factor * x, factor * y, factor * z


def _coefficients(s: float) -> tuple[float, float]:
    """Return c and its derivative by s."""
    if s < SERIES:
        c = slope = 0.0
        for power in range(len(C_SERIES) - 1, -1, -1):
            c = c * s + C_SERIES[power]
        for power in range(len(C_SERIES) - 1, 0, -1):
            slope = slope * s + power * C_SERIES[power]
        return c, slope
    half = 0.5 * math.sqrt(s)
    sine, cotangent = math.sin(half), math.cos(half) / math.sin(half)
    c = (1.0 - half * cotangent) / s
    return c, ((half / (sine * sine) - cotangent) / (8.0 * half) - c) / s


def _sum(*terms: tuple[float, Vector]) -> Vector:
    """Return the sum of factors times vectors, added in their order."""
    x = y = z = 0.0
    for factor, v in terms:
        x, y, z = x + factor * v[0], y + factor * v[1], z + factor * v[2]
    return x, y, z


def _second_derivative(phi: Vector, w: Vector, wdot: Vector) -> Vector:
    """Return phi'' of a ball displaced by phi that turns at w with the acceleration wdot."""
    c, c_by_s = _coefficients(_square(phi))
    first = _cross(phi, w)
    second = _cross(phi, first)
    rate = _sum((1.0, w), (0.5, first), (c, second))
    change = 2.0 * c_by_s * _dot(phi, rate)
    twist = _sum((1.0, _cross(rate, w)), (1.0, _cross(phi, wdot)))
    return _sum((1.0, wdot), (0.5, twist), (change, second), (c, _cross(rate, first)), (c, _cross(phi, twist)))


def _angular_velocity(phi: Vector, rate: Vector) -> Vector:
    """Return the angular velocity of a ball displaced by phi whose rotation vector changes at `rate`."""
    s = _square(phi)
    angle = math.sqrt(s)
    sinc = math.sin(0.5 * angle) / (0.5 * angle) if angle > 0.0 else 1.0
    first = _cross(phi, rate)
    return _sum((1.0, rate), (-0.5 * sinc * sinc, first), (_d(s), _cross(phi, first)))


def _d(s: float) -> float:
    """Return (|phi| - sin |phi|) / |phi|^3."""
    if s >= SERIES:
        return (math.sqrt(s) - math.sin(math.sqrt(s))) / (s * math.sqrt(s))
    d = 0.0
    for coefficient in D_SERIES[::-1]:
        d = d * s + coefficient
    return d
