"""x(t) in symbols: free fall, linear and quadratic drag, damped and driven oscillators, against solutions by hand."""

from __future__ import annotations

from math import atan, cos, cosh, exp, log, sin, sqrt

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

MODEL = """
multibody_sym: 1
name: formulas
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 2, c: 0.3, k: 50, F: 3, w: 2.5, kd: 0.4, v: 4, a: 0.1}
bodies: {b1: {mass: m}, b2: {mass: m}, b3: {mass: m}, b4: {mass: m}, b5: {mass: m}, b6: {mass: m}, b7: {mass: m}}
joints:
  j1: {type: prismatic, parent: ground, child: b1, axis: x, q: driven, initial: {q: a, u: v}}
  j2: {type: prismatic, parent: ground, child: b2, axis: y, q: braked, initial: {u: v}}
  j3: {type: prismatic, parent: ground, child: b3, axis: y, q: dropped}
  j4: {type: prismatic, parent: ground, child: b4, axis: x, q: swung, initial: {q: a}}
  j5: {type: prismatic, parent: ground, child: b5, axis: y, q: free, initial: {q: a, u: v}}
  j6: {type: prismatic, parent: ground, child: b6, axis: y, q: risen, initial: {u: v}}
  j7: {type: prismatic, parent: ground, child: b7, axis: x, q: bent, initial: {u: v}}
forces:
  s1: {type: spring_damper, joint: j1, stiffness: k, damping: c}
  d1: {type: torque, joint: j1, value: F*sin(w*t)}
  d2: {type: drag, on: b2, linear: c}
  d3: {type: drag, on: b3, quadratic: kd}
  s4: {type: spring_damper, joint: j4, stiffness: k}
  d6: {type: drag, on: b6, quadratic: kd}
  s7: {type: torque, joint: j7, value: -k*bent^3}
simulation: {t_end: 0.3 s}
ask: {driven: {formula: driven}, braked: {formula: braked}, dropped: {formula: dropped}, swung: {formula: swung},
  free: {formula: free}, risen: {formula: risen}, bent: {formula: bent}}
"""
G, M, C, K, F, W, KD, V, A = 9.81, 2, 0.3, 50, 3, 2.5, 0.4, 4, 0.1
SAMPLE = {"g": G, "m": M, "c": C, "k": K, "F": F, "w": W, "kd": KD, "v": V, "a": A}


@pytest.fixture(scope="module")
def solution() -> mbs.Solution:
    return mbs.solve(mbs.loads(MODEL))


def by_hand(name: str, t: float) -> float:
    omega, final = sqrt(K / M), sqrt(M * G / KD)
    decay = C / 2 / M
    turn = sqrt(K / M - decay**2)
    size = (K - M * W**2) ** 2 + (C * W) ** 2
    s, r = F * (K - M * W**2) / size, -F * C * W / size
    q, u = A - r, V - s * W
    start = atan(V / final)
    known = {
        "driven": s * sin(W * t) + r * cos(W * t)
        + exp(-decay * t) * (q * cos(turn * t) + (u + decay * q) / turn * sin(turn * t)),
        "braked": -M * G / C * t + (V + M * G / C) * M / C * (1 - exp(-C / M * t)),
        "dropped": -(final**2) / G * log(cosh(G * t / final)),
        "swung": A * cos(omega * t),
        "free": A + V * t - G * t**2 / 2,
        "risen": M / KD * log(cos(start - G * t / final) / cos(start)),
    }
    return known[name]


@pytest.mark.parametrize("name", ["driven", "braked", "dropped", "swung", "free", "risen"])
def test_coordinates_as_formulas_of_time(solution: mbs.Solution, name: str) -> None:
    expression = solution.answers[name].as_json()["expression"]
    assert expression is not None
    node = parse(expression)
    for t in np.linspace(0.0, 0.3, 7):
        (told,) = evaluate_float([node], {symbol(x): value for x, value in {**SAMPLE, "t": float(t)}.items()})
        assert told == pytest.approx(by_hand(name, float(t)), rel=1e-12, abs=1e-14)


def test_the_shortest_are_those_of_books(solution: mbs.Solution) -> None:
    told = {name: str(value) for name, value in solution.answers.items()}
    assert told["swung"] == "a*cos(t*sqrt(k/m))"
    assert told["free"] == "a + t*v - g*t^2/2"
    assert told["dropped"] == "-m/kd*log(cosh(t*sqrt(g*kd/m)))"


def test_forced_and_damped_motions_are_those_of_books() -> None:
    """No double fractions, the steady answer over one divisor, and no exponential of a logarithm at the top."""
    up = mbs.loads("""
multibody_sym: 1
name: thrown_up
gravity: [0, -g, 0]
parameters: {g: 9.81, m: {value: 2, positive: true}, c: {value: 0.3, positive: true}, v: 4, F: 3, w: 2.5,
  k: {value: 50, positive: true}}
bodies: {ball: {mass: m}, block: {mass: m}}
joints:
  j: {type: prismatic, parent: ground, child: ball, axis: y, q: y, initial: {u: v}}
  k: {type: prismatic, parent: ground, child: block, axis: x, q: x}
forces:
  air: {type: drag, on: ball, linear: c}
  spring: {type: spring_damper, joint: k, stiffness: k, damping: c}
  drive: {type: torque, joint: k, value: F*sin(w*t)}
ask: {way: {formula: y}, top: {max: y}, swing: {formula: x}}
simulation: {t_end: 1 s}
""")
    told = mbs.solve(up).answers
    assert told["top"].value == pytest.approx(M * V / C - M**2 * G / C**2 * log(1 + C * V / M / G), rel=1e-12)
    texts = {name: str(value).split(" = ")[0] for name, value in told.items()}
    assert texts["top"] == "m*(c*v + g*m*log(g*m/(c*v + g*m)))/c^2"
    assert texts["way"] == "m/c*(g*m/c + v)*(1 - exp(-c*t/m)) - g*m*t/c"
    steady, fading = texts["swing"].split(" + F*w*exp(-c*t/(2*m))*")
    assert steady == "F*(sin(t*w)*(k - m*w^2) - c*w*cos(t*w))/((k - m*w^2)^2 + c^2*w^2)"
    assert len(fading) <= 190
    assert "/(2*m)*" not in texts["swing"]


def test_what_has_no_known_solution_is_told(solution: mbs.Solution) -> None:
    assert solution.answers["bent"].as_json()["expression"] is None
    assert any(each.startswith("bent: no solution of the equation of bent is known") for each in solution.conditions)


FLOOR = """
multibody_sym: 1
name: floor
gravity: [0, -10, 0]
parameters: {v: 3, h: HEIGHT}
bodies: {b: {mass: 2}, ground: {surfaces: {f: {plane: [0, 0, 0], normal: y}}}}
joints: {D: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [0, h], u: [v, 0]}}}
contacts: {c: {between: [b, ground.f], static: 0.4, restitution: 0.5}}
simulation: {t_end: END}
ask: {course: {formula: x}}
"""


@pytest.mark.parametrize(
    ("height", "end", "said"),
    [
        ("0", "1", "until the first change of state: c sticks at t = 0.75 s"),  # v/(mu*g)
        ("0", "0.5", "there is none until t = 0.5 s"),
        ("0.8", "0.5", "until the first change of state: c strikes at t = 0.4 s"),  # sqrt(2*h/g)
    ],
)
def test_formulas_tell_until_which_change_of_state_they_hold(height: str, end: str, said: str) -> None:
    solution = mbs.solve(mbs.loads(FLOOR.replace("HEIGHT", height).replace("END", end)))
    assert solution.answers["course"].expression is not None
    (told,) = [each for each in solution.conditions if each.startswith("course: ")]
    assert said in told


def test_formulas_of_what_has_one_state_alone_tell_nothing_of_states(solution: mbs.Solution) -> None:
    assert not [each for each in (*solution.conditions, *solution.notes) if "state" in each]
