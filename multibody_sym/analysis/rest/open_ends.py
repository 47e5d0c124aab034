"""Ends that do not belong to their range of rest: towards them forces grow without bound."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.analysis.rest.position import Position
from multibody_sym.analysis.rest.rest_ends import RestEnd
from multibody_sym.numerics.feasibility import Conditions
from multibody_sym.numerics.native import linear_program

_WAYS: Final = (1e-4, 1e-5)
"""How far inside an end (of its size, 1 at least) forces are looked at, and at twice that."""
_POLE: Final = 1e-2
"""By how much the forces there may differ from those of a pole of first order, of which one is twice the other."""


def open_end(position: Position, name: str, end: RestEnd, outward: int) -> tuple[float, float] | None:
    """Return the pole of the least forces at an end of a range, and its error; None where they stay finite there."""
    found = [end.value]
    for way in _WAYS:
        near = found[-1] - outward * way * max(abs(end.value), 1.0)
        far = 2 * near - found[-1]
        one, two = (_least_force(position, name, end, x) for x in (near, far))
        if one is None or two is None or not abs(one - 2 * two) <= _POLE * one:
            return None
        found.append((one * near - two * far) / (one - two))
    return found[-1], abs(found[-1] - found[-2]) * _WAYS[1] / _WAYS[0]


def _least_force(position: Position, name: str, end: RestEnd, value: float) -> float | None:
    conditions = position.conditions({name: value}, position.statics.limits(end.choice), moves=True)
    return None if conditions is None else least_size(conditions)


def least_size(conditions: Conditions) -> float | None:
    """Return the least size of the largest component of an x that fulfils conditions, None where none does."""
    n = conditions.equal.shape[1]
    one = np.ones((n, 1))
    upper = np.vstack(
        [
            np.hstack([-conditions.cone, np.zeros((len(conditions.cone), 1))]),
            np.hstack([np.eye(n), -one]),
            np.hstack([-np.eye(n), -one]),
        ]
    )
    equal = np.hstack([conditions.equal, np.zeros((len(conditions.equal), 1))])
    cost = np.r_[np.zeros(n), 1.0]
    free = [(None, None)] * len(cost)
    found = linear_program(cost, free, below=(upper, np.zeros(len(upper))), equal=(equal, conditions.right))
    return found.value if found.status == 0 else None
