"""Runs of systems that have no state, as every motion in them is prescribed: nothing is integrated, stops are met."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.integrators.events import Watch
from multibody_sym.integrators.flow import Events, Flow, Step
from multibody_sym.integrators.loop import at_end, reaches
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.problem import Event, Problem, Progress, Statistics

_LEAST_STEPS: Final = 200  # within each of which the conditions are looked at as within a step of a method
_NOTHING: Final = np.zeros(0)


def prescribed_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Pass the samples, which are empty, until the first stop; see `Loop`."""
    stop = _first_stop(problem) if any(problem.terminal) else None
    if stop is None:
        yield Progress(len(samples), problem.t_end, problem.x0, Statistics(), None)
        return
    times = problem.times().tolist()
    written = sum(reaches(stop, time) for time in times)
    written += not at_end(stop, times[written - 1])
    assert stop.event is not None
    yield Progress(written, stop.t_new, problem.x0, Statistics(), None, (Event(stop.t_new, stop.event, True),))


def _first_stop(problem: Problem) -> Step | None:
    """Return the step that a stop ends, None where none does before t_end; its event is an index into `terminal`."""
    stops = np.flatnonzero(problem.terminal)

    def values(t: float, _: Floats) -> Floats:
        return problem.switching(t, _NOTHING)[stops]

    events = Events(values, (True,) * len(stops))
    flow = Flow(problem.method, lambda t, x: _NOTHING, problem.t0, problem.t_end, _NOTHING, events=events)
    watch, count = Watch(flow, events), max(problem.samples - 1, _LEAST_STEPS)
    times = np.linspace(problem.t0, problem.t_end, count + 1).tolist()
    for t, t_new in pairwise(times):
        step = watch.ended(_step(t, t_new - t, t_new), _NOTHING, partial(_step, t))
        if step.event is not None:
            return Step(t, _NOTHING, step.h, step.t_new, _NOTHING, _NOTHING, step.value, event=int(stops[step.event]))
    return None


def _step(t: float, h: float, t_new: float) -> Step:
    return Step(t, _NOTHING, h, t_new, _NOTHING, _NOTHING, lambda theta: _NOTHING)
