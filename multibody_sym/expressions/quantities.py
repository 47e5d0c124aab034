"""The quantities of the moving system that an expression can name, such as `reaction(C, fx)`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from multibody_sym.expressions.components import AT, FORCE_NAMES
from multibody_sym.expressions.known_units import Kind, Known
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.units import ENERGY, FORCE, LENGTH, Dimension
from multibody_sym.scalars.node import Node, quantity
from multibody_sym.scalars.traversal import leaves


class Quantity(NamedTuple):
    """What a quantity is asked with, and its dimension (None where that depends on what is asked).

    `others`: what it may be asked with instead, other numbers of arguments. `of_run`: it adds up along a run.
    `of_mode`: it is one of small oscillations, whose number it is asked with.
    """

    arguments: tuple[str, ...]
    dimension: Dimension | None
    others: tuple[tuple[str, ...], ...] = ()
    of_run: bool = False
    of_mode: bool = False

    def taking(self, count: int) -> tuple[str, ...] | None:
        """Return the kinds of so many arguments; None where it is not asked with so many."""
        return next((kinds for kinds in (self.arguments, *self.others) if len(kinds) == count), None)


QUANTITIES: Final[dict[str, Quantity]] = {
    "position": Quantity(("point", "axis"), Dimension(0, 1, 0)),
    "velocity": Quantity(("point", "axis"), Dimension(0, 1, -1)),
    "acceleration": Quantity(("point", "axis"), Dimension(0, 1, -2)),
    "angular_velocity": Quantity(("body", "axis"), Dimension(0, 0, -1)),
    "angular_acceleration": Quantity(("body", "axis"), Dimension(0, 0, -2)),
    "distance": Quantity(("point", "point"), Dimension(0, 1, 0)),
    "'": Quantity(("moving",), None),
    "''": Quantity(("coordinate",), None),
    "reaction": Quantity(("joint", "component"), None),
    "tension": Quantity(("rope",), Dimension(1, 1, -2)),
    "multiplier": Quantity(("constraint",), None),
    "total_energy": Quantity((), ENERGY),
    "kinetic_energy": Quantity((), ENERGY, (("whole",),)),
    "potential_energy": Quantity((), ENERGY, (("store",),)),
    "jacobi_integral": Quantity((), ENERGY),
    "center_of_mass": Quantity(("axis",), Dimension(0, 1, 0)),
    "momentum": Quantity(("axis",), Dimension(1, 1, -1), (("whole", "axis"),)),
    "angular_momentum": Quantity(("axis",), Dimension(1, 2, -1), (("whole", "axis"), ("whole", "about", "axis"))),
    "generalized_momentum": Quantity(("freedom",), None),
    "power": Quantity(("exerting",), Dimension(1, 2, -3)),
    "work": Quantity(("exerting",), ENERGY, of_run=True),
    "impulse": Quantity(("exerting", "axis"), Dimension(1, 1, -1), (("exerting", "whole", "axis"),), of_run=True),
    "frequency": Quantity(("mode",), Dimension(0, 0, -1), of_mode=True),
    "period": Quantity(("mode",), Dimension(0, 0, 1), of_mode=True),
}
"""Every quantity by its name; the arguments are names of the model, joined by dots.

The primes of `phi'` and `phi''` stand behind their one argument, a coordinate or a speed. A component of a `reaction`
is written as a quantity of its own, `fx(hinge)`, which `reaction(hinge, fx)` spells too.

A `whole` is a body or the word `system`; `about` a point, or the word `com` for its own centre of mass; what is
`exerting` a force, constraint, contact or joint, a body whose mass varies, or the word `weight`; a `store` of potential
energy a body or force.
"""
SYSTEM, OWN_CENTRE, WEIGHT = "system", "com", "weight"

_ANGULAR: Final = {"angular_velocity": 1, "angular_acceleration": 1, "angular_momentum": None, "frequency": 1}
_ENERGIES: Final = ("total_energy", "kinetic_energy", "potential_energy", "jacobi_integral", "work")


def of_run(node: Node) -> bool:
    """Return whether an expression names what adds up along a run: work, an impulse."""
    return any(QUANTITIES[leaf.data[0]].of_run for leaf in leaves([node], "quantity") if leaf.data[0] in QUANTITIES)


def force_name(element: str, component: str) -> str:
    """Return the name of a force in expressions: `fx(hinge)`, `tension(rope, 2)`, `multiplier(row)`, `friction(c)`.

    `component` is one of an element's reactions; other words than those of the language are parts of friction in a
    joint, with a number behind where they have several components.
    """
    if component == "multiplier":
        return text(quantity(component, (element,)))
    if component.startswith("tension"):
        run = component.removeprefix("tension")
        return text(quantity("tension", (f"{element}.{run}" if run else element,)))
    if component not in FORCE_NAMES:
        part, _, number = component.partition("_")
        element, component = f"{element}.{part}", f"friction_{number}" if number else "friction"
    return text(quantity("reaction", (element, component)))


def component_kind(component: str) -> Kind:
    """Return the kind of a component of a reaction: a force, but for `mx` .. `mz`, what resists rolling and places."""
    if component in AT:
        return Kind(LENGTH)
    turns = component.startswith("m") or component.startswith("rolling")
    return Kind(ENERGY, angle=None) if turns else Kind(FORCE)


def quantity_known(function: str, arguments: Sequence[str]) -> Known | None:
    """Return what is known of a quantity from what is asked; None where that depends on the constraint or freedom."""
    if function == "reaction":
        return Known(component_kind(arguments[1]), firm=True)
    dimension = QUANTITIES[function].dimension
    if dimension is None:
        return None
    return Known(Kind(dimension, _ANGULAR.get(function, 0), function in _ENERGIES), firm=dimension.mass != 0)
