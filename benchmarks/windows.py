"""Windows of a four-bar in a row: the planar linkage whose size several programs and tests choose."""

from __future__ import annotations

from typing import Any

import multibody_sym as mbs

GRAVITY = 9.81


def windows(count: int, t_end: float = 10.0) -> mbs.System:
    """Return the system, rods of 1 m and 1 kg: cranks upright, each with the coupler to its right at 1 m/s.

    The other end of a coupler is pinned to the next crank, which cuts the loop there.
    """
    rod = mbs.Body(shape={"rod": 1, "mass": 1}, points={"end": [1, 0, 0]})
    bodies = {"ground": mbs.Body(points={f"pivot{i}": [i, 0, 0] for i in range(count + 1)})}
    joints: dict[str, Any] = {}
    for i in range(count + 1):
        bodies[f"crank{i}"] = rod
        joints[f"A{i}"] = mbs.Revolute(f"ground.pivot{i}", f"crank{i}", axis="z", initial={"q": "90 deg", "u": -1})
    for i in range(count):
        bodies[f"coupler{i}"] = rod
        joints[f"B{i}"] = mbs.Revolute(f"crank{i}.end", f"coupler{i}", axis="z", initial={"q": "-90 deg", "u": 1})
        joints[f"C{i}"] = mbs.Revolute(f"coupler{i}.end", f"crank{i + 1}.end", axis="z", cut=True)
    return mbs.System("windows", gravity=[0, -GRAVITY, 0], bodies=bodies, joints=joints, simulation={"t_end": t_end})
