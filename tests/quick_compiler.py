"""A compiler that does not optimise models, for tests."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace

import pytest

from multibody_sym.program import loading


def compile_soon(patch: pytest.MonkeyPatch) -> None:
    """Let the compiler not optimise models, which takes two thirds of its time and changes no bit of the results.

    What all models share is optimised as ever. Models are linked with what they call, libm, alone: the process has the
    rest, and to look through it takes the linker longer than everything else.
    """
    compiled, linked = loading._Build._compile, loading._Build._link

    def also(build: loading._Build, flag: str) -> loading._Build:
        return replace(build, compiler=replace(build.compiler, flags=(*build.compiler.flags, flag)))

    def compiled_soon(build: loading._Build, units: Sequence[str]) -> None:
        quick = list(units) == ["model"] and "-ffp-contract=off" in build.compiler.flags
        compiled(also(build, "-O0") if quick else build, units)

    def linked_soon(build: loading._Build) -> None:
        linked(also(build, "-nostdlib") if sys.platform == "linux" else build)

    patch.setattr(loading._Build, "_compile", compiled_soon)
    patch.setattr(loading._Build, "_link", linked_soon)
