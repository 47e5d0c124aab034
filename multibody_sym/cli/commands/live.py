"""`live`: a page on which a model moves by its own equations, with its parameters at hand."""

from __future__ import annotations

import argparse
import os

from multibody_sym.cli.options import Reply, model_options, verify_apart
from multibody_sym.stages import stage

HELP = "write a page that computes the motion: sliders, bodies to drag, energies"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.add_argument("-o", "--output", metavar="OUT", help="an .html file; default: FILE.html")
    described = "from where it is seen: front, top, right, iso, or AZIMUTH,ELEVATION in degrees"
    parser.add_argument("--view", metavar="VIEW", help=described)


def run(options: argparse.Namespace) -> Reply:
    """Write the page."""
    from multibody_sym.cli.model import model
    from multibody_sym.documents.animation.live import live, verify_page_name

    place = options.output or os.path.splitext(os.path.basename(options.file))[0] + ".html"
    verify_page_name(place)
    verify_apart(options.file, place)
    with model(options) as system, stage("write the page"):
        live(system, place, view=options.view, **model_options(options))
    return Reply({"written": [place]}, f"wrote {place}")
