"""Energies, generalised forces and wrenches, each by a second route."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from exact import Exact
from mechanisms import Case, random_case, random_state

from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy, split
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.load_records import JointForce, JointSpring, PointForce, PointSpring
from multibody_sym.mechanics.motion import coordinate_rates
from multibody_sym.mechanics.points import Wrenches, add_force, generalized_forces, velocity
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.scalars.calculus import gradient
from multibody_sym.scalars.node import as_node

SEEDS = range(25)


@pytest.mark.parametrize("seed", SEEDS)
def test_kinetic_energy_is_half_u_M_u(seed: int) -> None:
    """Of the part that is even in u and vanishes with it; prescribed motion adds parts of lower degree."""
    case = random_case(seed)
    t, q, u = random_state(np.random.default_rng(seed), case)
    motion = case.motion(t, q, u)
    matrix = np.array(mass_matrix(motion), dtype=float)
    there, back, given = (kinetic_energy(case.motion(t, q, [k * x for x in u])) for k in (1.0, -1.0, 0.0))
    even = (there + back) / 2 - given
    assert even == pytest.approx(np.array(u) @ matrix @ np.array(u) / 2, rel=1e-12, abs=1e-13 * given)


@pytest.mark.parametrize("seed", SEEDS)
def test_conservative_forces_are_the_gradient_of_the_potential(seed: int) -> None:
    """Q = -N^T dV/dq for the weight and every load that has a potential."""
    case = random_case(seed, bodies=(1, 5))
    t, q, u = random_state(np.random.default_rng(seed), case)
    stored, working = split(case.mechanism.loads)
    undamped = [replace(load, damping=as_node(0)) if load.spring is not None else load for load in stored]
    motion, exact = case.motion(t, q, u), Exact(case)
    forces = np.array(applied_generalized_forces(motion, applied_forces(motion, undamped)), dtype=float)
    slope = exact.values(gradient(as_node(potential_energy(exact.motion)), exact.q), (t, q, u))
    for k in range(len(u)):
        column = np.array(coordinate_rates(case.mechanism, q, [float(j == k) for j in range(len(u))]), dtype=float)
        assert forces[k] == pytest.approx(-slope @ column, abs=1e-9 * (1 + np.abs(forces).max()))
    assert all(load.spring is not None or load.energy is not None for load in stored)
    assert len(stored) + len(working) >= len(case.mechanism.loads)


def test_springs_that_know_the_state_do_work_instead() -> None:
    working = (load for seed in range(200) for load in split(random_case(seed, bodies=(1, 4)).mechanism.loads)[1])
    assert any(isinstance(load, PointSpring) and load.stiffness.shadow is None for load in working)


@pytest.mark.parametrize("seed", SEEDS)
def test_power_of_forces_is_force_times_velocity(seed: int) -> None:
    case = random_case(seed, bodies=(1, 6))
    rng = np.random.default_rng(seed)
    t, q, u = random_state(rng, case)
    motion = case.motion(t, q, u)
    for name, marker in case.mechanism.markers.items():
        if marker.body < 0:
            continue
        force, wrenches = tuple(rng.uniform(-2, 2, 3).tolist()), Wrenches(len(motion.bodies))
        add_force(wrenches, motion, marker, force)
        power = np.array(generalized_forces(motion, wrenches.of_body), dtype=float) @ np.array(u)
        assert power == pytest.approx(np.dot(force, by_speeds(case, t, q, u, marker)), abs=1e-10), name


@pytest.mark.parametrize("seed", SEEDS)
def test_power_of_loads(seed: int) -> None:
    """The generalised force of a load times u is the load's own power: F . v, M qdot, -c (dl/dt)^2 ..."""
    case = random_case(seed, bodies=(1, 5))
    t, q, u = random_state(np.random.default_rng(seed), case)
    motion = case.motion(t, q, u)
    for load in case.mechanism.loads:
        force = np.array(applied_generalized_forces(motion, applied_forces(motion, [load], weight=False)), dtype=float)
        power = force @ np.array(u)
        if isinstance(load, PointForce):
            axes = np.array(motion.rotation(load.axes), dtype=float)
            expected = axes @ np.array(motion.state.values(load.value)) @ by_speeds(case, t, q, u, load.at)
        elif isinstance(load, JointForce):
            expected = np.prod(motion.state.values([load.value, load.rate]))
        elif isinstance(load, JointSpring):
            k, d, rest = motion.state.values([load.stiffness, load.damping, load.rest])
            coordinate, rate = motion.state.values([load.coordinate, load.rate])
            expected = -(k * (coordinate - rest) + d * rate) * rate
        else:
            continue
        assert power == pytest.approx(expected, abs=1e-9 * (1 + abs(expected)))


def by_speeds(case: Case, t: float, q: list[float], u: list[float], marker: Marker) -> np.ndarray:
    """Return the velocity of a point less what it would be with all speeds zero."""
    moving, given = (velocity(case.motion(t, q, speeds), marker) for speeds in (u, [0.0] * len(u)))
    return np.array(moving, dtype=float) - np.array(given, dtype=float)


def test_ground_takes_forces_and_forgets_them() -> None:
    case = next(case for case in map(random_case, range(20)) if case.mechanism.markers["ground.a"].body < 0)
    motion = case.motion(*random_state(np.random.default_rng(1), case))
    wrenches = Wrenches(len(motion.bodies))
    add_force(wrenches, motion, case.mechanism.markers["ground.a"], (1.0, 2.0, 3.0))
    assert not np.array(wrenches.of_body, dtype=float).any()
