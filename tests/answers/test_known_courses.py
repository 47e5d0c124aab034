"""x(t) in symbols of equations with a known solution, against the same equations written by hand, solved by scipy."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, exp

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.printer import text

SAMPLE = {"g": 9.81, "m": 2, "k": 50, "c": 20, "w": 5, "F": 3, "kd": 0.4, "v": 4, "a": 0.1, "T": 0.7, "P": 30, "d": 0.3}
G, M, K, C, W, F, KD, V, A, T, P, D = SAMPLE.values()
KNOWN: dict[str, tuple[str, str, Callable[[float, float, float], float], float, float]] = {
    # name: axis, forces on body b in joint j, x''(t, x, u), x(0), u(0)
    "critical": ("x", "spring_damper, joint: j, stiffness: k, damping: c", lambda t, x, u: -(K * x + C * u) / M, A, V),
    "resonant": ("x", "spring_damper, joint: j, stiffness: k|torque, joint: j, value: F*cos(w*t)",
        lambda t, x, u: -K * x / M + F / M * cos(W * t), 0, V),
    "driven": ("x", "spring_damper, joint: j, stiffness: k|torque, joint: j, value: F*cos(d*t)",
        lambda t, x, u: -K * x / M + F / M * cos(D * t), 0, V),
    "under": ("x", "spring_damper, joint: j, stiffness: k, damping: d", lambda t, x, u: -(K * x + D * u) / M, 0, V),
    "dragged": ("x", "drag, on: b, quadratic: kd", lambda t, x, u: -KD / M * u * abs(u), 0, V),
    "both": ("x", "drag, on: b, quadratic: kd, linear: d", lambda t, x, u: -(D + KD * abs(u)) / M * u, A, V),
    "thrown": ("y", "drag, on: b, quadratic: kd", lambda t, x, u: -G - KD / M * u * abs(u), A, V),
    "dropped": ("y", "drag, on: b, quadratic: kd, linear: d", lambda t, x, u: -G - (D + KD * abs(u)) / M * u, A, 0),
    "fast": ("y", "drag, on: b, quadratic: kd", lambda t, x, u: -G - KD / M * u * abs(u), 0, -5 * V),
    "cubic": ("x", "torque, joint: j, value: -d*SPEED^3", lambda t, x, u: -D / M * u**3, A, V),
    "powered": ("x", "torque, joint: j, value: P/SPEED", lambda t, x, u: P / M / u, 0, V),
    "ramp": ("x", "spring_damper, joint: j, stiffness: k|torque, joint: j, value: F*t + a*t^2",
        lambda t, x, u: (-K * x + F * t + A * t**2) / M, A, V),
    "damped_ramp": ("x", "drag, on: b, linear: d|torque, joint: j, value: F*t^2",
        lambda t, x, u: (-D * u + F * t**2) / M, A, V),
    "pushed": ("x", "torque, joint: j, value: F*t^3", lambda t, x, u: F * t**3 / M, A, V),
    "pulse": ("x", "spring_damper, joint: j, stiffness: k|torque, joint: j, value: F*exp(-t/T)",
        lambda t, x, u: (-K * x + F * exp(-t / T)) / M, 0, V),
    "faded": ("x", "drag, on: b, linear: m/T|torque, joint: j, value: F*exp(-t/T)",
        lambda t, x, u: -u / T + F / M * exp(-t / T), 0, V),
}  # fmt: skip
SPEEDS = ("resonant", "dragged", "both", "thrown", "fast", "powered")
END = 0.6


def model() -> str:
    lines = ["multibody_sym: 1", "name: courses", "gravity: [0, -g, 0]"]
    free = {"F": 3, "a": 0.1}
    given = [f"{x}: {v}" if x in free else f"{x}: {{value: {v}, positive: true}}" for x, v in SAMPLE.items()]
    lines += [f"parameters: {{{', '.join(given)}}}", "bodies:"]
    lines += [f"  b_{name}: {{mass: m}}" for name in KNOWN]
    lines += ["joints:"]
    for name, (axis, _, _, x, u) in KNOWN.items():
        start = f"initial: {{q: {'a' if x else 0}, u: {'0' if not u else 'v' if u == V else '-5*v'}}}"
        lines += [f"  j_{name}: {{type: prismatic, parent: ground, child: b_{name}, axis: {axis}, q: {name}, {start}}}"]
    lines += ["forces:"]
    for name, (_, forces, *_) in KNOWN.items():
        for n, force in enumerate(forces.split("|")):
            own = force.replace("joint: j", f"joint: j_{name}").replace("on: b", f"on: b_{name}")
            lines += [f"  f{n}_{name}: {{type: {own.replace('SPEED', f'u_{name}')}}}"]
    asked = [f"{name}: {{formula: {name}}}" for name in KNOWN]
    asked += [f"{name}_u: {{formula: u_{name}}}" for name in SPEEDS]
    return "\n".join([*lines, f"ask: {{{', '.join(asked)}}}", f"simulation: {{t_end: {END} s}}"])


@pytest.fixture(scope="module")
def solution() -> mbs.Solution:
    return mbs.solve(mbs.loads(model()))


@pytest.mark.parametrize("name", KNOWN)
def test_formulas_are_solutions(solution: mbs.Solution, name: str) -> None:
    _, _, rate, x0, u0 = KNOWN[name]
    until = 0.37 if name == "thrown" else END
    times = np.linspace(0.0, until, 7)
    shown = solve_ivp(
        lambda t, y: [y[1], rate(t, *y)], (0.0, until), [x0, u0], "DOP853", times, rtol=1e-13, atol=1e-14
    ).y
    for told, known in zip((name, f"{name}_u")[: 1 + (name in SPEEDS)], shown, strict=False):
        formula = solution.answers[told].expression
        assert formula is not None
        node = formula
        for t, value in zip(times, known, strict=True):
            sample = {symbol(x): float(y) for x, y in {**SAMPLE, "t": t}.items()}
            assert evaluate_float([node], sample)[0] == pytest.approx(value, rel=1e-10, abs=1e-11)


def test_the_formulas_are_those_of_books(solution: mbs.Solution) -> None:
    told = {name: text(solution.answers[name].expression) for name in solution.answers}
    assert told["critical"] == "exp(-c*t/(2*m))*(a + t*v + a*c*t/(2*m))"
    assert told["resonant"] == "F*t/(2*m*w)*sin(t*w) + v*sin(t*sqrt(k/m))*sqrt(m/k)"
    assert told["dragged"] == "m/kd*log(kd*t*v/m + 1)"
    assert told["dragged_u"] == "m*v/(kd*t*v + m)"
    assert told["powered_u"] == "sqrt(2*P*t/m + v^2)"


def test_what_formulas_take_for_granted_is_told(solution: mbs.Solution) -> None:
    told = {x.split(": ", 1)[0]: x.split(": ", 1)[1] for x in solution.conditions if ": " in x}
    assert told["critical"] == "4*k*m == c^2"
    assert told["resonant"] == "k == m*w^2"
    assert told["driven"] == "k != m*d^2"
    assert told["under"] == "4*k*m > d^2"
    assert told["fast"] == "25*kd*v^2 > g*m"
    final = np.sqrt(M * G / KD)
    assert told["thrown"] == f"while u_thrown > 0, until t = {final / G * np.arctan(V / final):.6g} s"
    assert not {"dragged", "both", "ramp", "pulse", "powered"} & told.keys()


def test_later_answers_tell_what_their_formulas_take_for_granted() -> None:
    system = mbs.loads("""
multibody_sym: 1
name: rings
parameters: {m: 2, k: {value: 50, positive: true}, d: {value: 3, positive: true}, v: {value: 4, positive: true}}
bodies: {b: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: v}}}
forces: {s: {type: spring_damper, joint: j, stiffness: k, damping: d}}
ask: {most: {max: x}}
simulation: {t_end: 1 s}
""")
    solution = mbs.solve(system)
    decay, turn = 3 / 4, np.sqrt(25 - 9 / 16)
    t = np.arctan(turn / decay) / turn
    assert solution.answers["most"].value == pytest.approx(4 / turn * np.exp(-decay * t) * np.sin(turn * t), rel=1e-10)
    assert solution.answers["most"].expression is not None
    assert "most: 4*k*m > d^2" in solution.conditions


def test_a_rocket_that_burns_at_a_constant_rate() -> None:
    """Tsiolkovsky's speed, less what gravity takes: u = v log(m0/(m0 - n t)) - g t."""
    solution = mbs.solve(mbs.loads("""
multibody_sym: 1
name: rocket
gravity: [0, -g, 0]
parameters: {g: 9.81, m0: {value: 100, positive: true}, n: {value: 2, positive: true}, v: {value: 2000, positive: true}}
bodies: {b: {mass: {value: m0 - n*t, relative_velocity: [0, -v, 0]}}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: y, q: y}}
ask: {speed: {formula: u_y}, height: {formula: y}}
simulation: {t_end: 10 s}
"""))
    values = {symbol(x): y for x, y in {"g": 9.81, "m0": 100.0, "n": 2.0, "v": 2000.0, "t": 7.0}.items()}
    left = 86.0
    speed = 2000 * np.log(100 / left) - 9.81 * 7
    height = 2000 * (7 + left / 2 * np.log(left / 100)) - 9.81 * 49 / 2
    for name, value in (("speed", speed), ("height", height)):
        formula = solution.answers[name].expression
        assert formula is not None
        assert evaluate_float([formula], values)[0] == pytest.approx(value, rel=1e-12)
