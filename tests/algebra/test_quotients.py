"""Exact quotients: what vanishes is seen to vanish, and values agree with floats."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import factor_list
from sympy.polys.domains import ZZ
from sympy.polys.orderings import lex
from sympy.polys.rings import ring

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import exact, exact_solve, register_angles, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient, factors_of
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, number, symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

SAMPLE = {symbol("a"): 2, symbol("b"): 3, symbol("c"): 5, symbol("x"): 0.7, symbol("y"): -1.3}


def quotient(expression: str | Node, *, expands: bool = False, work: int = 10**6) -> Quotient:
    """Return an expression in a, b, c > 0 and x, y over a new field."""
    field = Field(work, expands)
    known = {
        node: field.letter(node, Letter(node, PRECISE.mpf(str(value)), node.data in "abc"))
        for node, value in SAMPLE.items()
    }
    return exact(field, [parse(expression) if isinstance(expression, str) else expression], known)[0]


@pytest.mark.parametrize("expression", [
    "(a + b)^2 - a^2 - 2*a*b - b^2",
    "a/(a + b) + b/(a + b) - 1",
    "sin(x)^2 + cos(x)^2 - 1",
    "sin(x)^4 - cos(x)^4 + cos(2*x)",
    "sin(3*x) - 3*sin(x) + 4*sin(x)^3",
    "tan(x)*cos(x) - sin(x)",
    "sin(pi/2 - x) - cos(x)",
    "cos(pi + x) + cos(x)",
    "sin(pi/3) - sqrt(3)/2",
    "cos(-3*pi/4) + 1/sqrt(2)",
    "sin(19*pi/36) - cos(pi/36)",
    "sqrt(a^2 + 2*a*b + b^2) - a - b",
    "sqrt(8)*sqrt(2) - 4",
    "1/(sqrt(2) - 1) - sqrt(2) - 1",
    "sqrt(a^2*cos(x)^2 + a^2*sin(x)^2) - a",
    "sqrt(1 - cos(x)^2) - sin(x)",
    "sqrt(a/b)*sqrt(b/a) - 1",
    "1/sqrt(a^2 + b^2) - sqrt(a^2 + b^2)/(a^2 + b^2)",
    "abs(y) + y",
    "min(a, b) - a",
    "max(a, b) - b",
    "where(a < b, c, x) - c",
    "sign(y)*a + a",
    "a^(3/2)*sqrt(a) - a^2",
    "a^(x + 1)*a^(x - 1) - (a^x)^2",
    "b^(2 - x) - b^2*b^(-x)",
])  # fmt: skip
def test_what_vanishes_is_zero(expression: str) -> None:
    assert quotient(expression).is_zero


@pytest.mark.parametrize("angle", [-9.0, -2.5, -0.4, 0.3, 1.2, 2.0, 3.1, 7.0])
@pytest.mark.parametrize("arguments", [
    "sin(x), cos(x)", "-sin(x), cos(x)", "sin(x), -cos(x)", "-sin(x), -cos(x)",
    "cos(x), sin(x)", "cos(x), -sin(x)", "-cos(x), sin(x)", "-cos(x), -sin(x)",
    "0, a", "0, -a", "a, 0", "-a, 0",
])  # fmt: skip
def test_an_angle_is_known_by_its_sine_and_cosine(arguments: str, angle: float) -> None:
    field = Field(10**6)
    sample = {symbol("x"): angle, symbol("a"): 0.7}
    letters = {node: Letter(node, PRECISE.mpf(value), node.data == "a") for node, value in sample.items()}
    known = {node: field.letter(node, letter) for node, letter in letters.items()}
    node = parse(f"atan2({arguments})")
    found = book_form(exact(field, [node], known)[0])
    assert "atan2" not in text(found)
    assert evaluate_float([found], sample)[0] == pytest.approx(evaluate_float([node], sample)[0], abs=1e-14)


def test_sums_of_angles_are_written_out_on_request() -> None:
    expression = "sin(x + y) - sin(x)*cos(y) - cos(x)*sin(y)"
    assert quotient(expression, expands=True).is_zero
    assert not quotient(expression).is_zero
    assert quotient(expression).vanishes


def test_half_angles_are_shared_whichever_comes_first() -> None:
    field, x = Field(10**6), symbol("x")
    known = {x: field.letter(x, Letter(x, PRECISE.mpf("0.7")))}
    node = parse("sin(x) - 2*sin(x/2)*cos(x/2) + cos(x) - 2*cos(x/2)^2 + 1")
    register_angles(field, [node], known)
    assert exact(field, [node], known)[0].is_zero


def test_pairs_of_half_angles_become_whole_ones() -> None:
    assert text(book_form(with_whole_angles(quotient("a*sin(x/2)*cos(x/2)")))) == "a*sin(x)/2"
    assert text(book_form(with_whole_angles(quotient("1 - 2*sin(x/2)^2")))) == "cos(x)"
    assert text(book_form(with_whole_angles(quotient("sin(x/2)")))) == "sin(x/2)"


_leaf = st.sampled_from([*SAMPLE, number(2), number(7), parse("pi")])
_pair = st.sampled_from([lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / (b * b + 1)])
_node = st.recursive(
    _leaf,
    lambda inner: st.one_of(
        st.builds(lambda f, a, b: f(a, b), _pair, inner, inner),
        st.builds(lambda a: BUILD["sqrt"](a * a + 1), _leaf),
        st.builds(lambda name, a: BUILD[name](a), st.sampled_from(["sin", "cos"]), _leaf),
    ),
    max_leaves=8,
)


@given(_node)
@settings(max_examples=150, deadline=None)
def test_values_agree_with_floats(node: Node) -> None:
    found = quotient(node)
    value = evaluate_float([node], {leaf: float(x) for leaf, x in SAMPLE.items()})[0]
    assert float(found.sample) == pytest.approx(value, rel=1e-9, abs=1e-9)
    above, below = (float(found.field.value(p)) for p in (found.above, found.below))
    assert above / below == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_signs_that_decide_are_noted_once_factor_by_factor() -> None:
    found = quotient("abs(x*(a - b)*c) + abs(b - a)")
    assert sorted(float(condition.sample) for condition in found.field.positive) == pytest.approx([0.7, 1.0])


@pytest.mark.parametrize("expression", ["1/(b - a - 1)", "sign(b - a - 1)", "sqrt(y)", "a^100", "abs(a*b - 6)"])
def test_what_is_undecided_at_the_sample_has_no_closed_form(expression: str) -> None:
    with pytest.raises(NoClosedFormError):
        quotient(expression)


def test_the_work_is_limited() -> None:
    with pytest.raises(NoClosedFormError, match="too long"):
        quotient("(a + b + c + x + y)^20", work=1000)


@given(st.lists(st.lists(st.integers(-3, 3), min_size=4, max_size=4), min_size=1, max_size=3))
@settings(max_examples=60, deadline=None)
def test_factors_are_those_that_sympy_finds(coefficients: list[list[int]]) -> None:
    polynomials, x, y, z = ring("x,y,z", ZZ, lex)
    p = polynomials(2)
    for c in coefficients:
        p = p * (c[0] * x + c[1] * y * z + c[2] * y + c[3])
    if not p:
        return
    content, found = factors_of(p)
    product = polynomials(content)
    for factor, exponent in found:
        product = product * factor**exponent
    assert product == p
    _, expected = factor_list(p.as_expr())
    assert sorted(exponent for _, exponent in found) == sorted(exponent for _, exponent in expected)


def test_equations_are_solved_as_by_cramer_s_rule() -> None:
    field = Field(10**6)
    a, b, c = (field.letter(n, Letter(n, PRECISE.mpf(SAMPLE[n]))) for n in map(symbol, "abc"))
    one, zero = field.constant(1), field.constant(0)
    x = exact_solve([[zero, a, one], [a, b, zero], [one, zero, c]], [one, zero, zero])
    determinant = b * one * (-1) * one + a * (-a * c)  # expanded by hand: -(b + a^2 c)
    assert (x[0] * determinant - b * c).is_zero
    assert (x[1] * determinant + a * c).is_zero
    assert (x[2] * determinant + b).is_zero


def test_dependent_equations_leave_unknowns_at_zero() -> None:
    field = Field(10**6)
    a = field.letter("a", Letter(symbol("a"), PRECISE.mpf(2)))
    x = exact_solve([[a, a], [a * 2, a * 2]], [field.constant(1), field.constant(2)])
    assert sum((value.is_zero for value in x), 0) == 1
    assert (a * (x[0] + x[1]) - 1).is_zero


def test_equations_that_depend_at_the_sample_only_have_no_closed_form() -> None:
    field = Field(10**6)
    a = field.letter("a", Letter(symbol("a"), PRECISE.mpf(1)))
    one = field.constant(1)
    with pytest.raises(NoClosedFormError, match="given values"):
        exact_solve([[one, one], [one, a]], [one, one])


def test_equations_between_numbers_of_sixteen_digits_end_where_their_integers_are_no_doubles() -> None:
    """Each elimination multiplies two of them: of twelve such equations the solution has far too many digits."""
    field, chance = Field(10**6), random.Random(1)
    a = field.letter("a", Letter(symbol("a"), PRECISE.mpf(2)))
    rows = [[field.constant(Fraction(str(chance.uniform(1, 2)))) + a * (i == k) for k in range(12)] for i in range(12)]
    with pytest.raises(NoClosedFormError, match="numbers of the closed form are too long"):
        exact_solve(rows, [field.constant(k) for k in range(12)])


def test_factors_of_polynomials_with_long_coefficients_are_not_looked_for() -> None:
    """A product whose coefficients have a thousand binary digits is told as one factor."""
    _, x = ring("x", ZZ, lex)
    n, m = 3**400, 5**260
    short, long = ((x**2 + p) * (x**2 + q) for p, q in ((2, 3), (n, m)))
    assert [factor for factor, _ in factors_of(short)[1]] == [x**2 + 2, x**2 + 3]
    assert factors_of(long) == (1, [(long, 1)])


def test_fifty_digits_are_kept() -> None:
    difference = quotient("sqrt(2)^2 - 2 + 1e-20*sqrt(2)")
    assert float(difference.sample) == pytest.approx(1e-20 * math.sqrt(2), rel=1e-14)
