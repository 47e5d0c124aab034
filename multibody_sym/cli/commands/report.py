"""`report`: a model as a document to hand in, HTML or LaTeX."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from typing import Final

from multibody_sym.cli.commands.simulate import SETTINGS, add_settings
from multibody_sym.cli.output import Answer, add_units, asked_units

HELP: Final = "write all that is found of a model to one page: figure, equations, steps, motion"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    parser.add_argument("-o", "--output", metavar="OUT", help="a file (.html, .tex); default: FILE.html")
    add_units(parser)
    add_settings(parser)


def run(options: argparse.Namespace) -> Answer:
    """Ask all questions and write the answers."""
    from multibody_sym.cli.model import model, shared
    from multibody_sym.cli.output import verify_apart
    from multibody_sym.documents.report import report, report_ending

    place = options.output or os.path.splitext(os.path.basename(options.file))[0] + ".html"
    report_ending(place)
    verify_apart(options.file, place)
    settings = {name: getattr(options, name) for name in (*SETTINGS, "backend", "native")}
    command = shlex.join(["multibody-sym", *(word for word in sys.argv[1:] if word.isprintable())])
    with model(options) as system:
        found = report(system, units=asked_units(options), command=command, **shared(options), **settings)
    written = found.write(place)
    lines = [repr(found)[1:-1], *(f"wrote {name}" for name in written)]
    return Answer({"written": written}, "\n".join(lines))
