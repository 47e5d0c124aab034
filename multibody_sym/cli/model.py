"""The model file of a command, with the parameter values that `--set` changes."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager

from multibody_sym.formats.reader import load_with_places
from multibody_sym.model.slots import at
from multibody_sym.model.system import System
from multibody_sym.simulation.overrides import with_values


def add_file(parser: argparse.ArgumentParser) -> None:
    """Declare the model file as an argument."""
    parser.add_argument("file", metavar="FILE", help="a model file (YAML)")


@contextmanager
def model(options: argparse.Namespace) -> Iterator[System]:
    """Give the system of a command; errors about the model that are raised inside get their place in the file."""
    system, places = load_with_places(options.file)
    with at("--set"):
        changed = with_values(system, options.set)
    with places.shown():
        yield changed
