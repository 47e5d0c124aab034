"""Many rows of few elements each: solved and judged within their profile as they are by dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.scalars import rank as module
from multibody_sym.scalars.elimination import blocks, eliminate
from multibody_sym.scalars.rank import CLOSED, clear_least_norm, damped_solution
from multibody_sym.scalars.rank import rank as rank_of


def chain(count: int, rng: np.random.Generator) -> np.ndarray:
    """Return rows of a chain of loops that share columns with the one before, and a row of zeros, columns mixed."""
    matrix = np.zeros((2 * count, 2 * count + 9))
    for k in range(0, 2 * count, 2):
        matrix[k : k + 2, k : k + 5] = rng.normal(size=(2, 5))
    matrix = np.insert(matrix, 7, 0.0, axis=0)
    return matrix[:, rng.permutation(matrix.shape[1])]


def test_the_shortest_solution_is_that_of_dense_algebra() -> None:
    rng = np.random.default_rng(1)
    matrix = chain(30, rng)
    right = matrix @ rng.normal(size=matrix.shape[1])
    wanted = np.linalg.pinv(matrix) @ right
    found = clear_least_norm(matrix, right)
    assert found is not None
    assert found == pytest.approx(wanted, abs=1e-11)


@pytest.mark.parametrize("damping", [0.0, 1e-9, 1e-2])
def test_damping_is_that_of_singular_values(damping: float) -> None:
    rng = np.random.default_rng(3)
    matrix, mu = chain(30, rng), damping
    right = rng.normal(size=len(matrix))
    lengths = np.linalg.norm(matrix, axis=1)
    right[lengths == 0.0] = 0.0
    here = lengths > 0.0
    u, s, v = np.linalg.svd(matrix[here] / lengths[here, None], full_matrices=False)
    wanted = v.T @ (s / (s * s + mu) * (u.T @ (right[here] / lengths[here])))
    allowed = 1e-11 * np.abs(wanted).max()  # conditioned by 2000
    assert damped_solution(matrix, right, mu) == pytest.approx(wanted, abs=allowed)


@pytest.mark.parametrize("lost", [0, 1, 3])
def test_rank_of_many_rows_is_known_by_how_they_were_made(lost: int) -> None:
    """Rows in blocks; as many of them as are lost are sums of others."""
    rng = np.random.default_rng(lost)
    parts = [chain(20, rng), chain(15, rng)]
    matrix = np.zeros((sum(len(p) for p in parts), sum(p.shape[1] for p in parts)))
    matrix[: len(parts[0]), : parts[0].shape[1]] = parts[0]
    matrix[len(parts[0]) :, parts[0].shape[1] :] = parts[1]
    for k in range(lost):
        matrix[k] = matrix[20 + k] + matrix[25 + k]
    assert rank_of(matrix, CLOSED) == rank_of(matrix.T, CLOSED) == 70 - lost
    assert len(list(blocks(matrix))) == 2


def test_clear_cases_take_no_dense_algebra(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dense decomposition takes eight times the time for twice the loops."""
    matrix = chain(30, np.random.default_rng(4))

    def dense(*_: object, **__: object) -> None:
        raise AssertionError("dense")

    monkeypatch.setattr(module.np.linalg, "svd", dense)
    assert rank_of(matrix, CLOSED) == 60


def test_rows_that_may_depend_on_each_other_are_left_to_others() -> None:
    matrix = chain(30, np.random.default_rng(5))
    matrix[40] = matrix[41] * (1 + 1e-9)
    assert eliminate(matrix, 1e-6) is None
    assert clear_least_norm(matrix, np.zeros(len(matrix))) is None
    assert rank_of(matrix, CLOSED) == 59
