"""Compiled functions called for one state without delay, or for many in C, on threads."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate, pairwise
from threading import Event
from typing import Any, Final

import numpy as np

from multibody_sym.program.native import NativeFunction
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_PIECE: Final = 0.02
"""Seconds that a piece of a batch takes, after which Ctrl-C is heard."""
_FIRST: Final = 64
"""States in the first piece of a batch, whose time decides how long the others are."""


@dataclass(frozen=True, eq=False)
class Door:
    """Arguments and results of a call, where its C function finds them."""

    arrays: Mapping[str, Floats]
    outputs: Floats
    given: Any
    results: Any
    run: Callable[..., None]

    @staticmethod
    def of(function: NativeFunction, parameters: Floats) -> Door:
        arrays = {name: np.zeros(math.prod(shape)) for name, shape in function.signature.inputs}
        arrays["parameters"][:] = parameters
        sizes = function.signature.sizes("outputs")
        outputs = np.empty(sum(sizes))
        starts = accumulate(sizes[:-1], initial=0)
        given = (ctypes.c_void_p * len(arrays))(*[array.ctypes.data for array in arrays.values()])
        results = (ctypes.c_void_p * len(sizes))(*[outputs.ctypes.data + 8 * k for k in starts])
        return Door(arrays, outputs, given, results, function._function)


def run_many(function: Any, inputs: list[Floats], outputs: list[Floats], count: int | None, threads: int) -> None:
    """Run a function for one state or n, in `threads`; Ctrl-C ends it within a few hundredths of a second."""
    if count is None or not isinstance(function, NativeFunction):
        t, *rest = inputs
        found: Sequence[Floats] = ()
        if count is None:
            found = function(*inputs)
        elif count:
            found = function.map(np.full(count, t) if t.ndim == 0 else t, *rest)
        for array, values in zip(outputs, found, strict=bool(found)):
            array[...] = values
        return
    batch = _Batch(function, inputs, outputs)
    if threads <= 1 or count < 2 * _FIRST:
        batch.run(0, count, Event())
        return
    ends = np.linspace(0, count, threads + 1).astype(int).tolist()
    stop = Event()
    with ThreadPoolExecutor(threads) as pool:
        parts = [pool.submit(batch.run, a, b, stop) for a, b in pairwise(ends)]
        try:
            for part in parts:
                part.result()
        except BaseException:
            stop.set()
            raise


@dataclass(frozen=True, eq=False)
class _Batch:
    """A function in C with arrays for many states."""

    function: NativeFunction
    inputs: list[Floats]
    outputs: list[Floats]

    def run(self, first: int, last: int, stop: Event) -> None:
        """Run the states from `first` to `last`, piece by piece, until told to stop."""
        size = min(_FIRST, last - first)
        while first < last and not stop.is_set():
            begun = time.perf_counter()
            self._piece(first, size)
            took = max(time.perf_counter() - begun, 1e-6)
            first += size
            size = min(max(int(size * _PIECE / took), 1), last - first)

    def _piece(self, first: int, count: int) -> None:
        signature, library = self.function.signature, self.function.library
        changing = [x.ndim > len(shape) for x, (_, shape) in zip(self.inputs, signature.inputs, strict=True)]
        sizes = zip(self.inputs, signature.sizes("inputs"), changing, strict=True)
        given = [x.ctypes.data + 8 * first * size * many for x, size, many in sizes]
        results = [x.ctypes.data + 8 * first * n for x, n in zip(self.outputs, signature.sizes("outputs"), strict=True)]
        library.mbs_map(
            ctypes.byref(self.function.structure),
            ctypes.c_longlong(count),
            (ctypes.c_void_p * len(given))(*given),
            (ctypes.c_int * len(changing))(*changing),
            (ctypes.c_void_p * len(results))(*results),
        )
