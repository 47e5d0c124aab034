"""Quantities that outputs and questions name, against kinematics and balances."""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state
from scipy.spatial.transform import Rotation

from multibody_sym.analysis.check import partial_velocities
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import Accelerations, forward_dynamics
from multibody_sym.dynamics.programs.quantities import quantities
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.motion import Motion, accelerations
from multibody_sym.mechanics.row_records import DistanceRow, RopeRow
from multibody_sym.scalars.node import Node, quantity
from multibody_sym.text.parser import QUANTITIES

SEEDS = range(12)


def instant(seed: int) -> tuple[Case, Motion, Accelerations]:
    cases = (random_case(seed + 100 * k, bodies=(1, 4), rows=True) for k in range(10))
    case = next(case for case in cases if not case.mechanism.drives)
    motion = case.motion(*random_state(np.random.default_rng(seed), case))
    return case, motion, forward_dynamics(composite_body(case.mechanism, motion.state))


def value(motion: Motion, found: Accelerations, function: str, *names: str) -> float:
    asked: list[Node] = [quantity(function, names)]
    return float(quantities(motion, found.udot.tolist(), found.multipliers.tolist(), asked)[asked[0]])


def vector(motion: Motion, found: Accelerations, function: str, *names: str) -> np.ndarray:
    return np.array([value(motion, found, function, *names, axis) for axis in "xyz"])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_body_alone_means_its_centre_of_mass(seed: int) -> None:
    case, motion, found = instant(seed)
    u, body = np.array(motion.state.u), case.mechanism.bodies[0].name
    R, p = (np.array(part, dtype=float) for part in motion.poses[0])
    com = np.array(motion.masses[0].com, dtype=float)
    np.testing.assert_allclose(vector(motion, found, "position", body), p + R @ com, atol=1e-13)
    partials = partial_velocities(motion)[0]
    spin = partials.angular @ u
    expected = partials.linear @ u + np.cross(spin, R @ com)
    np.testing.assert_allclose(vector(motion, found, "velocity", body), expected, atol=1e-12)
    np.testing.assert_allclose(vector(motion, found, "angular_velocity", body), spin, atol=1e-12)
    a, alpha = accelerations(motion, found.udot.tolist())[0]
    turning = R @ np.array(alpha, dtype=float)
    np.testing.assert_allclose(vector(motion, found, "angular_acceleration", body), turning, rtol=1e-9, atol=1e-9)
    expected = R @ np.array(a, dtype=float) + np.cross(turning, R @ com) + np.cross(spin, np.cross(spin, R @ com))
    np.testing.assert_allclose(vector(motion, found, "acceleration", body), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_points_distances_and_energies(seed: int) -> None:
    _, motion, found = instant(seed)
    between = vector(motion, found, "position", "b1.a") - vector(motion, found, "position", "ground.b")
    assert value(motion, found, "distance", "ground.b", "b1.a") == pytest.approx(np.linalg.norm(between))
    assert not vector(motion, found, "velocity", "ground.b").any()
    assert value(motion, found, "kinetic_energy") == pytest.approx(kinetic_energy(motion))
    assert value(motion, found, "potential_energy") == pytest.approx(potential_energy(motion))
    total = kinetic_energy(motion) + potential_energy(motion)
    assert value(motion, found, "total_energy") == pytest.approx(total)


@pytest.mark.parametrize("seed", SEEDS)
def test_momenta_are_sums_over_the_bodies(seed: int) -> None:
    case, motion, found = instant(seed)
    momentum, angular, moment = np.zeros(3), np.zeros(3), np.zeros(3)
    for index, body in enumerate(case.mechanism.bodies):
        mass, R = motion.masses[index], np.array(motion.rotation(index), dtype=float)
        p = float(mass.mass) * vector(motion, found, "velocity", body.name)
        momentum += p
        moment += float(mass.mass) * vector(motion, found, "position", body.name)
        spin = R @ np.array(mass.inertia, dtype=float) @ R.T @ vector(motion, found, "angular_velocity", body.name)
        angular += spin + np.cross(vector(motion, found, "position", body.name), p)
    com = moment / sum(float(mass.mass) for mass in motion.masses)
    np.testing.assert_allclose(vector(motion, found, "center_of_mass"), com, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(vector(motion, found, "momentum"), momentum, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(vector(motion, found, "angular_momentum"), angular, rtol=1e-10, atol=1e-10)


def test_tensions_and_multipliers_are_the_rows_own() -> None:
    for seed in SEEDS:
        case, motion, found = instant(seed)
        for row, multiplier in zip(case.mechanism.rows, found.multipliers.tolist(), strict=True):
            assert value(motion, found, "multiplier", row.name) == multiplier
            if isinstance(row, (RopeRow, DistanceRow)):
                assert value(motion, found, "tension", row.name) == multiplier


def test_every_quantity_of_the_language_is_known() -> None:
    _, motion, found = instant(3)
    row = motion.mechanism.rows[0].name
    names = {"point": "b1", "body": "b1", "axis": "x", "joint": "j1", "component": "fx", "constraint": row}
    names |= {"frame": "b1", "element": "w", "whole": "b1", "about": "com", "store": "b1", "exerting": "weight"}
    names |= dict.fromkeys(("freedom", "moving"), motion.mechanism.speeds[0].name)
    names["coordinate"] = motion.mechanism.coordinates[0].name
    for function, known in QUANTITIES.items():
        for arguments in (known.arguments, *known.others):
            if "rope" not in arguments and not known.of_mode:
                assert np.isfinite(value(motion, found, function, *(names[a] for a in arguments)))


@pytest.mark.parametrize("seed", SEEDS)
def test_orientations_are_those_of_scipy(seed: int) -> None:
    case, motion, found = instant(seed)
    body = case.mechanism.bodies[-1].name
    R = np.array(motion.poses[-1][0], dtype=float)
    elements = [[value(motion, found, "rotation", body, i, j) for j in "xyz"] for i in "xyz"]
    np.testing.assert_array_equal(elements, R)
    unit = [value(motion, found, "quaternion", body, element) for element in "wxyz"]
    expected = Rotation.from_matrix(R).as_quat(canonical=True)
    np.testing.assert_allclose(unit, [expected[3], *expected[:3]], atol=1e-15)
    for k, axis in enumerate("xyz"):  # taken back by its angle, the next axis has no component along the one after
        back = Rotation.from_rotvec(-value(motion, found, "angle", body, axis) * np.eye(3)[k]).apply(R[:, (k + 1) % 3])
        assert back[(k + 2) % 3] == pytest.approx(0.0, abs=1e-14)
        assert back[(k + 1) % 3] > 0.0
