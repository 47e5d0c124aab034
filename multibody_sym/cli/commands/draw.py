"""`draw` (also `show`): the figure of a mechanism at its start or at a time, as a book would print it."""

from __future__ import annotations

import argparse
import os
from typing import Final

from multibody_sym.cli.options import Reply, model_options, verify_apart
from multibody_sym.stages import reached

HELP: Final = "draw the mechanism, at its start or at a time, as a book would print it"
ALIASES: Final = ("show",)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    output = "the figure: .svg, .png, .pdf or .tex; default: FILE.svg in this folder, FILE_phase_NAME.svg with --phase"
    parser.add_argument("-o", "--output", metavar="OUT", help=output)
    time = "simulate to this time, such as 0.5 or '1 s'; default: the start"
    parser.add_argument("--at", metavar="T", default="0", help=time)
    view = "front, back, top, right, left, iso, or AZIMUTH,ELEVATION in degrees such as 30,20"
    parser.add_argument("--view", metavar="VIEW", help=view)
    parser.add_argument("--forces", action="store_true", help="show weights, pulls of springs and drags too")
    parser.add_argument("--reactions", action="store_true", help="show what joints, contacts, ropes and rods exert")
    names = "letters of the problem (default), all: names of bodies, joints and ropes too, or none"
    parser.add_argument("--names", choices=("letters", "all", "none"), default="letters", help=names)
    dimensions = "named lengths (default), or none"
    parser.add_argument("--dimensions", action=argparse.BooleanOptionalAction, default=True, help=dimensions)
    redundant = "mark joints and constraints that others imply"
    parser.add_argument("--redundant", action="store_true", help=redundant)
    diagrams = "show N, V, M of beams and plans of velocities below"
    parser.add_argument("--diagrams", action="store_true", help=diagrams)
    phase = "draw a phase portrait, or a body's polhodes, instead"
    parser.add_argument("--phase", metavar="NAME", help=phase)
    mark = "mark what stands at a place of the model, such as joints.A; may be repeated"
    parser.add_argument("--mark", metavar="PLACE", action="append", help=mark)
    strip = "leave out with what names begin, such as panda_ of a robot; may be repeated"
    parser.add_argument("--strip", metavar="PREFIX", action="append", default=[], help=strip)


def run(options: argparse.Namespace) -> Reply:
    """Draw and write the figure."""
    from multibody_sym.cli.model import model
    from multibody_sym.documents.draw import draw
    from multibody_sym.pictures.draw import ending_of

    stem = os.path.splitext(os.path.basename(options.file))[0]
    beside = "" if options.phase is None else f"_phase_{options.phase}"  # not over the figure of the mechanism
    target = options.output or f"{stem}{beside}.svg"
    ending_of(target)
    verify_apart(options.file, target)
    with model(options) as system:
        figure = draw(
            system,
            at=options.at,
            view=options.view,
            forces=options.forces,
            reactions=options.reactions,
            names=options.names,
            dimensions=options.dimensions,
            redundant=options.redundant,
            diagrams=options.diagrams,
            phase=options.phase,
            mark=options.mark,
            strip=options.strip,
            on_progress=reached,
            **model_options(options),
        )
    figure.write(target)
    width, height = (25.4 / 72 * length for length in figure.size)
    told = {"written": [target], "title": figure.title, "description": figure.description, "size_mm": [width, height]}
    return Reply(told, f"{figure.description}\nwrote {target} ({width:.0f} mm x {height:.0f} mm)")
