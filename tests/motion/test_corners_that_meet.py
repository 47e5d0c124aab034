"""Corners of boxes that meet exactly strike along the way in which they come together, and none passes through."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

MODEL = """\
multibody_sym: 1
name: corners
gravity: [0, {gravity}, 0]
bodies:
  a: {{shape: {{box: [1, 1, 1], mass: 2}}}}
  b: {{{b}}}
joints:
  A: {{{a}}}
  B: {{type: {joint}, parent: ground, child: b, q: [xb, yb{turn}], initial: {{q: [{q}], u: [{u}]}}}}
contacts: {{c: {{between: [{between}], restitution: {e}}}}}
simulation: {{t_end: 2, samples: 5}}
"""
BOX, ROD, PARTICLE = "shape: {box: [1, 1, 1], mass: 1}", "shape: {rod: 1, mass: 1}", "mass: 1"


def run(
    q: str,
    u: str,
    *,
    b: str = BOX,
    turned: str = "0",
    pinned: bool = False,
    gravity: float = 0,
    e: float = 1,
    between: str = "a, b",
    **settings: Any,
) -> Any:
    """Return a run of what comes to a box, which is free, or turns about its centre, and starts `turned`."""
    a = f"type: planar, parent: ground, child: a, q: [xa, ya, pa], initial: {{q: [0, 0, {turned}]}}"
    if pinned:
        a = f"type: revolute, parent: ground, child: a, axis: z, q: pa, initial: {{q: {turned}}}"
    joint, turn = ("point", "") if b == PARTICLE else ("planar", ", pb")
    text = MODEL.format(gravity=gravity, b=b, a=a, joint=joint, turn=turn, q=q, u=u, between=between, e=e)
    return mbs.simulate(mbs.loads(text), **{"backend": "python", **settings})


def told(found: Any) -> list[tuple[str, str, float]]:
    return [(x["kind"], x["element"], round(x["t"], 9)) for x in found.events]


@pytest.mark.parametrize("backend", ["python", "c"])
@pytest.mark.parametrize(("between", "name"), [("a, b", "c.corner3.corner1"), ("b, a", "c.corner1.corner3")])
def test_boxes_that_meet_tip_on_tip_strike(between: str, name: str, backend: str) -> None:
    """Along a line through both centres of mass 2 kg and 1 kg are 4/3 N*s exchanged at 1 m/s."""
    found = run("0, sqrt(2) + 1, pi/4", "0, -1, 0", turned="pi/4", between=between, backend=backend)
    assert told(found) == [("impact", name, 1.0)]
    assert found.events[0]["impulse"] == pytest.approx(4 / 3, rel=1e-12)
    assert found.u[-1] == pytest.approx([0, -2 / 3, 0, 0, 1 / 3, 0], abs=1e-12)


def test_a_box_bounces_on_a_tip_until_it_stands_there() -> None:
    """It falls 1 m, and its flights end at 3 sqrt(2 h/g)."""
    found = run("0, sqrt(2) + 1, pi/4", "0, 0, 0", turned="pi/4", pinned=True, gravity=-10, e=0.5)
    first = math.sqrt(0.2)
    assert [x["t"] for x in found.events[:3]] == pytest.approx([first, 2 * first, 2.5 * first], rel=1e-9)
    assert (found.events[-1]["kind"], found.events[-1]["element"]) == ("closed", "c.corner3.corner1")
    assert found.events[-1]["t"] == pytest.approx(3 * first, rel=1e-8)
    assert found["yb"][-1] == pytest.approx(math.sqrt(2), abs=1e-9)


def test_short_flights_from_the_start_on_a_tip_are_not_lost() -> None:
    found = run("0, sqrt(2), pi/4", "0, -1, 0", turned="pi/4", pinned=True, gravity=-10, e=0.5)
    assert [x["t"] for x in found.events[:6]] == pytest.approx([0, 0.1, 0.15, 0.175, 0.1875, 0.19375], abs=1e-9)
    assert {x["element"] for x in found.events} == {"c.corner3.corner1"}
    assert found["yb"][-1] == pytest.approx(math.sqrt(2), abs=1e-9)


@pytest.mark.parametrize(("speed", "way"), [("-1, -1, 0", (1, 1)), ("-0.5, -1, 0", (0.5, 1))])
def test_boxes_that_meet_corner_on_corner_strike_along_their_way(speed: str, way: tuple[float, float]) -> None:
    """W = n (1/m_a + 1/m_b + (r_a x n)^2/I_a + (r_b x n)^2/I_b) n, with r_a = (1, 1)/2 = -r_b, I = m/6."""
    found = run(f"{1 + way[0]}, {1 + way[1]}, 0", speed)
    (event,) = found.events
    n, fast = np.array(way) / np.hypot(*way), float(np.hypot(*way))
    arm = (n[1] - n[0]) / 2
    assert (event["kind"], event["element"]) == ("impact", "c.corner3.corner1")
    assert event["t"] == pytest.approx(1.0, rel=1e-12)
    impulse = 2 * fast / (1.5 * (1 + 6 * arm**2))
    assert event["impulse"] == pytest.approx(impulse, rel=1e-9)
    after = [found["u_xa"][-1], found["u_ya"][-1], found["u_xb"][-1], found["u_yb"][-1]]
    assert after == pytest.approx([*(-impulse / 2 * n), *((impulse - fast) * n)], abs=1e-9)


@pytest.mark.parametrize("place", ["1, 2, 0", "1, 3, 0"])
def test_a_box_that_comes_down_along_the_side_of_another_one_passes_it(place: str) -> None:
    assert run(place, "0, -1, 0", pinned=True).events == []


def test_boxes_that_meet_face_on_face_strike_with_their_faces() -> None:
    found = run("0, 2, 0", "0, -1, 0")
    names = ["c.corner3.bottom", "c.corner4.bottom", "c.top.corner1", "c.top.corner2"]
    assert told(found) == [("impact", name, 1.0) for name in names]


@pytest.mark.parametrize(("place", "turned"), [("1.5, 1.5", "0"), ("0, sqrt(2)/2 + sqrt(2)", "pi/4")])
def test_a_particle_that_comes_onto_a_corner_strikes_it(place: str, turned: str) -> None:
    found = run(place, "-1, -1" if turned == "0" else "0, -sqrt(2)", b=PARTICLE, turned=turned)
    assert told(found) == [("impact", "c.corner3", 1.0)]
    assert found.events[0]["impulse"] == pytest.approx(4 / 3 * math.sqrt(2), rel=1e-12)


@pytest.mark.parametrize("along", [0, 0.5])
def test_a_particle_that_lands_at_the_very_end_of_a_face_strikes_it(along: float) -> None:
    """It pushes the corner down: 1/m_a + 1/m_b + (1/2 m)^2/I_a is 2.25/kg."""
    found = run(f"{0.5 - along}, 1.5", f"{along}, -1", b=PARTICLE)
    impacts = {x["element"]: x["impulse"] for x in found.events}
    assert impacts["c.top"] == pytest.approx(2 / (1 + 1 / 2 + 3 / 4), rel=1e-9)
    assert [x["t"] for x in found.events] == pytest.approx([1.0] * len(found.events), rel=1e-9)


def test_a_particle_that_falls_along_a_side_from_below_its_end_slides() -> None:
    assert told(run("0.5, 0.4", "0, -1", b=PARTICLE, pinned=True)) == [("open", "c.right", 0.9)]


@pytest.mark.parametrize(("place", "name"), [("pi/2", "end1"), ("-pi/2", "end2")])
def test_the_end_of_a_rod_that_comes_onto_a_corner_strikes_it(place: str, name: str) -> None:
    above = 1 if name == "end1" else 2
    found = run(f"0, sqrt(2)/2 + {above}, {place}", "0, -1, 0", b=ROD, turned="pi/4")
    assert told(found) == [("impact", f"c.corner3.{name}", 1.0)]
    assert found.u[-1] == pytest.approx([0, -2 / 3, 0, 0, 1 / 3, 0], abs=1e-12)


@pytest.mark.parametrize("bar", ["segment: [[-2, 0, 0], [0, 0, 0]]", "segment: [[-2, 0, 0], [0, 0, 0]], normal: y"])
@pytest.mark.parametrize(("place", "speed"), [("sqrt(2)/2 + 1, 0", (-1, 0)), ("0, sqrt(2)/2 + 1", (0, -1))])
def test_a_box_whose_corner_comes_onto_the_end_of_a_bar_strikes_it(
    bar: str, place: str, speed: tuple[int, int]
) -> None:
    text = f"""\
multibody_sym: 1
name: box at the end of a bar
gravity: [0, 0, 0]
bodies:
  ground: {{surfaces: {{bar: {{{bar}}}}}}}
  b: {{{BOX}}}
joints:
  B: {{type: planar, parent: ground, child: b, initial: {{q: [{place}, pi/4], u: [{speed[0]}, {speed[1]}, 0]}}}}
contacts: {{c: {{between: [ground.bar, b], restitution: 0.5}}}}
simulation: {{t_end: 2, samples: 5}}
"""
    found = mbs.simulate(mbs.loads(text), backend="python")
    assert [x["t"] for x in found.events] == pytest.approx([1.0], rel=1e-9)
    assert found.u[-1] == pytest.approx([-0.5 * speed[0], -0.5 * speed[1], 0], abs=1e-9)
