"""The stepping loop in plain Python; `runtime.c` and `trials.c` are the same algorithm in C.

Both do the same floating-point operations in the same order, so that they take the same steps to round-off.
Step control: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sections II.4 and IV.2
(proportional-integral control, automatic first step).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from sys import float_info

import numpy as np

from multibody_sym.motion.integrator.events import Watch
from multibody_sym.motion.integrator.flow import (
    Derivative,
    Flow,
    Step,
    StepError,
    StepsTaken,
    TrialStep,
    sample_times,
    scaled_norm,
    steps_before,
)
from multibody_sym.motion.integrator.library_steps import library_steps
from multibody_sym.motion.integrator.runge_kutta_steps import (
    AdamsStepper,
    CollocationStepper,
    ExplicitStepper,
    StoermerStepper,
    VerletStepper,
)
from multibody_sym.motion.integrator.singular import Approach, moved_far
from multibody_sym.motion.methods.explicit import RungeKutta
from multibody_sym.motion.methods.multistep import AdamsBashforthMoulton, Collocation, Stoermer, StoermerVerlet
from multibody_sym.motion.methods.table import LibraryMethod, Method
from multibody_sym.program.runtime_constants import (
    GROWTH,
    LEAST_AT_KINK,
    LEAST_ERROR,
    LEAST_PART,
    RETREAT,
    SAFETY,
    SHRINKAGE,
    Status,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats


def steps(flow: Flow) -> Iterator[Step]:
    """Yield the steps of a flow, the last of which ends exactly at t_end; raises StepError.

    Fixed steps are of length `flow.step`, only the last may be shorter. Others are such that the estimated error is at
    most atol + rtol |x| in the mean square; a trial that cannot be evaluated is an error only after shorter ones
    failed, down to the least step. The steps of another library's method are as long as that library makes them.
    """
    if isinstance(flow.method, LibraryMethod):
        return library_steps(flow)
    approach = Approach(flow)
    flow = approach.watched()
    watch = None if flow.events is None else Watch(flow, flow.events)

    taking = stepper(flow.method, flow if watch is None else watch.watched())
    course = _Course(flow, taking, watch, approach)
    taking.restart()
    t = flow.start
    slope = flow.slope(t, flow.x0)
    approach.restart(t)
    start = Step(t, flow.x0, 0.0, t, flow.x0, slope, lambda _: flow.x0)
    if flow.step is None:
        return _adaptive_steps(course, replace(start, h_next=first_step(flow, t, flow.x0, slope)))
    return _fixed_steps(course, start, flow.step)


@dataclass(frozen=True)
class _Course:
    """What takes the steps of a flow and watches over them."""

    flow: Flow
    taking: StepsTaken
    watch: Watch | None
    approach: Approach


def _fixed_steps(course: _Course, done: Step, step: float) -> Iterator[Step]:
    """Yield whole steps and what events and singular positions have left of them."""
    flow = course.flow
    count, grid = step_count(flow.t0, flow.t_end, step), steps_before(flow.t0, flow.start, step)

    def grid_time(number: int) -> float:
        return flow.t0 + number * step if number < count else flow.t_end

    while done.t_new < flow.t_end:
        t, t_new, whole = done.t_new, grid_time(grid + 1), done.t_new == grid_time(grid)
        if not whole and t_new < flow.t_end and t_new - t < _least_step(flow, t):
            grid += 1
            t_new = grid_time(grid + 1)
        h = step if whole and t_new < flow.t_end else t_new - t
        done = course.approach.passed(_take_step(course, done, h, t_new))
        if done.t_new >= t_new:
            grid += 1
        yield done
        if _is_terminal(flow, done):
            return
        done = _moved_on(course, done)


def _attempt(course: _Course, before: Step, h: float, t_new: float) -> TrialStep:
    if course.watch is not None:
        course.watch.beyond = course.watch.touched = False
    start = before.t_new, before.x_new
    course.approach.begin(*start, h)
    try:
        trial = course.taking.attempt(*start, before.slope_new, h, t_new)
    except StepError:
        if not course.approach.turns_stiff(course.taking):
            raise
        course.approach.begin(*start, h)
        trial = course.taking.attempt(*start, before.slope_new, h, t_new)
    course.approach.verify(t_new)
    return trial


def _take_step(course: _Course, before: Step, whole: float, t_end: float) -> Step:
    """Return the step over `whole`, or as far as the first event in it.

    Near a singular position it may be another part of a whole step: the rest of one may end too near to it.
    """
    h, t_new, rejected, flow = whole, t_end, 0, course.flow
    if course.watch is not None:
        course.watch.begin(before.t_new, before.x_new, before.slope_new)
    longest = flow.step if flow.step is not None and before.t_new + flow.step < flow.t_end else whole
    while True:
        try:
            return replace(_stuck_or_taken(course, before, h, t_new), rejected=rejected)
        except StepError as met:
            if course.approach.comes_unforeseen():
                before = course.approach.foresee(before, course.taking)
            else:
                h = longest = longest * course.approach.retreat(longest, 0.0)
                t_new = before.t_new + h
            if h < LEAST_PART * whole:
                raise course.approach.failure(met, before.t_new) from None
            rejected += 1


def _stuck_or_taken(course: _Course, before: Step, h: float, t_new: float) -> Step:
    """Return the step over h, shortened to the first event in it; one that is stuck at a kink ends there."""
    try:
        done, problem = _close_step(course, _attempt(course, before, h, t_new)), None
    except StepError as met:
        if course.watch is None or not course.watch.stuck(met):
            raise
        done, problem = replace(before, t=before.t_new, x=before.x_new, h=h, t_new=t_new), met
    return _shorten_to_event(course, done, before, problem)


def _shorten_to_event(course: _Course, done: Step, before: Step, problem: StepError | None = None) -> Step:
    """Return a step shortened to the first event in it."""
    if course.watch is None:
        return done

    def take(h: float, t_new: float) -> Step:
        trial = _attempt(course, before, h, t_new)
        error = LEAST_ERROR if trial.error is None else _error_norm(course, trial)[0]
        return replace(_close_step(course, trial), error=error)

    return course.watch.ended(done, before.slope_new, take, problem)


def _is_terminal(flow: Flow, done: Step) -> bool:
    return done.event is not None and flow.events is not None and flow.events.terminal[done.event]


def _moved_on(course: _Course, done: Step) -> Step:
    """Make the end of the step the start of the next, afresh after an event."""
    if course.watch is not None:
        course.watch.origin = done.event
    if done.event is None:
        course.taking.advance(done)
        course.approach.advance(done, course.taking)
        return done
    if not done.t_new < course.flow.t_end:
        return done
    course.taking.restart()
    course.approach.near = course.approach.stiff = False
    flow, h_next = course.flow, done.h_next
    slope = flow.slope(done.t_new, done.x_new)
    course.approach.restart(done.t_new)
    if flow.step is None and isinstance(flow.method, Collocation):  # a long step would damp a motion it does not see
        h_next = min(h_next, first_step(flow, done.t_new, done.x_new, slope))
    return replace(done, slope_new=slope, h_next=h_next)


def step_count(t0: float, t_end: float, step: float) -> int:
    """Return the number of steps from t0 to t_end; a last piece below 1e-9 of the way belongs to the step before."""
    ratio = (t_end - t0) / step
    nearest = math.floor(ratio + 0.5)
    whole = abs(ratio - nearest) <= 1e-9 * max(1.0, ratio)
    return max(1, nearest if whole else math.ceil(ratio))


def _adaptive_steps(course: _Course, done: Step) -> Iterator[Step]:
    while done.t_new < course.flow.t_end:
        done = course.approach.passed(_accepted_step(course, done))
        yield done
        if _is_terminal(course.flow, done):
            return
        done = _moved_on(course, done)


def _accepted_step(course: _Course, before: Step) -> Step:
    flow, approach, power = course.flow, course.approach, control_power(course.flow.method)
    t, x, proposed, rejected = before.t_new, before.x_new, before.h_next, 0
    if course.watch is not None:
        course.watch.begin(before.t_new, before.x_new, before.slope_new)
        proposed = min(proposed, course.watch.longest(t, x, before.slope_new))
    failure = StepError(Status.STEP_UNDERFLOW, t, 0)
    laid = approach.laid(proposed)
    proposed, wished = laid, proposed if laid < proposed else 0.0
    while proposed >= _least_step(flow, t):
        last = t + 1.01 * proposed >= flow.t_end
        t_new = flow.t_end if last else t + proposed
        h = flow.t_end - t if last else proposed
        try:
            trial = _attempt(course, before, h, t_new)
            error, worst = _error_norm(course, trial)
            plain, _ = _error_beside(course, trial, 0.0)
            if error <= 1.0:
                done = _close_step(course, trial)
                far = moved_far(x, trial.x_new, done.x_new)
                if far is None:
                    done = _shorten_to_event(course, done, before)
                    h_next = _length_after(course, trial, (error, plain, before.error), rejected)
                    h_next = approach.wished(max(h_next, wished), plain)
                    return replace(done, h_next=h_next, error=max(error, LEAST_ERROR), rejected=rejected)
                jump = h <= LEAST_AT_KINK * (flow.t_end - flow.t0)
                failure, proposed = StepError(Status.STEP_UNDERFLOW, t, far), 0.0 if jump else h * RETREAT
            else:
                if rejected and (ended := _before_kink(course, before, h, t_new)) is not None:
                    return replace(ended, h_next=h, error=LEAST_ERROR, rejected=rejected)
                shrink = min(SHRINKAGE, math.pow(error, power - 0.75 * (0.2 * power)) / SAFETY)
                failure, proposed, wished = StepError(Status.STEP_UNDERFLOW, t, worst), h / shrink, 0.0
        except StepError as problem:
            failure = problem
            if approach.comes_unforeseen():
                before = approach.foresee(before, course.taking)
                x = before.x_new
            else:
                proposed = h * approach.retreat(h, RETREAT)
                wished = max(wished, h) if approach.near else 0.0  # but for a singular position
        rejected += 1
    raise approach.failure(failure, t, rejected)


def _before_kink(course: _Course, before: Step, h: float, t_new: float) -> Step | None:
    """Return a step that ends at the kink beyond which a trial over h looked; None if there is none.

    Behind a jump the error of a trial falls with the step, not with the order of the method: no step over it may be
    accurate enough.
    """
    if course.watch is None or not course.watch.beyond:
        return None
    trial = replace(before, t=before.t_new, x=before.x_new, h=h, t_new=t_new)
    try:
        return _shorten_to_event(course, trial, before, StepError(Status.NOT_CONVERGED, trial.t, 0))
    except StepError:
        return None


def _least_step(flow: Flow, t: float) -> float:
    return max(16.0 * float_info.epsilon * abs(t), least_step(flow.t0, flow.t_end))


def least_step(t0: float, t_end: float) -> float:
    """Return the least step (s) of a run; later in it, what floats tell apart may allow longer ones only."""
    return 1e-16 * (t_end - t0)


def control_power(method: Method) -> float:
    """Return the power of the error by which the step is chosen."""
    return 1.0 / (min(method.order, method.error_order) + 1.0)


def _length_after(course: _Course, trial: TrialStep, errors: tuple[float, float, float], rejected: int) -> float:
    """Return the length of the step after an accepted trial, by its error, that without noise, and the one before it.

    It grows only as the error without the allowance for round-off lets it.
    """
    h, (error, plain, remembered), power = trial.h, errors, control_power(course.flow.method)
    integral = 0.2 * power
    changes = (
        math.pow(size, power - 0.75 * integral) / math.pow(remembered, integral) / SAFETY for size in (error, plain)
    )
    h_next, grown = (h / max(1.0 / GROWTH, min(SHRINKAGE, change)) for change in changes)
    if h_next > h and grown < h_next:
        h_next = max(grown, h)
    return min(h_next, h) if rejected or h_next < trial.least_growth * h else h_next


def _close_step(course: _Course, trial: TrialStep) -> Step:
    settle, approach = course.flow.settle, course.approach
    x_new = trial.x_new if settle is None else settle(trial.t_new, trial.x_new)
    done = course.taking.finish(trial, approach.closed(trial.t_new, x_new))
    approach.verify_end(trial, done)
    return done


def _error_norm(course: _Course, trial: TrialStep) -> tuple[float, int]:
    """Return the error of a trial; near a singular position what round-off does there counts as allowed."""
    return _error_beside(course, trial, course.approach.noise() * float(np.max(np.abs(trial.x_new))))


def _error_beside(course: _Course, trial: TrialStep, noise: float) -> tuple[float, int]:
    """Return the mean-square error in units of noise + atol + rtol max(|x|, |x_new|), and where most of it is.

    Of two estimates the finer, e5, counts as e5^2 / sqrt(e5^2 + 0.01 e3^2), with the coarser, e3: an error of the power
    of the step that their orders together make (Hairer, Norsett, Wanner, section II.10).
    """
    assert trial.error is not None
    scales = course.flow.scales(trial.x, trial.x_new) + noise
    fine, worst = scaled_norm(trial.error, scales), int(np.argmax(np.abs(trial.error / scales)))
    if trial.coarse is None or fine == 0.0:
        return fine, worst
    coarse = scaled_norm(trial.coarse, scales)
    return fine * fine / math.sqrt(fine * fine + 0.01 * (coarse * coarse)), worst


def first_step(flow: Flow, t: float, x: Floats, slope: Floats) -> float:
    """Return a first step from (t, x) for which an explicit Euler step and the second derivative stay small."""
    scales = flow.atol + flow.rtol * np.abs(x)
    size, speed = scaled_norm(x, scales), scaled_norm(slope, scales)
    span = flow.t_end - t
    h = min(1e-6 if size < 1e-5 or speed < 1e-5 else 0.01 * size / speed, span)
    h = max(h, _least_step(flow, t))  # rates may be past all floats
    while True:
        try:
            bend = flow.slope(t + h, x + h * slope) - slope
            break
        except StepError:
            h *= 0.1
            if not h > _least_step(flow, t):
                return _least_step(flow, t)
    steepest = max(speed, scaled_norm(bend, scales) / h)
    power = control_power(flow.method)
    tried = max(1e-6, h * 1e-3) if steepest <= 1e-15 else math.pow(0.01 / steepest, power)
    return min(100.0 * h, tried, span)


def at_end(step: Step, time: float) -> bool:
    """Tell whether `time` is the end of `step` up to round-off, so that nothing has to be interpolated."""
    return abs(time - step.t_new) <= 8.0 * float_info.epsilon * max(abs(time), abs(step.t_new))


def reaches(step: Step, time: float) -> bool:
    """Tell whether `time`, which lies after the start of `step`, lies within it."""
    return time <= step.t_new or at_end(step, time)


def interpolate_step(step: Step, time: float) -> Floats:
    """Return the state at `time` within `step` by the method's continuous extension; at the end the end itself."""
    return step.x_new if at_end(step, time) else step.value((time - step.t) / step.h)


def solution(
    method: Method,
    f: Derivative,
    t0: float,
    t_end: float,
    x0: Floats,
    *,
    step: float | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-8,
    samples: int = 1001,
) -> tuple[Floats, Floats]:
    """Return evenly spaced times (samples,) and states (samples, n) of x' = f(t, x); `step` makes the steps fixed."""
    flow = Flow(method, f, t0, t_end, np.array(x0, dtype=float), step=step, rtol=rtol, atol=atol)
    times = sample_times(t0, t_end, samples).tolist()
    states = [flow.x0]
    for done in steps(flow):
        while len(states) < samples and reaches(done, times[len(states)]):
            states.append(interpolate_step(done, times[len(states)]))
    return np.array(times), np.array(states)


# ----------------------------------------------------------------------------------------------------------------------
# The stepper of each family of methods.


def stepper(method: Method, flow: Flow) -> StepsTaken:
    """Return what takes the steps of a method; raises TypeError for a family that is not known."""
    match method:
        case RungeKutta():
            return ExplicitStepper(method.tableau, flow)
        case Collocation():
            return CollocationStepper(method.scheme, flow)
        case AdamsBashforthMoulton():
            return AdamsStepper(method, flow)
        case Stoermer():
            return StoermerStepper(method, flow)
        case StoermerVerlet():
            return VerletStepper(flow)
    raise TypeError(f"{method!r} is no method")
