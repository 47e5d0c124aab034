"""Amplitudes and lags of steady motions against runs of 20 periods begun on them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.answers.records import Formula
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol

DRIVEN = """
multibody_sym: 1
name: driven
gravity: [0, 0, 0]
parameters:
  M: {value: 20 kg, positive: true}
  m: {value: 2 kg, positive: true}
  k: {value: 2000 N/m, positive: true}
  ka: {value: 150 N/m, positive: true}
  c: {value: 30 N*s/m, positive: true}
  F0: {value: 10 N, positive: true}
  Y: {value: 1 cm, positive: true}
  w: {value: 7 rad/s, positive: true}
bodies: {table: {mass: 1}, machine: {mass: M}, small: {mass: m}}
joints:
  shaker: {type: prismatic, parent: ground, child: table, axis: x, motion: base}
  rail: {type: prismatic, parent: table, child: machine, axis: x, q: x}
  track: {type: prismatic, parent: machine, child: small, axis: x, q: s}
inputs: {F: F0*sin(w*t), base: Y*cos(w*t)}
forces:
  spring: {type: spring_damper, joint: rail, stiffness: k, damping: c}
  own: {type: spring_damper, joint: track, stiffness: ka}
  drive: {type: force, on: machine, value: [F, 0, 0]}
"""
FAST = DRIVEN.replace("7 rad/s", "13 rad/s")
CHAIN = """
multibody_sym: 1
name: chain
gravity: [0, 0, 0]
bodies: {a: {mass: 1}, b: {mass: 2}, c: {mass: 0.5}, d: {mass: 3}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x}
  B: {type: prismatic, parent: a, child: b, axis: x, q: y}
  C: {type: prismatic, parent: b, child: c, axis: x, q: z}
  D: {type: prismatic, parent: c, child: d, axis: x, q: v}
forces:
  sa: {type: spring_damper, joint: A, stiffness: 100, damping: 0.4}
  sb: {type: spring_damper, joint: B, stiffness: 50, damping: 0.2}
  sc: {type: spring_damper, joint: C, stiffness: 20, damping: 0.1}
  sd: {type: spring_damper, joint: D, stiffness: 90, damping: 0.3}
  push: {type: force, on: b, value: [F, 0, 0]}
inputs: {F: 3*sin(4*t)}
"""


@lru_cache
def answered(model: str, asked: str) -> dict[str, mbs.Value]:
    return dict(mbs.solve(mbs.loads(f"{model}ask: {{{asked}}}\n")).answers)


def steady(names: str, of: str) -> str:
    both = ("A_{0}: {{amplitude: {0}, of: {1}}}", "p_{0}: {{phase: {0}, of: {1}}}")
    return ", ".join(each.format(name, of) for name in names.split() for each in both)


@pytest.mark.parametrize(
    ("model", "names", "of", "other", "omega", "ahead"),
    [
        pytest.param(DRIVEN, "x s", "F", "Y*cos(w*t)", 7.0, -np.pi / 2, id="pushed"),
        pytest.param(FAST, "x s", "base", "F0*sin(w*t)", 13.0, 0.0, id="shaken above both resonances"),
        pytest.param(CHAIN, "x y z v", "F", "none", 4.0, -np.pi / 2, id="numbers beyond three freedoms"),
    ],
)
def test_twenty_periods_begun_on_the_steady_motion_stay_on_it(
    model: str, names: str, of: str, other: str, omega: float, ahead: float
) -> None:
    """x = A cos(w t + ahead - lag); the input is its cosine, or its sine a quarter later."""
    found = answered(model, steady(names, of))
    A, lag = (np.array([found[f"{kind}_{name}"].value for name in names.split()]) for kind in "Ap")
    rhs = mbs.compile(mbs.state_derivative(mbs.loads(model.replace(other, "0"))), backend="python")
    start = np.concatenate([A * np.cos(ahead - lag), -A * omega * np.sin(ahead - lag)])
    t = np.linspace(0.0, 40 * np.pi / omega, 101)
    run = solve_ivp(rhs, (0.0, t[-1]), start, method="DOP853", t_eval=t, rtol=1e-11, atol=1e-13 * A.max())
    wanted = A[:, None] * np.cos(omega * t + ahead - lag[:, None])
    assert np.abs(run.y[: len(A)] - wanted).max() <= 1e-8 * A.max()
    assert all((each.expression is None) == (model == CHAIN) for each in found.values())


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("driven by a sine", "{F: F0*sin(w*t), base: '0'}"),
        ("shaken by a cosine", "{F: '0', base: Y*cos(w*t)}"),
    ],
)
def test_equations_of_steps_hold_at_amplitude_and_lag(kind: str, inputs: str) -> None:
    """The factors of sine and cosine are those of the equation of motion with x = X sin(w t - phi) put in."""
    of = "F" if "driven" in kind else "base"
    text = DRIVEN.replace("{F: F0*sin(w*t), base: Y*cos(w*t)}", inputs).replace(
        "parent: machine, child: small, axis: x, q: s}", "parent: machine, child: small, axis: x, motion: '0'}"
    )
    asked = f"ask: {{A: {{amplitude: x, of: {of}}}, lag: {{phase: x, of: {of}}}}}\n"
    held = text.replace("  own: {type: spring_damper, joint: track, stiffness: ka}\n", "")
    solution = mbs.solve(mbs.loads(held + asked), steps=True)
    assert solution.steps is not None
    amplitude, lag = (solution.answers[name].value for name in ("A", "lag"))
    values = {"M": 20, "m": 2, "k": 2000, "c": 30, "F0": 10, "Y": 0.01, "w": 7, "X": amplitude, "phi": lag}
    lines = [line for step in solution.steps.steps if step.title.startswith(("A:", "lag:")) for line in step.lines]
    names = ("put in", "factors of", "squared", "divided")
    checked = [x for x in lines if isinstance(x, Formula) and str((*x.before, "")[0]).startswith(names)]
    assert len(checked) == 4
    for line in checked:
        known = {s: values[solution.steps.notation.text(s)] for side in line.sides for s in side.free_symbols}
        left, right = (float(side.subs(known)) for side in line.sides)
        assert left == pytest.approx(right, rel=1e-10)


@lru_cache
def damped_pair(pace: float) -> mbs.Value:
    model = """
multibody_sym: 1
name: damped_pair
gravity: [0, 0, 0]
parameters: {m1: 2 kg, m2: 1 kg, c1: 3 N*s/m, c2: 5 N*s/m, k1: 450 N/m, k2: 150 N/m, W: 13 rad/s}
inputs: {F: 10*sin(W*t)}
bodies: {one: {mass: m1}, two: {mass: m2}}
joints:
  A: {type: prismatic, parent: ground, child: one, axis: x, q: x}
  B: {type: prismatic, parent: one, child: two, axis: x, q: y}
forces:
  a: {type: spring, joint: A, stiffness: k1, damping: c1}
  b: {type: spring, joint: B, stiffness: k2, damping: c2}
  F: {type: force, on: two, value: [F, 0, 0]}
ask: {lag: {phase: y, of: F}}
"""
    return mbs.solve(mbs.loads(model), {"W": pace}).answers["lag"]


@pytest.mark.parametrize("pace", [3.0, 11.0, 17.0, 40.0])
def test_a_lag_has_one_formula_at_every_pace(pace: float) -> None:
    """The formula at 13 rad/s is that of all frequencies, as a linear system of complex numbers shows."""
    M, C, K = ([[3.0, 1.0], [1.0, 1.0]], [[3.0, 0.0], [0.0, 5.0]], [[450.0, 0.0], [0.0, 150.0]])
    y = np.linalg.solve(np.array(K) + 1j * pace * np.array(C) - pace**2 * np.array(M), [1.0, 1.0])[1]
    numbers = {"m1": 2.0, "m2": 1.0, "c1": 3.0, "c2": 5.0, "k1": 450.0, "k2": 150.0, "W": pace}
    formula = damped_pair(13.0).expression
    assert formula is not None
    lag = evaluate_float([formula], {symbol(name): x for name, x in numbers.items()})[0]
    assert lag == pytest.approx(-np.angle(y), abs=1e-9)
