"""Sampling predictive control: a pendulum on a cart is swung up by the best of 200 pushes, tried ahead each time.

All 200 go on from the state of the cart, and in a batch: 40 steps ahead. Run it: `python examples/control/predict.py`.
"""

from pathlib import Path

import numpy as np

import multibody_sym as mbs

DT, PLANS = 0.02, (200, 40)  # s; so many plans of 40 pushes each, which change by the same for 4 steps
MODEL = mbs.load(Path(__file__).parent.parent / "cart_pole.yaml")


def cost(sim: mbs.Stepper) -> np.ndarray:
    """Return how far each pole is from standing upright, over the middle of the rail."""
    return 1.0 - np.sin(sim["theta"]) + 0.1 * sim["x"] ** 2 + 0.02 * sim["u_theta"] ** 2


rng, prepared = np.random.default_rng(1), mbs.prepare(MODEL, method="rk4", step=DT, initial={"theta": -np.pi / 2})
cart, ahead, best = prepared.stepper(DT), prepared.stepper(DT, count=PLANS[0]), np.zeros(PLANS[1])
while cart.t < 6.0:
    noise = np.repeat(rng.standard_normal((PLANS[0], PLANS[1] // 4)), 4, axis=1)
    plans = np.vstack([best, best + 10.0 * noise[1:]])
    ahead.restore(cart.state)
    costs = np.sum([cost(ahead.step(push[:, None])) for push in plans.T], axis=0)
    best = np.append(plans[np.argmin(costs), 1:], 0.0)
    cart.step(plans[np.argmin(costs), :1])
print(f"after {cart.t:.1f} s the pole leans by {np.degrees(np.arccos(np.sin(cart['theta']))):.1f} degrees")
