"""Identification: what motion and torques tell of the masses of an arm, by least squares on its regressor.

Only the base parameters show in torques: combinations of masses and moments. Run it:
`python examples/control/identify.py`.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr

import multibody_sym as mbs


def arm(payload: float) -> mbs.System:
    """Return an arm with three joints that carries a payload."""
    rod = {"rod": 0.5, "mass": 1.5}
    bodies = {name: mbs.Body(shape=rod, points={"end": [0.5, 0, 0]}) for name in ("upper", "lower")}
    bodies["hand"] = mbs.Body(mass=payload, com=[0.1, 0.02, 0], inertia={"Ixx": 0.01, "Iyy": 0.01, "Izz": 0.01})
    joints = {
        "shoulder": mbs.Revolute("ground", "upper", axis="y", q="q0"),
        "elbow": mbs.Revolute("upper.end", "lower", axis="y", q="q1"),
        "wrist": mbs.Revolute("lower.end", "hand", axis="z", q="q2"),
    }
    return mbs.System("arm", gravity=[0, 0, -9.81], bodies=bodies, joints=joints)


def identified(payload: float, noise: float, count: int = 200) -> tuple[float, int]:
    """Return how far off torques of a new motion are predicted (N m), and the number of base parameters."""
    rng, truth, model = np.random.default_rng(0), arm(payload), arm(1.0)
    torques, regressor = mbs.function(truth, "inverse_dynamics"), mbs.function(model, "regressor")
    q, u, udot = rng.uniform(-2, 2, (3, count, 3))
    Y = regressor(0.0, q, u, udot).regressor.reshape(3 * count, -1)
    measured = torques(0.0, q, u, udot).ravel() + noise * rng.standard_normal(3 * count)
    _, R, order = qr(Y, mode="economic", pivoting=True)
    base = order[: np.linalg.matrix_rank(R)]
    theta = np.zeros(Y.shape[1])
    theta[base] = np.linalg.lstsq(Y[:, base], measured, rcond=None)[0]
    new = rng.uniform(-2, 2, (3, 50, 3))
    predicted = regressor(0.0, *new).regressor @ theta
    return float(np.abs(predicted - torques(0.0, *new)).max()), len(base)


if __name__ == "__main__":
    for noise in (0.0, 0.1):
        error, count = identified(0.8, noise)
        print(f"noise {noise} N m: {count} of 30 parameters are found, torques are predicted to {error:.1e} N m")
