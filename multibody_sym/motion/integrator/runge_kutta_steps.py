"""Steps of Runge-Kutta methods, explicit and implicit; `explicit.c` and `implicit.c` are the same in C."""

from __future__ import annotations

import math
from dataclasses import field
from sys import float_info

import numpy as np

from multibody_sym.motion.integrator.flow import (
    Flow,
    Step,
    StepError,
    TrialStep,
    combination,
    hermite,
    require_finite,
    scaled_norm,
)
from multibody_sym.motion.methods.explicit import Tableau
from multibody_sym.motion.methods.multistep import AdamsBashforthMoulton, Scheme, Stoermer
from multibody_sym.program.runtime_constants import (
    ADAPTIVE_ROUNDS,
    FAR,
    FARTHEST_TURN,
    FIXED_ROUNDS,
    GROWTHS,
    KAPPA,
    LEAST_GROWTH,
    LEAST_SCALE,
    SAME_LENGTH,
    SHORTEST_STEP,
    SLOW,
    STANDSTILL,
    Status,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats


@dataclass(frozen=True)
class ExplicitStepper:
    """An explicit Runge-Kutta method at work; the stages of a trial are the slopes k."""

    tableau: Tableau
    flow: Flow

    def restart(self) -> None:
        """Do nothing: a step knows nothing of those before."""

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> TrialStep:
        """Return a step; the last slope is among its stages only if the error estimate needs it."""
        tableau, k, end = self.tableau, [slope], self.tableau.stages - 1
        self._extend(t, x, h, k, end)
        x_new = x + h * combination(tableau.A[end, :end], k)
        require_finite(x_new, t_new)
        if tableau.end_in_error:
            k.append(self.flow.slope(t_new, x_new))
        weights = (tableau.error, tableau.coarse_error) if self.flow.step is None else (None, None)
        error, coarse = (None if w is None else h * combination(w[: len(k)], k) for w in weights)
        return TrialStep(t, x, slope, h, t_new, x_new, error, k, coarse)

    def _extend(self, t: float, x: Floats, h: float, k: list[Floats], count: int) -> None:
        """Add the slopes of further stages to `k` until there are `count`."""
        for stage in range(len(k), count):
            at = x + h * combination(self.tableau.A[stage, :stage], k)
            k.append(self.flow.slope(t + float(self.tableau.c[stage]) * h, at))

    def finish(self, trial: TrialStep, x_new: Floats) -> Step:
        """Return the step with the slope at its end; a changed end needs one of its own."""
        k = trial.stages
        if not self.tableau.end_in_error:
            slope_new = self.flow.slope(trial.t_new, x_new)
            k = [*k, slope_new]
        else:
            kept = np.array_equal(x_new, trial.x_new)
            slope_new = k[-1] if kept else self.flow.slope(trial.t_new, x_new)

        def value(theta: float) -> Floats:
            self._extend(trial.t, trial.x, trial.h, k, len(self.tableau.c))
            weights = np.zeros(len(k))
            for column in self.tableau.dense.T[::-1]:
                weights = (weights + column) * theta
            return trial.x + trial.h * combination(weights, k)

        return Step(trial.t, trial.x, trial.h, trial.t_new, x_new, slope_new, value)

    def advance(self, step: Step) -> None:
        """Do nothing: a step knows nothing of those before."""


# ----------------------------------------------------------------------------------------------------------------------
# Steps of methods that look back over steps of one length; `multistep.c` is the same in C.




@dataclass(frozen=True)
class Point:
    """A state x with its slope; `displacement` (nu,) of the step that led away from it, where the method needs it."""

    x: Floats
    slope: Floats
    displacement: Floats | None = None


@dataclass
class Past:
    """The points before the present one, newest first, `spacing` apart; at most `most` of them."""

    most: int
    points: list[Point] = field(default_factory=list)
    spacing: float = 0.0

    def fits(self, h: float) -> bool:
        """Tell whether a step over h can look back at all the points it needs."""
        return len(self.points) == self.most and abs(h - self.spacing) <= SAME_LENGTH * h

    def add(self, point: Point, h: float) -> None:
        """Let a step over h that began at `point` be the newest; with those of another length nothing is left."""
        if abs(h - self.spacing) > SAME_LENGTH * h:
            self.points, self.spacing = [], h
        self.points = [point, *self.points][: self.most]


class AdamsStepper:
    """An Adams-Bashforth-Moulton method at work; steps without enough of a past are the starter's."""

    def __init__(self, method: AdamsBashforthMoulton, flow: Flow) -> None:
        self.weights = method.tables
        self.flow = flow
        self.starter = ExplicitStepper(method.starter, flow)
        self.past = Past(method.past)
        self.last: TrialStep | None = None

    def restart(self) -> None:
        """Forget the past."""
        self.past.points = []

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> TrialStep:
        """Return a step; only one of the starter has stages."""
        if not self.past.fits(h):
            return self.starter.attempt(t, x, slope, h, t_new)
        slopes = [slope, *(point.slope for point in self.past.points)]
        predicted = x + h * combination(self.weights["predictor"], slopes)
        new = self.flow.slope(t_new, predicted)
        x_new = x + h * combination(self.weights["corrector"], [new, *slopes[:-1]])
        require_finite(x_new, t_new)
        return TrialStep(t, x, slope, h, t_new, x_new, None, [])

    def finish(self, trial: TrialStep, x_new: Floats) -> Step:
        """Return the step with the slope at its end."""
        self.last = trial
        if trial.stages:
            return self.starter.finish(trial, x_new)
        return _finish_step(self.flow, trial, x_new, self.past.points[0])

    def advance(self, step: Step) -> None:
        """Let `step` be the newest of the past."""
        assert self.last is not None
        self.past.add(Point(step.x, self.last.slope), step.h)


class VerletStepper:
    """Velocity Verlet at work."""

    def __init__(self, flow: Flow) -> None:
        self.flow = flow

    def restart(self) -> None:
        """Do nothing: a step knows nothing of those before."""

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> TrialStep:
        """Return a step."""
        pairing = self.flow.pairing
        nq, u, udot = pairing.nq, x[pairing.nq :], slope[pairing.nq :]
        q_new = pairing.moved(x[:nq], h * (u + (0.5 * h) * udot))
        new = self.flow.slope(t_new, np.concatenate([q_new, u + h * udot]))
        x_new = np.concatenate([q_new, u + (0.5 * h) * (udot + new[nq:])])
        require_finite(x_new, t_new)
        return TrialStep(t, x, slope, h, t_new, x_new, None, [])

    def finish(self, trial: TrialStep, x_new: Floats) -> Step:
        """Return the step with the slope at its end."""
        return _finish_step(self.flow, trial, x_new, None)

    def advance(self, step: Step) -> None:
        """Do nothing: a step knows nothing of those before."""


class StoermerStepper:
    """Stoermer's method at work, for displacements from the present coordinates.

    A ball's displacement is its rotation vector since the present point, at which it is zero; so the second derivatives
    at all points are formed anew in each step. Steps without enough of a past, and steps in which a ball turns far, are
    the starter's. Displacements are kept from step to step, for differences of coordinates would lose digits.
    """

    def __init__(self, method: Stoermer, flow: Flow) -> None:
        self.weights = method.tables
        self.flow = flow
        self.starter = ExplicitStepper(method.starter, flow)
        self.past = Past(method.past)
        self.last: TrialStep | None = None
        self.displacement: Floats | None = None  # of the trial that was finished last

    def restart(self) -> None:
        """Forget the past."""
        self.past.points = []

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> TrialStep:
        """Return a step; the first of its stages is its displacement, others are the starter's."""
        too_short = self.flow.step is not None and h < SHORTEST_STEP * self.flow.step
        if not self.past.fits(h) or too_short or self._turn() > FARTHEST_TURN:
            return self.starter.attempt(t, x, slope, h, t_new)
        pairing, nq = self.flow.pairing, self.flow.pairing.nq
        before = self.past.points[0].displacement
        assert before is not None
        second = self._second_derivatives(x, slope)
        moved = before + (h * h) * combination(self.weights["position"], second)
        q_new = pairing.moved(x[:nq], moved)
        rates = moved / h + h * combination(self.weights["predictor"], second)
        predicted = np.concatenate([q_new, pairing.speeds(moved, rates)])
        new = self.flow.slope(t_new, predicted)
        ahead = pairing.accelerations(moved, predicted[nq:], new[nq:])
        rates = moved / h + h * combination(self.weights["corrector"], [ahead, *second[:-1]])
        x_new = np.concatenate([q_new, pairing.speeds(moved, rates)])
        require_finite(x_new, t_new)
        return TrialStep(t, x, slope, h, t_new, x_new, None, [moved])

    def _turn(self) -> float:
        """Return an upper bound of the angle by which a ball has turned since the oldest point."""
        displacements = [point.displacement for point in self.past.points if point.displacement is not None]
        return sum(map(self.flow.pairing.farthest_turn, displacements))

    def _second_derivatives(self, x: Floats, slope: Floats) -> list[Floats]:
        """Return the displacements' second derivatives, at the present point and those before."""
        pairing, nq = self.flow.pairing, self.flow.pairing.nq
        found = [slope[nq:]]
        for point in self.past.points:
            away = pairing.displacement(x[:nq], point.x[:nq], len(x) - nq)
            found.append(pairing.accelerations(away, point.x[nq:], point.slope[nq:]))
        return found

    def finish(self, trial: TrialStep, x_new: Floats) -> Step:
        """Return the step with the slope at its end; what settling has moved belongs to its displacement."""
        pairing, nq, nu = self.flow.pairing, self.flow.pairing.nq, len(x_new) - self.flow.pairing.nq
        self.last = trial
        if len(trial.stages) > 1:
            self.displacement = pairing.displacement(trial.x[:nq], x_new[:nq], nu)
            return self.starter.finish(trial, x_new)
        self.displacement = trial.stages[0] + pairing.displacement(trial.x_new[:nq], x_new[:nq], nu)
        return _finish_step(self.flow, trial, x_new, self.past.points[0])

    def advance(self, step: Step) -> None:
        """Let `step` be the newest of the past."""
        assert self.last is not None
        self.past.add(Point(step.x, self.last.slope, self.displacement), step.h)


def _finish_step(flow: Flow, trial: TrialStep, x_new: Floats, before: Point | None) -> Step:
    """Return the step with the slope at its end, between them the polynomial through both ends and `before`."""
    slope_new = flow.slope(trial.t_new, x_new)

    def value(theta: float) -> Floats:
        if before is None:
            return hermite(trial.x, trial.slope, x_new, slope_new, trial.h, theta)
        here, ahead, back = 1.0 - theta * theta, 0.5 * theta * (theta + 1.0), 0.5 * theta * (theta - 1.0)
        here, ahead, back = here * here, ahead * ahead, back * back
        slopes = here * theta * trial.slope + ahead * (theta - 1.0) * slope_new + back * (theta + 1.0) * before.slope
        ahead, back = ahead * (4.0 - 3.0 * theta), back * (4.0 + 3.0 * theta)
        return here * trial.x + ahead * x_new + back * before.x + trial.h * slopes

    return Step(trial.t, trial.x, trial.h, trial.t_new, x_new, slope_new, value)


# ----------------------------------------------------------------------------------------------------------------------
# Steps of collocation methods by simplified Newton iteration with the exact Jacobian; `implicit.c` is the same in C.
#
# The unknowns of a stage are y = (x, z), with multipliers z where rows are part of the equations:
# W E (y - y0) = h start f(t, y0) + h f(t + c h, y), `StageEquations`. Steps and iterations are judged by x alone; the
# multipliers come along, with the order of the stages.
#
# Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.8 and VII.4.


# ----------------------------------------------------------------------------------------------------------------------
# The linear equations of simplified Newton iteration for the stages of a collocation method, factorised.
#
# Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.8.


class StageMatrices:
    """The factors of gamma E - h J and of [alpha E - h J, -beta E; beta E, alpha E - h J] for the kept rows."""

    def __init__(self, scheme: Scheme, differential: Floats, jacobian: Floats, h: float) -> None:
        """Factorise; `differential` (n,) is the diagonal of E. Raises ZeroDivisionError where a matrix is singular."""
        self.scheme = scheme
        E, J = np.diag(differential), h * jacobian
        if scheme.gamma > 0.0 or scheme.error is not None:
            self.single = _factors(scheme.filter * E - J)
        if scheme.beta > 0.0:
            diagonal, off = scheme.alpha * E - J, scheme.beta * E
            self.pairs = _factors(np.block([[diagonal, -off], [off, diagonal]]))

    def solved(self, rest: Floats) -> Floats:
        """Return the transformed changes (s, n) for the transformed residuals."""
        parts = []
        if self.scheme.gamma > 0.0:
            parts.append(_back_substitute(self.single, rest[0]))
        if self.scheme.beta > 0.0:
            parts.append(_back_substitute(self.pairs, rest[-2:].ravel()))
        return np.concatenate(parts).reshape(rest.shape)

    def filtered(self, right: Floats) -> Floats:
        """Return (filter E - h J)^-1 right (n,)."""
        return _back_substitute(self.single, right)


_Factors = tuple[Floats, list[int]]


def _factors(matrix: Floats) -> _Factors:
    """Return L U of the matrix with rows exchanged, and which row took each place; raises ZeroDivisionError."""
    a, rows = matrix.copy(), []
    for k in range(len(a)):
        pivot = k + int(np.argmax(np.abs(a[k:, k])))
        rows.append(pivot)
        if pivot != k:
            a[[k, pivot]] = a[[pivot, k]]
        if not abs(a[k, k]) > 0.0:
            raise ZeroDivisionError
        a[k + 1 :, k] = a[k + 1 :, k] / a[k, k]
        a[k + 1 :, k + 1 :] -= a[k + 1 :, k, None] * a[k, k + 1 :]
    return a, rows


def _back_substitute(factors: _Factors, right: Floats) -> Floats:
    a, rows = factors
    b = right.copy()
    for k, pivot in enumerate(rows):
        b[k], b[pivot] = b[pivot], b[k]
    for k in range(len(b)):
        b[k + 1 :] -= a[k + 1 :, k] * b[k]
    for k in range(len(b) - 1, -1, -1):
        b[k] = b[k] / a[k, k]
        b[:k] -= a[:k, k] * b[k]
    return b


class CollocationStepper:
    """A collocation method at work; the stages of a trial are z_i = u(t + c_i h) - y, y = (x, multipliers)."""

    def __init__(self, scheme: Scheme, flow: Flow) -> None:
        assert flow.stages is not None
        self.scheme = scheme
        self.flow = flow
        self.equations = flow.stages
        self.size = len(flow.x0)
        self.rounds = ADAPTIVE_ROUNDS if flow.step is None else FIXED_ROUNDS
        self.restart()

    def restart(self) -> None:
        """Forget the step before, its multipliers and the Jacobian."""
        self.multipliers: Floats | None = None
        self.before: tuple[float, Floats] | None = None
        self.factored = 0.0
        self.contraction = 0.0
        self.expected = 1.0
        self.fresh = False
        self.trials = 0
        self.latest: tuple[float, Floats] | None = None

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> TrialStep:
        """Return a step; raises StepError where Newton's iteration does not converge with a new Jacobian either."""
        self.trials += 1
        if self.multipliers is None:
            self.multipliers = self.equations.multipliers(t, x)
        stages = self._stages(t, x, slope, h)
        self.latest = h, stages
        z = stages[:, : self.size]
        for node, stage in zip(self.scheme.c.tolist(), z, strict=True):
            self.equations.found(t + node * h, x + stage)
        x_new = self._end(z) + x
        require_finite(x_new, t_new)
        error = self._error(t, x, slope, h, z, x_new) if self.flow.step is None else None
        return TrialStep(t, x, slope, h, t_new, x_new, error, list(z), least_growth=LEAST_GROWTH)

    def _end(self, stages: Floats) -> Floats:
        total = np.zeros(stages.shape[1])
        for weight, stage in zip(self.scheme.end.tolist(), stages, strict=True):
            if weight != 0.0:
                total = total + weight * stage
        return total

    def finish(self, trial: TrialStep, x_new: Floats) -> Step:
        """Return the step with the slope at its end."""
        slope_new = self.flow.slope(trial.t_new, x_new)

        def value(theta: float) -> Floats:
            if self.scheme.hermite:
                return hermite(trial.x, trial.slope, x_new, slope_new, trial.h, theta)
            total = np.zeros_like(trial.x)
            for coefficients, stage in zip(self.scheme.dense, trial.stages, strict=True):
                weight = 0.0
                for coefficient in coefficients[::-1].tolist():
                    weight = (weight + coefficient) * theta
                total = total + weight * stage
            return total + trial.x

        return Step(trial.t, trial.x, trial.h, trial.t_new, x_new, slope_new, value)

    def advance(self, step: Step) -> None:
        """Keep the stages of the step, which predict those of the next, and the multipliers at its end."""
        assert self.latest is not None
        assert self.multipliers is not None
        self.before = self.latest
        self.multipliers = self.multipliers + self._end(self.before[1][:, self.size :])
        self.fresh, self.trials = False, 0

    # --- Newton's iteration ---------------------------------------------------------------------------------------

    def _stages(self, t: float, x: Floats, slope: Floats, h: float) -> Floats:
        """Solve for z (s, n + m); where the old Jacobian does not do, with a new one."""
        if not self.fresh and not (self.before is not None and self.contraction <= SLOW):
            self._evaluate_jacobian(t, x)
        while True:
            try:
                if self.factored != h:
                    self._factorise(t, h)
                return self._iterated(t, x, slope, h, self._predicted(h))
            except StepError:
                if self.fresh:
                    raise
            self._evaluate_jacobian(t, x)

    def _evaluate_jacobian(self, t: float, x: Floats) -> None:
        """Take a new Jacobian, and with it a new choice of independent rows."""
        assert self.multipliers is not None
        self.jacobian = self.equations.jacobian(t, np.concatenate([x, self.multipliers]))
        kept = self.equations.kept(self.jacobian)
        self.active = [*range(self.size), *(self.size + k for k in kept)]
        multipliers = np.zeros_like(self.multipliers)
        multipliers[list(kept)] = self.multipliers[list(kept)]
        self.multipliers = multipliers
        self.flow.counts.jacobians += 1
        self.fresh, self.factored, self.contraction, self.expected = True, 0.0, 0.0, 1.0

    def _factorise(self, t: float, h: float) -> None:
        self.flow.counts.factorisations += 1
        self.factored = 0.0
        differential = np.array([float(k < self.size) for k in self.active])
        try:
            jacobian = self.jacobian[np.ix_(self.active, self.active)]
            self.matrices = StageMatrices(self.scheme, differential, jacobian, h)
        except ZeroDivisionError:
            raise StepError(Status.NOT_CONVERGED, t, 0) from None
        self.factored = h

    def _guided(self, h: float) -> bool:
        """Tell whether the step before is a guide to one over h."""
        return self.before is not None and h / self.before[0] <= FAR

    def _predicted(self, h: float) -> Floats:
        """Return the polynomial of the step before, led on; zero where there is none, and for rows not kept."""
        z = np.zeros((len(self.scheme.c), len(self.jacobian)))
        if self.before is None or not self._guided(h):
            return z
        ratio = h / self.before[0]
        for i, node in enumerate(self.scheme.c.tolist()):
            theta = 1.0 + node * ratio
            for coefficients, stage in zip(self.scheme.dense, self.before[1], strict=True):
                there = here = 0.0
                for coefficient in coefficients[::-1].tolist():
                    there = (there + coefficient) * theta
                    here += coefficient
                z[i, self.active] = z[i, self.active] + (there - here) * stage[self.active]
        return z

    def _iterated(self, t: float, x: Floats, slope: Floats, h: float, z: Floats) -> Floats:
        before, growths = math.inf, 0
        contraction = self.expected = math.pow(self.expected, 0.8)
        for round_ in range(self.rounds):
            rest, change = self._residual(t, x, slope, h, z), np.zeros_like(z)
            change[:, self.active] = self.matrices.solved(rest[:, self.active])
            change = _transform_stages(self.scheme.T, change)
            size, worst = self._change_size(x, z, change)
            z = z + change
            if round_ > 0:
                contraction = size / before
                self.expected = max(contraction, float_info.epsilon)
            if round_ == 1:
                self.contraction = contraction
            # From far off, without a prediction, the first change is much larger than what it leaves.
            known = round_ > 0 if self.flow.step is not None else round_ > 1 or self._guided(h)
            if self._converged(size, before, contraction if known else 1.0):
                return z
            growths += round_ > 0 and contraction >= 1.0
            if not size < math.inf or growths > (GROWTHS if self.flow.step is not None else 0):
                if self._rounded(x, z, change):
                    return z
                break
            before = size
        raise StepError(Status.NOT_CONVERGED, t, worst)

    def _residual(self, t: float, x: Floats, slope: Floats, h: float, z: Floats) -> Floats:
        """Return T^-1 (h start f(t, y) + h f(t + c h, y + z) - W E z)."""
        assert self.multipliers is not None
        scheme, n, y = self.scheme, self.size, np.concatenate([x, self.multipliers])
        rest = np.zeros_like(z)
        rest[:, :n] = _transform_stages(scheme.W, z[:, :n])
        explicit = np.concatenate([slope, np.zeros_like(self.multipliers)])
        for i, (node, start) in enumerate(zip(scheme.c.tolist(), scheme.start.tolist(), strict=True)):
            values = self.equations.values(t + node * h, y + z[i])
            require_finite(values[:n], t + node * h)
            rest[i] = h * (start * explicit + values) - rest[i]
        return _transform_stages(scheme.T_inverse, rest)

    def _change_size(self, x: Floats, z: Floats, change: Floats) -> tuple[float, int]:
        """Return the change in units of the tolerance, in the mean square, or for fixed steps its largest entry."""
        parts = change[:, : self.size] / self._scales(x, z[:, : self.size])
        total = 0.0
        for part in parts.ravel().tolist():
            total += part * part
        worst = int(np.argmax(np.abs(parts)))
        fixed = self.flow.step is not None and total < math.inf
        size = float(np.abs(parts).max()) if fixed else math.sqrt(total / parts.size)
        return size, worst % len(x)

    def _scales(self, x: Floats, z: Floats) -> Floats:
        if self.flow.step is None:
            return self.flow.atol + self.flow.rtol * np.abs(x) + self.flow.noise() * float(np.max(np.abs(x)))
        scales = np.maximum(np.abs(x), np.abs(z).max(axis=0))
        least = LEAST_SCALE * float(scales.max())
        return np.where(scales > least, scales, least if least > 0.0 else 1.0)

    def _converged(self, size: float, before: float, contraction: float) -> bool:
        """Tell whether the iteration is near enough to its limit: within a part of the tolerance, or to round-off."""
        rest = contraction / (1.0 - contraction) * size if contraction < 1.0 else math.inf
        if self.flow.step is not None:
            at_rest = size >= before and size <= STANDSTILL
            return size <= float_info.epsilon or rest <= 0.25 * float_info.epsilon or at_rest
        wanted = max(10.0 * float_info.epsilon / self.flow.rtol, KAPPA) if self.flow.rtol > 0.0 else KAPPA
        return 10.0 * size <= wanted or rest <= wanted

    def _rounded(self, x: Floats, z: Floats, change: Floats) -> bool:
        """Tell whether what keeps moving is rounding.

        It is that of the largest components under fixed steps, where stiff forces show it; else no more than what
        round-off may falsify near a singular position.
        """
        most = float(np.abs(change[:, : self.size]).max())
        if self.flow.step is None:
            return most <= self.flow.noise() * float(np.max(np.abs(x)))
        return most <= STANDSTILL * float(self._scales(x, z[:, : self.size]).max())

    def _error(self, t: float, x: Floats, slope: Floats, h: float, z: Floats, x_new: Floats) -> Floats:
        """Return the error; where a start that is not smooth yet makes the step fail, with the slope it leads to."""
        rough = self.before is None or self.trials > 1
        error = self._filtered(h * slope, z)
        if not rough or scaled_norm(error, self.flow.scales(x, x_new)) <= 1.0:
            return error
        return self._filtered(h * self.flow.slope(t, x + error), z)

    def _filtered(self, error: Floats, z: Floats) -> Floats:
        assert self.scheme.error is not None
        for weight, stage in zip(self.scheme.error.tolist(), z, strict=True):
            error = error + weight * stage
        right = np.zeros(len(self.active))
        right[: self.size] = error
        return self.matrices.filtered(right)[: self.size]


def _transform_stages(matrix: Floats, stages: Floats) -> Floats:
    result = np.zeros_like(stages)
    for i, row in enumerate(matrix.tolist()):
        for weight, stage in zip(row, stages, strict=True):
            result[i] = result[i] + weight * stage
    return result
