"""Where switching functions change sign within a step; `events.c` and `switching.c` are the same in C.

A step that crosses, or looks beyond a kink in one of its slopes, is taken again to just before the crossing, until no
slope is from beyond; its continuous extension then leads over it. A slope at a kink but for round-off is that just
before it, as a force may jump there, and the step ends just behind. What nothing crosses at the end of a step may cross
and cross back within it: the functions are looked at until their signs are certain (`looks`). What has just been
crossed counts as crossed whatever round-off says, and a function that starts at zero has no side until it has left it.
A stop that is above zero counts anew once it has been below: a step in which it goes there and comes back ends in
between, as nothing crosses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from sys import float_info

import numpy as np
from numpy.typing import NDArray

from multibody_sym.motion.integrator.flow import Events, Flow, Step, StepError, longest_in_modes
from multibody_sym.motion.integrator.singular import strays
from multibody_sym.program.runtime_constants import (
    AT_ONCE,
    BEYOND,
    JUST_BEFORE,
    LOCATING_ROUNDS,
    MOST_CHANGE,
    MOST_OF_ALL,
    REPEATS,
    ROUNDED_TIME,
    SHORT_OF,
    SHORTER,
    SOON,
    Status,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.sign_changes import PROBE, Look, first_seen, looks_at_ends

# ----------------------------------------------------------------------------------------------------------------------
# Looks at switching functions within a step, until they are certain to keep their signs; `looks.c` is the same in C.
#
# A function that has one sign at both ends of a piece of a step, and changes at rates known there, is certain to keep
# it if its rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all
# the way. A piece of which neither is true is halved. So a body that can reach another within a step is looked at ever
# more closely where it comes near, and few looks are taken at what stays away.


@dataclass(frozen=True)
class Ends:
    """Values (ng,) at both ends of a step, times the sides on which they were, and PROBE after and before them."""

    start: Floats
    after: Floats
    before: Floats
    end: Floats

    def uncertain(self) -> NDArray[np.bool_]:
        """Tell which functions may change their sign: values at both ends and rates there do not say they keep it."""
        rise, fall = (self.after - self.start) / PROBE, (self.end - self.before) / PROBE
        change = self.end - self.start
        bend = np.maximum(np.abs(rise - change), np.abs(fall - change))
        bends = (np.minimum(self.start, self.end) < bend) & (bend > 0.5 * np.abs(change))
        found: NDArray[np.bool_] = (self.end < 0.0) | bends
        return found

    def looks(self, index: int) -> tuple[Look, Look]:
        """Return the looks at one function at the ends of the step."""
        start, after, before, end = (float(values[index]) for values in (self.start, self.after, self.before, self.end))
        rise, fall = (after - start) / PROBE, (end - before) / PROBE
        return Look(0.0, start, rise, rise), Look(1.0, end, fall, fall)


class Reach:
    """The last looks at functions that keep steps short: those of a mode at the places `limiting`.

    In a step they may change by half their distance from zero, or a tenth of the largest they had, as the quadratic
    through their last three looks goes: where a body sticks nothing else says that the force on it changes. One that
    ends before zero (a negative margin) must not get there: it may change by half the way to its end, or by what is
    left from there.
    """

    def __init__(self, limiting: Sequence[int], margins: Sequence[float] = ()) -> None:
        self.limiting = list(limiting)
        self._short_of = [max(-margins[k], 0.0) if margins else 0.0 for k in limiting]
        self._looks: list[tuple[float, list[float]]] = []
        self._largest: list[float] = []

    def forget(self) -> None:
        """Let nothing that was before count: forces may have jumped."""
        self._looks = []

    def step(self, t: float, values: Floats) -> float:
        """Return the longest step that may be tried after a look at the functions of a mode at time t."""
        latest = values[self.limiting].tolist()
        known = self._largest if self._looks else [0.0] * len(latest)
        self._largest = [before if before > abs(now) else abs(now) for now, before in zip(latest, known, strict=True)]
        longest = min(self._reach(t, i, now) for i, now in enumerate(latest))
        self._looks = [*self._looks[-1:], (t, latest)]
        return longest

    def _reach(self, t: float, i: int, now: float) -> float:
        b = c = 0.0
        if self._looks:
            late = t - self._looks[-1][0]
            b = (now - self._looks[-1][1][i]) / late
        if len(self._looks) > 1:
            early = self._looks[-1][0] - self._looks[0][0]
            c = (b - (self._looks[-1][1][i] - self._looks[0][1][i]) / early) / (late + early)
            b += c * late
        allowed = max(MOST_CHANGE * abs(now), self._short_of[i] or MOST_OF_ALL * self._largest[i])
        rate = abs(b) + math.sqrt(b * b + 4.0 * abs(c) * allowed)
        return 2.0 * allowed / rate if rate > 0.0 else math.inf


Take = Callable[[float, float], Step]
Path = Callable[[float], Floats]


class Watch:
    """The switching functions of a flow and the sides of zero on which they were last seen.

    `beyond`: a slope of the step on trial was taken beyond a kink, or just before one that is `touched`; `origin`: the
    function at whose event it starts, which has `left` zero so soon, or is `chattering` if it turns back at once, and
    `flipped` if it was let to. `below`: the first part of the step at which a stop that is above zero at both its ends
    was seen below it, None if none was.
    """

    def __init__(self, flow: Flow, events: Events) -> None:
        self.flow = flow
        self.events = events
        self.values = events.beyond
        self.terminal = np.array(events.terminal, dtype=bool)
        self.sides = events.sides(flow.start, flow.x0)
        self.switches = len(events.margins)
        self.reach = Reach(events.limiting, events.margins)
        self.beyond = self.touched = False
        self.origin: int | None = None
        self.chattering = self.flipped = False
        self.left = 0.0
        self.below: float | None = None

    def watched(self) -> Flow:
        """Return the flow with a watch on whether its derivatives are taken beyond a kink."""
        flow, stages, size = self.flow, self.flow.stages, len(self.flow.x0)

        def slope(t: float, x: Floats) -> Floats:
            return flow.derivative(self._time_of_slope(t, x), x)

        if stages is None:
            return replace(flow, derivative=slope)

        def values(t: float, y: Floats) -> Floats:
            return stages.values(self._time_of_slope(t, y[:size]), y)

        return replace(flow, derivative=slope, stages=replace(stages, values=values))

    def _time_of_slope(self, t: float, x: Floats) -> float:
        """Return the time at which the slope of (t, x) is taken, and note whether it is beyond a kink.

        It is slightly before a kink that it is at but for round-off: a force may jump there.
        """
        here = 1 if self.beyond or self.terminal.all() else self._before_kinks(t, x)
        if here > 0:
            return t
        earlier = t - JUST_BEFORE * abs(t)
        if self._before_kinks(earlier, x) > 0:
            self.touched = True
            return earlier
        self.beyond = here < 0
        return t

    def _before_kinks(self, t: float, x: Floats) -> int:
        """Return 1 before all kinks, 0 at one, -1 beyond one."""
        kinks = ~self.terminal & (self.sides != 0.0)
        if self.origin is not None and self.chattering:
            kinks[self.origin] = False
        values = self.values(t, x)
        if (kinks & self._crossed(values)).any():
            return -1
        return int(not (kinks & (values == 0.0)).any())

    def longest(self, t: float, x: Floats, slope: Floats) -> float:
        """Return the longest step that may be tried from (t, x), a run in modes being looked at now and then."""
        if not self.switches:
            return self.events.to_moment(t)
        most = min(longest_in_modes(self.flow.lasts, slope), self.events.to_moment(t))
        if self.origin is not None:
            self.reach.forget()
        if not self.reach.limiting:
            return most
        return min(most, self.reach.step(t, self.values(t, x)[len(self.sides) - self.switches :]))

    def begin(self, t: float, x: Floats, slope: Floats) -> None:
        """Tell of the function at whose event a step from (t, x) starts whether it goes back to where it came from."""
        self.left, self.chattering = 0.0, False
        if self.origin is None:
            return
        way, rate = float(np.max(np.abs(x))), float(np.max(np.abs(slope)))
        soon = SOON * max(abs(t), way / rate if rate > 0.0 else 0.0)
        before, after = (float(self.values(t + h, x + h * slope)[self.origin]) for h in (0.0, soon))
        self.chattering = not self.sides[self.origin] * (after - before) > 0.0
        self.left = 0.0 if self.chattering else soon

    def stuck(self, problem: StepError) -> bool:
        """Tell whether a step has no solution because it would lead over a kink."""
        return problem.status is Status.NOT_CONVERGED and self.beyond

    def ended(self, step: Step, slope: Floats, take: Take, problem: StepError | None = None) -> Step:
        """Return `step` if nothing crosses in it, else one that ends at the first crossing or before it.

        `slope` is the one at its start; `take(h, t_new)` takes another step from there; `problem`: `step` got stuck at
        a kink, only its start and length count. Raises StepError.
        """

        def straight_on(theta: float) -> Floats:  # nothing from beyond a kink can bend it
            return step.x + theta * step.h * slope

        least, way, margin = ROUNDED_TIME * abs(step.t), step.h, SHORT_OF
        values = self.values(step.t_new, step.x_new)
        self.flipped = False
        if problem is None:
            self._let_chatter(step, values)
        for rounds in count():
            high = None if problem is not None else self._trouble(step, values, slope)
            below = self.below if problem is None and high is None and rounds < REPEATS else None
            if problem is None and high is None and not self.beyond and below is None:
                clean = rounds or self.touched
                return self._ended_clean(step, values) if clean else self._passed(step, values)
            if below is not None:
                step, problem = self._taken(step, below * step.h, take)
                values = self.values(step.t_new, step.x_new)
                continue
            if high is not None:
                if not self._crossed(self._at(step, high)).any():
                    return self._at_event(step, step.t_new, step.x_new, values)
                theta = self._first_crossing(step, 0.0, high)
                way, soon = theta * step.h, max(least, self._unresolved(step, slope, theta))
                if not way * (1.0 - min(margin, 0.5)) > soon or rounds == REPEATS:
                    return self._within(step, theta)
            elif rounds == REPEATS:
                if problem is not None:
                    raise problem
                return self._passed(step, values)
            elif (high := self._ahead(step, slope, straight_on)) is not None:
                theta = self._first_crossing(step, 0.0, high, straight_on)
                way = theta * step.h
                if problem is None and not way > least:  # at the very start: the function may tell another kink within
                    self._passed(step, self._at(step, theta, straight_on))
                    self.beyond = False
                    continue
            h = way * (1.0 - min(margin, 0.5))
            step, problem = self._taken(step, h, take)
            if self.beyond:
                margin *= SHORTER
            if margin > 0.5:
                way = h
            values = self.values(step.t_new, step.x_new)
        raise AssertionError

    def _unresolved(self, step: Step, slope: Floats, theta: float) -> float:
        """Return the time (s) in which a kink that has crossed at a part of a step changes by its round-off alone.

        Nearer to it a step may leave all components as they are, so that none would ever get there.
        """
        crossed = self._crossed(self._at(step, theta)) & ~self.terminal
        if not crossed.any():
            return 0.0
        index, probe = int(np.argmax(crossed)), PROBE * step.h
        after, now = (float(self.values(step.t + h, step.x + h * slope)[index]) for h in (probe, 0.0))
        return self.events.unseen(index, step.t, step.x) * probe / abs(after - now) if after != now else 0.0

    def _taken(self, step: Step, h: float, take: Take) -> tuple[Step, StepError | None]:
        """Return another step from the start of `step`; where it got stuck at a kink, its start and length, and why."""
        try:
            return take(h, step.t + h), None
        except StepError as met:
            if not self.stuck(met):
                raise
            return replace(step, h=h, t_new=step.t + h), met

    def _let_chatter(self, step: Step, values: Floats) -> None:
        """Let a function that turns back and crosses at once after its own event do so, as dry friction at rest."""
        index = self.origin
        if index is None or not self.chattering:
            return
        if self._crossed(values)[index] and self._crossed(self._at(step, 1.0))[index]:
            self.flipped = self._located(step, index, 0.0, 1.0) < AT_ONCE
            self.sides[index] = -self.sides[index] if self.flipped else self.sides[index]

    def _trouble(self, step: Step, values: Floats, slope: Floats) -> float | None:
        """Return a part of the step at which something has crossed, its end first; None if nothing is known to."""
        self.below = None
        if self._crossed(values).any():
            return 1.0
        return None if self.beyond else self._looked(step, values, slope)

    def _ahead(self, step: Step, slope: Floats, straight_on: Path) -> float | None:
        """Return a part of the step at which something has crossed straight on; None if nothing does."""
        if self._crossed(self._at(step, 1.0, straight_on)).any():
            return 1.0
        end = straight_on(1.0)
        return self._looked(replace(step, x_new=end, slope_new=slope), self.values(step.t_new, end), slope, straight_on)

    def _looked(self, step: Step, values: Floats, slope: Floats, along: Path | None = None) -> float | None:
        """Return the first part of a step, that nothing crosses at its end, at which something is seen to have crossed.

        What is zero at the start is on the side to which it goes. Note where a stop was `below`.
        """
        probe = PROBE * step.h
        after = self.values(step.t + probe, step.x + probe * slope)
        before = self.values(step.t_new - probe, step.x_new - probe * step.slope_new)
        self.sides = np.where(self.sides == 0.0, np.sign(after), self.sides)
        sides, high = self.sides, None
        above, self.below = self.terminal & (sides > 0.0), None
        start = np.maximum(sides * self.values(step.t, step.x), 0.0)
        ends = Ends(start, sides * after, sides * before, sides * values)
        for index in np.flatnonzero(ends.uncertain() & ~(above & (values < 0.0))).tolist():
            if index == self.origin and self.chattering:
                continue

            seen = self._seen(step, index, ends, along)
            if above[index]:
                self.below = _first(self.below, seen)
            else:
                high = _first(high, seen)
        return high

    def _seen(self, step: Step, index: int, ends: Ends, along: Path | None) -> float | None:
        """Return the first part of a step at which a function is seen on its other side.

        What is zero at both ends may be held there by others, and be anything off the constraints.
        """
        looks, unseen, side = ends.looks(index), self.events.unseen(index, step.t, step.x), self.sides[index]
        held = along is None and max(look.value for look in looks) <= unseen
        way = partial(self._settled, step) if held else along

        def value(theta: float) -> float:
            return float(side * self._at(step, theta, way)[index])

        looks = looks_at_ends(value, *(look.value for look in looks)) if held else looks
        return first_seen(value, *looks, unseen)

    def _ended_clean(self, step: Step, values: Floats) -> Step:
        """Return a step without a slope from beyond a kink, ended at a crossing just behind it before the run ends.

        Raises StepError if the step was taken again and has become inaccurate, as the one before met no force there.
        """
        if not step.error <= 1.0:
            if self.flipped and self.origin is not None:
                self.sides[self.origin] = -self.sides[self.origin]
            raise StepError(Status.STEP_UNDERFLOW, step.t, 0)
        if self._crossed(self._at(step, 1.0 + BEYOND)).any():
            theta = self._first_crossing(step, 1.0, 1.0 + BEYOND)
            t = step.t + theta * step.h
            if not t - self.flow.t_end > ROUNDED_TIME * abs(t):
                return self._within(step, theta)
        return self._passed(step, values)

    def _crossed(self, values: Floats) -> NDArray[np.bool_]:
        """Tell which functions have crossed: a stop upwards, a kink in both directions."""
        return np.logical_and(self.sides * values < 0.0, ~self.terminal | (values > 0.0))

    def _at(self, step: Step, theta: float, along: Path | None = None) -> Floats:
        """Return the values `along` a way, the extension of the step; nan where there is none."""
        try:
            return self.values(step.t + theta * step.h, (along or step.value)(theta))
        except StepError:
            return np.full(len(self.sides), np.nan)

    def _passed(self, step: Step, values: Floats) -> Step:
        self.sides = np.where(values != 0.0, np.sign(values), self.sides)
        return step

    def _within(self, step: Step, theta: float) -> Step:
        t = step.t + theta * step.h
        values = self.values(t, step.value(theta))
        return self._at_event(step, t, self._settled(step, theta), values)

    def _settled(self, step: Step, theta: float) -> Floats:
        """Return the state within a step, put onto the constraints."""
        x = step.value(theta)
        settled = x if self.flow.settle_sample is None else self.flow.settle_sample(step.t + theta * step.h, x)
        return x if strays(step, x, settled) else settled

    def _at_event(self, step: Step, t: float, x: Floats, values: Floats) -> Step:
        """Return `step` ended at (t, x), by which event, stops first."""
        crossed = self._crossed(values)
        stops = crossed & self.terminal
        event = int(np.argmax(stops if stops.any() else crossed))
        return self._passed(replace(step, t_new=min(t, self.flow.t_end), x_new=x, event=event), values)

    def _first_crossing(self, step: Step, low: float, high: float, along: Path | None = None) -> float:
        """Return where the first of the functions crosses that have crossed at `high`, on the way `along` the step."""
        crossed = self._crossed(self._at(step, high, along))
        for index in range(len(self.sides)):
            if crossed[index]:
                left = self.left / step.h if index == self.origin else 0.0
                high = self._located(step, index, left if low < left < high else low, high, along)
                crossed = self._crossed(self._at(step, high, along))
        return high

    def _located(self, step: Step, index: int, low: float, high: float, along: Path | None = None) -> float:
        """Return the upper end of [low, high] reduced to round-off of the time by the Illinois method.

        They are parts of the step; at the upper end function `index` has been crossed. Where an end is the crossing but
        for round-off, a look beside it, by what is sought, is the last.
        """
        end = abs(step.t) + abs(step.h)
        least = max(float_info.epsilon * end / step.h, float_info.epsilon)
        at_high, at_low = (float(self._at(step, theta, along)[index]) for theta in (high, low))
        last = 0
        for round_ in range(LOCATING_ROUNDS):
            if not high - low > least:
                break
            change = at_low - at_high
            middle = low + (high - low) * (at_low / change) if change != 0.0 else math.nan
            if round_ % 3 == 2 or not low <= middle <= high:
                middle = 0.5 * (low + high)
            else:
                middle = min(max(middle, low + least), high - least)
            values = self._at(step, middle, along)
            if self._crossed(values)[index]:
                high, at_high = middle, float(values[index])
                at_low = 0.5 * at_low if last > 0 else at_low
                last = 1
            else:
                low, at_low = middle, float(values[index])
                at_high = 0.5 * at_high if last < 0 else at_high
                last = -1
        return high


def _first(one: float | None, other: float | None) -> float | None:
    """Return the smaller one of two parts of a step that are known."""
    return min((part for part in (one, other) if part is not None), default=None)
