"""`export`: source code of the equations of motion, which compiles and tests itself."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.answer import Answer
from multibody_sym.codegen.languages import LANGUAGES

HELP: Final = "write source code of the equations of motion, with a self-test"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    parser.add_argument("--to", required=True, choices=sorted(LANGUAGES), help="the language")
    names = ("-o", "--output", "--directory")
    parser.add_argument(*names, dest="directory", required=True, metavar="DIR", help="the folder to write to")
    parser.add_argument("--fold", action="store_true", help="put the values of all parameters into the code")


def run(options: argparse.Namespace) -> Answer:
    """Write the files and say how to try them."""
    from multibody_sym.cli.model import model, shared
    from multibody_sym.simulation.export import export

    with model(options) as system:
        files = export(system, options.to, options.directory, fold=options.fold, **shared(options))
    names, run = [str(file) for file in files], LANGUAGES[options.to].run
    text = "\n".join([*(f"wrote {name}" for name in names), f"next: cd {options.directory} && {run}"])
    return Answer({"to": options.to, "files": names}, text)
