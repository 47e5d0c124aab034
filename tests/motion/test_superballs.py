"""Superballs in runs: contacts that return the tangential speed, against the book's matrix of each bounce."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs

BALL = """
multibody_sym: 1
name: superball between floor and ceiling
parameters: {m: 0.1, r: 0.025, H: 0.5, back: 1, mu: 1}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, ceiling: {plane: [0, H, 0], normal: -y}}}
  ball: {shape: {sphere: r, mass: m}, surfaces: {skin: {sphere: r}}}
joints: {free: {type: planar, parent: ground, child: ball, q: [x, y, phi], initial: {q: [0, r, 0], u: [2, -3, 40]}}}
contacts:
  down: {between: [ball.skin, ground.floor], static: mu, restitution: 1, tangential_restitution: back}
  up: {between: [ball.skin, ground.ceiling], static: mu, restitution: 1, tangential_restitution: back}
"""


def bounced(u: float, w: float, side: float, back: float) -> tuple[float, float]:
    """Return u and r w after a bounce: s = u + side r w becomes -back s, and m u - side J w/r stays (J = 2 m r^2/5)."""
    slip = u + side * w
    push = -(1 + back) * slip / (1 + 5 / 2)
    return u + push, w + side * 5 / 2 * push


@pytest.mark.parametrize("back", [1.0, 0.6, 0.0])
def test_a_superball_between_floor_and_ceiling(back: float) -> None:
    flight = 0.45 / 3
    run = mbs.simulate(mbs.loads(BALL), parameters={"back": back}, t_end=6.5 * flight, samples=14)
    x, u, w = 0.0, 2.0, 0.025 * 40
    for k in range(7):
        u, w = bounced(u, w, 1.0 if k % 2 == 0 else -1.0, back)
        assert run["u_x"][2 * k + 1] == pytest.approx(u, rel=1e-12)
        assert 0.025 * run["u_phi"][2 * k + 1] == pytest.approx(w, rel=1e-12)
        assert run["x"][2 * k + 1] == pytest.approx(x + u * flight / 2, rel=1e-11)
        x += u * flight
    assert [event["element"] for event in run.events] == ["down", "up"] * 3 + ["down"]
    assert abs(run["u_y"]) == pytest.approx(np.full(14, 3.0), rel=1e-13)
    if back == 1.0:
        assert sum(run.impact_losses.values()) == pytest.approx(0.0, abs=1e-14)
