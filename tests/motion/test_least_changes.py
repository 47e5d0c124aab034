"""The least change of speeds that changes rows as wanted, against least squares by singular values."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from multibody_sym.motion.switching.impact import _least_change
from multibody_sym.motion.switching.law_values import Pattern, SparseRows


def instant(inverse: np.ndarray) -> Any:
    """What is asked of an instant: G^-1."""
    return SimpleNamespace(inverse=SparseRows(Pattern(inverse.shape, np.arange(inverse.size)), inverse.ravel()))


@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_it_is_that_of_least_squares(count: int) -> None:
    rng = np.random.default_rng(count)
    rows, inverse, wanted = rng.normal(size=(count, 9)), rng.normal(size=(9, 9)), rng.normal(size=count)
    found = _least_change(instant(inverse), rows, wanted)
    assert found is not None
    np.testing.assert_allclose(found, inverse @ np.linalg.lstsq(rows, wanted, rcond=None)[0], rtol=1e-10, atol=1e-12)


def test_rows_that_nearly_depend_on_each_other_and_many_rows_are_left_to_others() -> None:
    rows = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 1e-5]])
    assert _least_change(instant(np.eye(3)), rows, np.ones(2)) is None
    assert _least_change(instant(np.eye(9)), np.eye(9), np.ones(9)) is None
