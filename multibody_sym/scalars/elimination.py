"""Elimination of many rows of which each has few elements: Householder QR of A^T within the profile, as `in_order.h`.

Rows are taken as they come, columns in the order in which rows first use them; work follows the profile, which of loops
in a chain grows as their number does. Rows that are zero are left out. Nothing is decided here: `rank` does that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats

Places = list[int]


@dataclass(frozen=True)
class _Row:
    """What elimination leaves of a row: entries of R from column `low` on, then the vector v of its reflection."""

    low: int
    high: int
    entries: Floats
    vector: Floats
    factor: float
    diagonal: float


@dataclass(frozen=True)
class Elimination:
    """The rows `kept` (k) of a matrix of so many `columns`, eliminated in `order`; the least part left of one."""

    columns: int
    kept: Places
    order: Places
    rows: list[_Row]
    least: float

    def least_norm(self, right: Floats) -> Floats:
        """Return the shortest x (n) with A x = r (s) over the rows that are kept."""
        x = np.zeros(self.columns)
        x[: len(self.rows)] = self._forward(right[self.kept])
        for k in range(len(self.rows) - 1, -1, -1):
            row = self.rows[k]
            x[k : row.high] -= row.factor * float(row.vector @ x[k : row.high]) * row.vector
        found = np.empty(self.columns)
        found[self.order] = x
        return found

    def grown(self, right: Floats) -> Floats:
        """Return (A A^T)^-1 r (k) over the rows that are kept."""
        rest, found = self._forward(right), np.zeros(len(self.rows))
        for k in range(len(self.rows) - 1, -1, -1):
            row = self.rows[k]
            found[k] = rest[k] / row.diagonal
            rest[row.low : k] -= row.entries * found[k]
        return found

    def _forward(self, right: Floats) -> Floats:
        """Return y = R^-T r."""
        y = np.zeros(len(self.rows))
        for k, row in enumerate(self.rows):
            y[k] = (right[k] - float(row.entries @ y[row.low : k])) / row.diagonal
        return y


def eliminate(matrix: Floats, clear: float) -> Elimination | None:
    """Return the elimination of a matrix (s x n); None where those before it leave of a row no more than that part."""
    used = matrix != 0.0
    kept = np.flatnonzero(used.any(axis=1)).tolist()
    first_use = np.where(used.any(axis=0), used.argmax(axis=0), len(matrix))
    order = np.argsort(first_use, kind="stable").tolist()
    found, highs, least = list[_Row](), list[int](), math.inf
    if len(kept) > matrix.shape[1]:
        return None
    for j, values in enumerate(matrix[np.ix_(kept, order)]):
        places = np.flatnonzero(values)
        first, end = int(places[0]), int(places[-1]) + 1
        low = min(int(np.searchsorted(highs, first, side="right")), first, j)
        high = max([end, j + 1, *highs[-1:]]) if low < j else max(end, j + 1)
        row, whole = values[:high].copy(), float(values[first:end] @ values[first:end])
        for k in range(low, j):
            before = found[k]
            row[k : before.high] -= before.factor * float(before.vector @ row[k : before.high]) * before.vector
        rest = float(row[j:] @ row[j:])
        if not rest > clear * clear * whole:
            return None
        least = min(least, math.sqrt(rest / whole))
        found.append(_reflection(row, low, j, math.sqrt(rest)))
        highs.append(high)
    return Elimination(matrix.shape[1], kept, order, found, least)


def _reflection(row: Floats, low: int, j: int, length: float) -> _Row:
    vector, first = row[j:].copy(), float(row[j])
    diagonal = -length if first > 0.0 else length
    vector[0] -= diagonal
    return _Row(low, len(row), row[low:j].copy(), vector, 1.0 / (length * (length + abs(first))), diagonal)


def blocks(matrix: Floats) -> Iterator[tuple[Places, Places]]:
    """Yield rows and columns of a matrix that no element joins with others; what is zero is in none."""
    of_row = [np.flatnonzero(row).tolist() for row in matrix]
    of_column = [np.flatnonzero(column).tolist() for column in matrix.T]
    seen = [not places for places in of_row]
    for begin in range(len(matrix)):
        if seen[begin]:
            continue
        rows, columns, waiting = list[int](), set[int](), [begin]
        seen[begin] = True
        while waiting:
            rows.append(waiting.pop())
            for column in of_row[rows[-1]]:
                if column not in columns:
                    columns.add(column)
                    waiting += [k for k in of_column[column] if not seen[k]]
                    for k in of_column[column]:
                        seen[k] = True
        yield sorted(rows), sorted(columns)


# ----------------------------------------------------------------------------------------------------------------------
# What rounding may make of a matrix, and eigenvalues without what rounding alone makes of them.
#
# A part of an eigenvalue is rounding where it is smaller than the change that the matrix's own rounding E can bring:
# to first order |y|^T |E| |x| / |y^H x| with the left and right eigenvectors y, x, which no choice of units changes,
# and no more than the square root of the rounding where two eigenvalues meet. Errors are first-order bounds: they
# exceed that square root where several eigenvalues meet. Source: G. H. Golub, C. F. Van Loan, Matrix Computations (4th
# ed. 2013), section 7.2.


_LARGEST: Final = 1e150
_SAFETY: Final = 8.0


def without_rounding(matrix: Floats, rounding: Floats) -> Floats:
    """Return a matrix with zeros where nothing but rounding stands, none of them negative."""
    return np.where(np.abs(matrix) <= rounding, 0.0, matrix) + 0.0


def least_rounding(matrix: Floats, rounding: Floats) -> Floats:
    """Return `rounding` (m x m), but no less than the last places of the matrix as a whole, in balanced units.

    Elements that cancel to zero at the few states at which rounding was looked at are rounding nevertheless.
    """
    if not matrix.size:
        return rounding
    balanced, scale = _balance(without_rounding(matrix, rounding))
    size = float(np.linalg.norm(balanced, 2))
    found: Floats = np.maximum(rounding, _SAFETY * EPSILON * size * scale[:, None] / scale[None, :])
    return found


def eigenvalues(matrix: Floats, rounding: Floats) -> tuple[npt.NDArray[np.complex128], Floats]:
    """Return the eigenvalues of a matrix (m x m) known up to `rounding` (m x m, not negative), and their errors.

    Real and imaginary parts that are rounding are zero. Raises FloatingPointError for a matrix past all bounds.
    """
    if not matrix.size:
        return np.zeros(0, dtype=complex), np.zeros(0)
    from scipy.linalg import eig  # scipy takes longer to import than most answers take

    balanced, scale = _balance(without_rounding(matrix, rounding))
    noise = rounding * scale[None, :] / scale[:, None]
    size = float(np.linalg.norm(balanced, 2))
    values, left, right = eig(balanced, left=True, right=True)
    moved = _first_order(left, right, noise + _SAFETY * EPSILON * size)
    uncertain = np.minimum(moved, np.sqrt(np.linalg.norm(noise + _SAFETY * EPSILON * size, 2) * size))
    real = np.where(np.abs(values.real) <= uncertain, 0.0, values.real)
    imaginary = np.where(np.abs(values.imag) <= uncertain, 0.0, values.imag)
    return real + 1j * imaginary + 0.0, np.minimum(moved, size)


def _balance(matrix: Floats) -> tuple[Floats, Floats]:
    """Return D^-1 A D of nearly equal rows and columns, and the diagonal of D. Raises FloatingPointError."""
    if not float(np.abs(matrix).max()) < _LARGEST:
        raise FloatingPointError("the matrix holds what is too large to compute with")
    from scipy.linalg import matrix_balance  # as above

    balanced, (scale, _) = matrix_balance(matrix, separate=True, permute=False)
    return balanced, scale


def _first_order(left: Floats, right: Floats, noise: Floats) -> Floats:
    """Return by how much noise moves each eigenvalue to first order, infinity where it has no bound."""
    overlap = np.abs(np.sum(left.conj() * right, axis=0))
    moved = np.einsum("ik,ij,jk->k", np.abs(left), noise, np.abs(right))
    found: Floats = np.divide(moved, overlap, out=np.full_like(moved, np.inf), where=overlap > 0.0)
    return found
