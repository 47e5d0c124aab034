"""Least changes by few rows against least squares by singular values."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.numerics.few_rows import MOST, least_change


@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_the_least_change_is_that_of_least_squares(count: int) -> None:
    rng = np.random.default_rng(count)
    rows, inverse = rng.normal(size=(count, 9)), rng.normal(size=(9, 9))
    wanted = rng.normal(size=count)
    found = least_change(rows, wanted, inverse)
    assert found is not None
    np.testing.assert_allclose(found, inverse @ np.linalg.lstsq(rows, wanted, rcond=None)[0], rtol=1e-10, atol=1e-12)


def test_dependent_rows_and_many_rows_are_left_to_others() -> None:
    rows = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 1e-5]])
    assert least_change(rows, np.ones(2), np.eye(3)) is None
    assert least_change(np.eye(MOST + 1), np.ones(MOST + 1), np.eye(MOST + 1)) is None
