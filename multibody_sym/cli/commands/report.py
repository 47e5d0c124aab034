"""`report`: a model as a document to hand in, HTML or LaTeX."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from typing import Final

from multibody_sym.cli.options import (
    Reply,
    add_digits,
    add_run_options,
    add_units,
    asked_units,
    run_options,
    verify_apart,
)
from multibody_sym.errors import InputError, Where

HELP: Final = "write a model to one page: question, figure, answers, solution, motion; or an exercise"
_OUT: Final = "a file (.html, .tex); default: FILE.html, of a fragment FILE.tex"
_NUMBERS: Final = "other round numbers of the parameters; an exercise has its answers beside it"
_DIGITS: Final = 4


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("-o", "--output", metavar="OUT", help=_OUT)
    parser.add_argument("--exercise", action="store_true", help="figure, givens and question, without the solution")
    parser.add_argument("--numbers", metavar="SEED", help=_NUMBERS)
    parser.add_argument("--fragment", action="store_true", help="LaTeX to be taken in by \\input, with labels")
    add_units(parser)
    add_digits(parser, _DIGITS)
    add_run_options(parser)


def _seed(told: str | None) -> int | None:
    """Return the seed of `--numbers`. Raises InputError for what is no number from 1 on."""
    if told is None:
        return None
    if not told.isdecimal() or not int(told):
        raise InputError(f"expected a number from 1 on, such as 17, got {told!r}", where=Where(path=("--numbers",)))
    return int(told)


def run(options: argparse.Namespace) -> Reply:
    """Ask all questions and write the answers."""
    from multibody_sym.cli.model import model
    from multibody_sym.documents.report import report, report_ending

    ending = ".tex" if options.fragment else ".html"
    place = options.output or os.path.splitext(os.path.basename(options.file))[0] + ending
    report_ending(place, fragment=options.fragment)
    seed = _seed(options.numbers)
    verify_apart(options.file, place)
    command = shlex.join(["multibody-sym", *(word for word in sys.argv[1:] if word.isprintable())])
    with model(options) as system:
        units = asked_units(options)
        found = report(
            system,
            units=units,
            digits=units.digits,
            exercise=options.exercise,
            numbers=seed,
            fragment=options.fragment,
            command=command,
            **run_options(options),
        )
    written = found.write(place)
    lines = [repr(found)[1:-1], *(f"wrote {name}" for name in written)]
    return Reply({"written": written}, "\n".join(lines))
