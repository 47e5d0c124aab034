"""Switching functions against the kinks that a fine grid of values shows."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.scalars.sign_changes import switching_function, switching_functions
from multibody_sym.text.parser import parse

X = symbol("x")


@pytest.mark.parametrize(
    "condition", ["x < 2", "x <= 2", "2 > x", "2 >= x", "x > 0 and x < 2", "x < 2 and x < 5 or x > 7"]
)
def test_a_condition_holds_where_its_switching_function_is_positive(condition: str) -> None:
    g = switching_function(parse(condition))
    assert evaluate_float([g], {X: 1.0}) == [1.0]
    assert evaluate_float([g], {X: 3.0}) == [-1.0]


def test_joined_conditions_hold_as_their_parts_do() -> None:
    node = parse("x > 0 and x < 2 or x > 5 and (x < 6 or x > 8)")
    g = switching_function(node)
    for k in range(-10, 100):
        x = k / 10 + 0.05
        holds = 0 < x < 2 or (x > 5 and (x < 6 or x > 8))
        assert evaluate_float([node, g], {X: x})[0] == float(holds)
        assert (evaluate_float([g], {X: x})[0] > 0) == holds


@pytest.mark.parametrize(
    ("text", "zeros"),
    [
        ("where(x < 1, x, 3)", [1]),
        ("abs(x - 1/2)", [0.5]),
        ("2*sign(x + 1)*x", [-1]),
        ("max(x, 1 - x)", [0.5]),
        ("min(x, 2*x, 1 - x)", [0, 0.5]),
        ("where(abs(x) < 1, sign(x), min(x, 1.5))", [-1, 0, 1, 1.5]),
        ("where(min(x > -1, x < 1), x, 0)", [-1, 1]),
        ("where(x > -1 and x < 1 or x > 1.5, x, 0)", [-1, 1, 1.5]),
        ("sin(x)*x^2/(2 + cos(x))", []),
        ("max(x, 1) + max(x, 1)^2 + abs(x - 1) + where(x < 1, 0, x)", [1]),
        ("abs(2) + sign(-3) + where(1 < 2, 1, x)", []),
    ],
)
def test_every_kink_is_a_zero_of_one_of_them(text: str, zeros: list[float]) -> None:
    found = switching_functions([parse(text)])
    grid = np.linspace(-2.03, 2.05, 4001)
    values = np.array([evaluate_float(found, {X: x}) for x in grid]).reshape(len(grid), len(found))
    changes = np.flatnonzero(np.any(values[1:] * values[:-1] < 0, axis=1))
    np.testing.assert_allclose(sorted(set(zeros)), (grid[changes] + grid[changes + 1]) / 2, atol=2e-3)


def test_each_is_listed_once() -> None:
    found = switching_functions([parse("max(x, y) + abs(y)"), parse("where(x < y, sign(y), where(y <= x, 0, 1))")])
    assert len(found) == 2
