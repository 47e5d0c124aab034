"""Lemke's method: solutions where there are some, dependent rows, ties, and rays that prove that there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from multibody_sym.contact_laws.enumeration import lemke


def residual(M: np.ndarray, q: np.ndarray, z: np.ndarray) -> float:
    """Return by how much z misses 0 <= w, 0 <= z, w z = 0, w = M z + q."""
    w = M @ z + q
    return float(max(-w.min(), -z.min(), np.abs(w * z).max()))


@pytest.mark.parametrize("size", [1, 3, 10, 40])
@pytest.mark.parametrize("seed", range(10))
def test_semidefinite_problems_with_a_solution(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(size, max(1, size // 2)))
    z = np.maximum(rng.normal(size=size), 0.0)
    w = np.where(z > 0.0, 0.0, np.abs(rng.normal(size=size)))
    M = B @ B.T
    found = lemke(M, w - M @ z)
    assert not found.ray
    assert residual(M, w - M @ z, found.z) < 1e-9 * (1.0 + np.abs(found.z).max())


@pytest.mark.parametrize("seed", range(50))
def test_a_ray_of_a_semidefinite_problem_means_that_no_z_is_feasible(seed: int) -> None:
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(6, 2))
    M, q = B @ B.T, rng.normal(size=6)
    feasible = linprog(np.zeros(6), A_ub=-M, b_ub=q, bounds=[(0, None)] * 6, method="highs").status == 0
    found = lemke(M, q)
    assert found.ray is not feasible
    assert found.ray or residual(M, q, found.z) < 1e-8


@pytest.mark.parametrize("size", [2, 5, 20])
def test_rows_that_are_all_alike_do_not_make_it_cycle(size: int) -> None:
    """A load on so many like legs: every ratio is a tie."""
    found = lemke(np.ones((size, size)), -np.ones(size))
    assert not found.ray
    assert found.z.sum() == pytest.approx(1.0)


def test_the_solution_of_a_skew_problem_that_principal_pivots_cycle_in() -> None:
    """Murty's P matrix of order 3, in which the least index rule visits modes again."""
    M, q = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]), -np.ones(3)
    found = lemke(M, q)
    assert found.z == pytest.approx(np.full(3, 1 / 3))
    assert found.basic.all()


def test_nothing_is_needed_where_q_is_not_negative() -> None:
    found = lemke(-np.eye(2), np.array([1.0, 0.0]))
    assert (found.z.tolist(), found.ray, found.pivots) == ([0.0, 0.0], False, 0)
