"""Three freedoms whose polynomial does not factor: roots of a cubic by the cosine of a third of an angle."""

from __future__ import annotations

import numpy as np

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.printer import text

CHAIN = """
multibody_sym: 1
name: chain
parameters: {m1: {value: 2, positive: true}, m2: {value: 3, positive: true}, m3: {value: 1, positive: true},
  k: {value: 8, positive: true}}
bodies: {p: {mass: m1}, q: {mass: m2}, r: {mass: m3}}
joints:
  A: {type: prismatic, parent: ground, child: p, axis: x, q: x1}
  B: {type: prismatic, parent: ground, child: q, axis: x, q: x2}
  C: {type: prismatic, parent: ground, child: r, axis: x, q: x3}
forces:
  a: {type: spring_damper, joint: A, stiffness: k}
  b: {type: spring_damper, between: [p, q], stiffness: k}
  c: {type: spring_damper, between: [q, r], stiffness: k}
"""


def test_a_chain_of_three_masses_has_formulas_that_hold_for_others() -> None:
    """Eigenvalues of M^-1 K at other parameters; the stiffness scales all roots and stands in no angle."""
    found = mbs.modes(mbs.loads(CHAIN)).frequencies
    formulas = [x.expression for x in found]
    assert all(x is not None for x in formulas)
    rng = np.random.default_rng(5)
    for m1, m2, m3, k in rng.uniform(0.5, 4.0, (20, 4)):
        values = {symbol("m1"): m1, symbol("m2"): m2, symbol("m3"): m3, symbol("k"): k}
        stiffness = k * np.array([[2, -1, 0], [-1, 2, -1], [0, -1, 1]])
        wanted = np.sort(np.sqrt(np.linalg.eigvals(np.diag([1 / m1, 1 / m2, 1 / m3]) @ stiffness).real))
        told = [evaluate_float([x], values)[0] for x in formulas]
        assert np.allclose(told, wanted, rtol=1e-11, atol=0)
    assert max(len(text(x)) for x in formulas) <= 520
    assert text(formulas[0]).count("k*") == 2
