"""The model file of a command, and errors that say whether the file or an option is wrong."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from contextlib import contextmanager

from multibody_sym.dynamics.start.examined import numbers_of
from multibody_sym.errors import InputError, MultibodyError, Where, at
from multibody_sym.formats.reader import load_with_places
from multibody_sym.model.declaration.system import System
from multibody_sym.simulation.overrides import with_settings, with_values


@contextmanager
def model(options: argparse.Namespace) -> Iterator[System]:
    """Give the system of a command, with the values, start and coordinates that its options change.

    Errors about the model that are raised inside name their place in the file, or the option they come from.
    """
    system, places = load_with_places(options.file)
    with at("--set"):
        changed = with_settings(with_values(system, options.set), {"project": options.project or None})
    try:
        asked = with_settings(changed, {"coordinates": getattr(options, "coordinates", None)})
        with numbers_of(asked):
            yield asked
    except MultibodyError as error:
        option = _option(error.where.path, options)
        if option is not None:
            error.where = Where(path=(option,))
        elif error.where.path:
            with places.shown():
                raise
        raise


def verify_apart(file: str, target: str | None) -> None:
    """Raise InputError where a result would replace the model file, under whatever name."""
    both = target is not None and os.path.isfile(file) and os.path.isfile(target)
    if both and target is not None and os.path.samefile(file, target):
        raise InputError("this is the model itself; give the result another name", where=Where(file=target))


def _option(path: tuple[str, ...], options: argparse.Namespace) -> str | None:
    """Return the option that gave what stands at a path of the model; None where the file did."""
    section, name = (*path, "", "")[:2]
    if section == "parameters" and name in options.set:
        return f"--set {name}"
    if section == "simulation" and getattr(options, name, None) is not None:
        return "--" + name.replace("_", "-")
    return "--formalism" if section == "formalism" else None
