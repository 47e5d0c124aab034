"""Equations of bodies with friction in a given mode, and the test that rejects wrongly assumed directions."""

from __future__ import annotations

import math
import re

import pytest
from test_worked_steps import steps, verify

import multibody_sym as mbs
from multibody_sym.answers.worked.alternatives import Refuted, refuted_assumptions
from multibody_sym.answers.worked.equations import Equations, in_sympy
from multibody_sym.derivation.symbolic_start import declared_state
from multibody_sym.documents.document import worked_document, write_document
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode

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
    declared = check_numbers(mbs.loads(model))
    mechanism = in_mode(declared, mode)
    return Equations(mechanism, declared_state(mechanism, start(declared)), plane=True)


def result(found: Equations, name: str) -> float:
    """Return the acceleration of a coordinate's speed."""
    places = {speed.name: k for k, speed in enumerate(found.mechanism.speeds)}
    symbol = found.symbols.accelerations[places[name]]
    return float(found.elimination.results[symbol].rest.sample)


def wrong(model: str, mode: Mode) -> list[Refuted]:
    return list(refuted_assumptions(equations(model, mode)))


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
    assert str(in_sympy(up.equations.exactly, up.left)) == "u_s_rate"
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


# --- the state that solve finds --------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [TABLE, TABLE.replace("mu: 0.2", "mu: 0.8"), INCLINE, RIDGE])
def test_printed_equations_hold_with_friction(model: str) -> None:
    verify(steps(mbs.loads(model)))


def test_steps_of_a_block_on_an_incline_reject_the_direction_that_a_book_assumed() -> None:
    text = write_document(worked_document(steps(mbs.loads(INCLINE))), "text")
    assert "F: friction of rub, along (cos(alpha), sin(alpha))" in text
    assert "(1) along s: m1*s'' = T - m1*g*sin(alpha) + F" in text
    assert "(5) rub: F = mu*N" in text
    rejected = text.partition("Other assumption 1\n")[2]
    assert rejected.startswith("    Assume that rub slides so that s grows")
    assert "m1*sin(alpha))/(m1 + m2) = -0.327494 m/s^2\n    and not > 0" in rejected
    assert "abs(F) = g*(m1*sin(alpha) - m2) = 2.42641 N" in rejected
    assert "mu*abs(N) = m1*g*mu*cos(alpha) = 0.848528 N" in rejected


def test_friction_has_the_number_of_its_normal_force() -> None:
    text = write_document(worked_document(steps(mbs.loads(RIDGE))), "text")
    assert "c1: F1 = mu*N1" in text
    assert "c2: F2 = mu*N2" in text


JOURNAL = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m: 2 kg, l: 0.5 m, r: 1 cm, mu: 0.3}
bodies: {rod: {shape: {rod: l, mass: m}}}
joints: {hinge: {type: revolute, parent: ground, child: rod, axis: z, q: phi, initial: {q: 20 deg, u: 3}}}
forces: {rub: {type: friction, joint: hinge, kinetic: mu, radius: r}}
"""
)


def test_a_journal_rubs_by_the_length_of_its_reaction() -> None:
    worked = steps(mbs.loads(JOURNAL))
    verify(worked)
    text = write_document(worked_document(worked), "text")
    assert "rub: M = r*mu*sqrt(R_hinge_x^2 + R_hinge_y^2)" in text
    assert re.search(r"M = 0\.0156\d* N\*m", text)
    at_rest = write_document(worked_document(steps(mbs.loads(JOURNAL.replace("q: 20 deg, u: 3", "q: 0")))), "text")
    assert "rub: M = r*mu*R_hinge_y" in at_rest


PADS = (
    HEAD
    + """
parameters: {l: 0.4 m, d: 0.3 m, F: 10 N, mu: 0.5, g: 10}
bodies: {drawer: {mass: 3 kg, points: {knob: [0, -d, 0]}}}
joints: {guide: {type: prismatic, parent: ground, child: drawer, axis: x, q: s}}
forces:
  pull: {type: force, on: drawer, at: knob, value: [F, 30 N, 0]}
  rub: {type: friction, joint: guide, kinetic: mu, length: l}
"""
)


def test_pads_press_by_force_and_moment() -> None:
    worked = steps(mbs.loads(PADS))
    verify(worked)
    laws = next(step for step in worked.steps if step.title == "Laws of forces")
    assert len(laws.lines) == 3


HEAVY = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m1: 1 kg, m2: 2 kg, M: 4 kg, R: 0.1 m}
bodies:
  ground: {points: {axle: [0, 2 m, 0], left: [-R, 0, 0], right: [R, 0, 0]}}
  wheel: {shape: {disc: R, mass: M}}
  left: {mass: m1}
  right: {mass: m2}
joints:
  axle: {type: revolute, parent: ground.axle, child: wheel, axis: z, q: phi}
  line1: {type: prismatic, parent: ground.left, child: left, axis: y, q: y1}
  line2: {type: prismatic, parent: ground.right, child: right, axis: y, q: y2}
pulleys: {pulley: {body: wheel, radius: R}}
constraints: {string: {type: rope, path: [left, pulley, right]}}
"""
)


def test_a_wheel_with_mass_has_two_tensions() -> None:
    worked = steps(mbs.loads(HEAVY))
    verify(worked)
    text = write_document(worked_document(worked), "text")
    assert "up: 0 = R_axle_y - M*g - T1 - T2" in text
    assert "moments about axle: M*R^2*phi''/2 = R*T1 - R*T2" in text
    assert "R_axle_y = (3*M*(m1 + m2) + 8*m1*m2 + M^2)*g/(2*m1 + 2*m2 + M) = 68 N" in text


PUCK = (
    HEAD.replace("[0, -g, 0]", "[0, 0, -g]")
    + """
parameters: {g: 10 m/s^2, m: 2 kg, mu: 0.3}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}, puck: {mass: m}}
joints: {p: {type: point, axes: xyz, parent: ground, child: puck, q: [x, y, z], initial: {u: [3, 4, 0]}}}
contacts: {c: {between: [puck, ground.floor], kinetic: mu}}
"""
)


def test_friction_in_space_is_against_the_velocity() -> None:
    worked = steps(mbs.loads(PUCK))
    verify(worked)
    text = write_document(worked_document(worked), "text")
    assert "F: friction at c, along (-3/5, -4/5, 0)" in text
    assert "x'' = -3*g*mu/5 = -1.8 m/s^2" in text
    pushed = PUCK.replace(", initial: {u: [3, 4, 0]}", "") + "forces: {F: {type: force, on: puck, value: [6, 8, 0]}}\n"
    worked = steps(mbs.loads(pushed))
    verify(worked)
    assert "in the direction of slip: d1 = 0.6\n" in write_document(worked_document(worked), "text")


WHEEL = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m: 2 kg, mu: 0.5, R: 0.1 m, f: 0.001 m, a: 20 deg}
bodies:
  ground:
    frames: {slope: {rotate: [{axis: z, angle: -a}]}}
    surfaces: {s: {plane: [0, 0, 0], normal: [sin(a), cos(a), 0]}}
  wheel: {mass: m, inertia: {Izz: m*R^2/2}, surfaces: {rim: {disc: R, axis: z}}}
joints: {w: {type: planar, parent: ground.slope, child: wheel, q: [x, y, phi], initial: {q: [0, R, 0]}}}
contacts: {c: {between: [wheel.rim, ground.s], static: mu, rolling_resistance: f}}
"""
)


def test_rolling_resistance_is_a_moment() -> None:
    worked = steps(mbs.loads(WHEEL))
    verify(worked)
    text = write_document(worked_document(worked), "text")
    assert "M = f*N" in text
    assert re.search(r"M = .* = 0\.0187939 N\*m", text)
    assert "Assume that c.rolling slides backward" in text


STOP = (
    HEAD
    + """
parameters: {g: 10 m/s^2, m: 2 kg, F: 5 N}
bodies: {a: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: a, axis: x, q: x, limits: {lower: 0, upper: 1}}}
forces: {push: {type: force, on: a, value: [-F, 0, 0]}}
"""
)


def test_a_stop_pushes_back() -> None:
    worked = steps(mbs.loads(STOP))
    verify(worked)
    assert "N2: force of stop j.lower, to the right" in write_document(worked_document(worked), "text")
