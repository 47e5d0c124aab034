"""Formulas as a book prints them: from any equal expression to the same short text, which reads back as its value."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.inequalities import comparison
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

SAMPLE = {
    "g": 10.0, "m": 1.5, "m1": 1.0, "m2": 2.0, "M": 5.0, "F": 30.0, "F1": 3.0, "F2": 5.0, "h": 2.0, "l": 0.5, "k": 7.0,
    "J": 0.25, "r": 0.1, "v": 4.0, "a": 0.6, "b": 0.4, "mu": 0.2,
}  # fmt: skip


def closed(expression: str) -> Quotient:
    """Return an expression of letters that are positive, but for the angles, over a new field."""
    field, node = Field(10**6), parse(expression)
    known = {
        leaf: field.letter(leaf, Letter(leaf, PRECISE.mpf(SAMPLE[leaf.data]), leaf.data not in ("a", "b")))
        for leaf in leaves([node], "symbol")
    }
    return exact(field, [node], known)[0]


PRINTED = {
    "g*m2/(m1 + m2) - g*m1/(m1 + m2)": "g*(m2 - m1)/(m1 + m2)",
    "2*g/(1/m1 + 1/m2)": "2*g*m1*m2/(m1 + m2)",
    "(F1*m2 + F2*m1)/(m1 + m2)": "(F1*m2 + F2*m1)/(m1 + m2)",
    "F1 - F2 - (F1 - F2)*m2/(m1 + m2)": "m1*(F1 - F2)/(m1 + m2)",
    "(m1*g*sin(a) - m2*g)/(m1 + m2)": "g*(m1*sin(a) - m2)/(m1 + m2)",
    "m*g*sin(a)*cos(a)/(M + m - m*cos(a)^2)": "g*m*cos(a)*sin(a)/(M + m*sin(a)^2)",
    "(1 - cos(a)^2)/sin(a)": "sin(a)",
    "1/(1 + tan(a)^2)": "cos(a)^2",
    "m*g*sin(a)/cos(a)": "g*m*tan(a)",
    "J*sin(a)^2 + k*cos(a)^2": "J*sin(a)^2 + k*cos(a)^2",
    "sqrt(2*g*h)": "sqrt(2*g*h)",
    "sqrt(2*h/g)": "sqrt(2*h/g)",
    "sqrt(h/(2*g))": "sqrt(h/(2*g))",
    "g/sqrt(2)": "g*sqrt(2)/2",
    "1/sqrt(h^2 + l^2)": "1/sqrt(h^2 + l^2)",
    "sqrt(2*h*(m1 + m2)/(g*(m2 - m1)))*g*(m2 - m1)/(m1 + m2)": "sqrt(2*g*h*(m2 - m1)/(m1 + m2))",
    "3*m*g/12": "g*m/4",
    "3*g/(2*l)": "3*g/(2*l)",
    "-(3*r*v + 10*g)/(7*r)": "-(10*g + 3*r*v)/(7*r)",  # not -10*(0.3*r*v + g)/(7*r)
    "5*g/7 - 2*r*v/7": "(5*g - 2*r*v)/7",
    "g - 0.1*r*v": "g - 0.1*r*v",
    "m*v^2*(1 - h)*(1 + l)/256": "m*v^2*(1 - h)*(l + 1)/256",  # not 0.00390625*m*...
    "(F - M*g - m*g)/(M + m)": "F/(M + m) - g",
    "F*(cos(a) + mu*sin(a))/(m1 + m2) - mu*g": "F*(cos(a) + mu*sin(a))/(m1 + m2) - g*mu",
    "g*m1*cos(a) + g*m2*cos(a) + l*m1*v^2 + l*m2*v^2": "(g*cos(a) + l*v^2)*(m1 + m2)",
    "g - 8*g*m1*m2/(4*m1*m2 + m*m1 + m*m2)": "g*(m*(m1 + m2) - 4*m1*m2)/(m*(m1 + m2) + 4*m1*m2)",
    "5*g*sin(a)/(14*(l - h))": "-5*g*sin(a)/(14*(h - l))",
    "-(m*g*r^2)/(m*r^2 + J)": "-g*m*r^2/(J + m*r^2)",  # shorter by one sign: J*g/(J + m*r^2) - g
    "m*g*r^2/(m*r^2 + J)": "g*m*r^2/(J + m*r^2)",
    "g*(F1 - F2)/(m1 - m2)": "g*(F2 - F1)/(m2 - m1)",
    "-F/(m1 - m2)^3": "F/(m2 - m1)^3",
    "-F*sin(a)/(m1^2 + m2^2 - m1*m2)": "-F*sin(a)/(m1^2 + m2^2 - m1*m2)",
    "-F*sin(a)/(m1^2 + m2^2 - 3*m1*m2)": "F*sin(a)/(3*m1*m2 - m1^2 - m2^2)",
    "m*r^2 + J": "J + m*r^2",
    "m2 + 4*m1": "4*m1 + m2",
    "981/100*m": "9.81*m",
    "0.3125*F^2/m": "5*F^2/(16*m)",  # as 5*F/(4*m) beside it
    "0.74*F^2/m": "37*F^2/(50*m)",
    "259*F^2/512/m": "259*F^2/(512*m)",
    "0.709814*F^2/m": "0.709814*F^2/m",
    "40/3": "40/3",
    "-m1 - m2": "-(m1 + m2)",
    "0*m": "0",
    "h*cos(45*pi/180)": "h*sqrt(2)/2",
    "cos(b - a)*sin(a - b)": "cos(a - b)*sin(a - b)",
    "F*cos(a)*cos(b) + F*sin(a)*sin(b) + m*g*cos(a)": "F*cos(a - b) + g*m*cos(a)",
    "F*sin(a)*cos(b) - F*cos(a)*sin(b) + m*g*cos(a)": "F*sin(a - b) + g*m*cos(a)",
    "m*g*sin(b)/(cos(a)*sin(b) + cos(b)*sin(a))": "g*m*sin(b)/sin(a + b)",
    "m1*sin(a) + m2*cos(a - b)*cos(a)*sin(a - b) + m2*sin(a - b)^2*sin(a)": "m1*sin(a) + m2*cos(b)*sin(a - b)",
    "m*h^2 - 2*m*h*l + m*l^2 + J": "J + m*(h - l)^2",
    "1/(2*m*h^2 - 4*m*h*l + 2*m*l^2 + 3*J)": "1/(3*J + 2*m*(h - l)^2)",
    "m*h^2 + 2*m*h*l + 3*m*l^2": "m*((h + l)^2 + 2*l^2)",
    "m*h^2 - m*h*l + m*l^2": "m*(h^2 + l^2 - h*l)",
    "F*m1 - g*k*m1*m2 - g*k*m2^2 - g*k*m2*m - g*mu*m1*m": "F*m1 - g*(k*m2*(m + m1 + m2) + m*m1*mu)",
    "m*cos(a)*sin(a) - M*h - m*cos(a)^2*h - m*cos(a)*sin(a)*h*k": "m*cos(a)*(sin(a)*(1 - h*k) - h*cos(a)) - M*h",
    "(M + m1 + m2)*(m1 + m2) - (m1*cos(a) + m2*cos(b))^2": "(M + m1 + m2)*(m1 + m2) - (m1*cos(a) + m2*cos(b))^2",
    "(sin(a)^2 - 2*mu*sin(a)*cos(a) + mu^2*cos(a)^2)*F/(sin(a) - mu*cos(a))": "F*(sin(a) - mu*cos(a))",
    "m/(sqrt(h) + sqrt(l))": "m/(sqrt(h) + sqrt(l))",
    "sqrt(h + l)*(M*sqrt(h) + m*sqrt(l))/(M^2*h - m^2*l)": "sqrt(h + l)/(M*sqrt(h) - m*sqrt(l))",
    "F*(sqrt(M)*sqrt(M + m) - M)": "F*(sqrt(M*(M + m)) - M)",
    "M*exp(mu*pi)*exp(mu*pi/2)*exp(-k*pi)": "M*exp(pi*(3*mu - 2*k)/2)",
    "m*exp(2*mu) + m*exp(mu)^2": "2*m*exp(2*mu)",
    "exp(mu*a)*exp(-mu*a)*m": "m",
    "m*exp(log(h/l))": "h*m/l",
    "m*exp(mu - 2*log(h/l))": "m*l^2*exp(mu)/h^2",
    "(3*cos(a)^2 - 2 - cos(a)^4)/(1 - cos(a)^2)": "cos(a)^2 - 2",
}


@pytest.mark.parametrize("expression", PRINTED)
def test_printed_as_in_a_book(expression: str) -> None:
    assert text(book_form(closed(expression))) == PRINTED[expression]


ABOVE, BELOW = 6098546091055885333965000, 2370785123456789123456789


@pytest.mark.parametrize(
    ("expression", "printed"),
    [
        (f"{ABOVE}/{BELOW}*m", f"{ABOVE / BELOW!r}*m"),
        ("m*g/(0.2238878709*m + 0.0123457)", "10*g*m/(2.238878709*m + 0.123457)"),
        ("sqrt(1.23456789012*h^2 + 1)", "2*sqrt(0.30864197253*h^2 + 0.25)"),
        ("0.123456789012*m", "0.123456789012*m"),
        ("m/3 + m*sqrt(2)/7 + 22*pi*m/12345", "m*(22*pi/12345 + sqrt(2)/7 + 1/3)"),
        ("cos(0.12345678901234567890123*a)", "cos(0.12345678901234568*a)"),
    ],
)
def test_numbers_longer_than_given_ones_are_printed_as_their_doubles(expression: str, printed: str) -> None:
    assert text(with_doubles(book_form(closed(expression)))) == printed


@pytest.mark.parametrize("seed", range(20))
def test_forms_with_long_numbers_keep_their_values(seed: int) -> None:
    rng = random.Random(seed)
    numbers = [f"{rng.uniform(0.01, 20):.{rng.randint(1, 16)}f}" for _ in range(8)]
    expression = "({}*m + {}*g*sin(a) + {})*sqrt({}*h^2 + {}*l + {})/({}*m1 + {}*cos(a)^2)".format(*numbers)
    written = text(with_doubles(book_form(closed(expression))))
    values = {leaf: SAMPLE[leaf.data] for leaf in leaves([parse(expression)], "symbol")}
    before, after = evaluate_float([parse(expression), parse(written)], values)
    assert after == pytest.approx(before, rel=1e-13)
    assert not re.search(r"(?<![.\d])[1-9]\d{7,}[1-9]", written)


_TERMS = st.sampled_from("m1 m2 g sin(a) cos(a) sqrt(h^2+l^2) 2 h l/3 sin(2*a) sqrt(g)".split())


_STEPS = st.lists(st.tuples(st.sampled_from("+-*/"), _TERMS, _TERMS), min_size=1, max_size=5)


@given(_STEPS)
@settings(max_examples=50, deadline=None)
def test_the_text_has_the_value_of_what_it_stands_for(steps: list[tuple[str, str, str]]) -> None:
    assert_same_value(steps)


@pytest.mark.long
@given(_STEPS)
@settings(max_examples=500, deadline=None)
def test_many_texts_have_the_value_of_what_they_stand_for(steps: list[tuple[str, str, str]]) -> None:
    assert_same_value(steps)


def assert_same_value(steps: list[tuple[str, str, str]]) -> None:
    expression = "m"
    for operation, a, b in steps:
        expression = f"({expression}) {operation} ({a} + {b})"
    found = closed(expression)
    values = {leaf: SAMPLE[leaf.data] for leaf in leaves([parse(expression)], "symbol")}
    try:
        again = parse(text(book_form(found)))
    except NoClosedFormError:  # too long to be read
        reject()
    value = evaluate_float([parse(expression)], values)[0]
    assert evaluate_float([again], values)[0] == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_what_no_one_reads_is_not_printed() -> None:
    with pytest.raises(NoClosedFormError, match="too long"):
        book_form(closed("(g + m + m1 + m2 + M + F)^9 + k"))


@pytest.mark.parametrize(("expression", "printed"), [
    ("m2 - m1", "m2 > m1"), ("h", "h > 0"), ("-cos(a)", "cos(a) < 0"), ("h - 2", "h > 2"), ("g - h - l", "g > h + l"),
])  # fmt: skip
def test_comparisons(expression: str, printed: str) -> None:
    assert comparison(closed(expression)) == printed


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ("cos(3*a)", "cos(3*a)"),
        ("g*m*(mu*cos(3*a) - sin(3*a))", "g*m*(mu*cos(3*a) - sin(3*a))"),
        ("F*sin(4*a)/cos(4*a)", "F*tan(4*a)"),
        ("cos(2*a)^2 + sin(2*a)^2 + h", "h + 1"),
        ("sin(a)*cos(a)", "cos(a)*sin(a)"),  # nobody speaks of 2 a
        ("-g*sin(3*a)", "-g*sin(3*a)"),
        ("m/(M + m*cos(2*a))", "m/(M + m*cos(2*a))"),
        ("sin(2*a)*sin(3*b)*F", "F*sin(2*a)*sin(3*b)"),
    ],
)
def test_multiples_of_angles_come_back_where_they_are_named(given: str, wanted: str) -> None:
    assert text(book_form(closed(given))) == wanted


@pytest.mark.parametrize("seed", range(12))
def test_sums_and_products_of_multiples_keep_their_value(seed: int) -> None:
    rng = random.Random(seed)

    def factor() -> str:
        terms = [f"{rng.choice('ghmk')}*{rng.choice(['sin', 'cos'])}({rng.randint(1, 4)}*{rng.choice('ab')})"]
        return f"({rng.choice(['', '-'])}{' + '.join([*terms, rng.choice(['mu', 'cos(2*a)', 'sin(3*a)*cos(a)'])])})"

    expression = f"{factor()}*{factor()}/{factor()}"
    values = {leaf: SAMPLE[leaf.data] for leaf in leaves([parse(expression)], "symbol")}
    written = book_form(closed(expression))
    assert evaluate_float([written], values)[0] == pytest.approx(
        evaluate_float([parse(expression)], values)[0], rel=1e-9
    )


def test_a_sum_whose_parts_lose_their_divisors_is_written_part_by_part() -> None:
    """The forces on a rod in a bowl: one common denominator makes 160 characters of them."""
    known = "m*g/2*(cos(a)/sqrt(h^2 - l^2) {} l*sin(a)/(3*h^2 - 2*l^2))"
    plus, minus = (book_form(closed(known.format(sign))) for sign in "+-")
    assert text(plus) == "g*m*(cos(a)/sqrt(h^2 - l^2) + l*sin(a)/(3*h^2 - 2*l^2))/2"
    assert text(minus) == "g*m*(cos(a)/sqrt(h^2 - l^2) - l*sin(a)/(3*h^2 - 2*l^2))/2"
    for node, sign in ((plus, "+"), (minus, "-")):
        values = {leaf: SAMPLE[leaf.data] for leaf in leaves([node], "symbol")}
        found, wanted = evaluate_float([node, parse(known.format(sign))], values)
        assert found == pytest.approx(wanted, rel=1e-12)
