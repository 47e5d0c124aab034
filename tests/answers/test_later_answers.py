"""Questions about what happens later: extremes, moments, values at them, displacements, answers in answers."""

from __future__ import annotations

from math import asin, atan2, cos, exp, pi, radians, sin, sqrt
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol

V, A, G = 20.0, radians(60), 9.81
THROWN = """
multibody_sym: 1
name: thrown
gravity: [0, -g, 0]
parameters: {g: 9.81 m/s^2, v: 20 m/s, a: 60 deg}
bodies: {ball: {mass: 1 kg}}
joints: {j: {type: point, parent: ground, child: ball, q: [x, y], initial: {u: [v*cos(a), v*sin(a)]}}}
simulation: {t_end: 6 s}
ask:
"""
PENDULUM = """
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 2 kg, l: 0.7 m, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 60 deg}}}
simulation: {t_end: 2 s}
ask:
"""


def answers(model: str, *questions: str) -> dict[str, Any]:
    return dict(mbs.solve(mbs.loads(model + "".join(f"  {question}\n" for question in questions))).answers)


@pytest.fixture(scope="module")
def thrown() -> dict[str, Any]:
    return answers(
        THROWN,
        "top: {max: y}",
        "low: {min: y, until: {x: 5}}",
        "late: {max: y, after: 2.5 s, until: 3 s}",
        "T: y < 0",
        "range: {value: x, when: y < 0}",
        "both: y < 8 and u_y < 0",
        "h: {value: 'position(ball, y)', after: 1 s}",
        "fallen: {of: ball, after: 3 s, along: '-y'}",
        "vy: {of: ball, at: y < 0, along: y}",
        "speed: {of: ball, at: 'x > 5 or y > 100'}",
        "ratio: top/range + 0*vy",
    )


def test_extremes_of_a_thrown_ball_and_their_times(thrown: dict[str, Any]) -> None:
    up = V * sin(A)
    assert (thrown["top"].value, thrown["top"].t) == pytest.approx((up**2 / 2 / G, up / G), rel=1e-9)
    assert thrown["top"].unit == "m"
    assert (thrown["low"].value, thrown["low"].t) == (0.0, 0.0)
    assert thrown["late"].value == pytest.approx(up * 2.5 - G * 2.5**2 / 2, rel=1e-9)
    assert thrown["late"].as_json()["t"] == pytest.approx(2.5, rel=1e-12)


def test_moments_of_conditions_and_values_at_them(thrown: dict[str, Any]) -> None:
    up, flight = V * sin(A), 2 * V * sin(A) / G
    assert thrown["T"].value == pytest.approx(flight, rel=1e-9)
    assert thrown["range"].value == pytest.approx(V * cos(A) * flight, rel=1e-9)
    assert thrown["both"].value == pytest.approx((up + sqrt(up**2 - 16 * G)) / G, rel=1e-9)
    assert thrown["h"].value == pytest.approx(up - G / 2, rel=1e-9)
    assert thrown["speed"].value == pytest.approx(sqrt((V * cos(A)) ** 2 + (up - G * 0.5) ** 2), rel=1e-9)


def test_displacements_and_velocities_along_a_direction_have_signs(thrown: dict[str, Any]) -> None:
    assert thrown["fallen"].value == pytest.approx(-(3 * V * sin(A) - 4.5 * G), rel=1e-9)
    assert thrown["vy"].value == pytest.approx(-V * sin(A), rel=1e-9)
    assert (thrown["fallen"].unit, thrown["vy"].unit) == ("m", "m/s")
    assert thrown["fallen"].as_json()["expression"] == "3*(3*g - 2*v*sin(a))/2"


def test_answers_stand_in_the_expressions_of_others(thrown: dict[str, Any]) -> None:
    assert thrown["ratio"].value == pytest.approx(thrown["top"].value / thrown["range"].value, rel=1e-12)


def test_a_pendulum_pulls_hardest_at_its_lowest_point() -> None:
    found = answers(PENDULUM, "pull: {max: 'reaction(hinge, fy)'}", "least: {min: theta}", "over: {max: u_theta^2}")
    assert found["pull"].value == pytest.approx(2 * G * (3 - 2 * cos(pi / 3)), rel=1e-9)
    assert found["over"].value == pytest.approx(2 * G / 0.7 * 0.5, rel=1e-9)
    assert found["least"].value == pytest.approx(-pi / 3, rel=1e-9)


def test_a_damped_mass_turns_back_at_formulas_of_moment_and_place() -> None:
    """x = v/w exp(-d t) sin(w t): it turns where tan(w t) = w/d, and again a period later, less by exp(d T)."""
    found = answers(
        """
multibody_sym: 1
name: damped
parameters: {m: {value: 2, positive: true}, k: {value: 80, positive: true}, c: {value: 3, positive: true},
  v: {value: 0.7, positive: true}}
bodies: {b: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: v}}}
forces: {s: {type: spring_damper, joint: j, stiffness: k, damping: c}}
simulation: {t_end: 1.5}
ask:
""",
        "first: {max: x}",
        "when: u_x < 0",
        "ratio: first/second",
        "second: {max: x, after: 0.6}",
    )
    for m, k, c, v in ((2, 80, 3, 0.7), (3, 50, 4, 0.9), (1.5, 70, 1, 0.4)):
        values = {symbol(name): x for name, x in zip("mkcv", (m, k, c, v), strict=True)}
        first, when, ratio = (evaluate_float([found[x].expression], values)[0] for x in ("first", "when", "ratio"))
        d, w = c / 2 / m, sqrt(k / m - (c / 2 / m) ** 2)
        assert when == pytest.approx(atan2(w, d) / w, rel=1e-13)
        assert first == pytest.approx(v / w * exp(-d * when) * sin(w * when), rel=1e-13)
        assert ratio == pytest.approx(exp(2 * pi * d / w), rel=1e-13)
        if m == 2:
            assert (found["first"].value, found["when"].value) == pytest.approx((first, when), rel=1e-9)


def test_questions_are_written_back() -> None:
    asked = [
        "a: {max: y, after: 1 s, until: y < 0}", "b: {value: x, when: {y: 1}}", "c: y < 0 and x > 2",
        "d: {of: ball, after: 1 s, along: x}", "e: {find: v, so: 'max(y) + min(x, y) == 2*min(x)', between: [1, 9]}",
        "f: {formula: y}", "g: {min: x, until: 2 s}",
    ]
    system = mbs.loads(THROWN + "".join(f"  {question}\n" for question in asked))
    assert mbs.loads(mbs.dumps(system)).ask == system.ask


# --- for which value -----------------------------------------------------------------------------------------------


def test_values_of_parameters_and_start_values_are_found() -> None:
    found = answers(
        THROWN,
        "range: {value: x, when: y < 0}",
        "a1: {find: a, so: range == 20, between: [0.1, 1.5]}",
        "v1: {find: v, so: max(y) == 10}",
        "g1: {find: g, so: 'max(y) == min(range, 10) + 0*min(y)'}",
        "high: {find: y, so: range == 40}",
    )
    assert found["a1"].value == pytest.approx(pi / 2 - _low_angle(), rel=1e-9)
    assert found["v1"].value == pytest.approx(sqrt(2 * G * 10) / sin(A), rel=1e-9)
    assert found["g1"].value == pytest.approx((V * sin(A)) ** 2 / 20, rel=1e-9)
    time = 40 / (V * cos(A))
    assert found["high"].value == pytest.approx(G * time**2 / 2 - V * sin(A) * time, rel=1e-8)
    assert found["v1"].unit == "m/s"


def _low_angle() -> float:
    return asin(20 * G / V**2) / 2


def test_no_value_and_several_values_are_told() -> None:
    model = mbs.loads(
        THROWN
        + "  range: {value: x, when: y < 0}\n  far: {find: a, so: range == 50, between: [0.1, 1.5]}\n"
        + "  near: {find: a, so: range == 20, between: [0.1, 1.5]}\n"
    )
    solution = mbs.solve(model)
    assert solution.answers["far"].value is None
    assert any("far: no value of a was found for which range == 50" in x for x in solution.conditions)
    assert any(f"near: others are {_low_angle():.6f}"[:20] in x for x in solution.conditions)


def test_a_time_that_is_a_value_is_in_seconds() -> None:
    found = answers(THROWN, "down: {value: t, when: y < 0}")["down"]
    assert (found.value, found.unit) == (pytest.approx(2 * V * sin(A) / G, rel=1e-9), "s")


def test_reasons_why_an_extreme_has_no_formula_are_of_mechanics() -> None:
    model = """
multibody_sym: 1
name: forced
parameters: {m: 2, k: 8, F: 3, W: 1.5}
bodies: {b: {mass: m}}
joints: {D: {type: prismatic, parent: ground, child: b, axis: x, q: x}}
forces: {s: {type: spring, joint: D, stiffness: k}, f: {type: force, on: b, value: [F*cos(W*t), 0, 0]}}
simulation: {t_end: 3 s}
ask: {mx: {max: x, until: 3 s}}
"""
    said = " ".join(mbs.solve(mbs.loads(model)).notes)
    assert "root of no known kind" in said
    assert "unpack" not in said
