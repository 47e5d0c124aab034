"""The Programs of a mechanism against the same things in floats, by the interpreter."""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

from multibody_sym.analysis.check import LARGEST_WITH_ROWS, dalembert, ratio
from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.formalisms.composite_body import composite_body, mass_matrix
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.mechanism import ALPHA, BETA
from multibody_sym.mechanics.motion import arrays, coordinate_rates
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.program.program import interpret
from multibody_sym.program.programs import Programs
from multibody_sym.scalars.node import slot

State = tuple[float, list[float], list[float]]


def made(seed: int, *, rows: bool) -> tuple[Case, Programs, State]:
    case = random_case(seed, bodies=(1, 4), rows=rows)
    formalism = ("composite_body", "block_ldl")[seed % 2]
    return case, programs(case.mechanism, FORMALISMS[formalism]), random_state(np.random.default_rng(seed), case)


def run(case: Case, program, state: State, parameters=None):
    values = case.parameters if parameters is None else parameters
    inputs = [case.state(*state).slots[slot("inputs", i)] for i in range(len(case.mechanism.inputs))]
    return interpret(program, *state, values, inputs, [])


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_against_floats(seed: int, rows: bool) -> None:
    case, found, state = made(seed, rows=rows)
    motion = case.motion(*state)
    (inputs,) = interpret(found.inputs, *state, case.parameters)
    expected = [motion.state.slots[slot("inputs", i)] for i in range(len(case.mechanism.inputs))]
    np.testing.assert_allclose(inputs, expected, rtol=1e-14)
    kinetic, potential = run(case, found.energy, state)
    assert kinetic == pytest.approx(kinetic_energy(motion), rel=1e-12)
    assert potential == pytest.approx(potential_energy(motion), rel=1e-12, abs=1e-12 * (1 + abs(kinetic)))
    (values,) = run(case, found.outputs, state)
    assert values == pytest.approx([kinetic_energy(motion) + potential_energy(motion)], rel=1e-12)
    qdot, udot, multipliers, report = run(case, found.state_derivative, state)
    np.testing.assert_allclose(qdot, np.array(coordinate_rates(case.mechanism, *state[1:]), dtype=float), atol=1e-14)
    assert ratio(dalembert(motion), udot, multipliers) <= LARGEST_WITH_ROWS
    assert report[0] == len(case.mechanism.rows)


@pytest.mark.parametrize("seed", range(8))
def test_baumgarte_pulls_towards_the_constraints(seed: int) -> None:
    """H udot = gamma - 2 alpha phidot - beta^2 phi, or gamma - alpha psi, with alpha, beta the last two parameters."""
    case, found, state = made(seed, rows=True)
    parameters = case.mechanism.parameters.changed(case.parameters, {ALPHA: 3.0, BETA: 5.0})
    _, udot, _, _ = run(case, found.state_derivative, state, parameters)
    for row in row_motions(case.motion(*state)):
        wanted = row.gamma - (6 * row.phidot + 25 * row.phi if row.holonomic else 3 * row.phidot)
        size = np.abs(row.jacobian) @ np.abs(udot) + abs(wanted)
        assert np.array(row.jacobian, dtype=float) @ udot == pytest.approx(wanted, abs=1e-10 * size)


@pytest.mark.parametrize("seed", range(8))
def test_projections_are_the_smallest_corrections(seed: int) -> None:
    """H c = -phi, and M c = H^T mu: perpendicular, in the mass matrix's norm, to all that the rows allow."""
    case, found, state = made(seed, rows=True)
    rows = row_motions(case.motion(*state))
    jacobian = np.array([row.jacobian for row in rows], dtype=float)
    matrix = np.array(mass_matrix(case.motion(*state)), dtype=float)
    residual, change = run(case, found.project_velocity, state)
    np.testing.assert_allclose(residual, [row.phidot for row in rows], rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(jacobian @ change, -residual, atol=1e-9 * (1 + np.abs(residual).max()))
    multipliers, *_ = np.linalg.lstsq(jacobian.T, matrix @ change, rcond=None)
    np.testing.assert_allclose(jacobian.T @ multipliers, matrix @ change, atol=1e-7 * np.abs(matrix @ change).max())
    phi, correction = run(case, found.project_position, state)
    np.testing.assert_allclose(phi, [row.phi if row.holonomic else 0 for row in rows], rtol=1e-10, atol=1e-12)
    holonomic = [row.holonomic for row in rows]
    change = least(jacobian[holonomic], matrix, phi[holonomic])
    along = np.array(coordinate_rates(case.mechanism, state[1], change), dtype=float)
    np.testing.assert_allclose(correction, along, atol=1e-7 * (1 + np.abs(along).max()))


def least(jacobian: np.ndarray, matrix: np.ndarray, phi: np.ndarray) -> list[float]:
    """Return -M^-1 H^T (H M^-1 H^T)^-1 phi."""
    through = np.linalg.solve(matrix, jacobian.T)
    change: list[float] = (-through @ np.linalg.solve(jacobian @ through, phi)).tolist()
    return change


def test_quaternions_are_normalised() -> None:
    checked = 0
    for seed in range(12):
        case, found, (t, q, u) = made(seed, rows=False)
        quaternions = [places for body in case.mechanism.bodies for places in body.quaternions]
        assert (found.normalize is not None) == bool(quaternions)
        if found.normalize is None:
            continue
        longer = list(q)
        for places in quaternions:
            for k in places:
                longer[k] *= 1.25
        normalised, deviation = run(case, found.normalize, (t, longer, u))
        np.testing.assert_allclose(normalised, q, atol=1e-14)
        assert deviation == pytest.approx(0.25)
        checked += 1
    assert checked


def test_state_derivative_is_the_one_of_the_formalism_and_forward_dynamics() -> None:
    case, found, state = made(2, rows=True)
    _, udot, multipliers, _ = run(case, found.state_derivative, state)
    expected = forward_dynamics(composite_body(case.mechanism, case.state(*state)))
    np.testing.assert_allclose(udot, expected.udot, rtol=1e-7)
    np.testing.assert_allclose(multipliers, expected.multipliers, rtol=1e-7)


def test_names_of_arrays_are_the_toolkits_own() -> None:
    case = random_case(5)
    assert [array.name for array in arrays(case.mechanism)] == ["t", "q", "u", "parameters", "inputs", "modes"]
    assert cheapest(case.mechanism) in FORMALISMS
