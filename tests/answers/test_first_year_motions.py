"""Times, speeds and courses of problems of first-year books: formulas against closed forms found by hand.

Formulas are put to the test at other values of the parameters than those of the model.
"""

from __future__ import annotations

from collections.abc import Callable
from math import acosh, exp, log, pi, sqrt
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol

FLOOR = "ground: {surfaces: {lane: {plane: [0, 0, 0], normal: y}}}"
SLIDER = "joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: START}}"
PROBLEMS: dict[str, tuple[str, str, dict[str, float], dict[str, float], dict[str, Callable[..., float]]]] = {
    # name: model, ask, sample, other values, answers by hand
    "a boat drifts": (
        f"bodies: {{b: {{mass: m}}}}\n{SLIDER.replace('START', '{u: v}')}\n"
        "forces: {d: {type: drag, on: b, linear: k}}",
        "T: {value: t, when: u_x < v/2}, S: {value: x, when: u_x < v/2}",
        {"m": 100, "k": 20, "v": 4}, {"m": 30, "k": 7, "v": 5},
        {"T": lambda m, k, v: m / k * log(2), "S": lambda m, k, v: m * v / (2 * k)},
    ),
    "a car of constant power": (
        f"bodies: {{b: {{mass: m}}}}\n{SLIDER.replace('START', '{u: v}')}\n"
        "forces: {d: {type: torque, joint: j, value: P/u_x}}",
        "T: {value: t, when: u_x > w}, S: {value: x, when: u_x > w}",
        {"m": 1000, "P": 5e4, "v": 5, "w": 20}, {"m": 10, "P": 7, "v": 2, "w": 3},
        {"T": lambda m, P, v, w: m * (w**2 - v**2) / (2 * P), "S": lambda m, P, v, w: m * (w**3 - v**3) / (3 * P)},
    ),
    "a chain slides off a table": (
        f"bodies: {{b: {{mass: m}}}}\n{SLIDER.replace('START', '{q: a}')}\n"
        "forces: {d: {type: torque, joint: j, value: m*g*x/l}}",
        "T: {when: {x: l}}, V: {value: u_x, when: {x: l}}",
        {"m": 2, "g": 9.81, "l": 1.5, "a": 0.3}, {"m": 3, "g": 9, "l": 2, "a": 0.7},
        {"T": lambda m, g, l, a: sqrt(l / g) * acosh(l / a), "V": lambda m, g, l, a: sqrt(g * (l**2 - a**2) / l)},
    ),
    "a fall with drag": (
        f"gravity: [g, 0, 0]\nbodies: {{b: {{mass: m}}}}\n{SLIDER.replace('START', '{q: 0}')}\n"
        "forces: {d: {type: drag, on: b, quadratic: k}}",
        "T: {when: {x: h}}, V: {of: b, at: {x: h}}, high: {find: h, so: V == 10, between: [1, 30]}",
        {"m": 2, "g": 9.81, "k": 0.1, "h": 30}, {"m": 3, "g": 9, "k": 0.2, "h": 12},
        {"T": lambda m, g, k, h: sqrt(m / (g * k)) * acosh(exp(k * h / m)),
         "V": lambda m, g, k, h: sqrt(m * g / k * (1 - exp(-2 * k * h / m))),
         "high": lambda m, g, k, h: m / (2 * k) * log(m * g / (m * g - 100 * k))},
    ),
    "a ball begins to roll": (
        f"gravity: [0, -g, 0]\nbodies: {{{FLOOR}, b: {{mass: m, inertia: {{Izz: 2*m*R^2/5}}, surfaces: "
        "{rim: {disc: R, axis: z}}}}\njoints: {j: {type: planar, parent: ground, child: b, q: [x, y, phi], "
        "initial: {q: [0, R, 0], u: [v, 0, 0]}}}\n"
        "contacts: {c: {between: [b.rim, ground.lane], static: mu, kinetic: mu}}",
        "T: {value: t, when: c sticks}, S: {value: x, when: c sticks}, V: {value: u_x, when: c sticks}",
        {"m": 2, "g": 9.81, "R": 0.11, "mu": 0.2, "v": 7}, {"m": 3, "g": 9, "R": 0.3, "mu": 0.4, "v": 5},
        {"T": lambda m, g, R, mu, v: 2 * v / (7 * mu * g), "S": lambda m, g, R, mu, v: 12 * v**2 / (49 * mu * g),
         "V": lambda m, g, R, mu, v: 5 * v / 7},
    ),
    "a growing force moves a block": (
        f"gravity: [0, -g, 0]\nbodies: {{{FLOOR}, b: {{mass: m}}}}\njoints: {{j: {{type: planar, parent: ground, "
        "child: b, q: [x, y], motion: [null, null, 0]}}\n"
        "contacts: {c: {between: [b, ground.lane], static: mu, kinetic: mu}}\n"
        "forces: {d: {type: force, on: b, value: [k*t, 0, 0]}}",
        "T: {value: t, when: c slides}, F: {value: k*t, when: c slides}",
        {"m": 2, "g": 9.81, "mu": 0.3, "k": 3}, {"m": 3, "g": 9, "mu": 0.4, "k": 5},
        {"T": lambda m, g, mu, k: mu * m * g / k, "F": lambda m, g, mu, k: mu * m * g},
    ),
    "a pair of masses leaves the wall": (
        "bodies: {ground: {surfaces: {wall: {plane: [0, 0, 0], normal: x}}}, b: {mass: m}, p: {mass: M}}\n"
        "joints: {A: {type: prismatic, parent: ground, child: b, axis: x, q: x}, "
        "B: {type: prismatic, parent: ground, child: p, axis: x, q: y, initial: {q: l - a}}}\n"
        "contacts: {c: {between: [b, ground.wall]}}\n"
        "forces: {s: {type: spring_damper, between: [b, p], stiffness: k, length: l}}",
        "T: {value: t, when: c opens}, V: {value: u_y, when: c opens}",
        {"m": 2, "M": 3, "k": 50, "a": 0.1, "l": 1}, {"m": 1, "M": 2, "k": 9, "a": 0.2, "l": 2},
        {"T": lambda m, M, k, a, l: pi / 2 * sqrt(M / k), "V": lambda m, M, k, a, l: a * sqrt(k / M)},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", PROBLEMS)
def test_answers_are_the_formulas_of_books(name: str) -> None:
    model, ask, sample, other, known = PROBLEMS[name]
    given = ", ".join(f"{x}: {{value: {y}, positive: true}}" for x, y in sample.items())
    text = f"multibody_sym: 1\nname: p\nparameters: {{{given}}}\n{model}\nask: {{{ask}}}\nsimulation: {{t_end: 8 s}}"
    answers: dict[str, Any] = dict(mbs.solve(mbs.loads(text)).answers)
    for key, by_hand in known.items():
        assert answers[key].value == pytest.approx(by_hand(*sample.values()), rel=1e-9)
        assert answers[key].expression is not None, key
        (told,) = evaluate_float([answers[key].expression], {symbol(x): float(y) for x, y in other.items()})
        assert told == pytest.approx(by_hand(*other.values()), rel=1e-12)
