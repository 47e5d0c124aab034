"""A crane: the acceleration of its trolley, computed 50 times a second, brings the load to rest 6 m away.

Run it: `python examples/control/crane.py`.
"""

from pathlib import Path

import numpy as np

import multibody_sym as mbs

EVERY, GOAL = 0.02, 6.0
crane = mbs.load(Path(__file__).parent / "trolley.yaml")
near = mbs.linearize(crane, at={"x": GOAL})  # states x, theta, u_theta, v
K = near.discrete(EVERY).lqr(np.diag([1.0, 10.0, 10.0, 1.0]), np.eye(1))


def law(t: float, q: np.ndarray, u: np.ndarray) -> float:
    """Return the acceleration (m/s^2) that leads to the goal; q is x, theta and the state v, u their speeds."""
    return float(-K[0] @ [q[0] - GOAL, q[1], u[1], q[2]])


def travel() -> mbs.Trajectory:
    """Return 20 s of the motion, with all of it that is not linear."""
    return mbs.simulate(crane, t_end=20, inputs={"a": law, "every": EVERY})


if __name__ == "__main__":
    run = travel()
    swing = np.degrees(np.abs(run["theta"]).max())
    print(f"the load is at {run['reach'][-1]:.4f} m after 20 s; the rope swung by {swing:.1f} deg")
