"""Tensors in other axes against numpy, and as few operations as the rotation allows."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.program.program import operation_count
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.vectors import rotation_about, turned_symmetric, turned_tensor

AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0.6, 0, 0.8)]
ANGLE, TENSOR = Array("angle", ()), Array("tensor", (3, 3))


def rows(flat):
    return tuple(flat[:3]), tuple(flat[3:6]), tuple(flat[6:])


@pytest.mark.parametrize("axis", AXES)
def test_turned(axis: tuple[float, ...]) -> None:
    tensor = np.random.default_rng(3).normal(size=(3, 3))
    R = np.array(rotation_about(axis, 0.7))
    np.testing.assert_allclose(turned_tensor(rows(R.ravel()), rows(tensor.ravel())), R @ tensor @ R.T, atol=1e-14)
    symmetric = np.tril(tensor) + np.tril(tensor, -1).T
    lower = tensor + np.tril(tensor, -1).T - np.triu(tensor, 1)
    found = turned_symmetric(rotation_about(axis, 0.7), rows(lower.ravel()))
    np.testing.assert_allclose(found, R @ symmetric @ R.T, atol=1e-14)


@pytest.mark.parametrize(("function", "most"), [(turned_symmetric, 16), (turned_tensor, 23)])
def test_operations_about_a_coordinate_axis(function, most: int) -> None:
    trace = Trace("turned", [ANGLE, TENSOR])
    t = trace["tensor"]
    given = (t[:3], (t[1], *t[4:6]), (t[2], t[5], t[8])) if function is turned_symmetric else rows(t)
    result = function(rotation_about((0, 0, 1), trace["angle"][0]), given)
    program = trace.finish({"turned": ((3, 3), [x for row in result for x in row])})
    assert operation_count(program).total <= most
