"""`equilibrium`: positions in which a system can rest, and whether they are stable."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.options import Reply, UsageError, add_digits, add_units, asked_units, model_options
from multibody_sym.errors import Where

HELP: Final = "find positions of rest and whether they are stable, or for which values of a parameter there is rest"
_VARY: Final = "find all values of this parameter at which rest is possible in the declared position, friction included"
_LEAST: Final = "find the least value of this parameter (a force) at which rest ends, over all values of that of --vary"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--vary", metavar="NAME", help=_VARY)
    parser.add_argument("--steps", action="store_true", help="show how the ends of the range of --vary are found")
    parser.add_argument("--least", metavar="NAME", help=_LEAST)
    add_units(parser)
    add_digits(parser)


def run(options: argparse.Namespace) -> Reply:
    """Find positions of equilibrium, from the start and from positions around it, or a range of rest."""
    from multibody_sym.cli.model import model

    if options.least is not None and options.vary is None:
        message = f"--least {options.least}: name the parameter over whose values it is least, such as --vary beta"
        raise UsageError(message, where=Where(path=("--least",)))
    if options.steps and (options.vary is None or options.least is not None):
        message = "--steps: steps lead to the ends of a range of rest; name its parameter alone, such as --vary mu"
        raise UsageError(message, where=Where(path=("--steps",)))
    units, asked = asked_units(options), model_options(options)
    if options.least is not None:
        from multibody_sym.analysis.rest.range_of_rest import least_for_motion
        from multibody_sym.documents.analysis import least_text

        with model(options) as system:
            least = least_for_motion(system, options.least, options.vary, **asked)
        return Reply(least.as_json(), least_text(least, units))
    if options.vary is not None:
        from multibody_sym.analysis.rest.range_of_rest import range_of_rest
        from multibody_sym.documents.analysis import rest_text

        with model(options) as system:
            rest = range_of_rest(system, options.vary, **asked)
            told = rest_text(rest, units)
            if options.steps:
                from multibody_sym.answers.worked.rest import worked_rest
                from multibody_sym.documents.document import worked_document, write_document

                steps = worked_rest(system, options.vary, **asked)
                told = f"{write_document(worked_document(steps), 'text', units)}\n{told}"
        return Reply(rest.as_json(), told)
    from multibody_sym.analysis.equilibrium import equilibrium
    from multibody_sym.documents.analysis import equilibrium_text

    with model(options) as system:
        found = equilibrium(system, **asked)
    return Reply(found.as_json(), equilibrium_text(found, units))
