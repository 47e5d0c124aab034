"""The error of a run's end, as a coarser run shows it: larger tolerances, or twice the step."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.motion.loop.integrate import Integration, integrate
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

COARSER: Final = 100
"""By how much the tolerances of coarser runs are larger."""
LEFT: Final = 0.1
"""The part that is left of an error by a tolerance so much smaller; errors fall faster."""
_MOST_STEPS: Final = 20_000
"""Steps of a run that is made once more."""


@dataclass(frozen=True, eq=False)
class EndChanges:
    """By how much a coarser run ends at another time and state; the `part` of it that bounds the error of the run."""

    t: float
    q: Floats
    u: Floats
    part: float


def end_changes(problem: Problem, done: Integration) -> EndChanges | None:
    """Return what a coarser run changes at the end; None of long runs and those that fail, or end otherwise."""
    if done.failure is not None or done.statistics.steps > _MOST_STEPS or not len(problem.x0):
        return None
    if problem.step is None:
        coarser = replace(problem, samples=2, rtol=COARSER * problem.rtol, atol=COARSER * problem.atol)
    else:
        coarser = replace(problem, samples=2, step=2.0 * problem.step)
    other = integrate(coarser)
    if other.status is not done.status:
        return None
    q, u = np.abs(other.q_final - done.q_final), np.abs(other.u_final - done.u_final)
    return EndChanges(abs(other.t_final - done.t_final), q, u, LEFT if problem.step is None else 1.0)
