"""Rank: one rule in one file, against matrices whose rank is known by how they were made."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from package_trees import nodes

from multibody_sym.scalars import rank as module
from multibody_sym.scalars.least_norm import independent_rows, solve
from multibody_sym.scalars.rank import (
    CLOSED,
    DRAWN,
    damped_solution,
    exact,
    idle,
    leading_columns,
    least_squares,
    null_space,
)
from multibody_sym.scalars.rank import rank as rank_of

OF = "linalg", "lapack()"
DECIDING = {"dgeqp3", "matrix_rank", "svd", "lstsq", "pinv", "pinvh", "qr", "null_space", "orth", "cond"}
"""Functions of NumPy and SciPy that judge, or serve to judge, how many directions count."""


def made(rng: np.random.Generator, rows: int, columns: int, rank: int) -> np.ndarray:
    """Return a matrix of a rank, its rows of lengths from 1e-6 to 1e6."""
    matrix = rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, columns))
    return np.asarray(10.0 ** rng.uniform(-6, 6, (rows, 1)) * matrix)


@pytest.mark.parametrize("seed", range(40))
def test_every_way_to_ask_agrees(seed: int) -> None:
    rng = np.random.default_rng(seed)  # the seeds have no other meaning than to differ
    rows, columns = (int(n) for n in rng.integers(1, 8, 2))
    rank = int(rng.integers(1, min(rows, columns) + 1))
    matrix = made(rng, rows, columns, rank)
    unit = module.scaled_rows(matrix)[1]
    assert rank_of(matrix, exact(matrix)) == rank_of(matrix, CLOSED) == rank
    assert solve(matrix, rng.normal(size=rows)).report[0] == rank
    assert len(independent_rows(matrix)) == len(leading_columns(unit, DRAWN)) == rank
    kernel = null_space(unit, DRAWN)
    assert kernel.shape == (columns, columns - rank)
    assert_allclose(unit @ kernel, 0.0, atol=1e-9)
    assert_allclose(kernel.T @ kernel, np.eye(columns - rank), atol=1e-12)
    still = idle(unit, rank)
    assert still.shape == (rows - rank, rows)
    assert_allclose(still @ unit, 0.0, atol=1e-9)


def test_leading_columns_determine_the_others() -> None:
    rng = np.random.default_rng(1)
    matrix = made(rng, 5, 6, 3) / 1e3
    chosen = leading_columns(matrix, DRAWN)
    others = [k for k in range(6) if k not in chosen]
    found = least_squares(matrix[:, chosen], matrix[:, others])
    assert_allclose(matrix[:, chosen] @ found, matrix[:, others], rtol=0, atol=1e-9 * np.abs(matrix).max())
    assert leading_columns(np.array([[1.0, 1.0 + 1e-12, 2.0]]), DRAWN) == [2]
    assert leading_columns(np.array([[1.0, 1.0 + 1e-12]]), DRAWN) == [0]  # alike but for rounding: the first


def test_nothing_has_rank_zero() -> None:
    assert [rank_of(np.zeros(shape), CLOSED) for shape in ((0, 3), (2, 0), (2, 3))] == [0, 0, 0]
    assert null_space(np.zeros((0, 3)), CLOSED).tolist() == np.eye(3).tolist()
    assert leading_columns(np.zeros((2, 3)), CLOSED) == []


def test_damping_ends_where_the_rows_hold() -> None:
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(2, 4))
    right = rng.normal(size=2)
    assert_allclose(damped_solution(matrix, right, 0.0), np.linalg.pinv(matrix) @ right, rtol=1e-12)
    assert np.linalg.norm(damped_solution(matrix, right, 1.0)) < np.linalg.norm(damped_solution(matrix, right, 0.0))


def deciding(within: Iterable[ast.AST]) -> Iterator[int]:
    """Yield the lines in which a function of NumPy or SciPy that decides rank is named."""
    for node in within:
        if isinstance(node, ast.Attribute) and node.attr in DECIDING and ast.unparse(node.value).endswith(OF):
            yield node.lineno
        elif isinstance(node, ast.ImportFrom) and str(node.module).partition(".")[0] in {"numpy", "scipy"}:
            yield from (node.lineno for alias in node.names if alias.name in DECIDING)


def test_rank_is_decided_in_one_place() -> None:
    assert list(deciding(ast.walk(ast.parse("from scipy.linalg import null_space; np.linalg.svd(x)")))) == [1, 1]
    found = {name for name, within in nodes().items() for _ in deciding(within)}
    assert found == {"scalars/rank.py", "scalars/pivoted_qr.py"}  # which factors for its rule


def test_every_tolerance_has_its_reason() -> None:
    body = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8")).body
    constants = [k for k, node in enumerate(body) if isinstance(node, ast.AnnAssign)]
    assert len(constants) > 8
    for k in constants:
        following = body[k + 1]
        assert isinstance(following, ast.Expr)
        assert isinstance(following.value, ast.Constant)
        assert isinstance(following.value.value, str)
