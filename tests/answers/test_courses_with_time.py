"""x(t) and u(t) where accelerations depend on time and speed: put into equations written by hand, and integrated."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import cos, exp

import numpy as np
import pytest
from exact import exactly
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse

SAMPLE = {"g": 9.81, "m": 2, "k": 3, "c": 20, "w": 5, "F": 3, "b": 0.4, "v": 4, "a": 0.1, "T": 0.7, "n": 1.3, "s": 50}
G, M, K, C, W, F, B, V, A, T, N, S = SAMPLE.values()
BOTH, SPEED = True, False
KNOWN: dict[str, tuple[str, str, Callable[[float, float], float], float, float, bool]] = {
    # name: mass, force along x, x''(t, u), x(0), u(0), whether x has a formula too
    "growing": ("m", "-k*t*U", lambda t, u: -K * t * u / M, A, V, SPEED),
    "growing_square": ("m", "-k*t*U^2", lambda t, u: -K * t * u**2 / M, A, V, BOTH),
    "falling_square": ("m", "-k/(1 + t/T)*U^2", lambda t, u: -K / (1 + t / T) * u**2 / M, A, V, SPEED),
    "faded": ("m", "-k*exp(-t/T)*U", lambda t, u: -K * exp(-t / T) * u / M, A, V, SPEED),
    "faded_square": ("m", "-k*exp(-t/T)*U^2", lambda t, u: -K * exp(-t / T) * u**2 / M, A, V, BOTH),
    "falling": ("m", "-k*U/(1 + t/T)", lambda t, u: -K * u / (1 + t / T) / M, A, V, BOTH),
    "pushed": ("m", "F - k*U/(1 + t/T)", lambda t, u: (F - K * u / (1 + t / T)) / M, A, V, BOTH),
    "both_grow": ("m", "F*t - k*t*U", lambda t, u: (F * t - K * t * u) / M, A, 0, SPEED),
    "wave": ("m", "-k*cos(w*t)*U", lambda t, u: -K * cos(W * t) * u / M, A, V, SPEED),
    "to_an_end": ("m", "t*(F - k*U^2)", lambda t, u: t * (F - K * u**2) / M, A, V, SPEED),
    "ramp_and_pulse": ("m", "F*t*exp(-t/T)", lambda t, u: F * t * exp(-t / T) / M, A, V, BOTH),
    "rung": ("m", "F*exp(-t/T)*cos(w*t)", lambda t, u: F * exp(-t / T) * cos(W * t) / M, A, V, BOTH),
    "slowed_rung": ("m", "F*exp(-t/T)*cos(w*t) - k*U",
        lambda t, u: (F * exp(-t / T) * cos(W * t) - K * u) / M, A, V, BOTH),
    "cart_in_rain": ("m + n*t", "F - n*U", lambda t, u: (F - N * u) / (M + N * t), A, V, BOTH),
    "braked_rocket": ("s - n*t", "n*c - k*U", lambda t, u: (N * C - K * u) / (S - N * t), A, V, BOTH),
    "cubic": ("m", "-k*t*U^3", lambda t, u: -K * t * u**3 / M, A, V, SPEED),
}  # fmt: skip
END = 0.6


def model() -> str:
    given = [f"{x}: {{value: {v}, positive: true}}" for x, v in SAMPLE.items()]
    lines = ["multibody_sym: 1", "name: courses", f"parameters: {{{', '.join(given)}}}", "bodies:"]
    for name, (mass, *_) in KNOWN.items():
        own = mass if mass == "m" else f"{{value: {mass}, relative_velocity: [0, 0, 0]}}"
        lines += [f"  b_{name}: {{mass: {own}}}"]
    lines += ["joints:"]
    for name, (*_, x, u, _) in KNOWN.items():
        start = f"initial: {{q: {'a' if x else 0}, u: {'v' if u else 0}}}"
        lines += [f"  j_{name}: {{type: prismatic, parent: ground, child: b_{name}, axis: x, q: {name}, {start}}}"]
    lines += ["forces:"]
    for name, (_, force, *_) in KNOWN.items():
        lines += [f"  f_{name}: {{type: torque, joint: j_{name}, value: '{force.replace('U', f'u_{name}')}'}}"]
    asked = [f"{name}_u: {{formula: u_{name}}}" for name in KNOWN]
    asked += [f"{name}: {{formula: {name}}}" for name in KNOWN]
    return "\n".join([*lines, f"ask: {{{', '.join(asked)}}}", f"simulation: {{t_end: {END} s}}"])


@pytest.fixture(scope="module")
def solution() -> mbs.Solution:
    return mbs.solve(mbs.loads(model()))


def values(node: Node | None, times: np.ndarray) -> list[float]:
    assert node is not None
    given = {symbol(x): float(y) for x, y in SAMPLE.items()}
    return [evaluate_float([node], {**given, symbol("t"): float(t)})[0] for t in times]


@pytest.mark.parametrize("name", KNOWN)
def test_formulas_are_solutions(solution: mbs.Solution, name: str) -> None:
    *_, rate, x0, u0, both = KNOWN[name]
    times = np.linspace(0.0, END, 7)
    shown = solve_ivp(lambda t, y: [y[1], rate(t, y[1])], (0.0, END), [x0, u0], "DOP853", times, rtol=1e-13, atol=1e-14)
    assert values(solution.answers[f"{name}_u"].expression, times) == pytest.approx(shown.y[1], rel=1e-10, abs=1e-11)
    if both:
        assert values(solution.answers[name].expression, times) == pytest.approx(shown.y[0], rel=1e-10, abs=1e-11)
    else:
        assert solution.answers[name].expression is None


@pytest.mark.parametrize("name", KNOWN)
def test_they_satisfy_the_equation_and_the_start(solution: mbs.Solution, name: str) -> None:
    mass, force, _, x0, u0, _ = KNOWN[name]
    x, u, t = solution.answers[name].expression, solution.answers[f"{name}_u"].expression, symbol("t")
    assert u is not None
    given = {symbol(letter): symbol(letter) for letter in (*SAMPLE, "t")}
    (right,) = evaluate([parse(f"({force})/({mass})")], {**given, symbol("U"): u})
    missed = [derivative(u, t) - right, *([] if x is None else [derivative(x, t) - u])]
    start = [u - parse("v" if u0 else "0"), *([] if x is None else [x - parse("a" if x0 else "0")])]
    decimals = {letter: str(value) for letter, value in SAMPLE.items()}
    for at in (Fraction(1, 7), Fraction(9, 5)):
        assert max(abs(each) for each in exactly(missed, decimals, at)) < 1e-40
    assert max(abs(each) for each in exactly(start, decimals, Fraction(0))) < 1e-40


def test_what_is_taken_for_granted_and_why_there_is_none_is_told(solution: mbs.Solution) -> None:
    told = solution.conditions
    assert "falling: m != T*k" in told
    assert "to_an_end_u: k*v^2 > F" in told
    assert not [x for x in told if x.startswith(("falling_u", "faded_u", "growing_u", "cart_in_rain", "ramp"))]
    why = "no integral of u_growing is known, which has a formula of its own"
    assert f"growing: {why}; simulate tells numbers" in told
