"""Prescribed motions that jump in position or in speed are refused, by place and time; softer kinks are not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.time_functions import verify_motions
from multibody_sym.errors import ModelError
from multibody_sym.scalars.node import symbol

SWUNG = """
multibody_sym: 1
name: swung
gravity: [0, -9.81, 0]
parameters: {T: 1, a: 0.25}
bodies: {cart: {mass: 1}, bob: {mass: 1, com: [0, -1, 0]}}
joints:
  slide: {type: prismatic, parent: ground, child: cart, axis: x, motion: "MOTION"}
  hinge: {type: revolute, parent: cart, child: bob, axis: z, q: theta}
"""


@pytest.mark.parametrize(
    "motion",
    [
        "atan2(0.3*sin(t), 1)",
        "atan2(sin(9*t), 2 + cos(t))",
        "atan2(t - 1.3, 1e-6)",
        "asin(0.5*sin(t))",
        "acos(0.9999*cos(5*t + 1))",
        "asin(0.999999999*sin(t))",
        "asin(1 - (t - 2)^4/32)",
        "atan(t)",
        "atan(sin(t - 1.3)/(t - 1.3))",
        "tan(1.5*sin(t))",
        "cos(2*atan(tan(t)))",
        "sin(asin(sin(t)))",
        "cos(atan2(sin(t), cos(t)))",
        "sin(50*t)",
        "sqrt(1 + t^2)",
        "sqrt((t - 1.3)^2 + 1e-12)",
        "sqrt(sin(t)^4)",
        "(sin(t)^2)^(3/2)",
        "where(t < 1, 0, (t - 1)^2)",
        "where(t < 1, 0.2*t, 0.1*(t + acos(cos(0.5*t + 0.5)) + t/2 - 0.5))",
    ],
)
def test_what_is_smooth_all_the_way_is_not_refused_for_its_functions(motion: str) -> None:
    system = mbs.loads(SWUNG.replace("MOTION", motion))
    verify_motions(system, {symbol("T"): 1.0, symbol("a"): 0.25}, 4.0)


@pytest.mark.parametrize(
    ("motion", "told"),
    [
        ("where(t < 1, 0, 1)", "this motion jumps at t = 1 s, from 0 to 1"),
        ("max(0, t - T)", "the rate of this motion jumps at t = 1 s, from 0 to 1"),
        ("1/(t - T)", "this motion has a pole at t = 1 s"),
    ],
)
@pytest.mark.parametrize(
    "question",
    [
        mbs.derive,
        mbs.check,
        mbs.solve,
        mbs.equilibrium,
        mbs.linearize,
        mbs.simulate,
        lambda system: mbs.compile(mbs.state_derivative(system), backend="python"),
        lambda system: mbs.compile(mbs.mass_matrix(system), backend="python"),
        lambda system: mbs.export(system, "python", "never_made"),
    ],
)
def test_every_question_is_refused_alike(question: Callable[[Any], Any], motion: str, told: str) -> None:
    with pytest.raises(ModelError) as caught:
        question(mbs.loads(SWUNG.replace("MOTION", motion)))
    assert told in caught.value.message
    assert caught.value.where.path[:3] == ("joints", "slide", "motion")


@pytest.mark.parametrize(
    "motion",
    [
        "1/(t + 1)",
        "1/(t - 5)",
        "sin(t - 1)/(t - 1)",
        "(t^2 - 1)/(t - 1)",
        "(1 - cos(t - 1))/(t - 1)^2",
        "1/(1e-4 + (t - 1)^2)",
        "sin(t)/(2 + sin(7*t))",
        "exp(-1/(t - 1)^2)",
        "1/(1 + 1/(t - 1)^2)",
    ],
)
def test_denominators_that_make_no_pole_on_the_way_are_not_refused(motion: str) -> None:
    verify_motions(mbs.loads(SWUNG.replace("MOTION", motion)), {symbol("T"): 1.0, symbol("a"): 0.25}, 4.0)
