"""A compiler that does not optimise models, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from multibody_sym.runtime import compiler


def compile_soon(patch: pytest.MonkeyPatch) -> None:
    """Let the compiler not optimise models, which takes two thirds of its time and changes no bit of the results.

    What all models share is optimised as ever.
    """
    compiled = compiler._Build._compile

    def compiled_soon(build: compiler._Build, units: Sequence[str]) -> None:
        flags = build.compiler.flags
        if list(units) == ["model"] and "-ffp-contract=off" in flags:
            build = replace(build, compiler=replace(build.compiler, flags=(*flags, "-O0")))
        compiled(build, units)

    patch.setattr(compiler._Build, "_compile", compiled_soon)
