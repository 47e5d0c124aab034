"""Which code a calculation becomes: C, for any processor or for this one, or generated Python; languages of exports.

In: what a user asks for. Out: a record that all take who compile, load or recall. A module of its own, for the command
line reads it before it knows whether anything is compiled: what prints is imported when it is called.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final, Literal, get_args

from multibody_sym.errors import InputError, short_repr
from multibody_sym.records import dataclass

if TYPE_CHECKING:
    from multibody_sym.program.program import Program
    from multibody_sym.program.target_layout import Samples

Backend = Literal["c", "python"]


@dataclass(frozen=True)
class Native:
    """The code to be made.

    `native`: C for this processor only, whose last digits may differ, with the numbers in its text, where the compiler
    packs them. `backend`: None takes C, and Python where there is no compiler; "c" and "python" take no other.
    """

    native: bool = False
    backend: Backend | None = None

    def verify(self) -> None:
        """Raise InputError for a backend that is none."""
        if self.backend is not None and not (isinstance(self.backend, str) and self.backend in get_args(Backend)):
            raise InputError(f"there is no backend {short_repr(self.backend)}; known: {', '.join(get_args(Backend))}")


PORTABLE: Final = Native()
"""What is made where nothing else is asked for."""


# ----------------------------------------------------------------------------------------------------------------------
# The languages that Programs are exported in: one record each, from which `export` and the command line take theirs.


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
    from multibody_sym.program.list_target import python_source
    from multibody_sym.program.target_layout import template_text

    module = python_source(programs, samples=samples, alone=True)
    return {"model.py": module, "integrate.py": template_text("python/integrate.py")}


def _javascript(programs: Mapping[str, Program], samples: Samples) -> dict[str, str]:
    from multibody_sym.program.list_target import javascript_source

    return javascript_source(programs, samples)


def _octave(programs: Mapping[str, Program], samples: Samples) -> dict[str, str]:
    from multibody_sym.program.octave_target import octave_source

    return octave_source(programs, samples)


LANGUAGES: Final[Mapping[str, ExportLanguage]] = {
    "c": ExportLanguage(
        _c, "cc -std=c99 -O2 -ffp-contract=off model.c solve.c selftest.c -lm -o selftest && ./selftest"
    ),
    "javascript": ExportLanguage(_javascript, "node selftest.mjs && node integrate.mjs 1"),
    "octave": ExportLanguage(_octave, "octave-cli selftest.m && octave-cli integrate.m 1"),
    "python": ExportLanguage(_python, "python model.py && python integrate.py 1   (nothing but NumPy is needed)"),
}
FMU: Final = "fmu"
TARGETS: Final = (*LANGUAGES, FMU)
"""What a system can be exported as: source code in a folder, or an FMU, which is one file."""
