"""Equations of bodies with friction in a given mode, and the test that rejects wrongly assumed directions."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.answers.symbolic_start import declared_state
from multibody_sym.answers.worked.alternatives import Refuted, refuted
from multibody_sym.answers.worked.equations import Equations
from multibody_sym.answers.worked.exactly import shown
from multibody_sym.dynamics.start.examined import examined
from multibody_sym.dynamics.start.start import start
from multibody_sym.model.mechanism.modes import in_mode
from multibody_sym.model.mechanism.one_way import Mode

HEAD = "multibody_sym: 1\nname: problem\ngravity: [0, -g, 0]\n"

TABLE = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m1: 6 kg, m2: 4 kg, mu: 0.2}
bodies:
  ground: {points: {edge: [3 m, 0, 0]}, surfaces: {table: {plane: [0, 0, 0], normal: y}}}
  block: {mass: m1}
  load: {mass: m2}
joints:
  b: {type: point, parent: ground, child: block, q: [x, y]}
  line: {type: prismatic, parent: ground.edge, child: load, axis: -y, q: depth, initial: {q: 1 m}}
contacts: {c1: {between: [block, ground.table], static: mu, kinetic: mu}}
constraints: {string: {type: rope, path: [block, pulley, load]}}
pulleys: {pulley: {at: ground.edge}}
"""
)

INCLINE = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m1: 6 kg, m2: 4 kg, alpha: 45 deg, mu: 0.02}
bodies:
  ground: {frames: {incline: {rotate: [{axis: z, angle: alpha}]}}}
  block: {mass: m1}
  load: {mass: m2}
joints:
  plane: {type: prismatic, parent: ground.incline, child: block, axis: x, q: s, initial: {q: -2 m}}
  line: {type: prismatic, parent: ground, child: load, axis: -y, q: depth, initial: {q: 1 m}}
forces: {rub: {type: friction, joint: plane, kinetic: mu}}
pulleys: {pulley: {at: ground}}
constraints: {string: {type: rope, path: [block, pulley, load]}}
"""
)

RIDGE = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m: 1 kg, mu: 0.1, alpha: 45 deg, beta: 30 deg}
bodies:
  ground:
    frames: {left: {rotate: [{axis: z, angle: alpha}]}, right: {rotate: [{axis: z, angle: -beta}]}}
    surfaces:
      steep: {plane: [0, 0, 0], normal: [-sin(alpha), cos(alpha), 0]}
      flat: {plane: [0, 0, 0], normal: [sin(beta), cos(beta), 0]}
  a: {mass: m}
  b: {mass: m}
joints:
  a: {type: point, parent: ground.left, child: a, q: [s1, n1], initial: {q: [-1 m, 0]}}
  b: {type: point, parent: ground.right, child: b, q: [s2, n2], initial: {q: [1 m, 0]}}
pulleys: {ridge: {at: ground}}
constraints: {string: {type: rope, path: [a, ridge, b]}}
contacts: {c1: {between: [a, ground.steep], kinetic: mu}, c2: {between: [b, ground.flat], kinetic: mu}}
"""
)


def equations(model: str, mode: Mode) -> Equations:
    """Return the equations of a model in a mode at its start."""
    declared = examined(mbs.loads(model))
    mechanism = in_mode(declared, mode)
    return Equations(mechanism, declared_state(mechanism, start(declared)), plane=True)


def result(found: Equations, name: str) -> float:
    """Return the acceleration of a coordinate's speed."""
    places = {speed.name: k for k, speed in enumerate(found.mechanism.speeds)}
    symbol = found.symbols.accelerations[places[name]]
    return float(found.elimination.results[symbol].rest.sample)


def wrong(model: str, mode: Mode) -> list[Refuted]:
    return list(refuted(equations(model, mode)))


def test_a_block_that_slides_has_friction_by_its_law() -> None:
    found = equations(TABLE, Mode({"c1": 1}, {"c1": 1}))
    (law,) = found.laws
    assert str(law.sides(found.exactly)[1]) == "lambda_c1_normal*mu"
    assert result(found, "u_x") == pytest.approx(2.8, rel=1e-14)
    (tension,) = (s for s in found.symbols.multipliers if "string" in s.name)
    assert float(found.elimination.results[tension].rest.sample) == pytest.approx(28.8, rel=1e-14)


def test_friction_of_a_guide_is_of_its_reaction() -> None:
    found = equations(INCLINE, Mode({"rub": 1}, {"rub": -1}))
    assert result(found, "u_s") == pytest.approx(-10 * (6 * 0.98 / math.sqrt(2) - 4) / 10, rel=1e-12)
    assert not any("rub" in s.name for e in found.all for s in e.form.terms if s in found.symbols.multipliers)


def test_the_wrong_direction_contradicts_itself() -> None:
    up, sticks = wrong(INCLINE, Mode({"rub": 1}, {"rub": -1}))
    assert up.slips == {"rub": 1}
    assert float(up.value.sample) == pytest.approx(4 - 6 * 1.02 / math.sqrt(2), rel=1e-12)  # -0.3275, not > 0
    assert str(shown(up.equations.exactly, up.left)) == "u_s_rate"
    assert sticks.limit is not None
    assert float(sticks.value.sample) == pytest.approx(60 / math.sqrt(2) - 40, rel=1e-12)
    assert float(sticks.limit.sample) == pytest.approx(0.02 * 60 / math.sqrt(2), rel=1e-12)


def test_what_sticks_slides_neither_way() -> None:
    right, left = wrong(TABLE.replace("mu: 0.2", "mu: 0.8"), Mode({"c1": 1}, {"c1": 0}))
    assert (right.slips, left.slips) == ({"c1": 1}, {"c1": -1})
    assert float(right.value.sample) == pytest.approx(-0.8, rel=1e-12)
    assert float(left.value.sample) == pytest.approx(8.8, rel=1e-12)


def test_two_blocks_slide_together_and_one_of_them_does_not_stick() -> None:
    back, sticks = wrong(RIDGE, Mode({"c1": 1, "c2": 1}, {"c1": -1, "c2": -1}))
    assert back.slips == {"c1": 1, "c2": 1}
    assert float(back.value.sample) == pytest.approx(5 * (0.5 - 1.1 / math.sqrt(2) - 0.05 * math.sqrt(3)), rel=1e-12)
    assert sticks.limit is not None
    assert float(sticks.value.sample) > float(sticks.limit.sample) == pytest.approx(1 / math.sqrt(2), rel=1e-12)


def test_a_state_that_is_wrong_is_not_confirmed() -> None:
    found = wrong(TABLE, Mode({"c1": 1}, {"c1": -1}))
    assert {tuple(each.slips.values()) for each in found} == {(0,)}
