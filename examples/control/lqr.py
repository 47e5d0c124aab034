"""LQR: a pole on a cart, a Furuta pendulum and an arm with seven joints, held where they would fall.

Run it: `python examples/control/lqr.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.linalg import solve_continuous_are

import multibody_sym as mbs

MODELS = Path(__file__).parent.parent


def balanced(system: mbs.System, at: dict[str, object]) -> tuple[mbs.System, np.ndarray, Mapping[str, float]]:
    """Return the system with inputs that hold it at a position, the eigenvalues designed, and the state."""
    held = mbs.trim(system, at)
    near = mbs.linearize(system, at=held.state, inputs=held.inputs)
    weights = np.eye(len(near.states)), np.eye(len(near.inputs))
    K = near.B.T @ solve_continuous_are(near.A, near.B, *weights)
    off = [mbs.variable(name) - near.at[name] for name in near.states]
    laws = {
        name: held.inputs[name] - sum(k * x for k, x in zip(row, off, strict=True))
        for name, row in zip(near.inputs, K.tolist(), strict=True)
    }
    return replace(system, inputs=laws), np.linalg.eigvals(near.A - near.B @ K), held.state


def arm(count: int = 7) -> mbs.System:
    """Return rods on each other with a motor in each joint, whose axes are y and z in turn."""
    bodies, joints, forces, parent = {}, {}, {}, "ground"
    for k in range(count):
        bodies[f"link{k}"] = mbs.Body(shape={"box": [0.3, 0.05, 0.04], "mass": 2 - k / 5}, points={"end": [0.3, 0, 0]})
        joints[f"joint{k}"] = mbs.Revolute(parent, f"link{k}", axis="yz"[k % 2], q=f"q{k}")
        forces[f"motor{k}"] = mbs.Torque(mbs.variable(f"tau{k}"), joint=f"joint{k}")
        parent = f"link{k}.end"
    inputs = {f"tau{k}": 0 for k in range(count)}
    return mbs.System("arm", gravity=[0, 0, -9.81], bodies=bodies, joints=joints, forces=forces, inputs=inputs)


CASES = {
    "cart_pole": (mbs.load(MODELS / "cart_pole.yaml"), {"x": 0, "theta": "90 deg"}),
    "furuta": (mbs.load(MODELS / "furuta.yaml"), {"phi": 0, "theta": "180 deg"}),
    "arm": (arm(), {f"q{k}": 0.2 * (-1) ** k for k in range(7)}),
}

if __name__ == "__main__":
    for name, (system, at) in CASES.items():
        closed, designed, place = balanced(system, at)
        found = mbs.linearize(closed, at=place).eigenvalues
        apart = np.abs(np.sort_complex(found) - np.sort_complex(designed)).max()
        print(f"{name}: slowest eigenvalue {found[0].real:.3f} 1/s, {apart:.1e} from the one designed")
