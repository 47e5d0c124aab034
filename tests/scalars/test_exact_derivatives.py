"""Derivatives of Nodes: forward against reverse, and both against sympy and difference quotients."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy
from random_expressions import LEAVES, random_expression, random_point

from multibody_sym.scalars.calculus import adjoints, derivative, gradient, partials, tangents
from multibody_sym.scalars.elementary import acos, maximum, minimum, postorder
from multibody_sym.scalars.functions import evaluate_float, sin
from multibody_sym.scalars.node import ONE, ZERO, Node, absolute, as_node, number, power, slot, sqrt, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy

x, y, t = symbol("x"), symbol("y"), symbol("t")
SEEDS = range(60)


@pytest.mark.parametrize("seed", SEEDS)
def test_forward_and_reverse_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expression, point = random_expression(rng), random_point(rng)
    forward = evaluate_float([derivative(expression, leaf) for leaf in LEAVES], point)
    assert forward == pytest.approx(evaluate_float(gradient(expression, LEAVES), point), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_against_difference_quotients(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expression, point = random_expression(rng), random_point(rng)
    step = 1e-6
    for leaf, slope in zip(LEAVES, evaluate_float(gradient(expression, LEAVES), point), strict=True):
        ahead, behind = (evaluate_float([expression], {**point, leaf: point[leaf] + s})[0] for s in (step, -step))
        halfway = evaluate_float([expression], point)[0]
        one_sided = abs((ahead - halfway) - (halfway - behind)) / step
        size = 1 + abs(slope)
        if one_sided > 1e-3 * size:  # a kink or jump of min, abs, where lies between
            continue
        assert slope == pytest.approx((ahead - behind) / (2 * step), abs=1e-4 * size)


@pytest.mark.parametrize("seed", range(25))
def test_against_sympy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expression, point = random_expression(rng, depth=3), random_point(rng)
    translated = to_sympy(expression, {})
    values = {sympy.Symbol(leaf.data, real=True): value for leaf, value in point.items()}
    for leaf in LEAVES:
        slope = sympy.diff(translated, sympy.Symbol(leaf.data, real=True)).subs(values).evalf()
        found = evaluate_float([derivative(expression, leaf)], point)[0]
        assert found == pytest.approx(float(slope), rel=1e-9, abs=1e-12)


def test_total_derivative_in_time() -> None:
    q, u = slot("q", 0), slot("u", 0)
    (rate,) = tangents([sin(q) * t], {q: u, t: ONE})
    assert evaluate_float([rate], {q: 0.3, u: 2.0, t: 5.0}) == pytest.approx([np.cos(0.3) * 2 * 5 + np.sin(0.3)])


def test_leaves_without_a_rate_are_constant() -> None:
    assert tangents([x * y, as_node(3)], {x: ONE}) == [y, ZERO]
    assert derivative(sin(y), x) is ZERO


def test_many_nodes_at_once() -> None:
    found = adjoints([(x * y, as_node(2)), (x**2, ONE), (x * y, ONE)], [x, y])
    assert evaluate_float(found, {x: 3.0, y: 5.0}) == [2 * 5 + 5 + 6, 2 * 3 + 3]


def test_deep_expressions_are_no_recursion() -> None:
    deep = x
    for _ in range(5_000):
        deep = sin(deep) * y
    assert evaluate_float([derivative(deep, x)], {x: 0.0, y: 1.0}) == [1.0]
    assert evaluate_float(gradient(deep, [x, y]), {x: 0.0, y: 1.0})[0] == 1.0


def test_size_of_a_gradient_is_a_small_multiple_of_the_expression() -> None:
    for seed in range(20):
        expression = random_expression(np.random.default_rng(seed), depth=8)
        size = len(list(postorder([expression])))
        assert len(list(postorder(gradient(expression, LEAVES)))) <= 12 * size + 20


def test_partials_of_operations() -> None:
    assert partials(x * y) == ((y, x) if (x * y).args == (x, y) else (x, y))
    assert partials(sin(x))[0] is symbol("x") or partials(sin(x))[0].op == "cos"


FLAT = maximum(x, ZERO)


@pytest.mark.parametrize(
    ("law", "on", "slope"),
    [
        (sqrt(FLAT), 4.0, 1 / 4),
        (sqrt(absolute(x) + x), 2.0, 2 / (2 * math.sqrt(4))),
        (power(FLAT, number(Fraction(1, 3))), 8.0, 1 / 12),
        (power(FLAT, y), 4.0, 1 / 4),
        (acos(minimum(x + ONE, ONE)), -1.0, -1.0),
    ],
)
def test_a_root_of_what_stays_zero_stays_zero(law: Node, on: float, slope: float) -> None:
    """Off the law, here on the other side of its edge x = 0, and at the edge; on it the slope is the usual one."""
    for found in (derivative(law, x), gradient(law, [x])[0]):
        assert evaluate_float([found], {x: on, y: 0.5}) == pytest.approx([slope])
        for off in (-math.copysign(1.0, on), 0.0):
            assert evaluate_float([found], {x: off, y: 0.5}) == [0.0]


def test_the_exponent_of_what_stays_zero_changes_nothing() -> None:
    slope = derivative(power(FLAT, y), y)
    assert evaluate_float([slope], {x: -1.0, y: 1.5}) == [0.0]
    assert evaluate_float([slope], {x: 4.0, y: 1.5}) == pytest.approx([8 * math.log(4)])


def test_roots_without_a_kink_and_higher_powers_are_differentiated_without_choices() -> None:
    for law in (sqrt(x * y), power(x, y), acos(x), power(FLAT, number(Fraction(3, 2))), power(FLAT, number(-3))):
        assert not any(n.op in ("where", "less") for n in postorder(partials(law)[:1]))
