"""One form of a root in all formulas of a problem, wherever that makes none of them longer."""

from __future__ import annotations

import random

import pytest
from mpmath import MPContext

from multibody_sym.algebra.quotients import PRECISE, Letter
from multibody_sym.algebra.roots import with_shared_roots
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

PLACES = 5
EXACT = MPContext()
EXACT.dps = 40
SAMPLE = {"m": 1.5, "k": 7.0, "l": 0.5, "g": 9.8, "h": 0.3, "W": 4.0, "A": 0.2, "a": 0.6, "x": 2.0, "t": 1.0}
TURNING = ("a", "x")
"""Symbols that may be negative."""

SHARED = {
    "a root's factor that is a square beside a divisor": (
        ["sqrt((g*l + k)/m)", "m/(sqrt(m*(g*l + k)) - m*sqrt(h))"],
        ["sqrt((g*l + k)/m)", "1/(sqrt((g*l + k)/m) - sqrt(h))"],
    ),
    "the square of a sum of what is positive": (
        ["sqrt(W^2 + g*h/(A + m*h^2)^2)", "4*(A + m*h^2)/sqrt(W^2*(A + m*h^2)^2 + g*h)"],
        ["sqrt(W^2 + g*h/(A + m*h^2)^2)", "4/sqrt(W^2 + g*h/(A + m*h^2)^2)"],
    ),
    "numbers": (["sqrt(k + 3*g)", "x*sqrt(4*k + 12*g)/2"], ["sqrt(k + 3*g)", "x*sqrt(k + 3*g)"]),
    "the later form where it is the shorter one": (
        ["sqrt(W^4*(k + cos(a)))/W^2", "sqrt(k + cos(a))"],
        ["sqrt(k + cos(a))", "sqrt(k + cos(a))"],
    ),
    "the form that is met first, of two that serve": (
        ["sqrt(W^2 + g/(h*W)^2)", "6*pi*h*W/sqrt(h^2*W^4 + g)"],
        ["sqrt(W^2 + g/(h*W)^2)", "6*pi/sqrt(W^2 + g/(h*W)^2)"],
    ),
}
KEPT = {
    "a form that would be longer": ["sqrt(k/m)", "sqrt(k*m)"],
    "a period and its frequency": ["sqrt(k/m)", "2*pi*sqrt(m/k)"],
    "what may be negative": ["sqrt(k + g)", "sqrt(k*x^2 + g*x^2)/x"],
    "a difference, which may be negative": ["sqrt(k)", "sqrt(k*(l - h)^2)/(l - h)"],
    "other roots": ["sqrt(k + g)", "sqrt(k + 2*g)", "sqrt(k)", "sqrt(2*k + g)"],
    "symbols without a sample": ["sqrt(m*y + m*g)/m", "sqrt((y + g)/m)"],
    "one root": ["x*sqrt(m*k)/m"],
}


def shared(expressions: list[str]) -> list[str]:
    letters = {
        symbol(name): Letter(symbol(name), PRECISE.mpf(value), name not in TURNING) for name, value in SAMPLE.items()
    }
    return [text(node) for node in with_shared_roots([parse(x) for x in expressions], letters)]


def value(node: Node, at: dict[str, float]) -> object:
    """Return the value of an expression in 40 digits."""
    functions = {"sqrt": EXACT.sqrt, "cos": EXACT.cos, "pi": EXACT.pi}
    numbers = {name: EXACT.mpf(x) for name, x in at.items()}
    return eval(text(node).replace("^", "**"), {"__builtins__": {}}, {**functions, **numbers})


@pytest.mark.parametrize("name", SHARED)
def test_a_root_has_one_form(name: str) -> None:
    before, after = SHARED[name]
    assert shared(before) == [text(parse(x)) for x in after]


@pytest.mark.parametrize("name", SHARED)
def test_each_value_stays_wherever_parameters_are_positive(name: str) -> None:
    draw = random.Random(name)
    before, after = SHARED[name][0], shared(SHARED[name][0])
    for old, new in zip(before, after, strict=True):
        assert len(new) <= len(text(parse(old)))
        names = {leaf.data for leaf in leaves([parse(old), parse(new)], "symbol")}
        for _ in range(PLACES):
            at = {each: draw.choice((-1, 1) if each in TURNING else (1,)) * draw.uniform(1.0, 2.0) for each in names}
            was, now = value(parse(old), at), value(parse(new), at)
            assert abs(was - now) <= EXACT.mpf(10) ** -30 * abs(was)


@pytest.mark.parametrize("name", KEPT)
def test_what_would_be_longer_or_another_value_stays(name: str) -> None:
    assert shared(KEPT[name]) == [text(parse(x)) for x in KEPT[name]]
