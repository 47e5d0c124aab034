"""The reply of a command: an object for programs, text for people, the exit code of the process."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from multibody_sym.errors import InputError, Where, at
from multibody_sym.records import dataclass

if TYPE_CHECKING:
    from multibody_sym.text.values import Units

INTERRUPTED: Final = 130
"""The exit code after Ctrl-C."""


def first_lines(hints: Iterable[str]) -> list[str]:
    """Return the first lines of hints, without the lines of the model file."""
    return [hint.partition("\n")[0] for hint in hints]


@dataclass(frozen=True)
class Reply:
    """`--json` prints `json` on standard output and `text` on standard error; without it `text` is the output.

    `missed`: work that was asked for and not done, on standard error in either case.
    """

    json: Mapping[str, Any]
    text: str
    exit_code: int = 0
    missed: str = ""


# ----------------------------------------------------------------------------------------------------------------------
# Where results of commands go.


def verify_apart(file: str, target: str | None, what: str = "the model itself") -> None:
    """Raise InputError where a result would replace the model file or `what` else, under whatever name."""
    both = target is not None and os.path.isfile(file) and os.path.isfile(target)
    if both and target is not None and os.path.samefile(file, target):
        raise InputError(f"this is {what}; give the result another name", where=Where(file=target), number="O101")


# ----------------------------------------------------------------------------------------------------------------------
# The option of commands that print quantities: the units in which people read them.


_DESCRIBED = "units to read, such as mm,deg,kN; --json stays SI"


def add_units(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--units", metavar="UNITS", help=_DESCRIBED)


def asked_units(options: argparse.Namespace) -> Units:
    """Return the units that `--units` asks for. Raises InputError for what is no unit."""
    from multibody_sym.text.values import chosen_units

    with at("--units"):
        return chosen_units(options.units)
