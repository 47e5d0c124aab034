"""The option of commands that print quantities: the units in which people read them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from multibody_sym.errors import at

if TYPE_CHECKING:
    from multibody_sym.expressions.chosen_units import Units

_DESCRIBED = "units to read, such as mm,deg,kN; --json stays SI"


def add_units(parser: argparse.ArgumentParser) -> None:
    """Declare `--units`."""
    parser.add_argument("--units", metavar="UNITS", help=_DESCRIBED)


def asked_units(options: argparse.Namespace) -> Units:
    """Return the units that `--units` asks for. Raises InputError for what is no unit."""
    from multibody_sym.expressions.chosen_units import chosen_units

    with at("--units"):
        return chosen_units(options.units)
