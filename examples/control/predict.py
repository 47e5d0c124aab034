"""Sampling predictive control: a pendulum on a cart is swung up by the best of 200 pushes, tried ahead each time.

All 200 go on from the state of the cart, and in a batch: 40 steps ahead. Run it: `python examples/control/predict.py`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import multibody_sym as mbs

TRIES, AHEAD, KEPT = 200, 40, 2  # plans, steps of each, and steps of the best one that are taken
MODEL = Path(__file__).parent.parent / "cart_pole.yaml"


def cost(sim: mbs.Stepper) -> np.ndarray:
    """Return how far each pole is from standing upright, over the middle of the rail."""
    return 1.0 - np.sin(sim["theta"]) + 0.1 * sim["x"] ** 2 + 0.02 * sim["u_theta"] ** 2


def swing_up(seconds: float = 6.0, dt: float = 0.02, seed: int = 1) -> mbs.Stepper:
    """Return the cart after so many seconds; the pole hangs down at first."""
    rng = np.random.default_rng(seed)
    prepared = mbs.prepare(mbs.load(MODEL), method="rk4", step=dt, initial={"theta": -np.pi / 2})
    cart, plans = prepared.stepper(dt), prepared.stepper(dt, count=TRIES)
    best = np.zeros(AHEAD)
    while cart.t < seconds:
        tried = best + 10.0 * np.repeat(rng.standard_normal((TRIES, AHEAD // 4)), 4, axis=1)
        tried[0] = best
        plans.restore(cart.state)
        costs = np.sum([cost(plans.step(push[:, None])) for push in tried.T], axis=0)
        best = tried[np.argmin(costs)]
        for push in best[:KEPT]:
            cart.step([push])
        best = np.append(best[KEPT:], np.zeros(KEPT))
    return cart


if __name__ == "__main__":
    cart = swing_up()
    print(f"after {cart.t:.1f} s the pole leans by {np.degrees(np.arccos(np.sin(cart['theta']))):.1f} degrees")
