"""The C compiler: found without a look at the working folder, called without a shell and with a time limit.

Where the machine has none, that of the package `ziglang` serves (extra `compiler`): clang with a C library.
"""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from importlib.util import find_spec
from itertools import accumulate
from pathlib import Path
from typing import Final

from multibody_sym.errors import OutputError
from multibody_sym.program import cache
from multibody_sym.records import dataclass

_NAMES: Final = ("cc", "gcc", "clang")
_FLAGS: Final = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC")
_ZIG_FLAGS: Final = ("-fno-sanitize=undefined",)  # which Zig asks for by itself
_NATIVE_FLAGS: Final = ("-std=c99", "-O2", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC")
_SELDOM: Final = ("turns", "events", "looks", "switching", "singular", "multistep", "pairing")
_LESS: Final = ("-O1",)
"""For units of the runtime that take no part of a run's time that can be measured: a third of their compilation."""
_GENERATED: Final = (*_LESS, "-finline-small-functions")
"""For generated code: straight on, it gains nothing by -O2, which compiles twice as long."""
_SECONDS: Final = 60.0
_BYTES_PER_SECOND: Final = 20_000.0  # more time for a large source: a slow compiler is not a hanging one


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
    into the cache without starting the compiler.
    """

    command: tuple[str, ...]
    flags: tuple[str, ...]
    identity: str

    @property
    def native(self) -> bool:
        """Whether the code is for this processor alone, and the compiler takes its time for it."""
        return "-march=native" in self.flags

    def version(self) -> str:
        """Return what the compiler says about itself."""
        with tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            return _run([[*self.command, "--version"]], Path(place), 10.0)


def find_compiler(*, native: bool = False) -> Compiler:
    """Return the compiler named by CC, or the first of cc, gcc, clang on PATH, or ziglang's; raises CompilerError."""
    try:
        words = shlex.split(os.environ.get("CC", ""))
    except ValueError as problem:
        raise CompilerError(f"the environment variable CC cannot be read: {problem}") from None
    flags = _NATIVE_FLAGS if native else _FLAGS
    for name in words[:1] or _NAMES:
        if os.path.isabs(name):
            candidates = [name]
        else:  # by name alone, and not in the working folder
            candidates = [] if os.path.dirname(name) else [os.path.join(place, name) for place in _search_path()]
        path = next((path for path in candidates if _runs(path)), None)
        if path is not None:
            return Compiler((path, *words[1:]), flags, _identity(path, words[1:], flags, native))
    zig = None if words else _zig()
    if zig is not None:
        flags = (*flags, *_ZIG_FLAGS)
        return Compiler((zig, "cc"), flags, _identity(zig, ["cc"], flags, native))
    sought = f"CC = {words[0]!r}, which is not" if words else f"none of {', '.join(_NAMES)} is"
    advice = "pip install 'multibody-sym[compiler]' brings one"
    raise CompilerError(f"no C compiler: {sought} an executable on PATH or an absolute path; {advice}")


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
        with tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            content = _Build(compiler, sources, origin, Path(place)).library()
        library = cache.keep(content, library_key, ".so")
        cache.store(library_key, library, {})
        return library


def _origin(compiler: Compiler) -> str:
    """Return what tells the objects of a compiler from those of others."""
    return "\0".join([*compiler.command, *compiler.flags, compiler.version(), compiler.identity])


def begin_runtime(compiler: Compiler, sources: Mapping[str, str]) -> None:
    """Compile what is missing of the runtime's files in `sources` (file name -> text), beside what the caller does.

    `build_library` waits for it. What fails here fails there again, where it is told.
    """

    def compiled() -> None:
        with suppress(CompilerError, OSError), tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            _Build(compiler, sources, _origin(compiler), Path(place)).runtime()

    threading.Thread(target=compiled, name="multibody_sym runtime").start()


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
        self._write_sources()
        self._bring_runtime()
        self._compile(["model"])
        try:
            self._link()
        except CompilerError:  # the kept objects may be another linker's
            self._compile_runtime(self._units)
            self._link()
        return self._written("model.so")

    def runtime(self) -> None:
        """Have the objects of the runtime in the cache."""
        self._write_sources()
        self._bring_runtime()

    def objects(self) -> dict[str, bytes]:
        """Return the objects of the runtime, each by what it was made from."""
        self._write_sources()
        self._compile(self._units)
        return {self._made_of(unit): self._written(f"{unit}.o") for unit in self._units}

    def _write_sources(self) -> None:
        """Write what is compiled into the folder."""
        for file, text in self.sources.items():
            (self.place / file).write_text(text, encoding="ascii")

    @cached_property
    def _units(self) -> list[str]:
        """The names of the runtime's sources, without the ending."""
        return [name.removesuffix(".c") for name in self.sources if name.endswith(".c") and name != "model.c"]

    def _bring_runtime(self) -> None:
        """Bring the objects of the runtime into the folder."""
        brought = _packaged_objects()
        missing = [unit for unit in self._units if not self._put(unit, brought.get(self._made_of(unit)))]
        missing = [unit for unit in missing if not self._put(unit, cache.stored_content(self._key(unit)))]
        if missing:
            with cache.alone(cache.digest("runtime", self.origin)):
                # another process may have made them meanwhile
                missing = [unit for unit in missing if not self._put(unit, cache.stored_content(self._key(unit)))]
                self._compile_runtime(missing)

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
        names = (name for name in sorted(self.sources) if name.endswith(".h") and name != "model.h")
        return cache.digest(*(self.sources[name] for name in names))

    def _flags(self, unit: str) -> tuple[str, ...]:
        flags = self.compiler.flags
        if unit == "model":
            return flags if self.compiler.native else (*flags, *_GENERATED)
        return (*flags, *_LESS) if unit in _SELDOM and "-O2" in flags else flags

    def _compile(self, units: Sequence[str]) -> None:
        """Compile files at the same time."""
        self._run([[*self._flags(unit), "-c", f"{unit}.c", "-o", f"{unit}.o"] for unit in units])

    def _link(self) -> None:
        objects = [f"{unit}.o" for unit in ("model", *self._units)]
        self._run([[*self.compiler.flags, "-shared", *objects, "-lm", "-o", "model.so"]])

    def _run(self, arguments: Sequence[Sequence[str]]) -> None:
        limit = _SECONDS + sum(map(len, self.sources.values())) / _BYTES_PER_SECOND
        _run([[*self.compiler.command, *words] for words in arguments], self.place, limit)

    def _written(self, name: str) -> bytes:
        """Return the content of a file that the compiler was to write; raises CompilerError."""
        try:
            return (self.place / name).read_bytes()
        except FileNotFoundError:
            raise CompilerError(f"the C compiler {self.compiler.command[0]} wrote no {name}") from None


def _run(commands: Sequence[Sequence[str]], place: Path, limit: float) -> str:
    """Run `commands` at the same time in the private folder `place`; return what they printed."""
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
                processes.append(
                    subprocess.Popen(
                        command,
                        cwd=place,
                        env=environment,
                        stdin=subprocess.DEVNULL,
                        stdout=output,
                        stderr=subprocess.STDOUT,
                        start_new_session=True,
                    )
                )
            timer.start()
            codes = [process.wait() for process in processes]
        except OSError as problem:
            raise CompilerError(f"the C compiler {commands[0][0]} cannot be started: {problem.strerror}") from None
        finally:
            timer.cancel()
            _end(processes)
        if late.is_set():
            raise CompilerError(f"the C compiler {commands[0][0]} took more than {limit:.0f} s")
        output.seek(0)
        printed = output.read().decode(errors="replace")
    if any(codes):
        raise CompilerError(f"the C compiler {commands[0][0]} failed: {_reason(printed)}")
    return printed


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
