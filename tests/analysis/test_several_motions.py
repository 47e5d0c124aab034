"""A contact where a joint or a constraint already guides the body: the laws leave several motions, as reported."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import check
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text

SAID = "the laws leave several motions"
WEDGE = """
multibody_sym: 1
name: wedge
gravity: [0, -9.81, 0]
parameters: {alpha: 35 deg, mu: 0.15}
bodies:
  wedge:
    mass: 4
    frames: {slope: {rotate: [{axis: z, angle: alpha}]}}
    surfaces: {face: {plane: [0, 0, 0], normal: [-sin(alpha), cos(alpha), 0]}}
  block: {mass: 1.5}
joints:
  floor: {type: prismatic, parent: ground, child: wedge, axis: x, q: X}
  slide: %s
contacts: {c: {between: [block, wedge.face], static: mu, kinetic: mu}}
"""
GUIDED = "{type: prismatic, parent: wedge.slope, child: block, axis: x, q: s, initial: {q: 1}}"
FREE = "{type: point, parent: wedge.slope, child: block, q: [s, n], initial: {q: [1, 0]}}"
HELD = """
constraints:
  line: {type: expression, zero: n}
"""


def hints(found: mbs.CheckReport) -> list[str]:
    return [hint for hint in found.hints if "gap of contact c" in hint]


def test_check_and_run_say_that_a_guided_block_has_several_motions_and_which_is_taken() -> None:
    system = mbs.loads(WEDGE % GUIDED)
    found = check(system)
    assert (found.verdict, found.states) == ("several", {"c": "slide-"})
    text = check_text(found)
    assert SAID in text
    assert "c slide-" in text
    assert len(hints(found)) == 1
    run = mbs.simulate(system, t_end=0.2, samples=3)
    (event,) = (x for x in run.events if x["kind"] == "several states")
    assert event["element"] == "c"
    assert event["taken"] in {"open", "slide+", "slide-"}
    assert f"c {event['taken']}" in run_summary(run)
    assert SAID in run_summary(run)
    sine, cosine = math.sin(math.radians(35)), math.cos(math.radians(35))
    smooth = 1.5 * 9.81 * cosine * sine / (4 + 1.5 * sine**2)
    assert run.final["coordinates"]["X"] == pytest.approx(smooth * 0.2**2 / 2, rel=1e-9)


def test_a_guided_contact_does_not_strike_by_the_rounding_of_a_long_way() -> None:
    """Behind 5 km in 50 s the gap, in which all lengths cancel, is 1e-12 m, and its rate 3e-14 m/s."""
    run = mbs.simulate(mbs.loads(WEDGE % GUIDED), t_end=50, samples=3)
    assert [x["kind"] for x in run.events] == ["several states"]
    sine, cosine = math.sin(math.radians(35)), math.cos(math.radians(35))
    smooth = 1.5 * 9.81 * cosine * sine / (4 + 1.5 * sine**2)
    assert run.final["coordinates"]["X"] == pytest.approx(smooth * 50**2 / 2, rel=1e-9)


def test_a_constraint_that_holds_a_block_on_its_face_is_named_as_a_joint_is() -> None:
    found = check(mbs.loads(WEDGE % FREE + HELD))
    assert len(hints(found)) == 1


def test_a_block_that_its_face_alone_carries_has_one_motion_and_no_hint() -> None:
    found = check(mbs.loads(WEDGE % FREE))
    assert (found.verdict, found.others, hints(found)) == ("one", (), [])
    assert SAID not in check_text(found)


PAINLEVE = """
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
bodies:
  rod: {shape: {rod: 2, mass: 1}, points: {foot: [0, 0, 0]}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {J: {type: planar, parent: ground, child: rod, initial: {q: [0, 0, 0.9], u: [-8, 0, -4]}}}
contacts: {c: {between: [rod.foot, ground.floor], static: 2}}
"""


def test_painleves_rod_may_slide_or_lift_off_and_check_names_both() -> None:
    """The foot would rise (a_n > 0) without the contact, and its apparent mass is negative: both states are consistent.

    Source: Painleve 1895; here with half the length 1 m and the coefficient 2.
    """
    found = check(mbs.loads(PAINLEVE))
    assert found.verdict == "several"
    states = {found.states["c"], *(other["c"] for other in found.others)}
    assert states == {"open", "slide-"}
    assert "another: c " in check_text(found)
    lifting = -9.81 + 4.0**2 * math.sin(0.9) * 1.0
    pressing = 1.0 + 3.0 * math.cos(0.9) * (math.cos(0.9) - 2.0 * math.sin(0.9))
    assert lifting > 0 > pressing
