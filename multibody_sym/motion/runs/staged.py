"""Runs of several stages: each goes on from the end of the one before, to the time or event with which the next begins.

In: a prepared system with `then`. Out: one trajectory over all stages, with the beginning of each among its events.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property, reduce
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.dynamics.start.parameters import known_values
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import InputError
from multibody_sym.mechanics.changes import at_end, end_questions, going_on, in_stage, stage_systems
from multibody_sym.model.argument_checks import door
from multibody_sym.model.fields import Names
from multibody_sym.model.state_words import Stage
from multibody_sym.model.system import System
from multibody_sym.motion.results.integrals import FineLeg, Miss
from multibody_sym.motion.results.samples import STAGE, FrictionWork, Samples, SingleRun
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import less, multiply, real, subtract, symbol

_NEXT: Final = "the next stage"
"""The stop that ends a stage."""
_THERE: Final = 1e-9
"""m or rad, and their rates: how near to a place a stage begins there."""
_ROUNDING: Final = 1e-12
"""The part of its largest value below which a coordinate or speed is zero as the next stage begins."""
Run = Callable[[System], Trajectory]


def run_in_stages(system: System, run: Run) -> Trajectory:
    """Return the motion through all stages that begin before `t_end`; `run` makes that of one stage.

    Raises what `run` does, with places in the declared system; the trajectory of a failure ends there.
    """
    known = known_values(system)
    t_end = evaluate_float([system.simulation.t_end], known)[0]
    runs, begun, start, samples = list[Trajectory](), [0.0], dict[str, float](), system.simulation.samples
    if isinstance(samples, tuple):
        times = np.array(evaluate_float(samples, known))
    else:
        times = np.linspace(0.0, t_end, int(evaluate_float([samples], known)[0]))
    for number, part in enumerate(stage_systems(system), 1):
        follows = system.then[number - 1] if number <= len(system.then) else None
        with in_stage(system, number):
            try:
                done, ends = _stage_run(system, part, number, start, (begun[-1], times, t_end), run)
            except FailedRunError as failed:
                joined = _joined(system, [*runs, failed.trajectory], begun)
                raise type(failed)(failed.message, joined) from None
        runs.append(done)
        if follows is None or not ends:
            break
        begun.append(begun[-1] + done.t_final)
        largest = {x: float(np.abs(y).max()) for x, y in {**done.whole.coordinates, **done.whole.speeds}.items()}
        final = {**done.final["coordinates"], **done.final["speeds"]}  # of which some is rounding
        start = {name: x if abs(x) > _ROUNDING * largest[name] else 0.0 for name, x in final.items()}
        start |= {name: float(done.whole[at_end(name, number)][-1]) for name in follows.initial or {}}
    return _joined(system, runs, begun)


def _stage_run(
    system: System,
    part: System,
    number: int,
    start: Mapping[str, float],
    span: tuple[float, Floats, float],
    run: Run,
) -> tuple[Trajectory, bool]:
    """Return the motion of a stage, and whether it ends where the next one begins; `span`: begin, sample times, end."""
    begin, times, t_end = span
    own = part if number == 1 else going_on(replace(part, ask=Names()), real(begin), start)
    end = t_end - begin
    if number <= len(system.then):
        follows = system.then[number - 1]
        after = follows.after
        if after is not None:
            end = min(end, evaluate_float([after], known_values(system))[0] - begin)
        else:
            own = replace(own, stop=Names({**own.stop, _NEXT: _stop(own, follows)}))
        asked = {name: x.value for name, x in end_questions(system, number).items() if x.value is not None}
        own = replace(own, outputs=Names({**own.outputs, **asked}))
    samples = tuple(real(x) for x in (0.0, *(times[(times > begin) & (times < begin + end)] - begin).tolist(), end))
    settings = replace(own.simulation, t_end=real(end), samples=samples)
    done = run(replace(own, simulation=settings))
    reached = done.stop is None and end < t_end - begin
    return done, reached or (done.stop is not None and done.stop["element"] == _NEXT)


def _stop(system: System, stage: Stage) -> Any:
    """Return the condition that ends a stage where the next begins: of a place that of coming to it from one side."""
    if stage.at is None:
        return stage.when
    ((name, value),) = stage.at.items()
    if system.impact is not None:
        from multibody_sym.dynamics.start.declared_impact import from_impact  # which few stages begin with

        system = from_impact(system).system
    state = examined_state(system)
    numbers = dict(zip((c.name for c in state.mechanism.coordinates), state.start.q, strict=True))
    rates = dict(zip((s.name for s in state.mechanism.speeds), state.start.u, strict=True))
    way = numbers[name] - evaluate_float([value], known_values(system))[0]
    side = way if abs(way) > _THERE else rates.get(f"u_{name}", 0.0)
    distance = subtract(symbol(name), value)
    return less(multiply(real(1.0 if side > 0.0 else -1.0), distance), real(0.0))


# ----------------------------------------------------------------------------------------------------------------------
# The runs of all stages as one.


def _joined(system: System, runs: list[Trajectory], begun: list[float]) -> Trajectory:
    """Return runs one after the other, which begin at times (s), as one trajectory."""
    first, last = runs[0], runs[-1]
    t = np.concatenate([run.whole.t + begin for run, begin in zip(runs, begun, strict=True)])
    q, u = (np.concatenate([getattr(run.whole, name) for run in runs]) for name in "qu")
    parts = [part for run in runs for part in run.whole._parts]
    done = replace(
        last.integration,
        t=t,
        q=q,
        u=u,
        t_final=begun[-1] + last.t_final,
        taken=reduce(lambda a, b: a.joined(b), (run.integration.statistics for run in runs)),
        singular=tuple(x + begin for run, begin in zip(runs, begun, strict=True) for x in run.integration.singular),
    )
    t_end = evaluate_float([system.simulation.t_end], known_values(system))[0]
    made = SingleRun(first.ready, replace(first.problem, t_end=t_end), done, parts)
    return StagedTrajectory(made, system, tuple(runs), tuple(begun))


@dataclass(frozen=True, eq=False, repr=False)
class StagedTrajectory(Trajectory):
    """The motion of a `system` through its stages: the `runs` of these, in their own times, which begin at `begun` (s).

    Each has its last sample where the next one begins. Forces of elements are zero in stages without these, outputs
    that name such elements nan.
    """

    system: System
    runs: tuple[Trajectory, ...]
    begun_at: tuple[float, ...]

    @property
    def _asked(self) -> slice:
        return slice(0, len(self._made.t))

    def _of_runs(self, columns: Callable[[Trajectory], Mapping[str, Floats]], missing: float) -> dict[str, Floats]:
        """Return columns by name, run after run, with a value where a run has none of that name."""
        known = [columns(run.whole) for run in self.runs]
        names = dict.fromkeys(name for each in known for name in each)
        lacking = [np.full(len(run.whole.t), missing) for run in self.runs]
        return {x: np.concatenate([each.get(x, no) for each, no in zip(known, lacking, strict=True)]) for x in names}

    def _shifted(self, events: Callable[[Trajectory], list[dict[str, Any]]]) -> list[dict[str, Any]]:
        """Return events of all runs in the time of the whole, without the stops that end stages."""
        found = []
        for run, begin in zip(self.runs, self.begun_at, strict=True):
            found += [{**each, "t": each["t"] + begin} for each in events(run) if each["element"] != _NEXT]
        return found

    def _names(self) -> list[str]:
        return [*self.coordinates, *self.speeds, *self.outputs, *self.inputs]

    @cached_property
    def outputs(self) -> Mapping[str, Floats]:
        """Each declared output (m,) by name; nan in stages without an element that it names."""
        found = self._of_runs(lambda run: run.outputs, np.nan)
        return {name: found[name] for name in self.system.outputs if name in found}

    @cached_property
    def output_units(self) -> Mapping[str, str]:
        """The SI unit of each output; empty where none is known."""
        return {name: unit for run in self.runs for name, unit in run.output_units.items()}

    @cached_property
    def reactions(self) -> Mapping[str, Mapping[str, Floats]]:
        """What each joint exerts on its child, as of one run; zero where it does not hold."""
        names = dict.fromkeys(name for run in self.runs for name in run.reactions)
        return {
            name: self._of_runs(lambda run, name=name: run.reactions.get(name, {}), 0.0)  # type: ignore[misc]
            for name in names
        }

    @property
    def events(self) -> list[dict[str, Any]]:
        """What happened on the way, in the order of time, with the beginning of each stage."""
        words = [stage.words() for stage in self.system.then]
        begun = [{"t": t, "kind": STAGE, "element": x} for t, x in zip(self.begun_at[1:], words, strict=False)]
        return sorted([*begun, *self._shifted(lambda run: run.events)], key=lambda each: float(each["t"]))

    @property
    def changes(self) -> list[dict[str, Any]]:
        """What began to stick, slide, open or close, in the order of time."""
        return self._shifted(lambda run: run.changes)

    @property
    def friction_work(self) -> Mapping[str, FrictionWork]:
        """The work of friction in J by contact or joint friction, on all bodies and on each."""
        found: dict[str, FrictionWork] = {}
        for run in self.runs:
            for name, work in run.friction_work.items():
                own = found.setdefault(name, FrictionWork())
                bodies = {x: own.bodies.get(x, 0.0) + part for x, part in work.bodies.items()}
                found[name] = FrictionWork(own.total + work.total, {**own.bodies, **bodies})
        return found

    @property
    def impact_losses(self) -> Mapping[str, float]:
        """The kinetic energy in J that impacts took, by what closed."""
        names = dict.fromkeys(name for run in self.runs for name in run.impact_losses)
        return {name: sum(run.impact_losses.get(name, 0.0) for run in self.runs) for name in names}

    @property
    def begun(self) -> tuple[Mapping[str, Any], ...]:
        """The events of the impacts with which stages begin."""
        return tuple(self._shifted(lambda run: [dict(event) for event in run.begun]))

    @property
    def energy_residual(self) -> float:
        """Nan: what is released or begins takes and brings energy that is not accounted."""
        return math.nan

    @property
    def stretches(self) -> list[FineLeg]:
        """The parts of the runs between switches of modes, in the times of their stages."""
        return [each for run in self.runs for each in run.stretches]

    def verified(self) -> dict[str, Miss]:
        """Return how well the general theorems hold along the stages: the largest miss of each by name."""
        every = [run.verified() for run in self.runs]
        names = dict.fromkeys(name for each in every for name in each)
        return {x: max((each[x] for each in every if x in each), key=lambda miss: miss.relative) for x in names}

    @property
    def drift(self) -> Mapping[str, float]:
        """The largest drift of a stage."""
        every = [run.drift for run in self.runs]
        return {name: max(each[name] for each in every) for name in every[0]}

    @property
    def redundancy(self) -> Redundancy:
        """Which constraints were redundant at the start."""
        return self.runs[0].redundancy

    @property
    def baumgarte(self) -> dict[str, float] | None:
        """Baumgarte's alpha and beta in 1/s where they stabilised the first stage."""
        return self.runs[0].baumgarte

    @door
    def __call__(self, t: ArrayLike, *, before: bool = False) -> Samples:
        """Raise InputError: states between samples are asked of the run of a stage."""
        raise InputError("a run of several stages has samples alone; ask for more of them, or run.runs[0](t)")
