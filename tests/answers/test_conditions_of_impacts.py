"""Conditions of impacts decide: where all hold formulas are what the laws give in numbers, elsewhere they are not."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np
import pytest
from impact_models import STRUCK, impact_of

import multibody_sym as mbs
from multibody_sym.answers.records import ImpactFound
from multibody_sym.dynamics.contact.impact_problem import struck_rows
from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.declared_impact import outcome, posed_impact
from multibody_sym.errors import InputError, NoSolutionError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.impacts import state_in_impact
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

SETS = 12
NEAR = 1e-6
"""Of its sides: a condition that is so near its limit is not asked."""


def decisions(model: str, ranges: Mapping[str, tuple[float, float]], sets: int = SETS) -> tuple[int, int]:
    """Return how many parameter sets fulfil all conditions, and how many do not: each decides, or it fails."""
    system = mbs.loads(STRUCK + model)
    told = mbs.solve(system).impact
    assert told is not None
    assert told.conditions, told.notes
    assert "a condition is too long" not in " ".join(told.notes)
    sticks = "sticks" in " ".join(told.states.values())  # its formulas do not know from which side it came to stick
    rng = np.random.default_rng(20)
    sides = [0, 0]
    for _ in range(sets):
        given = {name: float(rng.uniform(*ends)) for name, ends in ranges.items()}
        holds = all_hold(told.conditions, given)
        if holds is not None:
            same = is_same(told, system, given)
            assert same if holds else not same or sticks, (given, told.conditions, told.states)
            sides[holds] += 1
    return sides[1], sides[0]


def all_hold(conditions: tuple[str, ...], given: Mapping[str, float]) -> bool | None:
    """Return whether conditions hold; None where one is near its limit."""
    found = []
    for each in conditions:
        sides = [parse(side) for side in re.split("[<>]=?", each)]
        a, b = evaluate_float(sides, {symbol(k): x for k, x in given.items()})
        a, b = (b, a) if ">" in each else (a, b)
        if abs(b - a) <= NEAR * (abs(a) + abs(b)):
            return None
        found.append(b > a)
    return all(found)


def is_same(told: ImpactFound, system: mbs.System, given: Mapping[str, float]) -> bool:
    """Return whether formulas of the speeds after are what the laws give at other parameters."""
    try:
        posed = posed_impact(Overrides(dict(given)).of(system))
        there = outcome(posed)
    except (NoSolutionError, InputError):
        return False
    rows = struck_rows(posed.blow, there)
    state = state_in_impact(posed.blow.motion.state, rows.jumps)
    jumps = forward_dynamics(tree_dynamics_of(rows.mechanism, state)).udot
    formulas = [told.after[speed.name].expression for speed in posed.mechanism.speeds]
    assert None not in formulas
    values = evaluate_float(formulas, {symbol(k): x for k, x in given.items()})
    after = np.array(posed.begin.u) + jumps
    return bool(np.allclose(values, after, rtol=0, atol=1e-7 * np.abs(after).max()))


ROD = """
parameters: {u: U, v: {value: 3, positive: true}, e: {value: 0.5, positive: true}, mu: {value: 0.2, positive: true},
  a: {value: ANGLE, positive: true}}
bodies:
  rod: {mass: 1, inertia: {Izz: 1/12}, points: {tip: [-1/2, 0, 0]}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {P: {type: planar, parent: ground, child: rod, q: [x, y, th],
  initial: {q: [0, sin(a)/2, a], u: [u, -v, 0]}}}
contacts: {c: {between: [rod.tip, ground.floor], static: mu, kinetic: mu, restitution: e}}
impact: {contacts: c, law: LAW}
"""
WIDE = {"v": (0.5, 4.0), "e": (0.0, 1.0), "mu": (0.0, 2.0), "a": (0.2, 1.5)}


COURSES = [
    *((law, u, a) for law in ("newton", "poisson") for u, a in (("1.5", "1.05"), ("0.3", "0.6"))),
    *((law, u, a) for law in ("newton", "stronge") for u, a in (("-1.5", "1.05"), ("0.05", "1.4"))),
    ("poisson", "-0.3", "0.6"),
]


def of_a_rod(law: str, u: str, angle: str, sets: int) -> tuple[int, int]:
    model = ROD.replace("LAW", law).replace("U,", f"{u},").replace("ANGLE", angle)
    return decisions(model, {"u": (-2.0, 2.0), **WIDE}, sets)


@pytest.mark.parametrize(("law", "u", "angle"), [COURSES[0], COURSES[5], COURSES[8]])
def test_of_a_rod_that_strikes_a_rough_floor(law: str, u: str, angle: str) -> None:
    assert sum(of_a_rod(law, u, angle, SETS)) > SETS // 2


@pytest.mark.parametrize(("law", "u", "angle"), [COURSES[2], COURSES[1]])
def test_energy_that_slip_takes_which_turns_round_has_a_formula(law: str, u: str, angle: str) -> None:
    """At other parameters in the range of its conditions it is what the kinetic energies of an impact there say."""
    text = STRUCK + ROD.replace("LAW", law).replace("U,", f"{u},").replace("ANGLE", angle)
    told = impact_of(text)
    assert told.energy_lost.expression is not None, told.notes
    rng, ranges, held = np.random.default_rng(5), {"u": (0.1, 2.0), **WIDE}, 0
    while held < 3:
        given = {name: float(rng.uniform(*ends)) for name, ends in ranges.items()}
        if not all_hold(told.conditions, given):
            continue
        held += 1
        there = outcome(posed_impact(Overrides(given).of(mbs.loads(text))))
        value = evaluate_float([told.energy_lost.expression], {symbol(k): x for k, x in given.items()})[0]
        assert value == pytest.approx(float(np.nansum(there.lost)), rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize(("law", "u", "angle"), COURSES)
def test_of_a_rod_that_strikes_a_rough_floor_often(law: str, u: str, angle: str) -> None:
    within, beyond = of_a_rod(law, u, angle, 100)
    assert within > 0
    assert beyond > 10


def test_more_friction_than_lets_a_rod_slide_breaks_a_condition() -> None:
    """At 60 deg and mu = 1.5 the harder it is pressed the more it slips: 13 - 9 sqrt(3) mu < 0 there."""
    model = ROD.replace("LAW", "newton").replace("U,", "1.5,").replace("ANGLE", "60 deg")
    told = impact_of(STRUCK + model)
    given = {"u": 1.5, "v": 3.0, "e": 0.5, "mu": 0.2, "a": math.radians(60)}
    assert all_hold(told.conditions, given) is True
    assert all_hold(told.conditions, given | {"mu": 1.5}) is False


LINE = """
parameters: {m1: {value: 1, positive: true}, m2: {value: 1, positive: true}, m3: {value: 1, positive: true},
  v: {value: 2, positive: true}, w: 0, e: {value: E, positive: true}}
bodies: {a: {mass: m1}, b: {mass: m2}, c: {mass: m3}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x1, initial: {u: v}}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: x2}
  C: {type: prismatic, parent: ground, child: c, axis: x, q: x3, initial: {u: w}}
impact: {c1: {between: [b, a], normal: x, restitution: e}, c2: {between: [c, b], normal: x, restitution: e}, SEQUENCE}
"""
MASSES = {"m1": (0.1, 4.0), "m2": (0.1, 4.0), "m3": (0.1, 4.0), "v": (0.5, 3.0), "w": (-2.0, 1.0)}


def of_a_row(sequence: str, e: float, w: float, sets: int) -> tuple[int, int]:
    model = LINE.replace("E,", f"{e},").replace("w: 0", f"w: {w}").replace("SEQUENCE", f"sequence: {sequence}")
    return decisions(model, {**MASSES, "e": (0.2, 1.0)}, sets)


@pytest.mark.parametrize(("sequence", "e", "w"), [("one_by_one", 0.6, -1.0), ("simultaneous", 0.9, 0.4)])
def test_of_three_balls_in_a_row(sequence: str, e: float, w: float) -> None:
    assert sum(of_a_row(sequence, e, w, SETS)) > SETS // 2


@pytest.mark.long
@pytest.mark.parametrize("sequence", ["one_by_one", "simultaneous"])
@pytest.mark.parametrize(("e", "w"), [(1.0, 0.0), (0.5, 0.0), (0.9, 0.4), (0.6, -1.0)])
def test_of_three_balls_in_a_row_often(sequence: str, e: float, w: float) -> None:
    within, beyond = of_a_row(sequence, e, w, 100)
    assert within > 0
    assert beyond > 0
