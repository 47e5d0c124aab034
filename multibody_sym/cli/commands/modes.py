"""`modes`: small oscillations about an equilibrium or a steady motion, as formulas."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.options import Reply, add_digits, add_units, asked_units, model_options

HELP: Final = "small oscillations as formulas: frequencies, modes, stability"
_FORMATS: Final = ("text", "latex")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--format", choices=_FORMATS, default=_FORMATS[0], help="how to print it; default: text")
    add_units(parser)
    add_digits(parser)
    place = "where: equilibrium, the position of rest found first, or NAME=VALUE; default: the start, or beside it"
    parser.add_argument("--at", metavar="WHERE", action="append", help=place)
    swings = "a coordinate: also print its period in the motion from the start, of any amplitude"
    parser.add_argument("--period", metavar="NAME", help=swings)


def run(options: argparse.Namespace) -> Reply:
    """Tell the small motions about the start, or about the state beside it that keeps its speeds."""
    from multibody_sym.analysis.modes.modes import modes
    from multibody_sym.cli.model import model
    from multibody_sym.documents.analysis import modes_document, modes_text

    units = asked_units(options)
    with model(options) as system:
        found = modes(system, at=options.at, period=options.period, **model_options(options))
    if options.format == "latex":
        return Reply(found.as_json(), modes_document(found), source=True)
    return Reply(found.as_json(), modes_text(found, units))
