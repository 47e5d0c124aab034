"""Tensors turned into other axes: R T R^T in as few operations as the rotation allows, over any scalar."""

from __future__ import annotations

from multibody_sym.scalars.functions import is_exactly
from multibody_sym.scalars.vectors import Mat, S, apply, dot, product, symmetric, transpose


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
    e = s * (T[i][i] - T[j][j]) + c * _sum(T[i][j], T[j][i])
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


def _sum(a: S, b: S) -> S:
    return 2 * a if a is b else a + b
