"""Identification: what motion and torques tell of the masses of an arm, by least squares on its regressor.

Only the base parameters show in torques: combinations of masses and moments. Run it:
`python examples/control/identify.py`.
"""

from pathlib import Path

import numpy as np

import multibody_sym as mbs

ARM = mbs.load(Path(__file__).parent / "arm.yaml")
BASE = mbs.base_parameters(ARM)
torques, regressor = mbs.function(ARM, "inverse_dynamics"), mbs.function(ARM, "regressor")


def identified(noise: float, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Return the base parameters as torques with noise (N m) of random motions tell them, and as they are."""
    rng = np.random.default_rng(0)
    q, u, udot = rng.uniform(-2, 2, (3, count, 7))
    measured = torques(0.0, q, u, udot) + noise * rng.standard_normal((count, 7))
    Y, theta = regressor(0.0, q, u, udot)
    found = np.linalg.lstsq(Y[:, :, BASE.columns].reshape(7 * count, -1), measured.ravel(), rcond=None)[0]
    return found, BASE.combination @ theta[0]


if __name__ == "__main__":
    for name, found, true in zip(BASE.names, *identified(0.1), strict=True):
        print(f"{found:8.4f} {true:8.4f} {name}")
