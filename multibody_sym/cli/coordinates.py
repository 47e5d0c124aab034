"""The option of commands whose answer depends on the coordinates."""

from __future__ import annotations

import argparse


def add_coordinates(parser: argparse.ArgumentParser) -> None:
    """Declare `--coordinates`."""
    described = "relative (of the joints) or absolute (of each body, restricted by joints); default: the file's"
    parser.add_argument("--coordinates", metavar="WHICH", help=described)
