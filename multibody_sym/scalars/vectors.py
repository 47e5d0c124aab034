"""Vectors of three and 3 x 3 matrices over any scalar, as tuples: small enough that names beat arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

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
