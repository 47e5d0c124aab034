"""What bounces and closes at the start strikes: it does not make what it meets move with it."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.state import examined_state

_TWO_BALLS = """
multibody_sym: 1
name: gap
gravity: [0, 0, 0]
bodies:
  a: {mass: 1, surfaces: {skin: {sphere: 0.05}}}
  b: {mass: 1, surfaces: {skin: {sphere: 0.05}}}
joints:
  J1: {type: prismatic, parent: ground, child: a, axis: x, q: x1, initial: {u: 2}}
  J2: {type: prismatic, parent: ground, child: b, axis: x, q: x2, initial: {q: 0.1}}
contacts: {c: {between: [b.skin, a.skin], restitution: E}}
simulation: {t_end: 0.1, samples: 3}
"""


def _balls(restitution: float) -> mbs.System:
    return mbs.loads(_TWO_BALLS.replace("E}", f"{restitution}}}"))


def test_a_ball_without_a_typed_speed_rests_before_it_is_struck() -> None:
    begin = examined_state(_balls(0.5)).begin
    assert begin.u == pytest.approx([2.0, 0.0])
    assert not begin.assembled


def test_a_run_strikes_it() -> None:
    run = mbs.simulate(_balls(0.5), backend="python")
    assert run["u_x1"][-1] == pytest.approx(0.5)  # (1 - e)/2 of 2 m/s
    assert run["u_x2"][-1] == pytest.approx(1.5)


def test_what_does_not_bounce_goes_with_what_pushes_it() -> None:
    assert examined_state(_balls(0.0)).begin.u == pytest.approx([2.0, 2.0])
