"""Steps over singular positions, in which constraint rows become dependent; `singular.c` is the same in C.

On one side of such a position and on the other the motion is smooth, but an acceleration off the constraints by e, at
the distance s from it, is wrong by e/s, and by round-off/s^3 on them. So a step that comes near one is made with its
slopes taken at states put back onto the constraints, and with another length if one of them falls too near to it or
onto another branch of the motion: it steps across, and goes on where the way it came by leads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.integrators.collocation import Collocation
from multibody_sym.integrators.flow import Floats, Flow, Method, Status, Step, StepError, Stepper, Trial
from multibody_sym.integrators.runge_kutta import RungeKutta

NEAR: Final = 0.5  # of the largest independence about a step: with less in it the step is near a singular position, ...
NEAR_BY: Final = 0.1  # ... as with less than this part of the largest in the run
USUAL: Final = 0.01  # what counts as the largest at least
MARGIN: Final = 0.05  # of the largest about a step: nothing in it may be nearer than that, ...
LEAST: Final = 1e-8  # ... nor than this
NOISE: Final = 1e-16  # what round-off leaves of rows that are closed
GOLDEN: Final = 0.618033988749895  # a step made again that much shorter meets no node of the one before, nor its end
SHORTER: Final = 0.8  # at most, where it is known what lies ahead
FAR: Final = 0.1  # of the whole step, by which its end may move when it is settled
FAR_BEYOND_ROUND_OFF: Final = 1e-10
LOOKS: Final = 16  # how often the independence is looked at within a step
_ROUNDS: Final = 5


class Approach:
    """How near the rows come to dependence on the way; their independence is 0 in a singular position, 1 at most.

    `near`: the step on trial is near a singular position.
    """

    def __init__(self, flow: Flow) -> None:
        self.flow, self.rows = flow, flow.rows
        self.near = False
        self.x = flow.x0  # where the trial starts
        self.before = 0.0  # the independence at the start of the step before, ...
        self.start = self.latest = self.end = math.inf  # ... of this one, at the latest slope, at the end, ...
        self.least, self.greatest = math.inf, 0.0  # ... and of all slopes in the trial
        self.rate = 0.0  # at which it went down in the step before
        self.gap = widest_gap(flow.method)
        self.peak = USUAL  # and the largest at the start of a step

    def watched(self) -> Flow:
        """Return the flow with these slopes.

        Slopes at states put onto the constraints hardly change with what is off them: the Jacobian of an implicit
        method, which tells the contrary, is left out near a singular position, and its stages are found by iteration.
        """
        flow, stages = self.flow, self.flow.stages
        if stages is None or stages.values != flow.derivative:
            return replace(flow, derivative=self.slope)

        def jacobian(t: float, x: Floats) -> Floats:
            return np.zeros((len(x), len(x))) if self.near else stages.jacobian(t, x)

        return replace(flow, derivative=self.slope, stages=replace(stages, values=self.slope, jacobian=jacobian))

    def slope(self, t: float, x: Floats) -> Floats:
        """Return the derivative at (t, x), near a singular position at x put onto the constraints."""
        if self.rows is None:
            return self.flow.derivative(t, x)
        slope = self.flow.derivative(t, self.closed(t, x))
        self.latest = self.rows.latest()
        self.least, self.greatest = min(self.least, self.latest), max(self.greatest, self.latest)
        return slope

    def closed(self, t: float, x: Floats) -> Floats:
        """Return a state in the trial, near a singular position put onto the constraints; raises StepError."""
        if self.rows is None or not self.near:
            return x
        closed = self.rows.closed(t, x)
        if self._strays(x, closed):
            raise StepError(Status.SINGULAR, t, -1)
        return closed

    def begin(self, x: Floats) -> None:
        """Start a trial at x."""
        self.x, self.least, self.greatest = x, math.inf, 0.0

    def restart(self, t: float) -> None:
        """Start afresh at the latest slope. Raises StepError in a singular position."""
        self.near, self.before, self.start, self.rate = False, 0.0, self.latest, 0.0
        if self.start < LEAST:
            raise StepError(Status.SINGULAR, t, -1)

    def advance(self, step: Step) -> None:
        """Let an accepted step be the one before."""
        self.rate = (self.start - self.end) / (step.t_new - step.t)
        self.near = self.near and self._comes_near()
        self.before, self.start = self.start, self.end
        self.peak = max(self.peak, self.start)

    def verify(self, t: float) -> None:
        """Raise StepError if the trial comes near unforeseen, or too near."""
        if self.comes_unforeseen() or (self._comes_near() and self.least < max(LEAST, MARGIN * self._most())):
            raise StepError(Status.SINGULAR, t, -1)

    def verify_end(self, trial: Trial, done: Step) -> None:
        """Raise StepError if the end comes near unforeseen, too near, or is on another branch of the motion."""
        self.end = self.latest
        self.verify(done.t_new)
        if self.near and self._strays(trial.x_new, done.x_new):
            raise StepError(Status.SINGULAR, done.t_new, -1)

    def noise(self) -> float:
        """Return the part of the speeds by which round-off may falsify a step.

        Rows that hold to eps let coordinates be off them by eps/s at the distance s, speeds by eps/s^2, and
        accelerations by eps/s^3.
        """
        return self._round_off() * (self._most() - self._least()) / self._least() if self.near else 0.0

    def _round_off(self) -> float:
        """Return the part of the speeds by which round-off may falsify a state."""
        return NOISE / self._least() ** 2

    def comes_unforeseen(self) -> bool:
        """Tell whether the trial comes near a singular position and was not made for that."""
        return self._comes_near() and not self.near

    def foresee(self, taking: Stepper) -> None:
        """Let the next trial be made for that; what an implicit method knows of other slopes does not count."""
        self.near = True
        if isinstance(self.flow.method, Collocation):
            taking.restart()

    def retreat(self, h: float, otherwise: float) -> float:
        """Return over which part of a step over h, that failed, to make the next: `otherwise` far from all that.

        It is to have the singular position in its widest gap between nodes; else the step after it will.
        """
        if not self.near:
            return otherwise
        if not self.rate > 0.0:
            return GOLDEN
        way = self.start / (self.rate * h)
        if way <= SHORTER * self.gap:
            return way / self.gap
        return min(way - SHORTER * SHORTER * self.gap, SHORTER)

    def failure(self, problem: StepError, t: float, rejected: int = 0) -> StepError:
        """Return why no step could be made from time t."""
        if self.near:
            return StepError(Status.SINGULAR, t, -1, rejected)
        return StepError(problem.status, problem.time, problem.component, rejected)

    def passed(self, step: Step) -> Step:
        """Return an accepted step, with the times of the singular positions that it passed."""
        if self.rows is None or not self.near:
            return step
        return replace(step, singular=singular_times(step, self.rows.independence))

    def _strays(self, x: Floats, closed: Floats) -> bool:
        """Tell whether a state has been put onto another branch of the motion."""
        return moved_far(self.x, x, closed, self._round_off() * float(np.max(np.abs(x)))) is not None

    def _least(self) -> float:
        return min(self.least, self.start)

    def _most(self) -> float:
        return max(self.before, self.start, self.greatest) if math.isfinite(self.start) else 0.0

    def _comes_near(self) -> bool:
        return self._least() < max(NEAR * self._most(), NEAR_BY * self.peak)


def widest_gap(method: Method) -> float:
    """Return the middle of the widest gap between the nodes of a step, as a part of it."""
    nodes = sorted({0.0, *_nodes(method), 1.0})
    widest = max(range(len(nodes) - 1), key=lambda k: nodes[k + 1] - nodes[k])
    return 0.5 * (nodes[widest] + nodes[widest + 1])


def _nodes(method: Method) -> list[float]:
    if isinstance(method, RungeKutta):
        nodes: list[float] = method.tableau.c[: method.tableau.stages].tolist()
        return nodes
    return method.scheme.c.tolist() if isinstance(method, Collocation) else []


def moved_far(x: Floats, x_new: Floats, settled: Floats, round_off: float = 0.0) -> int | None:
    """Return the component that settling moved most, if by over a tenth of the way from x and round-off; else None.

    Such a step has gone over a kink in the constraints, of which the error estimate knows nothing, or settled on
    another branch of the motion.
    """
    moved, step = np.abs(settled - x_new), float(np.max(np.abs(x_new - x)))
    most = float(np.max(moved))
    far = most > FAR * step + round_off and most > FAR_BEYOND_ROUND_OFF * (1.0 + float(np.max(np.abs(settled))))
    return int(np.argmax(moved)) if far else None


def strays(step: Step, x: Floats, settled: Floats) -> bool:
    """Tell whether a state within a step has settled on another branch of the motion, by over a tenth of the step."""
    moved, whole = (np.abs(change).max(initial=0.0) for change in (settled - x, step.x_new - step.x))
    return bool(moved > FAR * whole)


def singular_times(step: Step, independence: Callable[[float, Floats], float]) -> tuple[float, ...]:
    """Return when a step passes singular positions.

    Beside one the independence goes down, and up again, in proportion to the distance.
    """

    def at(theta: float) -> float:
        return independence(step.t + theta * step.h, step.value(theta))

    end = (step.t_new - step.t) / step.h
    places = [end * k / LOOKS for k in range(LOOKS + 1)]
    looks = [at(theta) for theta in places]
    found = []
    for k, here in enumerate(looks):
        low, high = max(k - 1, 0), min(k + 1, LOOKS)
        if (k == 0 or here < looks[low]) and (k == LOOKS or here <= looks[high]):
            theta, left = _dip(at, (places[low], places[high]), (looks[low], looks[high]))
            if left < 0.5 * min(looks[low], looks[high]) and left < MARGIN * max(looks):
                found.append(step.t + theta * step.h)
    return tuple(found)


def _dip(at: Callable[[float], float], places: tuple[float, float], values: tuple[float, float]) -> tuple[float, float]:
    """Return where between two places a function goes down to zero and up again as steeply, and its value beside it."""
    (low, high), (at_low, at_high) = places, values
    theta = low
    for _ in range(_ROUNDS):
        theta, width = low + (high - low) * (at_low / (at_low + at_high)), 0.125 * (high - low)
        low, high = max(theta - width, places[0]), min(theta + width, places[1])
        at_low, at_high = at(low), at(high)
    return theta, min(at_low, at_high)
