"""Windows of a four-bar in a row: the planar linkage whose size several programs and tests choose."""

from __future__ import annotations

import math
import random
from itertools import accumulate
from typing import Any

import multibody_sym as mbs

GRAVITY = 9.81


def windows(count: int, t_end: float = 10.0, seed: int | None = None) -> mbs.System:
    """Return the system, rods of 1 m and 1 kg: cranks upright, each with the coupler to its right at 1 m/s.

    The other end of a coupler is pinned to the next crank, which cuts the loop there. With a `seed` all lengths,
    masses and distances are unlike, and the start is alike: cranks upright, couplers from tip to tip without turning.
    """
    of = random.Random(seed).uniform if seed is not None else _alike
    cranks = [of(0.9, 1.1) for _ in range(count + 1)]
    feet = [0.0, *accumulate(of(0.9, 1.1) for _ in range(count))]
    bodies: dict[str, Any] = {"ground": mbs.Body(points={f"pivot{i}": [x, 0, 0] for i, x in enumerate(feet)})}
    joints: dict[str, Any] = {}
    for i, length in enumerate(cranks):
        bodies[f"crank{i}"] = _rod(length, of(0.9, 1.1))
        initial = {"q": "90 deg", "u": -cranks[0] / length}
        joints[f"A{i}"] = mbs.Revolute(f"ground.pivot{i}", f"crank{i}", axis="z", initial=initial)
    for i in range(count):
        across, up = feet[i + 1] - feet[i], cranks[i + 1] - cranks[i]
        bodies[f"coupler{i}"] = _rod(math.hypot(across, up), of(0.9, 1.1))
        initial = {"q": math.atan2(up, across) - math.pi / 2, "u": cranks[0] / cranks[i]}
        joints[f"B{i}"] = mbs.Revolute(f"crank{i}.end", f"coupler{i}", axis="z", initial=initial)
        joints[f"C{i}"] = mbs.Revolute(f"coupler{i}.end", f"crank{i + 1}.end", axis="z", cut=True)
    return mbs.System("windows", gravity=[0, -GRAVITY, 0], bodies=bodies, joints=joints, simulation={"t_end": t_end})


def _alike(_least: float, _most: float) -> float:
    return 1.0


def _rod(length: float, mass: float) -> mbs.Body:
    return mbs.Body(shape={"rod": length, "mass": mass}, points={"end": [length, 0, 0]})
