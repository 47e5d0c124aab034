"""`check`: whether a model is what its author means, and whether all routes to its equations agree."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.answer import Answer
from multibody_sym.cli.coordinates import add_coordinates

HELP: Final = "check a model: degrees of freedom, redundancy, formalisms against each other, hints"
_DISAGREES: Final = 3


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    add_coordinates(parser)


def run(options: argparse.Namespace) -> Answer:
    """Check; a model without a start, and routes that disagree, end with 3."""
    from multibody_sym.checking.check import check
    from multibody_sym.cli.model import model
    from multibody_sym.model.resolution.resolve import mechanism
    from multibody_sym.simulation.recall import formalism_name
    from multibody_sym.writing.check import check_text

    with model(options) as system:
        formalism_name(options.formalism, mechanism(system))
        found = check(system)
    return Answer(found.as_json(), check_text(found), 0 if found.agrees else _DISAGREES)
