"""When the elements of a scan's arrays are read and written, and whether each is written before it is read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.program.progressions import Integers, Window
from multibody_sym.program.statements import Scan
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Access:
    """How an array's elements are used: by time (iterations counted through all loops), -1 and `never` if they are not.

    `read` first, `written` last, `stored` how often, `surely` behind no gate; `added` whether anything is added.
    """

    read: Integers
    written: Integers
    stored: Integers
    surely: npt.NDArray[np.bool_]
    added: npt.NDArray[np.bool_]

    def needs_zeros(self, result: bool) -> bool:
        """Whether an element is read or added to that may hold nothing; of a result all are read afterwards."""
        return bool((self.added | (((self.read < _NEVER) | result) & ~self.surely)).any())


_NEVER: Final = np.iinfo(np.int64).max


def accesses(scan: Scan) -> list[Access]:
    """Return the use of every array; raises IndexError where there is no such window or kernel."""
    found = [
        Access(np.full(n, _NEVER), np.full(n, -1), np.zeros(n, dtype=np.int64), *np.zeros((2, n), dtype=bool))
        for n in scan.sizes
    ]
    begun = 0
    for loop in scan.loops:
        if loop.gate is not None:
            every = np.arange(loop.count)
            np.minimum.at(found[loop.gate.array].read, _places(loop.gate, every, 1, found).ravel(), begun + every)
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
                    use.surely[where] = loop.gate is None
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
