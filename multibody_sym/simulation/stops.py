"""Conditions that hold before anything has moved."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from multibody_sym.runtime.problem import Event, Problem, Progress, Statistics


def held_at_start(problem: Problem) -> int | None:
    """Return the index of the first stop whose condition holds at the start, None if there is none."""
    if not any(problem.terminal):
        return None
    state = (problem.t0, problem.q0, problem.u0, problem.parameters)
    inputs = problem.compiled["inputs"](*state)[0] if problem.inputs else np.empty(0)
    (values,) = problem.compiled["events"](*state, inputs, problem.modes)
    holding = np.flatnonzero((values > 0.0) & np.array(problem.terminal))
    return int(holding[0]) if len(holding) else None


def end_at_once(problem: Problem, samples: NDArray[np.float64]) -> Iterator[Progress]:
    """Write the start and stop there: a `Loop` for a problem with a stop that holds."""
    index = held_at_start(problem)
    assert index is not None
    samples[0] = problem.x0
    yield Progress(1, problem.t0, problem.x0, Statistics(), None, (Event(problem.t0, index, True),))
