"""The stepping loop of explicit Runge-Kutta methods in plain Python; `runtime.c` is the same algorithm in C.

Both do the same floating-point operations in the same order, so that they take the same steps to round-off.
Step control: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, sections II.4 and IV.2
(proportional-integral control, automatic first step).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import IntEnum
from sys import float_info
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.integrators.runge_kutta import RungeKutta, Tableau

Floats = NDArray[np.float64]
Derivative = Callable[[float, Floats], Floats]
Settle = Callable[[float, Floats], Floats]

SAFETY: Final = 0.9
GROWTH: Final = 10.0
SHRINKAGE: Final = 5.0
RETREAT: Final = 0.25  # of the step, when a trial step could not be evaluated at all
FAR: Final = 0.1  # of the whole step, by which its end may move when it is settled
FAR_BEYOND_ROUND_OFF: Final = 1e-10
LEAST_AT_KINK: Final = 1e-9  # of the time of the run: what is still a kink in so short a step is a jump
LEAST_ERROR: Final = 1e-4  # remembered by the control: a lucky step does not let the next one grow without measure


class Status(IntEnum):
    """How a run stands; the codes are those of runtime.h."""

    RUNNING = 0
    DONE = 1
    NOT_FINITE = 2
    STEP_UNDERFLOW = 3
    STEP_LIMIT = 4
    CONTRADICTION = 5
    NOT_CLOSED = 6
    INTERRUPTED = 7


class StepError(Exception):
    """A step could not be taken: `status`, at which `time`, and the `component` of the state or row it shows in.

    `rejected` counts the trials that were made in vain.
    """

    def __init__(self, status: Status, time: float, component: int, rejected: int = 0) -> None:
        super().__init__(f"{status.name} at t = {time!r} in component {component}")
        self.status = status
        self.time = time
        self.component = component
        self.rejected = rejected


@dataclass(frozen=True)
class Flow:
    """x' = derivative(t, x) from (t0, x0) to t_end under a method's tableau.

    `settle(t, x)` returns the state from which to go on after an accepted step (put back onto constraints,
    normalised), or x itself; it may raise StepError, as may the derivative.
    """

    tableau: Tableau
    derivative: Derivative
    t0: float
    t_end: float
    x0: Floats
    settle: Settle | None = None


@dataclass(frozen=True)
class Step:
    """An accepted step from (t, x) over h with stage slopes k to (t_new, x_new), where the slope is slope_new.

    `h_next` is the step to try next and `error` the scaled error norm that control remembers (adaptive steps);
    `rejected` counts the trials that failed since the step before.
    """

    t: float
    x: Floats
    h: float
    k: list[Floats]
    t_new: float
    x_new: Floats
    slope_new: Floats
    h_next: float = 0.0
    error: float = LEAST_ERROR
    rejected: int = 0


def fixed_steps(flow: Flow, step: float) -> Iterator[Step]:
    """Yield steps of length `step`; the last one ends exactly at t_end and may be shorter. Raises StepError."""
    count = step_count(flow.t0, flow.t_end, step)
    t, x, slope = flow.t0, flow.x0, finite_slope(flow, flow.t0, flow.x0)
    for number in range(1, count + 1):
        t_new = flow.t0 + number * step if number < count else flow.t_end
        h = step if number < count else flow.t_end - t
        x_new, k = _stages(flow, t, x, slope, h, t_new)
        done = _closed(flow, Step(t, x, h, k, t_new, x_new, slope))
        yield done
        t, x, slope = done.t_new, done.x_new, done.slope_new


def step_count(t0: float, t_end: float, step: float) -> int:
    """Return the number of steps from t0 to t_end; a last piece below 1e-9 of the way belongs to the step before."""
    ratio = (t_end - t0) / step
    nearest = math.floor(ratio + 0.5)
    whole = abs(ratio - nearest) <= 1e-9 * max(1.0, ratio)
    return max(1, nearest if whole else math.ceil(ratio))


def adaptive_steps(flow: Flow, rtol: float, atol: float) -> Iterator[Step]:
    """Yield steps whose estimated error is at most atol + rtol |x| in the mean square; the last ends exactly at t_end.

    Raises StepError: for a trial that cannot be evaluated only after shorter ones failed, down to the least step.
    """
    slope = finite_slope(flow, flow.t0, flow.x0)
    h = first_step(flow, slope, rtol, atol)
    done = Step(flow.t0, flow.x0, 0.0, [], flow.t0, flow.x0, slope, h)
    while done.t_new < flow.t_end:
        done = _accepted_step(flow, done, rtol, atol)
        yield done


def _accepted_step(flow: Flow, before: Step, rtol: float, atol: float) -> Step:
    t, x, proposed, rejected = before.t_new, before.x_new, before.h_next, 0
    failure = StepError(Status.STEP_UNDERFLOW, t, 0)
    while proposed >= _least_step(flow, t):
        last = t + 1.01 * proposed >= flow.t_end
        t_new = flow.t_end if last else t + proposed
        h = flow.t_end - t if last else proposed
        try:
            x_new, k = _stages(flow, t, x, before.slope_new, h, t_new)
            error, worst = error_norm(flow.tableau, h, k, x, x_new, rtol, atol)
            shrink, change = _changes(flow.tableau, error, before.error)
            if error <= 1.0:
                h_next = min(h / change, h) if rejected else h / change
                done = Step(t, x, h, k, t_new, x_new, before.slope_new, h_next, max(error, LEAST_ERROR), rejected)
                closed = _closed(flow, done)
                far = _moved_far(x, x_new, closed.x_new)
                if far is None:
                    return closed
                jump = h <= LEAST_AT_KINK * (flow.t_end - flow.t0)
                failure, proposed = StepError(Status.STEP_UNDERFLOW, t, far), 0.0 if jump else h * RETREAT
            else:
                failure, proposed = StepError(Status.STEP_UNDERFLOW, t, worst), h / shrink
        except StepError as problem:
            failure, proposed = problem, h * RETREAT
        rejected += 1
    raise StepError(failure.status, failure.time, failure.component, rejected)


def _moved_far(x: Floats, x_new: Floats, settled: Floats) -> int | None:
    """Return the component that settling moved most, if by over a tenth of the whole step and round-off; else None.

    Such a step has gone over a kink in the constraints, of which the error estimate knows nothing.
    """
    moved, step = np.abs(settled - x_new), float(np.max(np.abs(x_new - x)))
    most = float(np.max(moved))
    far = most > FAR * step and most > FAR_BEYOND_ROUND_OFF * (1.0 + float(np.max(np.abs(settled))))
    return int(np.argmax(moved)) if far else None


def _least_step(flow: Flow, t: float) -> float:
    return max(16.0 * float_info.epsilon * abs(t), 1e-16 * (flow.t_end - flow.t0))


def _changes(tableau: Tableau, error: float, remembered: float) -> tuple[float, float]:
    """Return by what to divide the step after a rejected and after an accepted trial."""
    power = 1.0 / (min(tableau.order, tableau.error_order) + 1.0)
    integral = 0.2 * power
    proportional = math.pow(error, power - 0.75 * integral)
    change = proportional / math.pow(remembered, integral) / SAFETY
    return min(SHRINKAGE, proportional / SAFETY), max(1.0 / GROWTH, min(SHRINKAGE, change))


def _stages(flow: Flow, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> tuple[Floats, list[Floats]]:
    """Return x_new and the slopes; the last slope only if the error estimate needs it before x_new is settled."""
    tableau, k = flow.tableau, [slope]
    for stage in range(1, len(tableau.c) - 1):
        at = x + h * combination(tableau.A[stage, :stage], k)
        k.append(finite_slope(flow, t + float(tableau.c[stage]) * h, at))
    x_new = x + h * combination(tableau.A[-1, :-1], k)
    _require_finite(x_new, t_new)
    if tableau.end_in_error:
        k.append(finite_slope(flow, t_new, x_new))
    return x_new, k


def _closed(flow: Flow, trial: Step) -> Step:
    """Return `trial` with its end settled and the slope there; a changed end needs a slope of its own."""
    x_new = trial.x_new if flow.settle is None else flow.settle(trial.t_new, trial.x_new)
    if not flow.tableau.end_in_error:
        slope = finite_slope(flow, trial.t_new, x_new)
        return replace(trial, x_new=x_new, k=[*trial.k, slope], slope_new=slope)
    kept = np.array_equal(x_new, trial.x_new)
    return replace(trial, x_new=x_new, slope_new=trial.k[-1] if kept else finite_slope(flow, trial.t_new, x_new))


def combination(weights: Floats, k: list[Floats]) -> Floats:
    """Return sum_j weights_j k_j, added in order of j and without the zero weights."""
    total = np.zeros_like(k[0])
    for weight, slope in zip(weights.tolist(), k, strict=True):
        if weight != 0.0:
            total = total + weight * slope
    return total


def finite_slope(flow: Flow, t: float, x: Floats) -> Floats:
    """Return the derivative at (t, x); raises StepError where it is not finite."""
    slope = flow.derivative(t, x)
    _require_finite(slope, t)
    return slope


def _require_finite(values: Floats, time: float) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        raise StepError(Status.NOT_FINITE, time, int(np.argmin(finite)))


def _scaled_norm(values: Floats, scales: Floats) -> float:
    total = 0.0
    for value, scale in zip(values.tolist(), scales.tolist(), strict=True):
        total += (value / scale) * (value / scale)
    return math.sqrt(total / len(values))


def error_norm(
    tableau: Tableau, h: float, k: list[Floats], x: Floats, x_new: Floats, rtol: float, atol: float
) -> tuple[float, int]:
    """Return the mean-square error in units of atol + rtol max(|x|, |x_new|), and the component with most of it."""
    assert tableau.error is not None
    error = h * combination(tableau.error[: len(k)], k)
    scales = atol + rtol * np.maximum(np.abs(x), np.abs(x_new))
    return _scaled_norm(error, scales), int(np.argmax(np.abs(error / scales)))


def first_step(flow: Flow, slope: Floats, rtol: float, atol: float) -> float:
    """Return a first step for which an explicit Euler step and the second derivative stay small."""
    scales = atol + rtol * np.abs(flow.x0)
    size, speed = _scaled_norm(flow.x0, scales), _scaled_norm(slope, scales)
    span = flow.t_end - flow.t0
    h = min(1e-6 if size < 1e-5 or speed < 1e-5 else 0.01 * size / speed, span)
    while True:
        try:
            bend = finite_slope(flow, flow.t0 + h, flow.x0 + h * slope) - slope
            break
        except StepError:
            h *= 0.1
            if not h > _least_step(flow, flow.t0):
                return _least_step(flow, flow.t0)
    steepest = max(speed, _scaled_norm(bend, scales) / h)
    power = 1.0 / (min(flow.tableau.order, flow.tableau.error_order) + 1.0)
    tried = max(1e-6, h * 1e-3) if steepest <= 1e-15 else math.pow(0.01 / steepest, power)
    return min(100.0 * h, tried, span)


def sample_times(t0: float, t_end: float, samples: int) -> Floats:
    """Return the times (samples,) of evenly spaced samples, both ends among them and exact."""
    times = t0 + (t_end - t0) * np.arange(samples) / (samples - 1)
    times[-1] = t_end
    return times


def at_end(step: Step, time: float) -> bool:
    """Tell whether `time` is the end of `step` up to round-off, so that nothing has to be interpolated."""
    return abs(time - step.t_new) <= 8.0 * float_info.epsilon * max(abs(time), abs(step.t_new))


def reaches(step: Step, time: float) -> bool:
    """Tell whether `time`, which lies after the start of `step`, lies within it."""
    return time <= step.t_new or at_end(step, time)


def sampled(tableau: Tableau, step: Step, time: float) -> Floats:
    """Return the state at `time` within `step` by the method's continuous extension; at the end the end itself."""
    if at_end(step, time):
        return step.x_new
    theta = (time - step.t) / step.h
    weights = np.zeros(len(step.k))
    for column in tableau.dense.T[::-1]:
        weights = (weights + column) * theta
    return step.x + step.h * combination(weights, step.k)


def solution(
    method: RungeKutta,
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
    flow = Flow(method.tableau, f, t0, t_end, np.array(x0, dtype=float))
    times = sample_times(t0, t_end, samples).tolist()
    states = [flow.x0]
    for done in adaptive_steps(flow, rtol, atol) if step is None else fixed_steps(flow, step):
        while len(states) < samples and reaches(done, times[len(states)]):
            states.append(sampled(flow.tableau, done, times[len(states)]))
    return np.array(times), np.array(states)
