"""Lines by which an equation is solved: each holds at the root, and they lead to it."""

from __future__ import annotations

import pytest

from multibody_sym.algebra.quotients import PRECISE, Letter
from multibody_sym.answers.ask.working import solving_lines
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

SAMPLE = {"f": 0.2, "g": 9.81, "h": 6.0, "v": 14.0, "L": 1.5, "a": 1.2, "x": 0.9}


@pytest.mark.parametrize(
    ("function", "unknown", "root", "last"),
    [
        ("sqrt(1/(g*cos(a)*(sin(a) - f*cos(a))))", "a", "atan(f + sqrt(f^2 + 1))", "tan(a) = f + sqrt(f^2 + 1)"),
        (
            "v*cos(a)*(v*sin(a) + sqrt(v^2*sin(a)^2 + 2*g*h))/g",
            "a",
            "acos(sqrt((2*g*h + v^2)/(2*g*h + 2*v^2)))",
            "cos(a) = sqrt((2*g*h + v^2)/(2*(g*h + v^2)))",
        ),
        ("sqrt((12*x^2 + L^2)/(g*x))", "x", "sqrt(3)*L/6", "L^2 - 12*x^2 = 0"),
        ("exp(-f*x)*(1 - exp(-v*f*x))", "x", "log(v + 1)/(v*f)", "exp(-f*v*x) = 1/(v + 1)"),
    ],
)
def test_lines_hold_at_the_root_and_lead_to_it(function: str, unknown: str, root: str, last: str) -> None:
    letters = {symbol(name): Letter(symbol(name), PRECISE.mpf(value), True) for name, value in SAMPLE.items()}
    sample = {node: float(letter.sample) for node, letter in letters.items()}
    zero, x = derivative(parse(function), symbol(unknown)), symbol(unknown)
    lines = solving_lines(zero, x, parse(root), letters, sample)
    assert " = ".join(map(text, lines[-1].sides)) == last
    there = {**sample, x: evaluate_float([parse(root)], sample)[0]}
    for line in lines:
        left, right = evaluate_float(line.sides, there)
        size = max(abs(left), abs(right), *(abs(x) for x in evaluate_float([line.sides[0]], sample)))
        assert abs(left - right) <= 1e-9 * abs(size)


def test_a_root_that_no_known_step_leads_to_has_no_lines() -> None:
    letters = {symbol("x"): Letter(symbol("x"), PRECISE.mpf(0.7), True)}
    assert solving_lines(parse("x - cos(x)"), symbol("x"), parse("0.7390851332151607"), letters, {}) == []
