"""The reply of a command: an object for programs, text for people, the exit code of the process."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
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

    `missed`: work that was asked for and not done, on standard error in either case. `source`: the text is code, which
    no terminal wraps.
    """

    json: Mapping[str, Any]
    text: str
    exit_code: int = 0
    missed: str = ""
    source: bool = False


# ----------------------------------------------------------------------------------------------------------------------
# Where results of commands go.


def verify_apart(file: str, target: str | None, what: str = "the model itself") -> None:
    """Raise InputError where a result would replace the model file or `what` else, under whatever name."""
    both = target is not None and os.path.isfile(file) and os.path.isfile(target)
    if both and target is not None and os.path.samefile(file, target):
        raise InputError(f"this is {what}; give the result another name", where=Where(file=target), number="O101")


# ----------------------------------------------------------------------------------------------------------------------
# The options of commands that print quantities: units and digits in which people read them.


_DESCRIBED: Final = "units to read, such as mm,deg,kN; --json stays SI"
_MOST_DIGITS: Final = 17


def add_units(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--units", metavar="UNITS", help=_DESCRIBED)


def add_digits(parser: argparse.ArgumentParser, digits: int | None = None) -> None:
    """Declare how many digits are printed, where nothing is said so many; None: as texts have them."""
    from multibody_sym.text.values import DIGITS

    digits = digits or DIGITS
    parser.add_argument("--digits", metavar="N", default=digits, help=f"digits of numbers; default: {digits}")


def asked_units(options: argparse.Namespace) -> Units:
    """Return the units and digits that the options ask for. Raises InputError for what is neither."""
    from multibody_sym.text.values import chosen_units

    with at("--units"):
        units = chosen_units(options.units)
    told = str(getattr(options, "digits", units.digits))
    if not told.isdecimal() or not 1 <= int(told) <= _MOST_DIGITS:
        raise InputError(f"expected a number from 1 to {_MOST_DIGITS}, got {told!r}", where=Where(path=("--digits",)))
    return replace(units, digits=int(told))
