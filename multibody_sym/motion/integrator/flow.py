"""What the stepping loop and the families of methods share: the flow, trials, steps, and why a step fails."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import field
from sys import float_info
from typing import Protocol

import numpy as np

from multibody_sym.motion.methods.table import Method
from multibody_sym.program.runtime_constants import (
    BESIDE,
    C_SERIES,
    D_SERIES,
    GOLDEN,
    LEAST_ERROR,
    LEAST_STEPS,
    MOVED,
    SERIES,
    STANDING,
    Status,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# How coordinates follow speeds: displacements along speeds, and their second derivatives where a ball turns.
#
# A ball's displacement from orientation R_0 is the rotation vector phi in R = R_0 exp([phi]); with the body's angular
# velocity w in its own axes and s = |phi|^2
#
#     w = phi' - b phi x phi' + d phi x (phi x phi'),     b = (1 - cos |phi|) / s,   d = (|phi| - sin |phi|) / |phi|^3
#     phi' = w + phi x w / 2 + c phi x (phi x w),         c = (1 - |phi|/2 cot(|phi|/2)) / s
#
# Source: any text on rotation vectors; the series are those of the functions.


Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Pairing:
    """Which speeds are rates of which coordinates, in x = (q, u) with nq coordinates.

    `plain`: pairs (a, b), q[a]' = u[b]; `balls`: pairs (a, b) of the first indices of a unit quaternion in q and of the
    body's angular velocity in u.
    """

    nq: int
    plain: tuple[tuple[int, int], ...]
    balls: tuple[tuple[int, int], ...] = ()

    @staticmethod
    def of_equals(n: int) -> Pairing:
        """Return the pairing of n coordinates with their n rates."""
        return Pairing(n, tuple((k, k) for k in range(n)))

    def moved(self, q: Floats, displacement: Floats) -> Floats:
        """Return the coordinates q after a displacement (nu,)."""
        new = q.copy()
        for a, b in self.plain:
            new[a] = q[a] + displacement[b]
        for a, b in self.balls:
            new[a : a + 4] = _turn_quaternion(q[a : a + 4].tolist(), _vector(displacement, b))
        return new

    def displacement(self, q: Floats, other: Floats, nu: int) -> Floats:
        """Return the displacement (nu,) that leads from the coordinates q to the other ones."""
        found = np.zeros(nu)
        for a, b in self.plain:
            found[b] = other[a] - q[a]
        for a, b in self.balls:
            found[b : b + 3] = _rotation_vector(q[a : a + 4].tolist(), other[a : a + 4].tolist())
        return found

    def accelerations(self, displacement: Floats, u: Floats, udot: Floats) -> Floats:
        """Return the second derivatives (nu,) of displacements that have got this far, for speeds u with rates udot."""
        found = udot.copy()
        for _, b in self.balls:
            phi, w, wdot = _vector(displacement, b), _vector(u, b), _vector(udot, b)
            found[b : b + 3] = _second_derivative(phi, w, wdot)
        return found

    def speeds(self, displacement: Floats, rates: Floats) -> Floats:
        """Return the speeds (nu,) of displacements that have got this far and change at these rates."""
        found = rates.copy()
        for _, b in self.balls:
            found[b : b + 3] = _angular_velocity(_vector(displacement, b), _vector(rates, b))
        return found

    def farthest_turn(self, displacement: Floats) -> float:
        """Return the largest angle by which a ball is displaced."""
        return max((math.sqrt(_square(_vector(displacement, b))) for _, b in self.balls), default=0.0)


def _vector(values: Floats, first: int) -> Vector:
    return float(values[first]), float(values[first + 1]), float(values[first + 2])


def _square(v: Vector) -> float:
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _turn_quaternion(q: list[float], phi: Vector) -> list[float]:
    """Return the quaternion q times that of the rotation vector phi."""
    angle = math.sqrt(_square(phi))
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    x, y, z = s * phi[0], s * phi[1], s * phi[2]
    return [
        q[0] * c - q[1] * x - q[2] * y - q[3] * z,
        q[0] * x + q[1] * c + q[2] * z - q[3] * y,
        q[0] * y - q[1] * z + q[2] * c + q[3] * x,
        q[0] * z + q[1] * y - q[2] * x + q[3] * c,
    ]


def _rotation_vector(q: list[float], p: list[float]) -> Vector:
    """Return the rotation vector of at most half a turn that leads from the quaternion q to p."""
    w = q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] * p[3]
    x = q[0] * p[1] - q[1] * p[0] - q[2] * p[3] + q[3] * p[2]
    y = q[0] * p[2] + q[1] * p[3] - q[2] * p[0] - q[3] * p[1]
    z = q[0] * p[3] - q[1] * p[2] + q[2] * p[1] - q[3] * p[0]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(sine, w) / sine if sine > 0.0 else 2.0
    return factor * x, factor * y, factor * z


def _coefficients(s: float) -> tuple[float, float]:
    """Return c and its derivative by s."""
    if s < SERIES:
        c = slope = 0.0
        for power in range(len(C_SERIES) - 1, -1, -1):
            c = c * s + C_SERIES[power]
        for power in range(len(C_SERIES) - 1, 0, -1):
            slope = slope * s + power * C_SERIES[power]
        return c, slope
    half = 0.5 * math.sqrt(s)
    sine, cotangent = math.sin(half), math.cos(half) / math.sin(half)
    c = (1.0 - half * cotangent) / s
    return c, ((half / (sine * sine) - cotangent) / (8.0 * half) - c) / s


def _sum(*terms: tuple[float, Vector]) -> Vector:
    """Return the sum of factors times vectors, added in their order."""
    x = y = z = 0.0
    for factor, v in terms:
        x, y, z = x + factor * v[0], y + factor * v[1], z + factor * v[2]
    return x, y, z


def _second_derivative(phi: Vector, w: Vector, wdot: Vector) -> Vector:
    """Return phi'' of a ball displaced by phi that turns at w with the acceleration wdot."""
    c, c_by_s = _coefficients(_square(phi))
    first = _cross(phi, w)
    second = _cross(phi, first)
    rate = _sum((1.0, w), (0.5, first), (c, second))
    change = 2.0 * c_by_s * (phi[0] * rate[0] + phi[1] * rate[1] + phi[2] * rate[2])
    twist = _sum((1.0, _cross(rate, w)), (1.0, _cross(phi, wdot)))
    return _sum((1.0, wdot), (0.5, twist), (change, second), (c, _cross(rate, first)), (c, _cross(phi, twist)))


def _angular_velocity(phi: Vector, rate: Vector) -> Vector:
    """Return the angular velocity of a ball displaced by phi whose rotation vector changes at `rate`."""
    s = _square(phi)
    angle = math.sqrt(s)
    sinc = math.sin(0.5 * angle) / (0.5 * angle) if angle > 0.0 else 1.0
    first = _cross(phi, rate)
    return _sum((1.0, rate), (-0.5 * sinc * sinc, first), (_d(s), _cross(phi, first)))


def _d(s: float) -> float:
    """Return (|phi| - sin |phi|) / |phi|^3."""
    if s >= SERIES:
        return (math.sqrt(s) - math.sin(math.sqrt(s))) / (s * math.sqrt(s))
    d = 0.0
    for coefficient in D_SERIES[::-1]:
        d = d * s + coefficient
    return d


# ----------------------------------------------------------------------------------------------------------------------
# What the stages of an implicit method solve: differential equations, with constraint rows among them or without.


@dataclass(frozen=True)
class StageEquations:
    """x' = F(t, x, z), 0 = G(t, x) of n states and m multipliers, as E y' = f(t, y) with y = (x, z), f = (F, G).

    F is linear in z, and G_x F_z regular but for dependent rows of G: index 2. Without rows m = 0, an ordinary
    differential equation. `values(t, y)` is f (n + m,), `jacobian(t, y)` its derivative by y, `multipliers(t, x)` (m,)
    are those to begin with, and `kept(jacobian)` tells which of the m rows, and of the multipliers in their places,
    are independent; the other multipliers are zero. `found(t, x)` is told of each stage of a trial.
    """

    values: Callable[[float, Floats], Floats]
    jacobian: Callable[[float, Floats], Floats]
    multipliers: Callable[[float, Floats], Floats]
    kept: Callable[[Floats], Sequence[int]]
    found: Callable[[float, Floats], None] = lambda t, x: None


def ordinary(
    derivative: Callable[[float, Floats], Floats], jacobian: Callable[[float, Floats], Floats]
) -> StageEquations:
    """Return x' = derivative(t, x) as equations without rows."""
    none = np.zeros(0)
    return StageEquations(derivative, jacobian, lambda t, x: none, lambda J: ())


Derivative = Callable[[float, Floats], Floats]
Settle = Callable[[float, Floats], Floats]


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
        parts = np.array([MOVED * (0.5 + j * GOLDEN % 1.0) for j in range(len(x))])
        try:
            beside = self.beyond(t, x + parts * np.abs(x).max(initial=0.0))
        except StepError:
            return 0.0
        return float(BESIDE * float_info.epsilon / MOVED * abs(beside[index] - self.beyond(t, x)[index]))

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
class RowClosure:
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
    of a constrained system. `whole`: how long the run is of which this one is or repeats a part, 0 if it is none.
    `noise()`: the part of the state by which round-off may falsify the step on trial.
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
    rows: RowClosure | None = None
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
class TrialStep:
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


class StepsTaken(Protocol):
    """A family of methods at work: restart, then for each step attempt (until one is good enough), finish, advance."""

    def restart(self) -> None:
        """Let nothing that was before count: at the start and where an event has ended a step."""

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> TrialStep:
        """Return the step over any h, shorter or longer than the one before; raises StepError."""

    def finish(self, trial: TrialStep, x_new: Floats) -> Step:
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


# ----------------------------------------------------------------------------------------------------------------------
# Times of samples and of fixed steps.


def steps_before(t0: float, time: float, step: float) -> int:
    """Return how many whole steps from t0 on do not end after a time."""
    number = math.floor((time - t0) / step)
    return number + (t0 + (number + 1) * step <= time) - (t0 + number * step > time)


def sample_times(t0: float, t_end: float, samples: int) -> Floats:
    """Return the times (samples,) of evenly spaced samples, both ends among them and exact."""
    times = t0 + (t_end - t0) * np.arange(samples) / (samples - 1)
    times[-1] = t_end
    return times
