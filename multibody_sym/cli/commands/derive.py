"""`derive`: the equations of motion in symbols, with the steps that lead to them."""

from __future__ import annotations

import argparse
import json
from typing import Final

from multibody_sym.cli.options import Reply, model_options

HELP: Final = "derive energies and equations of motion in symbols"
_FORMATS: Final = ("text", "latex", "html", "json")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    route = (
        "lagrange, multipliers, newton_euler, composite_body, hamilton or routh; default: the first that fits "
        "(or --formalism M)"
    )
    parser.add_argument("--method", metavar="M", help=route)
    budget = "the time that the derivation may take; default: 60"
    parser.add_argument("--budget", metavar="SECONDS", type=float, help=budget)
    parser.add_argument("--steps", action="store_true", help="show every step of the derivation")
    theorems = "add the theorems of momentum, angular momentum and energy, and what is conserved"
    parser.add_argument("--theorems", action="store_true", help=theorems)
    parser.add_argument("--format", choices=_FORMATS, default=_FORMATS[0], help="how to print it; default: text")


def run(options: argparse.Namespace) -> Reply:
    """Derive and print in the format asked for."""
    from multibody_sym.cli.model import model
    from multibody_sym.derivation.derive import derive
    from multibody_sym.derivation.theorems import with_theorems
    from multibody_sym.documents.derivation import derivation_data, derivation_document
    from multibody_sym.documents.document import write_document
    from multibody_sym.dynamics.conserved import conserved_quantities

    with model(options) as system:
        equations = derive(system, options.method, budget=options.budget, **model_options(options))
        kept = conserved_quantities(system, **model_options(options)) if options.theorems else []
        if options.theorems:
            equations = with_theorems(equations, kept)
        data = derivation_data(equations)
        if options.theorems:
            data["conserved"] = {each.name: each.symmetry for each in kept}
        if options.format == "json":
            return Reply(data, json.dumps(data, indent=1), source=True)
        text = write_document(derivation_document(equations, steps=options.steps), options.format)
        return Reply(data, text, source=options.format != "text")
