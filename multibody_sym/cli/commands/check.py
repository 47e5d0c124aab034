"""`check`: whether a model is what its author means, and whether all routes to its equations agree."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Final

from multibody_sym.cli.options import Reply, add_digits, add_units, asked_units, first_lines, model_options

HELP: Final = "check a model: freedoms, redundancy, formalisms compared, hints"
_DISAGREES: Final = 3


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add_units(parser)
    add_digits(parser)


def run(options: argparse.Namespace) -> Reply:
    """Check; a model without a start, and routes that disagree, end with 3."""
    from multibody_sym.analysis.check import check
    from multibody_sym.cli.model import model
    from multibody_sym.documents.solution import check_text

    units = asked_units(options)
    with model(options) as system:
        found = check(system, **model_options(options))
    told = [options.told(hint) for hint in found.hints]
    options.hints = tuple  # the report has them
    failure = None if found.failure is None else options.told(found.failure)
    text = check_text(replace(found, hints=tuple(told), failure=failure), units)
    return Reply({**found.as_json(), "hints": first_lines(told)}, text, 0 if found.agrees else _DISAGREES)
