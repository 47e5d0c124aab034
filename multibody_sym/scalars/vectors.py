"""Vectors of three and 3 x 3 matrices over any scalar, as tuples: small enough that names beat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Final

from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, cos, is_exactly, less, sin, sqrt, where
from multibody_sym.scalars.node import ZERO

S = Any
"""A scalar: float, Node or sympy.Expr (plain integers are welcome)."""
Vec = tuple[S, S, S]
Mat = tuple[Vec, Vec, Vec]

ZERO_VECTOR: Final[Vec] = (0, 0, 0)
UNIT_MATRIX: Final[Mat] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


def add(a: Sequence[S], b: Sequence[S]) -> Vec:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Sequence[S], b: Sequence[S]) -> Vec:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def negate(a: Sequence[S]) -> Vec:
    """Return -a."""
    return -a[0], -a[1], -a[2]


def scale(k: S, a: Sequence[S]) -> Vec:
    """Return k a."""
    return k * a[0], k * a[1], k * a[2]


def dot(a: Sequence[S], b: Sequence[S]) -> S:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[S], b: Sequence[S]) -> Vec:
    """Return a x b."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def combination(vectors: Sequence[Vec], factors: Sequence[S]) -> Vec:
    """Return the sum of factors[k] vectors[k]."""
    total: Vec = ZERO_VECTOR
    for vector, factor in zip(vectors, factors, strict=True):
        total = add(total, scale(factor, vector))
    return total


def apply(m: Mat, a: Sequence[S]) -> Vec:
    """Return M a."""
    if m is UNIT_MATRIX:
        return a[0], a[1], a[2]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = m
    x, y, z = a
    return xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z


def apply_transposed(m: Mat, a: Sequence[S]) -> Vec:
    """Return M^T a."""
    if m is UNIT_MATRIX:
        return a[0], a[1], a[2]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = m
    x, y, z = a
    return xx * x + yx * y + zx * z, xy * x + yy * y + zy * z, xz * x + yz * y + zz * z


def transpose(m: Mat) -> Mat:
    """Return M^T."""
    if m is UNIT_MATRIX:
        return m
    return (m[0][0], m[1][0], m[2][0]), (m[0][1], m[1][1], m[2][1]), (m[0][2], m[1][2], m[2][2])


def product(a: Mat, b: Mat) -> Mat:
    """Return A B."""
    if a is UNIT_MATRIX:
        return b
    if b is UNIT_MATRIX:
        return a
    return apply_transposed(b, a[0]), apply_transposed(b, a[1]), apply_transposed(b, a[2])


def matrix_sum(a: Mat, b: Mat) -> Mat:
    """Return A + B."""
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


def symmetric(elements: Sequence[S]) -> Mat:
    """Return the symmetric matrix with the elements (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = elements
    return (xx, xy, xz), (xy, yy, yz), (xz, yz, zz)


def steiner(a: Vec, b: Vec) -> Mat:
    """Return -[a][b] = (a . b) E - b a^T."""
    d = dot(a, b)
    return (
        (d - b[0] * a[0], -(b[0] * a[1]), -(b[0] * a[2])),
        (-(b[1] * a[0]), d - b[1] * a[1], -(b[1] * a[2])),
        (-(b[2] * a[0]), -(b[2] * a[1]), d - b[2] * a[2]),
    )


# ----------------------------------------------------------------------------------------------------------------------
# Rotations over any scalar: matrices of turns about axes, unit quaternions (w first) and their rates.


def rotation_about(axis: Vec, angle: S) -> Mat:
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


def rotation_quaternion(R: Mat) -> list[S]:
    """Return the unit quaternion (w first, not negative) of a rotation, by its largest element (Shepperd 1978)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R
    rows = [  # 4 q q^T
        [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1 + xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, 1 - xx + yy - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, 1 - xx - yy + zz],
    ]
    found, square = rows[0], rows[0][0]
    for k in range(1, 4):
        larger = less(square, rows[k][k])
        found = [where(larger, a, b) for a, b in zip(rows[k], found, strict=True)]
        square = where(larger, rows[k][k], square)
    size = 2 * where(less(found[0], 0), -1, 1) * sqrt(square)
    return [x / size for x in found]


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


# ----------------------------------------------------------------------------------------------------------------------
# Tensors turned into other axes: R T R^T in as few operations as the rotation allows, over any scalar.


def turned_tensor(R: Mat, T: Mat) -> Mat:
    """Return R T R^T."""
    axis = _coordinate_axis(R)
    if axis is None:
        return product(product(R, T), transpose(R))
    return _turned_about(axis, R, T)


def turned_symmetric(R: Mat, T: Mat) -> Mat:
    """Return R T R^T of a symmetric tensor (only its lower triangle is read), each element formed once."""
    full = lower_triangle(T)
    axis = _coordinate_axis(R)
    if axis is not None:
        return lower_triangle(_turned_about(axis, R, full))
    half = [apply(full, row) for row in R]
    return symmetric([dot(R[i], half[j]) for i, j in _TRIANGLE])


def lower_triangle(T: Mat) -> Mat:
    """Return the symmetric matrix of a lower triangle."""
    return symmetric([T[i][j] for i, j in _TRIANGLE])


_TRIANGLE = ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1))


def _coordinate_axis(R: Mat) -> int | None:
    """Return k where R turns about coordinate axis k, as its zeros and its one say."""
    for k in range(3):
        if is_exactly(R[k][k], 1) and all(is_exactly(R[k][j], 0) and is_exactly(R[j][k], 0) for j in _others(k)):
            return k
    return None


def _turned_about(k: int, R: Mat, T: Mat) -> Mat:
    """Return R T R^T for the rotation by an angle with sine s and cosine c about coordinate axis k.

    With i, j, k in cyclic order and e = s (T_ii - T_jj) + c (T_ij + T_ji): T_ii - s e, T_jj + s e, c e - T_ji and
    c e - T_ij stand for T_ii, T_jj, T_ij and T_ji.
    """
    i, j = _others(k)
    c, s = R[i][i], R[j][i]
    across = 2 * T[i][j] if T[i][j] is T[j][i] else T[i][j] + T[j][i]
    e = s * (T[i][i] - T[j][j]) + c * across
    change, other = s * e, c * e
    turned = {
        (i, i): T[i][i] - change,
        (j, j): T[j][j] + change,
        (i, j): other - T[j][i],
        (j, i): other - T[i][j],
        (i, k): c * T[i][k] - s * T[j][k],
        (j, k): s * T[i][k] + c * T[j][k],
        (k, i): c * T[k][i] - s * T[k][j],
        (k, j): s * T[k][i] + c * T[k][j],
        (k, k): T[k][k],
    }
    rows = [(turned[r, 0], turned[r, 1], turned[r, 2]) for r in range(3)]
    return rows[0], rows[1], rows[2]


def _others(k: int) -> tuple[int, int]:
    return (k + 1) % 3, (k + 2) % 3


# ----------------------------------------------------------------------------------------------------------------------
# M = L^T D L from the leaves to the root, over any scalar: no root, no inverse, and no fill-in along a tree.
#
# Source: Featherstone, Rigid Body Dynamics Algorithms, section 6.5.


@dataclass(frozen=True)
class Factors:
    """M = L^T D L: `below[k]` holds the non-zero L[k][i], i < k (the diagonal is 1), `pivots` D (n)."""

    below: tuple[tuple[tuple[int, S], ...], ...]
    pivots: tuple[S, ...]

    def solve(self, right: Sequence[S]) -> list[S]:
        """Return M^-1 right (n)."""
        scaled = [x / d for x, d in zip(self.from_right(right), self.pivots, strict=True)]
        return self.to_left(scaled)

    def from_right(self, right: Sequence[S]) -> list[S]:
        """Return L^-T right (n)."""
        x = list(right)
        for k in range(len(x) - 1, -1, -1):
            for i, factor in self.below[k] if x[k] is not ZERO else ():
                x[i] = x[i] - factor * x[k]
        return x

    def to_left(self, x: Sequence[S]) -> list[S]:
        """Return L^-1 x (n)."""
        y = list(x)
        for k in range(len(y)):
            for i, factor in self.below[k]:
                y[k] = y[k] - factor * y[i]
        return y

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return D^-1/2 L^-T right (n): forces in the coordinates in which the mass matrix is the unit matrix."""
        found = zip(self.from_right(right), self._roots, strict=True)
        return [x if x is ZERO else x * root for x, root in found]

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return L^-1 D^-1/2 x (n): accelerations from those coordinates."""
        return self.to_left([value * root for value, root in zip(x, self._roots, strict=True)])

    @cached_property
    def _roots(self) -> list[S]:
        return [1 / sqrt(d) for d in self.pivots]


def factorize(matrix: Sequence[Sequence[S]]) -> Factors:
    """Return the factors of a symmetric positive definite matrix (only its lower triangle is read)."""
    m = [list(row) for row in matrix]
    below: list[tuple[tuple[int, S], ...]] = [()] * len(m)
    for k in range(len(m) - 1, -1, -1):
        columns = [i for i in range(k) if not (m[k][i] is ZERO or (isinstance(m[k][i], int) and m[k][i] == 0))]
        factors = {i: m[k][i] / m[k][k] for i in columns}
        for i in columns:
            for j in columns:
                if j <= i:
                    m[i][j] = m[i][j] - factors[i] * m[k][j]
        below[k] = tuple(factors.items())
    return Factors(tuple(below), tuple(m[k][k] for k in range(len(m))))
