"""Points do not get through bars without thickness: they bounce on the side from which they come."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

_FALLING = """
multibody_sym: 1
name: thin
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {bar: {segment: [[-2, 0, 0], [2, 0, 0]]NORMAL}}}
  ball: {mass: 1, points: {tip: [0, 0, 0]}}
joints: {fall: {type: planar, parent: ground, child: ball, q: [x, y, a], initial: {q: [X, 0.2, 0], u: [U, 0, 0]}}}
contacts: {hit: {between: [ball.tip, ground.bar], restitution: 0.5}}
simulation: {t_end: 0.35 s}
"""


def _falling(normal: str = "", x: float = 0.0, u: float = 0.0) -> mbs.System:
    text = _FALLING.replace("NORMAL", normal).replace("X,", f"{x},").replace("[U", f"[{u}")
    return mbs.loads(text.replace("mass: 1,", "mass: 1, inertia: [1, 1, 1, 0, 0, 0],"))


@pytest.mark.parametrize("normal", ["", ", normal: y"])
def test_with_a_normal_and_without_it_bounces(normal: str) -> None:
    run = mbs.simulate(_falling(normal))
    rest = 0.35 - 0.2  # after the blow at 0.2 s, with 1 m/s up
    assert run["y"][-1] == pytest.approx(rest - 5.0 * rest**2, abs=1e-6)


def test_past_the_end_of_a_bar_it_falls() -> None:
    run = mbs.simulate(_falling(x=1.5, u=3.0), backend="python")
    assert run["y"][-1] == pytest.approx(0.2 - 5.0 * 0.35**2, abs=1e-6)


def test_it_starts_from_one_side_of_a_bar_that_it_crosses() -> None:
    text = """
multibody_sym: 1
name: thin
gravity: [0, -10, 0]
bodies:
  ground: {points: {edge: [0, 0, 0], b: [-0.7, 0, 0]}}
  rod: {shape: {rod: 2, mass: 1}}
joints: {fall: {type: prismatic, parent: ground.b, child: rod, axis: y, q: y, initial: {q: 0, u: -2}}}
contacts: {hit: {between: [ground.edge, rod], restitution: 0.5}}
impact: closing
simulation: {t_end: 0.35 s}
"""
    with pytest.raises(mbs.ModelError, match="rod a bar without thickness: nothing tells which side"):
        mbs.simulate(mbs.loads(text), backend="python")
