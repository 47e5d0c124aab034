"""Squares of differences equal the sums that they stand for."""

from __future__ import annotations

import pytest
import sympy

from multibody_sym.algebra.simplify import expression_of, terms_of, with_squares


@pytest.mark.parametrize(
    "sums",
    [
        "x**2 - 2*x*y + y**2",
        "3*x**2 - 2*x*y + y**2",
        "k*(x**2/2 + x*y + 5*y**2)",
        "x**2 - 2*x*y + y**2 - 2*y*z + z**2 + y**2",
        "x**2 - 3*x*y + y**2",
        "-x**2 + 2*x*y - 4*y**2",
    ],
)
def test_squares_are_equal_to_what_they_stand_for(sums: str) -> None:
    expression = sympy.sympify(sums)
    found = expression_of(with_squares(terms_of(expression), frozenset()))
    assert sympy.expand(found - expression) == 0
    assert (found.count_ops() < sympy.expand(expression).count_ops()) == ("3*x*y" not in sums)
