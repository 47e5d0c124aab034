"""Positions, velocities and accelerations of all kinds of joints, against exact derivatives of positions."""

from __future__ import annotations

import numpy as np
import pytest
from exact import Exact, flat
from mechanisms import random_case, random_state

from multibody_sym.mechanics.motion import accelerations, coordinate_rates
from multibody_sym.mechanics.points import acceleration, position, velocity
from multibody_sym.model.steps import Follow

SEEDS = range(30)


def skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


@pytest.mark.parametrize("seed", SEEDS)
def test_velocities_are_the_rates_of_positions(seed: int) -> None:
    case = random_case(seed, bodies=(1, 5))
    state = random_state(np.random.default_rng(seed), case)
    exact, motion = Exact(case), case.motion(*state)
    for index, body in enumerate(motion.bodies):
        R = np.array(motion.poses[index][0], dtype=float)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-13)
        assert np.linalg.det(R) > 0
        pdot = exact.values(exact.rates(exact.motion.poses[index][1]), state)
        Rdot = exact.values(exact.rates(flat(exact.motion.poses[index][0])), state).reshape(3, 3)
        np.testing.assert_allclose(R @ np.array(body.v_WB, dtype=float), pdot, atol=1e-12)
        np.testing.assert_allclose(R @ skew(np.array(body.w_WB, dtype=float)), Rdot, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_accelerations_are_the_rates_of_velocities(seed: int) -> None:
    case = random_case(seed, bodies=(1, 5))
    rng = np.random.default_rng(seed)
    state = random_state(rng, case)
    udot = rng.uniform(-3, 3, len(state[2])).tolist()
    exact, motion = Exact(case), case.motion(*state)
    for index, (a, alpha) in enumerate(accelerations(motion, udot)):
        R = np.array(motion.poses[index][0], dtype=float)
        pddot = exact.values(exact.rates(exact.rates(exact.motion.poses[index][1])), state, udot)
        wdot = exact.values(exact.rates(exact.motion.bodies[index].w_WB), state, udot)
        np.testing.assert_allclose(R @ np.array(a, dtype=float), pddot, atol=1e-10)
        np.testing.assert_allclose(np.array(alpha, dtype=float), wdot, atol=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_partial_velocities_are_what_unit_speeds_add_to_velocities(seed: int) -> None:
    case = random_case(seed, bodies=(1, 5))
    t, q, u = random_state(np.random.default_rng(seed), case)
    at_rest = case.motion(t, q, [0.0] * len(u)).bodies
    for index, (body, moved) in enumerate(zip(case.mechanism.bodies, case.motion(t, q, u).bodies, strict=True)):
        given_v, given_w = (np.array(v, dtype=float) for v in (at_rest[index].v_WB, at_rest[index].w_WB))
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            alone = case.motion(t, q, [float(j == k) for j in range(len(u))]).bodies[index]
            np.testing.assert_allclose(np.array(linear, dtype=float) + given_v, alone.v_WB, atol=1e-12)
            np.testing.assert_allclose(np.array(angular, dtype=float) + given_w, alone.w_WB, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_points_move_with_their_bodies(seed: int) -> None:
    case = random_case(seed, bodies=(1, 4))
    rng = np.random.default_rng(seed)
    state = random_state(rng, case)
    udot = rng.uniform(-3, 3, len(state[2])).tolist()
    exact, motion = Exact(case), case.motion(*state)
    bodies = accelerations(motion, udot)
    for name in ("b1.a", "b1.F", "ground.b"):
        marker = case.mechanism.markers[name]
        place = position(exact.motion, marker)
        np.testing.assert_allclose(velocity(motion, marker), exact.values(exact.rates(place), state), atol=1e-12)
        found = np.array(acceleration(motion, marker, bodies), dtype=float)
        np.testing.assert_allclose(found, exact.values(exact.rates(exact.rates(place)), state, udot), atol=1e-10)


@pytest.mark.parametrize("seed", SEEDS)
def test_frames_coincide_at_zero_coordinates(seed: int) -> None:
    case = random_case(seed, bodies=(1, 6))
    zero = [1.0 if c.name.endswith("_qw") else 0.0 for c in case.mechanism.coordinates]
    motion = case.motion(0.0, zero, [0.0] * len(case.mechanism.speeds))
    for index, body in enumerate(case.mechanism.bodies):
        if any(step.motion is not None or isinstance(step, Follow) for step in body.steps):
            continue  # a curve need not lead through the origin
        on_parent, on_body = (case.system.joints[body.joint_name].parent, case.system.joints[body.joint_name].child)
        ends = [np.array(position(motion, case.mechanism.markers[name]), dtype=float) for name in (on_parent, on_body)]
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-13)
        assert body.parent < index


def test_quaternion_rates_keep_unit_length() -> None:
    for seed in SEEDS:
        case = random_case(seed)
        _, q, u = random_state(np.random.default_rng(seed), case)
        qdot = np.array(coordinate_rates(case.mechanism, q, u), dtype=float)
        for body in case.mechanism.bodies:
            for places in map(list, body.quaternions):
                assert abs(np.array(q)[places] @ qdot[places]) < 1e-14
