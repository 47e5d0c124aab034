"""Numbers are printed with the digits that hold: all of them are right to half a unit of the last place."""

from __future__ import annotations

import re
from math import asin, pi, radians, sin, sqrt
from pathlib import Path
from random import Random
from typing import Any

import pytest
from scipy.special import ellipk, ellipkinc

import multibody_sym as mbs
from multibody_sym.documents.analysis import equilibrium_text
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import solution_text
from multibody_sym.text.values import Units, number_within

TEN = Units(digits=10)

ORBIT = """
multibody_sym: 1
name: orbit
parameters: {{m: 2 kg, k: {k} N*m^2, r0: {r0} m, v0: {v0} m/s}}
bodies: {{p: {{mass: m}}}}
joints: {{free: {{type: point, parent: ground, child: p, q: [x, y], initial: {{q: [r0, 0], u: [0, v0]}}}}}}
forces: {{pull: {{type: potential, joint: free, value: "-k/sqrt(x^2 + y^2)"}}}}
ask:
  farthest: {{max: "sqrt(x^2 + y^2)"}}
  slowest: {{min: "sqrt(u_x^2 + u_y^2)"}}
  far: {{find: v0, so: "max(sqrt(x^2 + y^2)) == 2.5*r0"}}
simulation: {{t_end: {end} s{more}}}
"""
PENDULUM = """
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {{g: 9.81 m/s^2, m: 1 kg, l: {length} m}}
bodies: {{bob: {{mass: m, com: [0, -l, 0]}}}}
joints: {{hinge: {{type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {{q: {angle} deg}}}}}}
ask: {{down: {{when: {{phi: 0.3}}}}, swing: {{period_of: phi}}}}
simulation: {{t_end: 4 s{more}}}
"""


def verify(printed: str, true: float, least: int) -> None:
    """Raise where a digit of a printed number is wrong by more than half a unit of its place, or few are printed."""
    mantissa, _, exponent = printed.partition("e")
    digits = mantissa.replace(".", "").lstrip("-0")
    places = len(mantissa.partition(".")[2]) - int(exponent or 0)
    assert abs(float(printed) - true) <= 0.5000001 * 10.0**-places, (printed, true)
    assert least <= len(digits) <= 10, printed


def printed(text: str, name: str) -> list[str]:
    """Return the numbers behind a name in what is printed, without formulas."""
    (line,) = re.findall(rf"^  {name} = (.*)$", text, re.MULTILINE)
    return re.findall(r"(?:^|= )(-?[0-9][0-9.]*(?:e[-+][0-9]+)?)", line)


def ellipse(draw: Random, more: str = "") -> tuple[str, dict[str, float]]:
    """Return an orbit that begins nearest to the centre, and its closed forms."""
    mu, r0, wide = draw.uniform(1, 9), draw.uniform(0.5, 2), draw.uniform(1.3, 1.7)
    v0 = sqrt(wide * mu / r0)
    r1 = r0 * wide / (2 - wide)
    half = pi * sqrt(((r0 + r1) / 2) ** 3 / mu)
    text = ORBIT.format(k=repr(2 * mu), r0=repr(r0), v0=repr(v0), end=1.7 * half, more=more)
    return text, {"farthest": r1, "t": half, "slowest": v0 * r0 / r1, "far": sqrt(2 * mu * 2.5 / (r0 * 3.5))}


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.long) for k in range(2, 12))])
def test_all_digits_of_an_orbit_hold(seed: int) -> None:
    text, true = ellipse(Random(seed))
    told = solution_text(mbs.solve(mbs.loads(text)), TEN)
    for name in ("farthest", "slowest", "far"):
        verify(printed(told, name)[0], true[name], 8)
        if name != "far":
            (time,) = re.findall(rf"{name} = .* at t = ([0-9.]*) s", told)
            verify(time, true["t"], 6)


def test_few_digits_hold_in_long_steps() -> None:
    """The same orbits in steps with which five digits hold, or less."""
    text, true = ellipse(Random(5), more=", step: 0.05, method: rk4")
    found = mbs.solve(mbs.loads(text))
    for name in ("farthest", "slowest"):
        answer = found.answers[name]
        assert answer.value is not None
        assert abs(answer.value - true[name]) <= answer.error
        assert answer.as_json()["error"] == answer.error
        number = printed(solution_text(found, TEN), name)[0]
        assert len(number.replace(".", "").lstrip("0")) < 8
        verify(number, true[name], 2)


@pytest.mark.parametrize("seed", range(3))
def test_all_digits_of_a_swing_hold(seed: int) -> None:
    draw = Random(seed)
    length, angle = draw.uniform(0.2, 2), draw.uniform(60, 170)
    told = solution_text(mbs.solve(mbs.loads(PENDULUM.format(length=repr(length), angle=repr(angle), more=""))), TEN)
    m, w = sin(radians(angle) / 2) ** 2, sqrt(9.81 / length)
    first = (ellipk(m) - ellipkinc(asin(sin(0.15) / sqrt(m)), m)) / w
    verify(printed(told, "down")[0], first, 9)
    verify(printed(told, "swing")[0], 4 * ellipk(m) / w, 9)


WELL = """
multibody_sym: 1
name: well
parameters: {{k: 1 N/m^{power}, a: {at} m}}
bodies: {{p: {{mass: 1 kg}}}}
joints: {{j: {{type: prismatic, parent: ground, child: p, axis: x, q: x, initial: {{q: {start} m}}}}}}
forces: {{f: {{type: force, on: p, value: ["-{force}", 0, 0]}}}}
"""


@pytest.mark.parametrize("power", [1, 3, 5])
def test_digits_of_a_position_hold_where_several_roots_meet(power: int) -> None:
    """A force (x - a)^3 tells a to 1e-8 only: its zeros to rounding are as wide."""
    draw = Random(power)
    for _ in range(3):
        at = draw.uniform(0.1, 0.9)
        text = WELL.format(power=power, at=repr(at), start=repr(at + 0.4), force=f"k*(x - a)^{power}")
        told = equilibrium_text(mbs.equilibrium(mbs.loads(text)), TEN)
        verify(re.findall(r"x = (?:a = )?([0-9.]*) m", told)[0], at, 7 if power == 1 else 4)


@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (5.0, 0.0, "5"),
        (1.0 / 3.0, 0.0, "0.3333333333"),
        (1.0 / 3.0, 1e-6, "0.33333"),
        (9.9996, 5e-4, "10"),
        (-1.18e-30, 1e-20, "0"),
        (12345.678, 100.0, "1.2e+04"),
        (2.5, 0.05, "2.5"),
    ],
)
def test_digits_are_printed_to_which_both_ends_round(number: float, error: float, text: str) -> None:
    assert number_within(number, error) == text


EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("four_bar", {}),
        ("double_pendulum", {}),
        ("pendulum", {"rtol": 1e-5}),
        ("pendulum", {"method": "rk4", "step": 0.02}),
    ],
)
def test_all_digits_of_the_end_of_a_run_hold(name: str, how: dict[str, Any]) -> None:
    """Against a run with steps so short that rounding alone is left; errors of four_bar grow by more than 1000."""
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    fine = mbs.simulate(system, rtol=1e-13, atol=1e-14, samples=2).final
    told = run_summary(mbs.simulate(system, samples=2, **how))
    for quantity, true in {**fine["coordinates"], **fine["speeds"]}.items():
        (number,) = re.findall(rf"^  {quantity} +(-?[0-9.e+-]+) ", told, re.MULTILINE)
        verify(number, true, 1)


BOUNCING = """
multibody_sym: 1
name: bouncing
gravity: [0, -9.81, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: 1 kg}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {q: 1}}}
contacts: {c: {between: [b, ground.floor], restitution: 0.7, open: true}}
outputs: {root: sqrt(1.5 - t)}
simulation: {t_end: 2 s}
"""


@pytest.mark.parametrize(("rtol", "digits"), [(1e-9, 6), (1e-7, 4), (1e-12, 6)])
def test_all_times_of_a_run_have_as_many_digits(rtol: float, digits: int) -> None:
    """Of events, warnings and the stop that ends it: 100 tolerances are left of them, and six digits at most."""
    system = mbs.loads(BOUNCING + "stop: {up: t > 1.83456789}")
    run = mbs.simulate(system, rtol=rtol)
    told = run_summary(run)
    times = re.findall(r"(?:t =| s to) ([0-9.]+)", told)
    known = [*(event["t"] for event in run.events), run.t_final]
    assert len(times) >= 5
    assert set(times) <= {f"{t:.{digits}g}" for t in known}
    assert f"{sqrt(2 / 9.81):.{digits}g}" in times


LANDING = """
multibody_sym: 1
name: landing
parameters: {v: 7.3 m/s, c: 0.05 kg/m}
gravity: [0, -9.81, 0]
bodies: {b: {mass: 1.1 kg}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {u: [v, v]}}}
forces: {d: {type: force, on: b, value: [-c*u_x*abs(u_x), -c*u_y*abs(u_y), 0]}}
ask: {down: {value: y, when: y < 0}, above: {value: y - 0.3, when: {y: 0.3}}, top: {value: u_y, when: u_y < 0}}
simulation: {t_end: 3 s}
"""


def test_rounding_about_zero_is_zero() -> None:
    told = solution_text(mbs.solve(mbs.loads(LANDING)), TEN)
    assert [printed(told, name) for name in ("down", "above", "top")] == [["0"], ["0"], ["0"]]


SPUN_BACK = """
multibody_sym: 1
name: spun_back
gravity: [0, -g, 0]
parameters: {m: 0.5 kg, mu: 0.25, v: 2 m/s, g: 9.81 m/s^2, r: 0.1 m, w: 50 rad/s}
bodies: {b: {shape: {sphere: r, mass: m}}, ground: {surfaces: {t: {plane: [0, 0, 0], normal: y}}}}
joints: {j: {type: planar, parent: ground, child: b, q: [x, y, phi], initial: {q: [0, r, 0], u: [v, 0, w]}}}
contacts: {c: {between: [b, ground.t], static: mu}}
ask:
  left: {value: u_x, when: c sticks}
  turning: {value: u_phi*r, when: c sticks}
  turned: {value: phi, when: c sticks}
  lost: {value: work(c), after: 3 s}
  energy: {value: kinetic_energy(), after: 3 s}
simulation: {t_end: 4 s}
"""


def test_the_error_of_a_value_at_a_moment_has_those_of_the_moment_and_of_rounding() -> None:
    """With w = 5 v/(2 r) a ball comes to rest as its slip ends, at v/(mu g): friction takes all of its energy."""
    found = mbs.solve(mbs.loads(SPUN_BACK))
    known = {"left": 0.0, "turning": 0.0, "lost": -3.5, "energy": 0.0, "turned": 25 * 2 / (0.25 * 9.81)}
    for name, true in known.items():
        answer = found.answers[name]
        assert answer.value is not None
        assert abs(answer.value - true) <= max(answer.error, 1e-15 * abs(true)), name
        assert answer.error < 1e-10, name
    told = solution_text(found, TEN)
    assert [printed(told, name) for name in ("left", "turning", "energy")] == [["0"]] * 3
