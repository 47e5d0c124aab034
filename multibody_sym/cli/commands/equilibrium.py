"""`equilibrium`: positions in which a system can rest, and whether they are stable."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.answer import Answer
from multibody_sym.cli.units import add_units, asked_units

HELP: Final = "find positions of rest and whether they are stable, or for which values of a parameter there is rest"
_VARY: Final = "find all values of this parameter at which rest is possible in the declared position, friction included"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    parser.add_argument("--vary", metavar="NAME", help=_VARY)
    add_units(parser)


def run(options: argparse.Namespace) -> Answer:
    """Find positions of equilibrium, from the start and from positions around it, or a range of rest."""
    from multibody_sym.analysis.equilibrium import equilibrium
    from multibody_sym.cli.model import model, shared
    from multibody_sym.writing.statics import equilibrium_text

    if options.vary is not None:
        return _range_of_rest(options)
    units = asked_units(options)
    with model(options) as system:
        found = equilibrium(system, **shared(options))
    return Answer(found.as_json(), equilibrium_text(found, units))


def _range_of_rest(options: argparse.Namespace) -> Answer:
    from multibody_sym.answers.range_of_rest import range_of_rest
    from multibody_sym.cli.model import model, shared
    from multibody_sym.writing.rest import rest_text

    units = asked_units(options)
    with model(options) as system:
        found = range_of_rest(system, options.vary, **shared(options))
    return Answer(found.as_json(), rest_text(found, units))
