"""Collocation: the pushes that swing a pole up on its cart in 2 s with the least effort, by scipy's SLSQP.

Unknown are x, theta, their rates and the push at 41 times; the trapezoidal rule joins each time to the next, with the
exact derivatives of the accelerations at all times in one call. Run it: `python examples/control/swing_up.py`.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import multibody_sym as mbs

SYSTEM = mbs.load(Path(__file__).parent.parent / "cart_pole.yaml")
BEGIN, END = np.array([0, -np.pi / 2, 0, 0]), np.array([0, np.pi / 2, 0, 0])
N, t, h, k, E = 41, np.linspace(0, 2, 41), 2 / 40, np.arange(40), np.eye(4, 5)
motion = mbs.function(SYSTEM, "state_derivative")
derivatives = [motion.derivative(by) for by in ("q", "u", "inputs")]


def rates(function: mbs.Function, z: np.ndarray) -> np.ndarray:
    return np.hstack(function(t, z[:, :2], z[:, 2:4], inputs=z[:, 4:])[:2])  # of qdot and udot


def gaps(flat: np.ndarray) -> np.ndarray:
    z, f = flat.reshape(N, 5), rates(motion, flat.reshape(N, 5))
    return np.r_[(z[1:, :4] - z[:-1, :4] - h / 2 * (f[1:] + f[:-1])).ravel(), z[0, :4] - BEGIN, z[-1, :4] - END]


def slopes(flat: np.ndarray) -> np.ndarray:
    D, J = np.dstack([rates(f, flat.reshape(N, 5)) for f in derivatives]), np.zeros((N + 1, 4, N, 5))
    J[k, :, k], J[k, :, k + 1], J[-2, :, 0], J[-1, :, -1] = -E - h / 2 * D[:-1], E - h / 2 * D[1:], E, E
    return J.reshape(4 * N + 4, 5 * N)


guess, pushes = np.c_[np.linspace(BEGIN, END, N), np.zeros(N)].ravel(), np.tile(np.eye(5)[4], N)
joined = {"type": "eq", "fun": gaps, "jac": slopes}
found = minimize(lambda z: h * pushes @ z**2, guess, jac=lambda z: 2 * h * pushes * z, constraints=joined)
law = {"push": {"table": np.c_[t, found.x[4::5]].tolist()}}
run = mbs.simulate(SYSTEM, inputs=law, initial={"theta": BEGIN[1]}, t_end=2)
print(f"pushes up to {np.abs(found.x[4::5]).max():.1f} N; a run ends {np.degrees(run['theta'][-1]) - 90:.1f} deg off")
