"""LQR: a pole on a cart, a Furuta pendulum and an arm with seven joints, held where they would fall."""

from pathlib import Path

import numpy as np

import multibody_sym as mbs

PLACES = {
    "../cart_pole": {"x": 0, "theta": "90 deg"},
    "../furuta": {"phi": 0, "theta": "180 deg"},
    "arm": {f"q{k}": 0.2 * (-1) ** k for k in range(7)},
}


def balanced(name: str) -> tuple[mbs.System, dict[str, float], dict[str, object], np.ndarray]:
    """Return a system, the state at its place, the feedback that holds it there, and the eigenvalues designed."""
    system = mbs.load(Path(__file__).parent / f"{name}.yaml")
    near = mbs.trim(system, PLACES[name]).linearize()
    K = near.lqr(np.eye(len(near.states)), np.eye(len(near.inputs)))
    return system, dict(near.at), near.feedback(K), np.linalg.eigvals(near.A - near.B @ K)


if __name__ == "__main__":
    for name in PLACES:
        system, place, law, designed = balanced(name)
        found = mbs.linearize(system, at=place, inputs=law).eigenvalues
        print(name, "has the eigenvalues designed:", np.allclose(np.sort_complex(found), np.sort_complex(designed)))
