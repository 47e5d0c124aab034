"""The door to sympy: round trips, exact numbers, a whitelist."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import sympy
from random_expressions import LEAVES, random_expression, random_point

from multibody_sym.errors import ExpressionError
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float, node_of
from multibody_sym.scalars.node import PI, as_node, number, quantity, real, slot, symbol
from multibody_sym.scalars.sympy_bridge import from_sympy, to_sympy

x, y = symbol("x"), symbol("y")
X, Y = sympy.symbols("x y", real=True)


@pytest.mark.parametrize("seed", range(60))
def test_there_and_back_the_value_is_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expression = random_expression(rng, depth=4)
    back = from_sympy(to_sympy(expression, {}))
    for _ in range(3):
        point = random_point(rng)
        found = evaluate_float([expression, back], point)
        assert found[1] == pytest.approx(found[0], rel=1e-9, abs=1e-12)
    assert set(leaves([back], "symbol")) <= set(LEAVES)


@pytest.mark.parametrize(
    ("expression", "node"),
    [
        (X + Y / 2, x + y / 2),
        (X**2 / Y, x**2 / y),
        (1 / sympy.sqrt(X), 1 / x ** Fraction(1, 2)),
        (sympy.Rational(1, 3), number(Fraction(1, 3))),
        (sympy.Float(0.1), real(0.1)),
        (sympy.pi * X, PI * x),
        (sympy.Integer(0), as_node(0)),
    ],
)
def test_exact_counterparts(expression, node) -> None:
    assert from_sympy(expression) is node


def test_symbols_are_real_and_by_name() -> None:
    assert to_sympy(x, {}) == sympy.Symbol("x", real=True)
    assert from_sympy(sympy.Symbol("x")) is x, "whatever is assumed of it"
    assert from_sympy(sympy.Symbol("x"), {sympy.Symbol("x"): slot("q", 0)}) is slot("q", 0)


def test_slots_and_quantities_need_a_symbol() -> None:
    with pytest.raises(KeyError):
        to_sympy(slot("q", 0) + x, {})
    with pytest.raises(KeyError):
        to_sympy(quantity("tension", ["r"]), {})
    assert to_sympy(slot("q", 0) + x, {slot("q", 0): Y}) == X + Y


@pytest.mark.parametrize(
    "expression",
    [
        sympy.gamma(X),
        sympy.Function("f")(X),
        sympy.Derivative(sympy.Function("f")(X), X),
        sympy.Integral(X, X),
        sympy.I * X,
        sympy.oo,
        sympy.nan,
        sympy.zoo,
        sympy.Piecewise((X, X > 0)),
        sympy.Matrix([X])[0] + sympy.Heaviside(X),
    ],
)
def test_everything_else_is_refused(expression) -> None:
    with pytest.raises(ExpressionError):
        from_sympy(expression)


def test_strings_never_reach_sympy() -> None:
    for text in ("x", "__import__('os')", "1+1"):
        with pytest.raises(TypeError):
            node_of(text)


def test_deep_expressions_are_no_recursion() -> None:
    deep = x
    for _ in range(300):
        deep = (deep + y) * y
    back = from_sympy(to_sympy(deep, {}))
    assert evaluate_float([back], {x: 0.5, y: 0.9}) == pytest.approx(evaluate_float([deep], {x: 0.5, y: 0.9}))
