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


CORNER = """
multibody_sym: 1
name: corner
gravity: [0, -9.81, 0]
bodies:
  ground:
    surfaces:
      floor: {plane: [0, 0, 0], normal: [-0.29552020666133955, 0.955336489125606, 0]}
      wall: {plane: [0, 0, 0], normal: [-0.9950041652780258, 0.09983341664682815, 0]}
  p: {mass: 1.7}
joints:
  j: {type: point, parent: ground, child: p, q: [x, y], initial: {q: [AT, UP], u: [ALONG, DOWN]}}
contacts:
  f: {between: [p, ground.floor], static: 1.5, kinetic: 1.5, open: true}
  w: {between: [p, ground.wall]}
"""


def test_a_wall_along_which_a_point_falls_is_not_struck_as_the_point_lands_and_sticks() -> None:
    """The floor takes all momentum, which is that of a fall along the wall; the wall took -8e-16 N*s: rounding."""
    wx, wy, h = 0.09983341664682815, 0.9950041652780258, 0.5
    given = {"AT": h * wx, "UP": h * wy, "ALONG": -wx, "DOWN": -wy}
    text = CORNER
    for name, value in given.items():
        text = text.replace(name, repr(value))
    run = mbs.simulate(mbs.loads(text), t_end=0.6, samples=3)
    (event,) = run.events
    assert (event["element"], event["kind"]) == ("f", "stick")
    v = math.sqrt(1 + 2 * 9.81 * wy * h)
    assert event["impulse"] == pytest.approx(1.7 * v * (0.955336489125606 * wy - 0.29552020666133955 * wx), rel=1e-9)
