"""Coordinates that constraints hold where they are: a lever pressed on a drum does not turn while it touches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import constraint_jacobian, row_motions
from multibody_sym.kinematics.state import slot_state, state_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import CLOSED, rank
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.traversal import leaves

_TIMED: Final = ("t", "inputs", "u")


def held_coordinates(mechanism: Mechanism, q: Sequence[float], parameters: Sequence[float]) -> frozenset[int]:
    """Return the places of coordinates that rows hold at a position for as long as these act; none with quaternions.

    So many rows that name so many coordinates alone, and not the time, and are independent there, leave them no other
    position near by.
    """
    if len(q) != len(mechanism.speeds) or any(body.quaternions for body in mechanism.bodies):
        return frozenset()
    named = _named(mechanism)
    if not named:
        return frozenset()
    state = state_of(mechanism, float, 0.0, q, [0.0] * len(mechanism.speeds), parameters)
    jacobian = constraint_jacobian(row_motions(motion_of(mechanism, state)))
    held: set[int] = set()
    while True:
        left = {row: places - held for row, places in named.items() if places - held}
        groups = [frozenset(places) for places in left.values()] + _joined(list(left.values()))
        found = next((group for group in groups if _fixes(group, left, jacobian)), None)
        if found is None:
            return frozenset(held)
        held |= found


def _named(mechanism: Mechanism) -> dict[int, set[int]]:
    """Return the coordinates that each row on positions names, by the rows' numbers, but for those that name time."""
    found = {}
    for k, row in enumerate(row_motions(motion_of(mechanism, slot_state(mechanism)))):
        if row.holonomic and row.kinematic:
            slots = [leaf.data for leaf in leaves([as_node(row.phi)], "slot")]
            if not any(array in _TIMED for array, _ in slots):
                found[k] = {index for array, index in slots if array == "q"}
    return found


def _joined(groups: Sequence[set[int]]) -> list[frozenset[int]]:
    """Return the coordinates that rows join, directly or by others."""
    found: list[set[int]] = []
    for group in groups:
        apart = [other for other in found if not other & group]
        found = [*apart, set(group).union(*(other for other in found if other & group))]
    return [frozenset(group) for group in found]


def _fixes(group: frozenset[int], named: dict[int, set[int]], jacobian: Floats) -> bool:
    """Return whether the rows that name these coordinates alone are as many independent ones."""
    rows = [row for row, places in named.items() if places <= group]
    return len(rows) >= len(group) and rank(jacobian[np.ix_(rows, sorted(group))], CLOSED) == len(group)
