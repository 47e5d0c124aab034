"""Rows of matrices of which few entries are given, against the same matrices with all their zeros."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.motion.switching.law_values import Pattern, SparseRows


@pytest.mark.parametrize("shape", [(7, 5), (1, 3), (300, 40)])
def test_rows_and_products_are_those_of_the_whole(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(shape[0])
    places = rng.permutation(shape[0] * shape[1])[: shape[0] * shape[1] // 4]
    values = rng.normal(size=len(places))
    whole = np.zeros(shape)
    whole.flat[places] = values
    sparse = SparseRows(Pattern(shape, places), values)
    x, at = rng.normal(size=shape[1]), rng.integers(0, shape[0], size=9)
    np.testing.assert_array_equal(sparse.whole, whole)
    np.testing.assert_array_equal(sparse[at], whole[at])
    np.testing.assert_array_equal(sparse[int(at[0])], whole[at[0]])
    np.testing.assert_array_equal(sparse[[]], whole[[]])
    np.testing.assert_allclose(sparse @ x, whole @ x, rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(sparse.in_order(x), [sum(map(float, row * x), start=0.0) for row in whole])


@pytest.mark.parametrize("count", [6, 100])
def test_a_block_has_what_its_rows_have_in_its_columns(count: int) -> None:
    places = np.arange(count) * count + np.arange(count)[::-1]
    sparse = SparseRows(Pattern((count, count), places), np.arange(1.0, count + 1.0))
    at = np.array([count - 1, 2, 0])
    np.testing.assert_array_equal(sparse.block(at), sparse.whole[np.ix_(at, at)])
    none = SparseRows(Pattern((count, count), places[:0]), np.zeros(0))
    np.testing.assert_array_equal(none.block(at), np.zeros((3, 3)))
