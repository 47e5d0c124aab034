"""Boxes of one size that meet flush: every corner of one is at the very end of a face of the other."""

from __future__ import annotations

import math

import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

ON_A_CART = """\
multibody_sym: 1
name: on_a_cart
gravity: [0, -10, 0]
bodies: {cart: {shape: {box: [0.2, 0.2, 1], mass: 50}}, b: {shape: {box: [0.2, 0.5, 0.2], mass: 3}}}
joints:
  jc: {type: prismatic, parent: ground, child: cart, axis: x, motion: 4.2*t^2/2}
  jb: {type: planar, parent: ground, child: b, q: [x, y, p], initial: {q: [0, 0.35, 0]}}
contacts: {c: {between: [b, cart.top], static: 0.8}}
simulation: {t_end: 0.6, samples: 2}
"""


def test_a_box_tips_from_the_start_on_a_cart_as_wide_as_it_is() -> None:
    """It turns about the corner at which both bodies have one, whose rows are alike at the start alone."""
    inertia = (0.2**2 + 0.5**2) / 12 + 0.1**2 + 0.25**2

    def rate(_: float, y: list[float]) -> list[float]:
        along, above = (0.1 * math.cos(y[0]) - 0.25 * math.sin(y[0]), 0.1 * math.sin(y[0]) + 0.25 * math.cos(y[0]))
        return [y[1], (4.2 * above - 10 * along) / inertia]

    turned = solve_ivp(rate, (0, 0.6), [0, 0], rtol=1e-10, atol=1e-12).y[0, -1]
    assert mbs.simulate(mbs.loads(ON_A_CART)).q[-1, 2] == pytest.approx(turned, abs=1e-8)
