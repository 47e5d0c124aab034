"""Declared contacts in given modes: accelerations and forces that textbooks print."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from solved_starts import solved_start

import multibody_sym as mbs
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode, mode_words
from multibody_sym.mechanics.resolve import mechanism

G = 10.0


def solved(text: str, sides: Mapping[str, int], slips: Mapping[str, int]) -> dict[str, float]:
    """Return udot by speeds' names and multipliers by rows' names in a mode."""
    whole = mechanism(mbs.loads(f"multibody_sym: 1\nname: m\ngravity: [0, -10, 0]\n{text}"))
    chosen, begin = in_mode(whole, Mode(sides, slips)), start(whole)
    known = dict(zip((entry.name for entry in whole.parameters), begin.parameters, strict=True))
    pairs = zip(chosen.parameters, parameter_values(chosen, {}), strict=True)
    values = tuple(known.get(entry.name, x) for entry, x in pairs)
    found = solved_start(chosen, replace(begin, parameters=values))
    names = [*(s.name for s in chosen.speeds), *(row.name for row in chosen.rows)]
    return dict(zip(names, [*found.udot, *found.multipliers], strict=True))


RAMP = """\
parameters: {a: 0.5, mu: 0.2}
bodies: {ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}, block: {mass: 2}}
joints: {J: {type: point, parent: ground, child: block, initial: {u: [-2*cos(a), -2*sin(a)]}}}
contacts: {c: {between: [block, ground.ramp], static: mu}}
"""


def test_a_block_slides_down_a_ramp() -> None:
    found = solved(RAMP, {"c": 1}, {"c": -1})
    down = G * (math.sin(0.5) - 0.2 * math.cos(0.5))
    assert found["u_J_x"] == pytest.approx(-down * math.cos(0.5), rel=1e-13)
    assert found["u_J_y"] == pytest.approx(-down * math.sin(0.5), rel=1e-13)
    assert found["c.normal"] == pytest.approx(2 * G * math.cos(0.5), rel=1e-13)


def test_a_block_that_sticks_is_held_uphill() -> None:
    found = solved(RAMP.replace("initial: {u: [-2*cos(a), -2*sin(a)]}", ""), {"c": 1}, {})
    assert found["c.friction"] == pytest.approx(2 * G * math.sin(0.5), rel=1e-13)
    assert found["u_J_x"] == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("between", ["block, wedge.face", "wedge.face, block"])
def test_a_wedge_moves_under_a_smooth_block(between: str) -> None:
    """The wedge's acceleration is m g sin cos / (M + m sin^2)."""
    text = f"""\
parameters: {{a: 0.6, m: 2, M: 5}}
bodies:
  wedge: {{mass: M, surfaces: {{face: {{plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}}}
  block: {{mass: m}}
joints:
  W: {{type: prismatic, parent: ground, child: wedge, axis: x, q: s}}
  J: {{type: point, parent: ground, child: block}}
contacts: {{c: {{between: [{between}]}}}}
"""
    sine, cosine = math.sin(0.6), math.cos(0.6)
    found = solved(text, {"c": 1}, {})
    assert found["u_s"] == pytest.approx(2 * G * sine * cosine / (5 + 2 * sine**2), rel=1e-12)
    assert found["c.normal"] == pytest.approx(2 * 5 * G * cosine / (5 + 2 * sine**2), rel=1e-12)


def test_a_disc_rolls_down_a_ramp_against_its_resistance() -> None:
    """m a = m g sin - F, J a / r = F r - f N: a = (g sin - f g cos / r) / (1 + 1/2)."""
    text = """\
parameters: {a: 0.3, r: 0.5, f: 0.01}
bodies:
  ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  disc: {shape: {disc: r, mass: 4}}
joints:
  J:
    type: planar
    parent: ground
    child: disc
    initial: {q: [-r*sin(a), r*cos(a), 0], u: [-r*cos(a), -r*sin(a), 1]}
contacts: {c: {between: [disc, ground.ramp], static: 0.5, rolling_resistance: f}}
"""
    found = solved(text, {"c": 1}, {"c": 0, "c.rolling": -1})
    a = (G * math.sin(0.3) - 0.01 * G * math.cos(0.3) / 0.5) / 1.5
    assert found["u_J_theta"] == pytest.approx(a / 0.5, rel=1e-12)
    assert found["u_J_x"] == pytest.approx(-a * math.cos(0.3), rel=1e-12)
    assert found["c.normal"] == pytest.approx(4 * G * math.cos(0.3), rel=1e-12)
    assert found["c.friction"] == pytest.approx(4 * (G * math.sin(0.3) - a), rel=1e-12)


@pytest.mark.parametrize("between", ["ball, bowl.in", "bowl.in, ball"])
def test_a_ball_slides_without_friction_in_a_bowl(between: str) -> None:
    """It moves as a pendulum of length R - r: N = m g cos + m v^2/(R - r)."""
    text = f"""\
bodies:
  bowl: {{mass: 1, surfaces: {{in: {{disc: 2, inside: true}}}}}}
  ball: {{shape: {{sphere: 0.5, mass: 3}}}}
joints:
  B: {{type: fixed, parent: ground, child: bowl}}
  J:
    type: planar
    parent: ground
    child: ball
    initial: {{q: [1.5*sin(0.4), -1.5*cos(0.4), 0], u: [1.2*cos(0.4), 1.2*sin(0.4), 0]}}
contacts: {{c: {{between: [{between}]}}}}
"""
    found = solved(text, {"c": 1}, {})
    tangential = np.array([found["u_J_x"], found["u_J_y"]]) @ [math.cos(0.4), math.sin(0.4)]
    assert tangential == pytest.approx(-G * math.sin(0.4), rel=1e-12)
    assert found["c.normal"] == pytest.approx(3 * G * math.cos(0.4) + 3 * 1.2**2 / 1.5, rel=1e-12)
    assert found["u_J_theta"] == pytest.approx(0.0, abs=1e-12)


def test_a_disc_rolls_off_a_fixed_disc() -> None:
    """Rolling without slip on a cylinder: theta'' = 2 g sin(theta) / (3 (R + r)), N = m g cos - m (R + r) theta'^2."""
    text = """\
bodies:
  ground: {surfaces: {drum: {disc: 1.5}}}
  disc: {shape: {disc: 0.5, mass: 3}}
joints:
  J:
    type: planar
    parent: ground
    child: disc
    initial: {q: [2*sin(0.2), 2*cos(0.2), 0], u: [cos(0.2), -sin(0.2), -2]}
contacts: {c: {between: [disc, ground.drum], static: 0.9}}
"""
    found = solved(text, {"c": 1}, {})
    assert -found["u_J_theta"] * 0.5 / 2 == pytest.approx(2 * G * math.sin(0.2) / (3 * 2), rel=1e-12)
    assert found["c.normal"] == pytest.approx(3 * G * math.cos(0.2) - 3 * 2 * 0.5**2, rel=1e-12)
    assert found["c.friction"] == pytest.approx(-3 * G * math.sin(0.2) / 3, rel=1e-12)  # t leads down, friction up


def test_a_ladder_slides_down_a_smooth_wall() -> None:
    """theta'' = -(3 g / 2 l) cos(theta), theta from the floor, as long as it leans."""
    text = """\
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  ladder: {shape: {rod: 4, mass: 6}}
joints: {J: {type: planar, parent: ground, child: ladder, initial: {q: [4*cos(1), 0, pi - 1]}}}
contacts: {f: {between: [ladder, ground.floor]}, w: {between: [ladder, ground.wall]}}
"""
    found = solved(text, {"f.end1": 1, "w.end2": 1}, {})
    assert found["u_J_theta"] == pytest.approx(3 * G / 8 * math.cos(1), rel=1e-12)
    assert found["f.end1.normal"] == pytest.approx(60 * (1 - 0.75 * math.cos(1) ** 2), rel=1e-12)


def test_a_ball_slides_in_space_against_its_velocity() -> None:
    """A ball on a floor that slides along (3, 4, 0): friction opposes it, and turns the ball: J w' = mu m g r."""
    text = """\
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, ball: {shape: {sphere: 0.5, mass: 2}}}
joints: {J: {type: free, parent: ground, child: ball, initial: {q: [0, 0.5, 0, 1, 0, 0, 0], u: [3, 0, 4, 0, 0, 0]}}}
contacts: {c: {between: [ball, ground.floor], static: 0.3}}
"""
    found = solved(text, {"c": 1}, {"c": 2})
    assert [found[f"u_J_{x}"] for x in "xyz"] == pytest.approx([-0.3 * G * 0.6, 0, -0.3 * G * 0.8], abs=1e-13)
    turning = 0.3 * 2 * G * 0.5 / (0.4 * 2 * 0.25)
    assert [found[f"J_w{x}"] for x in "xyz"] == pytest.approx([turning * 0.8, 0, -turning * 0.6], abs=1e-12)


TABLE = """\
bodies:
  table: {{mass: 3, inertia: {{Ixx: 2, Iyy: 2, Izz: 2}}, surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}
  p: {{mass: 2}}
joints:
  hinge: {{type: revolute, parent: ground, child: table, axis: y, q: phi, initial: {{q: {turn}}}}}
  ride: {{type: point, axes: xyz, parent: ground, child: p, initial: {{q: [0.3, 0, 0.1]}}}}
forces: {{push: {{type: force, on: p, value: [3, 0, 1]}}}}
contacts: {{c: {{between: [{between}], static: 0.9}}}}
"""


@pytest.mark.parametrize(("between", "sense"), [("p, table.top", 1), ("table.top, p", -1)])
def test_tangents_in_space_start_along_ground(between: str, sense: int) -> None:
    """Friction on a turned table has the components that it has on one that is not; on the other body, the opposite."""
    found, other = (solved(TABLE.format(turn=turn, between=between), {"c": 1}, {}) for turn in (0.0, 0.8))
    for row in ("c.normal", "c.friction1", "c.friction2"):
        assert other[row] == pytest.approx(found[row], rel=1e-12)
    held = solved(TABLE.format(turn=0.8, between=between).replace("type: revolute", "type: fixed").replace(
        ", axis: y, q: phi, initial: {q: 0.8}", ""), {"c": 1}, {})
    assert held["c.friction1"] == pytest.approx(-3.0 * sense, rel=1e-12)  # along x; t2 = n x t1 is -z
    assert held["c.friction2"] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("surface", ["disc: 1.5", "sphere: 1.5"])
def test_a_disc_that_rolls_on_a_disc_never_slips(surface: str) -> None:
    """The constraint says what the contact that sticks does, as long as it presses."""
    text = f"""\
bodies:
  ground: {{surfaces: {{drum: {{{surface}}}}}}}
  disc: {{shape: {{disc: 0.5, mass: 3}}}}
joints:
  J:
    type: planar
    parent: ground
    child: disc
    initial: {{q: [2*sin(0.2), 2*cos(0.2), 0], u: [cos(0.2), -sin(0.2), -2]}}
constraints: {{roll: {{type: rolling, body: disc, on: ground.drum}}}}
"""
    found = solved(text, {}, {})
    assert -found["u_J_theta"] * 0.5 / 2 == pytest.approx(2 * G * math.sin(0.2) / (3 * 2), rel=1e-12)
    assert found["roll.n"] == pytest.approx(3 * G * math.cos(0.2) - 3 * 2 * 0.5**2, rel=1e-12)
    assert found["roll.t1"] == pytest.approx(-3 * G * math.sin(0.2) / 3, rel=1e-12)


def test_a_ball_rolls_in_a_bowl() -> None:
    """It swings as a pendulum: 7/5 (R - r) theta'' = -g sin(theta), and the energy stays."""
    text = """\
multibody_sym: 1
name: bowl
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {bowl: {sphere: 2, inside: true}}}
  ball: {shape: {sphere: 0.5, mass: 3}}
joints: {J: {type: free, parent: ground, child: ball, initial: {q: [1.5*sin(0.4), -1.5*cos(0.4), 0, 1, 0, 0, 0]}}}
constraints: {roll: {type: rolling, body: ball, on: ground.bowl}}
simulation: {t_end: 0.5, rtol: 1e-10, atol: 1e-12, samples: 3}
"""
    system = mbs.loads(text)
    begun = mbs.solve(system).accelerations
    along = begun["J_x"].value * math.cos(0.4) + begun["J_y"].value * math.sin(0.4)
    assert along == pytest.approx(-5 / 7 * G * math.sin(0.4), rel=1e-10)
    run = mbs.simulate(system)
    assert np.ptp(run.energy) < 1e-8
    assert np.hypot(run["J_x"], run["J_y"]) == pytest.approx(1.5, abs=1e-9)


@pytest.mark.parametrize(
    ("roll", "message"),
    [
        ("body: ground.floor, on: wheel", r"roll.body: ground.floor is a plane; a ball or a disc rolls"),
        ("body: block, on: ground.floor", r"roll.body: block is neither a ball nor a disc"),
        ("body: wheel, on: block", r"roll.on: block is neither a plane nor round"),
    ],
)
def test_what_does_not_roll(roll: str, message: str) -> None:
    text = f"""\
multibody_sym: 1
name: m
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  wheel: {{shape: {{disc: 1, mass: 1}}}}
  block: {{mass: 1}}
joints: {{J: {{type: planar, parent: ground, child: wheel}}, B: {{type: point, parent: ground, child: block}}}}
constraints: {{roll: {{type: rolling, {roll}}}}}
"""
    with pytest.raises(mbs.ModelError, match=message):
        mechanism(mbs.loads(text))


def test_rolling_that_may_slip_is_a_contact() -> None:
    text = """\
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, wheel: {shape: {disc: 0.5, mass: 4}}}
joints: {J: {type: planar, parent: ground, child: wheel, initial: {q: [0, 0.5, 0], u: [3, 0, 0]}}}
constraints: {roll: {type: rolling, body: wheel, on: ground.floor, static: 0.3, kinetic: 0.2}}
"""
    found = solved(text, {"roll": 1}, {"roll": 1})
    assert found["u_J_x"] == pytest.approx(-0.2 * G, rel=1e-12)
    assert found["u_J_theta"] == pytest.approx(-0.2 * 4 * G * 0.5 / (4 * 0.25 / 2), rel=1e-12)
    whole = mechanism(mbs.loads(f"multibody_sym: 1\nname: m\n{text}"))
    assert (whole.rows, whole.one_way[0].path) == ((), ("constraints", "roll"))
    for slip, word in ((0, "roll"), (1, "slip+"), (-1, "slip-")):
        assert mode_words(whole.one_way, Mode({"roll": 1}, {"roll": slip})) == {"roll": word}
    with pytest.raises(mbs.ModelError, match=r"roll.static: static 0.1 is below kinetic 0.2"):
        mbs.loads(f"multibody_sym: 1\nname: m\n{text.replace('static: 0.3', 'static: 0.1')}")
