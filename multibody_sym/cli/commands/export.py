"""`export`: source code of the equations of motion, which compiles and tests itself."""

from __future__ import annotations

import argparse
import json
from typing import Final

from multibody_sym.cli.options import model_options
from multibody_sym.cli.output import Reply
from multibody_sym.program.backend import LANGUAGES

HELP: Final = "write source code of the equations of motion, with a self-test"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")
    parser.add_argument("--to", required=True, choices=sorted(LANGUAGES), help="the language")
    names = ("-o", "--output", "--directory")
    parser.add_argument(*names, dest="directory", required=True, metavar="DIR", help="the folder to write to")
    parser.add_argument("--fold", action="store_true", help="put the values of all parameters into the code")


def run(options: argparse.Namespace) -> Reply:
    """Write the files and say how to try them."""
    from multibody_sym.cli.model import model
    from multibody_sym.motion.prepare.export import export

    with model(options) as system:
        files = export(system, options.to, options.directory, fold=options.fold, **model_options(options))
    names, run = [str(file) for file in files], LANGUAGES[options.to].run
    lines = [f"wrote {name}" for name in names]
    table = next(file for file in files if file.name == "names.json")
    if mode := json.loads(table.read_text(encoding="utf-8")).get("mode"):
        state = ", ".join(f"{name}: {word}" for name, word in mode.items())
        end = "it ends where the last values of `events` become positive"
        lines.append(f"of the state at the start only, {{{state}}}; {end}")
    lines.append(f"next: cd {options.directory} && {run}")
    return Reply({"to": options.to, "files": names}, "\n".join(lines))
