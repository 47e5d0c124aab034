"""Inverse kinematics: an arm with three joints reaches for a point, within the limits of its joints.

scipy's least squares gets the exact Jacobian of the tip. Run it: `python examples/control/reach.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import multibody_sym as mbs

LENGTHS = (0.4, 0.3, 0.2)  # m
LIMITS = (-2.0, 2.0)  # rad, of each joint


def arm() -> mbs.System:
    """Return rods that hang on each other by hinges, the first one at the origin."""
    bodies, joints, parent = {}, {}, "ground"
    for k, length in enumerate(LENGTHS):
        rod = {"rod": length, "mass": length}
        bodies[f"link{k}"] = mbs.Body(shape=rod, points={"end": [length, 0, 0]})
        joints[f"joint{k}"] = mbs.Revolute(parent, f"link{k}", axis="z", q=f"q{k}")
        parent = f"link{k}.end"
    return mbs.System("arm", gravity=[0, -9.81, 0], bodies=bodies, joints=joints)


def reach(target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles at which the tip is at a point (x, y), or as near as the limits let it."""
    tip = mbs.function(arm(), "frame", frame="link2.end")
    slope = mbs.function(arm(), "jacobian", frame="link2.end", axes="local_world_aligned")
    still = np.zeros(3)
    found = least_squares(
        lambda q: tip(0.0, q, still).position[:2] - target,
        np.full(3, 0.3),
        jac=lambda q: slope(0.0, q, still).jacobian[:2],
        bounds=LIMITS,
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    return np.asarray(found.x)


if __name__ == "__main__":
    where = mbs.function(arm(), "frame", frame="link2.end")
    for target in ([0.5, 0.4], [-0.3, 0.5], [1.2, 0.3]):
        q = reach(np.array(target))
        reached = where(0.0, q, np.zeros(3)).position[:2]
        away = np.linalg.norm(reached - target)
        print(f"for {target}: angles {np.round(np.degrees(q), 2)} deg, {away:.1e} m away")
