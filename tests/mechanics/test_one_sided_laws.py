"""Laws that have a value on one side only stand in the branch of a choice that is taken there."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.time_functions import verify_motions
from multibody_sym.errors import ModelError
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

HERTZ = """
multibody_sym: 1
name: hertz
parameters: {k: 1e3}
bodies: {ball: {mass: 2}}
joints: {A: {type: prismatic, parent: ground, child: ball, axis: x, q: x, initial: {q: START, u: 1}}}
forces: {wall: {type: force, on: ball, value: ["where(x > 0, -k*x^1.5, 0)", 0, 0]}}
"""


@pytest.mark.parametrize(
    ("law", "at", "value"),
    [
        ("where(x > 0, sqrt(x), 0)", -1.0, 0.0),
        ("where(x > 0, sqrt(x), 0)", 4.0, 2.0),
        ("where(x < 0, 3, log(x))", -1.0, 3.0),
        ("1 + where(x > 0, where(x > 1, 1/sqrt(x - 1), 5), x)", 0.5, 6.0),
        ("where(x < 0, 2, 1/x)", -0.5, 2.0),
        ("where(x < 800, x, exp(x))", 700.0, 700.0),
        ("where(x < 800, 1, exp(2*x))", 700.0, 1.0),
    ],
)
def test_only_the_branch_that_is_taken_needs_a_value(law: str, at: float, value: float) -> None:
    assert evaluate_float([parse(law)], {symbol("x"): at}) == [value]


@pytest.mark.parametrize("law", ["sqrt(x)", "where(x < 0, sqrt(x), 0)", "max(0, sqrt(x))", "where(log(x) > 0, 1, 2)"])
def test_what_is_needed_and_has_no_value_is_an_error(law: str) -> None:
    with pytest.raises((ArithmeticError, ValueError)):
        evaluate_float([parse("1 + x"), parse(law)], {symbol("x"): -1.0})


def test_a_motion_that_begins_later_is_no_error() -> None:
    text = HERTZ.replace("q: x, initial: {q: START, u: 1}", 'motion: "where(t > 1, (t - 1)^2.5, 0)"')
    system = mbs.loads(text.replace("where(x > 0, -k*x^1.5, 0)", "0"))
    run = mbs.simulate(system, t_end=2, samples=3, backend="python", parameters={"k": 2})
    assert run.t_final == 2
    with pytest.raises(ModelError, match="jumps at t = 1 s"):
        verify_motions(mbs.loads(text.replace("2.5", "0.5*0 + 1").replace("where(x > 0, -k*x^1.5, 0)", "0")), {}, 2.0)
