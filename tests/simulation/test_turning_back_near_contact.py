"""What turns back just short of where it touches does so in its own time, however near it is."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

SLOPE = """
multibody_sym: 1
name: slope
gravity: [-6, -8, 0]
bodies:
  ground: {points: {o: [1, 0, 0]}, surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  p: {mass: 1}
joints: {j: {type: point, parent: ground, child: p, q: [x, y], initial: {q: [0, 0], u: [v, 0]}}}
contacts: {c: {between: [p, ground.floor], static: 0.5, kinetic: 0.5, restitution: 0}}
constraints: {r: {type: rope, path: [p, ground.o], length: 1, slack: true}}
"""


@pytest.mark.parametrize("slack", [5e-11, 4e-10])
def test_a_block_that_slides_up_and_turns_back_is_caught_by_its_rope_later(slack: float) -> None:
    """Up it slows down by 6 + 4 m/s^2, down it gains 6 - 4: it is at rest as its rope is slack by less than 1e-9 m."""
    v = math.sqrt(20 * slack)
    run = mbs.simulate(mbs.loads(SLOPE.replace("u: [v, 0]", f"u: [{v!r}, 0]")), t_end=1e-3, samples=3)
    taut = [event["t"] for event in run.events if event["element"] == "r"]
    assert taut == [pytest.approx(v / 10 + math.sqrt(slack), rel=1e-6)]
