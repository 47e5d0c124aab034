"""The integration loop of runtime.c, driven from Python in pieces of about a tenth of a second."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.motion.integrator.flow import steps_before
from multibody_sym.motion.loop.native_problem import NativeProblem, address
from multibody_sym.motion.loop.problem import SECONDS, Event, Jump, Problem, Progress, RunFailure, Statistics, chatters
from multibody_sym.program.native import StateStruct
from multibody_sym.program.runtime_constants import Phase, Status
from multibody_sym.scalars.arrays import Floats

_FIRST_PIECE: Final = 200  # steps; of small systems more, each of which takes less
_SMALL: Final = 20_000  # numbers of the state in the first piece
_LARGEST_PIECE: Final = 10_000_000


def native_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Integrate in C; see `Loop`. What was written before an interruption stays in `samples`."""
    course = None
    if problem.course is not None:
        from multibody_sym.motion.loop.native_course import NativeCourse

        course = NativeCourse.of(problem)
    now = NativeProblem(problem) if course is None else course.now
    x0 = problem.x0
    state, steps, done = StateStruct(), piece_of(problem), False
    events: list[Event] = []
    singular: list[float] = []
    library, at = now.library, ctypes.byref(state)
    work = np.zeros(now.work if course is None else course.work)
    room, first, width = address(work), samples.ctypes.data, samples.itemsize * len(x0)
    library.mbs_start(now.handle, address(x0), at, room)
    if problem.begun is not None:
        state.t = state.t_new = problem.begun.time
        state.sample = problem.begun.written
        if problem.step is not None:
            state.grid = steps_before(problem.t0, problem.begun.time, problem.step)
    while not done:
        begin, before = time.perf_counter(), state.steps
        left = steps
        while left > 0 and not done and not (left < steps and time.perf_counter() - begin > SECONDS):
            rows = ctypes.c_longlong(problem.sample_count - state.sample)
            piece = ctypes.c_longlong(left)
            to = ctypes.c_void_p(first + width * state.sample)
            if course is None:
                library.mbs_integrate(now.handle, at, room, piece, rows, to)
            else:
                library.mbs_follow(course.handle, at, room, piece, rows, to)
                course.passed()
                now = course.now
            done = state.status != Status.RUNNING
            left = before + steps - state.steps
            if state.event >= now.problem.switches and _jump_if_due(problem.jump, now, state, work):
                done = False
            elif state.event >= 0:
                events.append(Event(state.t, state.event, now.problem.terminal[state.event]))
                if chatters(problem, events):
                    state.status, state.failure_time, state.component = Status.CHATTERS, state.t, -1
                    done = True
            singular += state.singular[: state.passed]
        seconds = max(time.perf_counter() - begin, 1e-6)
        steps = max(1, min(10 * steps, int(steps * SECONDS / seconds), _LARGEST_PIECE))
        status, failure = Status(state.status), None
        if status not in (Status.RUNNING, Status.DONE, Status.STOPPED):
            failure = RunFailure(status, state.failure_time, state.component if state.component >= 0 else None)
        x, statistics = work[: len(x0)].copy(), statistics_of(problem, state)
        yield Progress(state.sample, state.t, x, statistics, failure, tuple(events), tuple(singular))


def piece_of(problem: Problem) -> int:
    """Return how many steps of a problem take no time that anybody waits for."""
    return max(_FIRST_PIECE, _SMALL // len(problem.x0))


def _jump_if_due(jump: Jump | None, now: NativeProblem, state: StateStruct, work: Floats) -> bool:
    """Let a run that stands at a switch go on with the state after a jump, if there is one."""
    problem = now.problem
    index, size = state.event - problem.switches, len(problem.x0)
    after = None if jump is None or problem.is_over(state.t) else jump(state.t, work[:size].copy(), index)
    if after is None:
        return False
    work[:size] = after
    now.margins[index] = min(now.margins[index], 0.0)
    state.status, state.phase, state.crossing, state.origin = Status.RUNNING, Phase.STARTING, -1, -1
    return True


def statistics_of(problem: Problem, state: StateStruct) -> Statistics:
    """Return what a run took until now."""
    rows, steps = math.isfinite(state.least_rank), state.steps
    return Statistics(  # in their order: with names it takes twice as long, once a run
        steps,
        state.rejected,
        state.evaluations,
        state.jacobians,
        state.factorisations,
        (state.t - problem.start) / steps if steps else 0.0,
        state.drift_position,
        state.drift_velocity,
        state.removed_position,
        state.removed_velocity,
        state.quaternion_deviation,
        int(state.least_rank) if rows else 0,
        int(state.greatest_rank),
        state.conditioning if rows else 1.0,
        state.conditioning_time,
    )
