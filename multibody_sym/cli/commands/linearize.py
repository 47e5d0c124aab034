"""`linearize`: small motions about the start, an equilibrium or a steady motion: A, B, eigenvalues."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.options import Reply, add_digits, add_units, asked_units, model_options

HELP: Final = "A, B and eigenvalues about an equilibrium or a steady motion"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add_units(parser)
    add_digits(parser)
    place = "where: equilibrium, the position of rest found first from the start, or NAME=VALUE; default: the start"
    parser.add_argument("--at", metavar="WHERE", action="append", help=place)
    moving = "also where the system moves: A and B of the moment at t = 0"
    parser.add_argument("--moving", action="store_true", help=moving)
    described = "of a motion that repeats itself after T, such as 2 or '2*pi/W': by what a period multiplies deviations"
    parser.add_argument("--period", metavar="T", help=described)


def run(options: argparse.Namespace) -> Reply:
    """Linearise about the state at t = 0."""
    from multibody_sym.analysis.linearize import linearize, period_multipliers
    from multibody_sym.cli.model import model
    from multibody_sym.documents.analysis import linearization_text, multipliers_text

    units = asked_units(options)
    with model(options) as system:
        if options.period is not None:
            repeated = period_multipliers(system, options.period, at=options.at, **model_options(options))
            return Reply(repeated.as_json(), multipliers_text(repeated, units))
        found = linearize(system, at=options.at, moving=options.moving, **model_options(options))
    return Reply(found.as_json(), linearization_text(found, units))
