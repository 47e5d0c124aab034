"""Speeds that stand still as long as a mode lasts: rows at rest hold them, wherever else the mechanism goes."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import coordinate_rates, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import row_space

_HELD: Final = 1e-10
"""What the rows may leave of a unit speed that they hold."""
_ASIDE: Final = 1e-3
"""How far, as turns and against the model's size, the position lies aside at which the rows hold the same speeds."""


def held_speeds(mechanism: Mechanism, parameters: Floats, t: float, q: Floats) -> tuple[int, ...]:
    """Return the places of the speeds that the rows of a mechanism in a mode hold at zero, here and beside.

    A speed is held if its unit vector lies in the space of rows that have no part of their own in motion, as a belt's
    or a drive's has: H u = 0 and H udot = 0 for u = 0.
    """
    here = _held(mechanism, parameters, t, q) if mechanism.rows else set[int]()
    if not here:
        return ()
    aside = np.array([np.sin(1.0 + 2.0 * k) for k in range(len(mechanism.speeds))]) * _ASIDE
    moved = np.array(coordinate_rates(mechanism, q.tolist(), aside.tolist()), dtype=float)
    return tuple(sorted(here & _held(mechanism, parameters, t + _ASIDE, q + moved)))


def _held(mechanism: Mechanism, parameters: Floats, t: float, q: Floats) -> set[int]:
    still = [0.0] * len(mechanism.speeds)
    motion = motion_of(mechanism, state_of(mechanism, float, t, q.tolist(), still, parameters.tolist()))
    rows = [
        row.jacobian
        for row in row_motions(motion)
        if row.kinematic and float(row.phidot) == 0.0 and float(row.gamma) == 0.0
    ]
    matrix = np.array(rows, dtype=float).reshape(len(rows), len(still))
    sizes = np.linalg.norm(matrix, axis=1)
    matrix = matrix[sizes > 0.0] / sizes[sizes > 0.0][:, None]
    if not len(matrix):
        return set()
    kept = row_space(matrix, _HELD)
    left = np.linalg.norm(np.eye(len(still)) - kept.T @ kept, axis=0)
    return set(np.flatnonzero(left <= _HELD).tolist())
