"""Prescribed motions that jump in position or in speed are refused, by place and time; softer kinks are not."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
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
SHAKEN = """
multibody_sym: 1
name: shaken
bodies:
  ground: {motion: {y: "MOTION"}}
  bob: {mass: 1, com: [1, 0, 0]}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}}
"""
DRIVEN = """
multibody_sym: 1
name: driven
parameters: {T: 1, a: 0.25}
bodies: {bob: {mass: 1, com: [0, -1, 0]}, more: {mass: 1, com: [0, -1, 0]}}
joints:
  hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}
  next: {type: revolute, parent: bob, child: more, axis: z, q: phi}
constraints: {drive: CONSTRAINT}
"""


def refusal(text: str, t_end: float = 4.0) -> ModelError:
    with pytest.raises(ModelError) as caught:
        mbs.simulate(mbs.loads(text), t_end=t_end, backend="python", samples=2)
    return caught.value


@pytest.mark.parametrize(
    ("motion", "time", "values"),
    [
        ("where(t < 1, 0, 1)", "1", "from 0 to 1"),
        ("where(t <= T + a, t^2, 3)", "1.25", "from 1.5625 to 3"),
        ("sign(t - 2)", "2", "from -1 to 1"),
        ("where(t > 0.5, where(t < 0.5001, 0.01, 0), 0)", "0.5", "from 0 to 0.01"),
        ("where(sin(40*t) > -0.5, 0, 1)", f"{(math.pi + math.pi / 6) / 40:.6g}", "from 0 to 1"),
    ],
)
def test_a_motion_that_jumps_is_refused_with_its_time(motion: str, time: str, values: str) -> None:
    error = refusal(SWUNG.replace("MOTION", motion))
    assert f"jumps at t = {time} s, {values}: nothing moves so" in error.message
    assert error.where.path[:3] == ("joints", "slide", "motion")


@pytest.mark.parametrize(
    ("motion", "time", "rates"),
    [
        ("max(0, t - T)", "1", "from 0 to 1"),
        ("abs(sin(3*t))", "1.0472", "from -3 to 3"),
        ("where(t < 1, 0, sin(t - 1))", "1", "from 0 to 1"),
        ("min(t, 3)", "3", "from 1 to 0"),
        ("max(0, t - 1)^2 + abs(t - 2.5)", "2.5", "from 2 to 4"),
    ],
)
def test_a_motion_whose_speed_jumps_is_refused_until_impacts_are_computed(motion: str, time: str, rates: str) -> None:
    error = refusal(SWUNG.replace("MOTION", motion))
    assert f"the rate of this motion jumps at t = {time} s, {rates}" in error.message
    assert "impact" in error.message
    assert error.where.path[:3] == ("joints", "slide", "motion")


@pytest.mark.parametrize(
    ("motion", "time"),
    [
        ("atan(tan(t))", math.pi / 2),
        ("atan(sin(t)/cos(t))", math.pi / 2),
        ("atan2(sin(t), cos(t))", math.pi),
        ("atan2(sin(5*t), -2 + cos(t))", math.pi / 5),
        ("0.1*tan(T*t)", math.pi / 2),
        ("atan(1/(t - 1.3))", 1.3),
        ("atan(1e-5*tan(t))", math.pi / 2),
        ("sin(t) + 0.1*tanh((t - 1.3)^(-3))", 1.3),
    ],
)
def test_a_motion_that_jumps_at_a_branch_or_a_pole_is_refused(motion: str, time: float) -> None:
    error = refusal(SWUNG.replace("MOTION", motion))
    assert f"this motion jumps at t = {time:.6g} s, from " in error.message
    assert "nothing moves so" in error.message
    assert error.where.path[:3] == ("joints", "slide", "motion")


@pytest.mark.parametrize(
    ("motion", "time", "rates"),
    [
        ("asin(sin(t))", math.pi / 2, "from 1 to -1"),
        ("asin(sin(40*t))", math.pi / 80, "from 40 to -40"),
        ("acos(cos(t + a))", math.pi - 0.25, "from 1 to -1"),
        ("sqrt(sin(T*t)^2)", math.pi, "from -1 to 1"),
        ("sqrt(1 - sin(t)^2)", math.pi / 2, "from -1 to 1"),
        ("sqrt(4*(t - 1.3)^2)", 1.3, "from -2 to 2"),
        ("cos(atan(tan(t)))", math.pi / 2, "from -1 to 1"),
    ],
)
def test_a_motion_whose_speed_jumps_at_a_branch_is_refused(motion: str, time: float, rates: str) -> None:
    error = refusal(SWUNG.replace("MOTION", motion))
    assert f"the rate of this motion jumps at t = {time:.6g} s, {rates}" in error.message
    assert error.where.path[:3] == ("joints", "slide", "motion")


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
    "motion",
    [
        "where(t < 1, 0, (t - 1)^2)",
        "max(0, t - 1)^3",
        "where(t < 1, t^2, 2*t - 1)",
        "where(t < 2, 0.1*(t - sin(pi*t)/pi), 0.2 + 0*t)",
        "sin(100*t)*where(t < 5, 1, 0)",
        "sqrt(t^2 + 0.01)",
        "abs(t)",
    ],
)
def test_kinks_of_the_acceleration_are_allowed_and_what_comes_after_the_end(motion: str) -> None:
    run = mbs.simulate(mbs.loads(SWUNG.replace("MOTION", motion)), t_end=2.1, backend="python", samples=2, rtol=1e-3)
    assert run.t_final == 2.1


def test_ground_is_refused_as_well() -> None:
    error = refusal(SHAKEN.replace("MOTION", "max(0, t - 1)"))
    assert "the rate of this motion jumps at t = 1 s, from 0 to 1" in error.message
    assert error.where.path == ("bodies", "ground", "motion", "y")


@pytest.mark.parametrize(
    ("constraint", "what", "field"),
    [
        ('{type: motion, joint: hinge, value: "max(0, t - 1)"}', "the rate of this expression jumps", "value"),
        ('{type: motion, joint: hinge, value: "where(t < T, 0, a)"}', "this expression jumps", "value"),
        ('{type: expression, zero: "theta + phi - abs(t - 1)"}', "the rate of this expression jumps", "zero"),
        ('{type: velocity, zero: "u_theta - where(t < 1, 0, 1)"}', "the speed of what it moves would", "zero"),
    ],
)
@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_constraints_are_refused_as_well(constraint: str, what: str, field: str, coordinates: str) -> None:
    text = DRIVEN.replace("CONSTRAINT", constraint) + f"simulation: {{coordinates: {coordinates}}}\n"
    error = refusal(text)
    assert what in error.message
    assert "t = 1 s" in error.message
    assert error.where.path == ("constraints", "drive", field)


def test_a_speed_that_is_prescribed_may_bend() -> None:
    text = DRIVEN.replace("CONSTRAINT", '{type: velocity, zero: "u_theta - max(0, t - 1)"}')
    run = mbs.simulate(mbs.loads(text), t_end=2, backend="python", samples=2)
    assert run["theta"][-1] == pytest.approx(0.5, abs=1e-6)


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


@pytest.mark.parametrize("command", ["derive", "check", "solve", "equilibrium", "linearize", "simulate"])
def test_every_command_names_the_line_and_looks_till_the_end(command: str, tmp_path: Path, capfd: Any) -> None:
    file = tmp_path / "m.yaml"
    text = SWUNG.replace("MOTION", "max(0, t - T)") + "simulation: {t_end: 2*T, samples: 2, rtol: 1e-3}\n"
    file.write_text(text)
    assert main([command, str(file), "--json"]) == 2
    error = json.loads(capfd.readouterr().out)["error"]
    assert "the rate of this motion jumps at t = 1 s" in error["message"]
    assert error["where"]["line"] == 8
    file.write_text(text.replace("2*T", "T/2"))
    assert main([command, str(file), "--json"]) == 0


@pytest.mark.parametrize(
    ("motion", "what", "time"),
    [
        ("1/(t - T)", "this motion has a pole", 1),
        ("sin(t) - a*(t - 2)^(-2)", "this motion has a pole", 2),
        ("t/(1 - sin(t))", "this motion has a pole", math.pi / 2),
        ("0.001/(t^2 - 2*t + 1)", "this motion has a pole", 1),
        ("abs(t - 3)^(-0.25)", "this motion has a pole", 3),
        ("a/(t - 1)/(t - 3)", "this motion has a pole", 1),
        ("abs(t - 1.5)^(3/4)", "the rate of this motion", 1.5),
    ],
)
def test_poles_on_the_way_are_told_by_name_and_time(motion: str, what: str, time: float) -> None:
    error = refusal(SWUNG.replace("MOTION", motion))
    assert what in error.message
    assert f"at t = {time:.6g} s" in error.message
    assert error.where.path[:3] == ("joints", "slide", "motion")


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


def test_a_prescribed_speed_with_a_pole_is_refused() -> None:
    error = refusal(DRIVEN.replace("CONSTRAINT", '{type: velocity, zero: "u_theta - 1/(t - 1)"}'))
    assert "this expression has a pole at t = 1 s" in error.message
    assert error.where.path == ("constraints", "drive", "zero")


def test_check_says_of_softer_kinks_only_what_is_so() -> None:
    def hints(motion: str) -> list[str]:
        system = mbs.loads(SWUNG.replace("MOTION", motion) + "simulation: {t_end: 2*T}\n")
        return [hint for hint in mbs.check(system).hints if "slide" in hint]

    told = "the motion of joint slide has kinks: until t_end = 2 s neither it nor its rate jumps"
    assert hints("abs(t - 5)") == [told]
    assert hints("max(0, t - T)^2") == [told]
    assert hints("where(a > T, t, 2*t)") == hints("sin(t)") == []
