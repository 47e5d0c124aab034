"""Programs made callable: compiled or taken from the cache, in C or, where that cannot be, in generated Python."""

from __future__ import annotations

import contextlib
import functools
import importlib.machinery
import importlib.util
import json
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.errors import OutputError
from multibody_sym.program import cache
from multibody_sym.program.backend import PORTABLE, Backend, Native
from multibody_sym.program.compiler import CompilerError, begin_runtime, build_library, find_compiler
from multibody_sym.program.native import NativeFunction, Signature, open_library
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.stages import stage

if TYPE_CHECKING:
    from multibody_sym.program.program import Program


# ----------------------------------------------------------------------------------------------------------------------
# Programs as generated Python, loaded from a file in the cache: what runs where there is no C compiler.


@dataclass(frozen=True)
class PythonFunction:
    """One program of a generated module: a function of numbers and lists of numbers that returns the like."""

    signature: Signature
    function: Callable[..., Sequence[Any]]

    def __call__(self, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs, shaped as declared, for the inputs in their declared order; raises ValueError."""
        return self._call(self.signature.arranged(arrays))

    def map(self, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs (samples, *shape) for inputs that are stacked by sample or the same for all."""
        samples, inputs, changing = self.signature.stacked(arrays)
        outputs = tuple(np.empty((samples, *shape)) for _, shape in self.signature.outputs)
        for sample in range(samples):
            row = [values[sample] if many else values for values, many in zip(inputs, changing, strict=True)]
            for output, values in zip(outputs, self._call(row), strict=True):
                output[sample] = values
        return outputs

    def _call(self, inputs: Sequence[Floats]) -> tuple[Floats, ...]:
        returned = self.function(*[values.ravel().tolist() if values.ndim else float(values) for values in inputs])
        shapes = (shape for _, shape in self.signature.outputs)
        return tuple(np.array(v, dtype=float).reshape(s) for v, s in zip(returned, shapes, strict=True))


class _PlainLoader(importlib.machinery.SourceFileLoader):
    """Loads source and leaves no compiled file behind, which would be read back without a check of its content."""

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        """Write nothing."""


def open_module(path: Path, signatures: Sequence[Signature]) -> Mapping[str, PythonFunction]:
    """Return the programs of the generated module at `path` by name; raises ValueError if one is missing."""
    name = f"multibody_sym_generated_{path.stem.replace('-', '_')}"
    loader = _PlainLoader(name, str(path))
    spec = importlib.util.spec_from_loader(name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    missing = [s.program for s in signatures if s.program not in module.PROGRAMS]
    if missing:
        raise ValueError(f"{path} has no program {missing[0]}")
    return {s.program: PythonFunction(s, module.PROGRAMS[s.program]) for s in signatures}


# ----------------------------------------------------------------------------------------------------------------------

Function = NativeFunction | PythonFunction
_PYTHON: Final = "python"


class FallbackNotice(UserWarning):
    """Programs run as generated Python because C is not available; given once for each reason."""


@dataclass(frozen=True)
class Compiled:
    """Programs ready to be called: `compiled[name](*arrays)`, `compiled.map(name, *arrays stacked by sample)`.

    `path` is the library or module in the cache, `origin` tells what made it. `notice` says why it is Python although
    C was wanted, else None. Its copy in another process has no `path`: it holds no code, but makes or recalls its own
    by `remake(wanted)` when it is first called, as was `wanted` here. `numbers` are
    those that were given to the library.
    """

    backend: Backend
    path: Path | None
    origin: str
    functions: Mapping[str, Function]
    notice: str | None = None
    numbers: tuple[float, ...] = ()
    wanted: Native = PORTABLE
    remake: Callable[[Native], Compiled] | None = field(default=None, repr=False, compare=False)

    def __copy__(self) -> Compiled:
        return self

    def __deepcopy__(self, memo: object) -> Compiled:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        if self.remake is None:
            raise TypeError("nothing says how these compiled functions are made again elsewhere")
        names = tuple(self.functions)
        wanted = Native(self.wanted.native, self.likewise.backend)
        return _elsewhere, (names, self.backend, self.origin, self.notice, wanted, self.remake)

    @property
    def likewise(self) -> Native:
        """The code to ask for where more is to run as this does: Python if it is that, be it as a fallback."""
        return Native(backend="python" if self.backend == "python" else self.wanted.backend)

    def __getitem__(self, name: str) -> Function:
        return self.functions[name]

    def __contains__(self, name: object) -> bool:
        return name in self.functions

    def map(self, name: str, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs (samples, *shape) of program `name` for inputs stacked by sample, or the same for all."""
        return self.functions[name].map(*arrays)


class _Later(Mapping[str, Function]):
    """Functions of known `names` that are made when the first of them is asked for."""

    def __init__(self, names: tuple[str, ...], make: Callable[[], Compiled]) -> None:
        self._names = names
        self._make = make

    @functools.cached_property
    def _made(self) -> Mapping[str, Function]:
        return self._make().functions

    def __getitem__(self, name: str) -> Function:
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _elsewhere(
    names: tuple[str, ...],
    backend: Backend,
    origin: str,
    notice: str | None,
    wanted: Native,
    remake: Callable[[Native], Compiled],
) -> Compiled:
    """Return what another process compiled, as it comes out of a pickle here."""
    functions = _Later(names, functools.partial(remake, wanted))
    return Compiled(backend, None, origin, functions, notice, (), wanted, remake)


def load(
    programs: Mapping[str, Program],
    code: Native = PORTABLE,
    *,
    rare: Mapping[str, Program] = MappingProxyType({}),
    multistep: bool = True,
) -> Compiled:
    """Return `programs` callable by name; what the cache holds is neither printed nor compiled again.

    Among them are those that are `rare`, whose compilation is to be short. `multistep`: whether methods that look back
    may run them.

    Where `code` leaves the backend open and there is no C, one FallbackNotice says so; for "c" CompilerError is raised.
    Raises OutputError if generated code cannot be written anywhere.
    """
    from multibody_sym.program.program import program_hash

    code.verify()
    every = {**programs, **rare}
    signatures = [Signature.of(name, program) for name, program in every.items()]
    hashes = (part for name, program in every.items() for part in (name, program_hash(program)))
    key = cache.digest("programs", str(len(programs)), str(multistep), *hashes)

    def printed_c() -> Mapping[str, str]:
        from multibody_sym.program.c_target import c_source
        from multibody_sym.program.target_layout import parts_of

        return c_source(programs, rare=rare, parts=parts_of(every, multistep=multistep), apart=not code.native)

    def printed_python() -> str:
        from multibody_sym.program.python_target import python_source

        return python_source(every)

    try:
        with stage("compile"):
            made = _in_c_or_python(
                code.backend,
                lambda: load_c(signatures, key, printed_c, native=code.native),
                lambda: load_python(signatures, key, printed_python),
            )
        again = functools.partial(load, programs, rare=dict(rare), multistep=multistep)
        return replace(made, wanted=code, remake=again)
    except OSError as problem:
        raise OutputError(f"generated code cannot be written: {problem}", number="O102") from problem


def begin(parts: Collection[str], code: Native) -> None:
    """Compile these parts of the runtime, if they are missing, beside the derivation of what `load` gets."""
    if code.backend == "python":
        return
    from multibody_sym.program.target_layout import runtime_files

    with contextlib.suppress(CompilerError, OSError):
        begin_runtime(find_compiler(native=code.native), runtime_files(parts))


def _in_c_or_python(
    backend: Backend | None, in_c: Callable[[], Compiled], in_python: Callable[[], Compiled]
) -> Compiled:
    if backend == "python":
        return in_python()
    try:
        return in_c()
    except (CompilerError, OSError) as problem:
        reason = problem.message if isinstance(problem, CompilerError) else str(problem)
        if backend == "c":
            raise CompilerError(f"C is not available: {reason}") from problem
    return _with_notice(in_python(), reason)


def _with_notice(compiled: Compiled, reason: str) -> Compiled:
    notice = f"the model runs as Python, many times slower: {reason}"
    _warn_once(notice)
    return replace(compiled, notice=notice)


@functools.cache
def _warn_once(notice: str) -> None:
    warnings.warn(notice, FallbackNotice, stacklevel=4)


def load_c(
    signatures: Sequence[Signature], key: str, sources: Callable[[], Mapping[str, str]], *, native: bool = False
) -> Compiled:
    """Return the programs of the library known as `key`, built from `sources` if need be; raises OutputError, OSError.

    `sources()` gives the texts of model.c, runtime.c and headers by file name, and the numbers that model.c leaves
    open: models that differ in these alone have copies of one library, each with its own.
    """
    compiler = find_compiler(native=native)
    full_key = cache.digest("c", key, compiler.identity, cache.toolkit())
    found = _load_stored("c", full_key, compiler.identity, signatures)
    if found is not None:
        return found
    with cache.alone(full_key):
        found = _load_stored("c", full_key, compiler.identity, signatures)  # another process has made it meanwhile
        if found is not None:
            return found
        from multibody_sym.program.target_layout import NUMBERS_FILE  # what is found needs nothing of what prints

        texts = dict(sources())
        numbers = json.loads(texts.pop(NUMBERS_FILE, "[]"))
        library = build_library(compiler, texts)
        if numbers:
            library = cache.keep(library.read_bytes(), full_key, library.suffix)
        cache.store(full_key, library, {"numbers": numbers})
        return _open_compiled("c", library, compiler.identity, signatures, numbers)


def load_python(signatures: Sequence[Signature], key: str, source: Callable[[], str]) -> Compiled:
    """Return the programs of the module known as `key`, written from `source()` if need be; raises OSError."""
    full_key = cache.digest("python", key, cache.toolkit())
    found = _load_stored("python", full_key, _PYTHON, signatures)
    if found is not None:
        return found
    module = cache.keep(source().encode("ascii"), full_key, ".py")
    cache.store(full_key, module, {"numbers": []})
    return _open_compiled("python", module, _PYTHON, signatures)


def _load_stored(backend: Backend, key: str, origin: str, signatures: Sequence[Signature]) -> Compiled | None:
    """Return what the cache has under `key`, loaded; None where that is nothing, or something else."""
    with cache.keep_files():
        artifact = cache.find(key)
        if artifact is not None:
            with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
                return _open_compiled(backend, artifact.path, origin, signatures, artifact.metadata["numbers"])
    return None


def _open_compiled(
    backend: Backend, path: Path, origin: str, signatures: Sequence[Signature], numbers: Sequence[float] = ()
) -> Compiled:
    if backend == "python":
        return Compiled(backend, path, origin, open_module(path, signatures))
    return Compiled(backend, path, origin, open_library(path, signatures, numbers), numbers=tuple(numbers))


@dataclass(frozen=True)
class Recalled:
    """Programs found under a caller's key, and what the caller stored with them."""

    compiled: Compiled
    metadata: Mapping[str, Any]


def remember(key: str, compiled: Compiled, metadata: Mapping[str, Any]) -> None:
    """Let `recall(key)` find `compiled` and `metadata` (JSON values) as long as toolkit and compiler stay the same."""
    programs = [function.signature.as_json() for function in compiled.functions.values()]
    assert compiled.path is not None  # made here
    full_key = cache.digest("recall", key, compiled.origin, cache.toolkit())
    about = {"programs": programs, "numbers": compiled.numbers, "caller": dict(metadata)}
    cache.store(full_key, compiled.path, about)


def recall(key: str, code: Native = PORTABLE) -> Recalled | None:
    """Return what was remembered under `key` for this code, or None; needs no Program and starts no compiler.

    The key has to name everything the programs were derived from.
    """
    code.verify()
    if code.backend == "python":
        return _load_recalled(key, "python", _PYTHON)
    try:
        return _load_recalled(key, "c", find_compiler(native=code.native).identity)
    except CompilerError as problem:
        found = _load_recalled(key, "python", _PYTHON) if code.backend is None else None
        return found and replace(found, compiled=_with_notice(found.compiled, problem.message))


def _load_recalled(key: str, backend: Backend, origin: str) -> Recalled | None:
    with cache.keep_files():
        artifact = cache.find(cache.digest("recall", key, origin, cache.toolkit()))
        if artifact is None:
            return None
        try:
            signatures = [Signature.from_json(entry) for entry in artifact.metadata["programs"]]
            made = _open_compiled(backend, artifact.path, origin, signatures, artifact.metadata["numbers"])
            return Recalled(made, artifact.metadata["caller"])
        except (OSError, ValueError, KeyError, TypeError):
            return None
