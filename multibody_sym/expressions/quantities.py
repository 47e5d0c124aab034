"""The quantities of the moving system that an expression can name, such as `reaction(C, fx)`."""

from __future__ import annotations

from typing import Final, NamedTuple

from multibody_sym.expressions.units import Dimension


class Quantity(NamedTuple):
    """What a quantity is asked with, and its dimension (None where that depends on what is asked)."""

    arguments: tuple[str, ...]
    dimension: Dimension | None


_ENERGY: Final = Dimension(1, 2, -2)

QUANTITIES: Final[dict[str, Quantity]] = {
    "position": Quantity(("point", "axis"), Dimension(0, 1, 0)),
    "velocity": Quantity(("point", "axis"), Dimension(0, 1, -1)),
    "acceleration": Quantity(("point", "axis"), Dimension(0, 1, -2)),
    "angular_velocity": Quantity(("body", "axis"), Dimension(0, 0, -1)),
    "angular_acceleration": Quantity(("body", "axis"), Dimension(0, 0, -2)),
    "distance": Quantity(("point", "point"), Dimension(0, 1, 0)),
    "reaction": Quantity(("joint", "component"), None),
    "tension": Quantity(("rope",), Dimension(1, 1, -2)),
    "multiplier": Quantity(("constraint",), None),
    "total_energy": Quantity((), _ENERGY),
    "kinetic_energy": Quantity((), _ENERGY),
    "potential_energy": Quantity((), _ENERGY),
    "center_of_mass": Quantity(("axis",), Dimension(0, 1, 0)),
    "momentum": Quantity(("axis",), Dimension(1, 1, -1)),
    "angular_momentum": Quantity(("axis",), Dimension(1, 2, -1)),
}
"""Every quantity by its name; the arguments are names of the model, joined by dots."""
