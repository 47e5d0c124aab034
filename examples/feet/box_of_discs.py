"""Discs fall into a box and on each other, with friction and without rebound, until all rest.

Usage: box_of_discs.py [COUNT [FIGURE.svg]]: as many discs as COUNT, 10 if left out; FIGURE.svg shows them at rest.
"""

from __future__ import annotations

import math
import sys
import time
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

import multibody_sym as mbs

Floats = NDArray[np.float64]

RADIUS, MASS, GRAVITY, FRICTION = 0.1, 0.5, 9.81, 0.3
PLACE = 0.24
"""The part of the width of the box for each disc of a row; SI units."""


def box_of_discs(count: int, columns: int = 5) -> mbs.System:
    """Return discs that hang in rows over the floor of a box, each row moved sideways against the one below."""
    walls = {
        "floor": mbs.Surface(plane=[0, 0, 0], normal="y"),
        "left": mbs.Surface(plane=[0, 0, 0], normal="x"),
        "right": mbs.Surface(plane=[PLACE * columns, 0, 0], normal="-x"),
    }
    law = {"static": FRICTION}
    bodies, joints, contacts = {"ground": mbs.Body(surfaces=walls)}, {}, {}
    for i in range(count):
        row, place = divmod(i, columns)
        start = [0.12 + 0.23 * place + 0.03 * (row % 2), 0.2 + 0.25 * row, 0]
        shape = {"disc": RADIUS, "mass": MASS}
        bodies[f"disc{i}"] = mbs.Body(shape=shape, surfaces={"rim": mbs.Surface(disc=RADIUS)})
        joints[f"free{i}"] = mbs.Planar("ground", f"disc{i}", q=[f"x{i}", f"y{i}", f"phi{i}"], initial={"q": start})
        contacts |= {f"{wall}{i}": mbs.Contact([f"disc{i}.rim", f"ground.{wall}"], **law) for wall in walls}
    pairs = combinations(range(count), 2)
    contacts |= {f"pair{i}_{k}": mbs.Contact([f"disc{i}.rim", f"disc{k}.rim"], **law) for i, k in pairs}
    return mbs.System(
        "box_of_discs",
        gravity=[0, -GRAVITY, 0],
        bodies=bodies,
        joints=joints,
        contacts=contacts,
        outputs={"held_up": held_up(count), "pushed_right": pushed_right(count)},
    )


def held_up(count: int) -> str:
    """Return the force (N) of floor and walls on all discs, upward: the walls rub."""
    return " + ".join(f"normal(floor{i}) - friction(left{i}) + friction(right{i})" for i in range(count))


def pushed_right(count: int) -> str:
    """Return the force (N) of floor and walls on all discs, to the right."""
    return " + ".join(f"normal(left{i}) - normal(right{i}) + friction(floor{i})" for i in range(count))


def overlap(places: Floats, columns: int = 5) -> float:
    """Return how deep (m) any of the discs at places x, y, angle (count, 3) are in each other or in a wall, at most."""
    x, y = places[:, 0], places[:, 1]
    pairs = (2 * RADIUS - math.dist(a, b) for a, b in combinations(places[:, :2].tolist(), 2))
    return max(*pairs, *(RADIUS - x), *(RADIUS + x - PLACE * columns), *(RADIUS - y))


def at_rest(run: mbs.Trajectory) -> float:
    """Return the first sample (s) from which on nothing moves."""
    moves = np.flatnonzero(run.u.any(axis=1))
    return float(run.t[min(moves[-1] + 1, len(run.t) - 1)])


def main(count: int = 10, figure: str | None = None) -> None:
    """Run, and print events, time, and what is left of overlap, forces and energy at the end."""
    begun, system = time.perf_counter(), box_of_discs(count)
    run = mbs.simulate(system, t_end=2)
    took = time.perf_counter() - begun
    print(f"{count} discs, {len(system.contacts)} contacts: {len(run.events)} events in {took:.1f} s")
    print(f"at rest from t = {at_rest(run):.3f} s; overlap {overlap(run.q[-1].reshape(count, 3)):.1e} m")
    print(f"held up by {run['held_up'][-1]:.9f} N of {count * MASS * GRAVITY:.9f} N")
    print(f"pushed to the right by {run['pushed_right'][-1]:.1e} N")
    print(f"the energy account closes to {run.energy_residual:.1e} J of {run.energy_at_start:.3f} J")
    if figure is not None:
        mbs.draw(system, figure, initial=run.final["coordinates"], names="none")


if __name__ == "__main__":
    main(*(int(word) if word.isdigit() else word for word in sys.argv[1:]))


