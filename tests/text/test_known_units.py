"""Units of expressions: told where they are certain, never a wrong one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import NamedTuple

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from multibody_sym.scalars.arrays import EPSILON
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sign_changes import Bounded, bound_rounding
from multibody_sym.text.parser import parse
from multibody_sym.text.units import (
    ANGLE,
    DIMENSIONLESS,
    ENERGY,
    LENGTH,
    TIME,
    Dimension,
    InferredUnit,
    Kind,
    infer_units,
    parse_unit,
)

SPEED = LENGTH.times(TIME, -1)
DECLARED = {
    name: InferredUnit(Kind(parse_unit(unit)[1], angle=0 if unit in ("kg", "s") else None), firm=True)
    for name, unit in {"m": "kg", "l": "m", "K": "N/m", "T": "s", "C": "N*m", "F": "N"}.items()
}
MOVING = {
    "x": InferredUnit(Kind(LENGTH)), "y": InferredUnit(Kind(LENGTH)),
    "v": InferredUnit(Kind(SPEED)), "a": InferredUnit(ANGLE),
    "w": InferredUnit(Kind(Dimension(time=-1), angle=1)), "E": InferredUnit(Kind(ENERGY, energy=True), firm=True),
    "t": InferredUnit(Kind(TIME), doubtful=True),
}
LEAVES: Mapping[str, InferredUnit] = {**DECLARED, **MOVING}


def unit(text: str) -> str | None:
    """Return the unit of an expression; `k` and whatever else is not in the tables has none."""
    (found,) = infer_units([parse(text)], lambda leaf: LEAVES.get(leaf.data))
    return None if found is None else found.kind.unit


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x", "m"), ("-2*x", "m"), ("(x + y)/2", "m"), ("v^2/x", "m/s^2"), ("a", "rad"), ("w", "rad/s"), ("a/2", "rad"),
        ("w*x", "m/s"), ("w^2*x", "m/s^2"), ("w*T", "rad"), ("w/T", "rad/s^2"), ("a*T", "rad*s"), ("sqrt(a^2)", "rad"),
        ("a*w", "1/s"), ("K*x - F", "N"), ("m*l^2*w^2/12", "N*m"), ("m*v*x/T", "N*m"), ("K*x*v", "W"), ("E", "J"),
        ("E + m*v^2/2", "J"), ("2*E/3", "J"), ("E/x", "N"), ("C*sin(2*pi*t)", "N*m"), ("F*exp(-3*t)", "N"),
        ("m*(3*cos(a) - 2)*v^2/l", "N"), ("sqrt(K/m)", "1/s"), ("atan2(x, y)", "rad"), ("min(x, 1)", "m"),
        ("where(x < 1, F, 0)", "N"), ("abs(x) + 1", "m"), ("x - 5*t", "m"), ("7*x + l", "m"), ("x + sin(a)", "m"),
        ("7*x*K", "N"), ("K*(7*x)", "N"),
        ("C/(m*l^2)", "1/s^2"), ("C*a/(K*x^2)", ""), ("x/y", ""), ("sign(x)", ""), ("x^1.5", "m^(3/2)"),
        ("1/(2*T)", "1/s"), ("a/(2*pi)", ""), ("w/(2*pi)", "1/s"), ("2*pi/w", "s"),
    ],
)
def test_units_that_are_certain(text: str, expected: str) -> None:
    assert unit(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "k", "k*x", "k*x + F", "F + k*x", "7*x", "x*7*v", "9.81*m", "2.5e3*l", "180/pi*a", "a*180/pi",
        "w*30/pi", "2*t", "t", "5*sin(3*t)", "x - a", "x + v", "5*x + 3*v", "2^x", "3",
        "where(x < 1, 5, 0)", "7*x - 5*t", "k^2*m", "x/t", "min(k, x)", "sqrt(2)*x", "x*y^k",
    ],
)
def test_what_a_number_without_a_unit_may_have_changed_has_none(text: str) -> None:
    assert unit(text) is None


# --- the same in other units of mass, length and time ---------------------------------------------------------------

SCALES = (3.0, 7.0, 11.0)
"""How many of the new units one kilogram, metre and second is."""


def scale(dimension: Dimension) -> float:
    return math.prod(size ** float(exponent) for size, exponent in zip(SCALES, dimension, strict=True))


class Made(NamedTuple):
    """An expression whose sums are of one dimension, with that as it was made."""

    text: str
    dimension: Dimension


def grown(terms: st.SearchStrategy[Made]) -> st.SearchStrategy[Made]:
    pairs = st.tuples(terms, terms)
    same = pairs.map(lambda x: (x[0], f"({x[1].text}{fitted(x[1].dimension, x[0].dimension)})"))
    return st.one_of(
        pairs.map(lambda x: Made(f"({x[0].text})*({x[1].text})", x[0].dimension.times(x[1].dimension))),
        pairs.map(lambda x: Made(f"({x[0].text})/({x[1].text})", x[0].dimension.times(x[1].dimension, -1))),
        same.map(lambda x: Made(f"({x[0].text} - {x[1]}/3)", x[0].dimension)),
        same.map(lambda x: Made(f"max({x[0].text}, {x[1]})", x[0].dimension)),
        same.map(lambda x: Made(f"where({x[0].text} < {x[1]}, {x[1]}, {x[0].text})", x[0].dimension)),
        terms.map(lambda x: Made(f"sqrt(abs({x.text}))", DIMENSIONLESS.times(x.dimension, Fraction(1, 2)))),
        terms.map(lambda x: Made(f"({x.text})^2", DIMENSIONLESS.times(x.dimension, 2))),
        terms.map(lambda x: Made(f"3*({x.text})", x.dimension)),
    )


def fitted(given: Dimension, wanted: Dimension) -> str:
    """Return the factor, of parameters in kg, m and s, that makes a quantity one of another dimension."""
    missing = wanted.times(given, -1)
    return "".join(f"*{name}^({exponent})" for name, exponent in zip("mlT", missing, strict=True) if exponent)


def made_of(leaves: Mapping[str, InferredUnit]) -> st.SearchStrategy[Made]:
    single = st.sampled_from(sorted(leaves)).map(lambda name: Made(name, leaves[name].kind.dimension))
    return st.recursive(single, grown, max_leaves=6)


def scales_as_told(text: str) -> bool:
    """Return whether a unit was told; fail where the value in other units of mass, length, time is not that factor."""
    node = parse(text)
    (found,) = infer_units([node], lambda leaf: LEAVES.get(leaf.data))
    if found is not None:
        before = value(node, VALUES)
        scaled = {name: x * scale(LEAVES[name].kind.dimension) for name, x in VALUES.items()}
        factor = scale(found.kind.dimension)
        lost = rounding(node, scaled) + rounding(node, VALUES) * factor
        assert value(node, scaled) == pytest.approx(before * factor, rel=1e-7, abs=lost)
    return found is not None or node.shadow is not None  # a constant is in no unit


def value(node: Node, values: Mapping[str, float]) -> float:
    try:
        return evaluate_float([node], {symbol(name): x for name, x in values.items()})[0]
    except (ArithmeticError, ValueError):
        return 0.0


def rounding(node: Node, values: Mapping[str, float]) -> float:
    """Return a bound of what is lost in an expression's value, where terms cancel: half the digits under a root."""
    (found,) = bound_rounding([node], {symbol(name): Bounded(x, EPSILON * abs(x)) for name, x in values.items()})
    return 2 * found.bound if math.isfinite(found.bound) else math.sqrt(EPSILON) * max(map(abs, values.values()))


VALUES = dict(zip(sorted(LEAVES), (0.7, 1.3, 2.1, 0.4, 1.9, 3.2, 0.9, 1.7, 2.6, 0.3, 1.1, 4.3, 0.6), strict=True))


@settings(deadline=None)
@given(made_of(DECLARED))
def test_what_is_made_of_parameters_with_units_has_a_unit_and_scales_so(made: Made) -> None:
    assume(made.text.count("3*(") < 3)  # 27 is no small number any more, and may have a unit
    assert scales_as_told(made.text)


@settings(deadline=None)  # the first one imports
@given(made_of(LEAVES))
def test_a_told_unit_is_how_the_value_scales_with_the_units_of_what_it_is_made_of(made: Made) -> None:
    scales_as_told(made.text)
