"""Rows of a study: what was found of runs with consecutive numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

EVENTS, FAILURE = "events", "failure"
TEXTS = (EVENTS, FAILURE)
"""The columns of text: what happened on the way, and why there is no result."""


class Row(NamedTuple):
    """What was found of one run: numbers by name, its events, and the reason why it failed, if it did."""

    numbers: Mapping[str, float]
    events: str = ""
    failure: str = ""


@dataclass(frozen=True, eq=False)
class Rows:
    """Runs from number `first` on: `numbers` (count, names), nan where a run has none, and texts."""

    first: int
    names: tuple[str, ...]
    numbers: Floats
    texts: Mapping[str, Sequence[str]]

    @classmethod
    def of(cls, first: int, rows: Sequence[Row]) -> Rows:
        """Return rows one after the other; a name has a column where one of them has it."""
        found = [row.numbers for row in rows]
        names = tuple(dict.fromkeys(chain.from_iterable(found)))
        columns = [[numbers.get(name, math.nan) for numbers in found] for name in names]
        numbers = np.array(columns, dtype=float).T
        texts = {EVENTS: [row.events for row in rows], FAILURE: [row.failure for row in rows]}
        return cls(first, names, numbers.reshape(len(rows), len(names)), texts)

    def __len__(self) -> int:
        return len(self.numbers)

    def column(self, name: str) -> Floats:
        """Return a column (count,), nan where no row has it."""
        if name not in self.names:
            return np.full(len(self), np.nan)
        found: Floats = self.numbers[:, self.names.index(name)]
        return found


Span = tuple[int, int]
"""The first number of some runs, and that after the last."""


def missing(done: Sequence[Span], total: int) -> Iterator[Span]:
    """Yield what is left of the numbers from 0 to `total`; `done` spans do not overlap."""
    begin = 0
    for first, end in sorted(done):
        if first > begin:
            yield begin, first
        begin = end
    if begin < total:
        yield begin, total
