"""Motions of the examples, and motions by hand to compare them with."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from twins import from_file

import multibody_sym as mbs

Floats = NDArray[np.float64]
G = 9.81


def simulated(name: str, t_end: float, **settings: object) -> mbs.Trajectory:
    """Return the motion of an example until `t_end`, by the generated Python (no compiler is needed)."""
    return mbs.simulate(from_file(name), t_end=t_end, rtol=1e-11, atol=1e-12, backend="python", **settings)


def run_of(system: mbs.System | str, **settings: object) -> mbs.Trajectory:
    """Return the motion of a system, or of an example, to 12 digits, by the generated Python."""
    declared = from_file(system) if isinstance(system, str) else system
    return mbs.simulate(declared, rtol=1e-12, atol=1e-13, backend="python", **settings)


def by_hand(
    accelerations: Callable[..., Sequence[float]], q: Sequence[float], times: Floats, u: Sequence[float] | None = None
) -> Floats:
    """Return coordinates (n, m) at times, from rest or from speeds u, integrated by scipy; accelerations(t, q, u)."""
    n = len(q)

    def rates(t: float, x: Floats) -> list[float]:
        return [*x[n:], *accelerations(t, x[:n], x[n:])]

    start = [*q, *([0.0] * n if u is None else u)]
    found = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13)
    assert found.success
    return np.asarray(found.y[:n])
