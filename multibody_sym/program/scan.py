"""Scan: kernels run over arrays in loops, so that a thousand like bodies cost the code of one.

A scan owns arrays that its loops fill. In each iteration one kernel reads *windows*, consecutive elements that begin
where a progression says, and stores its outputs in others or adds them there. What a tree needs is said with windows:
the parent's row is a window whose places are the parents', what children hand to their parent is added there, up the
tree is a loop whose places descend, and different kinds of bodies are several kernels among which a progression
chooses. As no element changes once it has been read, the values at the end are those that every kernel saw, and a
scan is differentiated backwards by running the kernels' adjoints over the same windows in the opposite order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.scalars.node import Node

if TYPE_CHECKING:
    from multibody_sym.program.program import Program

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
    return progression_through(np.arange(len(values)), np.asarray(values, dtype=np.int64))


def progression_through(places: Integers, values: Integers) -> Progression:
    """Return the progression of the shortest period that has `values` at `places` (ascending), whatever it has between.

    A long period is a table.
    """
    if not len(values):
        return Progression((0,))
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


@dataclass(frozen=True)
class Kernel:
    """A Program, with a window for each of its inputs and of its outputs."""

    program: Program
    reads: tuple[Window, ...]
    writes: tuple[Window, ...]


@dataclass(frozen=True)
class Loop:
    """`count` iterations; in iteration k kernel number `choice.at(k)` runs."""

    count: int
    kernels: tuple[Kernel, ...]
    choice: Progression = Progression((0,))

    def turns(self) -> Iterator[tuple[Kernel, Integers]]:
        """Yield each kernel with the iterations in which it runs; raises IndexError where there is no such kernel."""
        chosen = self.choice.values(self.count)
        if chosen.size and not (chosen.min() >= 0 and chosen.max() < len(self.kernels)):
            raise IndexError(f"a loop chooses among {len(self.kernels)} kernels one that is not there")
        for number, kernel in enumerate(self.kernels):
            yield kernel, np.nonzero(chosen == number)[0]


@dataclass(frozen=True, repr=False)
class Scan:
    """Run `loops` over arrays: `given` atoms, results (`targets`) and work space of the sizes `work`.

    Results and work space are zero at first.
    """

    given: tuple[tuple[Node, ...], ...]
    targets: tuple[tuple[Node, ...], ...]
    work: tuple[int, ...]
    loops: tuple[Loop, ...]

    @property
    def sizes(self) -> tuple[int, ...]:
        """The size of each array."""
        return (*map(len, self.given), *map(len, self.targets), *self.work)


@dataclass(frozen=True)
class Access:
    """How an array's elements are used: by time (iterations counted through all loops), -1 and `never` if they are not.

    `read` first, `written` last, `stored` how often; `added` whether anything is added.
    """

    read: Integers
    written: Integers
    stored: Integers
    added: npt.NDArray[np.bool_]

    @property
    def needs_zeros(self) -> bool:
        """Whether an element is read or added to that nothing was stored in."""
        return bool((self.added | ((self.read < _NEVER) & (self.stored == 0))).any())


_NEVER: Final = np.iinfo(np.int64).max


def accesses(scan: Scan) -> list[Access]:
    """Return the use of every array; raises IndexError where there is no such window or kernel."""
    found = [
        Access(np.full(n, _NEVER), np.full(n, -1), np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool))
        for n in scan.sizes
    ]
    begun = 0
    for loop in scan.loops:
        for kernel, iterations in loop.turns():
            times = begun + iterations
            for window, array in zip(kernel.reads, kernel.program.inputs, strict=True):
                where = _places(window, iterations, array.size, found)
                np.minimum.at(found[window.array].read, where.ravel(), np.repeat(times, array.size))
            for window, output in zip(kernel.writes, kernel.program.outputs, strict=True):
                size = len(output.values)
                where, use = _places(window, iterations, size, found), found[window.array]
                np.maximum.at(use.written, where.ravel(), np.repeat(times, size))
                if window.adds:
                    use.added[where] = True
                else:
                    np.add.at(use.stored, where.ravel(), 1)
        begun += loop.count
    return found


def _places(window: Window, iterations: Integers, size: int, found: Sequence[Access]) -> Integers:
    """Return the places (iterations, size) of a window."""
    if not 0 <= window.array < len(found):
        raise IndexError(f"there is no array {window.array}")
    where = window.first.values(int(iterations[-1]) + 1 if len(iterations) else 0)[iterations, None] + np.arange(size)
    if where.size and not (where.min() >= 0 and where.max() < len(found[window.array].read)):
        raise IndexError(f"a window reaches beyond array {window.array}")
    return where


def conflict(scan: Scan) -> str:
    """Return what contradicts the rule that elements are stored once, or added to, before they are read, or ''."""
    for number, use in enumerate(accesses(scan)):
        if number < len(scan.given) and (use.written >= 0).any():
            return f"array {number} is given and written"
        if (use.stored > 1).any() or ((use.stored == 1) & use.added).any():
            return f"an element of array {number} is stored twice"
        if (use.written >= use.read).any():
            return f"an element of array {number} is written after it is read"
    return ""


def reversed_progression(given: Progression, count: int) -> Progression:
    """Return the first `count` numbers of a progression, last first."""
    return progression(given.values(count)[::-1])
