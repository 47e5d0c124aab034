"""x(t) of coupled linear equations as formulas, by normal modes; speeds as formulas; words where there are none."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol

PAIR = """
multibody_sym: 1
name: pair
gravity: [g, 0, 0]
parameters: {g: 0 m/s^2, m: {value: 2 kg, positive: true}, M: {value: 3 kg, positive: true}, a: 0.1 m, v: 0.2 m/s,
  k: {value: 8 N/m, positive: true}, h: {value: 3 N/m, positive: true}}
bodies: {p: {mass: m}, q: {mass: MASS}}
joints:
  A: {type: prismatic, parent: ground, child: p, axis: x, q: x1, initial: {q: a}}
  B: {type: prismatic, parent: ground, child: q, axis: x, q: x2, initial: {u: v}}
forces: {WALLS c: {type: spring_damper, between: [p, q], stiffness: h}}
ask: {x1: {formula: x1}, x2: {formula: x2}, v2: {formula: u_x2}}
simulation: {t_end: 5 s}
"""
WALLS = "s: {type: spring_damper, joint: A, stiffness: k}, r: {type: spring_damper, joint: B, stiffness: k},"
VALUES = {"g": 9.81, "m": 2.0, "M": 3.0, "a": 0.1, "v": 0.2, "k": 8.0, "h": 3.0}


LATER = "ask: {late: {value: x1 - x2, after: T}, least: {min: x1 - x2}, pull: {max: h*(x2 - x1)}, "


def at(answer: Any, t: float, T: float = 0.7) -> float:
    assert answer.expression is not None
    values = {symbol(name): value for name, value in {**VALUES, "t": t, "T": T}.items()}
    return evaluate_float([answer.expression], values)[0]


def test_equal_masses_between_walls_beat() -> None:
    level = PAIR.replace("g: 0 m/s^2, ", "T: 0.7 s, ").replace("gravity: [g, 0, 0]", "").replace("ask: {", LATER)
    answers = mbs.solve(mbs.loads(level.replace("MASS", "m").replace("WALLS", WALLS))).answers
    w, W = sqrt(8 / 2), sqrt((8 + 2 * 3) / 2)
    for t in (0.0, 0.7, 4.1):
        slow, fast = 0.1 * cos(w * t) + 0.2 * sin(w * t) / w, 0.1 * cos(W * t) - 0.2 * sin(W * t) / W
        assert at(answers["x1"], t) == pytest.approx((slow + fast) / 2, abs=1e-15)
        assert at(answers["x2"], t) == pytest.approx((slow - fast) / 2, abs=1e-15)
        rates = 0.2 * cos(w * t) - 0.1 * w * sin(w * t), -0.2 * cos(W * t) - 0.1 * W * sin(W * t)
        assert at(answers["v2"], t) == pytest.approx((rates[0] - rates[1]) / 2, abs=1e-14)
        assert at(answers["late"], 0.0, T=t) == pytest.approx(fast, abs=1e-15)
    apart = sqrt(0.1**2 + (0.2 / W) ** 2)
    assert (at(answers["least"], 0.0), at(answers["pull"], 0.0)) == pytest.approx((-apart, apart * 3), rel=1e-14)
    assert [at(answers[x], 0.0) for x in ("least", "pull", "late")] == pytest.approx(
        [answers[x].value for x in ("least", "pull", "late")], rel=1e-8
    )


def test_two_masses_that_fall_while_they_swing() -> None:
    """The centre falls with g, and 1/m + 1/M is the mobility with which the distance swings."""
    answers = mbs.solve(mbs.loads(PAIR.replace("g: 0", "g: 9.81").replace("MASS", "M").replace("WALLS", ""))).answers
    w = sqrt(3 * (1 / 2 + 1 / 3))
    for t in (0.0, 0.7, 4.1):
        centre = (2 * 0.1 + 3 * 0.2 * t) / 5 + 9.81 * t**2 / 2
        apart = 0.1 * cos(w * t) - 0.2 * sin(w * t) / w
        assert at(answers["x1"], t) == pytest.approx(centre + 3 / 5 * apart, rel=1e-14)
        assert at(answers["x2"], t) == pytest.approx(centre - 2 / 5 * apart, rel=1e-14)


def test_where_there_is_no_formula_words_say_why() -> None:
    damped = WALLS.replace("joint: A, stiffness: k", "joint: A, stiffness: k, damping: 1 N*s/m")
    solution = mbs.solve(mbs.loads(PAIR.replace("MASS", "m").replace("WALLS", damped)))
    assert solution.answers["x1"].expression is None
    words = "its characteristic polynomial has a factor of degree 4 without known roots"
    assert any(words in each for each in solution.conditions)
    cubic = "k: {type: torque, joint: A, value: -x1^3*N_m3}, " + WALLS
    model = PAIR.replace("MASS", "m").replace("WALLS", cubic).replace("h: {", "N_m3: 1, h: {")
    solution = mbs.solve(mbs.loads(model))
    assert any("x'' = A x + B x' + f(t) with constant A and B" in each for each in solution.conditions)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("{formula: x1}", "{maximum: x1}", "did you mean max"),
        ("{formula: x1}", "frequency(1.5)", "name a mode by its number; 1 is the one with the lowest"),
        ("{formula: x1}", "{formula: u_x3}", "no coordinate or speed is called 'u_x3'; did you mean"),
        ("t_end: 5 s", "t_end: 0", "simulation.t_end: expected a positive number, got 0"),
        ("a: 0.1 m", "a: 1e-6 C", "'C' is not a unit here, where units are made of mass, length, time"),
    ],
)
def test_words_for_what_is_asked_wrongly(old: str, new: str, said: str) -> None:
    model = PAIR.replace("MASS", "m").replace("WALLS", "").replace(old, new)
    with pytest.raises(mbs.InputError, match=said):
        mbs.solve(mbs.loads(model))


def test_notes_name_the_answers_that_they_are_about() -> None:
    model = """
multibody_sym: 1
name: swinging
parameters: {m: {value: 2 kg, positive: true}, k: {value: 8 N/m, positive: true}}
bodies: {b: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 0.1}}}
forces: {s: {type: spring_damper, joint: j, stiffness: k}}
ask: {top: {max: u_x}, far: {of: b, after: 2 s}}
simulation: {t_end: 3 s}
"""
    assert any("given: far: a path has no formula" in note for note in mbs.solve(mbs.loads(model)).notes)
