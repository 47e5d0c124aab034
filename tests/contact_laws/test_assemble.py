"""The problem of one-way laws of a mechanism in motion, and the mode of what is found."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym import loads
from multibody_sym.contact_laws.problem import Equality, FrictionRow, LawMode, LawState, Unilateral
from multibody_sym.dynamics.contact.contact_problem import one_way_rows
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism

MODEL = """\
multibody_sym: 1
name: s
gravity: [0, -9.81, 0]
bodies: {a: {mass: 2, inertia: {Izz: 1}}, b: {mass: 3}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {q: 1, u: 0}, limits: {upper: 1}}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {q: 2, u: 0}, limits: {lower: 1}}
forces:
  push: {type: force, on: a, value: [20, -3, 0]}
  rub: {type: friction, joint: A, static: 0.3, kinetic: 0.2}
"""


def rows_of(text: str):
    resolved = mechanism(loads(text))
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    return one_way_rows(resolved, motion_of(resolved, state))


def test_gaps_and_speeds_tell_how_things_stand() -> None:
    for changed, standing in (
        ({}, "touching"),
        ({"u: 0": "u: 1"}, "closing"),
        ({"u: 0": "u: -1"}, "leaving"),
        ({"q: 1,": "q: 1.001,"}, "inside"),
        ({"q: 1,": "q: 0.999,"}, "open"),
        ({"q: 1,": "q: 1.0000000001,"}, "touching"),
    ):
        text = MODEL
        for old, new in changed.items():
            text = text.replace(old, new, 1)
        rows = rows_of(text)
        assert rows.standing(rows.mechanism.one_way[0]) == standing


def test_the_problem_has_what_touches_and_friction_in_joints() -> None:
    rows = rows_of(MODEL)
    found = rows.posed(["A.upper"])
    assert found.names == ("A.upper", "rub.normal", "rub.friction")
    problem = found.problem
    assert problem.laws == (Unilateral(), Equality(), FrictionRow(0, 0))
    # a = A x + D z - r with x = sqrt(2) (udot - 10), and C^T z = x where the stop and friction push
    root = np.sqrt(2)
    assert problem.matrix == pytest.approx(np.array([[-1 / root, 0], [0, 0], [1 / root, 0]]), rel=1e-15)
    assert problem.exerted == pytest.approx(problem.matrix)
    assert problem.coupling == pytest.approx(np.diag([0, -1, 0]))
    assert problem.right == pytest.approx([10, -(2 * 9.81 + 3), -10], rel=1e-14)  # gamma - H udot_free
    (part,) = problem.parts
    assert (part.rows, part.normals, part.static, part.kinetic, part.velocity) == ((2,), (1,), 0.3, 0.2, (0.0,))


def test_what_moves_slides_by_its_velocity() -> None:
    assert rows_of(MODEL.replace("q: 1, u: 0", "q: 0, u: -2")).posed([]).problem.parts[0].velocity == (-2.0,)


def test_a_state_is_told_as_a_mode_and_back() -> None:
    found = rows_of(MODEL).posed(["A.upper"])
    for sides, slip in (((1, 1, 1), 0), ((1, -1, 0), -1), ((0, 1, 0), 1)):
        law = LawMode(sides, (slip,), (None,))
        mode = found.mode(LawState(law, np.zeros(2), np.zeros(3), np.zeros(3)))
        assert found.law_mode(mode) == law
        assert mode.sides["B.lower"] == 0
    assert mode == Mode({"A.upper": 0, "B.lower": 0, "rub": 1}, {"rub": 1}, {})
