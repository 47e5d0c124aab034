"""The integration loop of runtime.c in Python: the same steps and, to the bit, the same trajectory."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import field, replace
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.motion.integrator.events import Watch
from multibody_sym.motion.integrator.flow import (
    Counts,
    Events,
    Flow,
    RowClosure,
    StageEquations,
    Step,
    StepError,
    ordinary,
)
from multibody_sym.motion.integrator.loop import at_end, interpolate_step, reaches, steps
from multibody_sym.motion.integrator.singular import strays
from multibody_sym.motion.loop.problem import SECONDS, Event, Problem, Progress, RunFailure, Statistics, chatters
from multibody_sym.program.runtime_constants import (
    CLOSING_ROUNDS,
    DOUBLED,
    LEAST_PACE,
    ROUND_OFF,
    ROWS_FLOOR,
    ROWS_NOTHING,
    SAME_PART,
    Status,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_LEVELS: Final = ("project_position", "project_velocity")


def python_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Integrate in Python; see `Loop`."""
    run = _Run(problem, problem.times().tolist())
    x, begun = problem.x0.copy(), problem.begun
    if begun is None:
        samples[0] = x
    written, reached, failure, shown = begun.written if begun else 1, problem.start, None, time.perf_counter()
    events: list[Event] = []
    singular: list[float] = []
    try:
        for done in run.steps(x):
            run.accept(done, written)
            while run.due(done, written):
                samples[written] = run.sample(done, written)
                written += 1
            reached, x = done.t_new, done.x_new
            if done.event is not None:
                events.append(Event(reached, done.event, problem.terminal[done.event]))
                if chatters(problem, events):
                    raise StepError(Status.CHATTERS, reached, -1)
            singular += done.singular
            if run.stops_between_samples(done, written):
                samples[written] = x
                written += 1
            if time.perf_counter() - shown > SECONDS:
                yield Progress(written, reached, x, run.statistics(reached), None, tuple(events), tuple(singular))
                shown = time.perf_counter()
    except StepError as problem_met:
        run.rejected += problem_met.rejected
        component = problem_met.component if problem_met.component >= 0 else None
        failure = RunFailure(problem_met.status, problem_met.time, component)
    yield Progress(written, reached, x, run.statistics(reached), failure, tuple(events), tuple(singular))


def put_back(problem: Problem, t: float, x: Floats) -> Floats:
    """Return a state (nq + nu,) put onto the constraints of a problem as far as round-off lets it be.

    Where that does not succeed it is returned as it is.
    """
    with np.errstate(all="ignore"):
        try:
            return _Run(problem, []).closed(t, x)
        except StepError:
            return x


@dataclass
class _Trial:
    """What was measured at the end of a step on trial."""

    drift_position: float = 0.0
    drift_velocity: float = 0.0
    removed_position: float = 0.0
    removed_velocity: float = 0.0
    quaternion_deviation: float = 0.0


@dataclass
class _Run:
    """The functions a step needs, and the counts and largest values that become Statistics."""

    problem: Problem
    times: list[float]
    count: int = 0
    rejected: int = 0
    evaluations: int = 0
    counts: Counts = field(default_factory=Counts)
    least_rank: float = math.inf
    greatest_rank: float = 0.0
    conditioning: float = math.inf
    conditioning_time: float = 0.0
    doubled: tuple[float, ...] = ()  # when the number of steps was a power of two, the last few times
    independence: float = math.inf  # of the rows at the latest slope
    residual: float = 0.0  # of dependent rows in the step on trial
    trial: _Trial = field(default_factory=_Trial)
    largest: _Trial = field(default_factory=_Trial)
    _latest: tuple[tuple[float, bytes], tuple[Floats, ...]] | None = None

    def steps(self, x0: Floats) -> Iterator[Step]:
        """Yield the accepted steps; raises StepError."""
        p = self.problem
        rows = RowClosure(lambda: self.independence, self.independence_at, self.closed, p.project, p.crosses)
        flow = Flow(
            method=p.method,
            derivative=self.derivative,
            t0=p.t0,
            t_end=p.t_end,
            x0=x0,
            settle=self.settle,
            settle_sample=self.settle_sample,
            step=p.step,
            rtol=p.rtol,
            atol=p.atol,
            stages=self.stages(),
            counts=self.counts,
            events=Events(self.switching, p.terminal, p.margins, p.limiting, p.moments) if p.terminal else None,
            rows=rows if p.rows else None,
            pairs=p.pairing,
            begun=None if p.begun is None else p.begun.time,
            whole=p.whole,
        )
        number, going = 0, steps(flow)
        while (done := next(going, None)) is not None:
            after, number = self._jumped(flow, done), number + 1
            yield done if after is None else replace(done, event=None)
            if number >= p.max_steps and done.t_new < p.t_end:
                raise StepError(Status.STEP_LIMIT, done.t_new, -1)
            self._pace(number, done.t_new)
            if after is not None:
                flow, going = after, steps(after)

    def _jumped(self, flow: Flow, done: Step) -> Flow | None:
        """Return how a run goes on that stands at a switch from which a jump of speeds leads on, None elsewhere."""
        p, index = self.problem, -1 if done.event is None else done.event - self.problem.switches
        if flow.events is None or p.jump is None or index < 0 or p.is_over(done.t_new):
            return None
        after = p.jump(done.t_new, done.x_new.copy(), index)
        if after is None:
            return None
        margins = list(flow.events.margins)
        margins[index] = min(margins[index], 0.0)
        return replace(flow, x0=after, begun=done.t_new, events=replace(flow.events, margins=tuple(margins)))

    def _pace(self, number: int, time: float) -> None:
        """Raise StepError if, as steps grow shorter, the run would take more of them than it may.

        That is so where a speed grows, or dry friction rests. Each eight times as many steps took so much longer, or
        shorter, than those before; it is taken to go on so. Where they took ever less time, the motion comes to an
        end of its own, which the steps reach, at once or, where each took the same part of the time before, when that
        is rounding.
        """
        if number & (number - 1):
            return
        self.doubled = (*self.doubled, time)[-DOUBLED:]
        if number < LEAST_PACE:
            return
        middle, most, steps, t = self.doubled[DOUBLED // 2], self.problem.max_steps, float(number), time
        before, way = middle - self.doubled[0], time - middle
        ratio = way / before if before > 0.0 else 8.0
        if ratio < 0.9 and not self._approaches_steadily():
            return
        while steps <= most:
            way *= ratio
            t += way
            if not t < self.problem.t_end or way <= ROWS_FLOOR * abs(t):
                return
            steps *= 8.0
        raise StepError(Status.STEP_LIMIT, time, -1)

    def _approaches_steadily(self) -> bool:
        """Return whether each eight times as many steps took the same part of the time before."""
        ways = np.diff(self.doubled)
        if not (ways > 0.0).all():
            return False
        ratios = ways[DOUBLED // 2 :] / ways[: DOUBLED // 2]
        return bool(ratios.min() >= SAME_PART * ratios.max())

    def call(self, program: str, t: float, x: Floats, *further: Floats) -> tuple[Floats, ...]:
        """Return the outputs of `program` at (t, x), for `further` inputs beyond those of all."""
        p = self.problem
        known = (t, x[: len(p.q0)], x[len(p.q0) :], p.parameters)
        inputs = p.compiled["inputs"](*known)[0] if p.inputs else np.zeros(0)
        return p.compiled[program](*known, inputs, p.modes, *further)

    def derivative(self, t: float, x: Floats) -> Floats:
        """Return x', and watch the rank of the rows and how far dependent ones disagree."""
        qdot, udot, _, report = self._evaluated(t, x)
        self.evaluations += 1
        slope = np.concatenate([qdot, udot])
        if self.problem.rows and np.isfinite(slope).all():
            self._note(t, *report.tolist())
        return slope

    def independence_at(self, t: float, x: Floats) -> float:
        """Return the independence of the rows at (t, x)."""
        report = self._evaluated(t, x)[3]
        return self._independence(*report[:2].tolist())

    def _independence(self, rank: float, conditioning: float) -> float:
        if rank < self.problem.independent:
            return 0.0
        return conditioning if rank else 1.0

    def _note(self, t: float, rank: float, conditioning: float, residual: float) -> None:
        self.independence = self._independence(rank, conditioning)
        self.least_rank = min(self.least_rank, rank)
        self.greatest_rank = max(self.greatest_rank, rank)
        if conditioning < self.conditioning:
            self.conditioning, self.conditioning_time = conditioning, t
        self.residual = max(self.residual, residual)

    def settle(self, t: float, x: Floats) -> Floats:
        """Return the end of a step on trial, normalised and put back onto the constraints."""
        x = self._normalized(t, x, self.trial)
        return self._projected(t, x, self.trial) if self.problem.project else x

    def closed(self, t: float, x: Floats) -> Floats:
        """Return a state within a step put onto the constraints as far as round-off lets it be."""
        return self._projected(t, x, _Trial(), 0.0)

    def settle_sample(self, t: float, x: Floats) -> Floats:
        """Return a state between steps, normalised and put back onto the constraints; where that fails as it is."""
        aside = _Trial()
        x = self._normalized(t, x, aside)
        try:
            return self._projected(t, x, aside) if self.problem.project or self.problem.index_2 else x
        except StepError:
            return x

    def stages(self) -> StageEquations | None:
        """Return what the stages of an implicit method solve, as far as there are programs for it."""
        if "index_2" in self.problem.compiled:
            return StageEquations(self._values, self._derivatives, self._multipliers, self._kept)
        if "jacobian" in self.problem.compiled:
            return ordinary(self.derivative, lambda t, x: self.call("jacobian", t, x)[0])
        return None

    def _values(self, t: float, y: Floats) -> Floats:
        """Return x' and the rows of both levels."""
        self.evaluations += 1
        x, multipliers = np.split(y, [len(self.problem.x0)])
        return np.concatenate(self.call("index_2", t, x, multipliers))

    def _derivatives(self, t: float, y: Floats) -> Floats:
        """Return the derivative of `_values` by y."""
        n = len(self.problem.x0)
        x, multipliers = np.split(y, [n])
        matrix = np.zeros((len(y), len(y)))
        (matrix[:, :n],) = self.call("index_2_by_state", t, x, multipliers)
        (matrix[:n, n:],) = self.call("index_2_by_multipliers", t, x)
        return matrix

    def _multipliers(self, t: float, x: Floats) -> Floats:
        """Return those that hold the rows at rest: none on positions, on speeds those of the accelerations."""
        multipliers = self.call("state_derivative", t, x)[2]
        self.evaluations += 1
        return np.concatenate([np.zeros_like(multipliers), multipliers])

    def _kept(self, jacobian: Floats) -> list[int]:
        """Return the rows that are independent, of each level for itself."""
        from multibody_sym.scalars.least_norm import independent_rows  # other runs need nothing of `program`

        n, nq, rows = len(self.problem.x0), len(self.problem.q0), self.problem.rows
        most = self.problem.independent
        positions, speeds = jacobian[n : n + rows, :nq], jacobian[n + rows :, nq:n]
        return [*independent_rows(positions, most), *(rows + k for k in independent_rows(speeds, most))]

    def switching(self, t: float, x: Floats) -> Floats:
        """Return the values of the switching functions."""
        return self.problem.switching(t, x, self._evaluated(t, x)[2] if self.problem.margins else None)

    def _evaluated(self, t: float, x: Floats) -> tuple[Floats, ...]:
        """Return what the state derivative says at (t, x), which is kept until another one is asked for."""
        at = t, x.tobytes()
        if self._latest is None or self._latest[0] != at:
            self._latest = at, self.call("state_derivative", t, x)
        return self._latest[1]

    def _normalized(self, t: float, x: Floats, trial: _Trial) -> Floats:
        if "normalize" not in self.problem.compiled:
            return x
        q, deviation = self.call("normalize", t, x)
        trial.quaternion_deviation = float(deviation)
        return np.concatenate([q, x[len(q) :]])

    def _projected(self, t: float, x: Floats, trial: _Trial, goal: float = ROUND_OFF) -> Floats:
        if "put_back" in self.problem.compiled:
            return self._projected_together(t, x, trial, goal)
        if "project_position" in self.problem.compiled:
            part = slice(0, len(self.problem.q0))
            x, trial.removed_position, trial.drift_position = self._closed("project_position", t, x, part, goal)
        if "project_velocity" in self.problem.compiled:
            part = slice(len(self.problem.q0), len(x))
            x, trial.removed_velocity, trial.drift_velocity = self._closed("project_velocity", t, x, part, goal)
        return x

    def _projected_together(self, t: float, x: Floats, trial: _Trial, goal: float) -> Floats:
        parts = slice(0, len(self.problem.q0)), slice(len(self.problem.q0), len(x))
        sizes = [1.0 + _largest(x[part]) for part in parts]
        found = self._missed(t, x)
        trial.removed_position, trial.removed_velocity = found
        x, found = self._corrected(t, x, [goal or ROWS_FLOOR * size for size in sizes], found)
        trial.drift_position, trial.drift_velocity = found
        for level, (after, size) in enumerate(zip(found, sizes, strict=True)):
            if not after <= self.problem.closure * size:
                rows = self.call("missed", t, x)[level]
                raise StepError(Status.NOT_CLOSED, t, int(np.argmax(np.abs(rows))))
        return x

    def _missed(self, t: float, x: Floats) -> list[float]:
        """Return the largest |phi| and |phidot|."""
        return [_largest(rows) for rows in self.call("missed", t, x)]

    def _corrected(self, t: float, x: Floats, goals: list[float], after: list[float]) -> tuple[Floats, list[float]]:
        """Correct both levels together until each holds to its goal or gets no better; see constraints.c."""
        previous, noise = [math.inf, math.inf], ROWS_NOTHING * (1.0 + _largest(x[: len(self.problem.q0)]))
        for _ in range(CLOSING_ROUNDS):
            going = [a > goal and a < 0.5 * p for a, goal, p in zip(after, goals, previous, strict=True)]
            if not any(going):
                break
            tried, previous = x + np.concatenate(self.call("put_back", t, x)), after
            after = self._missed(t, tried)
            closer = going[0] and after[0] < previous[0]
            if not closer and not (after[0] <= noise and (going[0] or after[1] < previous[1])):
                return x, previous
            x, previous = tried, [previous[0], math.inf if going[0] else previous[1]]
        return x, after

    def _closed(self, program: str, t: float, x: Floats, part: slice, goal: float) -> tuple[Floats, float, float]:
        """Correct `part` of x until the rows hold or get no better; return x, the largest |row| before and after."""
        size = 1.0 + _largest(x[part])
        rows, correction = self.call(program, t, x)
        before = after = _largest(rows)
        previous = math.inf
        for _ in range(CLOSING_ROUNDS):
            if not (after > goal and after < 0.5 * previous):
                break
            previous, tried = after, x.copy()
            tried[part] += correction
            rows, correction = self.call(program, t, tried)
            after = _largest(rows)
            if after < previous:
                x = tried
            else:
                after = previous
        if not after <= self.problem.closure * size:
            raise StepError(Status.NOT_CLOSED, t, int(np.argmax(np.abs(rows))))
        return x, before, after

    def due(self, done: Step, index: int) -> bool:
        """Tell whether sample `index` lies within the step."""
        return index < len(self.times) and reaches(done, self.times[index])

    def sample(self, done: Step, index: int) -> Floats:
        """Return sample `index`, settled if it lies between steps."""
        at = self.times[index]
        x = interpolate_step(done, at)
        if x is done.x_new:
            return x
        settled = self.settle_sample(at, x)
        return x if strays(done, x, settled) else settled

    def stops_between_samples(self, done: Step, index: int) -> bool:
        """Tell whether the step ends the run at a stop, after which no other mode follows, not at the sample before."""
        p = self.problem
        stops = done.event is not None and p.terminal[done.event] and done.event < len(p.terminal) - len(p.margins)
        return stops and not at_end(done, self.times[index - 1])

    def accept(self, done: Step, written: int) -> None:
        """Record an accepted step; drift without projection is measured at the steps in which a sample falls."""
        self.count += 1
        self.rejected += done.rejected
        trial = self.trial
        if not self.problem.project and self.due(done, written):
            phi, phidot = (self._rows(level, done.t_new, done.x_new) for level in _LEVELS)
            trial.drift_position = trial.drift_position if phi is None else _largest(phi)
            trial.drift_velocity = trial.drift_velocity if phidot is None else _largest(phidot)
        for name, value in vars(trial).items():
            if not value <= getattr(self.largest, name):
                setattr(self.largest, name, value)
        self._check_contradiction(done)

    def _check_contradiction(self, done: Step) -> None:
        """Raise StepError if dependent rows disagree and a row is broken.

        Disagreement alone is not enough: where hardly any force acts on the rows, it is round-off by round-off.
        """
        allowed, residual, self.residual = self.problem.contradiction, self.residual, 0.0
        rows = self._rows(_LEVELS[1], done.t_new, done.x_new) if residual > allowed else None
        if rows is not None and _largest(rows) > allowed * (1.0 + _largest(done.x_new[len(self.problem.q0) :])):
            raise StepError(Status.CONTRADICTION, done.t_new, int(np.argmax(np.abs(rows))))

    def _rows(self, level: str, t: float, x: Floats) -> Floats | None:
        """Return the rows of a level, None where there are none."""
        if "missed" in self.problem.compiled:
            return self.call("missed", t, x)[_LEVELS.index(level)]
        return self.call(level, t, x)[0] if level in self.problem.compiled else None

    def statistics(self, reached: float) -> Statistics:
        """Return what was counted and measured up to time `reached`."""
        rows = math.isfinite(self.least_rank)
        return Statistics(
            steps=self.count,
            rejected=self.rejected,
            evaluations=self.evaluations,
            jacobians=self.counts.jacobians,
            factorisations=self.counts.factorisations,
            mean_step=(reached - self.problem.start) / self.count if self.count else 0.0,
            least_rank=int(self.least_rank) if rows else 0,
            greatest_rank=int(self.greatest_rank),
            conditioning=self.conditioning if rows else 1.0,
            conditioning_time=self.conditioning_time,
            **vars(self.largest),
        )


def _largest(values: Floats) -> float:
    return float(np.abs(values).max(initial=0.0))


# ----------------------------------------------------------------------------------------------------------------------
# Runs of systems that have no state, as every motion in them is prescribed: nothing is integrated, stops are met.


_LEAST_PIECES: Final = 200  # within each of which the conditions are looked at as within a step of a method
_EMPTY: Final = np.zeros(0)


def prescribed_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Pass the samples, which are empty, until the first stop; see `Loop`."""
    stop = _first_stop(problem) if any(problem.terminal) else None
    if stop is None:
        yield Progress(problem.due, problem.t_end, problem.x0, Statistics(), None)
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
        return problem.switching(t, _EMPTY)[stops]

    events = Events(values, (True,) * len(stops))
    flow = Flow(problem.method, lambda t, x: _EMPTY, problem.t0, problem.t_end, _EMPTY, events=events)
    watch, count = Watch(flow, events), max(problem.sample_count - 1, _LEAST_PIECES)
    times = np.linspace(problem.t0, problem.t_end, count + 1).tolist()
    for t, t_new in pairwise(times):
        step = watch.ended(_step(t, t_new - t, t_new), _EMPTY, partial(_step, t))
        if step.event is not None:
            return Step(t, _EMPTY, step.h, step.t_new, _EMPTY, _EMPTY, step.value, event=int(stops[step.event]))
    return None


def _step(t: float, h: float, t_new: float) -> Step:
    return Step(t, _EMPTY, h, t_new, _EMPTY, _EMPTY, lambda theta: _EMPTY)
