"""Which joints on ground exert nothing along or about an axis, whatever moves: their letters would stand for zero.

Found in numbers, at states and parameters drawn at random: what is zero to rounding at all of them is zero.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import MultibodyError
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import motion_of, pose
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED, Floats

_STATES: Final = 3
_TRIES: Final = 10
_ROUNDING: Final = 1e-10
"""The part of the largest force or moment, of joints and others, below which one is rounding."""

Idle = frozenset[tuple[str, int]]
"""Pairs of a joint's name and a component: forces along ground's axes 0 to 2, moments about them 3 to 5."""


def idle_reactions(mechanism: Mechanism) -> Idle:
    """Return which components of the reactions of joints on ground, moments about the origin, are always zero."""
    base = mechanism.relative or mechanism
    joints = [body.joint_name for body in base.bodies if body.parent < 0]
    rng, found, acting = np.random.default_rng(0), list[Floats](), 0.0
    for _ in range(_TRIES):
        if len(found) == _STATES:
            break
        try:
            exerted, largest = _reactions(base, rng)
        except (*UNDEFINED, MultibodyError):
            continue
        if np.isfinite(exerted).all():
            found.append(exerted)
            acting = max(acting, largest)
    if len(found) < _STATES:
        return frozenset()
    sizes = np.abs(np.array(found)).max(axis=0)
    idle = sizes <= _ROUNDING * sizes.max(initial=acting)
    return frozenset((joint, k) for joint, row in zip(joints, idle.tolist(), strict=True) for k in range(6) if row[k])


def _reactions(mechanism: Mechanism, rng: np.random.Generator) -> tuple[Floats, float]:
    """Return force and moment (joints on ground, 6) about the origin, in ground's axes, at a random state.

    And the largest force or moment that acts on the bodies there.
    """
    given = np.array(parameter_values(mechanism, {}), dtype=float)
    factors, others = rng.uniform(0.5, 1.5, len(given)), rng.uniform(0.5, 1.5, len(given))
    parameters = np.where(given == 0.0, others, given * factors).tolist()
    q, u = (rng.uniform(-1.0, 1.0, len(of)).tolist() for of in (mechanism.coordinates, mechanism.speeds))
    state = state_of(mechanism, float, float(rng.uniform(0.1, 1.0)), q, u, parameters)
    dynamics = composite_body(mechanism, state)
    solved, motion = forward_dynamics(dynamics), motion_of(mechanism, state)
    told = reactions(motion, solved.udot.tolist(), dynamics.rows, solved.multipliers.tolist())
    found = []
    for k, body in enumerate(mechanism.bodies):
        if body.parent < 0:
            turned = np.array(pose(state, body.frame_on_parent)[0], dtype=float)
            values = np.array([float(told[body.joint_name][component]) for component in COMPONENTS])
            force, moment = turned @ values[:3], turned @ values[3:]
            at = np.array(position(motion, Marker("", k, body.frame_on_body)), dtype=float)
            found.append(np.concatenate([force, moment + np.cross(at, force)]))
    acting = [abs(float(x)) for wrench in applied(motion).of_body for vector in wrench for x in vector]
    return np.array(found).reshape(len(found), len(COMPONENTS)), max(acting, default=0.0)
