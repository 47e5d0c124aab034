"""Values of a symbol at which an exact quotient vanishes, in closed form; inverse functions of known numbers."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq

from multibody_sym.algebra.quotient_functions import exact, register_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter
from multibody_sym.algebra.roots import roots
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

SAMPLE = {"a": 0.7, "b": 1.9, "c": 0.4}


def solved(expression: str, low: float, high: float) -> tuple[float, list[str], list[float]]:
    """Return the root x between two values by bisection, the closed forms near it, and their values."""
    node = parse(expression)
    known_values = {symbol(name): value for name, value in SAMPLE.items()}
    near = brentq(lambda x: evaluate_float([node], {**known_values, symbol("x"): x})[0], low, high, xtol=1e-15)
    field = Field(100_000)
    samples = {**known_values, symbol("x"): near}
    known = {s: field.letter(s, Letter(s, PRECISE.mpf(repr(value)))) for s, value in samples.items()}
    register_angles(field, [node], known)
    found = list(roots(exact(field, [node], known)[0], symbol("x")))
    return near, [text(form) for form in found], [evaluate_float([form], known_values)[0] for form in found]


@pytest.mark.parametrize(
    ("expression", "low", "high", "form"),
    [
        ("a*x - b*c", 0.0, 5.0, "b*c/a"),
        ("x^2 + a*x - b", 0.0, 5.0, "(sqrt(a^2 + 4*b) - a)/2"),
        ("sin(x) - a*cos(x)", 0.0, 1.5, "atan(a)"),
        ("sin(x) - a*cos(x)", 3.0, 4.5, "atan(a) + pi"),
        ("b*sin(x) + a*cos(x) - c", -1.0, 1.0, "asin(c/sqrt(a^2 + b^2)) - atan(a/b)"),
        ("b*sin(x)^2 - a*sin(x)*cos(x)", 0.1, 1.5, "atan(a/b)"),
        ("cos(2*x) - c", 0.0, 1.5, "acos(sqrt((c + 1)/2))"),
        ("exp(a*x) - b", 0.0, 5.0, "log(b)/a"),
        ("a*(exp(x) - 1)/(exp(x) + 1) - c", 0.0, 5.0, "log((a + c)/(a - c))"),
        ("tanh(x) - c", 0.0, 5.0, "log((c + 1)/(1 - c))/2"),
        ("sqrt(x + a) - b", 0.0, 5.0, "b^2 - a"),
        ("(x - a)*(x^5 + x + b)", 0.0, 1.5, "a"),
    ],
)
def test_roots_in_closed_form(expression: str, low: float, high: float, form: str) -> None:
    near, forms, values = solved(expression, low, high)
    right = [written for written, value in zip(forms, values, strict=True) if value == pytest.approx(near, rel=1e-13)]
    assert form in right


def test_what_has_no_closed_form_gives_none() -> None:
    assert solved("x - cos(x)*a", 0.0, 1.5)[1] == []
    assert solved("x^5 + x - b", 0.0, 1.5)[1] == []


@pytest.mark.parametrize(
    ("expression", "form"),
    [("atan2(1, 0)", "pi/2"), ("atan2(-1, -1)", "-3*pi/4"), ("acos(1/2)", "pi/3")],
)
def test_inverse_functions_of_known_numbers_are_parts_of_a_turn(expression: str, form: str) -> None:
    field = Field(10_000)
    angle, wanted = exact(field, [parse(expression), parse(form)], {})
    assert float(angle.sample) == pytest.approx(float(wanted.sample), rel=1e-15)
    assert (angle - wanted).is_zero


def test_other_numbers_are_no_parts_of_a_turn() -> None:
    field = Field(10_000)
    (angle,) = exact(field, [parse("atan(2)")], {})
    assert text(next(letter.node for letter in field.letters[1:] if letter.node is not None)) == "atan(2)"
    assert float(angle.sample) == pytest.approx(math.atan(2), rel=1e-15)
