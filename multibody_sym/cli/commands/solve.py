"""`solve`: what holds at the given instant, in numbers and in closed form."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.answer import Answer
from multibody_sym.cli.units import add_units, asked_units

HELP: Final = "find accelerations, tensions and reactions at the given instant, in closed form"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    add_units(parser)


def run(options: argparse.Namespace) -> Answer:
    """Solve the instant t = 0 and the questions under `ask`."""
    from multibody_sym.answers.solve import solve
    from multibody_sym.cli.model import model, shared
    from multibody_sym.writing.solution import solution_text

    units = asked_units(options)
    with model(options) as system:
        solution = solve(system, **shared(options))
    return Answer(solution.as_json(), solution_text(solution, units))
