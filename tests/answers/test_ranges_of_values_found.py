"""Where an equation holds in a whole range of values both ends are found; rounding is no root."""

from __future__ import annotations

from math import cos, sin, sqrt
from random import Random

import pytest

import multibody_sym as mbs
from multibody_sym.answers.ask import from_runs
from multibody_sym.answers.ask.extremes import zeros
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol

LOOP = """
multibody_sym: 1
name: loop
gravity: [0, -g, 0]
parameters: {{g: 9.81 m/s^2, m: 1 kg, R: 1 m, v0: {speed} m/s}}
bodies: {{ground: {{surfaces: {{loop: {{disc: R, inside: true}}}}}}, car: {{mass: m}}}}
joints: {{free: {{type: point, parent: ground, child: car, q: [x, y], initial: {{q: [0, -R], u: [v0, 0]}}}}}}
contacts: {{c: {{between: [car, ground.loop]}}}}
outputs: {{N: "reaction(c, normal)"}}
ask: {{vmin: {{find: v0, so: "min(N) == 0"}}}}
simulation: {{t_end: 1 s}}
"""
EDGE = """
multibody_sym: 1
name: edge
gravity: [0, -9.81, 0]
parameters: {m: {value: 2 kg, positive: true}, mu: {value: 0.35, positive: true}, F: {value: 3 N, positive: true}}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: m}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y]}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
forces: {f: {type: force, on: b, value: [F, 0, 0]}}
ask: {slips: {find: F, so: "reaction(c, friction) == -mu*reaction(c, normal)", between: [1, 30]}}
"""


def test_a_car_loses_its_loop_between_two_speeds() -> None:
    """From the speed that reaches the height of the centre to the speed that passes the top, whatever is declared."""
    found = mbs.solve(mbs.loads(LOOP.format(speed=6.5)))
    assert found.answers["vmin"].value == pytest.approx(sqrt(5 * 9.81), rel=1e-9)
    (told,) = [note for note in found.conditions if "holds for every v0" in note]
    ends = [float(word.rstrip(";,")) for word in told.replace("=", " ").split() if word[:2] in ("4.", "7.")]
    assert ends == pytest.approx([sqrt(2 * 9.81), sqrt(5 * 9.81)], rel=1e-9)
    assert "from sqrt(2*R*g) = 4.4" in told  # energy along the circle, by x or y, and no force at its end
    assert found.answers["vmin"].as_json()["expression"] == "sqrt(5*R*g)"


SWING = """
multibody_sym: 1
name: swing
gravity: [0, -g, 0]
parameters: {{g: 9.81 m/s^2, m: {{value: 2 kg, positive: true}}, l: {{value: 1.3 m, positive: true}}, h: 0.4 m, c: 0}}
bodies: {{ground: {{}}, bob: {{mass: m}}}}
joints: {{free: {{type: point, parent: ground, child: bob, q: [x, y], initial: {{q: [sqrt(l^2 - h^2), -h]}}}}}}
constraints: {{rod: {{type: distance, between: [ground, bob], value: l}}}}
forces: {{air: {{type: drag, on: bob, linear: {drag}}}}}
ask: {{most: {{max: tension(rod)}}, low: {{max: "sqrt(u_x^2 + u_y^2)"}}, there: {{value: u_x^2, when: {{y: -0.9}}}}}}
simulation: {{t_end: 2 s}}
"""


def test_energy_along_a_constraint_gives_formulas_of_two_coordinates() -> None:
    """T = m g (3 l - 2 h)/l and v = sqrt(2 g (l - h)) at the lowest point of a pendulum in x and y."""
    answers = mbs.solve(mbs.loads(SWING.format(drag="0"))).answers
    rng, l0, h0 = Random(3), 1.3, 0.4
    forms = {name: answers[name].expression for name in ("most", "low")}
    assert all(forms.values())
    for _ in range(5):
        g, m, length = rng.uniform(1, 20), rng.uniform(0.5, 3), rng.uniform(1, 2)
        h = rng.uniform(0.1, 0.9) * length
        known = {symbol(x): v for x, v in {"g": g, "m": m, "l": length, "h": h, "c": 0.0}.items()}
        found = [evaluate_float([form], known)[0] for form in forms.values() if form is not None]
        assert found == pytest.approx([m * g * (3 * length - 2 * h) / length, sqrt(2 * g * (length - h))], rel=1e-12)
    assert answers["there"].value == pytest.approx(2 * 9.81 * (0.9 - h0) * 0.9**2 / l0**2, rel=1e-9)


def test_where_air_takes_energy_there_is_no_formula_of_it() -> None:
    answers = mbs.solve(mbs.loads(SWING.format(drag="c")), parameters={"c": 0.2}).answers
    assert [answers[x].expression for x in ("most", "low", "there")] == [None] * 3


@pytest.mark.parametrize("sample", [4.5, 5.0, 5.7, 6.9])
def test_rounding_in_a_range_is_no_root(sample: float) -> None:
    """A function that is +-1e-12 between 4 and 7, of terms as large as 50; a root at 2 beyond is not met."""
    draw, looked = Random(7), []

    def function(x: float) -> float:
        looked.append(x)
        return 10 * max(4 - x, 0.0) + 10 * max(x - 7, 0.0) + draw.uniform(-1e-12, 1e-12)

    (zero,) = zeros(function, sample, None, size=50.0)
    assert (zero.at, zero.through) == (pytest.approx(7.0, abs=1e-9), pytest.approx(4.0, abs=1e-9))
    assert zero.ended
    assert len(looked) < 60  # each of them may be a run; halving alone takes 90


def test_a_body_that_leaves_is_pressed_by_nothing_exactly() -> None:
    """The run that ends as the contact opens leaves 1e-11 N of it; the flight behind has none."""
    asked = LOOP.replace('vmin: {{find: v0, so: "min(N) == 0"}}', "least: {{min: N}}")
    found = mbs.solve(mbs.loads(asked.format(speed=6.5))).answers["least"]
    assert found.value == 0.0


@pytest.mark.parametrize("angle", [1e-4, 1e-3])
def test_the_force_of_a_contact_that_opens_for_less_than_a_sample_is_exactly_zero(angle: float) -> None:
    """N = 0 at this angle before the top where v0^2 = g R (2 + 3 cos); the parabola meets the circle soon after."""
    asked = LOOP.replace('vmin: {{find: v0, so: "min(N) == 0"}}', "least: {{min: N}}")
    found = mbs.solve(mbs.loads(asked.format(speed=repr(sqrt(9.81 * (2 + 3 * cos(angle)))))))
    assert found.answers["least"].value == 0.0
    assert found.answers["least"].t == pytest.approx(0.644632 - angle / sqrt(9.81), abs=3e-4)


def test_a_root_is_found_however_steep_the_function_is_elsewhere() -> None:
    (zero,) = zeros(lambda x: (x - 3.0) * (1.0 + x**8), 1.0, None)
    assert zero.at == pytest.approx(3.0, rel=1e-12)
    assert zero.through is None


def test_a_value_with_a_formula_is_the_value_of_the_formula() -> None:
    found = mbs.solve(mbs.loads(EDGE)).answers["slips"]
    assert found.as_json()["expression"] == "9.81*m*mu"
    assert found.value == pytest.approx(9.81 * 2 * 0.35, rel=1e-15)


PULLED = """
multibody_sym: 1
name: pulled
gravity: [0, -g, 0]
parameters: {m: 2 kg, mu1: 0.2, mu2: 0.4, M: 5 kg, F: 60 N, g: 9.81 m/s^2}
bodies: {top: {mass: m}, plank: {mass: M}}
joints:
  P: {type: prismatic, parent: ground, child: plank, axis: x, q: X}
  T: {type: prismatic, parent: plank, child: top, axis: x, q: s}
forces:
  pull: {type: force, on: plank, value: [F, 0, 0]}
  r1: {type: friction, joint: P, static: mu1}
  r2: {type: friction, joint: T, static: mu2, kinetic: 0.35}
ask: {most: {find: F, so: "s'' == 0"}}
"""


LATER = [pytest.param(start, marks=pytest.mark.long) for start in (41.2, -50.0, 0.0)]


@pytest.mark.parametrize("start", [60.0, 41.202, *LATER])
def test_the_end_of_a_range_is_where_a_condition_comes_to_hold_wherever_it_is_looked_for_from(start: float) -> None:
    """The top one is pulled by no more than mu2 m g: both move with (F - mu1 (m + M) g)/(m + M) up to mu2 g.

    Beyond, kinetic friction is less: s'' jumps, and what laws tolerate moves the jump.
    """
    solution = mbs.solve(mbs.loads(PULLED), parameters={"F": start})
    most = solution.answers["most"]
    assert most.value == pytest.approx((0.2 + 0.4) * 7 * 9.81, rel=1e-15)
    assert most.as_json()["expression"] == "g*(M + m)*(mu1 + mu2)"
    told = "holds for every F from -g*(M + m)*(mu1 + mu2) = -41.202 N to g*(M + m)*(mu1 + mu2) = 41.202 N"
    assert any(told in each for each in solution.conditions), solution.conditions


@pytest.mark.parametrize("sample", [2.29, 2.0, 3.0])
def test_where_a_function_jumps_at_the_end_of_a_range_its_error_is_what_laws_tolerate(sample: float) -> None:
    def function(x: float) -> float:
        return 0.0 if abs(x) <= 2.3 * (1 + 3e-10) else x

    (zero,) = zeros(function, sample, None)
    assert (zero.at, zero.through) == (pytest.approx(2.3, rel=1e-9), pytest.approx(-2.3, rel=1e-9))
    assert abs(zero.at - 2.3) < zero.error(function, 0.0) < 1e-7


BRAKING = """
multibody_sym: 1
name: braking
gravity: [0, -g, 0]
parameters: {g: {value: 9.81 m/s^2, positive: true}, m: {value: 2 kg, positive: true}, mu: {value: 0.3, positive: true},
  v: {value: 4 m/s, positive: true}}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: m}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {u: [v, 0]}}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
simulation: {t_end: 5 s}
"""


def test_a_find_takes_few_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values at a moment come from the run that ends there; how far two numbers are apart takes none.

    These were 216 runs for two questions, five a value tried.
    """
    runs = []
    simulate = from_runs.simulate
    monkeypatch.setattr(from_runs, "simulate", lambda *given, **how: runs.append(1) or simulate(*given, **how))
    mbs.solve(mbs.loads(BRAKING + "ask: {s: {value: x, when: c sticks}, need: {find: v, so: s == 5}}\n"))
    assert len(runs) <= 20


@pytest.mark.parametrize(
    ("function", "bounds", "known"),
    [
        (lambda x: max(x - 2.3, 0.0), (0.0, 5.0), [(2.3, 0.0)]),
        (lambda x: max(x - 2.3, 0.0) + min(x - 1.2, 0.0), (0.0, 5.0), [(2.3, 1.2)]),
        (lambda x: max(x - 2.3, 0.0) * (x - 4.1) + 1e-13 * sin(40 * x), (0.0, 5.0), [(2.3, 0.0), (4.1, None)]),
        (lambda x: x**4 - 1e-40, (-2.0, 5.0), [(1e-10, None)]),
        (lambda x: 10 ** (3 * x) - 10**1.5, (0.0, 5.0), [(0.5, None)]),
        (lambda x: x - 2.5, (0.0, 5.0), [(2.5, None)]),
    ],
)
def test_ranges_of_zeros_are_told_from_zeros(function, bounds, known) -> None:  # type: ignore[no-untyped-def]
    found = zeros(function, 0.9, bounds)
    if len(known) == 1 and known[0][0] == 1e-10:
        assert all(zero.through is None for zero in found)
        return
    assert [zero.at for zero in found] == pytest.approx([at for at, _ in known], rel=1e-10)
    ends = [zero.through for zero in found]
    assert [None if end is None else pytest.approx(end, rel=1e-10) for end in ends] == [end for _, end in known]
