"""Impacts at which time would not go on: what rounding has let into a face, and what strikes again at once."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.motion.switching import impact
from multibody_sym.motion.switching.impact import BounceMemory, Hit, Standstill

POINT = """\
multibody_sym: 1
name: past_an_end
gravity: [0, 0, 0]
parameters: {y0: 0, v: 0, e: 1}
bodies:
  ground: {surfaces: {bar: {segment: [[-1, 0, 0], [0, 0, 0]], normal: y}}}
  p: {mass: 1}
joints: {free: {type: point, parent: ground, child: p, q: [x, y], initial: {q: [0.5, y0], u: [-1, v]}}}
contacts: {c: {between: [p, ground.bar], restitution: e}}
simulation: {t_end: 1, samples: 3}
"""
DEEP = 3e-9
"""Past the end the point is so far (m) inside the face, three times of what counts as touching."""


def test_impacts_at_one_time_collapse() -> None:
    """So do those after a first one at that time, which only rounding sets apart."""
    bounces, time = BounceMemory(), 11.5
    for _ in range(141):
        assert not bounces.collapsing(time, 2)
        bounces.hit(Hit(time, frozenset({"c"}), np.zeros(2)))
        time += 2e-15
    assert bounces.collapsing(time, 2) == {"c"}
    assert bounces.collapsing(time + 1e-6, 2) == frozenset()


def test_time_that_does_not_go_on_is_told() -> None:
    stands, time = Standstill(), 11.5
    for _ in range(1200):
        assert not stands.lasts(time, 1)
        time += 2e-15
    assert stands.lasts(time, 1)
    assert not stands.lasts(time + 1e-9, 1)


def too_fast(stands: Standstill, times: list[float]) -> bool:
    return any(stands.lasts(time, 1) for time in times)


def test_a_pace_that_a_run_cannot_hold_is_told_and_one_that_it_can_is_not() -> None:
    steady = [2.0 + k * 1e-7 for k in range(5000)]
    assert too_fast(Standstill(2.0), steady)  # 2e7 in the whole run
    assert not too_fast(Standstill(0.9), steady)
    assert not too_fast(Standstill(2.0), steady[:2400])  # two blocks of 1,200 tell a pace


@pytest.mark.parametrize("e", [0.9, 0.999, 0.9999])
def test_bounces_that_shrink_are_not_too_fast_however_many_there_are(e: float) -> None:
    """They cease at t = 1, the last 1e-9 of that aside."""
    times, left = [0.0], 1.0
    while left > 1e-9:
        left *= e
        times.append(1.0 - left)
    assert not too_fast(Standstill(1e3), times)


WALLS = """\
multibody_sym: 1
name: walls
gravity: [0, 0, 0]
parameters: {d: 1e-7}
bodies:
  ground: {surfaces: {left: {plane: [0, 0, 0], normal: x}, right: {plane: [d, 0, 0], normal: -x}}}
  p: {mass: 1}
joints: {free: {type: point, parent: ground, child: p, q: [x, y], initial: {q: [d/2, 0], u: [1, 0]}}}
contacts: {a: {between: [p, ground.left], restitution: 1}, b: {between: [p, ground.right], restitution: 1}}
simulation: {samples: 3}
"""


def test_a_run_with_impacts_without_end_says_between_what_and_when() -> None:
    """Each d/v = 1e-7 s, a hundred million times in 10 s; a run of 3e-4 s goes to its end."""
    said = r"a, b: it strikes or lets go 1400 times in 0.00014 s, more often than .* at t = 0.00028"
    with pytest.raises(FailedRunError, match=said) as met:
        mbs.simulate(mbs.loads(WALLS), t_end=10.0)
    assert met.value.number == "R100"
    events = met.value.trajectory.events
    assert {event["element"] for event in events} == {"a", "b"}
    assert 2800 <= len(events) <= 2802
    run = mbs.simulate(mbs.loads(WALLS), t_end=3e-4)
    assert len(run.events) == 3000
    assert (run["x"][-1], run["u_x"][-1]) == pytest.approx((0.5e-7, 1.0), rel=1e-6)


CLOSING = """\
multibody_sym: 1
name: closing
gravity: [0, 0, 0]
bodies:
  piston: {mass: 1, surfaces: {face: {plane: [0, 0, 0], normal: -x}}}
  p: {mass: 1}
joints:
  P: {type: prismatic, parent: ground, child: piston, axis: x, motion: 1 - t}
  B:
    {type: prismatic, parent: ground, child: p, axis: x, q: x, initial: {q: 0.5, u: 1},
     limits: {lower: 0, restitution: 1}}
contacts: {c: {between: [p, piston.face], restitution: E, open: true}}
simulation: {t_end: 1.5, samples: 3}
"""


def test_impacts_between_walls_that_close_in_end_a_run_soon() -> None:
    """Each adds twice the piston's speed: u (1 - t) lasts, and the n-th is at 1 - t = 1/n or so."""
    with pytest.raises(FailedRunError, match=r"B.lower, c: it strikes or lets go 1400 times in .*, more often") as met:
        mbs.simulate(mbs.loads(CLOSING.replace("E", "1")))
    impacts = [x["t"] for x in met.value.trajectory.events]
    assert len(impacts) < 10 * 1400
    assert (1 - impacts[1999]) / (1 - impacts[999]) == pytest.approx(0.5, rel=1e-2)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_run_that_is_struck_for_ever_ends_with_words(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Were what is inside let stay there, it would be met again at once."""
    monkeypatch.setattr(impact, "_endless", lambda contacts: 10)
    monkeypatch.setattr(BounceMemory, "leaving", lambda self, facts, element: facts.q)
    with pytest.raises(FailedRunError, match="c: it strikes or lets go again and again and time does not go on; let"):
        mbs.simulate(mbs.loads(POINT), parameters={"y0": -DEEP}, backend=backend)


RODS = """\
multibody_sym: 1
name: folding
gravity: [0, 0, 0]
parameters: {l: 1, further: 0, w: 0.3}
bodies:
  one:
    {mass: 1, com: [l/2, 0, 0], inertia: {Izz: l^2/12},
     surfaces: {side: {segment: [[0, 0, 0], [l + further, 0, 0]], normal: y}}}
  two: {mass: 1, com: [l/2, 0, 0], inertia: {Izz: l^2/12}, points: {tip: [l, 0, 0]}}
joints:
  table: {type: planar, parent: ground, child: one, q: [x, y, f], initial: {q: [10, 3, 0], u: [0.1, 0.2, w]}}
  hinge: {type: revolute, parent: one, child: two, axis: z, q: g, initial: {q: 1, u: -1}}
contacts: {c: {between: [two.tip, one.side], restitution: 1, open: true}}
simulation: {t_end: 1.5, samples: 3, rtol: 1e-12, atol: 1e-13}
"""


def test_rods_that_fold_bounce_on_what_reaches_further_than_the_tip() -> None:
    """The speed of the tip across the other rod, l times that of the hinge, is reversed."""
    rods = mbs.loads(RODS)
    run = mbs.simulate(rods, parameters={"further": 0.01})
    (event,) = run.events
    again = mbs.simulate(rods, parameters={"further": 0.01}, t_end=2 * event["t"], samples=3)
    assert again["g"][-1] == pytest.approx(1.0, abs=1e-9)  # the way back is that there, turned round
    assert again["u_g"][-1] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_rods_that_fold_onto_the_very_end_bounce_there(backend: str) -> None:
    """The foot is the end to rounding, within the segment or beyond it."""
    rods = mbs.loads(RODS)
    run = mbs.simulate(rods, backend=backend)
    (event,) = run.events
    assert (event["kind"], event["element"]) == ("impact", "c")
    again = mbs.simulate(rods, t_end=2 * event["t"], samples=3, backend=backend)
    assert again["g"][-1] == pytest.approx(1.0, abs=1e-9)
    assert again["u_g"][-1] == pytest.approx(1.0, abs=1e-9)
