"""`report`: a model as a document to hand in, HTML or LaTeX."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from typing import Final

from multibody_sym.cli.options import add_run_options, run_options
from multibody_sym.cli.output import Reply, add_units, asked_units, verify_apart

HELP: Final = "write all that is found of a model to one page: figure, equations, steps, motion"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    parser.add_argument("-o", "--output", metavar="OUT", help="a file (.html, .tex); default: FILE.html")
    add_units(parser)
    add_run_options(parser)


def run(options: argparse.Namespace) -> Reply:
    """Ask all questions and write the answers."""
    from multibody_sym.cli.model import model
    from multibody_sym.documents.report import report, report_ending

    place = options.output or os.path.splitext(os.path.basename(options.file))[0] + ".html"
    report_ending(place)
    verify_apart(options.file, place)
    command = shlex.join(["multibody-sym", *(word for word in sys.argv[1:] if word.isprintable())])
    with model(options) as system:
        found = report(system, units=asked_units(options), command=command, **run_options(options))
    written = found.write(place)
    lines = [repr(found)[1:-1], *(f"wrote {name}" for name in written)]
    return Reply({"written": written}, "\n".join(lines))
