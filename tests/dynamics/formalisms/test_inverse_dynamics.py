"""Recursive Newton-Euler against M udot + c, and its reactions against the free-body balance of every body."""

from __future__ import annotations

import numpy as np
import pytest
from exact import Exact
from mechanisms import random_case, random_state

from multibody_sym.analysis.check import dalembert
from multibody_sym.dynamics.balance import rates_of
from multibody_sym.dynamics.formalisms.composite_body import composite_body, inverse_dynamics
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions, wrenches_on_bodies
from multibody_sym.mechanics.motion import pose
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.row_kinematics import row_motions

SEEDS = range(25)


@pytest.mark.parametrize("seed", SEEDS)
def test_is_M_udot_plus_c(seed: int) -> None:
    case = random_case(seed)
    rng = np.random.default_rng(seed)
    motion = case.motion(*random_state(rng, case))
    udot = rng.uniform(-3, 3, len(motion.state.u))
    reference = dalembert(motion)
    expected = reference.mass_matrix @ udot + reference.velocity_terms
    size = np.abs(reference.mass_matrix) @ np.abs(udot) + reference.absolute_velocity_terms
    assert (np.abs(np.array(inverse_dynamics(motion, udot.tolist())) - expected) <= 1e-12 * size).all()


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_reactions_balance_every_body(seed: int, rows: bool) -> None:
    """Own reaction - those of the joints it carries + loads = exact rate of momentum, moments about the origin."""
    case = random_case(seed, bodies=(1, 5), rows=rows)
    state = random_state(np.random.default_rng(seed), case)
    motion = case.motion(*state)
    found = forward_dynamics(composite_body(case.mechanism, motion.state))
    rates = Exact(case).values(rates_of(case.mechanism).changes, state, found.udot.tolist()).reshape(-1, 6)
    given = wrenches_on_bodies(motion, row_motions(motion), found.multipliers.tolist())
    in_joints = reactions(motion, found.udot.tolist(), row_motions(motion), found.multipliers.tolist())
    total = np.array([in_world(motion, k, wrench) for k, wrench in enumerate(given)])
    size = np.abs(total)
    for k, body in enumerate(case.mechanism.bodies):
        wrench = reaction_in_world(case, motion, k, in_joints[body.joint_name])
        for index, sign in ((k, 1.0), (body.parent, -1.0)):
            if index >= 0:
                total[index] += sign * wrench
                size[index] += np.abs(wrench)
    scale = size.max(axis=1, keepdims=True) + np.abs(rates).max(axis=1, keepdims=True)
    scale += 1e-2 * scale.max() + 1e-9  # a body that nothing moves has only what cancelling accelerations round
    np.testing.assert_allclose(total / scale, rates / scale, atol=1e-11)


def in_world(motion, index, wrench) -> np.ndarray:
    R, p = (np.array(part, dtype=float) for part in motion.poses[index])
    force, moment = (R @ np.array(part, dtype=float) for part in wrench)
    return np.concatenate([force, moment + np.cross(p, force)])


def reaction_in_world(case, motion, index, components) -> np.ndarray:
    """Return a reaction (parent's joint frame, about the joint's point on the child) about the origin, in the world."""
    body = case.mechanism.bodies[index]
    R_WP = np.array(motion.rotation(body.parent), dtype=float)
    R = R_WP @ np.array(pose(motion.state, body.frame_on_parent)[0], dtype=float)
    joint = case.system.joints.get(body.joint_name)
    child = case.mechanism.markers[joint.child if joint else body.name]
    point = np.array(position(motion, child), dtype=float)
    force = R @ [components[name] for name in ("fx", "fy", "fz")]
    moment = R @ [components[name] for name in ("mx", "my", "mz")]
    return np.concatenate([force, moment + np.cross(point, force)])
