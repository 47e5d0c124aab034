"""`equilibrium`: positions in which a system can rest, and whether they are stable."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.answer import Answer
from multibody_sym.cli.units import add_units, asked_units

HELP: Final = "find positions of rest and whether they are stable (start speeds are left out)"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    add_units(parser)


def run(options: argparse.Namespace) -> Answer:
    """Find positions of equilibrium, from the start and from positions around it."""
    from multibody_sym.analysis.equilibrium import equilibrium
    from multibody_sym.cli.model import model, shared
    from multibody_sym.writing.statics import equilibrium_text

    units = asked_units(options)
    with model(options) as system:
        found = equilibrium(system, **shared(options))
    return Answer(found.as_json(), equilibrium_text(found, units))
