"""Progressions of integers, and the windows on arrays whose places they give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.records import dataclass

Integers = npt.NDArray[np.int64]
_LONGEST_PERIOD: Final = 64


@dataclass(frozen=True)
class Progression:
    """Integers `pattern[k % p] + step * (k // p)`, p = len(pattern): constant, arithmetic, periodic, or any table."""

    pattern: tuple[int, ...]
    step: int = 0

    def at(self, k: int) -> int:
        """Return number k."""
        turns, place = divmod(k, len(self.pattern))
        return self.pattern[place] + self.step * turns

    def values(self, count: int) -> Integers:
        """Return the first `count` numbers."""
        k = np.arange(count)
        return np.array(self.pattern, dtype=np.int64)[k % len(self.pattern)] + self.step * (k // len(self.pattern))


def progression(values: Sequence[int] | Integers) -> Progression:
    """Return the progression of the shortest period that begins with `values`; a long period is a table."""
    array = np.asarray(values, dtype=np.int64)
    listed = array.tolist()
    for period in range(1, min(len(listed), _LONGEST_PERIOD + 1)):
        step = listed[period] - listed[0]
        if listed[-1] - listed[-1 - period] == step and (array[period:] - array[:-period] == step).all():
            return Progression(tuple(listed[:period]), step)
    return Progression(tuple(listed) or (0,))


def progression_through(places: Integers, values: Integers) -> Progression:
    """Return the progression of the shortest period that has `values` at `places` (ascending), whatever it has between.

    A long period is a table.
    """
    if len(places) == 0 or places[-1] == len(places) - 1:
        return progression(values)
    for period in range(1, _LONGEST_PERIOD + 1):
        turns, residues = np.divmod(places, period)
        order = np.argsort(residues, kind="stable")
        alike = np.nonzero(np.diff(residues[order]) == 0)[0]
        first, next_one = order[alike[:1]], order[alike[:1] + 1]
        step = int(((values[next_one] - values[first]) // (turns[next_one] - turns[first])).sum())
        pattern = np.zeros(period, dtype=np.int64)
        pattern[residues] = values - step * turns
        if (pattern[residues] + step * turns == values).all():
            return Progression(tuple(pattern.tolist()), step)
    table = np.zeros(places[-1] + 1, dtype=np.int64)
    table[places] = values
    return Progression(tuple(table.tolist()))


@dataclass(frozen=True)
class Window:
    """The elements from `first` on of array number `array`; a kernel's output is stored there, or added if it `adds`.

    Arrays count from the given ones on to the results and to those that only work.
    """

    array: int
    first: Progression
    adds: bool = False


def reversed_progression(given: Progression, count: int) -> Progression:
    """Return the first `count` numbers of a progression, last first."""
    return progression(given.values(count)[::-1])
