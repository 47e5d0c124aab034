"""Derivatives by the chain rule over names, against sympy's derivatives of the written-out expressions."""

from __future__ import annotations

from typing import Any

import pytest
import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions, partials, tidy_definitions
from multibody_sym.errors import NoSolutionError
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.parser import parse

q, u, p = sympy.symbols("q u p", real=True)
LEAVES = {symbol(x.name): x for x in (q, u, p)}
TEXT = "sin(q*p)*(u + sin(q*p))^2/sqrt(1 + q^2) + exp(q*u)*(u + sin(q*p)) - 3.7*cos(q)*q*p + atan2(u, 2 + q^2)"


def written_out(names: Subexpressions, expression: Any) -> Any:
    """Return an expression without names and number symbols."""
    known: dict[Any, Any] = {s: to_sympy(node, {}) for s, node in names.numbers.items()}
    for name, e in names.definitions.items():
        known[name] = e.xreplace(known)
    return expression.xreplace(known)


def translated(text: str) -> tuple[Subexpressions, Any, Any]:
    """Return names, an expression over them, and the same written out."""
    node = parse(text)
    names = Subexpressions("z", Budget())
    return names, names.translated([node], LEAVES)[0], to_sympy(node, LEAVES)


def assert_equal(found: Any, expected: Any) -> None:
    at = {q: 0.7, u: -1.3, p: 0.4}
    assert float(found.subs(at)) == pytest.approx(float(expected.subs(at)), rel=1e-12)


def test_translation_names_what_is_shared_and_keeps_the_value() -> None:
    names, expression, whole = translated(TEXT)
    assert sympy.sin(q * p) in [written_out(names, e) for e in names.definitions.values()]
    assert_equal(written_out(names, expression), whole)


def test_gradient() -> None:
    names, expression, whole = translated(TEXT)
    for leaf, found in zip((q, u, p), names.gradient(expression, (q, u, p)), strict=True):
        assert_equal(written_out(names, found), whole.diff(leaf))


def test_tangents_and_second_derivatives() -> None:
    names, expression, whole = translated(TEXT)
    slope = names.gradient(expression, [u])[0]
    found = names.tangents([slope], {q: u, u: p})[0]
    assert_equal(written_out(names, found), whole.diff(u, q) * u + whole.diff(u, 2) * p)


def test_numbers_never_enter() -> None:
    names, expression, _ = translated("3.7*q + 981/100*u*q + 2*u")
    assert sorted(node.shadow for node in names.numbers.values() if node.shadow) == [3.7, 9.81]
    assert not expression.has(sympy.Rational(37, 10))


@pytest.mark.parametrize(("text", "slopes"), [
    ("abs(q)", (1, -1)), ("sign(q)*u", (0, 0)), ("max(q, 0)", (1, 0)), ("min(q, 0)*2", (0, 2)),
])
def test_at_a_kink_the_derivative_is_that_of_either_side(text: str, slopes: tuple[float, float]) -> None:
    _, expression, _ = translated(text)
    slope = partials(expression).get(q, sympy.S.Zero)
    assert [slope.subs({q: 0.5, u: 1}), slope.subs({q: -0.5, u: 1})] == list(slopes)


def test_lowering_gives_the_same_value() -> None:
    names, expression, whole = translated(TEXT)
    back: dict[Any, Node] = {x: node for node, x in LEAVES.items()}
    node = names.lowered([expression], back)[0]
    values = dict(zip(LEAVES, (0.7, -1.3, 0.4), strict=True))
    assert evaluate_float([node], values)[0] == pytest.approx(float(whole.subs({q: 0.7, u: -1.3, p: 0.4})), rel=1e-12)


def test_tidying_drops_names_used_once_and_numbers_the_rest() -> None:
    z1, z2, z3, z4 = sympy.symbols("z1:5", real=True)
    definitions = {z1: q * p, z2: z1 + 1, z3: u**2, z4: z3 * z2}
    kept, replaced = tidy_definitions(definitions, [z4 + z1, z1 * u], "z")
    assert kept == [(z1, q * p)]
    assert (z4 + z1).xreplace(replaced) == u**2 * (z1 + 1) + z1


def test_past_the_budget_the_stage_and_the_way_out_are_named() -> None:
    names = Subexpressions("z", Budget(operations=2))
    names.budget.enter("the energies")
    with pytest.raises(NoSolutionError, match=r"stopped at the energies .* composite_body"):
        names.translated([parse(TEXT)], LEAVES)
