"""Random states of a mechanism, at which routes and theorems are compared."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from multibody_sym.dynamics.assembly import moved
from multibody_sym.dynamics.forward_dynamics import UNDEFINED, verify_inertia
from multibody_sym.dynamics.start import Start
from multibody_sym.errors import MultibodyError
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism import Mechanism

Floats = npt.NDArray[np.float64]

_TRIES = 20


def sampled_states(mechanism: Mechanism, begin: Start, count: int, seed: int = 0) -> list[State]:
    """Return the state at the start and up to `count` random ones around it, over floats.

    Coordinates need not satisfy phi = 0 (the equations of motion hold without), speeds satisfy H u = -phi_t. States at
    which something declared has no value, or M is singular, are passed over.
    """
    rng = np.random.default_rng(seed)
    states = [state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)]
    for _ in range(_TRIES * count):
        if len(states) > count:
            break
        try:
            states.append(_near(mechanism, begin, rng))
        except (*UNDEFINED, MultibodyError):
            continue
    return states


def _near(mechanism: Mechanism, begin: Start, rng: np.random.Generator) -> State:
    change, u = (rng.uniform(-1.0, 1.0, len(mechanism.speeds)) for _ in range(2))
    q, t = moved(mechanism, np.array(begin.q, dtype=float), change), float(rng.uniform(0.0, 1.0))
    free = state_of(mechanism, float, t, q.tolist(), u.tolist(), begin.parameters)
    admissible = u + _correction(motion_of(mechanism, free))
    state = state_of(mechanism, float, t, q.tolist(), admissible.tolist(), begin.parameters)
    motion = motion_of(mechanism, state)
    verify_inertia(motion)
    applied(motion)
    return state


def _correction(motion: Motion) -> Floats:
    """Return the smallest change of the speeds that satisfies H u = -phi_t."""
    rows = row_motions(motion)
    jacobian = np.array([row.jacobian for row in rows], dtype=float).reshape(-1, len(motion.state.u))
    change: Floats = np.linalg.lstsq(jacobian, -np.array([row.phidot for row in rows], dtype=float), rcond=None)[0]
    return change
