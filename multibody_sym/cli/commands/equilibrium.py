"""`equilibrium`: positions in which a system can rest, and whether they are stable."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.options import UsageError, model_options
from multibody_sym.cli.output import Reply, add_units, asked_units
from multibody_sym.errors import Where

HELP: Final = "find positions of rest and whether they are stable, or for which values of a parameter there is rest"
_VARY: Final = "find all values of this parameter at which rest is possible in the declared position, friction included"
_LEAST: Final = "find the least value of this parameter (a force) at which rest ends, over all values of that of --vary"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    parser.add_argument("--vary", metavar="NAME", help=_VARY)
    parser.add_argument("--least", metavar="NAME", help=_LEAST)
    add_units(parser)


def run(options: argparse.Namespace) -> Reply:
    """Find positions of equilibrium, from the start and from positions around it, or a range of rest."""
    from multibody_sym.analysis.equilibrium import equilibrium
    from multibody_sym.cli.model import model
    from multibody_sym.documents.analysis import equilibrium_text

    if options.least is not None:
        return _least_for_motion(options)
    if options.vary is not None:
        return _range_of_rest(options)
    units = asked_units(options)
    with model(options) as system:
        found = equilibrium(system, **model_options(options))
    return Reply(found.as_json(), equilibrium_text(found, units))


def _range_of_rest(options: argparse.Namespace) -> Reply:
    from multibody_sym.analysis.rest.range_of_rest import range_of_rest
    from multibody_sym.cli.model import model
    from multibody_sym.documents.analysis import rest_text

    units = asked_units(options)
    with model(options) as system:
        found = range_of_rest(system, options.vary, **model_options(options))
    return Reply(found.as_json(), rest_text(found, units))


def _least_for_motion(options: argparse.Namespace) -> Reply:
    from multibody_sym.analysis.rest.range_of_rest import least_for_motion
    from multibody_sym.cli.model import model
    from multibody_sym.documents.analysis import least_text

    if options.vary is None:
        message = f"--least {options.least}: name the parameter over whose values it is least, such as --vary beta"
        raise UsageError(message, where=Where(path=("--least",)))
    units = asked_units(options)
    with model(options) as system:
        found = least_for_motion(system, options.least, options.vary, **model_options(options))
    return Reply(found.as_json(), least_text(found, units))
