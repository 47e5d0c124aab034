"""Steps over singular positions, in which constraint rows become dependent; `singular.c` is the same in C.

On one side of such a position and on the other the motion is smooth, but an acceleration off the constraints by e, at
the distance s from it, is wrong by e/s, and by round-off/s^3 on them. So a step that comes near one is made with its
slopes taken at states put back onto the constraints, and with another length if one of them falls too near to it or
onto another branch of the motion: it steps across, and goes on where the way it came by leads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from multibody_sym.motion.integrator.flow import (
    Flow,
    StageEquations,
    Step,
    StepError,
    StepsTaken,
    TrialStep,
    require_finite,
)
from multibody_sym.motion.methods.explicit import RungeKutta
from multibody_sym.motion.methods.multistep import Collocation
from multibody_sym.motion.methods.table import Method
from multibody_sym.program.runtime_constants import (
    ASIDE,
    DIFFERENCE,
    DIP_ROUNDS,
    DIPS,
    FAR_BEYOND_ROUND_OFF,
    FEW_LOOKS,
    GOLDEN_RETREAT,
    HELD,
    LEAST,
    LEAST_HELD,
    LOOKS,
    MANY,
    MARGIN,
    MOST_NOISE,
    MOST_VAIN,
    MOVED_FAR,
    NEAR,
    NEAR_BY,
    NOISE,
    ROOM,
    SEEN,
    SHORTER_AHEAD,
    STEEPER,
    USUAL,
    Status,
)
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# When a step passed singular positions, by how independent the rows were within it; `singular.c` is the same in C.


def singular_times(
    step: Step, independence: Callable[[float, Floats], float], seen: tuple[float, float]
) -> tuple[float, ...]:
    """Return when a step passes singular positions, in which the least and the largest independence was `seen`.

    Beside one the independence goes down, and up again, in proportion to the distance.
    """

    def at(theta: float) -> float:
        return independence(step.t + theta * step.h, step.value(theta))

    end = (step.t_new - step.t) / step.h
    places = [end * k / LOOKS for k in range(LOOKS + 1)]
    few = {k: at(places[k]) for k in range(0, LOOKS + 1, LOOKS // FEW_LOOKS)}
    first = [*few.values()]
    one_way = sorted(first) in (first, first[::-1]) and not any(_may_vanish(first, k, k + 1) for k in range(FEW_LOOKS))
    if one_way and seen[0] >= min(first) / SEEN and seen[1] <= max(first) * SEEN:
        return ()  # all slopes of the step say so, too
    looks = [few[k] if k in few else at(theta) for k, theta in enumerate(places)]
    found = []
    for k, here in enumerate(looks):
        low, high = max(k - 1, 0), min(k + 1, LOOKS)
        if (k == 0 or here < looks[low]) and (k == LOOKS or here <= looks[high]) and _may_vanish(looks, low, high):
            theta, left = _dip(at, (places[low], places[high]), (looks[low], looks[high]))
            if left < 0.5 * min(looks[low], looks[high]) and left < MARGIN * max(looks):
                found.append(step.t + theta * step.h)
    return tuple(found)


def _may_vanish(looks: Sequence[float], low: int, high: int) -> bool:
    """Tell whether the independence may be zero between two looks, if it goes about as steeply as it does elsewhere."""
    steepest = max(abs(b - a) for a, b in pairwise(looks))
    return not looks[low] + looks[high] > STEEPER * steepest * (high - low)


def _dip(at: Callable[[float], float], places: tuple[float, float], values: tuple[float, float]) -> tuple[float, float]:
    """Return where between two places a function goes down to zero and up again as steeply, and its value beside it."""
    (low, high), (at_low, at_high) = places, values
    theta = low
    for _ in range(DIP_ROUNDS):
        theta, width = low + (high - low) * (at_low / (at_low + at_high)), 0.125 * (high - low)
        low, high = max(theta - width, places[0]), min(theta + width, places[1])
        at_low, at_high = at(low), at(high)
    return theta, min(at_low, at_high)


class Approach:
    """How near the rows come to dependence on the way; their independence is 0 in a singular position, 1 at most.

    `near`: the step on trial is near a singular position; `stiff`: there iteration fails without a Jacobian.
    """

    def __init__(self, flow: Flow) -> None:
        self.flow, self.rows = flow, flow.rows
        self.near = self.stiff = False
        self.vain = 0  # trials of the step that failed, but not as they came too near
        self.x = flow.x0  # where the trial starts
        self.before = 0.0  # the independence at the start of the step before, ...
        self.start = self.latest = self.end = math.inf  # ... of this one, at the latest slope, at the end, ...
        self.least, self.greatest = math.inf, 0.0  # ... and of all slopes in the trial
        self.t, self.h, self.least_time = flow.t0, 0.0, flow.t0  # its start, its length, and when the least was met
        self.smooth = 0.0  # steps that long do where the rows are regular
        self.rate = 0.0  # at which it went down in the step before
        self.gap = widest_gap(flow.method)
        self.peak = USUAL  # and the largest at the start of a step

    def watched(self) -> Flow:
        """Return the flow with these slopes.

        Slopes at states put onto the constraints hardly change with what is off them: the Jacobian of an implicit
        method, which tells the contrary, is left out near a singular position, as are rows that are part of the
        equations, and its stages are found by iteration. Where that fails for another reason than the singular
        position, as with stiff forces, it gets the Jacobian of such slopes.
        """
        flow = replace(self.flow, derivative=self.slope, noise=self.noise)
        return flow if flow.stages is None else replace(flow, stages=self._stages(flow.stages))

    def _stages(self, stages: StageEquations) -> StageEquations:
        size, index_2 = len(self.flow.x0), stages.values != self.flow.derivative

        def values(t: float, y: Floats) -> Floats:
            if index_2 and not self.near:
                return stages.values(t, y)
            return np.concatenate([self.slope(t, y[:size]), np.zeros(len(y) - size)])

        def jacobian(t: float, y: Floats) -> Floats:
            if not self.near:
                return stages.jacobian(t, y)
            matrix = np.zeros((len(y), len(y)))
            if self.stiff:
                self._differentiate(t, y[:size], matrix)
            return matrix

        def kept(matrix: Floats) -> Sequence[int]:
            return () if self.near else stages.kept(matrix)

        found = self._look if index_2 else stages.found
        return replace(stages, values=values, jacobian=jacobian, kept=kept, found=found)

    def _differentiate(self, t: float, x: Floats, matrix: Floats) -> None:
        """Fill in the derivative of slopes at states put onto the constraints, by differences.

        It tells what forces do, but nothing of what is off the constraints.
        """
        assert self.rows is not None
        try:
            slope = self.flow.slope(t, self.rows.closed(t, x))
        except StepError:
            return
        for j, size in enumerate(np.abs(x).tolist()):
            moved, change = x.copy(), DIFFERENCE * self.start * (1.0 + size)
            moved[j] += change
            try:
                matrix[: len(x), j] = (self.flow.slope(t, self.rows.closed(t, moved)) - slope) / change
            except StepError:
                continue

    def slope(self, t: float, x: Floats) -> Floats:
        """Return the derivative at (t, x), near a singular position at x put onto the constraints."""
        if self.rows is None:
            return self.flow.derivative(t, x)
        slope = self.flow.derivative(t, self.closed(t, x))
        self._note(t, self.rows.latest())
        return slope

    def _look(self, t: float, x: Floats) -> None:
        """Note the independence of the rows at a stage in whose equations they are: no slope tells it."""
        independence = math.nan if self.rows is None or self.near else self.rows.independence(t, x)
        if math.isfinite(independence):
            self._note(t, independence)

    def _note(self, t: float, independence: float) -> None:
        self.latest = independence
        if self.latest < self.least:
            self.least_time = t
        self.least, self.greatest = min(self.least, self.latest), max(self.greatest, self.latest)

    def closed(self, t: float, x: Floats) -> Floats:
        """Return a state in the trial, near a singular position put onto the constraints; raises StepError."""
        if self.rows is None or not self.near:
            return x
        closed = self.rows.closed(t, x)
        if self._strays(x, closed):
            raise StepError(Status.SINGULAR, t, -1)
        return closed

    def begin(self, t: float, x: Floats, h: float) -> None:
        """Start a trial over h at (t, x)."""
        self.t, self.x, self.h = t, x, h
        self.least, self.greatest, self.least_time = math.inf, 0.0, t

    def restart(self, t: float) -> None:
        """Start afresh at the latest slope. Raises StepError in a singular position."""
        self.near = self.stiff = False
        self.before, self.start, self.rate = 0.0, self.latest, 0.0
        if self.start < LEAST:
            raise StepError(Status.SINGULAR, t, -1)

    def advance(self, step: Step, taking: StepsTaken) -> None:
        """Let an accepted step be the one before; what an implicit method knows of slopes beside it does not count."""
        self.rate = (self.start - self.end) / (step.t_new - step.t)
        near, self.near = self.near, self.near and self._comes_near()
        self.stiff, self.vain = self.stiff and self.near, 0
        if near and not self.near and isinstance(self.flow.method, Collocation):
            taking.restart()
        self.before, self.start = self.start, self.end
        self.peak = max(self.peak, self.start)

    def verify(self, t: float) -> None:
        """Raise StepError if the trial comes near unforeseen, or too near."""
        if self.comes_unforeseen() or self._comes_too_near():
            raise StepError(Status.SINGULAR, t, -1)

    def verify_end(self, trial: TrialStep, done: Step) -> None:
        """Raise StepError if the end comes near unforeseen, too near, or is on another branch of the motion."""
        self.end = self.latest
        self.verify(done.t_new)
        if not self._crosses() and self.least < DIPS * min(self.start, self.end):
            raise StepError(Status.SINGULAR, done.t_new, -1)
        # The end may be so near before the singular position that the step across would be much shorter.
        left = ROOM * SHORTER_AHEAD * SHORTER_AHEAD * self.gap
        comes = self.end < self.start and self.end <= self.least and self.end < left * (self.start - self.end)
        if self.near and (comes or self._strays(trial.x_new, done.x_new)):
            raise StepError(Status.SINGULAR, done.t_new, -1)

    def noise(self) -> float:
        """Return the part of the speeds by which round-off may falsify a step.

        Rows that hold to eps let coordinates be off them by eps/s at the distance s, speeds by eps/s^2, and
        accelerations by eps/s^3. A step no longer than those that do elsewhere has no other error than that.
        """
        if not self.near:
            return 0.0
        least = self._least()
        noise = self._round_off() * (self._most() - least) / least if least > 0.0 else math.inf
        return _among_many(noise) if self.h <= self.smooth else noise

    def _round_off(self) -> float:
        """Return the part of the speeds by which round-off may falsify a state."""
        least = self._least()
        return NOISE / (least * least) if least > 0.0 else math.inf

    def comes_unforeseen(self) -> bool:
        """Tell whether the trial comes near a singular position and was not made for that."""
        return self._crosses() and self._comes_near() and not self.near

    def foresee(self, before: Step, taking: StepsTaken) -> Step:
        """Let the next trial be made for that, and return the step before with an end that is on the constraints.

        What an implicit method knows of other slopes does not count.
        """
        self.near = True
        if isinstance(self.flow.method, Collocation):
            taking.restart()
        if self.rows is None or self.rows.kept:
            return before
        try:
            self.x = self.rows.closed(before.t_new, before.x_new)
            slope = self.slope(before.t_new, self.x)
            require_finite(slope, before.t_new)
            return replace(before, x_new=self.x, slope_new=slope)
        except StepError:
            return before

    def turns_stiff(self, taking: StepsTaken) -> bool:
        """Tell whether a trial that failed is to be made again with a Jacobian; from now on so.

        It failed, as others of the step, for another reason than that it came too near.
        """
        implicit = isinstance(self.flow.method, Collocation)
        if not implicit or self.stiff or not self.near or self._comes_too_near():
            return False
        self.vain += 1
        if self.vain < MOST_VAIN:
            return False
        self.stiff = True
        taking.restart()
        return True

    def retreat(self, h: float, otherwise: float) -> float:
        """Return over which part of a step over h, that failed, to make the next: `otherwise` far from all that.

        It is to have the singular position in its widest gap between nodes; else the step after it will.
        """
        if not self.near:
            return otherwise
        way = self._way_to_singular() / h
        if not way > 0.0:
            return GOLDEN_RETREAT
        if way <= SHORTER_AHEAD * self.gap:
            return way / self.gap
        return min(way - SHORTER_AHEAD * SHORTER_AHEAD * self.gap, SHORTER_AHEAD)

    def wished(self, h: float, error: float) -> float:
        """Return the length of the next step; without noise, or with an error that is small beside none, such do."""
        if not self.near or (error <= 1.0 and h > self.smooth):
            self.smooth = h
        return h

    def laid(self, h: float) -> float:
        """Return how long to make a step that might be h.

        Where the singular position comes into it, or so near behind it that the next one has no room, it is to lie in
        the widest gap between the nodes of this step, or of the next.
        """
        way = self.start / self.rate / h if self.near and self.rate > 0.0 else 0.0
        if not way > 0.0 or way >= 1.0 + self.gap:
            return h
        if way <= self.gap:
            return h * (way / self.gap)
        return h if way <= ASIDE * self.gap else h * min(way - self.gap, 1.0)

    def _way_to_singular(self) -> float:
        """Return how long after the start of the trial the independence is zero; 0 if nothing tells.

        It is so beside the place where it was least, on the side on which, going on as before, it would be.
        """
        expected, ahead = self.start / self.rate if self.rate > 0.0 else 0.0, self.least_time - self.t
        if not (ahead > 0.0 and self.least < NEAR * self.start):
            return expected
        before, behind = (ahead * self.start / (self.start + least) for least in (-self.least, self.least))
        if not expected > 0.0:
            return ahead
        return before if abs(before - expected) < abs(behind - expected) else behind

    def failure(self, problem: StepError, t: float, rejected: int = 0) -> StepError:
        """Return why no step could be made from time t."""
        if self.near:
            return StepError(Status.SINGULAR, t, -1, rejected)
        return StepError(problem.status, problem.time, problem.component, rejected)

    def passed(self, step: Step) -> Step:
        """Return an accepted step, with the times of the singular positions that it passed."""
        if self.rows is None or not self.near:
            return step
        seen = self._least(), self._most_within()
        return replace(step, singular=singular_times(step, self.rows.independence, seen))

    def _strays(self, x: Floats, closed: Floats) -> bool:
        """Tell whether a state has been put onto another branch of the motion: further than round-off puts it."""
        round_off = _among_many(self._round_off()) * float(np.max(np.abs(x)))
        return moved_far(self.x, x, closed, round_off) is not None

    def _least(self) -> float:
        return min(self.least, self.start)

    def _most(self) -> float:
        return max(self.before, self.start, self.greatest) if math.isfinite(self.start) else 0.0

    def _comes_too_near(self) -> bool:
        if not self._crosses():
            return math.isfinite(self.start) and self.least < max(LEAST_HELD, HELD * self.start)
        return self._comes_near() and self.least < max(LEAST, MARGIN * self._most_within())

    def _crosses(self) -> bool:
        """Tell whether steps lead across singular positions."""
        return self.rows is None or self.rows.crosses

    def _most_within(self) -> float:
        """Return the largest in the trial itself: what is nearest in it is near beside that."""
        return max(self.start, self.greatest) if math.isfinite(self.start) else 0.0

    def _comes_near(self) -> bool:
        return self._least() < max(NEAR * self._most(), NEAR_BY * self.peak)


def _among_many(noise: float) -> float:
    """Return as much noise, or more of it where many rows depend on each other."""
    return max(noise, min(MANY * noise, MOST_NOISE))


def widest_gap(method: Method) -> float:
    """Return the middle of the widest gap between the nodes of a step, as a part of it."""
    own = method.tableau.c[: method.tableau.stages] if isinstance(method, RungeKutta) else np.zeros(0)
    own = method.scheme.c if isinstance(method, Collocation) else own
    nodes = sorted({0.0, *own.tolist(), 1.0})
    widest = max(range(len(nodes) - 1), key=lambda k: nodes[k + 1] - nodes[k])
    return float(0.5 * (nodes[widest] + nodes[widest + 1]))


def moved_far(x: Floats, x_new: Floats, settled: Floats, round_off: float = 0.0) -> int | None:
    """Return the component that settling moved most, if by over a tenth of the way from x and round-off; else None.

    Such a step has gone over a kink in the constraints, of which the error estimate knows nothing, or settled on
    another branch of the motion.
    """
    moved, step = np.abs(settled - x_new), float(np.max(np.abs(x_new - x)))
    most = float(np.max(moved))
    far = most > MOVED_FAR * step + round_off and most > FAR_BEYOND_ROUND_OFF * (1.0 + float(np.max(np.abs(settled))))
    return int(np.argmax(moved)) if far else None


def strays(step: Step, x: Floats, settled: Floats) -> bool:
    """Tell whether a state within a step has settled on another branch of the motion, by over a tenth of the step."""
    moved, whole = (np.abs(change).max(initial=0.0) for change in (settled - x, step.x_new - step.x))
    return bool(moved > MOVED_FAR * whole)
