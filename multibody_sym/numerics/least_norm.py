"""The rank-revealing solve of A x = r by Householder QR: the reference that `solve.c` repeats.

The text of this file stands in exported Python, and imports NumPy and the standard library only.
"""

from __future__ import annotations

import math

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import CLEAR, TIE, exact, scaled_rows
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Solution:
    """What `solve` returns: x (n), multipliers (s), and the report (rank, conditioning, residual)."""

    solution: Floats
    multipliers: Floats
    report: Floats


@dataclass(frozen=True)
class _Factors:
    """Householder vectors and triangular factor of the kept rows, in `rows` (s x n, one row of A each) and `diagonal`.

    `order[k]` is the row kept k-th; row `order[j]` holds R[k, j] in entry k < min(j, rank) and, where it was kept, the
    vector of reflection j from entry j on. Reflection k is E - factors[k] v v^T.
    """

    rows: Floats
    order: list[int]
    diagonal: list[float]
    factors: list[float]

    @property
    def rank(self) -> int:
        return len(self.diagonal)


@np.errstate(all="ignore")
def solve(matrix: Floats, right: Floats, most: float = math.inf) -> Solution:
    """Return the minimum-norm x with A x = r and the multipliers lambda with x = A^T lambda.

    The rows of A, scaled to unit length, are the columns of A^T = Q R P^T. They are taken as they come where at least
    1e-6 of each is left by those before it. Else the longest remaining column becomes the pivot at each step (ties: the
    row declared first) until none exceeds 100 eps max(n, s) |R_11|. Then x = Q R^-T r and R lambda = R^-T r, over the
    kept rows. Dependent rows take no part: their multipliers are zero, and x is the least
    squares solution as well whenever they agree with the kept ones. No more than `most` rows are kept: rows that depend
    on each other only in positions that satisfy them are independent beside such a position, by rounding.

    Arguments: matrix A (s, n), right r (s,). Returns x (n,), lambda (s,) and the report (3,): the rank; the smallest
    part of a kept row that those before it leave, relative to the longest of them (0 if there is none), which vanishes
    with a row, and where one becomes dependent; the largest |A x - r| of a dependent row relative to the largest |r|,
    both in rows of unit length (a zero row is as long as the longest). Everything is nan if A or r is not finite.
    Source: Businger, Golub, Linear least squares solutions by Householder transformations, Numer. Math. 7 (1965).
    """
    count, size = matrix.shape
    scale, rows = scaled_rows(matrix)
    if not (np.isfinite(scale).all() and np.isfinite(right).all()):
        return Solution(np.full(size, math.nan), np.full(count, math.nan), np.full(3, math.nan))
    factors = _in_order(rows.copy()) if count <= min(size, most) else None
    if factors is None:
        factors = _longest_first(rows, exact(matrix), most)
    scaled_right = right / scale
    halfway = _forward(factors, scaled_right)
    multipliers = _backward(factors, halfway) / scale
    return Solution(_rotated(factors, halfway, size), multipliers, _report(factors, scale, scaled_right, halfway))


def independent_rows(matrix: Floats, most: float = math.inf) -> list[int]:
    """Return which rows of a finite matrix (s, n) are independent, the longest taken first, in increasing order."""
    factors = _longest_first(scaled_rows(matrix)[1], exact(matrix), most)
    return sorted(factors.order[: factors.rank])


def _in_order(rows: Floats) -> _Factors | None:
    """Return the factors of the rows as they come, None where one of them might depend on those before it."""
    factors = _Factors(rows, list(range(len(rows))), [], [])
    for k, row in enumerate(rows):
        length = math.sqrt(float(row[k:] @ row[k:]))
        if not length > CLEAR:
            return None
        _reflect(factors, k, length)
    return factors


def _longest_first(rows: Floats, tolerance: float, most: float) -> _Factors:
    order = list(range(rows.shape[0]))
    factors = _Factors(rows, order, [], [])
    for k in range(min(rows.shape)):
        lengths = [math.sqrt(float(rows[j, k:] @ rows[j, k:])) for j in order[k:]]
        first = abs(factors.diagonal[0]) if k else max(lengths)
        if max(lengths) <= tolerance * first or k >= most:
            break
        chosen = next(i for i, length in enumerate(lengths) if length >= (1.0 - TIE) * max(lengths))
        order.insert(k, order.pop(k + chosen))
        _reflect(factors, k, lengths[chosen])
    return factors


def _reflect(factors: _Factors, k: int, length: float) -> None:
    """Turn the pivot's remaining part onto the k-th axis, and with it that of every row still to come."""
    rows, pivot = factors.rows, factors.order[k]
    first = float(rows[pivot, k])
    diagonal = -length if first > 0.0 else length
    factors.diagonal.append(diagonal)
    factors.factors.append(1.0 / (length * (length + abs(first))))
    rows[pivot, k] = first - diagonal
    vector = rows[pivot, k:]
    for j in factors.order[k + 1 :]:
        rows[j, k:] -= factors.factors[k] * float(vector @ rows[j, k:]) * vector


def _forward(factors: _Factors, right: Floats) -> Floats:
    """Solve R^T y = r over the kept rows."""
    y = np.zeros(factors.rank)
    for k, diagonal in enumerate(factors.diagonal):
        row = factors.order[k]
        y[k] = (right[row] - factors.rows[row, :k] @ y[:k]) / diagonal
    return y


def _backward(factors: _Factors, y: Floats) -> Floats:
    """Solve R lambda = y; the multipliers of rows that were not kept are zero."""
    multipliers = np.zeros(len(factors.order))
    rest = y.copy()
    for k in reversed(range(factors.rank)):
        row = factors.order[k]
        multipliers[row] = rest[k] / factors.diagonal[k]
        rest[:k] -= factors.rows[row, :k] * multipliers[row]
    return multipliers


def _rotated(factors: _Factors, y: Floats, size: int) -> Floats:
    """Return Q (y, 0)."""
    x = np.zeros(size)
    x[: factors.rank] = y
    for k in reversed(range(factors.rank)):
        vector = factors.rows[factors.order[k], k:]
        x[k:] -= factors.factors[k] * float(vector @ x[k:]) * vector
    return x


def _report(factors: _Factors, lengths: Floats, right: Floats, y: Floats) -> Floats:
    rank = factors.rank
    kept = lengths[factors.order[:rank]].tolist()
    least = min(abs(d) * length for d, length in zip(factors.diagonal, kept, strict=True)) / max(kept) if rank else 0.0
    largest = float(np.abs(right).max(initial=0.0))
    residual = max((abs(right[j] - factors.rows[j, :rank] @ y) for j in factors.order[rank:]), default=0.0)
    return np.array([float(rank), least, residual / largest if largest else 0.0])


def solve_lists(
    matrix: list[list[float]], right: list[float], columns: int, most: float
) -> tuple[list[float], list[float], list[float]]:
    """Return what `solve` does, solution, multipliers and report, for lists: s rows of `columns` numbers, and s."""
    found = solve(np.array(matrix, dtype=float).reshape(len(right), columns), np.array(right, dtype=float), most)
    return found.solution.tolist(), found.multipliers.tolist(), found.report.tolist()
