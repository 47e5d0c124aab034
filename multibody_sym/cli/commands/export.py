"""`export`: source code of the equations of motion, which compiles and tests itself, or an FMU."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from multibody_sym.cli.options import Reply, model_options
from multibody_sym.program.backend import FMU, LANGUAGES, TARGETS

HELP: Final = "write the equations of motion as source code with a self-test, or as an FMU"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("--to", required=True, choices=sorted(TARGETS), help="the language, or fmu")
    names = ("-o", "--output", "--directory")
    text = "the folder to write to (default: FILE_c, FILE_python ..), or the file (default: FILE.fmu)"
    parser.add_argument(*names, dest="directory", metavar="PATH", help=text)
    parser.add_argument("--fold", action="store_true", help="put the values of all parameters into the code")
    text = "functions of the system beside those of a run: mass_matrix, state_derivative_by_q_u_inputs .."
    parser.add_argument("--functions", metavar="NAMES", default="", help=text)
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="the version of an FMU (default: 2)")


def run(options: argparse.Namespace) -> Reply:
    """Write the files and say how to try them."""
    from multibody_sym.cli.model import model
    from multibody_sym.mechanics.changes import with_overrides
    from multibody_sym.motion.prepare.export import exported

    stem = Path(options.file).stem
    path = options.directory or (f"{stem}.fmu" if options.to == FMU else f"{stem}_{options.to}")
    changes = model_options(options)
    with model(options) as system:
        changed = with_overrides(system, changes)
        functions = [name.strip() for name in options.functions.split(",") if name.strip()]
        formalism = changes.get("formalism")
        found = exported(changed, options.to, path, options.fold, options.fmi, functions, formalism)
    names = [str(file) for file in found.files]
    run = f"fmpy validate {path}" if options.to == FMU else f"cd {path} && {LANGUAGES[options.to].run}"
    lines = [*(f"wrote {name}" for name in names), *found.notes, f"next: {run}"]
    return Reply({"to": options.to, "files": names}, "\n".join(lines))
