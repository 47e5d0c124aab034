"""The C side seen from Python: structures of runtime.h, the programs of a shared library, and how to call them."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cached_property
from itertools import accumulate, pairwise
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.program.runtime_constants import DOUBLED, PASSED
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import floats

if TYPE_CHECKING:
    from multibody_sym.program.program import Program

# ----------------------------------------------------------------------------------------------------------------------
# What a loaded program takes and returns, and arrays arranged accordingly.


Shaped = tuple[tuple[str, tuple[int, ...]], ...]


@dataclass(frozen=True)
class Signature:
    """The name of a program and the names and shapes of its inputs and outputs; shape () is a scalar."""

    program: str
    inputs: Shaped
    outputs: Shaped

    @staticmethod
    def of(name: str, program: Program) -> Signature:
        """Return the signature of `program`, which is known as `name`."""
        inputs = tuple((array.name, array.shape) for array in program.inputs)
        return Signature(name, inputs, tuple((output.name, output.shape) for output in program.outputs))

    @staticmethod
    def from_json(entry: Any) -> Signature:
        """Return the signature that `as_json` wrote; raises KeyError, TypeError or ValueError for anything else."""
        inputs, outputs = (
            tuple((str(name), tuple(map(int, shape))) for name, shape in entry[side]) for side in ("inputs", "outputs")
        )
        return Signature(str(entry["program"]), inputs, outputs)

    def as_json(self) -> dict[str, Any]:
        """Return the signature as JSON values."""
        return {"program": self.program, "inputs": self.inputs, "outputs": self.outputs}

    def sizes(self, side: str) -> list[int]:
        """Return the sizes of the `inputs` or `outputs`."""
        return [math.prod(shape) for _, shape in getattr(self, side)]

    def arranged(self, arrays: Sequence[ArrayLike]) -> list[Floats]:
        """Return the inputs as contiguous arrays of floats; raises ValueError where number or shape differ."""
        self._require_number(arrays)
        result = []
        for (name, shape), array in zip(self.inputs, arrays, strict=True):
            values = np.asarray(floats(name, array), order="C")
            if values.shape != shape:
                raise ValueError(f"{self.program}: {name} has the shape {values.shape}, not {shape}")
            result.append(values)
        return result

    def stacked(self, arrays: Sequence[ArrayLike]) -> tuple[int, list[Floats], list[bool]]:
        """Return the number of samples, the inputs as contiguous arrays, and which of them change with the sample.

        Those have one axis in front of their own; the others are the same for all samples. Raises ValueError.
        """
        self._require_number(arrays)
        values = [np.asarray(floats(self.program, array), order="C") for array in arrays]
        changing = [v.ndim == len(shape) + 1 for v, (_, shape) in zip(values, self.inputs, strict=True)]
        for v, many, (name, shape) in zip(values, changing, self.inputs, strict=True):
            if v.shape[many:] != shape:
                raise ValueError(f"{self.program}: {name} has the shape {v.shape}, not {shape} or (samples, *{shape})")
        counts = {len(v) for v, many in zip(values, changing, strict=True) if many}
        if len(counts) != 1:
            raise ValueError(f"{self.program}: the inputs have {sorted(counts)} samples, not one number of them")
        return counts.pop(), values, changing

    def _require_number(self, arrays: Sequence[ArrayLike]) -> None:
        if len(arrays) != len(self.inputs):
            names = ", ".join(name for name, _ in self.inputs)
            raise ValueError(f"{self.program} takes {len(self.inputs)} arrays ({names}), not {len(arrays)}")


# ----------------------------------------------------------------------------------------------------------------------

class ProgramStruct(ctypes.Structure):
    """`mbs_program` of runtime.h."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("n_in", ctypes.c_int),
        ("in_sizes", ctypes.POINTER(ctypes.c_int)),
        ("n_out", ctypes.c_int),
        ("out_sizes", ctypes.POINTER(ctypes.c_int)),
        ("call", ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)),
    )


class CollocationStruct(ctypes.Structure):
    """`mbs_collocation` of runtime.h."""

    _fields_ = (
        ("stages", ctypes.c_int),
        *((name, ctypes.c_void_p) for name in ("c", "w", "start", "end", "transform", "inverse")),
        *((name, ctypes.c_double) for name in ("gamma", "alpha", "beta", "filter")),
        *((name, ctypes.c_void_p) for name in ("error", "dense")),
        ("hermite", ctypes.c_int),
    )


class MethodStruct(ctypes.Structure):
    """`mbs_method` of runtime.h."""

    _fields_ = (
        *((name, ctypes.c_int) for name in ("family", "stages", "all_stages", "order", "error_order", "dense_degree")),
        *((name, ctypes.c_void_p) for name in ("a", "c", "error", "coarse_error", "dense")),
        ("past", ctypes.c_int),
        *((name, ctypes.c_void_p) for name in ("position", "predictor", "corrector")),
        ("collocation", ctypes.POINTER(CollocationStruct)),
    )


class SystemStruct(ctypes.Structure):
    """`mbs_system` of runtime.h."""

    _fields_ = (
        ("inputs", ctypes.c_void_p),
        ("state_derivative", ctypes.c_void_p),
        ("jacobian", ctypes.c_void_p),
        *((name, ctypes.c_void_p) for name in ("index_2", "index_2_by_state", "index_2_by_multipliers")),
        ("project_position", ctypes.c_void_p),
        ("project_velocity", ctypes.c_void_p),
        ("missed", ctypes.c_void_p),
        ("put_back", ctypes.c_void_p),
        ("normalize", ctypes.c_void_p),
        ("events", ctypes.c_void_p),
        ("terminal", ctypes.c_void_p),
        ("parameters", ctypes.c_void_p),
        ("modes", ctypes.c_void_p),
        *((name, ctypes.c_int) for name in ("nq", "nu", "ns", "nw", "ng")),
        *((name, ctypes.c_void_p) for name in ("plain", "ball")),
        *((name, ctypes.c_int) for name in ("plains", "balls")),
        ("margins", ctypes.c_void_p),
        ("limiting", ctypes.c_void_p),
        *((name, ctypes.c_int) for name in ("switches", "limits")),
        ("moments", ctypes.c_void_p),
        ("moment_count", ctypes.c_int),
    )


class ProblemStruct(ctypes.Structure):
    """`mbs_problem` of runtime.h."""

    _fields_ = (
        ("method", ctypes.POINTER(MethodStruct)),
        ("system", ctypes.POINTER(SystemStruct)),
        *((name, ctypes.c_double) for name in ("t0", "t_end", "step", "rtol", "atol", "contradiction")),
        *((name, ctypes.c_double) for name in ("closure", "independent", "whole")),
        ("max_steps", ctypes.c_longlong),
        ("samples", ctypes.c_longlong),
        ("times", ctypes.c_void_p),
        ("project", ctypes.c_int),
        ("crosses", ctypes.c_int),
    )


class StateStruct(ctypes.Structure):
    """`mbs_state` of runtime.h."""

    _fields_ = (
        *((name, ctypes.c_double) for name in ("t", "t_new", "h", "h_next", "error", "failure_time")),
        *((name, ctypes.c_double) for name in ("drift_position", "drift_velocity")),
        *((name, ctypes.c_double) for name in ("removed_position", "removed_velocity", "quaternion_deviation")),
        *((name, ctypes.c_double) for name in ("least_rank", "greatest_rank")),
        *((name, ctypes.c_double) for name in ("conditioning", "conditioning_time")),
        *((name, ctypes.c_double) for name in ("before", "start", "latest", "end")),
        *((name, ctypes.c_double) for name in ("least", "greatest", "peak", "rate", "least_time", "smooth")),
        ("singular", ctypes.c_double * PASSED),
        *((name, ctypes.c_longlong) for name in ("steps", "rejected", "evaluations")),
        *((name, ctypes.c_longlong) for name in ("jacobians", "factorisations", "sample", "grid")),
        *((name, ctypes.c_int) for name in ("status", "component", "event", "phase", "crossing", "origin", "extended")),
        *((name, ctypes.c_int) for name in ("passed", "near", "stiff", "vain")),
        ("doubled", ctypes.c_double * DOUBLED),
    )


class ContactsStruct(ctypes.Structure):
    """`mbs_contacts` of runtime.h."""

    _fields_ = (
        ("parts", ctypes.c_int),
        *((name, ctypes.c_void_p) for name in ("begins", "places", "matrix", "squares")),
        *((name, ctypes.c_void_p) for name in ("rubs", "presses", "coefficients")),
        ("relaxed", ctypes.c_double),
    )


@dataclass(frozen=True)
class _Space:
    """Inputs and outputs of one call, each one behind the other, and the addresses at which they begin."""

    inputs: Floats
    outputs: Floats
    given: ctypes.Array[ctypes.c_void_p]
    results: ctypes.Array[ctypes.c_void_p]

    @staticmethod
    def of(inputs: Sequence[int], outputs: Sequence[int]) -> _Space:
        """Return the space of a program whose arrays begin at these places; the last are how many numbers they are."""
        arrays = [np.empty(starts[-1]) for starts in (inputs, outputs)]
        pairs = zip(arrays, (inputs, outputs), strict=True)
        given, results = (
            (ctypes.c_void_p * (len(starts) - 1))(*(array.ctypes.data + 8 * k for k in starts[:-1]))
            for array, starts in pairs
        )
        return _Space(arrays[0], arrays[1], given, results)


@dataclass(frozen=True)
class NativeFunction:
    """One program of a loaded library; `structure` is its entry in `mbs_programs`."""

    signature: Signature
    structure: ProgramStruct
    library: ctypes.CDLL

    def __call__(self, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs, shaped as declared, for the inputs in their declared order; raises ValueError."""
        values = [array.ravel() for array in self.signature.arranged(arrays)]
        try:
            space = self._spaces.pop()
        except IndexError:  # the first call, or one beside another in a thread
            space = _Space.of(*self._starts)
        np.concatenate(values, out=space.inputs)
        self._function(space.given, space.results)
        outputs = space.outputs.copy()
        self._spaces.append(space)
        return tuple([outputs[a:b] if flat else outputs[a:b].reshape(shape) for a, b, shape, flat in self._pieces])

    @cached_property
    def _function(self) -> Callable[..., None]:
        return cast(Callable[..., None], self.structure.call)

    @cached_property
    def _spaces(self) -> list[_Space]:
        """What no call works in: addresses are found once."""
        return []

    @cached_property
    def _pieces(self) -> list[tuple[int, int, tuple[int, ...], bool]]:
        """Where each output begins and ends, its shape, and whether it is a row of numbers, as it stands there."""
        shapes = (shape for _, shape in self.signature.outputs)
        return [(a, b, shape, len(shape) == 1) for (a, b), shape in zip(pairwise(self._starts[1]), shapes, strict=True)]

    @cached_property
    def _starts(self) -> tuple[list[int], list[int]]:
        """Where inputs, and outputs, begin when they stand one after the other, and how many numbers they are."""
        inputs, outputs = (list(accumulate(self.signature.sizes(s), initial=0)) for s in ("inputs", "outputs"))
        return inputs, outputs

    def map(self, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs (samples, *shape) for inputs that are stacked by sample or the same for all."""
        samples, inputs, changing = self.signature.stacked(arrays)
        outputs = [np.empty((samples, *shape)) for _, shape in self.signature.outputs]
        advance = (ctypes.c_int * len(changing))(*changing)
        count = ctypes.c_longlong(samples)
        self.library.mbs_map(ctypes.byref(self.structure), count, _addresses(inputs), advance, _addresses(outputs))
        return tuple(outputs)


def _addresses(arrays: Sequence[Floats]) -> ctypes.Array[ctypes.c_void_p]:
    return (ctypes.c_void_p * len(arrays))(*[array.ctypes.data for array in arrays])


def open_library(
    path: Path, signatures: Sequence[Signature], numbers: Sequence[float] = ()
) -> Mapping[str, NativeFunction]:
    """Return the programs of the shared library at `path` by name; the `numbers` that its code names become its own.

    Raises OSError if it cannot be loaded, and ValueError if it does not hold programs of these signatures.
    """
    library = ctypes.CDLL(str(path))
    library.mbs_map.restype = None
    library.mbs_start.restype = None
    library.mbs_work.restype = ctypes.c_longlong
    library.mbs_integrate.restype = ctypes.c_longlong
    library.mbs_integrate_each.restype = None
    if numbers:
        if ctypes.c_int.in_dll(library, "mbs_number_count").value != len(numbers):
            raise ValueError("the library names other numbers")
        array = ctypes.POINTER(ctypes.c_double * len(numbers)).in_dll(library, "mbs_numbers")
        array.contents[:] = list(numbers)
    count = ctypes.c_int.in_dll(library, "mbs_program_count").value
    structures = (ProgramStruct * count).in_dll(library, "mbs_programs")
    found = {structure.name.decode("ascii"): structure for structure in structures}
    for signature in signatures:
        structure = found.get(signature.program)
        sizes = structure and [structure.in_sizes[: structure.n_in], structure.out_sizes[: structure.n_out]]
        if sizes != [signature.sizes("inputs"), signature.sizes("outputs")]:
            raise ValueError(f"{path} has no program {signature.program} of the expected sizes")
    return {s.program: NativeFunction(s, found[s.program], library) for s in signatures}


# ----------------------------------------------------------------------------------------------------------------------
# Compiled functions called for one state without delay, or for many in C, on threads.


_PIECE: Final = 0.02
"""Seconds that a piece of a batch takes, after which Ctrl-C is heard."""
_FIRST: Final = 64
"""States in the first piece of a batch, whose time decides how long the others are."""
_TELLING: Final = 0.1
"""Seconds between two calls of `on_progress`."""


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


def run_many(
    function: Any,
    inputs: list[Floats],
    outputs: list[Floats],
    count: int | None,
    threads: int = 1,
    on_progress: Callable[[float], None] | None = None,
) -> None:
    """Run a function for one state or n, in `threads`; Ctrl-C ends it within a few hundredths of a second.

    `on_progress` gets the part of the states that is done, about ten times a second.
    """
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
    batch = _Batch(function, inputs, outputs, on_progress)
    if threads <= 1 or count < 2 * _FIRST:
        batch.run(0, count, tells=True)
        return
    (first, end), *others = pairwise(np.linspace(0, count, threads + 1).astype(int).tolist())
    with ThreadPoolExecutor(threads - 1) as pool:
        parts = [pool.submit(batch.run, a, b) for a, b in others]
        try:
            batch.run(first, end, tells=True)
            while wait(parts, _PIECE).not_done:  # a wait without an end hears no Ctrl-C that another thread was sent
                batch.tell()
            for part in parts:
                part.result()
        except BaseException:
            batch.stop.set()
            raise


class _Batch:
    """A function in C with arrays for many states."""

    def __init__(
        self,
        function: NativeFunction,
        inputs: list[Floats],
        outputs: list[Floats],
        on_progress: Callable[[float], None] | None,
    ) -> None:
        signature = function.signature
        self._library, self._program = function.library, ctypes.byref(function.structure)
        changing = [x.ndim > len(shape) for x, (_, shape) in zip(inputs, signature.inputs, strict=True)]
        self._advance = (ctypes.c_int * len(changing))(*changing)
        sizes = zip(signature.sizes("inputs"), changing, strict=True)
        self._given = [(x.ctypes.data, 8 * size * many) for x, (size, many) in zip(inputs, sizes, strict=True)]
        self._results = [(x.ctypes.data, 8 * n) for x, n in zip(outputs, signature.sizes("outputs"), strict=True)]
        self.stop = Event()
        self._count, self._on_progress = len(outputs[0]), on_progress
        self._done: dict[int, int] = {}
        self._told = time.perf_counter()

    def run(self, first: int, last: int, *, tells: bool = False) -> None:
        """Run the states from `first` to `last`, piece by piece, until `stop` is set; one thread tells the progress."""
        begin, size = first, min(_FIRST, last - first)
        while first < last and not self.stop.is_set():
            begun = time.perf_counter()
            self._piece(first, size)
            took = max(time.perf_counter() - begun, 1e-6)
            first += size
            size = min(max(int(size * _PIECE / took), 1), last - first)
            self._done[begin] = first - begin
            if tells:
                self.tell()

    def tell(self) -> None:
        """Call `on_progress` with the part of the states that is done, at most once in `_TELLING` seconds."""
        now = time.perf_counter()
        if self._on_progress is not None and now - self._told > _TELLING:
            self._told = now
            self._on_progress(sum(self._done.values()) / self._count)

    def _piece(self, first: int, count: int) -> None:
        given, results = ([start + first * step for start, step in side] for side in (self._given, self._results))
        self._library.mbs_map(
            self._program,
            ctypes.c_longlong(count),
            (ctypes.c_void_p * len(given))(*given),
            self._advance,
            (ctypes.c_void_p * len(results))(*results),
        )
