"""A problem integrated in C or Python, with progress; once more, coarser, for the error of its end; in legs."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import replace
from functools import cached_property
from time import perf_counter
from typing import Any, Final, Generic, Self, TypeVar

import numpy as np

from multibody_sym.motion.loop.native_loop import native_loop
from multibody_sym.motion.loop.problem import (
    SECONDS,
    Begun,
    Chunk,
    Event,
    Loop,
    Passage,
    Problem,
    Progress,
    RunFailure,
    Statistics,
)
from multibody_sym.motion.methods.table import LibraryMethod
from multibody_sym.program.runtime_constants import LEAST_LEFT, Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.stages import log


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
    times, samples, nq = problem.times(), np.empty((problem.sample_count, len(problem.x0))), len(problem.q0)
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


# ----------------------------------------------------------------------------------------------------------------------
# The error of a run's end, as a coarser run shows it: larger tolerances, or twice the step.


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


# ----------------------------------------------------------------------------------------------------------------------
# Runs that go on in another problem where a switching function of the mode they are in says that it ends.
#
# All parts share the samples and the time from which steps are counted; each has Programs of its own.


@dataclass(frozen=True, eq=False)
class Leg:
    """A part of a run in one problem: samples number `first` up to `end`, in time up to `until`, by so many `steps`.

    It is the problem `of` a mode, begun where it was entered if that was passed `since`. `before`: the steps that the
    loop that took these had taken before.
    """

    of: Problem
    first: int = 0
    end: int = 0
    until: float = 0.0
    steps: int = 0
    since: Passage | None = None
    before: int = 0

    @property
    def start(self) -> float:
        """The time at which it begins."""
        return self.of.start if self.since is None else self.since.time

    @cached_property
    def problem(self) -> Problem:
        """The problem from the start of this part on."""
        if self.since is None:
            return self.of
        passed, nq = self.since, len(self.of.q0)
        q, u = passed.x[:nq], passed.x[nq:]
        return replace(self.of, begun=Begun(passed.time, self.first), q0=q, u0=u, margins=passed.margins)

    def come(self, end: int, until: float, steps: int) -> Self:
        """Return it as far as it has come, by the steps of its loop."""
        return self.changed(end=end, until=until, steps=steps - self.before)

    def entered(self, of: Problem, at: Progress, first: int) -> Self:
        """Return it as it begins where a run has come to, in a problem, with the sample number `first`."""
        return self.changed(of=of, first=first, end=at.written, until=at.time, steps=0, since=None, before=0)

    def passed_into(self, since: Passage) -> Self:
        """Return it as it begins where the loop has passed into its mode once more."""
        first, time, before = since.written, since.time, since.steps
        return self.changed(first=first, end=first, until=time, steps=0, since=since, before=before)

    def changed(self, **values: Any) -> Self:
        """Return it with other values of fields: `replace`, once a sample of an input, in a third of its time."""
        other, own = object.__new__(type(self)), vars(self)
        vars(other).update({name: own[name] for name in self.__dataclass_fields__}, **values)
        return other


LegT = TypeVar("LegT", bound=Leg)


@dataclass(frozen=True)
class Switch:
    """Where a leg ended: the state x (nq + nu,) at `begun`, by switching function `index` of its mode.

    Where no step leads on, as rows come to depend on each other, that is `NO_STEP`; at the end of a part of the run,
    which another one follows, it is `END`.
    """

    begun: Begun
    x: Floats
    index: int


NO_STEP: Final = -1
END: Final = -2


@dataclass(frozen=True, eq=False)
class LegAnswer:
    """Where a leg went on, by its number: the state `after` a jump of speeds, by that of the switching function."""

    leg: int
    time: float
    index: int
    after: Floats


@dataclass(frozen=True, eq=False)
class End(Generic[LegT]):
    """Where a run ends as it might go on in another leg: it fails, or meets a stop, before that `leg` or `behind` it.

    Behind it the leg tells the state there: it has hardly begun.
    """

    failure: RunFailure | None = None
    stop: Event | None = None
    leg: LegT | None = None
    behind: bool = False


_AT_SAMPLE: Final = 1e-9
"""The part of the time between samples within which a run stops at the one before."""

NextLeg = Callable[[LegT, Switch], "LegT | End[LegT] | None"]
"""Returns the leg that follows where one ended, or the end of the run; None where no step leads on and nothing else."""


def chain(next_leg: NextLeg[LegT], legs: list[LegT]) -> Loop:
    """Return the loop of a run from leg to leg: to the first of `legs` it adds others, the one under way last."""

    def loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
        done = Progress(0, problem.start, problem.x0, Statistics(), None)
        legs[-1], run, shown = legs[-1].entered(problem, done, 0), first_loop(problem), perf_counter()
        while True:
            latest, index = yield from _run_leg(run, done, samples, legs)
            problem, following = legs[-1].of, None
            if index is None:
                return
            if index == NO_STEP:
                following = next_leg(legs[-1], Switch(Begun(latest.time, latest.written), latest.x, index))
                if following is None:
                    yield latest
                    return
                latest = replace(latest, failure=None)
            if index != END and (problem.is_over(latest.time) or latest.written == len(samples)):
                due = max(problem.due, latest.written)  # what is left of the samples is the state there
                samples[latest.written : due] = latest.x
                legs[-1] = legs[-1].changed(end=due, until=latest.time)
                latest, index, following = replace(latest, written=due), END, None
                if problem.is_last:
                    yield latest
                    return
            following = following or next_leg(legs[-1], Switch(Begun(latest.time, latest.written), latest.x, index))
            assert following is not None  # a leg ends where another follows, or the run
            if isinstance(following, End):
                yield _end_progress(latest, following, problem, samples, legs)
                return
            done, problem = latest, following.of
            if index != END:  # each part of a run may take so many steps
                problem = replace(problem, max_steps=max(legs[-1].of.max_steps - legs[-1].before - legs[-1].steps, 1))
            first = _first_sample(legs[-1], latest, index)
            legs[-1] = legs[-1].changed(end=first, until=following.start)  # before its last step ended, or behind it
            legs.append(following.entered(problem, latest, first))
            log("leg %d from t = %g s", len(legs), problem.start)
            run = _no_time if problem.is_over(problem.start) else loop_for(problem)
            if perf_counter() - shown > SECONDS:  # many short legs
                yield replace(latest, time=problem.start, x=problem.x0)
                shown = perf_counter()

    return loop


def from_part(first: Problem, loop: Loop) -> Loop:
    """Return the loop of a run in parts, of which this one is the first."""
    return lambda _, samples: loop(first, samples)


def _run_leg(
    run: Loop, done: Progress, samples: Floats, legs: list[LegT]
) -> Generator[Progress, None, tuple[Progress, int | None]]:
    """Run the last leg, yielding progress; return how far it leads, and what ends it: None where the run is over."""
    latest, index = done, None
    for progress in run(legs[-1].of, samples):
        problem = legs[-1].of  # the loop may have gone on from mode to mode
        events = (*done.events, *(event for event in progress.events if event.index < problem.switches))
        statistics, singular = done.statistics.joined(progress.statistics), (*done.singular, *progress.singular)
        latest = replace(progress, statistics=statistics, events=events, singular=singular)
        index = _end_of_leg(progress, problem)
        legs[-1] = legs[-1].come(latest.written, latest.time, progress.statistics.steps)
        if index is None:
            yield latest
    return latest, index


def _end_of_leg(progress: Progress, problem: Problem) -> int | None:
    """Return what ends a leg, as of `Switch`; None where it goes on, or the run is over."""
    failure = progress.failure
    if failure is not None:  # where steps do not cross a singular position, they fail
        short = failure.status in (Status.STEP_UNDERFLOW, Status.NOT_CONVERGED)
        near = failure.status is Status.SINGULAR or (short and not problem.crosses)
        return NO_STEP if near else None
    last = progress.events[-1] if progress.events else None
    if last is not None and last.index >= problem.switches:
        return last.index - problem.switches
    goes_on = problem.is_last or progress.time < problem.t_end or _ends_run(progress.events)
    return None if goes_on else END


def _first_sample(leg: LegT, latest: Progress, index: int) -> int:
    """Return the number of the first sample of what follows a leg: at a time at which inputs change it shows them."""
    if index == END:
        return min(latest.written, leg.of.samples_before(latest.time))
    begun = leg.of.begun
    took = leg.since is None and begun is not None and leg.first < begun.written
    lasts = latest.time - leg.start > LEAST_LEFT * abs(latest.time)
    return leg.first if took and not lasts else latest.written


def _no_time(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Write the samples of a problem that ends where it begins: a `Loop`."""
    written = 0 if problem.begun is None else problem.begun.written
    samples[written : problem.due] = problem.x0
    end = problem.start if problem.is_last else problem.t_end
    yield Progress(max(written, problem.due), end, problem.x0, Statistics(), None)


def _end_progress(latest: Progress, end: End[LegT], problem: Problem, samples: Floats, legs: list[LegT]) -> Progress:
    """Return the progress at the end of a run, a sample telling where it stops."""
    if end.leg is not None:
        legs[-1] = replace(legs[-1], until=end.leg.start)
    if end.stop is None:
        return replace(latest, failure=end.failure)
    if end.leg is not None and end.behind:
        return _stopped_behind(latest, end.stop, end.leg, samples, legs)
    latest = _sample_end(latest, problem, samples)
    legs[-1] = replace(legs[-1], end=latest.written)
    return replace(latest, events=(*latest.events, end.stop))


def _sample_end(latest: Progress, problem: Problem, samples: Floats) -> Progress:
    """Return the progress with a sample of where the run stops, if that is behind the last one."""
    last, following = problem.times()[latest.written - 1 :][:2] if latest.written < len(samples) else (0.0, np.inf)
    if latest.time - last <= _AT_SAMPLE * (following - last):
        return latest
    samples[latest.written] = latest.x
    return replace(latest, written=latest.written + 1)


def _stopped_behind(latest: Progress, stop: Event, leg: LegT, samples: Floats, legs: list[LegT]) -> Progress:
    """Return the progress that ends behind a switch, in a leg, the last sample telling the state there."""
    until, first, problem = stop.time, latest.written, leg.of
    passed = [each for each in problem.times()[first:].tolist() if each <= until]
    for k, each in enumerate(passed, first):
        samples[k] = shortly(problem, each)
    x = shortly(problem, until)
    told = _sample_end(replace(latest, x=x, time=until, written=first + len(passed)), problem, samples)
    first = min(first, told.written - 1)
    samples[told.written - 1] = x
    legs[-1] = replace(legs[-1], end=first)
    legs.append(replace(leg, first=first, end=told.written, until=until))
    return replace(told, events=(*told.events, stop))


def shortly(problem: Problem, time: float) -> Floats:
    """Return the state (nq + nu,) of a run shortly after its start, or before it, by one step of order 4."""
    step = time - problem.start
    return problem.x0 if step == 0.0 else runge_kutta_step(problem.rates, problem.start, problem.x0, step)


def runge_kutta_step(rates: Callable[[float, Floats], Floats], t: float, x: Floats, step: float) -> Floats:
    """Return the state (nq + nu,) a step (s) after a state x at time t, of order 4."""
    half, whole = t + 0.5 * step, t + step
    k1 = rates(t, x)
    k2 = rates(half, x + 0.5 * step * k1)
    k3 = rates(half, x + 0.5 * step * k2)
    k4 = rates(whole, x + step * k3)
    state: Floats = x + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return state
