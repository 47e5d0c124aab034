"""Units against their definitions, and dimensions through every operation."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from multibody_sym.errors import ExpressionError
from multibody_sym.scalars.node import ONE, Node
from multibody_sym.text.parser import FUNCTIONS, parse
from multibody_sym.text.units import DIMENSIONLESS, UNITS, Dimension, Measured, given_in, infer_dimension, parse_unit

EXPONENTS = st.fractions(min_value=-4, max_value=4, max_denominator=3)

KNOWN = {
    "m1": Dimension(1, 0, 0), "m2": Dimension(1, 0, 0), "l": Dimension(0, 1, 0), "k": Dimension(1, 0, -2),
    "f": Dimension(1, 1, -2), "w": Dimension(0, 0, -1), "phi": DIMENSIONLESS, "T": Dimension(0, 0, 1),
}


def known(leaf: Node) -> Measured | None:
    return given_in(KNOWN.get(leaf.data))


def dimension(text: str) -> Dimension | None:
    found = infer_dimension(parse(text), known)
    return found.dimension if found is not None and found.dimension != DIMENSIONLESS else None


@pytest.mark.parametrize(
    ("unit", "factor", "in_base_units"),
    [
        ("kg", 1, "kg"), ("g", 1e-3, "kg"), ("mg", 1e-6, "kg"), ("N", 1, "kg*m/s^2"), ("kN", 1e3, "kg*m/s^2"),
        ("J", 1, "kg*m^2/s^2"), ("Nm", 1, "N*m"), ("W", 1, "J/s"), ("kW", 1e3, "N*m/s"), ("Pa", 1, "N/m^2"),
        ("GPa", 1e9, "N/m^2"), ("bar", 1e5, "N/m^2"), ("Hz", 1, "1/s"), ("deg", math.pi / 180, "rad"),
        ("turn", 2 * math.pi, "rad"), ("rpm", 2 * math.pi / 60, "rad/s"), ("km", 1e3, "m"), ("mm", 1e-3, "m"),
        ("um", 1e-6, "m"), ("cm", 1e-2, "m"), ("ms", 1e-3, "s"), ("min", 60, "s"), ("h", 3600, "s"),
        ("in", 0.0254, "m"), ("ft", 0.3048, "m"), ("lb", 0.45359237, "kg"), ("lbf", 4.4482216152605, "N"),
        ("m^-1", 1, "1/m"), ("km^2", 1e6, "m^2"), ("N/(m*s)", 1, "N/m/s"),
    ],
)
def test_units(unit, factor, in_base_units):
    node, found = parse_unit(unit)
    assert node.shadow == pytest.approx(factor, rel=1e-15)
    assert found == parse_unit(in_base_units)[1]


def test_milli_comes_before_metre_and_min_is_a_minute():
    assert parse_unit("mN")[0].shadow == 1e-3
    assert parse_unit("m*N")[0] is ONE
    assert parse_unit("min")[0].shadow == 60


def test_no_unit_is_called_like_a_function():
    assert not set(UNITS) & (set(FUNCTIONS) - {"min"})


@given(EXPONENTS, EXPONENTS, EXPONENTS)
def test_a_dimension_prints_as_its_unit(mass, length, time):
    expected = Dimension(mass, length, time)
    assert parse_unit(str(expected)) == (ONE, expected)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("m1 + m2", "kg"), ("m1*l^2/12", "kg*m^2"), ("k*l + f", "N"), ("sqrt(k/m1)", "1/s"), ("sqrt(k/m1) - w", "1/s"),
        ("m1*l*w^2", "N"), ("f*sin(phi)", "N"), ("l^1.5", "m^(3/2)"), ("l^(-1/2)", "m^(-1/2)"),
        ("-l", "m"), ("abs(l)", "m"),
        ("min(l, 2*l, 0.5)", "m"), ("where(l < 1, f, 0)", "N"), ("l + sin(phi)", "m"), ("1/w", "s"),
        ("m1^2/m2", "kg"), ("l*exp(-w*T)", "m"), ("l*atan2(m1, m2)", "m"), ("f*sign(l)", "N"),
        ("m1 + x*l", "kg"), ("x + f", "N"), ("where(x < 1, x, f) - 9.81", "N"),
    ],
)
def test_dimensions_of_expressions(text, unit):
    assert dimension(text) == parse_unit(unit)[1]


@pytest.mark.parametrize(
    "text",
    ["3", "2*pi", "m1/m2", "sin(phi)", "x", "m1*x", "x^2", "l^x", "9.81*m1", "sin(x)", "m1*x + l*x", "0"],
)
def test_unknown_and_pure_numbers_fit_everything(text):
    assert dimension(text) is None


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("m1 + l", ("kg", "m")), ("m1 - l", ("m1 is in kg", "l is in m")), ("f*l + m1", ("N*m", "kg")),
        ("min(l, m1)", ("min() combines", "kg")), ("where(phi < 1, l, f)", ("a choice of m and N",)),
        ("l < m1", ("a comparison of m and kg",)), ("atan2(l, f)", ("atan2() combines m and N",)),
        ("sin(l)", ("sin() wants a pure number or an angle, and l is in m",)), ("exp(w)", ("exp()", "1/s")),
        ("2^l", ("an exponent", "l is in m")), ("sqrt(l) + l", ("m^(1/2)",)), ("log(f/k)", ("log()", "in m")),
    ],
)
def test_contradictions_name_both_sides(text, part):
    with pytest.raises(ExpressionError) as caught:
        dimension(text)
    assert all(p in caught.value.message for p in part), caught.value.message


def test_products_and_powers_follow_the_exponents():
    assert Dimension(1, 2, -2).times(Dimension(0, 1, 0), Fraction(-1, 2)) == Dimension(1, Fraction(3, 2), -2)
