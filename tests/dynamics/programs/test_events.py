"""The events Program: stops in the order of the file, then kinks of forces and inputs, against the same in floats."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program.program import interpret

MODEL = """
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 2, l: 0.5, g: 9.81, limit: 3}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}}
forces: {drive: {type: torque, joint: hinge, value: "tau*sign(u_theta)"}}
inputs: {tau: "where(t < 1, 1, 2)"}
stop: {low: "position(bob, y) < -0.4", fast: u_theta >= limit, slack: "reaction(hinge, fy) < 0"}
"""


def values(text: str, t: float, theta: float, speed: float) -> list[float]:
    found = mechanism(mbs.loads(text))
    made = programs(found, FORMALISMS["composite_body"])
    assert made.events is not None
    assert made.ne == len(found.stops) + len(found.kinks)
    parameters = [2, 0.5, 9.81, 3]
    inputs = interpret(made.inputs, t, [theta], [speed], parameters)[0]
    return list(interpret(made.events, t, [theta], [speed], parameters, inputs, [])[0])


def test_stops_are_positive_where_they_hold_and_kinks_follow() -> None:
    t, theta, speed, tau = 0.25, 0.7, 2.0, 1.0
    low, fast, slack, *kinks = values(MODEL, t, theta, speed)
    assert low == pytest.approx(-0.4 + 0.5 * math.cos(theta))
    assert fast == speed - 3
    alpha = (tau - 2 * 9.81 * 0.5 * math.sin(theta)) / (2 * 0.25)
    weight_and_motion = 2 * (9.81 + 0.5 * (math.cos(theta) * speed**2 + math.sin(theta) * alpha))
    assert slack == pytest.approx(-weight_and_motion)
    assert sorted(map(abs, kinks)) == [0.75, speed]


def test_a_system_that_neither_stops_nor_switches_has_no_such_program() -> None:
    smooth = MODEL.partition("forces:")[0]
    assert programs(mechanism(mbs.loads(smooth)), FORMALISMS["composite_body"]).events is None


def test_a_stop_survives_being_written() -> None:
    system = mbs.loads(MODEL)
    assert mbs.loads(mbs.dumps(system)) == system
    assert list(system.stop) == ["low", "fast", "slack"]


@pytest.mark.parametrize(
    ("stop", "message", "path"),
    [
        ("theta", "expected a comparison such as y < 0", "stop.low"),
        ("1 < 2", "compares two constants", "stop.low"),
        ("phi < 2", "'phi' is not declared", "stop.low"),
        ("0 < theta < 2", "comparisons do not chain", "stop.low"),
        ("position(arm, y) < 0", "'arm' is no point", "stop.low"),
    ],
)
def test_what_is_no_condition_is_refused(stop: str, message: str, path: str) -> None:
    with pytest.raises((ModelError, mbs.InputError)) as caught:
        mechanism(mbs.loads(MODEL.replace("position(bob, y) < -0.4", stop)))
    assert message in caught.value.message
    assert ".".join(caught.value.where.path) == path
