"""Greatest and least over a parameter, limits and series: by closed forms of books and by scans."""

from __future__ import annotations

from functools import lru_cache
from math import atan, cos, pi, sin, sqrt

import numpy as np
import pytest
from problem_files import EXAMPLES

import multibody_sym as mbs
from multibody_sym.answers.ask import varied
from multibody_sym.answers.ask.extremes import zeros
from multibody_sym.answers.records import Formula, Sentence
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

G = 9.81
PULL = """
multibody_sym: 1
name: pull
gravity: [0, -g, 0]
parameters:
  g: {value: 9.81, positive: true}
  m: {value: 10, positive: true}
  mu: {value: 0.3, positive: true}
  F: {value: 50, positive: true}
  beta: 0.2
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: m}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {u: [0.1, 0]}}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
forces: {f: {type: force, on: b, value: [F*cos(beta), F*sin(beta), 0]}}
ask:
  a: acceleration(b, x)
  T: {find: F, so: a == 0}
  best: {find: beta, least: T, between: [0, 80 deg]}
  quick: {find: beta, greatest: a}
  edge: {find: beta, greatest: a, between: [0.4, 0.9]}
  smooth: {limit: a, let: {mu: 0}}
  light: {limit: a, let: {m: 0}}
  heavy: {limit: a, let: {m: oo}}
  flat: {series: a, in: beta, through: 2}
  beside: {series: 1/beta, in: beta, through: 2}
"""
TOWER = """
multibody_sym: 1
name: tower
gravity: [0, -g, 0]
parameters:
  {g: {value: 9.81, positive: true}, v: {value: 8, positive: true}, h: {value: 5, positive: true}, k: 0.1, th: 0.4}
bodies: {ball: {mass: 1}}
joints: {j: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [0, h], u: [v*cos(th), v*sin(th)]}}}
ask: {range: {value: x, when: {y: 0}}, best: {find: th, greatest: range, between: [-0.5, 1.5]}}
simulation: {t_end: 4}
"""
DRAG = "forces: {air: {type: drag, on: ball, quadratic: k}}\n"
PENDULUM = """
multibody_sym: 1
name: bar
gravity: [0, -g, 0]
parameters: {g: {value: 9.81, positive: true}, m: 1, l: {value: 2, positive: true}, d: {value: 0.3, positive: true}}
bodies: {bar: {mass: m, inertia: {Izz: m*l^2/12}, com: [0, -d, 0]}}
joints: {A: {type: revolute, parent: ground, child: bar, q: phi}}
ask: {T: period(1), best: {find: d, least: T, between: [0.05, 1]}}
"""


@lru_cache
def pulled() -> mbs.Solution:
    return mbs.solve(mbs.loads(PULL), steps=True)


def form(answer: Value) -> str:
    assert answer.expression is not None
    return text(answer.expression)


def test_the_least_pull_is_at_the_angle_of_friction() -> None:
    found = pulled().answers
    assert form(found["best"]) == form(found["quick"]) == "atan(mu)"
    assert found["best"].value == pytest.approx(atan(0.3), rel=1e-14)
    angles = np.linspace(0, 80 * pi / 180, 2001)
    pulls = 0.3 * 10 * G / (np.cos(angles) + 0.3 * np.sin(angles))
    assert found["best"].value == pytest.approx(angles[np.argmin(pulls)], abs=1e-3)
    (told,) = [x for x in pulled().conditions if x.startswith("best: T =")]
    assert float(told.split("=")[-1].split()[0]) == pytest.approx(pulls.min(), rel=1e-6)
    assert "g*m*mu/sqrt(mu^2 + 1)" in told


def test_the_steps_set_the_derivative_to_zero_and_compare_the_ends() -> None:
    steps = pulled().steps
    assert steps is not None
    (step,) = [x for x in steps.steps if x.title.startswith("best:")]
    words = [x.before if isinstance(x, Formula) else x.words for x in step.lines]
    said = "".join(str(x) for line in words for x in line if isinstance(x, str))
    assert "derivative by beta vanishes" in said
    assert "> 0: a least value" in said
    assert said.count("which is greater") == 2
    (slope,) = [x for x in step.lines if isinstance(x, Formula) and "derivative" in str(x.before)]
    values = {"g": G, "m": 10.0, "mu": 0.3}

    def number(beta: float) -> float:
        left = slope.sides[0]
        return float(left.subs({s: values.get(steps.notation.text(s), beta) for s in left.free_symbols}))

    step_size = 1e-6
    pulls = [3 * G / (cos(x) + 0.3 * sin(x)) for x in (0.7 - step_size, 0.7 + step_size)]
    assert number(0.7) == pytest.approx((pulls[1] - pulls[0]) / (2 * step_size), rel=1e-6)
    assert not any(isinstance(x, Sentence) and "comparing runs" in str(x.words) for x in step.lines)


def test_an_extreme_at_an_end_of_the_range_is_that_end() -> None:
    assert pulled().answers["edge"].value == 0.4
    assert any(x.startswith("edge: it is an end of the range") for x in pulled().conditions)


def test_limits_are_those_of_the_formula_in_the_state_near_by() -> None:
    """A light block is lifted by the pull: a = F cos(beta)/m grows; without friction a = F cos(beta)/m."""
    found = pulled().answers
    assert form(found["smooth"]) == "F*cos(beta)/m"
    assert found["light"].value is None
    assert any("light: a grows beyond all bounds as m -> 0" in x for x in pulled().conditions)
    assert form(found["heavy"]) == "-g*mu"


def test_series_have_the_derivatives_of_the_formula() -> None:
    found = pulled().answers["flat"]
    assert found.value == pytest.approx(5 * (1 + 0.3 * 0.2 - 0.2**2 / 2) - 0.3 * G, rel=1e-12)
    assert any(x.startswith("flat: at beta = 0.2 it differs from a by 0.00") for x in pulled().conditions)
    assert form(pulled().answers["beside"]) == "1/beta"


def test_a_throw_from_a_tower_goes_farthest_below_half_a_right_angle() -> None:
    """tan(theta) = v/sqrt(v^2 + 2 g h), the range v sqrt(v^2 + 2 g h)/g."""
    solution = mbs.solve(mbs.loads(TOWER))
    found = solution.answers["best"]
    assert found.expression is not None
    assert found.value == pytest.approx(atan(8 / sqrt(64 + 2 * G * 5)), rel=1e-12)
    assert any("v*sqrt(2*g*h + v^2)/g" in x for x in solution.conditions)


def test_runs_are_compared_where_there_is_no_formula() -> None:
    """With drag the best angle is lower; a scan of runs has it between its neighbours."""
    system = mbs.loads(TOWER + DRAG)
    solution = mbs.solve(system)
    found = solution.answers["best"]
    assert found.expression is None
    assert found.value is not None
    assert "best: by comparing runs, since range has no formula" in solution.conditions
    alone = mbs.loads(TOWER.replace(", best: {find: th, greatest: range, between: [-0.5, 1.5]}", "") + DRAG)
    angles = [found.value + way for way in (-0.02, 0.0, 0.02)]
    reached = [mbs.solve(alone, parameters={"th": x}).answers["range"].value or 0.0 for x in angles]
    assert reached[1] > max(reached[0], reached[2])
    parabola = np.polyfit([-0.02, 0.0, 0.02], reached, 2)
    assert found.value == pytest.approx(found.value - parabola[1] / (2 * parabola[0]), abs=2e-4)
    assert 0.0 < found.error < 1e-4


def test_a_bar_swings_fastest_about_a_point_at_its_radius_of_gyration() -> None:
    found = mbs.solve(mbs.loads(PENDULUM)).answers["best"]
    assert found.value == pytest.approx(2 / sqrt(12), rel=1e-12)
    assert found.expression is not None


def test_a_search_without_bounds_ends_and_asks_for_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(varied, "_LONGEST", 0.0)
    asked = TOWER.replace("best: {find: th, greatest: range, between: [-0.5, 1.5]}", "far: {find: k, so: range == 1e3}")
    solution = mbs.solve(mbs.loads(asked + DRAG))
    assert solution.answers["far"].value is None
    assert any("far: no value of k was found" in x and "between: [.., ..]" in x for x in solution.conditions)
    with pytest.raises(varied.OutOfTimeError, match="from 1 to 1 in 0 s"):
        zeros(lambda x: 1.0, 1.0, None, looked=varied.Patience(lambda x: 1.0))


def test_questions_are_written_back_and_wrong_ones_say_what_is_wrong() -> None:
    system = mbs.loads(PULL)
    assert mbs.loads(mbs.dumps(system)).ask == system.ask
    assert "in: beta" in mbs.dumps(system)
    wrong = {
        "{limit: a, let: {M: oo}}": "'M'",
        "{limit: a, let: {mu: 0, m: 1}}": "a name and its limit",
        "{limit: a}": "no known question",
        "{series: a, in: x1, through: 2}": "'x1'",
        "{series: a, in: mu, through: -1}": "whole number",
        "{find: beta, least: a, greatest: a}": "no known question",
    }
    for asked, said in wrong.items():
        with pytest.raises(mbs.InputError, match=said):
            mbs.solve(mbs.loads(PULL.split("ask:", maxsplit=1)[0] + f"ask: {{a: 'acceleration(b, x)', q: {asked}}}"))


def test_the_range_up_a_slope() -> None:
    alpha, v, theta = 20 * pi / 180, 12.0, 50 * pi / 180
    solution = mbs.solve(mbs.load(EXAMPLES / "questions/up_a_slope.yaml"))
    found = solution.answers
    assert form(found["best"]) == "alpha/2 + pi/4"
    assert found["best"].value == pytest.approx(pi / 4 + alpha / 2, rel=1e-15)
    assert any("v^2/(g*(sin(alpha) + 1))" in x for x in solution.conditions)
    assert found["level"].value == pytest.approx(v**2 * sin(2 * theta) / G, rel=1e-12)
    gentle = v**2 / G * (sin(2 * theta) - 2 * alpha * cos(theta) ** 2)
    assert found["gentle"].value == pytest.approx(gentle, rel=1e-12)


BASE = """
multibody_sym: 1
name: base
gravity: [0, 0, 0]
parameters:
  {m: {value: 10, positive: true}, k: {value: 4000, positive: true}, c: {value: 60, positive: true},
   w: {value: 30, positive: true}}
inputs: {y: 0.005*sin(w*t)}
bodies: {base: {}, mass: {mass: m}}
joints:
  B: {type: prismatic, parent: ground, child: base, axis: x, motion: y}
  S: {type: prismatic, parent: ground, child: mass, axis: x, q: x, initial: {q: 0.3}}
forces: {spring: {type: spring_damper, between: [base, mass], stiffness: k, damping: c, length: 0.3}}
ask: {T: {transmissibility: x, from: y}, T0: {limit: T, let: {c: 0}}}
"""


def test_the_limit_of_a_root_of_a_square_says_for_which_sign_it_holds() -> None:
    """Without damping T = k/abs(k - m*w^2)."""
    found = mbs.solve(mbs.loads(BASE))
    assert form(found.answers["T0"]) == "k/(m*w^2 - k)"
    assert "T0: while m*w^2 - k > 0" in found.conditions
