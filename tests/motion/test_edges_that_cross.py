"""Bars and edges that cross in space: they rest, slide and tip as by hand; edges of boxes pass unless declared."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import check
from multibody_sym.documents.runs import run_summary
from multibody_sym.text.printer import text

HEAD = "multibody_sym: 1\nname: edges\ngravity: [0, 0, -g]\n"

RAILS = """
parameters: {g: 10 m/s^2, m: {value: 5 kg, positive: true}, a: 0.2 m, b: 0.3 m, l: 1 m, r: 0.01}
bodies:
  ground: {surfaces: {left: {segment: [[-a, -1, 0], [-a, 1, 0]]}, right: {segment: [[b, 1, 0], [b, -1, 0]]}}}
  bar:
    shape: {cylinder: [r, l], mass: m}
    surfaces: {side: {segment: [[0, 0, -l/2], [0, 0, l/2]], normal: [0, -1, 0]}}
joints: {free: {type: free, parent: ground, child: bar, initial: {q: [0, 0, 0, 0.5, 0.5, 0.5, 0.5]}}}
contacts: {A: {between: [bar.side, ground.left], static: 0.5}, B: {between: [ground.right, bar.side], static: 0.5}}
"""

SEESAW = """
parameters: {g: 10 m/s^2, m: 2 kg, m1: 1 kg, m2: 1.5 kg, l: 1 m}
bodies:
  ground: {frames: {tilt: {rotate: [{axis: x, angle: 90 deg}]}}, surfaces: {edge: {segment: [[0, -1, 0], [0, 1, 0]]}}}
  bar: {shape: {rod: 2*l, mass: m}, points: {end: [2*l, 0, 0]}}
  left: {mass: m1}
  right: {mass: m2}
joints:
  J: {type: planar, parent: ground.tilt, child: bar, q: [x, y, phi], initial: {q: [-l, 0, 0]}}
  a: {type: fixed, parent: bar, child: left}
  b: {type: fixed, parent: bar.end, child: right}
contacts: {A: {between: [bar, ground.edge], static: 0.4}}
"""

SLIDES = """
parameters: {g: 10 m/s^2, mu: 0.2, beta: 25 deg}
bodies:
  ground: {surfaces: {rail: {segment: [[-0.5*cos(beta), 0, -0.5*sin(beta)], [3*cos(beta), 0, 3*sin(beta)]]}}}
  bar: {mass: 2, surfaces: {rod: {segment: [[0, -1, 0], [0, 1, 0]]}}}
joints: {J: {type: point, parent: ground, child: bar, axes: xyz, initial: {u: [cos(beta), 0, sin(beta)]}}}
contacts: {A: {between: [bar.rod, ground.rail], static: mu}}
simulation: {t_end: 1, samples: 11, rtol: 1e-10, atol: 1e-12}
"""

BOXES = """
parameters: {{g: 10 m/s^2}}
bodies:
  ground: {{frames: {{up: {{rotate: [{{axis: x, angle: 45 deg}}]}}}}}}
  a: {{shape: {{box: [1, sqrt(2), sqrt(2)], mass: 1}}}}
  b: {{shape: {{box: [sqrt(2), 1, sqrt(2)], mass: 1}}}}
joints:
  J: {{type: fixed, parent: ground.up, child: a}}
  K: {{type: free, parent: ground, child: b, initial: {{q: [0.1, 0.1, 2.2, cos(pi/8), 0, sin(pi/8), 0]}}}}
contacts: {{{contacts}}}
simulation: {{t_end: 0.3, samples: 31}}
"""


def solved(model: str) -> mbs.Solution:
    return mbs.solve(mbs.loads(HEAD + model))


def test_a_bar_lies_across_two_rails() -> None:
    """The one is nearer to its middle and carries more; which end of `between` it is at does not matter."""
    found = solved(RAILS)
    assert found.states == {"A": "stick", "B": "stick"}
    assert text(found.reactions["A"]["normal"].expression) == "b*g*m/(a + b)"
    assert text(found.reactions["B"]["normal"].expression) == "a*g*m/(a + b)"
    assert all(abs(x.value) < 1e-12 for x in found.accelerations.values())


def test_a_bar_tips_over_an_edge_with_a_load_at_each_end() -> None:
    """J phi'' = (m1 - m2) g l with J = m l^2/3 + (m1 + m2) l^2: the heavier load sinks."""
    found = solved(SEESAW)
    turning = (1.0 - 1.5) * 10.0 / (2.0 / 3.0 + 2.5)
    assert found.accelerations["phi"].value == pytest.approx(turning, rel=1e-12)
    pressing = 10.0 * 4.5 + 0.5 * turning  # the centre of mass falls by (m2 - m1) l |phi''|
    assert found.reactions["A"]["normal"].value == pytest.approx(pressing, rel=1e-12)


def test_a_bar_slides_up_a_rail_and_down_and_off_its_end() -> None:
    """-g (sin + mu cos) up, g (sin - mu cos) down, until it is 0.5 m below where it began."""
    run = mbs.simulate(mbs.loads(HEAD + SLIDES))
    s, c, mu, g = math.sin(math.radians(25)), math.cos(math.radians(25)), 0.2, 10.0
    stops = 1.0 / (g * (s + mu * c))
    falls = stops + math.sqrt((1.0 + stops) / (g * (s - mu * c)))
    times = {event["kind"]: event["t"] for event in run.changes}
    assert times["open"] == pytest.approx(falls, abs=1e-8)
    assert run["J_x"][-1] < -0.5 * c
    assert run.friction_work["A"].total == pytest.approx(-mu * 2 * g * c * (0.5 + stops), rel=1e-7)


def test_edges_of_boxes_touch_where_both_are_named() -> None:
    """The lower edge of b is 1 m below its middle, and the upper one of a 1 m above ground's origin: 0.2 m to fall.

    What is declared of the boxes alone lets them pass, which the run tells, and `check` beforehand.
    """
    passing, meeting = "c: {between: [b, a]}", "e: {between: [b.back_right, a.top_front]}"
    run = mbs.simulate(mbs.loads(HEAD + BOXES.format(contacts=passing)), backend="python")
    (event,) = [x for x in run.events if x["kind"] == "edges cross"]
    assert event["element"] == "c"
    assert event["t"] == pytest.approx(0.21, abs=1e-9)  # the first sample after 0.2 s
    assert "an edge of one box of contact c leads through the other" in run_summary(run)
    assert any("edges of the boxes of contact c" in hint for hint in check(run.ready.system).hints)

    run = mbs.simulate(mbs.loads(HEAD + BOXES.format(contacts=f"{passing}, {meeting}")), backend="python")
    assert next(x["t"] for x in run.changes if x["element"] == "e") == pytest.approx(0.2, abs=1e-9)
    assert not [x for x in run.events if x["kind"] == "edges cross"]
