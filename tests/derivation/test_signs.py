"""Absolute values and signs in derived equations: no x^2/|x| is left, and the equations hold on both sides of x = 0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.motion import state_of

COIN = Path(__file__).parents[2] / "examples" / "rolling_coin.yaml"


def test_the_lowest_point_of_a_coin_is_r_abs_sin_lean_below() -> None:
    """sin^2/|sin| = |sin|, sin/|sin| = sign(sin), and sin^2 + cos^2 = 1 is seen through them."""
    derived = write_document(derivation_document(mbs.derive(mbs.load(COIN)), steps=True), "text")
    assert "    phi_contact.n = z - r*abs(sin(lean))\n" in derived
    assert "    H[2,4] = r*cos(heading)*sign(sin(lean))*cos(lean)\n" in derived
    assert "/abs(" not in derived


@pytest.mark.parametrize("lean", [0.4, 2.5, -0.4, -2.5])
def test_a_coin_s_equations_hold_for_either_sign_of_sin_lean(lean: float) -> None:
    equations, rng = mbs.derive(mbs.load(COIN)), np.random.default_rng(int(10 * lean) % 7)
    values = parameter_values(equations.mechanism, {"r": 0.3, "m": 1.7})
    q, u = [*rng.normal(size=4), lean, 0.7], rng.normal(size=6).tolist()
    expected = composite_body(equations.mechanism, state_of(equations.mechanism, float, 0.0, q, u, values))
    *_, H, gamma = equations.lambdify("terms")(q, u, 0.0, values)
    assert pytest.approx(np.array(expected.constraint_jacobian, dtype=float), rel=1e-12, abs=1e-12) == H
    assert gamma == pytest.approx(np.array(expected.constraint_forcing, dtype=float), rel=1e-12, abs=1e-12)
