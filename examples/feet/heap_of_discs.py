"""A hundred discs fall into a box and come to rest on each other, by time stepping of their contacts.

Usage: heap_of_discs.py [COUNT]: as many discs as COUNT, 100 if left out.
"""

from __future__ import annotations

import sys
import time
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

import multibody_sym as mbs

Floats = NDArray[np.float64]

RADIUS, MASS, HALF_WIDTH, COLUMNS = 0.2, 1.0, 2.1, 10
LAW = {"static": 0.3, "restitution": 0.2}
"""SI units."""


def heap_of_discs(count: int) -> mbs.System:
    """Return discs in rows of ten, a millimetre apart, each row moved sideways against the one below."""
    walls = {
        "floor": mbs.Surface(plane=[0, 0, 0], normal="y"),
        "left": mbs.Surface(plane=[-HALF_WIDTH, 0, 0], normal="x"),
        "right": mbs.Surface(plane=[HALF_WIDTH, 0, 0], normal="-x"),
    }
    bodies, joints, contacts = {"ground": mbs.Body(surfaces=walls)}, {}, {}
    for i in range(count):
        row, column = divmod(i, COLUMNS)
        start = [-1.85 + 0.401 * column + 0.05 * (row % 2), 0.21 + 0.401 * row, 0]
        shape = {"disc": RADIUS, "mass": MASS}
        bodies[f"disc{i}"] = mbs.Body(shape=shape, surfaces={"rim": mbs.Surface(disc=RADIUS)})
        joints[f"free{i}"] = mbs.Planar("ground", f"disc{i}", q=[f"x{i}", f"y{i}", f"phi{i}"], initial={"q": start})
        contacts |= {f"{wall}{i}": mbs.Contact([f"disc{i}.rim", f"ground.{wall}"], **LAW) for wall in walls}
    pairs = combinations(range(count), 2)
    contacts |= {f"pair{i}_{k}": mbs.Contact([f"disc{i}.rim", f"disc{k}.rim"], **LAW) for i, k in pairs}
    return mbs.System("heap_of_discs", gravity=[0, -9.81, 0], bodies=bodies, joints=joints, contacts=contacts)


def overlap(x: Floats) -> float:
    """Return how deep (m) any of the discs at places x, y (count, 2) are in each other or in a wall, at most."""
    apart = np.linalg.norm(x[:, None] - x, axis=2)[np.triu_indices(len(x), 1)] - 2 * RADIUS
    walls = np.concatenate([x[:, 1], x[:, 0] + HALF_WIDTH, HALF_WIDTH - x[:, 0]]) - RADIUS
    return -float(np.concatenate([apart, walls]).min())


def main(count: int = 100) -> None:
    """Run, and print steps, time, and what is left of overlap and energy."""
    begun, system = time.process_time(), heap_of_discs(count)
    run = mbs.simulate(system, t_end=2, method="moreau", step="1 ms")
    took = time.process_time() - begun
    places = run.q.reshape(len(run.t), count, 3)[:, :, :2]
    print(f"{count} discs, {len(system.contacts)} contacts: {run.statistics['steps']} steps in {took:.1f} s of CPU")
    print(f"overlap {max(map(overlap, places)):.1e} m; at the end nothing is faster than {np.abs(run.u[-1]).max():.1e}")
    lost, rubbed = sum(run.impact_losses.values()), -sum(work.total for work in run.friction_work.values())
    print(f"of {run.energy[0]:.1f} J impacts took {lost:.1f} J, friction {rubbed:.1f} J")
    print(f"the energy account misses {run.energy_residual:.1e} J")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
