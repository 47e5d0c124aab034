"""A compiler that does not optimise models, for tests."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace

import pytest

from multibody_sym.program import loading


def compile_soon(patch: pytest.MonkeyPatch) -> None:
    """Let the compiler not optimise models, which takes two thirds of its time and changes no bit of the results.

    What all models share is optimised as ever. Models are linked with what they call, libm, alone: the process has the
    rest, and to look through it takes the linker longer than everything else. The linker of the machine's own compiler
    is called by itself, since three processes start it otherwise.
    """
    flags, linked = loading._Build._flags, loading._Build._link
    compiler, linker = shutil.which("cc"), shutil.which("ld") if sys.platform == "linux" else None

    def quick_flags(build: loading._Build, unit: str) -> tuple[str, ...]:
        quick = unit == "model" and "-ffp-contract=off" in build.compiler.flags
        return (*flags(build, unit), "-O0") if quick else flags(build, unit)

    def linked_soon(build: loading._Build) -> None:
        alone = build.compiler
        if linker is not None and alone.command == (compiler,):
            alone = replace(alone, command=(linker,), flags=())
        elif sys.platform == "linux":
            alone = replace(alone, flags=(*alone.flags, "-nostdlib"))
        linked(replace(build, compiler=alone))

    patch.setattr(loading._Build, "_flags", quick_flags)
    patch.setattr(loading._Build, "_link", linked_soon)
