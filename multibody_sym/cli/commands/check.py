"""`check`: whether a model is what its author means, and whether all routes to its equations agree."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.answer import Answer
from multibody_sym.cli.units import add_units, asked_units

HELP: Final = "check a model: freedoms, redundancy, formalisms compared, hints"
_DISAGREES: Final = 3


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    add_units(parser)


def run(options: argparse.Namespace) -> Answer:
    """Check; a model without a start, and routes that disagree, end with 3."""
    from multibody_sym.checking.check import check
    from multibody_sym.cli.model import model, shared
    from multibody_sym.writing.check import check_text

    units = asked_units(options)
    with model(options) as system:
        found = check(system, **shared(options))
    options.hints = tuple  # the report has them
    return Answer(found.as_json(), check_text(found, units), 0 if found.agrees else _DISAGREES)
