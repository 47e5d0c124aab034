"""The C compiler: found without a look at the working folder, called without a shell and with a time limit."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from multibody_sym.errors import OutputError
from multibody_sym.runtime import cache

_NAMES: Final = ("cc", "gcc", "clang")
_FLAGS: Final = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC")
_NATIVE_FLAGS: Final = ("-std=c99", "-O2", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fPIC")
_SECONDS: Final = 60.0
_BYTES_PER_SECOND: Final = 20_000.0  # more time for a large source: a slow compiler is not a hanging one


class CompilerError(OutputError):
    """There is no usable C compiler, or it failed."""

    code = "compiler"


@dataclass(frozen=True)
class Compiler:
    """A compiler's command (absolute path, then what CC adds to it), flags, and what tells it from another one.

    `identity` names the file by path, size and time of change, and for native code the processor: enough to look
    into the cache without starting the compiler.
    """

    command: tuple[str, ...]
    flags: tuple[str, ...]
    identity: str

    def version(self) -> str:
        """Return what the compiler says about itself."""
        with tempfile.TemporaryDirectory(prefix="multibody_sym-") as place:
            return _run([[*self.command, "--version"]], Path(place), 10.0)


def find_compiler(*, native: bool = False) -> Compiler:
    """Return the compiler named by CC, or the first of cc, gcc, clang on PATH; raises CompilerError without one."""
    try:
        words = shlex.split(os.environ.get("CC", ""))
    except ValueError as problem:
        raise CompilerError(f"the environment variable CC cannot be read: {problem}") from None
    for name in words[:1] or _NAMES:
        path = _executable(name)
        if path is not None:
            flags = _NATIVE_FLAGS if native else _FLAGS
            return Compiler((path, *words[1:]), flags, _identity(path, words[1:], flags, native))
    sought = f"CC = {words[0]!r}, which is not" if words else f"none of {', '.join(_NAMES)} is"
    raise CompilerError(f"no C compiler: {sought} an executable on PATH or an absolute path")


def _identity(path: str, extra: Sequence[str], flags: Sequence[str], native: bool) -> str:
    status = os.stat(path)
    parts = [os.path.realpath(path), str(status.st_size), str(status.st_mtime_ns), sys.platform, *_machine(), *flags]
    return cache.digest(path, *parts, *extra, _processor() if native else "")


def _machine() -> tuple[str, ...]:
    return (os.uname().machine,) if hasattr(os, "uname") else (os.environ.get("PROCESSOR_ARCHITECTURE", ""),)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        import platform

        return platform.processor()
    return "\n".join(sorted({line for line in lines if line.startswith(("model name", "flags", "Features"))}))


def _executable(name: str) -> str | None:
    """Return the absolute path of the program `name`, not looking into the working folder."""
    if os.path.isabs(name):
        return name if _runs(name) else None
    if os.path.dirname(name):
        return None
    candidates = (os.path.join(place, name) for place in _search_path())
    return next((path for path in candidates if _runs(path)), None)


def _search_path() -> list[str]:
    here = os.path.realpath(os.curdir)
    places = os.environ.get("PATH", os.defpath).split(os.pathsep)
    return [place for place in places if os.path.isabs(place) and os.path.realpath(place) != here]


def _runs(path: str) -> bool:
    return os.path.isfile(path) and os.access(path, os.X_OK)


def build_library(compiler: Compiler, sources: Mapping[str, str]) -> Path:
    """Return the cached shared library of `model.c` and the runtime's files in `sources` (file name -> text).

    All are compiled at the same time; the objects of the runtime are kept, since all models share them. Raises
    CompilerError, and OSError if nothing can be written.
    """
    version = compiler.version()
    origin = "\0".join([*compiler.command, *compiler.flags, version, compiler.identity])
    library_key = cache.digest("library", origin, *(text for item in sorted(sources.items()) for text in item))
    found = cache.find(library_key)
    if found is not None:
        return found.path
    content = _compiled(compiler, sources, origin)
    library = cache.keep(content, library_key, ".so")
    cache.store(library_key, library, {})
    return library


def _compiled(compiler: Compiler, sources: Mapping[str, str], origin: str) -> bytes:
    shared = _shared_objects(sources, origin)
    kept = {unit: artifact.path for unit, key in shared.items() if (artifact := cache.find(key)) is not None}
    with tempfile.TemporaryDirectory(prefix="multibody_sym-") as name:
        place = Path(name)
        for file, text in sources.items():
            (place / file).write_text(text, encoding="ascii")
        missing = [unit for unit in shared if unit not in kept]
        limit = _SECONDS + sum(map(len, sources.values())) / _BYTES_PER_SECOND
        start = [*compiler.command, *compiler.flags]
        _run([[*start, "-c", f"{unit}.c", "-o", f"{unit}.o"] for unit in ("model", *missing)], place, limit)
        for unit in missing:
            kept[unit] = cache.keep(_written(compiler, place / f"{unit}.o"), shared[unit], ".o")
            cache.store(shared[unit], kept[unit], {})
        objects = [str(kept[unit]) for unit in shared]
        _run([[*start, "-shared", "model.o", *objects, "-lm", "-o", "model.so"]], place, limit)
        return _written(compiler, place / "model.so")


def _shared_objects(sources: Mapping[str, str], origin: str) -> dict[str, str]:
    """Return the key of the compiled file for each of the runtime's files, by the file's name without ending."""
    headers = [text for name, text in sources.items() if name.endswith(".h") and name != "model.h"]
    units = [name.removesuffix(".c") for name in sources if name.endswith(".c") and name != "model.c"]
    return {unit: cache.digest("runtime", origin, sources[f"{unit}.c"], *headers) for unit in units}


def _written(compiler: Compiler, path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise CompilerError(f"the C compiler {compiler.command[0]} wrote no {path.name}") from None


def _run(commands: Sequence[Sequence[str]], place: Path, limit: float) -> str:
    """Run `commands` at the same time in the private folder `place`; return what they printed."""
    environment = {**os.environ, "PATH": os.pathsep.join(_search_path()), "TMPDIR": str(place), "LC_ALL": "C"}
    end = time.monotonic() + limit
    processes: list[subprocess.Popen[bytes]] = []
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
            codes = [process.wait(max(0.0, end - time.monotonic())) for process in processes]
        except subprocess.TimeoutExpired:
            raise CompilerError(f"the C compiler {commands[0][0]} took more than {limit:.0f} s") from None
        except OSError as problem:
            raise CompilerError(f"the C compiler {commands[0][0]} cannot be started: {problem.strerror}") from None
        finally:
            _end(processes)
        output.seek(0)
        printed = output.read().decode(errors="replace")
    if any(codes):
        first = next((line for line in printed.splitlines() if "error" in line), printed.strip()[:200])
        raise CompilerError(f"the C compiler {commands[0][0]} failed: {first}")
    return printed


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    """End what still runs, with everything it started (a compiler is several programs)."""
    for process in processes:
        if process.poll() is None:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except (OSError, AttributeError):
                process.kill()
            process.wait()
