"""The languages that Programs are written in: one record each, from which `export` and the command line take theirs.

What prints is imported when it is called: the command line needs the names alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from multibody_sym.records import dataclass

if TYPE_CHECKING:
    from multibody_sym.program.program import Program
    from multibody_sym.program.target_layout import Samples


@dataclass(frozen=True)
class ExportLanguage:
    """The `files` of Programs by name, which need this package no more and test themselves, and how to `run` them."""

    files: Callable[[Mapping[str, Program], Samples], dict[str, str]]
    run: str


def _c(programs: Mapping[str, Program], samples: Samples) -> dict[str, str]:
    from multibody_sym.program.c_target import c_source

    return c_source(programs, samples=samples)


def _python(programs: Mapping[str, Program], samples: Samples) -> dict[str, str]:
    """Return the module and a program that integrates it."""
    from multibody_sym.program.python_target import python_source
    from multibody_sym.program.target_layout import template_text

    module = python_source(programs, samples=samples, alone=True)
    return {"model.py": module, "integrate.py": template_text("python/integrate.py")}


LANGUAGES: Final[Mapping[str, ExportLanguage]] = {
    "c": ExportLanguage(
        _c, "cc -std=c99 -O2 -ffp-contract=off model.c solve.c selftest.c -lm -o selftest && ./selftest"
    ),
    "python": ExportLanguage(_python, "python model.py && python integrate.py 1   (nothing but NumPy is needed)"),
}
