"""Impacts at the given instant: impulses, jumps and impulses in joints, in numbers and in closed form."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import sympy
from impact_models import CHAIN, TWO_BALLS, impact_of

import multibody_sym as mbs
from multibody_sym.documents.document import worked_document, write_document
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.values import Value


def test_a_particle_on_a_chain_keeps_momentum_energy_and_the_impulses_of_each_rod() -> None:
    told = impact_of(CHAIN)
    (impulse,) = (parts["normal"].value for parts in told.impulses.values())
    assert told.opening["impact"].value == pytest.approx(told.closing["impact"].value, rel=1e-13)
    assert told.energy_lost.value == pytest.approx(0, abs=1e-14)
    n = np.array([np.sin(0.3 * np.pi), np.cos(0.3 * np.pi)])
    omega = np.cumsum([told.after[f"u_h{k}"].value for k in (1, 2, 3, 4)])
    angles = -np.pi / 10 * np.array([1, 2, 3, 4])
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    across = np.column_stack([-np.sin(angles), np.cos(angles)])
    joints = []
    for k in range(4):  # components are along the axes of the rod before
        x, y = (told.joint_impulses[f"h{k + 1}"][c].value for c in ("fx", "fy"))
        before = angles[k] + np.pi / 10
        joints.append(np.array([x * np.cos(before) - y * np.sin(before), x * np.sin(before) + y * np.cos(before)]))
    moving = np.zeros(2)
    for k in range(4):  # each rod by itself: momentum, and angular momentum about its middle
        middle = moving + omega[k] * across[k] / 2
        struck = -impulse * n if k == 2 else np.zeros(2)
        beyond = -joints[k + 1] if k < 3 else np.zeros(2)
        assert joints[k] + beyond + struck == pytest.approx(middle, abs=1e-13)
        arm, force = along[k] / 2, beyond - joints[k]
        assert arm[0] * force[1] - arm[1] * force[0] == pytest.approx(omega[k] / 12, abs=1e-13)
        moving = moving + omega[k] * across[k]


def test_the_json_has_the_words_of_the_contract() -> None:
    told = json.loads(json.dumps(mbs.solve(mbs.loads(TWO_BALLS)).as_json()))["impact"]
    wanted = {"law", "sequence", "impulses", "jumps", "after", "joint_impulses", "apparent_mass", "energy_lost"}
    wanted |= {"lost_by", "closing", "opening", "instantaneous_centres", "centre_of_percussion", "notes"}
    assert wanted <= set(told)
    assert told["law"] == "newton"
    assert told["impulses"]["impact"]["normal"]["value"] == pytest.approx(5.4)
    assert told["impulses"]["impact"]["state"] == "bounces"
    assert set(told["joint_impulses"]["A"]) == {"fx", "fy", "fz", "mx", "my", "mz"}


def test_in_python_as_in_a_file() -> None:
    system = mbs.loads(TWO_BALLS)
    again = mbs.System(
        "two balls on a line",
        parameters=system.parameters,
        bodies=system.bodies,
        joints=system.joints,
        impact=mbs.Impact(between=["a", "b"], normal="-x", restitution="e"),
    )
    assert again == system
    assert mbs.loads(mbs.dumps(again)) == again


CRADLE = """
multibody_sym: 1
name: Newton's cradle
parameters: {m: {value: 1 kg, positive: true}, v: {value: 2 m/s, positive: true}, e: 1}
bodies: {b1: {mass: m}, b2: {mass: m}, b3: {mass: m}, b4: {mass: m}, b5: {mass: m}}
joints:
  J1: {type: prismatic, parent: ground, child: b1, axis: x, q: x1, initial: {u: v}}
  J2: {type: prismatic, parent: ground, child: b2, axis: x, q: x2}
  J3: {type: prismatic, parent: ground, child: b3, axis: x, q: x3}
  J4: {type: prismatic, parent: ground, child: b4, axis: x, q: x4}
  J5: {type: prismatic, parent: ground, child: b5, axis: x, q: x5}
impact:
  c1: {between: [b2, b1], normal: x, restitution: e}
  c2: {between: [b3, b2], normal: x, restitution: e}
  c3: {between: [b4, b3], normal: x, restitution: e}
  c4: {between: [b5, b4], normal: x, restitution: e}
"""


def test_many_impacts_one_after_the_other_have_formulas_that_are_their_numbers() -> None:
    told = impact_of(CRADLE.replace("e: 1}", "e: 0.5}"))
    assert len(told.steps) == 10
    formula = told.impulses["c1"]["normal"].expression
    assert evaluate_float([formula], {symbol("m"): 1, symbol("v"): 2, symbol("e"): 0.5})[0] == pytest.approx(
        sum(step.impulses.get("c1", 0) for step in told.steps), rel=1e-13
    )


def test_the_steps_lead_from_momentum_and_restitution_to_the_result() -> None:
    worked = mbs.solve(mbs.loads(TWO_BALLS), steps=True).steps
    assert worked is not None
    lines = write_document(worked_document(worked), "text").splitlines()
    assert "    (1) along x1: m1*D(u_x1) = -p" in lines
    assert "    (2) along x2: m2*D(u_x2) = p" in lines
    assert "    (3) impact: D(u_x2) - D(u_x1) = (v1 - v2)*(1 + e)" in lines
    assert "    so: D(u_x2) = m1*(v1 - v2)*(1 + e)/(m1 + m2)" in lines
    lettered = [line for line in worked.formulas if line.tag is not None]
    named = {worked.notation.text(s): s for line in lettered for side in line.sides for s in side.free_symbols}
    m1, m2, v1, v2, e, p, a, b = (named[x] for x in ("m1", "m2", "v1", "v2", "e", "p", "D(u_x1)", "D(u_x2)"))
    equations = [line.sides[0] - line.sides[1] for line in lettered]
    (solution,) = sympy.solve(equations, [p, a, b], dict=True)
    assert sympy.simplify(solution[p] - (1 + e) * m1 * m2 * (v1 - v2) / (m1 + m2)) == 0
    assert r"\Delta u_{\mathrm{x1}}" in write_document(worked_document(worked), "latex")


def test_all_formulas_of_an_impact_take_one_form_of_each_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that it tells, and answers: here each gets the same one instead, in its place."""
    one = parse("sqrt(q)")

    def shared(values: Sequence[Value], letters: object) -> list[Value]:
        return [replace(x, expression=one) for x in values]

    plain = mbs.solve(mbs.loads(TWO_BALLS + "ask: {p: m1*u_x1 + m2*u_x2}\n"))
    monkeypatch.setattr("multibody_sym.answers.solve.values_with_shared_roots", shared)
    told = mbs.solve(mbs.loads(TWO_BALLS + "ask: {p: m1*u_x1 + m2*u_x2}\n"))
    assert plain.impact is not None
    assert told.impact is not None
    assert [x.value for x in told.impact.values] == [x.value for x in plain.impact.values]
    assert {x.expression for x in (*told.impact.values, *told.answers.values())} == {one}
    assert told.impact.after["u_x1"].value == plain.impact.after["u_x1"].value
    assert told.answers["p"].value == pytest.approx(11.0)
