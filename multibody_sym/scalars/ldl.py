"""M = L^T D L from the leaves to the root, over any scalar: no root, no inverse, and no fill-in along a tree.

Source: Featherstone, Rigid Body Dynamics Algorithms, section 6.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import S


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


def factorized(matrix: Sequence[Sequence[S]]) -> Factors:
    """Return the factors of a symmetric positive definite matrix (only its lower triangle is read)."""
    m = [list(row) for row in matrix]
    below: list[tuple[tuple[int, S], ...]] = [()] * len(m)
    for k in range(len(m) - 1, -1, -1):
        columns = [i for i in range(k) if not _is_zero(m[k][i])]
        factors = {i: m[k][i] / m[k][k] for i in columns}
        for i in columns:
            for j in columns:
                if j <= i:
                    m[i][j] = m[i][j] - factors[i] * m[k][j]
        below[k] = tuple(factors.items())
    return Factors(tuple(below), tuple(m[k][k] for k in range(len(m))))


def _is_zero(x: S) -> bool:
    return x is ZERO or (isinstance(x, int) and x == 0)
