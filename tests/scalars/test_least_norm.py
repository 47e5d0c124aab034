"""The rank-revealing solve against singular values, and its rules for dependent, zero and contradicting rows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from multibody_sym.scalars.least_norm import LeastNormSolution, solve


def random_system(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return A of random size and rank, rows of very different lengths, and an r in its range."""
    random = np.random.default_rng(seed)
    count, size = random.integers(0, 9, 2)
    rank = random.integers(0, min(count, size) + 1)
    matrix = random.normal(size=(count, rank)) @ random.normal(size=(rank, size))
    matrix *= 10.0 ** random.uniform(-6, 6, (count, 1))
    return matrix, matrix @ random.normal(size=size)


@given(st.integers(0, 10**6))
def test_solution_is_that_of_singular_values(seed: int) -> None:
    matrix, right = random_system(seed)
    found = solve(matrix, right)
    lengths = np.linalg.norm(matrix, axis=1)
    lengths[lengths == 0.0] = 1.0
    scaled, values = matrix / lengths[:, None], right / lengths
    if matrix.size:
        wanted, _, rank, _ = np.linalg.lstsq(scaled, values, rcond=1e-12)
        assert found.report[0] == rank
        conditioning = found.report[1] if rank else 1.0
        assert np.abs(found.solution - wanted).max() <= 1e-13 * (1 + np.abs(wanted).max()) / conditioning
    else:
        assert found.report[0] == 0.0
        assert not found.solution.any()
        assert not found.multipliers.any()


@given(st.integers(0, 10**6))
def test_solution_is_the_transposed_matrix_times_the_multipliers(seed: int) -> None:
    matrix, right = random_system(seed)
    found = solve(matrix, right)
    assert np.abs(matrix.T @ found.multipliers - found.solution).max(initial=0.0) <= 1e-9 * (
        1 + np.abs(found.solution).max(initial=0.0)
    )
    assert np.count_nonzero(found.multipliers) <= found.report[0]


@given(st.integers(0, 10**6))
def test_conditioning_is_near_the_smallest_singular_value(seed: int) -> None:
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(4, 6))
    matrix[3] = matrix[0] + 10.0 ** random.uniform(-8, 0) * matrix[3]
    values = np.linalg.svd(matrix / np.linalg.norm(matrix, axis=1)[:, None], compute_uv=False)
    found = solve(matrix, np.ones(4)).report
    assert found[0] == 4.0
    assert values[-1] / values[0] / 4 <= found[1] <= 16 * values[-1] / values[0]


@pytest.mark.parametrize("later", [1.0 - 1e-6, 1.0 + 1e-6])
def test_conditioning_is_the_same_whichever_of_two_rows_comes_first(later: float) -> None:
    """What a light body lets rows of unlike lengths leave of each other: 0.01, and 0.2 of 11 is the shortest."""
    sine, turn = 0.4 * later, 0.025
    short = 0.2 * np.array([math.sqrt(1.0 - 0.16), 0.4, 0.0])
    long = 11.0 * np.array([math.sqrt(1.0 - sine**2), sine * math.cos(turn), sine * math.sin(turn)])
    found = solve(np.array([[3.0, 0.0, 0.0], short, long, 3.0 * short]), np.zeros(4)).report
    assert found[:2] == pytest.approx([3.0, 0.4 * math.sin(turn)], rel=1e-5)


def test_of_equal_rows_the_one_declared_first_carries_the_multiplier() -> None:
    row = np.array([0.3, -0.2, 0.7])
    matrix = np.array([[0.0, 1.0, 0.0], row / 3, row, row * 1e5, [1.0, 0.0, 0.0]])
    found = solve(matrix, matrix @ np.array([1.0, 2.0, 3.0]))
    assert found.report[0] == 3.0
    assert found.report[2] < 1e-14
    assert found.multipliers[1] != 0.0
    assert found.multipliers[2] == found.multipliers[3] == 0.0
    assert found.solution == pytest.approx([1.0, 2.0, 3.0], rel=1e-13)


def test_a_contradicting_row_is_left_out_and_reported() -> None:
    found = solve(np.array([[2.0, 0.0], [1.0, 0.0]]), np.array([2.0, 1.5]))
    assert found.solution.tolist() == [1.0, 0.0]
    assert found.report == pytest.approx([1.0, 1.0, 0.5 / 1.5])


def test_zero_rows_have_rank_zero_and_show_what_they_contradict() -> None:
    found = solve(np.zeros((2, 3)), np.array([0.0, -4.0]))
    assert found.report.tolist() == [0.0, 0.0, 1.0]
    assert not found.solution.any()
    assert not found.multipliers.any()


@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_tiny_and_huge_rows_are_rows_like_any_other(scale: float) -> None:
    found = solve(scale * np.array([[3.0, 4.0], [4e-12, -3e-12]]), scale * np.array([5.0, 5e-12]))
    assert found.solution == pytest.approx([1.4, 0.2], rel=1e-14)
    assert found.report[0] == 2.0


def test_a_row_of_rounding_has_no_direction() -> None:
    """What rounding leaves of a row that vanishes would, scaled up to unit length, count as a constraint."""
    found = solve(np.array([[1.0, 2.0, 0.0], [3e-17, -1e-17, 2e-17]]), np.array([5.0, 1e-17]))
    assert found.solution == pytest.approx([1.0, 2.0, 0.0], rel=1e-14)
    assert found.report[0] == 1.0
    assert found.report[2] < 1e-15
    assert found.multipliers[1] == 0.0


@pytest.mark.parametrize(("entry", "value"), [(math.nan, 1.0), (math.inf, 1.0), (1.0, math.nan), (1.0, -math.inf)])
def test_what_is_not_finite_is_never_hidden(entry: float, value: float) -> None:
    matrix = np.array([[1.0, 0.0], [2.0, 0.0]])
    matrix[1, 0] *= entry
    found: LeastNormSolution = solve(matrix, np.array([1.0, value]))
    assert np.isnan(found.solution).all()
    assert np.isnan(found.multipliers).all()
    assert np.isnan(found.report).all()


def test_rows_that_exert_other_forces_and_depend_on_each_other_have_multipliers_of_least_norm() -> None:
    """Two equal normals that slide: x and the multipliers, times lengths of C, by a pseudo-inverse of both together."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    C = A.copy()
    C[0, 0], C[1, 0] = -0.3, -0.3
    right = np.array([2.0, 2.0, 5.0])
    found = solve(A, right, 1, [1.0, 1.0, 0.0], C.tolist())
    unit = C[:2] / np.linalg.norm(C[:2], axis=1)[:, None]
    both = np.block([[A[:2], np.zeros((2, 2))], [np.eye(3), -unit.T]])
    x, z = np.split(np.linalg.pinv(both) @ np.array([2.0, 2.0, 0.0, 0.0, 0.0]), [3])
    assert found.solution == pytest.approx(x, abs=1e-12)
    assert found.multipliers == pytest.approx([*(z / np.linalg.norm(C[:2], axis=1)), 0.0], abs=1e-12)
    assert found.report[0] == 1.0
