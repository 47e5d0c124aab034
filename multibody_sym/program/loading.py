"""Programs made callable: compiled or taken from the cache, in C or, where that cannot be, in generated Python."""

from __future__ import annotations

import contextlib
import functools
import importlib.machinery
import importlib.util
import json
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import field, replace
from functools import cached_property
from importlib.util import find_spec
from io import StringIO
from itertools import accumulate
from pathlib import Path
from types import MappingProxyType
from typing import IO, TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.errors import OutputError
from multibody_sym.program import cache
from multibody_sym.program.backend import PORTABLE, Backend, Native
from multibody_sym.program.native import NativeFunction, Signature, open_library
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.stages import log, stage

if TYPE_CHECKING:
    from multibody_sym.program.program import Program

# ----------------------------------------------------------------------------------------------------------------------
# The C compiler: found without a look at the working folder, called without a shell and with a time limit.
#
# Where the machine has none, that of the package `ziglang` serves (extra `compiler`): clang with a C library.


_NAMES: Final = ("cc", "gcc", "clang")
_FLAGS: Final = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC")
_ZIG_FLAGS: Final = ("-fno-sanitize=undefined",)  # which Zig asks for by itself
_VECTORS: Final = ("-fopenmp-simd", "-DMBS_VECTORS")
"""For loops that are marked as running side by side: the compiler takes several turns in one register."""
_NATIVE_FLAGS: Final = ("-std=c99", "-O2", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC", *_VECTORS)
_OF_ONE_MODEL: Final = ("model", "fmu", "fmi2", "fmi3")
"""Units that are compiled for one model alone."""
_OWN_HEADERS: Final = ("model.h", "fmu.h", "fmu_model.h")
"""Headers that no other unit includes."""
_WIDTH: Final = ("-mprefer-vector-width=256",)
"""For x86 with registers of 512 bits: loops have 2 to 50 turns, of which wide registers leave more to do one by one."""
_X86: Final = ("x86_64", "AMD64")
_FIRST_PROCESSOR: Final = 4096
"""Characters of a list of processors in which the first one stands: all are alike."""
_SELDOM: Final = ("turns", "events", "looks", "switching", "singular", "multistep", "pairing")
_LESS: Final = ("-O1",)
"""For units of the runtime that take no part of a run's time that can be measured: a third of their compilation."""
_GENERATED: Final = (*_LESS, "-finline-small-functions", *_VECTORS)
"""For generated code: straight on, it gains nothing by -O2, which compiles twice as long."""
_STRAIGHT_ON: Final = ("-fno-dse", "-fno-tree-dse", "-fno-tree-pta")
"""The same for GCC: searches for stores that nothing reads find none, and take a fifth of its time."""
_GCC: Final = "Free Software Foundation"
"""What GCC says of itself, and no other compiler."""
_SECONDS: Final = 60.0
_BYTES_PER_SECOND: Final = 20_000.0  # more time for a large source: a slow compiler is not a hanging one


_MOST_AT_ONCE: Final = 3
"""Files of the runtime that are compiled at the same time: the longest one takes a third of all."""
BROUGHT: Final = "runtime.objects"
"""A file beside this one in the wheels of platforms: what the runtime is compiled to, so that a first run need not."""
_SIGNS: Final = ("error", "undefined ", "cannot ", "No such ", "ld: ")  # of a reason, the surest first
_SUMMARIES: Final = ("ld returned", "linker command failed")
_LONGEST_REASON: Final = 300


class CompilerError(OutputError):
    """There is no usable C compiler, or it failed."""

    code = "compiler"
    number = "O103"


@dataclass(frozen=True)
class Compiler:
    """A compiler's command (absolute path, then what CC adds to it), flags, and what tells it from another one.

    `identity` names the file by path, size and time of change, and for native code the processor: enough to look
    into the cache without starting the compiler. `wide` are flags of generated code for registers of this processor.
    """

    command: tuple[str, ...]
    flags: tuple[str, ...]
    identity: str
    wide: tuple[str, ...] = ()

    @property
    def native(self) -> bool:
        """Whether the code is for this processor alone, and the compiler takes its time for it."""
        return "-march=native" in self.flags

    def version(self) -> str:
        """Return what the compiler says about itself."""
        with tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            with _running([[*self.command, "--version"]], Path(place), 10.0) as printed:
                pass
            return printed.getvalue()


def find_compiler(*, native: bool = False) -> Compiler:
    """Return the compiler named by CC, or the first of cc, gcc, clang on PATH, or ziglang's; raises CompilerError."""
    try:
        words = shlex.split(os.environ.get("CC", ""))
    except ValueError as problem:
        raise CompilerError(f"the environment variable CC cannot be read: {problem}") from None
    is_x86 = _machine()[0] in _X86
    flags = (*_NATIVE_FLAGS, *(_WIDTH if is_x86 else ())) if native else _FLAGS
    wide = () if native or not is_x86 else _wide_registers()
    for name in words[:1] or _NAMES:
        if os.path.isabs(name):
            candidates = [name]
        else:  # by name alone, and not in the working folder
            candidates = [] if os.path.dirname(name) else [os.path.join(place, name) for place in _search_path()]
        path = next((path for path in candidates if _runs(path)), None)
        if path is not None:
            return Compiler((path, *words[1:]), flags, _identity(path, words[1:], (*flags, *wide), native), wide)
    zig = None if words else _zig()
    if zig is not None:
        flags = (*flags, *_ZIG_FLAGS)
        return Compiler((zig, "cc"), flags, _identity(zig, ["cc"], (*flags, *wide), native), wide)
    sought = f"CC = {words[0]!r}, which is not" if words else f"none of {', '.join(_NAMES)} is"
    advice = "pip install 'multibody-sym[compiler]' brings one"
    raise CompilerError(f"no C compiler: {sought} an executable on PATH or an absolute path; {advice}")


@functools.cache
def _wide_registers() -> tuple[str, ...]:
    """Return flags for registers of four floats, where this processor has them: bits stay, no sum takes a product."""
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
            return ("-mavx2",) if "avx2" in file.read(_FIRST_PROCESSOR).split() else ()
    except OSError:
        return ()


def _zig() -> str | None:
    """Return the path of the program in the package `ziglang`, None where it is not installed."""
    package, here = find_spec("ziglang"), os.path.realpath(os.curdir)
    places = map(os.path.realpath, (package and package.submodule_search_locations) or ())
    apart = [place for place in places if os.path.dirname(place) != here]
    found = (os.path.join(place, name) for place in apart for name in ("zig", "zig.exe"))
    return next((path for path in found if _runs(path)), None)


def _identity(path: str, extra: Sequence[str], flags: Sequence[str], native: bool) -> str:
    processor = ""
    if native:
        try:
            lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
            kinds = {line for line in lines if line.startswith(("model name", "flags", "Features"))}
            processor = "\n".join(sorted(kinds))
        except OSError:
            import platform

            processor = platform.processor()
    status = os.stat(path)
    parts = [os.path.realpath(path), str(status.st_size), str(status.st_mtime_ns), sys.platform, *_machine(), *flags]
    return cache.digest(path, *parts, *extra, processor)


def _machine() -> tuple[str, ...]:
    return (os.uname().machine,) if hasattr(os, "uname") else (os.environ.get("PROCESSOR_ARCHITECTURE", ""),)


def _search_path() -> list[str]:
    here = os.path.realpath(os.curdir)
    places = os.environ.get("PATH", os.defpath).split(os.pathsep)
    return [place for place in places if os.path.isabs(place) and os.path.realpath(place) != here]


def _runs(path: str) -> bool:
    return os.path.isfile(path) and os.access(path, os.X_OK)


def build_library(compiler: Compiler, sources: Mapping[str, str]) -> Path:
    """Return the cached shared library of `model.c` and the runtime's files in `sources` (file name -> text).

    The objects of the runtime are kept, since models share them. What several processes need at the same time one of
    them compiles. Raises CompilerError, and OSError if nothing can be written.
    """
    origin = _origin(compiler)
    library_key = cache.digest("library", origin, *(text for item in sorted(sources.items()) for text in item))
    with cache.alone(library_key):
        found = cache.find(library_key)
        if found is not None:
            return found.path
        size = sum(map(len, sources.values()))
        log("compile %d files of %d characters by %s", len(sources), size, compiler.command[0])
        with tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            content = _Build(compiler, sources, origin, Path(place)).library()
        library = cache.keep(content, library_key, ".so")
        cache.store(library_key, library, {})
        return library


@functools.cache
def _origin(compiler: Compiler) -> str:
    """Return what tells the objects of a compiler from those of others."""
    return "\0".join([*compiler.command, *compiler.flags, compiler.version(), compiler.identity])


def begin_runtime(compiler: Compiler, sources: Mapping[str, str]) -> None:
    """Compile what is missing of the runtime's files in `sources` (file name -> text), beside what the caller does.

    The caller keeps a processor for itself until `build_library`, which helps, and waits for what is begun. What fails
    here fails there again, where it is told.
    """
    units = _by_length(sources)

    def compiled() -> None:
        with suppress(CompilerError, OSError), tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            _Build(compiler, sources, _origin(compiler), Path(place)).runtime(units)

    for _ in range(max(1, min(_MOST_AT_ONCE, (os.cpu_count() or 1) - 1))):
        threading.Thread(target=compiled, name="multibody_sym runtime").start()


def _by_length(sources: Mapping[str, str]) -> list[str]:
    """Return the names of the runtime's sources without the ending, the shortest first."""
    units = [name.removesuffix(".c") for name in sources if name.endswith(".c") and name != "model.c"]
    return sorted(units, key=lambda unit: len(sources[f"{unit}.c"]))


def objects_to_bring(sources: Mapping[str, str]) -> bytes:
    """Return the content of the file `BROUGHT` for the runtime's files in `sources` (file name -> text).

    Its first line tells of each what it was made from, and its size; for other sources, flags or machines none is used.
    Raises CompilerError.
    """
    with tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
        objects = _Build(find_compiler(), sources, "", Path(place)).objects()
    sizes = json.dumps([[made_of, len(content)] for made_of, content in objects.items()])
    return b"\n".join([sizes.encode("ascii"), b"".join(objects.values())])


def _packaged_objects() -> dict[str, bytes]:
    """Return the objects that the package brings, each by what it was made from."""
    try:
        head, _, contents = Path(__file__).with_name(BROUGHT).read_bytes().partition(b"\n")
    except OSError:
        return {}
    sizes: list[tuple[str, int]] = json.loads(head)
    ends = list(accumulate(size for _, size in sizes))
    return {made_of: contents[end - size : end] for (made_of, size), end in zip(sizes, ends, strict=True)}


@dataclass(frozen=True)
class _Build:
    """A model being compiled in a private folder, which everything that is linked is copied into."""

    compiler: Compiler
    sources: Mapping[str, str]
    origin: str
    place: Path

    def library(self) -> bytes:
        """Return the content of the shared library."""
        with self._compiling(self._own):
            self._bring_runtime()
        try:
            self._link()
        except CompilerError:  # the kept objects may be another linker's
            self._compile_runtime(self._units)
            self._link()
        return self._written("model.so")

    def runtime(self, units: list[str]) -> None:
        """Have objects of the runtime in the cache: those of `units` from the last on, which others take from as well.

        What another process is at is left to it.
        """
        brought = _packaged_objects()
        with suppress(IndexError):
            while True:
                unit = units.pop()
                if self._made_of(unit) not in brought:
                    self._make_at_once(unit)

    def objects(self) -> dict[str, bytes]:
        """Return the objects of the runtime, each by what it was made from."""
        self._compile(self._units)
        return {self._made_of(unit): self._written(f"{unit}.o") for unit in self._units}

    def _write(self, units: Sequence[str]) -> None:
        """Write the sources of units and the headers that are not there yet, which another compiler may be reading."""
        for file, text in self.sources.items():
            wanted = file.endswith(".h") or file.removesuffix(".c") in units
            if wanted and not (self.place / file).exists():
                (self.place / file).write_text(text, encoding="ascii")

    @cached_property
    def _own(self) -> list[str]:
        """The names of the sources of this model alone, without the ending."""
        return [unit for unit in _OF_ONE_MODEL if f"{unit}.c" in self.sources]

    @cached_property
    def _units(self) -> list[str]:
        """The names of the runtime's sources, without the ending."""
        return [name[:-2] for name in self.sources if name.endswith(".c") and name[:-2] not in self._own]

    def _bring_runtime(self) -> None:
        """Bring the objects of the runtime into the folder."""
        brought = _packaged_objects()
        missing = [unit for unit in self._units if not self._put(unit, brought.get(self._made_of(unit)))]
        missing = [unit for unit in _by_length(self.sources)[::-1] if unit in missing]
        for unit in [unit for unit in missing if not self._make_at_once(unit)]:
            with cache.alone(self._key(unit)):
                self._make(unit)

    def _make_at_once(self, unit: str) -> bool:
        """Have the object of a unit in the cache and the folder; tell whether it is, and not somebody else at it."""
        with cache.alone_at_once(self._key(unit)) as alone:
            if alone:
                self._make(unit)
        return alone

    def _make(self, unit: str) -> None:
        if not self._put(unit, cache.stored_content(self._key(unit))):
            self._compile_runtime([unit])

    def _put(self, unit: str, content: bytes | None) -> bool:
        """Write a unit's object into the folder where there is one; tell whether there is."""
        if content is not None:
            (self.place / f"{unit}.o").write_bytes(content)
        return content is not None

    def _compile_runtime(self, units: Sequence[str]) -> None:
        self._compile(units)
        for unit in units:
            cache.store(self._key(unit), cache.keep(self._written(f"{unit}.o"), self._key(unit), ".o"), {})

    def _key(self, unit: str) -> str:
        return cache.digest("unit", self.origin, self._made_of(unit))

    def _made_of(self, unit: str) -> str:
        """Return a hash of a unit of the runtime, of what it includes, the flags and the kind of machine."""
        return cache.digest(sys.platform, *_machine(), *self._flags(unit), self.sources[f"{unit}.c"], self._headers)

    @cached_property
    def _headers(self) -> str:
        names = (name for name in sorted(self.sources) if name.endswith(".h") and name not in _OWN_HEADERS)
        return cache.digest(*(self.sources[name] for name in names))

    def _flags(self, unit: str) -> tuple[str, ...]:
        flags = self.compiler.flags
        if unit == "model":
            more = (*_GENERATED, *_STRAIGHT_ON) if _GCC in self.origin else _GENERATED
            return flags if self.compiler.native else (*flags, *more, *self.compiler.wide)
        return (*flags, *_LESS) if unit in _SELDOM and "-O2" in flags else flags

    def _compile(self, units: Sequence[str]) -> None:
        """Compile files at the same time."""
        with self._compiling(units):
            pass

    def _compiling(self, units: Sequence[str]) -> AbstractContextManager[object]:
        """Compile files at the same time, beside what a block does."""
        self._write(units)
        return self._running([[*self._flags(unit), "-c", f"{unit}.c", "-o", f"{unit}.o"] for unit in units])

    def _link(self) -> None:
        objects = [f"{unit}.o" for unit in (*self._own, *self._units)]
        with self._running([[*self.compiler.flags, "-shared", *objects, "-lm", "-o", "model.so"]]):
            pass

    def _running(self, arguments: Sequence[Sequence[str]]) -> AbstractContextManager[object]:
        limit = _SECONDS + sum(map(len, self.sources.values())) / _BYTES_PER_SECOND
        return _running([[*self.compiler.command, *words] for words in arguments], self.place, limit)

    def _written(self, name: str) -> bytes:
        """Return the content of a file that the compiler was to write; raises CompilerError."""
        try:
            return (self.place / name).read_bytes()
        except FileNotFoundError:
            raise CompilerError(f"the C compiler {self.compiler.command[0]} wrote no {name}") from None


@contextmanager
def _running(commands: Sequence[Sequence[str]], place: Path, limit: float) -> Iterator[StringIO]:
    """Run `commands` at the same time in the private folder `place`, beside a block; yield what they will have printed.

    Raises CompilerError behind the block.
    """
    printed = StringIO()
    environment = {**os.environ, "PATH": os.pathsep.join(_search_path()), "TMPDIR": str(place), "LC_ALL": "C"}
    processes: list[subprocess.Popen[bytes]] = []
    late = threading.Event()

    def end_late() -> None:
        late.set()
        _end(processes)

    timer = threading.Timer(limit, end_late)  # wait(timeout) looks once in 50 ms whether a process has ended
    timer.daemon = True
    with tempfile.TemporaryFile(dir=place) as output:
        try:
            for command in commands:
                processes.append(_started(command, place, environment, output))
            timer.start()
            yield printed
            codes = [process.wait() for process in processes]
        finally:
            timer.cancel()
            _end(processes)
        if late.is_set():
            raise CompilerError(f"the C compiler {commands[0][0]} took more than {limit:.0f} s")
        output.seek(0)
        printed.write(output.read().decode(errors="replace"))
    if any(codes):
        raise CompilerError(f"the C compiler {commands[0][0]} failed: {_reason(printed.getvalue())}")


def _started(
    command: Sequence[str], place: Path, environment: Mapping[str, str], output: IO[bytes]
) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(
            command,
            cwd=place,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    except OSError as problem:
        raise CompilerError(f"the C compiler {command[0]} cannot be started: {problem.strerror}") from None


def _reason(printed: str) -> str:
    """Return the line that tells what went wrong: the linker's own, not the one that says that there is one."""
    lines = [line.strip() for line in printed.splitlines() if not any(words in line for words in _SUMMARIES)]
    for sign in _SIGNS:
        for line in lines:
            if sign in line:
                return line[:_LONGEST_REASON]
    return printed.strip()[:_LONGEST_REASON]


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    """End what still runs, with everything it started (a compiler is several programs)."""
    for process in processes:
        if process.poll() is None:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except (OSError, AttributeError):
                process.kill()
            process.wait()


# ----------------------------------------------------------------------------------------------------------------------
# Programs made callable: compiled or taken from the cache, in C or, where that cannot be, in generated Python.


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
        from multibody_sym.program.list_target import python_source

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
    log("write Python: %s", ", ".join(each.program for each in signatures))
    module = cache.keep(source().encode("ascii"), full_key, ".py")
    cache.store(full_key, module, {"numbers": []})
    return _open_compiled("python", module, _PYTHON, signatures)


def _load_stored(backend: Backend, key: str, origin: str, signatures: Sequence[Signature]) -> Compiled | None:
    """Return what the cache has under `key`, loaded; None where that is nothing, or something else."""
    with cache.keep_files():
        artifact = cache.find(key)
        if artifact is not None:
            with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
                found = _open_compiled(backend, artifact.path, origin, signatures, artifact.metadata["numbers"])
                log("found in the cache (%s): %s", backend, ", ".join(each.program for each in signatures))
                return found
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
            log("recalled without deriving (%s): %s", backend, ", ".join(each.program for each in signatures))
            return Recalled(made, artifact.metadata["caller"])
        except (OSError, ValueError, KeyError, TypeError):
            return None
