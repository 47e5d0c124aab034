"""What strikes in turn, each at rest without a rebound as the other strikes, comes to rest after endlessly many."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

MACHINE = """
multibody_sym: 1
name: jerked
gravity: [0, -g, 0]
parameters: {g: 9.81, m1: 2, m2: 3, h: 0.8, H: 5}
bodies:
  ground:
    points: {o: [0, H, 0], r: [0.4, 0, 0], l: [-0.4, 0, 0]}
    surfaces: {floor: {plane: [0, 0, 0], normal: y}}
  a: {mass: m1}
  b: {mass: m2}
joints:
  A: {type: prismatic, parent: ground.l, child: a, axis: y, q: y1, initial: {q: 1}}
  B: {type: prismatic, parent: ground.r, child: b, axis: y, q: y2, initial: {q: h}}
pulleys: {P: {at: ground.o, radius: 0.4}}
constraints: {s: {type: rope, path: [a, P, b], slack: true}}
contacts: {c: {between: [b, ground.floor], open: true}}
outputs: {E: total_energy()}
ask: {t1: c closes, ymax: {max: y1}}
"""


def rest(m1: float, m2: float) -> float:
    """Return when both rest: b lands with v, a flies for 2 v/g, the jerk leaves k v and b is back 2 k v/(k' g) later.

    Here k = m1/(m1 + m2), k' = (m2 - m1)/(m1 + m2), and each cycle is the one before times k.
    """
    k, slower = m1 / (m1 + m2), (m2 - m1) / (m1 + m2)
    v = math.sqrt(2 * slower * 9.81 * 0.8)
    return v / (slower * 9.81) + (2 * v / 9.81 + 2 * k * v / (slower * 9.81)) / (1 - k)


def test_what_bounces_on_landing_in_each_cycle_rests_at_the_same_limit() -> None:
    """b bounces to rest while a flies: infinitely many bounces in each of infinitely many cycles, as long as before."""
    bounces = mbs.loads(MACHINE.replace("open: true", "open: true, restitution: 0.45"))
    for m1, m2 in ((2, 3), (1, 4), (2, 2.5)):
        end = rest(m1, m2)
        run = mbs.simulate(bounces, parameters={"m1": m1, "m2": m2}, t_end=1.1 * end, samples=12)
        last = {event["element"]: event["t"] for event in run.events}
        assert last == {x: pytest.approx(end, rel=1e-10) for x in ("c", "s")}, (m1, m2)
        assert run["E"][0] - run["E"][-1] == pytest.approx((m2 - m1) * 9.81 * 0.8, rel=1e-12)


def test_questions_about_what_strikes_in_turn_have_answers() -> None:
    """It is highest as b has landed and a flies on: 0.8 + v^2/(2 g) above where it was, v^2 = 2 (g/5) 0.8."""
    answers = mbs.solve(mbs.loads(MACHINE + "simulation: {t_end: 3}\n")).answers
    assert answers["t1"].value == pytest.approx(math.sqrt(2 * 0.8 * 5 / 9.81), rel=1e-9)
    assert answers["ymax"].value == pytest.approx(1 + 0.8 + 0.8 / 5, rel=1e-9)
