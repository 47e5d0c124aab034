"""Inverse kinematics: at which angles is the tip of an arm with seven joints at a point?

Run it: `python examples/control/reach.py`.
"""

from pathlib import Path

import numpy as np

import multibody_sym as mbs

ARM = mbs.load(Path(__file__).parent / "arm.yaml")


def reach(*target: float) -> mbs.Posture:
    """Return the posture with the tip at a point (m), or as near as it gets."""
    return mbs.inverse_kinematics(ARM, "link6.end", target)


if __name__ == "__main__":
    for target in ((0.5, 0.4, 0.6), (-0.3, 0.5, 1.0), (3.0, 0.0, 0.0)):
        found = reach(*target)
        print(f"for {target}: angles {np.round(np.degrees(found.q), 1)} deg, {found.missed:.1e} m away")
