"""The sweep: every joint's wrench against inverse dynamics, and what factorising V buys on a chain of thin rods."""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import random_case, random_state
from plain_sweep import inverted, plain_sweep

from multibody_sym.analysis.check import LARGEST_ON_TREES, compare_formalisms, dalembert, ratio
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.articulated_body import hybrid_dynamics, swept, swept_joints
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics, joint_wrenches, unbalanced_wrenches
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Spherical
from multibody_sym.model.system import System

SEEDS = range(25)


def random_motion(seed: int) -> Motion:
    case = random_case(seed)
    return case.motion(*random_state(np.random.default_rng(seed), case))


def sizes(wrenches: np.ndarray) -> float:
    return float(np.abs(wrenches).max(initial=1e-9))


def thin_rods(count: int) -> Motion:
    """Return a chain of thin rods with ball joints, bent at random."""
    points = {"end": [1, 0, 0]}
    rod = {"mass": 1, "com": [0.5, 0, 0], "inertia": {"Ixx": 1e-6, "Iyy": 1 / 12, "Izz": 1 / 12}}
    bodies = {f"rod{k}": Body(**rod, points=points) for k in range(count)}
    joints = {f"ball{k}": Spherical(f"rod{k - 1}.end" if k else "ground", f"rod{k}") for k in range(count)}
    resolved = mechanism(System("rods", gravity=[0, 0, -9.81], bodies=bodies, joints=joints))
    rng = np.random.default_rng(count)
    q = rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    state = state_of(resolved, float, 0.0, q.ravel().tolist(), rng.uniform(-1, 1, 3 * count).tolist(), [])
    return motion_of(resolved, state)


@pytest.mark.parametrize("seed", SEEDS)
def test_wrenches_of_all_joints_are_those_of_inverse_dynamics(seed: int) -> None:
    motion = random_motion(seed)
    forces = applied_forces(motion)
    left = unbalanced_wrenches(motion, [0] * len(motion.state.u), forces.of_body)
    udot, found = swept(motion, swept_joints(motion), left, forces.of_speed)
    expected = np.array(joint_wrenches(motion, udot, forces.of_body), dtype=float)
    np.testing.assert_allclose(np.array(found, dtype=float), expected, atol=1e-9 * sizes(expected))


@pytest.mark.parametrize("seed", SEEDS)
def test_plain_sweep_finds_the_same_motion_where_it_is_short(seed: int) -> None:
    case = random_case(seed, bodies=(1, 3))
    motion = case.motion(*random_state(np.random.default_rng(seed), case))
    udot, wrenches = plain_sweep(motion)
    expected = FORMALISMS["composite_body"](motion.mechanism, motion.state).bias_acceleration
    np.testing.assert_allclose(udot, expected, rtol=1e-6, atol=1e-6 * sizes(np.array(expected)))
    loads = applied_forces(motion).of_body
    transmitted = np.array(joint_wrenches(motion, udot, loads), dtype=float).reshape(-1, 6)
    size = sizes(transmitted) + sizes(np.array(loads, dtype=float))
    np.testing.assert_allclose(np.array(wrenches, dtype=float), transmitted, atol=1e-6 * size)


@pytest.mark.parametrize(("count", "lost"), [(30, 1e2), (100, 1e4)])
def test_factorising_keeps_long_chains_accurate_and_inverting_does_not(count: int, lost: float) -> None:
    motion = thin_rods(count)
    factorised = {name: FORMALISMS[name] for name in ("sweep", "block_ldl")}
    assert max(compare_formalisms(motion.mechanism, [motion.state], factorised).values()) <= LARGEST_ON_TREES
    assert not ratio(dalembert(motion), plain_sweep(motion)[0], []) <= lost


def test_inverse_by_cofactors() -> None:
    rng = np.random.default_rng(0)
    for size in range(1, 7):
        matrix = rng.normal(size=(size, size)) + 4 * np.eye(size)
        np.testing.assert_allclose(inverted(matrix.tolist()), np.linalg.inv(matrix), atol=1e-12)


# --- hybrid dynamics -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_given_accelerations_and_their_forces_satisfy_the_equations_of_motion(seed: int) -> None:
    """M udot + c - Q is the force found at given joints and zero at the others."""
    motion = random_motion(seed)
    rng = np.random.default_rng(seed)
    bodies = motion.mechanism.bodies
    given = [k for k in range(len(bodies)) if rng.random() < 0.5]
    wanted = rng.uniform(-5, 5, len(motion.state.u))
    held = [k for index in given for k in bodies[index].u]
    udot, forces = hybrid_dynamics(motion, given, wanted.tolist())
    assert [udot[k] for k in held] == [wanted[k] for k in held]
    reference = dalembert(motion)
    missing = reference.mass_matrix @ udot - (reference.applied - reference.velocity_terms) - forces
    size = np.abs(reference.mass_matrix) @ np.abs(udot) + reference.absolute_applied
    assert (np.abs(missing) <= 1e-9 * (size + reference.absolute_velocity_terms)).all()
    assert all(forces[k] == 0 for k in range(len(forces)) if k not in held)


def test_all_given_is_inverse_and_none_given_forward_dynamics() -> None:
    for seed in SEEDS:
        motion = random_motion(seed)
        free, nothing = hybrid_dynamics(motion, (), [0] * len(motion.state.u))
        expected = FORMALISMS["block_ldl"](motion.mechanism, motion.state).bias_acceleration
        np.testing.assert_allclose(free, expected, rtol=1e-6, atol=1e-9 * sizes(np.array(expected)))
        assert not any(nothing)
        wanted = np.random.default_rng(seed).uniform(-5, 5, len(free)).tolist()
        udot, forces = hybrid_dynamics(motion, range(len(motion.bodies)), wanted)
        loads = applied_generalized_forces(motion, applied_forces(motion))
        needed = np.array(inverse_dynamics(motion, wanted)) - loads
        assert udot == wanted
        np.testing.assert_allclose(forces, needed, atol=1e-9 * sizes(np.array(loads)) + 1e-9 * sizes(needed))
