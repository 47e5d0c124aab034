"""Steps of explicit Runge-Kutta methods; `explicit.c` is the same in C."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from multibody_sym.motion.integrator.flow import Flow, Step, TrialStep, combination, hermite, require_finite
from multibody_sym.motion.methods.multistep import AdamsBashforthMoulton, Stoermer, StoermerVerlet
from multibody_sym.motion.methods.runge_kutta import Tableau
from multibody_sym.program.runtime_constants import FARTHEST_TURN, SAME_LENGTH, SHORTEST_STEP
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

    def __init__(self, _method: StoermerVerlet, flow: Flow) -> None:
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
        if not self.past.fits(h) or self._too_short(h) or self._turn() > FARTHEST_TURN:
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

    def _too_short(self, h: float) -> bool:
        return self.flow.step is not None and h < SHORTEST_STEP * self.flow.step

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
