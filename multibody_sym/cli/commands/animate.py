"""`animate`: the motion of a model to be looked at, as a page of HTML, a GIF or an MP4."""

from __future__ import annotations

import argparse
import os
from typing import Final

from multibody_sym.cli.options import (
    INTERRUPTED,
    Reply,
    add_run_options,
    add_units,
    asked_units,
    run_options,
    verify_apart,
)
from multibody_sym.stages import reached, stage

HELP: Final = "show the motion: a page that needs nothing beside it, a GIF or an MP4"
_OWN: Final = {
    "trace": ("NAMES", "bodies and points whose paths are shown, such as bob,rod.tip; default: the last bodies"),
    "view": ("VIEW", "from where it is seen: front, top, right, iso, or AZIMUTH,ELEVATION in degrees"),
    "show": ("NAMES", "names that the plots show, with commas between them; default: outputs, coordinates"),
    "speed": ("X", "how fast it plays at first; default: 1, as it happens"),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("-o", "--output", metavar="OUT", help="a file (.html, .gif, .mp4); default: FILE.html")
    add_units(parser)
    for name, (what, described) in _OWN.items():
        parser.add_argument(f"--{name}", metavar=what, help=described)
    add_run_options(parser)


def run(options: argparse.Namespace) -> Reply:
    """Simulate, and write the motion."""
    from multibody_sym.cli.model import model
    from multibody_sym.documents.animation.animate import animate, animation_name
    from multibody_sym.motion.simulate import simulate

    place = options.output or os.path.splitext(os.path.basename(options.file))[0] + ".html"
    animation_name(place)
    verify_apart(options.file, place)
    with model(options) as system:
        done = simulate(system, **run_options(options), on_progress=lambda _new, part: reached(part))
        with stage("draw frames"):
            found = animate(
                done, place, trace=options.trace, view=options.view, show=options.show,
                units=asked_units(options), speed=options.speed or 1.0, on_progress=reached,
            )  # fmt: skip
    count, ended = len(found.frames.times), ", where the run was interrupted" if done.interrupted else ""
    text = f"{done.ready.mechanism.name}: {count} frames to t = {done.t_final:g} s{ended}\nwrote {place}"
    answer = {"frames": count, "t": done.t_final, "written": [place]}
    return Reply(answer, text, INTERRUPTED if done.interrupted else 0)
