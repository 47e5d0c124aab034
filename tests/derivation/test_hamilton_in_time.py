"""dH/dt along runs of systems that time moves: H changes by the integral of its derivative by t at constant q and p."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy
from scipy.interpolate import make_interp_spline

import multibody_sym as mbs
from multibody_sym.dynamics.start.start import start

HEAD = """
multibody_sym: 1
name: moved
gravity: [0, -9.81, 0]
parameters: {m: 2, l: 0.7, w: 3, A: 0.2, k: 40}
"""
MODELS = {
    "shaken pendulum": """
bodies: {carrier: {}, bob: {mass: m, com: [0, -l, 0]}}
joints:
  S: {type: prismatic, parent: ground, child: carrier, axis: y, motion: A*sin(w*t)}
  H: {type: revolute, parent: carrier, child: bob, axis: z, q: theta, initial: {q: 1}}
outputs: {p_theta: generalized_momentum(theta)}
""",
    "pendulum that is drawn up": """
bodies: {arm: {}, bob: {mass: m}}
joints:
  H: {type: revolute, parent: ground, child: arm, axis: z, q: theta, initial: {q: 0.5}}
  D: {type: prismatic, parent: arm, child: bob, axis: "-y", motion: l - 0.1*t}
outputs: {p_theta: generalized_momentum(theta)}
""",
    "spring on a turntable that is sped up": """
bodies: {table: {}, bead: {mass: m}}
joints:
  T: {type: revolute, parent: ground, child: table, axis: z, motion: w*t + t^2/2}
  P: {type: point, parent: table, child: bead, q: [a, b], initial: {q: [0.3, 0.1]}}
forces: {v: {type: potential, on: bead, frame: table, value: "k*(1 + A*sin(t))*(x^2 + y^2)/2"}}
outputs: {p_a: generalized_momentum(a), p_b: generalized_momentum(b)}
""",
}


def along(equations: Any, expression: Any, run: Any) -> np.ndarray:
    """Return an expression of q, p and t at the samples of a run, whose outputs are the momenta."""
    s, mechanism = equations.symbols, equations.mechanism
    names = [c.name for c in mechanism.coordinates]
    function = sympy.lambdify([*s.coordinates, *equations.momenta, s.time, *s.parameters], expression)
    values = start(mechanism).parameters
    return np.array(function(*(run[x] for x in (*names, *(f"p_{name}" for name in names))), run.t, *values))


@pytest.mark.parametrize("name", MODELS)
def test_the_function_changes_by_its_rate_at_constant_q_and_p(name: str) -> None:
    system = mbs.loads(HEAD + MODELS[name])
    equations = mbs.derive(system, method="hamilton")
    function = equations.explicit(equations.function)
    rate = sympy.diff(function, equations.symbols.time)
    assert rate != 0
    run = mbs.simulate(system, t_end=2, samples=401, rtol=1e-13, atol=1e-14, method="dormand_prince_8")
    values, rates = along(equations, function, run), along(equations, rate, run)
    gained = make_interp_spline(run.t, rates, k=9).antiderivative()(run.t)
    size = float(np.abs(values).max())
    assert np.ptp(values) > 0.01 * size
    assert np.abs(values - values[0] - gained).max() <= 1e-10 * size
