"""Collocation: the pushes that swing a pole up on its cart in 2 s with the least effort, z = x, theta, rates, push."""

from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import multibody_sym as mbs

cart = mbs.function(mbs.load(Path(__file__).parent.parent / "cart_pole.yaml"), "state_derivative")
slopes = cart.derivative("q", "u", "inputs")
DOWN, UP = np.array([0, -np.pi / 2, 0, 0]), np.array([0, np.pi / 2, 0, 0])
N, t, h, k, E = 41, np.linspace(0, 2, 41), 2 / 40, np.arange(40), np.eye(4, 5)


def defects(flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    z, J = flat.reshape(N, 5), np.zeros((N + 1, 4, N, 5))
    f, D = (np.hstack(each(t, z[:, :2], z[:, 2:4], inputs=z[:, 4:])[:2]) for each in (cart, slopes))
    J[k, :, k], J[k, :, k + 1], J[-2, :, 0], J[-1, :, -1] = -E - h / 2 * D[:-1], E - h / 2 * D[1:], E, E
    missed = (z[1:, :4] - z[:-1, :4] - h / 2 * (f[1:] + f[:-1])).ravel(), z[0, :4] - DOWN, z[-1, :4] - UP
    return np.concatenate(missed), J.reshape(4 * N + 4, 5 * N)  # of the trapezoidal rule and both ends, and by z


guess, pushes = np.c_[np.linspace(DOWN, UP, N), np.zeros(N)].ravel(), np.tile(np.eye(5)[4], N)
joined = {"type": "eq", "fun": lambda z: defects(z)[0], "jac": lambda z: defects(z)[1]}
best = minimize(lambda z: h * pushes @ z**2, guess, jac=lambda z: 2 * h * pushes * z, constraints=joined)
run = mbs.simulate(cart.system, t_end=2, initial={"theta": DOWN[1]}, inputs={"push": mbs.Table(np.c_[t, best.x[4::5]])})
print(f"pushes up to {np.abs(best.x[4::5]).max():.1f} N; a run ends {np.degrees(run['theta'][-1]) - 90:.1f} deg off")
