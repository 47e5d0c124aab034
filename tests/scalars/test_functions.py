"""One expression over three scalars: float, Node and sympy give the same value."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy
from random_expressions import LEAVES, random_expression, random_point

from multibody_sym.scalars import functions as f
from multibody_sym.scalars.node import FLOAT_OPERATIONS, Node, as_node, symbol

x, y = symbol("x"), symbol("y")
SYMBOLS = {leaf: sympy.Symbol(leaf.data, real=True) for leaf in LEAVES}


@pytest.mark.parametrize("seed", range(60))
def test_three_scalars_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    expression, point = random_expression(rng, depth=4), random_point(rng)
    (value,) = f.evaluate([expression], point, float)
    over_nodes = f.evaluate([expression], {leaf: as_node(x) for leaf, x in point.items()})[0]
    assert over_nodes.shadow == pytest.approx(value, rel=1e-12, abs=1e-14)
    (translated,) = f.evaluate([expression], SYMBOLS, sympy.Expr)
    numbers = {SYMBOLS[leaf]: x for leaf, x in point.items()}
    assert float(translated.subs(numbers).evalf()) == pytest.approx(value, rel=1e-9, abs=1e-12)


def test_substitution_is_evaluation_over_nodes() -> None:
    (found,) = f.evaluate([f.sin(x) + y], {x: y, y: as_node(2)})
    assert found is f.sin(y) + 2
    assert f.evaluate([x * y], lambda leaf: leaf)[0] is x * y


def test_functions_take_the_richest_scalar() -> None:
    assert f.sin(0.5) == math.sin(0.5)
    assert isinstance(f.atan2(x, 2), Node)
    assert f.atan2(sympy.Symbol("a"), 2) == sympy.atan2(sympy.Symbol("a"), 2)
    assert f.maximum(1, 2.5) == 2.5


def test_integers_stay_exact_where_they_can() -> None:
    """So that 0 and 1 in rotation matrices stay structural."""
    assert (f.sin(0), type(f.sin(0))) == (0, int)
    assert (f.cos(0), type(f.cos(0))) == (1, int)
    assert (f.sqrt(1), type(f.sqrt(1))) == (1, int)


def test_constants_of_nodes_stay_exact_in_sympy() -> None:
    (found,) = f.evaluate([x / 3 + f.sqrt(as_node(2)) * f.pi], SYMBOLS, sympy.Expr)
    assert found == SYMBOLS[x] / 3 + sympy.sqrt(2) * sympy.pi


def test_of_a_choice_only_the_chosen_branch_is_looked_at() -> None:
    """In a table of 1,000 rows that are each an unknown of their own, one of them and the argument are read."""
    rows = [symbol(f"row{k}") for k in range(1000)]

    def chosen(first: int, last: int) -> Node:
        middle = (first + last) // 2
        return rows[first] if last - first == 1 else f.where(x < middle, chosen(first, middle), chosen(middle, last))

    assert f.evaluate_float([chosen(0, 1000)], {x: 617.5, rows[617]: 4.0}) == [4.0]
    with pytest.raises(ZeroDivisionError):
        f.evaluate_float([f.where(1 / x < 2, y, y + 1)], {x: 0.0, y: 1.0})
    assert f.evaluate_float([f.where(y < 2, y, 1 / x)], {x: 0.0, y: 1.0}) == [1.0]


def test_unknown_leaf_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        f.evaluate([x + y], {x: 1.0}, float)


def test_every_operation_has_a_float() -> None:
    assert FLOAT_OPERATIONS["where"](1.0, 2.0, 3.0) == 2.0
    assert [FLOAT_OPERATIONS["sign"](a) for a in (-2.0, 0.0, 3.0)] == [-1.0, 0.0, 1.0]
    assert FLOAT_OPERATIONS["less"](1.0, 1.0) == 0.0
    assert FLOAT_OPERATIONS["less_equal"](1.0, 1.0) == 1.0


def test_node_of_takes_sympy_at_the_door() -> None:
    assert f.node_of(sympy.Symbol("x") * 2) is 2 * x
    assert f.node_of(1.5) is as_node(1.5)
    with pytest.raises(TypeError):
        f.node_of("x")
