"""Ropes over rough drums solved as books have it: Euler's and Eytelwein's law in closed form, states and limits."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

INCLINE = """\
multibody_sym: 1
name: incline_drum
gravity: [0, -g, 0]
parameters:
  m1: {value: 1, positive: true}
  m2: {value: 3, positive: true}
  g: {value: 9.81, positive: true}
  a: {value: 30 deg, positive: true}
  mu: {value: 0.3, positive: true}
  R: {value: 0.1, positive: true}
bodies:
  ground: {points: {top: [0, 0, 0], slope: [-R*sin(a), R*cos(a), 0], side: [R, 0, 0]}}
  block: {mass: m1}
  load: {mass: m2}
pulleys: {drum: {at: ground.top, radius: R, rough: mu}}
joints:
  L: {type: prismatic, parent: ground.slope, child: block, axis: [cos(a), sin(a), 0], q: s, initial: {q: -2}}
  N: {type: prismatic, parent: ground.side, child: load, axis: y, q: y, initial: {q: -1}}
constraints: {string: {type: rope, path: [block, drum, load]}}
"""
HANGING = INCLINE.replace("30 deg", "90 deg").replace("axis: [cos(a), sin(a), 0]", "axis: y").replace(
    "slope: [-R*sin(a), R*cos(a), 0]", "slope: [-R, 0, 0]"
)


def test_a_rope_that_slips_over_a_drum_has_a_closed_form() -> None:
    """m1 s'' = T1 - m1 g sin a, m2 s'' = m2 g - T2, T2 = T1 exp(mu (pi/2 + a))."""
    found = mbs.solve(mbs.loads(INCLINE))
    ratio = math.exp(0.3 * (math.pi / 2 + math.pi / 6))
    expected = 9.81 * (3 - ratio * 0.5) / (3 + ratio)
    assert found.accelerations["s"].value == pytest.approx(expected, rel=1e-12)
    formula = found.as_json()["accelerations"]["s"]["expression"]
    assert formula == "g*(m2 - m1*exp(mu*(a + pi/2))*sin(a))/(m1*exp(mu*(a + pi/2)) + m2)"
    assert dict(found.states) == {"string": "taut", "drum": "slip+"}
    T1, T2 = (x.value for x in found.reactions["string"].values())
    assert pytest.approx(ratio, rel=1e-12) == T2 / T1
    assert found.reactions["drum"]["mz"].value == pytest.approx(0.1 * (T2 - T1), rel=1e-12)
    assert found.conditions == ("m2 > m1*exp(mu*(a + pi/2))*sin(a)",)


def test_a_rope_that_holds_tells_both_limits() -> None:
    found = mbs.solve(mbs.loads(HANGING), {"m2": 1.5})
    assert dict(found.states) == {"string": "taut", "drum": "grip"}
    assert found.conditions == ("m1*exp(mu*pi) >= m2", "m2*exp(mu*pi) >= m1")
    assert [x.as_json()["expression"] for x in found.reactions["string"].values()] == ["g*m1", "g*m2"]


def test_the_range_of_rest_over_a_drum_has_exact_ends() -> None:
    masses = mbs.range_of_rest(mbs.loads(HANGING), "m2").as_json()
    assert masses["rest"] == [pytest.approx([math.exp(-0.3 * math.pi), math.exp(0.3 * math.pi)], rel=1e-12)]
    (rough,) = mbs.range_of_rest(mbs.loads(HANGING), "mu").as_json()["rest"]
    assert rough == [pytest.approx(math.log(3) / math.pi, rel=1e-12), None]
