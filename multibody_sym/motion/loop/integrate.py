"""Integration of loaded programs: one call that runs the loop in C or Python, shows progress and keeps what it has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.motion.loop.native_loop import native_loop
from multibody_sym.motion.loop.problem import Chunk, Event, Loop, Problem, Progress, RunFailure, Statistics
from multibody_sym.motion.methods.table import LibraryMethod
from multibody_sym.program.runtime_constants import Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats


@dataclass(frozen=True)
class Integration:
    """Samples t (m,), q (m, nq), u (m, nu) as far as the run got, the state (q_final, u_final) at t_final, statistics.

    A run that stops at an event has its last sample there. `failure` is None for it, and for one that reached t_end.
    `singular`: when the run passed singular positions.
    """

    t: Floats
    q: Floats
    u: Floats
    t_final: float
    q_final: Floats
    u_final: Floats
    taken: Statistics | Callable[[], Statistics]
    failure: RunFailure | None
    events: tuple[Event, ...] = ()
    singular: tuple[float, ...] = ()

    @property
    def statistics(self) -> Statistics:
        """What the run took, which is `taken` from where it is when somebody asks."""
        return self.taken if isinstance(self.taken, Statistics) else self.taken()

    @property
    def status(self) -> Status:
        """DONE, STOPPED by an event, or the status of the failure."""
        if self.failure:
            return self.failure.status
        return Status.STOPPED if _ends_run(self.events) else Status.DONE


_NOTHING: Final = Statistics()


def integrate(
    problem: Problem, *, on_chunk: Callable[[Chunk], None] | None = None, loop: Loop | None = None
) -> Integration:
    """Return the motion of `problem`; a run that fails, or is interrupted by Ctrl-C, keeps what it had computed.

    `on_chunk` is called about ten times a second with the samples that are new (perhaps none), for a progress bar or
    to write them. `loop` is the one that fits `problem.compiled` unless another is given.
    """
    run = loop or loop_for(problem)
    times, samples, nq = problem.times(), np.empty((problem.samples, len(problem.x0))), len(problem.q0)
    progress = Progress(0, problem.t0, problem.x0, _NOTHING, None)
    try:
        with np.errstate(all="ignore"):
            for latest in run(problem, samples):
                before, progress = progress, latest
                if _ends_run(latest.events):
                    times[latest.written - 1] = latest.time
                if on_chunk is not None:
                    new = slice(before.written, latest.written)
                    on_chunk(Chunk(before.written, times[new], samples[new, :nq], samples[new, nq:], latest.time))
    except KeyboardInterrupt:
        progress = replace(progress, failure=RunFailure(Status.INTERRUPTED, progress.time, None))
    written = slice(progress.written)
    return Integration(
        t=times[written],
        q=samples[written, :nq],
        u=samples[written, nq:],
        t_final=progress.time,
        q_final=progress.x[:nq],
        u_final=progress.x[nq:],
        taken=progress.statistics,
        failure=progress.failure,
        events=progress.events,
        singular=progress.singular,
    )


def _ends_run(events: tuple[Event, ...]) -> bool:
    return bool(events) and events[-1].terminal


def loop_for(problem: Problem) -> Loop:
    """Return the loop, in C or Python, that fits the problem's Programs and method."""
    if not len(problem.x0):
        from multibody_sym.motion.loop.python_loop import prescribed_loop

        return prescribed_loop
    if problem.compiled.backend == "c" and not isinstance(problem.method, LibraryMethod):
        return native_loop
    from multibody_sym.motion.loop.python_loop import python_loop

    return python_loop


def first_loop(problem: Problem) -> Loop:
    """Return the loop of a run that begins, which may end where it does."""
    return loop_for(problem) if held_at_start(problem) is None else end_at_once


def held_at_start(problem: Problem) -> int | None:
    """Return the index of the first stop whose condition holds at the start, None if there is none."""
    if not any(problem.terminal):
        return None
    stops = slice(len(problem.terminal) - len(problem.margins))
    values = problem.switching(problem.t0, problem.x0)[stops]
    holding = np.flatnonzero((values > 0.0) & np.array(problem.terminal[stops], dtype=bool))
    return int(holding[0]) if len(holding) else None


def end_at_once(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Write the start and stop there: a `Loop` for a problem with a stop that holds."""
    index = held_at_start(problem)
    assert index is not None
    samples[0] = problem.x0
    yield Progress(1, problem.t0, problem.x0, Statistics(), None, (Event(problem.t0, index, True),))
