"""What the stepping loop and the families of methods share: the flow, trials, steps, and why a step fails."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import field
from enum import IntEnum
from sys import float_info
from typing import Final, Protocol

import numpy as np

from multibody_sym.integrators.methods.methods import Method
from multibody_sym.integrators.pairing import Pairing
from multibody_sym.integrators.stage_equations import StageEquations
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

Derivative = Callable[[float, Floats], Floats]
Settle = Callable[[float, Floats], Floats]

LEAST_STEPS: Final = 200.0  # of a run in modes, ...
STANDING: Final = 1000.0  # ... and of one in which nothing moves, so that no rate tells what comes
BESIDE: Final = 32.0  # margins: what is that near zero all along a piece of a step is zero but for round-off
_MOVED: Final = 2.0**-20  # part of the largest component by which the state is moved, ...
_GOLDEN: Final = 0.6180339887498949  # ... each component differently: no difference between two stays as it is
LEAST_ERROR: Final = 1e-4  # remembered by the control: a lucky step does not let the next one grow without measure


class Status(IntEnum):
    """How a run stands; the codes from 0 on are those of runtime.h."""

    RUNNING = 0
    DONE = 1
    NOT_FINITE = 2
    STEP_UNDERFLOW = 3
    STEP_LIMIT = 4
    CONTRADICTION = 5
    NOT_CLOSED = 6
    STOPPED = 7
    NOT_CONVERGED = 8
    SINGULAR = 9
    INTERRUPTED = -1
    LEFT = -2
    NO_SLOPE = -3
    NO_MODE = -4
    CHATTERS = -5


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
class Events:
    """Switching functions `values(t, x)` (ng,) and for each whether it is `terminal`.

    The run stops where a terminal one becomes positive; where another changes sign, a kink, a step ends and the next
    one starts afresh. What is zero at the start crosses nothing until it has left zero.
    The last are the switching functions of a mode, with `margins` by which they may exceed zero: the run stops where
    one exceeds that, from whichever side it starts; if it is negative, once it has been below it. Those at the
    places `limiting` keep adaptive steps short, none of which leads over one of the `moments`, times that rise.
    """

    values: Callable[[float, Floats], Floats]
    terminal: tuple[bool, ...]
    margins: tuple[float, ...] = ()
    limiting: tuple[int, ...] = ()
    moments: tuple[float, ...] = ()

    def beyond(self, t: float, x: Floats) -> Floats:
        """Return the values (ng,), those of a mode less their margins."""
        values = self.values(t, x)
        if self.margins:
            values = values.copy()
            values[len(values) - len(self.margins) :] -= self.margins
        return values

    def unseen(self, index: int, t: float, x: Floats) -> float:
        """Return how far from zero the values of a function are round-off all along a piece of a step from (t, x).

        Without a margin that is what it changes by with the round-off of the largest component in all of them.
        """
        own = index - (len(self.terminal) - len(self.margins))
        if own >= 0 and self.margins[own] != 0.0:
            return BESIDE * abs(self.margins[own])
        parts = np.array([_MOVED * (0.5 + j * _GOLDEN % 1.0) for j in range(len(x))])
        try:
            beside = self.beyond(t, x + parts * np.abs(x).max(initial=0.0))
        except StepError:
            return 0.0
        return float(BESIDE * float_info.epsilon / _MOVED * abs(beside[index] - self.beyond(t, x)[index]))

    def to_moment(self, t: float) -> float:
        """Return the way to the next moment, later than round-off tells apart; infinity where there is none."""
        place = bisect_right(self.moments, t + 16.0 * float_info.epsilon * abs(t))
        return self.moments[place] - t if place < len(self.moments) else math.inf

    def sides(self, t: float, x: Floats) -> Floats:
        """Return the sides (ng,) of zero on which the functions stand at the start, 0 for none yet.

        Those of a mode stand below, but for one that must have been below its margin first.
        """
        found = np.sign(self.beyond(t, x))
        of_mode = found[len(found) - len(self.margins) :]
        of_mode[np.array(self.margins) >= 0.0] = -1.0
        return found


@dataclass(frozen=True)
class Rows:
    """What a step over a singular position needs to know of the constraint rows.

    `latest()`: the rows' independence at the latest derivative, at most 1 and 0 where they depend on each other;
    `independence(t, x)`: that at any state; `closed(t, x)`: the state put onto the constraints; may raise StepError.
    `kept`: the end of each step is put there anyway. `crosses`: steps lead across singular positions.
    """

    latest: Callable[[], float]
    independence: Callable[[float, Floats], float]
    closed: Settle
    kept: bool
    crosses: bool = True


@dataclass
class Counts:
    """What implicit methods cost beyond evaluations of the derivative."""

    jacobians: int = 0
    factorisations: int = 0


@dataclass(frozen=True)
class Flow:
    """x' = derivative(t, x) from (t0, x0) to t_end by a method; where it has `begun` before, x0 is its state then.

    `settle(t, x)` returns the state from which to go on after an accepted step (put back onto constraints,
    normalised), or x itself; it may raise StepError, as may the derivative. `settle_sample` does so for states between
    steps and raises nothing. `step`: fixed, or None: adaptive by `rtol`, `atol`. `pairs`: which speeds in x = (q, u)
    are rates of which coordinates. `stages`: what the stages of implicit methods solve; these add to `counts`. `rows`:
    of a constrained system. `whole`: how long the run is of which this one repeats a part, 0 if it is none. `noise()`:
    the part of the state by which round-off may falsify the step on trial.
    """

    method: Method
    derivative: Derivative
    t0: float
    t_end: float
    x0: Floats
    settle: Settle | None = None
    step: float | None = None
    rtol: float = 1e-8
    atol: float = 1e-8
    settle_sample: Settle | None = None
    events: Events | None = None
    rows: Rows | None = None
    noise: Callable[[], float] = float
    pairs: Pairing | None = None
    stages: StageEquations | None = None
    counts: Counts = field(default_factory=Counts)
    begun: float | None = None
    whole: float = 0.0

    @property
    def lasts(self) -> float:
        """How long (s) the whole run is."""
        return self.whole or self.t_end - self.t0

    @property
    def start(self) -> float:
        """The time of x0."""
        return self.t0 if self.begun is None else self.begun

    @property
    def pairing(self) -> Pairing:
        """The pairing of coordinates and speeds; as many of one as of the other unless `pairs` says otherwise."""
        return self.pairs or Pairing.of_equals(len(self.x0) // 2)

    def scales(self, x: Floats, x_new: Floats) -> Floats:
        """Return the tolerance of each component in a step between two states."""
        scales: Floats = self.atol + self.rtol * np.maximum(np.abs(x), np.abs(x_new))
        return scales

    def slope(self, t: float, x: Floats) -> Floats:
        """Return the derivative at (t, x); raises StepError where it is not finite."""
        slope = self.derivative(t, x)
        require_finite(slope, t)
        return slope


@dataclass(frozen=True)
class Trial:
    """A step on trial from (t, x), where the slope is `slope`, over h to (t_new, x_new).

    `error`: the estimate of its error (n,), None where the method makes none; `stages`: what its family keeps;
    `coarse`: a second estimate of lower order (n,), where there is one; `least_growth`: a step that could grow, but by
    less than this factor, keeps its length.
    """

    t: float
    x: Floats
    slope: Floats
    h: float
    t_new: float
    x_new: Floats
    error: Floats | None
    stages: list[Floats]
    coarse: Floats | None = None
    least_growth: float = 1.0


@dataclass(frozen=True)
class Step:
    """An accepted step from (t, x) over h to (t_new, x_new), where the slope is slope_new.

    `value(theta)` is the state at t + theta h. `event`: the switching function that ended the step at (t_new, x_new),
    nearly at h; the slope from there on is another one. `singular`: when it passed singular positions. `h_next` is the
    step to try next and `error` the scaled error norm that control remembers (adaptive steps); `rejected` counts the
    trials that failed since the step before.
    """

    t: float
    x: Floats
    h: float
    t_new: float
    x_new: Floats
    slope_new: Floats
    value: Callable[[float], Floats]
    h_next: float = 0.0
    error: float = LEAST_ERROR
    rejected: int = 0
    event: int | None = None
    singular: tuple[float, ...] = ()


class Stepper(Protocol):
    """A family of methods at work: restart, then for each step attempt (until one is good enough), finish, advance."""

    def restart(self) -> None:
        """Let nothing that was before count: at the start and where an event has ended a step."""

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> Trial:
        """Return the step over any h, shorter or longer than the one before; raises StepError."""

    def finish(self, trial: Trial, x_new: Floats) -> Step:
        """Return the step that ends at x_new, which is the end of `trial` put onto constraints; raises StepError."""

    def advance(self, step: Step) -> None:
        """Let `step` be the one before."""


def longest_in_modes(time: float, slope: Floats) -> float:
    """Return the longest step (s) of a run in modes that takes so much time, where x changes at the rates `slope`."""
    return time / (LEAST_STEPS if float(np.abs(slope).max(initial=0.0)) > 0.0 else STANDING)


def combination(weights: Floats, k: list[Floats]) -> Floats:
    """Return sum_j weights_j k_j, added in order of j and without the zero weights."""
    total = np.zeros_like(k[0])
    for weight, slope in zip(weights.tolist(), k, strict=True):
        if weight != 0.0:
            total = total + weight * slope
    return total


def scaled_norm(values: Floats, scales: Floats) -> float:
    """Return the mean square of the values in units of the scales."""
    total = 0.0
    for value, scale in zip(values.tolist(), scales.tolist(), strict=True):
        total += (value / scale) * (value / scale)
    return math.sqrt(total / len(values))


def hermite(x: Floats, slope: Floats, x_new: Floats, slope_new: Floats, h: float, theta: float) -> Floats:
    """Return the cubic through both ends of a step with their slopes, at theta."""
    rest = 1.0 - theta
    a, b, c = theta * theta * (3.0 - 2.0 * theta), h * theta * rest * rest, -h * theta * theta * rest
    return x + a * (x_new - x) + b * slope + c * slope_new


def require_finite(values: Floats, time: float) -> None:
    """Raise StepError with the first component that is not finite."""
    finite = np.isfinite(values)
    if not finite.all():
        raise StepError(Status.NOT_FINITE, time, int(np.argmin(finite)))
