"""Whether stiffness keeps the steps of a run short: how fast its motion swings or dies down where it ended."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.integrators.methods.collocation import Collocation
from multibody_sym.numerics.arrays import UNDEFINED, Floats

if TYPE_CHECKING:
    from multibody_sym.simulation.trajectory import Trajectory

_SHORT: Final = 0.005
"""Steps of a run that follow a swing are longer than this part of 1/omega, at the least tolerances too."""
_OFTEN: Final = 1e4
"""How often in a run what is stiff could swing (by radians) or die down."""
_MOST: Final = 200
"""The largest state whose rates are differenced."""
_BESIDE: Final = (1e-6, 1e-7)
"""How far beside a state its rates are taken, as a part of its size: smooth ones have the same slope by both."""
_SMOOTH: Final = 0.01
_CURE: Final = "look at the value and the unit of what is so stiff"


def stiffness_of(run: Trajectory, time: float) -> str:
    """Return what is so stiff that it keeps steps short at the end of a run, and what to do; empty if nothing is."""
    steps = run.integration.statistics.steps
    found = _fastest(run, time)
    if found is None or not steps:
        return ""
    (value, name), span = found, run.problem.t_end - run.problem.t0
    if abs(value) * (time - run.problem.t0) < _SHORT * steps or abs(value) * span < _OFTEN:
        return ""
    if abs(value.imag) >= abs(value.real):
        swings = abs(value.imag) * span / (2.0 * math.pi)
        return (
            f"{name} is stiff, it swings with omega = {abs(value.imag):.3g} rad/s there, {swings:.3g} times in the "
            f"run, and every swing takes steps; {_CURE}; where its swings do not matter hold it by a joint or "
            "constraint, or damp it and take an implicit method (method: radau_5)"
        )
    if isinstance(run.problem.method, Collocation) or value.real > 0.0:
        return ""
    return (
        f"{name} is stiff, it dies down within {1.0 / abs(value.real):.3g} s there, and {run.problem.method.name} "
        f"takes steps as short as that; take an implicit method (method: radau_5), or {_CURE}"
    )


def _fastest(run: Trajectory, time: float) -> tuple[complex, str] | None:
    """Return the largest eigenvalue (1/s) of the motion beside the end of a run, and the coordinate with most of it.

    None where the rates are not smooth there, or have no values.
    """
    end = run.integration
    if end.q_final is None or end.u_final is None or not 0 < len(end.q_final) + len(end.u_final) <= _MOST:
        return None
    x = np.concatenate([end.q_final, end.u_final])
    try:
        slopes = [_slope(run, time, x, part) for part in _BESIDE]
    except UNDEFINED:
        return None
    if not all(np.isfinite(slope).all() for slope in slopes):
        return None
    sizes = [float(np.linalg.norm(slope)) for slope in slopes]
    if abs(sizes[0] - sizes[1]) > _SMOOTH * max(sizes):
        return None
    values, vectors = np.linalg.eig(slopes[0])
    k = int(np.argmax(np.abs(values)))
    coordinates = run.ready.mechanism.coordinates
    return complex(values[k]), coordinates[int(np.argmax(np.abs(vectors[: len(coordinates), k])))].name


def _slope(run: Trajectory, time: float, x: Floats, part: float) -> Floats:
    """Return how the rates of a state (n,) follow it, by differences."""
    size = np.where(np.abs(x) > 0.0, np.abs(x), 1.0)
    found: Floats = np.stack(
        [(_rates(run, time, x + part * size[k] * e) - _rates(run, time, x - part * size[k] * e)) / (2 * part * size[k])
         for k, e in enumerate(np.eye(len(x)))],
        axis=1,
    )
    return found


def _rates(run: Trajectory, t: float, x: Floats) -> Floats:
    """Return the rates of a state (n,)."""
    problem = run.problem if run.modes is None else run.modes.legs[-1].problem
    known = t, x[: len(problem.q0)], x[len(problem.q0) :], problem.parameters
    inputs = problem.compiled["inputs"](*known)[0] if problem.inputs else np.zeros(0)
    qdot, udot, *_ = problem.compiled["state_derivative"](*known, inputs, problem.modes)
    return np.concatenate([qdot, udot])
