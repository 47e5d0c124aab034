"""Shorter writings of formulas equal them at values other than the sample that chose them."""

from __future__ import annotations

from functools import cache

import pytest

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import exact, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter
from multibody_sym.algebra.roots import ShortForms
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

_SAMPLE = {"L": 2.0, "R": 1.3, "a": 0.7, "b": 1.1, "q": 0.4}
_OTHER = {"L": 3.0, "R": 0.9, "a": 0.4, "b": 0.6, "q": 0.9}


@cache
def _letters() -> dict[Node, Letter]:
    return {symbol(x): Letter(symbol(x), PRECISE.mpf(_SAMPLE.get(x, 0.5)), True) for x in "LRabqcfghnpruvwGWP"}


def _equal(one: Node, other: Node) -> None:
    values = {x: _OTHER.get(str(x.data), 0.8) for x in leaves([one, other], "symbol")}
    a, b = evaluate_float([one, other], values)
    assert a == pytest.approx(b, rel=1e-12)


@pytest.mark.parametrize(
    ("long", "short"),
    [
        ("sqrt(2*W*sqrt(W^2 + g/L) + 2*W^2 + g/L)", "W + sqrt((L*W^2 + g)/L)"),
        ("acos(sqrt((2*g*h + v^2)/(2*(g*h + v^2))))", "atan(v/sqrt(2*g*h + v^2))"),
        ("atan2(sqrt((5*L*g - v^2)*(L*g + v^2))/(3*g), 2*L/3 - v^2/(3*g))", "acos(2/3 - v^2/(3*L*g))"),
        ("atan(sqrt(5)/2)", "acos(2/3)"),
        ("atan(f + sqrt(f^2 + 1))", "atan(f)/2 + pi/4"),
        ("P*(f*cos(a) + sin(a))/sqrt(f^2 + 1)", "P*sin(a + atan(f))"),
        ("abs(R*u/sqrt(L^2 - R^2) + u)", "R*u/sqrt(L^2 - R^2) + u"),
        ("R*u^2*abs(1/(R - r))/r", "R*u^2/(r*abs(R - r))"),
        ("b*cos(a + q)*cos(c) + b*sin(a + q)*sin(c)", "b*cos(a + q - c)"),
        ("sqrt(sin(a + q)^2 - cos(a)^2 + 2*cos(a)*cos(a + q)*cos(q))", "cos(q)"),
        ("sqrt(a + b + 2*sqrt(a*b))", "sqrt(a + b + 2*sqrt(a*b))"),  # sqrt(a) + sqrt(b) is no shorter
        ("sqrt((a + b + sqrt((a - b)^2 + a*q))/c)", "sqrt((a + b + sqrt((a - b)^2 + a*q))/c)"),
        ("abs(a - b)", "abs(a - b)"),
        ("log((sqrt(u^2 + v^2) + v)/u)", "asinh(v/u)"),
        ("log(L + sqrt(L^2 - 1))", "acosh(L)"),
        ("log((L + R)/(L - R))/q", "2*atanh(R/L)/q"),
        ("log(a/b)", "log(a/b)"),
    ],
)
def test_shorter_writings(long: str, short: str) -> None:
    found = ShortForms(_letters()).shortest(parse(long))
    assert text(found) == short
    _equal(found, parse(long))


@pytest.mark.parametrize(
    ("long", "short"),
    [
        ("(1 - n)*(n + n^2 + 1)", "1 - n^3"),
        ("g*(p + 1)*(p - 1)*(p^2 + 1)/r", "g*(p^4 - 1)/r"),
        ("p^2 - sqrt((L + R)*(L - R))", "p^2 - sqrt(L^2 - R^2)"),
        ("u*sqrt(L^2 - R^2)/((L - R)^2*(L + R)^2)", "u/(L^2 - R^2)^1.5"),
        ("h*((P/c)^(1/3))^3/(P*c)", "h/c^2"),
        ("log(2/(1 - n) - 1)", "log(2/(1 - n) - 1)"),
        ("log(cosh(log((1 + n)/(1 - n))/2))", "-log(1 - n^2)/2"),
        ("log(exp(log(1 + v^2/u^2)/2) + v/u)", "log((sqrt(u^2 + v^2) + v)/u)"),
        ("asin(sin(a + q))", "a + q"),
        ("exp(asinh(u))", "sqrt(u^2 + 1) + u"),
        ("cosh(asinh(u))", "sqrt(u^2 + 1)"),
        ("tanh(atanh(n))", "n"),
        ("cosh(acosh(L)*2)", "2*L^2 - 1"),
        ("a*sin(q) + p*cos(g)*cos(r + q) - p*sin(g)*sin(r + q)", "a*sin(q) + p*cos(g + q + r)"),
    ],
)
def test_products_powers_and_waves_in_book_forms(long: str, short: str) -> None:
    over, node = Field(50_000), parse(long)
    known = {x: over.letter(x, letter) for x, letter in _letters().items()}
    found = book_form(with_whole_angles(exact(over, [node], known)[0]))
    assert text(found) == short
    _equal(found, node)
