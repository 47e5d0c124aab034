"""`solve`: what holds at the given instant, in numbers and in closed form."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Final

from multibody_sym.cli.options import Reply, add_digits, add_units, asked_units, model_options

HELP: Final = "find accelerations, tensions and reactions at the given instant, in closed form"
_FORMATS: Final = ("text", "latex", "html")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--steps", action="store_true", help="show how a book gets there, from bodies cut free on")
    parser.add_argument("--format", choices=_FORMATS, help="how to print the steps: text (default), latex or html")
    add_units(parser)
    add_digits(parser)


def run(options: argparse.Namespace) -> Reply:
    """Solve the instant t = 0 and the questions under `ask`."""
    from multibody_sym.answers.solve import solve
    from multibody_sym.cli.model import model
    from multibody_sym.documents.document import worked_document, write_document
    from multibody_sym.documents.solution import solution_text

    units, steps = asked_units(options), options.steps or options.format is not None
    with model(options) as system:
        solution = solve(system, steps=steps, **model_options(options))
    if solution.steps is None:
        return Reply(solution.as_json(), solution_text(solution, units))
    form, told = options.format or "text", replace(units, angles=solution.angles)
    return Reply(solution.as_json(), write_document(worked_document(solution.steps), form, told), source=form != "text")
