"""Matrices of which few entries differ from zero: rows of them, and products with vectors."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

Places = NDArray[np.intp]
_FEW: Final = 4096
"""Entries of a matrix, zeros too, up to which it is kept whole."""


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the entries of a matrix of a shape stand, row by row.

    Those of row j are numbers begins[j] up to begins[j + 1]; each is in one of the `columns`, and number `order` of
    those that are given.
    """

    shape: tuple[int, int]
    begins: Places
    columns: Places
    order: Places

    @staticmethod
    def of(shape: tuple[int, int], places: Places) -> Pattern:
        """Return the pattern of entries whose places count row by row."""
        order = np.argsort(places, kind="stable")
        rows, columns = np.divmod(places[order], max(shape[1], 1))
        return Pattern(shape, np.searchsorted(rows, np.arange(shape[0] + 1)), columns, order)

    @cached_property
    def rows(self) -> Places:
        """The row of each entry."""
        return np.repeat(np.arange(self.shape[0]), np.diff(self.begins))


@dataclass(frozen=True, eq=False)
class SparseRows:
    """A matrix of a pattern, whose entries are `values` as they were given."""

    pattern: Pattern
    values: Floats

    @cached_property
    def _entries(self) -> Floats:
        """The entries row by row."""
        found: Floats = self.values[self.pattern.order]
        return found

    @cached_property
    def whole(self) -> Floats:
        """The matrix with its zeros."""
        found = np.zeros(self.pattern.shape)
        found[self.pattern.rows, self.pattern.columns] = self._entries
        return found

    @property
    def _is_small(self) -> bool:
        return self.pattern.shape[0] * self.pattern.shape[1] <= _FEW

    def __getitem__(self, at: int | Sequence[int] | Places) -> Floats:
        """Return row number `at` (n,), or rows (k, n)."""
        if self._is_small:
            small: Floats = self.whole[at]
            return small
        if isinstance(at, (int, np.integer)):
            row: Floats = self[[int(at)]][0]
            return row
        rows = np.asarray(at, dtype=np.intp)
        first = self.pattern.begins[rows]
        counts = self.pattern.begins[rows + 1] - first
        ends = np.cumsum(counts)
        read = np.repeat(first - ends + counts, counts) + np.arange(ends[-1] if len(ends) else 0)
        found = np.zeros((len(rows), self.pattern.shape[1]))
        found[np.repeat(np.arange(len(rows)), counts), self.pattern.columns[read]] = self._entries[read]
        return found

    def block(self, at: Places) -> Floats:
        """Return what rows at some places have in the columns there (k, k)."""
        return self[at][:, at] if len(self.values) else np.zeros((len(at), len(at)))

    def __matmul__(self, x: Floats) -> Floats:
        """Return the product with a vector (n,)."""
        found: Floats = self.whole @ x if self._is_small else self.in_order(x)
        return found

    def in_order(self, x: Floats) -> Floats:
        """Return the product with a vector (n,), each sum added from left to right."""
        terms = self._entries * x[self.pattern.columns]
        found: Floats = np.bincount(self.pattern.rows, terms, minlength=self.pattern.shape[0]).astype(float)
        return found
