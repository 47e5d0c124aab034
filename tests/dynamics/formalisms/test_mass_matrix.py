"""The mass matrix and its factors: composite bodies against the second derivatives of T, d'Alembert and NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from exact import Exact
from mechanisms import random_case, random_state

from multibody_sym.analysis.check import dalembert
from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal, mass_matrix
from multibody_sym.mechanics.energy import kinetic_energy
from multibody_sym.scalars.calculus import gradient, tangents
from multibody_sym.scalars.node import ONE, as_node
from multibody_sym.scalars.vectors import factorize

SEEDS = range(30)


def scaled(matrix: np.ndarray) -> np.ndarray:
    size = 1 / np.sqrt(matrix.diagonal())
    return size[:, None] * matrix * size


@pytest.mark.parametrize("seed", SEEDS)
def test_is_symmetric_positive_definite_and_agrees_with_dalembert(seed: int) -> None:
    case = random_case(seed)
    motion = case.motion(*random_state(np.random.default_rng(seed), case))
    matrix = np.array(mass_matrix(motion), dtype=float)
    assert (matrix == matrix.T).all()
    np.testing.assert_allclose(mass_diagonal(motion), matrix.diagonal(), rtol=1e-13)
    assert np.linalg.eigvalsh(scaled(matrix)).min() > 0
    np.testing.assert_allclose(scaled(matrix), scaled(dalembert(motion).mass_matrix), atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_is_the_second_derivative_of_the_kinetic_energy(seed: int) -> None:
    case = random_case(seed, bodies=(1, 4))
    state = random_state(np.random.default_rng(seed), case)
    exact = Exact(case)
    momenta = gradient(as_node(kinetic_energy(exact.motion)), exact.u)
    columns = [exact.values(tangents(momenta, {speed: ONE}), state) for speed in exact.u]
    matrix = np.array(mass_matrix(case.motion(*state)), dtype=float)
    np.testing.assert_allclose(matrix, np.array(columns), atol=1e-11 * np.abs(matrix).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_both_factorisations_apply_its_inverse(seed: int) -> None:
    case = random_case(seed)
    rng = np.random.default_rng(seed)
    motion = case.motion(*random_state(rng, case))
    matrix = np.array(mass_matrix(motion), dtype=float)
    count = len(matrix)
    right = rng.normal(size=count) * np.sqrt(matrix.diagonal())
    size = np.sqrt(matrix.diagonal())
    for factors in (factorize(matrix.tolist()), tree_factors(motion)):
        x = np.array(factors.solve(right.tolist()), dtype=float)
        assert np.abs((matrix @ x - right) / size).max() <= 1e-13 * count * (np.abs(x * size).max() + 1)
        half = np.array(factors.weighted(right.tolist()), dtype=float)
        np.testing.assert_allclose(half @ half, right @ x, rtol=1e-8)
        np.testing.assert_allclose(factors.unweighted(half.tolist()), x, rtol=1e-9, atol=1e-12 * np.abs(x).max())


def test_independent_branches_do_not_meet() -> None:
    """Bodies on different branches have no mass in common: structural zeros stay exactly zero."""
    for seed in SEEDS:
        case = random_case(seed)
        matrix = mass_matrix(case.motion(*random_state(np.random.default_rng(seed), case)))
        for a, body in enumerate(case.mechanism.bodies):
            above, index = set(), a
            while index >= 0:
                above.add(index)
                index = case.mechanism.bodies[index].parent
            others = [b for k, b in enumerate(case.mechanism.bodies[:a]) if k not in above]
            assert all(matrix[i][j] == 0 and type(matrix[i][j]) is int for b in others for i in body.u for j in b.u)
