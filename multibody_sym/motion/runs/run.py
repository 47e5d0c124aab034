"""The run itself: integrated, and told as a trajectory or as a failure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from multibody_sym.errors import RunError
from multibody_sym.motion.loop.integrate import Leg, first_loop, integrate
from multibody_sym.motion.loop.problem import Chunk
from multibody_sym.motion.prepare.records import LegSamples, leg_samples
from multibody_sym.motion.results.samples import Departed, NewSamples, RunRecord, RunStart, Samples, SingleRun
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.program.runtime_constants import Status
from multibody_sym.scalars.arrays import Floats
from multibody_sym.stages import is_logged, log, stage

# ----------------------------------------------------------------------------------------------------------------------
# What a run that could not go on raises.


class FailedRunError(RunError):
    """A run that could not go on; `trajectory` holds what it had computed."""

    def __init__(self, message: str, trajectory: Trajectory) -> None:
        super().__init__(message)
        self.trajectory = trajectory

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.trajectory), vars(self)


class MotionEndsError(FailedRunError):
    """The motion of the model itself has no continuation; `trajectory` is all of it.

    A speed or a force grows without bound there, constraints contradict each other, a mass is used up, a rope comes off
    its wheel, or no state fulfils the laws of contact and friction.
    """

    number = "R101"


Progressed = Callable[[Samples, float], None] | None
"""Called with the new samples and the part of the time that is done."""


def run(begin: RunStart, on_progress: Progressed, told: int = 0) -> Trajectory:
    """Return the motion, from mode to mode where some holds one way only; of `told` samples progress tells no more."""
    ready, problem, modes, events, _hints, holds = begin
    legs: list[Leg] = []

    def report(chunk: Chunk) -> None:
        nonlocal told
        new, told = chunk.beyond(told), max(told, chunk.first + len(chunk.t))
        new = new.part(problem.asked(new.first, new.t))
        if on_progress is not None:
            parts = parts_of(new.t, new.q, new.u, new.first)
            piece = NewSamples(ready, problem.parameters, new.t, new.q, new.u, parts)
            on_progress(Samples(piece), new.time / problem.t_end)

    def parts_of(t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[LegSamples, ...]:
        if modes is not None:
            return modes.parts(t, q, u, first)
        return leg_samples(((leg, ready.told) for leg in legs), (t, q, u), first)

    loop = first_loop(problem) if modes is None else modes.loop
    if holds is not None:
        from multibody_sym.motion.runs.held_inputs import held_loop  # which few runs need

        loop, legs = held_loop(begin, holds)
    try:
        log("integrate %s to t = %g s by %s", ready.told.name, problem.t_end, problem.method.name)
        with stage("integrate"):
            done = integrate(problem, on_chunk=report, loop=loop)
            if ready.told.rows and done.failure is None and not done.statistics.drift_position <= problem.closure:
                from multibody_sym.motion.runs.failures import until_departure  # which few runs need

                done = until_departure(ready.mechanism, problem, done)
    except Departed as departed:
        return run(departed.begin(), on_progress, told)
    if is_logged():
        taken = done.statistics
        log("%s at t = %g s: %d steps, %d evaluations", done.status.name, done.t_final, taken.steps, taken.evaluations)
    if legs and done.failure is not None:  # which is looked into with what was held then
        problem = problem.with_numbers(legs[-1].of.parameters, problem.q0, problem.u0)
    return trajectory_of(SingleRun(ready, problem, done, parts_of(done.t, done.q, done.u), modes, events, legs))


def trajectory_of(made: RunRecord) -> Trajectory:
    """Return the trajectory of a run. Raises FailedRunError, MotionEndsError."""
    trajectory = Trajectory(made)
    if made.told.loses_mass and (made.failure is not None or trajectory.stop is not None):
        from multibody_sym.motion.runs.failures import mass_used_up

        if (left := mass_used_up(trajectory)) is not None:
            raise MotionEndsError(left, trajectory)
    if trajectory.stop is not None:
        from multibody_sym.motion.runs.failures import wheel_left

        if (left := wheel_left(trajectory)) is not None:
            raise MotionEndsError(left, trajectory)
    failure, modes = made.failure, made.modes
    if failure is None or failure.status is Status.INTERRUPTED:
        if modes is not None and (passed := modes.passed_through(made.t, made.q, made.u)):
            raise FailedRunError(passed, trajectory)
        return trajectory
    from multibody_sym.motion.runs.failures import why_failed  # which few runs need

    reason = why_failed(trajectory, failure)
    raise (MotionEndsError if reason.ends else FailedRunError)(reason.text, trajectory)
