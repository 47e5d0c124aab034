"""Solvers of scipy are reached by one door, which hands them no matrix without rows or columns."""

from __future__ import annotations

import ast

import numpy as np
import pytest
from package_trees import nodes

from multibody_sym.scalars.linear_inequalities import INFEASIBLE, linear_program, nonnegative_least_squares

BEHIND_THE_DOOR = {"nnls", "linprog", "milp", "lsq_linear"}


def test_nobody_else_imports_them() -> None:
    found = {
        name
        for name, within in nodes().items()
        for node in within
        if (isinstance(node, ast.ImportFrom) and BEHIND_THE_DOOR & {alias.name for alias in node.names})
        or (isinstance(node, ast.Attribute) and node.attr in BEHIND_THE_DOOR)
    }
    assert found == {"scalars/linear_inequalities.py"}


@pytest.mark.parametrize("shape", [(3, 0), (0, 3), (0, 0)])
def test_least_squares_without_rows_or_columns(shape: tuple[int, int]) -> None:
    right = np.arange(1.0, shape[0] + 1)
    y, left = nonnegative_least_squares(np.zeros(shape), right)
    assert y.shape == shape[1:]
    assert left == pytest.approx(float(np.sqrt(right @ right)))


def test_least_squares_fulfil_their_conditions() -> None:
    """The residual's slope is zero along what is taken and not downhill along what is left out (Kuhn, Tucker)."""
    rng = np.random.default_rng(1)
    A, b = rng.normal(size=(6, 4)), rng.normal(size=6)
    y, left = nonnegative_least_squares(A, b)
    slope = A.T @ (A @ y - b)
    assert (y >= 0.0).all()
    assert np.abs(slope[y > 0.0]).max(initial=0.0) < 1e-12
    assert (slope[y == 0.0] >= -1e-12).all()
    assert left == pytest.approx(float(np.linalg.norm(A @ y - b)))


@pytest.mark.parametrize(("right", "exact", "status"), [(1.0, 0.0, 0), (-1.0, 0.0, INFEASIBLE), (1.0, 2.0, INFEASIBLE)])
def test_a_program_without_variables_holds_or_contradicts(right: float, exact: float, status: int) -> None:
    rows = np.zeros((1, 0))
    found = linear_program(np.zeros(0), [], below=(rows, np.array([right])), equal=(rows, np.array([exact])))
    assert found.status == status


def test_a_program_without_rows_goes_to_its_bounds() -> None:
    found = linear_program(np.array([1.0, -1.0]), [(-2.0, 3.0)] * 2, below=(np.zeros((0, 2)), np.zeros(0)))
    assert found.x.tolist() == [-2.0, 3.0]
    assert found.value == pytest.approx(-5.0)
    assert linear_program(np.ones(1), [(0.0, 1.0)], equal=(np.ones((1, 1)), np.array([2.0]))).status == INFEASIBLE
