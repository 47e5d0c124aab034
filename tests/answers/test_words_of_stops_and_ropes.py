"""What is said of stops and ropes that hold, or are about to, are sentences."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import solution_text
from multibody_sym.errors import InputError

_STOP = """
multibody_sym: 1
name: block
gravity: [-10, 0, 0]
parameters: {F: 3}
forces: {push: {type: force, on: b, value: [F, 0, 0]}}
bodies: {b: {mass: 1}}
joints:
  jb: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 1}, limits: LIMITS}
"""


def _told(limits: str) -> str:
    return solution_text(mbs.solve(mbs.loads(_STOP.replace("LIMITS", limits))))


def test_a_stop_that_holds_is_what_its_joint_rests_at() -> None:
    told = _told("{lower: 1}")
    assert "jb rests at its lower stop" in told
    assert "is lower" not in told


def test_a_stop_that_is_left_would_be_rested_at() -> None:
    told = _told("{upper: 1}")
    assert "jb.upper is free" in told
    assert "else jb rests at its upper stop" in told


def test_a_rope_that_slackens_would_become_taut() -> None:
    model = """
multibody_sym: 1
name: thrown
gravity: [0, -10, 0]
parameters: {F: 15}
bodies: {b: {mass: 1}}
joints: {jb: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {q: -1}}}
constraints: {s: {type: rope, path: [ground, b], slack: true}}
forces: {lift: {type: force, on: b, value: [0, F, 0]}}
"""
    assert "else s becomes taut" in solution_text(mbs.solve(mbs.loads(model)))


def test_a_rope_closes_as_it_becomes_taut_and_opens_as_it_slackens() -> None:
    model = """
multibody_sym: 1
name: falls
gravity: [0, -10, 0]
bodies: {b: {mass: 1}}
joints: {jb: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {q: -0.2}}}
constraints: {s: {type: rope, path: [ground, b], length: 1, slack: true}}
simulation: {t_end: 0.6}
ask: {closes: s closes, opens: s opens}
"""
    found = mbs.solve(mbs.loads(model)).answers
    assert found["closes"].value == pytest.approx(0.4, rel=1e-9)  # it falls 0.8 m
    assert found["opens"].value == 0.0


def test_a_stop_closes_as_it_holds_and_opens_as_it_frees() -> None:
    """A force 4 t pulls it off against a weight of 10 N; it falls 0.2 m onto the other with 7 m/s^2."""
    leaves = _STOP.replace("value: [F, 0, 0]", "value: [4*t, 0, 0]").replace("LIMITS", "{lower: 1}").replace("F: 3", "")
    asks = "simulation: {t_end: 4}\nask: {opens: jb.lower opens, frees: jb.lower frees}\n"
    found = mbs.solve(mbs.loads(leaves + asks)).answers
    assert [found[name].value for name in ("opens", "frees")] == pytest.approx([2.5, 2.5], rel=1e-9)
    arrives = _STOP.replace("LIMITS", "{lower: 0.8, restitution: 0}")
    asks = "ask: {closes: jb.lower closes, stops: jb.lower stops}\n"
    found = mbs.solve(mbs.loads(arrives + asks)).answers
    moment = (2 * 0.2 / 7) ** 0.5
    assert [found[name].value for name in ("closes", "stops")] == pytest.approx([moment, moment], rel=1e-9)


def test_what_a_joint_with_stops_never_does_names_what_its_stops_do() -> None:
    with pytest.raises(InputError, match=r"say jb\.lower opens or jb\.lower closes or jb\.lower stops"):
        mbs.solve(mbs.loads(_STOP.replace("LIMITS", "{lower: 1}") + "ask: {a: jb sticks}\n"))
