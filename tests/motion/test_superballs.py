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


def test_friction_that_is_too_weak_gives_back_no_more_than_its_cone() -> None:
    """mu m (1 + e) v is less than what turns slip round: the ball slides all the while."""
    run = mbs.simulate(mbs.loads(BALL), parameters={"mu": 0.05}, t_end=0.01, samples=2)
    assert run["u_x"][-1] == pytest.approx(2 - 0.05 * 6, rel=1e-12)


def test_solve_has_the_same_answer_from_the_same_words() -> None:
    impact = mbs.solve(mbs.loads(BALL + "impact: {contacts: down}\n")).impact
    assert impact is not None
    u, w = bounced(2.0, 1.0, 1.0, 1.0)
    assert impact.after["u_x"].value == pytest.approx(u, rel=1e-13)
    assert 0.025 * impact.after["u_phi"].value == pytest.approx(w, rel=1e-13)


@pytest.mark.parametrize("value", ["1.5", "-0.1", "b"])
def test_what_is_no_such_coefficient_is_told_with_its_line(value: str) -> None:
    text = BALL.replace("tangential_restitution: back", f"tangential_restitution: {value}")
    with pytest.raises(mbs.ModelError, match=r"contacts\.down"):
        mbs.simulate(mbs.loads(text.replace("mu: 1", "mu: 1, b: 2")), t_end=0.1)


def test_a_smooth_contact_has_nothing_to_give_back() -> None:
    with pytest.raises(mbs.ModelError, match="tangential_restitution"):
        mbs.loads(BALL.replace("static: mu, ", ""))
