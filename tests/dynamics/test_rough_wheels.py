"""Ropes over rough wheels and drums: Euler's and Eytelwein's law in each mode, and the mode that the law finds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from solved_starts import solved_start

import multibody_sym as mbs
from multibody_sym.contact_laws.search import find
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.contact.contact_problem import one_way_rows
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions

CAPSTAN = """\
multibody_sym: 1
name: capstan
gravity: [0, -9.81, 0]
parameters: {m1: 1, m2: 5, mu: 0.2}
bodies:
  ground: {points: {top: [0, 3, 0], left: [-0.1, 0, 0], right: [0.1, 0, 0]}}
  wheel: {shape: {disc: 0.1, mass: 3}}
  one: {mass: m1}
  two: {mass: m2}
joints:
  H: {type: revolute, parent: ground.top, child: wheel, q: phi}
  L: {type: prismatic, parent: ground.left, child: one, axis: y, q: y1}
  N: {type: prismatic, parent: ground.right, child: two, axis: y, q: y2}
pulleys: {drum: {at: ground.top, radius: 0.1, rough: mu}}
constraints: {string: {type: rope, path: [one, drum, two]}}
"""
G = 9.81


def solved(text: str, slip: int, **parameters: float) -> StateQuantities:
    """Return the start of a model in a mode, solved."""
    return instant(mechanism(mbs.loads(text)), Mode({"string": 1}, {"drum": slip}), parameters)


def instant(resolved: Mechanism, mode: Mode, parameters: dict[str, float]) -> StateQuantities:
    acting = in_mode(resolved, mode)
    return solved_start(acting, start(acting, parameters), "block_ldl")


@pytest.mark.parametrize(("m1", "m2", "slip"), [(1.0, 5.0, 1), (6.0, 1.0, -1)])
def test_over_a_drum_that_stands_still_the_tensions_differ_by_the_exponential(m1: float, m2: float, slip: int) -> None:
    """m1 a = T1 - m1 g, m2 a = m2 g - T2, T2 = T1 exp(mu pi) where the rope runs forward, T1 = T2 exp(mu pi) else."""
    at = solved(CAPSTAN, slip, m1=m1, m2=m2)
    ratio = math.exp(slip * 0.2 * math.pi)
    a = G * (m2 - ratio * m1) / (m2 + ratio * m1)
    assert at.udot[1:] == pytest.approx([a, -a], rel=1e-12)
    T1, T2 = at.tensions["string.1"], at.tensions["string.2"]
    assert pytest.approx([m1 * (G + a), m2 * (G - a)], rel=1e-12) == [T1, T2]
    held = at.pulleys["drum"]
    assert held["fy"] == pytest.approx(T1 + T2, rel=1e-12)
    assert held["mz"] == pytest.approx((T2 - T1) * 0.1, rel=1e-12)


@pytest.mark.parametrize(
    ("m1", "m2", "turns", "slip"),
    [(1.0, 5.0, 0, 1), (1.0, 1.87, 0, 0), (1.0, 1.88, 0, 1), (1.88, 1.0, 0, -1), (1.0, 5.0, 1, 0), (1.0, 80.0, 3, 0)],
)
def test_the_law_finds_whether_the_rope_slips(m1: float, m2: float, turns: int, slip: int) -> None:
    """It rests up to exp(0.2 (pi + 2 pi turns)): 1.874 with a half turn, 6.586 with one more."""
    text = CAPSTAN.replace("[one, drum, two]", f"[one, drum, two], turns: {turns}")
    resolved = mechanism(mbs.loads(text))
    begin = start(resolved, {"m1": m1, "m2": m2})
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    problem = one_way_rows(resolved, motion_of(resolved, state)).posed(["string"])
    found = find(problem.problem)
    assert found.verdict == "one"
    mode = problem.mode(found.states[0])
    assert (mode.sides["string"], mode.slips["drum"]) == (1, slip)
    at = instant(resolved, mode, {"m1": m1, "m2": m2})
    assert (abs(at.udot[1]) < 1e-12) is (slip == 0)


WHEEL = CAPSTAN.replace("drum: {at: ground.top,", "drum: {body: wheel,")


def test_a_rough_wheel_that_holds_its_rope_is_one_that_grips() -> None:
    rough, gripping = solved(WHEEL, 0), mbs.solve(mbs.loads(WHEEL.replace(", rough: mu", "")))
    assert rough.udot == pytest.approx([x.value for x in gripping.accelerations.values()], rel=1e-12)
    known = gripping.reactions["string"]
    assert rough.tensions["string.1"] == pytest.approx(known["tension1"].value, rel=1e-12)
    assert rough.tensions["string.2"] == pytest.approx(known["tension2"].value, rel=1e-12)
    assert rough.reactions["H"]["fy"] == pytest.approx(gripping.reactions["H"]["fy"].value, rel=1e-12)


def test_a_wheel_over_which_its_rope_slips_is_turned_by_the_friction() -> None:
    at = solved(WHEEL.replace("mass: 3}", "mass: 300}"), 1, m2=50.0)
    T1, T2 = at.tensions["string.1"], at.tensions["string.2"]
    assert pytest.approx(math.exp(0.2 * math.pi), rel=1e-12) == T2 / T1
    assert at.udot[0] == pytest.approx(-(T2 - T1) * 0.1 / (300 * 0.1**2 / 2), rel=1e-12)
    assert at.udot[1] > -0.1 * at.udot[0], "the rope runs ahead of the rim"
    assert at.reactions["H"]["fy"] == pytest.approx(300 * G + T1 + T2, rel=1e-12)


SWINGING = WHEEL.replace(
    "  L: {type: prismatic, parent: ground.left, child: one, axis: y, q: y1}",
    "  L: {type: planar, parent: ground, child: one, q: [x, y1, turn], initial: {q: [-1, 0.5, 0], u: [0.3, 0.2, 0]}}",
).replace("one: {mass: m1}", "one: {mass: m1, inertia: {Izz: 1}}")


def test_the_row_of_the_slip_against_finite_differences() -> None:
    resolved = mechanism(mbs.loads(SWINGING))
    every = replace(resolved, rows=tuple(resolved.one_way[0].rows))
    begin = start(resolved)
    rng = np.random.default_rng(3)

    def slip(q: np.ndarray, u: np.ndarray) -> tuple:
        found = row_motions(motion_of(every, state_of(every, float, 0.0, q.tolist(), u.tolist(), begin.parameters)))
        return found[1]

    for _ in range(4):
        q, u = np.array(begin.q) + rng.uniform(-0.2, 0.2, len(begin.q)), rng.uniform(-1, 1, len(begin.u))
        rate, h, here = np.array(coordinate_rates(every, q.tolist(), u.tolist())), 1e-5, slip(q, u)
        change = (slip(q + h * rate, u).phidot - slip(q - h * rate, u).phidot) / (2 * h)
        assert here.phidot == pytest.approx(float(np.dot(here.jacobian, u)), abs=1e-12)
        assert here.gamma == pytest.approx(-change, abs=1e-8)
        assert here.phi is None


def test_the_wrap_is_that_of_the_present_position() -> None:
    """A load at (-1, 0.5) draws the rope aside; the tangent's angle by hand from the triangle with the radius."""
    acting = in_mode(mechanism(mbs.loads(SWINGING)), Mode({"string": 1}, {"drum": 1}))
    begin = start(acting)
    q = list(begin.q)
    q[1:3] = [-2.0, 1.0]
    state = state_of(acting, float, 0.0, q, [0.0] * len(begin.u), begin.parameters)
    found = forward_dynamics(FORMALISMS["composite_body"](acting, state))
    at = StateQuantities(motion_of(acting, state), found.udot.tolist(), found.multipliers.tolist())
    d = math.hypot(2.0, 2.0)
    heading = math.atan2(2.0, 2.0) + math.asin(0.1 / d)  # up and to the right, the wheel's centre on the right
    wrap = heading + math.pi / 2  # clockwise down to -90 deg
    assert at.tensions["string.2"] / at.tensions["string.1"] == pytest.approx(math.exp(0.2 * wrap), rel=1e-12)


@pytest.mark.parametrize(
    ("rough", "message"),
    [("-0.1", "negative"), ("{static: 0.1, kinetic: 0.2}", "static 0.1 is below kinetic 0.2"), ("{}", "give static")],
)
def test_roughness_that_nothing_has_is_told(rough: str, message: str) -> None:
    with pytest.raises(mbs.ModelError, match=message):
        mbs.loads(CAPSTAN.replace("rough: mu", f"rough: {rough}"))
