"""Tabulated functions against scipy's splines and numpy's lines: values, derivatives, other forms of the same Node."""

from __future__ import annotations

import pickle
from fractions import Fraction

import numpy as np
import pytest
import sympy
from scipy.interpolate import CubicSpline

from multibody_sym.scalars import sign_changes
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, PI, table
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, number, symbol
from multibody_sym.scalars.sign_changes import at_knots, known_zeros, switching_functions
from multibody_sym.scalars.sympy_bridge import from_sympy, to_sympy
from multibody_sym.scalars.tabulated import Kind, Tabulated, TabulatedRows
from multibody_sym.text.printer import text

T = symbol("t")
X = np.sort(np.random.default_rng(1).uniform(0, 3, 50))
Y = np.sin(5 * X)


def tabulated(kind: Kind) -> Node:
    return table(Tabulated("way", TabulatedRows(X, Y, {}), kind), 0, T)


def at(node: Node, times: np.ndarray) -> np.ndarray:
    return np.array([evaluate_float([node], {T: t})[0] for t in times])


def test_a_spline_and_its_derivatives_are_those_of_scipy() -> None:
    spline, node = CubicSpline(X, Y, bc_type="natural"), tabulated("cubic")
    inside, outside = np.random.default_rng(2).uniform(X[0], X[-1], 200), np.array([-1.0, 4.0])
    for order in range(5):
        assert at(node, inside) == pytest.approx(spline(inside, order), rel=1e-9, abs=1e-9), order
        assert list(at(node, outside)) == ([Y[0], Y[-1]] if order == 0 else [0, 0])
        node = derivative(node, T)
    assert node is number(0)


def test_lines_are_those_of_numpy_and_exact_for_exact_arguments() -> None:
    times, node = np.random.default_rng(3).uniform(-1, 4, 200), tabulated("linear")
    assert at(node, times) == pytest.approx(np.interp(times, X, Y), rel=1e-14)
    slopes = np.diff(Y) / np.diff(X)
    assert at(derivative(node, T), (X[1:] + X[:-1]) / 2) == pytest.approx(slopes, rel=1e-12)
    thirds = Tabulated("f", TabulatedRows([0.0, 1.0], [0.0, 1 / 3], {(1, 1): number(Fraction(1, 3))}), "linear")
    assert table(thirds, 0, number(Fraction(1, 2))) is number(Fraction(1, 6))


def test_its_slope_jumps_where_a_function_of_each_knot_changes_its_sign() -> None:
    found = switching_functions([tabulated("linear")])
    assert [known_zeros(g, T, {}) for g in found] == [[x] for x in X]
    ends = switching_functions([tabulated("cubic")])
    assert [known_zeros(g, T, {}) for g in ends] == [[X[0]], [X[-1]]]


def test_its_slope_jumps_where_one_function_changes_its_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sign_changes, "FEW_KNOTS", 2)
    (knots,) = switching_functions([tabulated("linear")])
    middles = np.concatenate([[-1.0], (X[1:] + X[:-1]) / 2, [4.0]])
    assert list(np.sign(at(knots, middles))) == [-1.0 if k % 2 == 0 else 1.0 for k in range(len(X) + 1)]
    assert not at(knots, X).any()
    moved = evaluate([knots], {T: 2 * T - number(1)})[0]
    assert known_zeros(moved, T, {}) == pytest.approx((X + 1) / 2)


def test_it_comes_back_from_sympy_and_from_a_pickle() -> None:
    node = tabulated("cubic") * T
    expression = to_sympy(node, {})
    time = sympy.Symbol("t", real=True)
    assert str(expression) == "t*way(t)"
    assert from_sympy(expression) is node
    assert from_sympy(sympy.diff(expression, time)) is derivative(node, T)
    assert float(expression.subs(time, 2).evalf()) == pytest.approx(evaluate_float([node], {T: 2.0})[0], rel=1e-14)
    assert text(derivative(node, T)) == "t*way'(t) + way(t)"
    assert pickle.loads(pickle.dumps(node)) is node
    assert pickle.loads(pickle.dumps(expression)) == expression


def test_names_tell_tables_apart_and_their_numbers_do_not_order_sums() -> None:
    first, second = (TabulatedRows([0.0, 1.0], [0.0, y], {}) for y in (1.0, 2.0))
    given = (("a", first), ("b", first), ("a", second))
    a, b, c = (table(Tabulated(name, rows, "linear"), 0, T) for name, rows in given)
    assert a is not b
    assert a is not c
    assert repr(first) == "<2 rows from 0.0 to 1.0>"
    assert BUILD["add"](a, b) is BUILD["add"](b, a)
    assert BUILD["add"](c, b).args.index(c) == BUILD["add"](a, b).args.index(a)


def test_knots_are_exact_numbers_that_later_expressions_share() -> None:
    """A float would take the place of the equal integer or fraction wherever that is written from then on."""
    x = [number(7919), number(Fraction(15841, 2)), 2523 * PI]
    rows = TabulatedRows([7919.0, 7920.5, 2523 * np.pi], [0.0, 1.0, 2.0], {(2, 0): x[2]})
    assert at_knots(table(Tabulated("way", rows, "linear"), 0, T)) == [T - each for each in x]
    knots = at_knots(table(Tabulated("way", TabulatedRows([6007.0, 6008.5], [0.0, 1.0], {}), "linear"), 0, T))
    assert knots == [T - 6007, T - Fraction(12017, 2)]
    assert [type(number(value).data) for value in (6007, Fraction(12017, 2))] == [int, Fraction]
