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
    """Where the entries of a matrix of a shape stand: `places` that count row by row, in any order."""

    shape: tuple[int, int]
    places: Places

    @cached_property
    def order(self) -> Places:
        """The numbers of the entries row by row."""
        return np.argsort(self.places, kind="stable")

    @cached_property
    def rows(self) -> Places:
        """The row of each entry in this order."""
        return self.places[self.order] // max(self.shape[1], 1)

    @cached_property
    def columns(self) -> Places:
        """The column of each."""
        return self.places[self.order] % max(self.shape[1], 1)

    @cached_property
    def begins(self) -> Places:
        """The number of the first entry of each row, and how many entries there are."""
        return np.searchsorted(self.rows, np.arange(self.shape[0] + 1))

    @cached_property
    def is_small(self) -> bool:
        """Whether the matrix is kept whole."""
        return self.shape[0] * self.shape[1] <= _FEW


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
        found.reshape(-1)[self.pattern.places] = self.values
        return found

    def __getitem__(self, at: int | Sequence[int] | Places) -> Floats:
        """Return row number `at` (n,), or rows (k, n)."""
        if self.pattern.is_small:
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
        found: Floats = self.whole @ x if self.pattern.is_small else self.in_order(x)
        return found

    def in_order(self, x: Floats) -> Floats:
        """Return the product with a vector (n,), each sum added from left to right."""
        terms = self._entries * x[self.pattern.columns]
        found: Floats = np.bincount(self.pattern.rows, terms, minlength=self.pattern.shape[0]).astype(float)
        return found
