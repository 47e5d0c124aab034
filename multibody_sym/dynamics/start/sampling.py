"""Random states of a mechanism, at which routes and theorems are compared."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing import Rows, closed_near, moved
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics, verify_inertia
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import MultibodyError
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import GROWING, ROUNDED, least_squares, worth

_TRIES: Final = 20
_REJECTED: Final = 10
"""After so many states passed over constraints are closed no more: where they are, rows may nearly depend on others."""
_STILL: Final = 1e-13
"""Of speeds that are drawn from -1 to 1, what rows leave of one that they hold: rounding."""


def sampled_states(mechanism: Mechanism, begin: Start, count: int, seed: int = 0) -> list[State]:
    """Return the state at the start and up to `count` random ones around it, over floats.

    Speeds satisfy H u = -phi_t, coordinates phi = 0 where Newton's method brings them there (the equations of motion
    hold without). States are passed over at which something declared has no value, M is singular, or no reactions
    satisfy the law of friction; after many of these phi = 0 is not asked for.
    """
    rng = np.random.default_rng(seed)
    states = [state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)]
    rejected = 0
    for _ in range(_TRIES * count):
        if len(states) > count:
            break
        try:
            states.append(_near(mechanism, begin, rng, closes=rejected < _REJECTED))
        except (*UNDEFINED, MultibodyError):
            rejected += 1
    return states


def _near(mechanism: Mechanism, begin: Start, rng: np.random.Generator, *, closes: bool) -> State:
    change, u = (rng.uniform(-1.0, 1.0, len(mechanism.speeds)) for _ in range(2))
    rows = Rows(mechanism, begin.parameters, range(len(mechanism.rows)), float(rng.uniform(0.0, 1.0)))
    apart = moved(mechanism, np.array(begin.q, dtype=float), change)
    closed = closed_near(rows, apart) if closes else None
    if closed is None and any(body.is_foot for body in mechanism.bodies):
        raise ValueError("a curve is not where its foot is, and what touches it is told by that")
    q = apart if closed is None else closed
    speeds = u + _correction(rows.motion(q, u))
    motion = rows.motion(q, np.where(np.abs(speeds) > _STILL, speeds, 0.0))
    verify_inertia(motion)
    _verify_regular(motion)
    applied(motion)
    _verify_friction(motion)
    return motion.state


def _restricting(motion: Motion) -> tuple[Floats, Floats]:
    """Return H (s x n) and phidot (s) of the rows that restrict the motion: others define forces."""
    rows = [row for row in row_motions(motion) if row.kinematic]
    jacobian = np.array([row.jacobian for row in rows], dtype=float).reshape(len(rows), len(motion.state.u))
    return jacobian, np.array([row.phidot for row in rows], dtype=float)


def _verify_regular(motion: Motion) -> None:
    """Raise ValueError where rows are nearly but not quite dependent: forces grow there beyond all bounds."""
    sizes = worth(_restricting(motion)[0])
    if ((sizes > ROUNDED) & (sizes < GROWING)).any():
        raise ValueError("a nearly singular position")


def _verify_friction(motion: Motion) -> None:
    """Raise ValueError where friction of joints has no direction, as reactions grow with it without end."""
    dynamics = composite_body(motion.mechanism, motion.state)
    if dynamics.friction is not None and dynamics.friction.beside and not forward_dynamics(dynamics).settled:
        raise ValueError("friction jams")


def _correction(motion: Motion) -> Floats:
    """Return the smallest change of the speeds that satisfies H u = -phi_t."""
    jacobian, phidot = _restricting(motion)
    return least_squares(jacobian, -phidot, GROWING)
