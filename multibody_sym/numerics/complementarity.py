"""Linear complementarity problems by Lemke's method: w = M z + q, 0 <= w, 0 <= z, w z = 0.

Ties of the ratio test are broken lexicographically, by rows of [B^-1 q, B^-1 p, B^-1] with a p without any pattern, so
that the method ends where rows depend on each other, which is normal where things rest on each other. (The first two
columns nearly always tell rows apart: q + epsilon p is not degenerate.) It ends on a ray
where it finds nothing; for a copositive M with the right q that proves that there is nothing.

Source: Cottle, Pang, Stone, The Linear Complementarity Problem (1992), 4.4, 4.9.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

TIED: Final = 1e-10
"""Ratios that differ by less than this part of their size are the same but for the rounding of some hundred pivots."""
SMALL: Final = 1e-10
"""Elements of a column below this part of its largest are what pivots have left of zeros: none of them is a pivot."""
PATTERN: Final = 7
"""Seed of the numbers that tell rows apart."""


@dataclass(frozen=True)
class Complementary:
    """z (n), and which z are basic (n; the w of the others are), or `ray`: nothing was found.

    `pivots` counts them; `spent` is true where there were more than allowed, which proves nothing.
    """

    z: Floats
    basic: NDArray[np.bool_]
    ray: bool
    pivots: int
    spent: bool = False


def lemke(matrix: Floats, right: Floats) -> Complementary:
    """Return a solution of w = M z + q, 0 <= w, 0 <= z, w z = 0 for M (n, n) and q (n), or the ray that Lemke ends on.

    M and q should be scaled: rows and columns of comparable size.
    """
    size = len(right)
    largest = float(np.abs(right).max(initial=0.0))
    if float(right.min(initial=0.0)) >= 0.0:
        return Complementary(np.zeros(size), np.zeros(size, dtype=bool), ray=False, pivots=0)
    tableau = _Tableau(matrix, right / largest)
    ray, spent = tableau.run()
    z, basic = tableau.solution()
    return Complementary(z * largest, basic, ray, tableau.pivots, spent)


class _Tableau:
    """B^-1 [q, p, E], kept as it is: the lexicographic order compares its rows. Columns are made where they enter.

    Variables by number: w_0..w_n-1, z_0..z_n-1, and the artificial one, number 2 n, whose column is a vector of ones.
    """

    def __init__(self, matrix: Floats, right: Floats) -> None:
        self.matrix, self.size, self.pivots = matrix, len(right), 0
        apart = np.random.default_rng(PATTERN).uniform(1.0, 2.0, self.size)
        self.rows = np.asfortranarray(np.column_stack([right, apart, np.eye(self.size)]))
        self.basis = np.arange(self.size)

    def run(self) -> tuple[bool, bool]:
        """Pivot until the artificial variable leaves; tell whether it ends on a ray, and whether it took too long."""
        artificial = 2 * self.size
        column = -np.ones(self.size)
        leaving = self._first(column, np.arange(self.size), -1.0)
        entering = artificial
        for _ in range(50 + 20 * self.size):
            left = int(self.basis[leaving])
            self._pivot(leaving, column)
            self.basis[leaving] = entering
            if left == artificial:
                return False, False
            entering = (left + self.size) % (2 * self.size)
            column = self._column(entering)
            candidates = np.flatnonzero(column > SMALL * max(1.0, float(np.abs(column).max())))
            if not len(candidates):
                return True, False
            leaving = self._first(column, candidates, 1.0)
        return True, True

    def solution(self) -> tuple[Floats, NDArray[np.bool_]]:
        z, basic = np.zeros(self.size), np.zeros(self.size, dtype=bool)
        held = (self.basis >= self.size) & (self.basis < 2 * self.size)
        z[self.basis[held] - self.size] = np.maximum(self.rows[held, 0], 0.0)
        basic[self.basis[held] - self.size] = True
        return z, basic

    def _column(self, variable: int) -> Floats:
        if variable < self.size:
            return self.rows[:, 2 + variable].copy()
        return np.asarray(-(self.rows[:, 2:] @ self.matrix[:, variable - self.size]), dtype=float)

    def _first(self, column: Floats, candidates: NDArray[np.intp], sense: float) -> int:
        """Return the candidate whose row, divided by its element of the column, comes first in lexicographic order.

        With sense -1 (where the artificial variable enters, and its column is -1) the order of the rows themselves.
        """
        ratios = self.rows[candidates, 0] / (sense * column[candidates])
        best = float(ratios.min())
        near = ratios <= best + TIED * max(1.0, abs(best))
        artificial = candidates[near & (self.basis[candidates] == 2 * self.size)]
        if len(artificial):
            return int(artificial[0])
        candidates = candidates[near]
        for first in range(1, self.rows.shape[1]):
            if len(candidates) == 1:
                break
            values = self.rows[candidates, first] / (sense * column[candidates])
            least = float(values.min())
            candidates = candidates[values <= least + TIED * max(1.0, abs(least))]
        return int(candidates[0])

    def _pivot(self, leaving: int, column: Floats) -> None:
        from scipy.linalg.blas import dger  # scipy takes longer to import than a run that needs no pivot

        row = self.rows[leaving] / column[leaving]
        column = column.copy()
        column[leaving] -= 1.0
        self.rows = dger(-1.0, column, row, a=self.rows, overwrite_a=1)
        self.pivots += 1
