"""The quantities of the moving system that an expression can name, such as `reaction(C, fx)`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from multibody_sym.expressions.known_units import Kind, Known
from multibody_sym.expressions.units import ENERGY, FORCE, Dimension


class Quantity(NamedTuple):
    """What a quantity is asked with, and its dimension (None where that depends on what is asked)."""

    arguments: tuple[str, ...]
    dimension: Dimension | None


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
    "total_energy": Quantity((), ENERGY),
    "kinetic_energy": Quantity((), ENERGY),
    "potential_energy": Quantity((), ENERGY),
    "center_of_mass": Quantity(("axis",), Dimension(0, 1, 0)),
    "momentum": Quantity(("axis",), Dimension(1, 1, -1)),
    "angular_momentum": Quantity(("axis",), Dimension(1, 2, -1)),
}
"""Every quantity by its name; the arguments are names of the model, joined by dots."""

_ANGULAR: Final = {"angular_velocity": 1, "angular_acceleration": 1, "angular_momentum": None}
_ENERGIES: Final = ("total_energy", "kinetic_energy", "potential_energy")


def component_kind(component: str) -> Kind:
    """Return the kind of a component of a reaction: `fx` .. `fz` are forces, `mx` .. `mz` moments."""
    return Kind(FORCE) if component.startswith("f") else Kind(ENERGY, angle=None)


def quantity_known(function: str, arguments: Sequence[str]) -> Known | None:
    """Return what is known of a quantity from what is asked; None for a multiplier, which depends on the constraint."""
    if function == "reaction":
        return Known(component_kind(arguments[1]), firm=True)
    dimension = QUANTITIES[function].dimension
    if dimension is None:
        return None
    return Known(Kind(dimension, _ANGULAR.get(function, 0), function in _ENERGIES), firm=dimension.mass != 0)
