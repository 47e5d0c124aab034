"""Runs that go on in another problem where a switching function of the mode they are in says that it ends.

All parts share the samples and the time from which steps are counted; each has Programs of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.integrators.flow import Status
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.course import Passage
from multibody_sym.runtime.integration import loop_for
from multibody_sym.runtime.problem import Begun, Event, Loop, Problem, Progress, RunFailure, Statistics


@dataclass(frozen=True)
class Leg:
    """A part of a run in one problem: samples number `first` up to `end`, in time up to `until`, by so many `steps`.

    It is the problem `of` a mode, begun where it was entered if that was passed `since`. `before`: the steps that the
    loop that took these had taken before.
    """

    of: Problem
    first: int
    end: int
    until: float
    steps: int = 0
    since: Passage | None = None
    before: int = 0

    @cached_property
    def problem(self) -> Problem:
        """The problem from the start of this part on."""
        if self.since is None:
            return self.of
        passed, nq = self.since, len(self.of.q0)
        q, u = passed.x[:nq], passed.x[nq:]
        return replace(self.of, begun=Begun(passed.time, self.first), q0=q, u0=u, margins=passed.margins)

    @staticmethod
    def entered(of: Problem, since: Passage) -> Leg:
        """Return the part of a run that has just passed into a mode."""
        return Leg(of, since.written, since.written, since.time, 0, since, since.steps)

    def passed(self, end: int, until: float, steps: int) -> Leg:
        """Return it as far as it has come, by the steps of its loop."""
        return Leg(self.of, self.first, end, until, steps - self.before, self.since, self.before)


@dataclass(frozen=True)
class Switch:
    """Where a part of a run ended: the state x (nq + nu,) at `begun`, by switching function `index` of the mode."""

    begun: Begun
    x: Floats
    index: int


@dataclass(frozen=True)
class Stopped:
    """A stop that a run meets as it goes on in another `problem`, which tells the state there: it has hardly begun."""

    event: Event
    problem: Problem


_AT_SAMPLE: Final = 1e-9
"""The part of the time between samples within which a run stops at the one before."""

Onward = Callable[[Problem, Switch], "Problem | RunFailure | Event | Stopped"]
"""Returns how a run goes on after a switch, which must be a problem begun there; why it cannot; or the stop it met:
before what the switch does, or behind it."""


Across = Callable[[Problem, Switch], "Problem | RunFailure | Event | Stopped | None"]
"""The same where no step leads on, as rows come to depend on each other; None where nothing else does."""


def chain(onward: Onward, legs: list[Leg], across: Across | None = None) -> Loop:
    """Return the loop of a run that goes on as `onward` says, and `across`, if it is given.

    Its parts are added to `legs`, the one under way last.
    """

    def loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
        done = Progress(0, problem.start, problem.x0, Statistics(), None)
        legs.append(Leg(problem, 0, 0, problem.start))
        while True:
            latest = done
            for progress in loop_for(problem)(problem, samples):
                problem = legs[-1].of  # the loop may have gone on from mode to mode
                latest = _joined(done, progress, problem)
                legs[-1] = legs[-1].passed(latest.written, latest.time, progress.statistics.steps)
                if _switched(progress, problem) is None and not _is_singular(latest, problem):
                    yield latest
            index = _switched(progress, problem)
            at = Begun(latest.time, latest.written)
            following = None
            if across is not None and _is_singular(latest, problem):
                following = across(problem, Switch(at, latest.x, -1))
            if following is not None:
                latest = replace(latest, failure=None)
            elif index is None or latest.failure is not None:
                if _is_singular(latest, problem):
                    yield latest
                return
            if problem.is_over(latest.time) or latest.written == len(samples):
                yield _over(latest, latest.x, samples, legs)
                return
            following = following or onward(problem, Switch(at, latest.x, index or 0))
            if isinstance(following, Event):
                latest = _told(latest, problem, samples)
                legs[-1] = replace(legs[-1], end=latest.written)
                yield replace(latest, events=(*latest.events, following))
                return
            if isinstance(following, Stopped):
                yield _stopped_behind(latest, following, samples, legs)
                return
            if isinstance(following, RunFailure):
                yield replace(latest, failure=following)
                return
            left = problem.max_steps - progress.statistics.steps
            problem, done = replace(following, max_steps=max(left, 1)), latest
            legs.append(Leg(problem, latest.written, latest.written, latest.time))
            if problem.is_over(problem.start):  # the end of the run is where it switched
                yield _over(replace(latest, time=problem.start), problem.x0, samples, legs)
                return

    return loop


def _over(latest: Progress, x: Floats, samples: Floats, legs: list[Leg]) -> Progress:
    """Return the progress at the end of the run, what is left of the samples being the state there."""
    samples[latest.written :] = x
    legs[-1] = replace(legs[-1], end=len(samples), until=latest.time)
    return replace(latest, written=len(samples), x=x)


def _told(latest: Progress, problem: Problem, samples: Floats) -> Progress:
    """Return the progress with a sample of where the run stops, if that is behind the last one."""
    last, following = problem.times()[latest.written - 1 :][:2] if latest.written < len(samples) else (0.0, np.inf)
    if latest.time - last <= _AT_SAMPLE * (following - last):
        return latest
    samples[latest.written] = latest.x
    return replace(latest, written=latest.written + 1)


def _stopped_behind(latest: Progress, stop: Stopped, samples: Floats, legs: list[Leg]) -> Progress:
    """Return the progress that ends behind a switch, the last sample telling the state there."""
    until, first, problem = stop.event.time, latest.written, stop.problem
    passed = [each for each in problem.times()[first:].tolist() if each <= until]
    for k, time in enumerate(passed, first):
        samples[k] = shortly(problem, time)
    x = shortly(problem, until)
    told = _told(replace(latest, x=x, time=until, written=first + len(passed)), problem, samples)
    first = min(first, told.written - 1)
    samples[told.written - 1] = x
    legs[-1] = replace(legs[-1], end=first)
    legs.append(Leg(problem, first, told.written, until))
    return replace(told, events=(*told.events, stop.event))


def shortly(problem: Problem, time: float) -> Floats:
    """Return the state (nq + nu,) of a run shortly after its start, or before it, by one step of order 4."""
    step = time - problem.start
    return problem.x0 if step == 0.0 else stepped(problem.rates, problem.start, problem.x0, step)


def stepped(rates: Callable[[float, Floats], Floats], t: float, x: Floats, step: float) -> Floats:
    """Return the state (nq + nu,) a step (s) after a state x at time t, of order 4."""
    half, whole = t + 0.5 * step, t + step
    k1 = rates(t, x)
    k2 = rates(half, x + 0.5 * step * k1)
    k3 = rates(half, x + 0.5 * step * k2)
    k4 = rates(whole, x + step * k3)
    state: Floats = x + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return state


def _switched(progress: Progress, problem: Problem) -> int | None:
    """Return the number of the switching function of the mode at which the run stands, None where it goes on."""
    last = progress.events[-1] if progress.events else None
    return last.index - problem.switches if last is not None and last.index >= problem.switches else None


def _is_singular(progress: Progress, problem: Problem) -> bool:
    """Return whether a loop ended as near a singular position; where steps do not cross one, they fail."""
    status = Status.RUNNING if progress.failure is None else progress.failure.status
    short = status in (Status.STEP_UNDERFLOW, Status.NOT_CONVERGED)
    return status is Status.SINGULAR or (short and not problem.crosses)


def _joined(done: Progress, latest: Progress, problem: Problem) -> Progress:
    """Return the progress of a run with a part that was done before."""
    events: tuple[Event, ...] = tuple(event for event in latest.events if event.index < problem.switches)
    return replace(
        latest,
        statistics=done.statistics.joined(latest.statistics),
        events=(*done.events, *events),
        singular=(*done.singular, *latest.singular),
    )
