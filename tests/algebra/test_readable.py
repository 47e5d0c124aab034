"""Rewriting keeps the value and leaves nothing that a person would still simplify."""

from __future__ import annotations

import random
from time import process_time
from typing import Any

import pytest
import sympy
from random_formulas import L, a, b, k, m1, random_formula, u, v

from multibody_sym.algebra.simplify import (
    LARGEST_SUM,
    Readable,
    _product_of_factors,
    expanded_size,
    terms_of,
    with_numbers_outside,
    with_signs,
    with_sizes,
    with_squares,
)

m2 = sympy.Symbol("m2", positive=True)
c = sympy.Symbol("c", real=True)
w, x, y, z = sympy.symbols("w x y z", real=True)
sin, cos = sympy.sin, sympy.cos

readable = Readable(frozenset({u, v}), ((w, x, y, z),))


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        (m1 * (u * sin(a)) ** 2 + m1 * (u * cos(a)) ** 2, m1 * u**2),
        (cos(a) * cos(b) - sin(a) * sin(b), cos(a + b)),
        (sin(a) * cos(b) - cos(a) * sin(b), sin(a - b)),
        (cos(a) * (cos(b) * cos(c) - sin(b) * sin(c)) - sin(a) * (cos(b) * sin(c) + sin(b) * cos(c)), cos(a + b + c)),
        (L**2 * m1 + m2 * L**2, L**2 * (m1 + m2)),
        (m1 * u**2 / 2 + m1 * u * v + m1 * v**2 / 2, m1 * (u + v) ** 2 / 2),
        (m1 * sin(a) ** 2 * u**2 + 0, m1 * sin(a) ** 2 * u**2),
        (1 - 2 * (x**2 + y**2) - (w**2 - x**2 - y**2 + z**2), 0),
        (sympy.sqrt((L * cos(a)) ** 2 + (L * sin(a)) ** 2), L),
        (k * (a - L) ** 2 / 2, k * (a - L) ** 2 / 2),
        (L * sin(a) ** 2 / sympy.Abs(sin(a)), L * sympy.Abs(sin(a))),
        (L * sin(a) * cos(a) / sympy.Abs(sin(a)), L * sympy.sign(sin(a)) * cos(a)),
        (sympy.sign(a) / a + 2 / sympy.Abs(a), 3 / sympy.Abs(a)),
        (a / sympy.Abs(a) ** 3 + L * sympy.sign(a) ** 3 / a, 1 / (a * sympy.Abs(a)) + L / sympy.Abs(a)),
        (k * a**2 * sympy.sign(a), k * a * sympy.Abs(a)),
        (2 * sympy.Abs(2 * a - 2 * b) / 4, sympy.Abs(a - b)),
        (k * sympy.sign(a) ** 2, k * sympy.sign(a) ** 2),  # 0 where a is
    ],
)
def test_as_a_person_would_write_it(given: Any, wanted: Any) -> None:
    assert readable(given) == wanted


def test_large_expressions_are_left_alone() -> None:
    many = sympy.symbols(f"n0:{LARGEST_SUM}")
    product = sympy.Add(*many[:50]) * sympy.Add(*many[50:])
    assert expanded_size(product) > LARGEST_SUM
    assert readable(product) is product


@pytest.mark.parametrize("seed", range(60))
def test_the_value_stays(seed: int) -> None:
    expression = random_formula(random.Random(seed), 4)
    at = {m1: 1.1, k: 0.7, L: 1.7, a: 0.3, b: -1.1, u: 0.6, v: -0.8}
    before, after = (complex(e.evalf(20, subs=at)) for e in (expression, readable(expression)))
    assert after == pytest.approx(before, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("at", [0.7, -0.7, 2.3])
@pytest.mark.parametrize("power", range(-3, 4))
def test_signs_and_sizes_keep_their_values(power: int, at: float) -> None:
    for size, signs in [(1, 0), (-1, 0), (-1, 1), (1, 2), (-3, 1)]:
        given = a**power * sympy.Abs(a, evaluate=False) ** size * sympy.sign(a) ** signs + L
        values = (float(e.subs({L: 1.7, a: at})) for e in (given, readable(given)))
        assert next(values) == pytest.approx(next(values), rel=1e-14)


def test_what_holds_no_sign_square_or_shared_number_is_not_built_anew() -> None:
    """Most expressions hold none: looking costs a fraction of rebuilding every term."""
    expression = m1 * L**2 * u**2 / 2 + m2 * k * L * v * cos(a - b) - sin(a) / (L + k)
    terms = terms_of(expression)
    assert with_signs(terms) is terms
    assert with_sizes(terms) is terms
    assert with_squares(terms, frozenset({u, v})) is terms
    assert with_numbers_outside(expression) is expression


def test_high_powers_are_left_alone() -> None:
    """(1 - cos^2)^100 is no help to a reader, and a trap for a program."""
    high = sin(a) ** 200 + u * cos(a) ** 201
    assert readable(high) == high


def test_numbers_of_hundreds_of_digits_take_no_time() -> None:
    given = u**2 / 400 + sympy.Rational(25 * 10**600 + 1, 50) * v**2
    began = process_time()
    found = readable(given)
    assert process_time() - began < 1.0
    assert sympy.expand(found - given) == 0


def test_a_root_is_not_taken_apart_by_factors() -> None:
    """sympy writes sqrt(2 R h - h^2) as sqrt(h) sqrt(2 R - h), and may search for its factors for a minute."""
    R, h, x, y, u = sympy.symbols("R h x y u")
    root = sympy.sqrt(2 * R * h - h**2)
    whole = sympy.expand(-2 * R * u * (2 * R * h - 2 * h * y + x**2 - 2 * x * root + y**2))
    found = _product_of_factors(whole)
    assert root in found.atoms(sympy.Pow)
    assert not found.has(sympy.sqrt(h))
    assert len(found.args) == 4
    assert sympy.expand(found - whole) == 0
