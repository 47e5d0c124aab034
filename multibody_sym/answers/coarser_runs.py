"""The error of numbers from runs, as coarser runs show it: larger tolerances, or twice the step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from multibody_sym.model.declaration.system import System
from multibody_sym.scalars.node import TWO, multiply
from multibody_sym.simulation.coarser import COARSER, LEFT


def accuracy(system: System, tolerances: Mapping[str, float], *, is_coarse: bool) -> dict[str, Any]:
    """Return the arguments of `simulate` for runs with these tolerances, or the system's own step, or coarse ones."""
    step = system.simulation.step
    if step is None:
        return {name: COARSER * x if is_coarse else x for name, x in tolerances.items()}
    return {"step": multiply(TWO, step)} if is_coarse else {}


def part_of_difference(system: System) -> float:
    """Return the part of the difference to coarse runs that bounds the error of the others."""
    return LEFT if system.simulation.step is None else 1.0
