"""`import`: a robot description (URDF) as a model file."""

from __future__ import annotations

import argparse
from typing import Final

from multibody_sym.cli.options import Reply

HELP: Final = "turn a robot description (URDF) into a model file"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("file", metavar="FILE", help="a robot description (.urdf)")
    parser.add_argument("-o", "--output", metavar="FILE", help="the model file to write; default: standard output")
    parser.add_argument("--floating", action="store_true", help="the root link moves freely; default: fixed to ground")
    parser.add_argument("--no-damping", dest="damping", action="store_false", help="leave out the damping of joints")
    parser.add_argument("--no-mimic", dest="mimic", action="store_false", help="leave joints free that mimic others")
    parser.add_argument("--friction", action="store_true", help="let joints rub with the friction that the file gives")
    parser.add_argument("--torques", action="store_true", help="give each joint with one coordinate a torque as input")


def run(options: argparse.Namespace) -> Reply:
    """Write the model; an existing file is never replaced. What was not imported is told on standard error."""
    from multibody_sym.mechanics.model_files import dumps
    from multibody_sym.mechanics.resolve import mechanism
    from multibody_sym.model.urdf import load_urdf
    from multibody_sym.text.files import write_new

    chosen = {name: getattr(options, name) for name in ("floating", "damping", "mimic", "torques", "friction")}
    system = load_urdf(options.file, **chosen)
    text, speeds = dumps(system), len(mechanism(system).speeds)
    answer = {"model": text, "file": options.output, "speeds": speeds}
    if options.output is None:
        return Reply(answer, text, source=True)
    write_new(options.output, text.encode("utf-8"))
    done = f"wrote {options.output}: {len(system.bodies)} bodies, {speeds} speeds"
    return Reply(answer, f"{done}; next: multibody-sym simulate {options.output} --plot")
