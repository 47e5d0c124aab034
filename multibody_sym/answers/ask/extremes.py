"""`ask: {max: y}`: the largest or least value of an expression over a motion, and when it is reached."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import islice, pairwise
from math import copysign, inf, isfinite, log2, nan
from typing import Final, Self

import numpy as np
from numpy.polynomial import Polynomial

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.ask.from_runs import ASKED, Simulated, samples_at
from multibody_sym.answers.ask.later_formulas import MotionFormulas
from multibody_sym.answers.ask.question import ROUNDING, AskedMotion, LaterQuestion, NeverError, RunNumbers
from multibody_sym.answers.ask.working import time_text
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.mechanics.mechanism import TIME
from multibody_sym.mechanics.motion import state_of
from multibody_sym.model.fields import Names
from multibody_sym.model.settings import Ask
from multibody_sym.model.state_words import Moment, condition_of, moment_text, time_of
from multibody_sym.motion.results.integrals import Adding, FineLeg, integrated_outputs
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves, postorder, table
from multibody_sym.scalars.node import Node, slot
from multibody_sym.scalars.sign_changes import known_zeros, switching_functions
from multibody_sym.text.parser import of_run
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# When speeds, forces, inputs or an asked expression bend or jump along a run: it may have its extreme there.


_SAMPLES_BESIDE: Final = 1
"""So many samples on each side of two between which a function changes its sign tell when."""


@dataclass(frozen=True)
class Crossing:
    """Where a `function` of the state changes its sign: about at `t`, `between` two samples."""

    function: Node
    t: float
    between: tuple[float, float]


def bends(run: Trajectory) -> dict[float, Crossing | None]:
    """Return the times in a run at which speeds, forces, inputs or what is asked bend or jump, rising.

    Those of impacts and changes of state are known, those that follow from time and parameters alone are exact, others
    have a crossing: they are as good as a cubic through four samples.
    """
    mechanism, parameters = run.ready.mechanism, run.parameters.tolist()
    asked = [mechanism.outputs[ASKED]] if ASKED in mechanism.outputs else []
    splines = (n for n in postorder(mechanism.inputs.values()) if n.op == "table" and n.data[0].kind == "cubic")
    knots = (table(n.data[0].knots(range(len(n.data[0].rows))), 0, n.args[0]) for n in splines)
    functions = dict.fromkeys([*mechanism.kinks, *switching_functions(asked), *knots])  # signs that change at bends
    known = {slot("parameters", k): float(x) for k, x in enumerate(parameters)}
    begin, end = float(run.t[0]), float(run.t[-1])
    found: dict[float, Crossing | None] = {}
    moving = []
    for g in functions:
        timed = all(leaf is TIME or leaf in known for leaf in leaves([g], "slot"))
        zeros = known_zeros(g, TIME, known) if timed and not leaves([g], "quantity") else None
        if zeros is not None:
            found.update((t, None) for t in zeros if begin < t < end)
        elif not leaves([g], "quantity"):
            moving.append(g)
    states = zip(run.t.tolist(), run.q.tolist(), run.u.tolist(), strict=True) if moving else ()
    rows = [state_of(mechanism, float, t, q, u, parameters).values(moving) for t, q, u in states]
    for g, values in zip(moving, np.array(rows, dtype=float).T, strict=True):
        found = {**{t: Crossing(g, t, between) for t, between in _changes_of_sign(run.t, values)}, **found}
    found.update((float(change["t"]), None) for change in run.changes)
    return dict(sorted(found.items()))


def _changes_of_sign(t: Floats, y: Floats) -> Iterator[tuple[float, tuple[float, float]]]:
    """Yield about when a function changes its sign, and the samples beside that."""
    for k in np.flatnonzero(y[:-1] * y[1:] < 0.0):
        near = slice(max(k - _SAMPLES_BESIDE, 0), k + 2 + _SAMPLES_BESIDE)
        roots = Polynomial.fit(t[near], y[near], len(t[near]) - 1).roots()
        inside = [float(x.real) for x in roots if x.imag == 0.0 and t[k] <= x.real <= t[k + 1]]
        about = inside[:1] or [float(t[k] - y[k] * (t[k + 1] - t[k]) / (y[k + 1] - y[k]))]
        yield about[0], (float(t[k]), float(t[k + 1]))
    for k in np.flatnonzero(y[1:-1] == 0.0) + 1:
        yield float(t[k]), (float(t[k - 1]), float(t[k + 1]))


# ----------------------------------------------------------------------------------------------------------------------
# Values of what is asked along a run, each on its own side of what bends or jumps there.


_ROUNDED: Final = 1e-15


class Sides:
    """What is asked along a run, from its own stretches: another run would have its changes at times a little off."""

    def __init__(self, run: Trajectory) -> None:
        self._run, self._asked = run, run.ready.mechanism
        self._stretches = [x for x in run.stretches if x.duration > 0.0]
        self._starts = np.array([x.problem.start for x in self._stretches])
        self._times: dict[Crossing, float] = {}

    def value(self, t: float) -> float:
        """Return the value at a time."""
        return self._value(self._at(t), t)

    def beside(self, change: float, side: int) -> float:
        """Return the value before (side < 0) or behind a change of state.

        Its time is when it was, which may be a little off that at which a stretch ended and the next began.
        """
        k = int(np.argmin(np.abs(self._starts - change)))
        if side > 0 or k == 0:
            return self._value(k, max(change, float(self._starts[k])))
        return self._value(k - 1, self._stretches[k - 1].until)

    def _value(self, k: int, t: float) -> float:
        stretch = self._stretches[k]
        part = samples_at(stretch, t)
        if ASKED in part.told.outputs:
            return float(part.evaluated("outputs")[0][0, part.told.outputs.index(ASKED)])
        if ASKED not in self._asked.run_outputs:
            return float("nan")
        adding, middle = Adding(self._asked.run_outputs), stretch.problem.start + stretch.duration / 2
        jumps = [] if self._run.modes is None else self._run.modes.added(adding.leaves)
        before = [(-np.inf, more) for at, more in jumps if at < middle]
        return float(integrated_outputs(adding, self._run.stretches, [part], before)[ASKED][0])

    def largest(self, low: float, high: float) -> tuple[float, float]:
        """Return when the value is largest between two times of a stretch, and the value then.

        Ever finer samples about the largest one are taken until the polynomial through them tells, or times end.
        """
        stretch = self._stretches[self._at((low + high) / 2)]
        low, high = max(low, stretch.problem.start), min(high, stretch.until)
        leg = stretch.part(low, high, *stretch.at(low))
        while True:
            part = leg.fine(_FINER)
            t, y = part.t, part.evaluated("outputs")[0][:, part.told.outputs.index(ASKED)]
            y = np.where(np.isfinite(y), y, -np.inf)
            k = int(np.argmax(y))
            near = slice(max(k - _EXTREMES_BESIDE, 0), k + _EXTREMES_BESIDE + 1)
            if 0 < k < len(t) - 1 and np.isfinite(y[near]).all() and is_smooth(t[near], y[near], t[k]):
                turns = turning_points(_fitted(t[near], y[near]), t[k - 1], t[k + 1])
                known = [(x, self._value(self._at(x), x)) for x in turns]
                return max([*known, (float(t[k]), float(y[k]))], key=lambda place: place[1])
            before, after = max(k - 1, 0), min(k + 1, len(t) - 1)
            if not t[after] - t[before] > _NARROWEST * abs(t[after]) or (before, after) == (0, len(t) - 1):
                return float(t[k]), float(y[k])
            leg = leg.part(float(t[before]), float(t[after]), part.q[before], part.u[before])

    def can_refine(self) -> bool:
        """Return whether what is asked follows from a state: it is no integral over the run."""
        return ASKED in self._asked.outputs

    def when(self, crossing: Crossing) -> float:
        """Return when a function crosses zero, to rounding."""
        if crossing not in self._times:
            self._times[crossing] = self._crossed(crossing)
        return self._times[crossing]

    def _crossed(self, crossing: Crossing) -> float:
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        def value(t: float) -> float:
            stretch = self._stretches[self._at(t)]
            time, q, u = self._state(stretch, t)
            known = time, q.tolist(), u.tolist(), self._run.parameters.tolist()
            return float(state_of(stretch.mechanism, float, *known).values([crossing.function])[0])

        low, high = crossing.between
        if not value(low) * value(high) < 0.0:
            return crossing.t
        return float(brentq(value, low, high, xtol=_ROUNDED * high, rtol=4.0 * np.finfo(float).eps))

    def _at(self, t: float) -> int:
        return max(int(np.searchsorted(self._starts, t, side="right")) - 1, 0)

    @staticmethod
    def _state(stretch: FineLeg, t: float) -> tuple[float, Floats, Floats]:
        time, problem = min(t, stretch.until), stretch.problem
        return max(time, problem.start), *stretch.at(time)


# ----------------------------------------------------------------------------------------------------------------------
# The polynomial through samples about an extreme one, and where it turns back.


_EXTREMES_BESIDE: Final = 4
"""So many samples on each side of the extreme one make the polynomial that is searched."""
_REAL: Final = 1e-9
_SMOOTH: Final = 1e-6
"""The part of what samples span by which a polynomial may miss one: its extreme has the root of that as error."""
_NARROWEST: Final = 1e-13
"""The part of a time between samples below which their polynomial is rounding."""
_FINER: Final = 16
"""Pieces of four samples between two times about an extreme."""


def is_smooth(t: Floats, y: Floats, at: float, noise: float = 0.0) -> bool:
    """Return whether the polynomial through samples but the one `at` a time has this, too."""
    k = int(np.argmin(np.abs(t - at)))
    others = np.arange(len(t)) != k
    if len(t) <= 2:
        return True
    missed = abs(float(_fitted(t[others], y[others], (t[0], t[-1]))(t[k])) - float(y[k]))
    return missed <= max(_SMOOTH * float(np.ptp(y)), noise)


def _fitted(t: Floats, y: Floats, domain: tuple[float, float] | None = None) -> Polynomial:
    return Polynomial.fit(t, y, len(t) - 1, domain=domain or (t[0], t[-1]))


def turning_points(fitted: Polynomial, low: float, high: float) -> list[float]:
    """Return where a polynomial turns back between two times."""
    roots = fitted.deriv().roots()
    real = roots[np.abs(roots.imag) <= _REAL * float(np.ptp(fitted.domain))].real
    return [float(x) for x in real if low <= x <= high]


# ----------------------------------------------------------------------------------------------------------------------

_SAME: Final = 100
"""By so many tolerances of what a value spans what is reached first may fall short of the extreme, as runs err."""
_LIKELY: Final = 1e-6
"""The same for what the polynomials through samples tell."""
_APART: Final = 1e-14
"""The part of a run beside a jump at which the values before and behind it are looked for."""
_MOST_PEAKS: Final = 200
_MOST_UNSURE: Final = 20
"""So many places at which few samples tell little are looked at, those that seem largest."""
_EXACTLY: Final = 3
"""So many of the likely times are compared by runs that end there."""
_UNTIL: Final = "until"


@dataclass(frozen=True)
class _Place:
    """A time `t` that may have the extreme, before (`side` -1) or behind (1) a bend or jump there; 0 where none is.

    It is about `value`, and may be larger by `unsure` where few samples tell: `between` two times finer ones do.
    """

    t: float
    value: float
    side: int = 0
    unsure: float = 0.0
    between: tuple[float, float] | None = None

    @property
    def most(self) -> float:
        return self.value + self.unsure


@dataclass(frozen=True)
class ExtremeQuestion(LaterQuestion):
    """The largest or the least value of an expression, from `after` (None: the start) to `until` (None: the end)."""

    expression: Node
    is_largest: bool
    after: Node | None
    until: Node | Moment | None

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        if ask.max is not None:
            return cls(ask.max, True, ask.after, ask.until)
        return None if ask.min is None else cls(ask.min, False, ask.after, ask.until)

    def words(self) -> str:
        which = "the largest" if self.is_largest else "the least"
        begin = "" if self.after is None else f" after {time_text(self.after)}"
        until, given = self.until, time_of(self.until)
        end = "" if until is None else f" until {moment_text(until) if given is None else time_text(given)}"
        return f"{which} {text(self.expression)}{begin}{end}"

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(self.expression)

    def number(self, numbers: RunNumbers) -> Value:
        """Return the value and the time at which it is reached, first if more than once.

        The samples tell where to look, a polynomial through those near by when, and the run to that time how much.
        """
        motion = numbers.motion
        run, is_cut_off = self._run(motion)
        begin = 0.0 if self.after is None else motion.number(self.after)
        y = run[ASKED]
        inside = (run.t >= begin) & np.isfinite(y)
        if not inside.any():
            raise NeverError("the motion ends before the time after which it is asked, or there is no value")
        rounding, changes = motion.rtol * float(np.ptp(y[inside])), bends(run)
        noise = motion.rtol * float(np.abs(y[inside]).max())
        likely = _likely(run, y, inside, begin, list(changes), noise)
        t, value = _first(likely, _Reached(run, changes, rounding), rounding)
        if is_cut_off and t >= float(run.t[-1]):
            which, more = ("largest", "larger") if self.is_largest else ("least", "smaller")
            end = f"the {which} value is that at the end of the run, t_end = {run.t_final:.6g} s"
            numbers.notes.append(f"{end}: a longer one (simulation: t_end) may show a {more} one")
        if not np.isfinite(y[run.t >= begin]).all():
            numbers.notes.append("it has no value at some of the time, which is left out")
        return Value(value if self.is_largest else 0.0 - value, t=t)

    def rounding(self, numbers: RunNumbers) -> float:
        y = self._run(numbers.motion)[0][ASKED]
        return ROUNDING * float(np.abs(y[np.isfinite(y)]).max(initial=0.0))

    def _run(self, motion: Simulated) -> tuple[Trajectory, bool]:
        """Return the run that is searched for what is to be largest, and whether nothing but its time ends it."""
        asked, until = self.expression if self.is_largest else -self.expression, self.until
        if (given := time_of(until)) is not None:
            return motion.along(asked, motion.number(given)), False
        if until is None or (condition := condition_of(until)) is not None:
            run = motion.along(asked, None, motion.system.stop if until is None else Names({_UNTIL: condition}))
            return run, run.stop is None
        time = motion.moment(until) or None  # a state that is there from the start ends nothing
        return motion.along(asked, time), time is None

    def time(self, _numbers: RunNumbers, number: Value) -> float:
        assert number.t is not None
        return number.t

    # --- in closed form -------------------------------------------------------------------------------------------

    def start_value(self) -> Node:
        return self.expression

    def is_start(self, start: float, number: Value) -> bool:
        better = start - (number.value or 0.0) if self.is_largest else (number.value or 0.0) - start
        return better > 0.0 or super().is_start(start, number)

    def is_of_run(self) -> bool:
        return of_run(self.expression)

    def formula(self, course: MotionFormulas, time: float) -> Quotient:
        along = course.along(self.expression)
        return course.value(along, self._place(course, along, time))

    def _place(self, course: MotionFormulas, along: Node, time: float) -> Node:
        """Return where an extreme is: at the start, at an end that was given, where the speed turns, or flat."""
        until = self.until
        end = time_of(until)
        for given in (self.after, end):
            if given is not None and abs(course.there.solved.number(given) - time) <= AGREEMENT * time:
                return course.place_after(given)
        if course.turning is not None:
            return course.place(course.turning, "the motion turns where")
        try:
            return course.place(derivative(along, course.variable), "its slope vanishes where")
        except NoClosedFormError:
            if until is None or end is not None:
                raise  # an end that is a time is none at which the extreme is, as it was compared before
            return course.place_when(until)


class _Reached:
    """The time and value of each place, as a run has them."""

    def __init__(self, run: Trajectory, changes: Mapping[float, Crossing | None], rounding: float) -> None:
        self._sides, self._changes, self._rounding = Sides(run), changes, rounding
        self._ends = {float(run.t[k]): float(run[ASKED][k]) for k in (0, -1)}
        self._apart = _APART * run.t_final
        self.states = {float(change["t"]) for change in run.changes}
        self._known: dict[_Place, tuple[float, float]] = {}

    def __call__(self, place: _Place) -> tuple[float, float]:
        """Return the time and the value; what has none is least."""
        if place not in self._known:
            t, value = self._of(place)
            self._known[place] = t, -np.inf if np.isnan(value) else value
        return self._known[place]

    def _of(self, place: _Place) -> tuple[float, float]:
        t, side = place.t, place.side
        if place.between is not None and self._sides.can_refine():
            return self._sides.largest(*place.between)
        if side == 0:
            return t, self._ends[t] if t in self._ends else self._sides.value(t)
        if t in self.states:
            return t, self._sides.beside(t, side)
        crossing = self._changes[t]
        t = t if crossing is None else self._sides.when(crossing)
        at, beside = self._sides.value(t), self._sides.value(t + side * self._apart)
        return t, max(at, beside) if abs(at - beside) <= _SAME * self._rounding else beside


def _first(likely: list[_Place], reached: _Reached, rounding: float) -> tuple[float, float]:
    """Return the first of the `likely` times that have the largest value, and this value.

    Where a mode ends a run is a little beyond what ends it: of values that differ by no more than `rounding` those
    within a mode count before those with which one begins, and these before those with which one ends.
    """
    best = sorted(likely, key=lambda each: -each.value)[:_EXACTLY]
    best += [*sorted(likely, key=lambda each: -each.most)[:_EXACTLY], likely[-1], *(x for x in likely if x.between)]
    largest = max(reached(place)[1] for place in best)
    alike = [place for place in best if reached(place)[1] >= largest - rounding]
    clearness = {place: 2 if place.t not in reached.states else max(place.side, 0) for place in alike}
    value = reached(max(alike, key=lambda place: (clearness[place], reached(place)[1])))[1]
    for place in likely:
        t, here = reached(place)
        if here >= largest - _SAME * rounding:
            return t, here if here > largest else value
    raise AssertionError("one of the best is among them")


def _likely(
    run: Trajectory, y: Floats, inside: np.ndarray, begin: float, changes: list[float], noise: float
) -> list[_Place]:
    """Return the places at which the largest value may be first, in their order.

    The begin, the end, where the polynomials through samples turn back, and both sides of changes and bends.
    """
    looked = np.where(inside, y, -np.inf)
    top, first = int(np.argmax(looked)), int(np.argmax(run.t >= begin))
    legs, little = _Legs(run, y, looked, changes, noise), _LIKELY * float(np.ptp(y[inside]))
    about = 0.0 if run.t[first] == begin else float(legs.rises[first])
    found = [_Place(begin, float(np.interp(begin, run.t, y)), unsure=about), legs.sample(len(y) - 1)]
    if not np.isfinite([place.value for place in found]).all():
        found.append(legs.sample(top))
    unseen = dict[tuple[float, float], None]()
    for k in legs.peaks(top, little):
        found += legs.places(k)
        unseen.update(dict.fromkeys(legs.without_samples(k) if y[k] >= y[top] - little else ()))
    found = [place for place in found if place.t >= begin and np.isfinite(place.value)]
    least = max(place.value for place in found) - little
    for n, (a, b) in enumerate(unseen):
        found += [_Place(a, least, 1, np.inf), _Place(b, least, -1, np.inf)]
        found += [_Place((a + b) / 2, least, unsure=np.inf)] if n < _EXACTLY else []
    likely = [x for x in found if x.value >= least]
    unsure = [x for x in found if x.value < least <= x.most]
    likely += sorted(unsure, key=lambda x: -x.value)[:_MOST_UNSURE]
    by_time = {(x.t, x.side): x for x in sorted(likely, key=lambda x: x.most)}
    return sorted(by_time.values(), key=lambda x: (x.t, x.side))


class _Legs:
    """The samples of a run between `changes`; where samples are `looked` at is the largest value looked for."""

    def __init__(self, run: Trajectory, y: Floats, looked: Floats, changes: list[float], noise: float) -> None:
        self.t, self.y, self.looked, self.changes = run.t, y, looked, changes
        self.number = np.searchsorted(changes, run.t, side="right")
        """Of each sample how many changes it has behind it: a change has the value before it, a sample there not."""
        self.begins = np.r_[True, self.number[1:] != self.number[:-1]]
        self.ends = np.r_[self.begins[1:], True]
        self.noise = noise

    def peaks(self, top: int, little: float) -> list[int]:
        """Return samples near which the largest value may be: not less than those beside them, or beside a change."""
        y, rises = self.looked, self.rises
        before, after = np.r_[-np.inf, y[:-1]], np.r_[y[1:], -np.inf]
        place = ((y > before) & (y >= after)) | self.begins | self.ends
        found = np.flatnonzero(place & (y + rises >= y[top] - little))[:_MOST_PEAKS]
        return sorted({*(int(k) for k in found), top})

    @cached_property
    def rises(self) -> Floats:
        """How much more than at each sample there may be between it and the next: twice what it differs from those."""
        with np.errstate(invalid="ignore"):
            steps = np.abs(np.diff(self.looked))
        steps = np.where(np.isfinite(steps), steps, 0.0)
        own = np.where(self.begins[1:], 0.0, steps)
        all_steps, own_steps = (np.maximum(np.r_[0.0, x], np.r_[x, 0.0]) for x in (steps, own))
        rises: Floats = 2.0 * np.where(self.begins & self.ends, all_steps, own_steps)
        return rises

    def places(self, k: int) -> list[_Place]:
        """Return where the polynomial through samples around one turns back, and its values at changes beside that."""
        t, leg = self.t, self.number[k]
        first = max(k - _EXTREMES_BESIDE, int(np.searchsorted(self.number, leg)))
        last = min(k + _EXTREMES_BESIDE, int(np.searchsorted(self.number, leg, side="right")) - 1)
        near, values = t[first : last + 1], self.y[first : last + 1]
        if not np.isfinite(values).all():
            return [self.sample(k)]
        fitted = _fitted(near, values, (near[0] - self.step, near[-1] + self.step))
        low, high = t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)]
        found = list[_Place]()
        if self.begins[k] and k:
            low = self.changes[leg - 1]
            found.append(_Place(low, float(fitted(low)), 1, self._unsure(near, k, low)))
        if self.ends[k] and k < len(t) - 1:
            high = self.changes[leg]
            found.append(_Place(high, float(fitted(high)), -1, self._unsure(near, k, high)))
        if not is_smooth(near, values, t[k], self.noise):
            most = float(self.y[k] + self.rises[k])
            about = max([float(self.y[k]), *(float(fitted(x)) for x in turning_points(fitted, low, high))])
            value, between = min(about, most), (float(low), float(high))
            return [*found, _Place(float(t[k]), value, unsure=most - value, between=between)]
        if len(near) > 2:
            found += [_Place(x, float(fitted(x))) for x in turning_points(fitted, low, high)]
        return found if found and not (self.begins[k] or self.ends[k]) else [*found, self.sample(k)]

    def sample(self, k: int) -> _Place:
        return _Place(float(self.t[k]), float(self.y[k]))

    def _unsure(self, near: Floats, k: int, change: float) -> float:
        """Return how much more there may be at a change than the polynomial has that near samples make."""
        return 0.0 if len(near) > 2 or change == self.t[k] else float(self.rises[k])

    def without_samples(self, k: int) -> list[tuple[float, float]]:
        """Return the changes near a sample between which there is none, in pairs."""
        low, high = bisect_left(self.changes, self.t[k] - self.step), bisect_right(self.changes, self.t[k] + self.step)
        pairs = pairwise(self.changes[low:high])
        return [(a, b) for a, b in pairs if a < b and np.searchsorted(self.t, a) == np.searchsorted(self.t, b)]

    @property
    def step(self) -> float:
        return float(self.t[1] - self.t[0])


# ----------------------------------------------------------------------------------------------------------------------
# Zeros of functions that may have no value in places, and ranges in which they vanish, by their values alone.


FIRST: Final = 0.05
GROWTH: Final = 1.6
WIDENED: Final = 14
"""The first step from the declared value, relative to it, by which the next ones are longer, and how many there are."""
_PARTS: Final = 24
_HALVINGS: Final = 8
"""How closely the place is looked for from which on a function has no value: a zero may lie before it."""
_MOST: Final = 4
_ACCURACY: Final = 4 * float(np.finfo(float).eps)
_FINE: Final = 1e-13
"""The part of a root to which it is looked for by runs, which are not more accurate."""
_NO_ROOT: Final = 1e-5
"""The part of the values beside it that is left at a change of sign which is a jump, or a pole, and no zero."""
_SLOWEST: Final = 0.25
"""The least power of the distance with which a function tends to zero at the end of the range where it has values."""
_NOTHING: Final = 1e-10
"""The part of the largest value met that is zero to rounding, where a function vanishes over a whole range."""
_ROUNDING: Final = 1e-2
"""The part of that which runs leave of what vanishes, beside places where it is exactly zero."""
_RISE: Final = 1e3
"""How many times what is left in such a range a value beside it is at least."""
_PART_BESIDE: Final = 0.1
"""The part of a bracket by which a function must vanish on from its end, for that to be in such a range."""
_EDGE: Final = 1e-12
"""The part of the end of such a range to which it is looked for."""
_SLOPE: Final = 1e-4
"""How far beside a zero, relative to it, a function's growth is looked at."""
_UNSURE: Final = 1e-6
"""The part of a zero that is its error where its function has no growth that tells, or coarser runs end otherwise."""
_JUMP: Final = 0.1
"""A power of the distance with which a function hardly grows beside a range in which it vanishes: it jumps there."""
TOLERATED: Final = 1e-8
"""The part of such an end that is its error: there forces break inequalities, which hold to less than this."""
_SHRUNK: Final = 0.25
"""The part of a bracket that its parts need not be halved at."""


Point = tuple[float, float]
ANYWHERE: Final[Point] = (-inf, inf)
UNKNOWN: Final = nan
"""The value of a function where it has none."""


@dataclass(frozen=True)
class Zero:
    """Where a function vanishes, and what is left of it there; `through`: it does so all the way from there to here.

    `other`: the end of that range on the other side, None where `through` is as far as was looked.
    `is_last`: it tends to zero there, and has no value beyond.
    `noise`: the part of the function's value that is none. `fine`: to which part of it the place was looked for.
    """

    at: float
    residual: float
    through: float | None = None
    noise: float = 0.0
    fine: float = 0.0
    other: Zero | None = None
    is_last: bool = False

    @property
    def ended(self) -> bool:
        """Whether both ends of the range are known in which the function vanishes."""
        return self.other is not None

    def error(self, function: Callable[[float], float], noise: float) -> float:
        """Return how far the place may be off where values of a function may be off by `noise`, or what is left there.

        Beside its zero a function grows like |x|^p: what it takes there to grow by the noise is the error.
        """
        size = abs(self.at) or 1.0
        sides = (1.0, -1.0) if self.through is None else (1.0,) if self.through <= self.at else (-1.0,)
        unsure = max(noise, self.noise, abs(self.residual))
        for side in sides if isfinite(unsure) else ():
            way = side * _SLOPE * size
            far, near = (abs(function(self.at + x) - self.residual) for x in (way, way / 2))
            if far > near > 0.0 and isfinite(far):
                power = log2(far / near)
                if self.through is not None and power < _JUMP:
                    return TOLERATED * size
                power = max(power, 1.0)
                return self.fine * size + abs(way) * float((unsure / far) ** (1.0 / power))
        return _UNSURE * size


def zeros(
    function: Callable[[float], float],
    sample: float,
    bounds: tuple[float, float] | None,
    *,
    cheap: bool = False,
    size: float = 0.0,
    limits: Point = ANYWHERE,
    looked: Callable[[float], float] | None = None,
) -> list[Zero]:
    """Return where a function vanishes: all that a scan between bounds shows, the nearest to the sample first.

    Without bounds the one that is met first on ways out from the sample, to both sides up to `limits`; of a function
    that is `cheap` a few. Where the function is nan, it has no value. Of a range in which it vanishes everywhere, the
    end is returned, of two ends the upper one; of a range in which it has values, an end to which it tends to zero.
    `size`: how large the terms are that cancel where it vanishes. `looked`: the function as the way outwards asks it,
    which may raise where that takes too long.
    """
    if bounds is not None:
        points = [(x, function(x)) for x in map(float, np.linspace(*bounds, _PARTS + 1))]
        brackets = (_with_values(function, a, b) for a, b in pairwise(points))
        walk: Iterator[_Seen] = (_Seen(*bracket, points, size) for bracket in brackets)
    else:
        walk = _outwards(looked or function, sample, size, limits)
    fine = _ACCURACY if cheap else _FINE
    looks = (_edge, partial(_zero, fine=fine), partial(_end, fine=fine))
    shown = (next(filter(None, (look(function, seen) for look in looks)), None) for seen in walk)
    met = filter(None, shown)
    found = list(islice(met, None if bounds is not None else _MOST if cheap else 1))
    if found and bounds is None and found[-1].through is not None:  # the other end of the range too
        found += islice(met, 1)
    # of a range in which all are zeros the upper end is kept
    found = sorted({zero.at: zero for zero in found}.values(), key=lambda zero: abs(zero.at - sample))
    ranges: list[Zero] = []
    for zero in (each for each in found if each.through is not None):
        same = next((k for k, other in enumerate(ranges) if _overlap(other, zero)), None)
        if same is None:
            ranges.append(zero)
        else:
            low, high = sorted((ranges[same], zero), key=lambda each: each.at)
            ranges[same] = replace(high, through=low.at, other=low)
    alone = [each for each in found if each.through is None and not any(_overlap(each, x) for x in ranges)]
    order = [zero.at for zero in found]
    return sorted([*ranges, *alone], key=lambda each: order.index(each.at))


def _overlap(one: Zero, two: Zero) -> bool:
    ends = [sorted((x.at, x.at if x.through is None else x.through)) for x in (one, two)]
    return max(low for low, _ in ends) <= min(high for _, high in ends)


def vanishes_about(
    function: Callable[[float], float], sample: float, bounds: tuple[float, float] | None, little: float
) -> bool:
    """Return whether a function is `little` at the sample, and wherever it has a value among some that lie about it."""
    if not abs(function(sample)) <= little:
        return False
    width = abs(sample) / 2 or 0.5
    low, high = bounds if bounds is not None else (sample - width, sample + width)
    known = [x for part in _ABOUT if isfinite(x := function(low + (high - low) * part))]
    far = reach(sample) if bounds is None else ()
    if len(known) < _ENOUGH or any(abs(x) > little for x in known):
        return False
    return not any(abs(function(x)) > little for x in far)


_ABOUT: Final = (0.0, 0.137, 0.391, 0.618, 0.853, 1.0)
"""Where between bounds a function is looked at that may vanish everywhere."""
_ENOUGH: Final = 4


def reach(sample: float, limits: Point = ANYWHERE) -> tuple[float, float]:
    """Return the least and the largest value that are tried without bounds, but for `limits`."""
    way = FIRST * (abs(sample) or 1.0) * (GROWTH**WIDENED - 1) / (GROWTH - 1)
    return max(sample - way, limits[0]), min(sample + way, limits[1])


def _changes(a: Point, b: Point) -> bool:
    return isfinite(a[1]) and isfinite(b[1]) and (a[1] == 0.0 or a[1] * b[1] < 0.0)


@dataclass(frozen=True)
class _Seen:
    """A bracket among the points at which a function of so large terms was looked at, in their order.

    `beyond`: a place beside the bracket where the function has no value, None where it has one.
    """

    a: Point
    b: Point
    beyond: float | None
    points: Sequence[Point]
    size: float

    @property
    def little(self) -> float:
        seen = (abs(y) for _, y in (*self.points, self.a, self.b) if isfinite(y))
        return _NOTHING * max(self.size, max(seen, default=0.0))

    @property
    def is_nothing(self) -> bool:
        """Whether both ends are rounding of the terms that cancel: no root, but within a range."""
        return max(abs(self.a[1]), abs(self.b[1])) <= _NOTHING * self.size

    def noise(self, end: float, through: float) -> float:
        """Return the largest value met in a range in which the function vanishes."""
        low, high = sorted((end, through))
        return max((abs(y) for x, y in self.points if low <= x <= high), default=0.0)

    def through(self, end: Point, other: Point) -> float:
        """Return how far the function vanishes from an end of the bracket on, away from the other."""
        side = 1.0 if end[0] > other[0] else -1.0
        beyond = sorted((x for x in self.points if (x[0] - end[0]) * side > 0.0), key=lambda x: x[0] * side)
        last = end[0]
        for x, y in beyond:
            if not abs(y) <= self.little:
                break
            last = x
        return last


def _outwards(function: Callable[[float], float], sample: float, size: float, limits: Point) -> Iterator[_Seen]:
    """Yield the brackets that are met on the way from the sample outwards, to one side and the other in turn."""
    low, high = limits if limits[0] <= sample <= limits[1] else ANYWHERE
    here = (sample, function(sample))
    points = [here]
    ends = {1.0: here, -1.0: here}
    step = FIRST * (abs(sample) or 1.0)
    for k in range(WIDENED):
        before = ends
        ways = {side: min(max(last[0] + side * step, low), high) for side, last in before.items()}
        ends = {side: (x, function(x)) for side, x in ways.items() if x != before[side][0]}
        points += ends.values()
        if k == 0 and here[1] == 0.0 and all(not abs(y) <= _NOTHING * size for _, y in ends.values()):
            yield _Seen(here, here, None, points, size)
        for side, end in ends.items():
            yield _Seen(*_with_values(function, before[side], end), tuple(sorted(points)), size)
        step *= GROWTH


def _with_values(function: Callable[[float], float], a: Point, b: Point) -> tuple[Point, Point, float | None]:
    """Return two points, and None; for one without a value, the last on the way there that has one, or another sign.

    Then with a place beyond that has none.
    """
    if isfinite(a[1]) == isfinite(b[1]):
        return a, b, None
    begin, beyond = (a, b[0]) if isfinite(a[1]) else (b, a[0])
    ways = islice(_towards_end(function, begin, beyond), _HALVINGS)
    last, without = begin, beyond
    while not _changes(begin, last) and (way := next(ways, None)) is not None:
        last, without = way
    return (begin, last, without) if begin is a else (last, begin, without)


def _towards_end(function: Callable[[float], float], last: Point, without: float) -> Iterator[tuple[Point, float]]:
    """Yield ever closer the last point at which a function has a value, and the place beyond at which it has none."""
    while True:
        x = (last[0] + without) / 2
        value = function(x)
        last, without = ((x, value), without) if isfinite(value) else (last, x)
        yield last, without


def _edge(function: Callable[[float], float], seen: _Seen) -> Zero | None:
    """Return the end of a range in which a function vanishes, to rounding, None where none ends in a bracket.

    It vanishes at one end of the bracket, and on from there as well: that tells a range from a zero that was hit.
    """
    zero, other = sorted((seen.a, seen.b), key=lambda x: abs(x[1]))
    if not (isfinite(zero[1]) and isfinite(other[1]) and abs(zero[1]) <= seen.little < abs(other[1])):
        return None
    through = seen.through(zero, other)
    way = _PART_BESIDE * (zero[0] - other[0]) if through != zero[0] else _PART_BESIDE * (other[0] - zero[0])
    beside = function(zero[0] + way)
    left = max(abs(zero[1]), abs(beside), seen.noise(zero[0], through))
    if not left <= min(seen.little, abs(other[1]) / _RISE):
        return None
    little = max(4 * left, _ROUNDING * seen.little)
    return Zero(*_last_within(function, zero, other, little), through, noise=little, fine=_EDGE)


def _last_within(function: Callable[[float], float], inside: Point, outside: Point, little: float) -> Point:
    """Return the last point from `inside` on, to rounding, at which a function is `little`; it is not so outside.

    Outside it grows from there on: a line through the last two points outside tells where, to its curvature, and it is
    looked at by as much to both sides of that; halves are taken where this shrinks the bracket little.
    """
    whole, before = abs(outside[0] - inside[0]), outside
    while abs(width := outside[0] - inside[0]) > (fine := _EDGE * max(abs(outside[0]), abs(inside[0]))):
        looked = [inside[0] + width / 2]
        if before[1] != outside[1]:
            slope = (outside[1] - before[1]) / (outside[0] - before[0])
            end = outside[0] - outside[1] / slope
            curved = 2 * abs((outside[0] - end) * (before[0] - end)) / whole
            aside = copysign(max(curved, 2 * little / abs(slope), fine / 4), width)
            if (end - inside[0] + aside) * width > 0.0:
                looked = [end + aside, end - aside, *looked]
        for x in looked:
            if not min(inside[0], outside[0]) < x < max(inside[0], outside[0]):
                continue
            there = (x, function(x))
            if abs(there[1]) <= little:
                inside = there
            else:
                before, outside = outside if abs(outside[1]) > _RISE * little else before, there
            if abs(outside[0] - inside[0]) <= _SHRUNK * abs(width):
                break
    return inside


def _zero(function: Callable[[float], float], seen: _Seen, fine: float) -> Zero | None:
    """Return the zero in a bracket, None where the function has none or jumps there."""
    a, b = seen.a, seen.b
    if not _changes(a, b) or seen.is_nothing:
        return None
    if a[1] == 0.0:
        return Zero(a[0], 0.0, fine=fine)
    from scipy.optimize import brentq  # scipy takes longer to import than most answers take

    known = dict((a, b))

    def remembered(x: float) -> float:
        if x not in known:
            known[x] = function(x)
        return known[x]

    try:
        root = float(brentq(remembered, a[0], b[0], xtol=fine * max(abs(a[0]), abs(b[0])), rtol=fine))
    except ValueError:
        return None
    left = remembered(root)
    return Zero(root, left, fine=fine) if abs(left) <= _NO_ROOT * max(abs(a[1]), abs(b[1])) else None


def _end(function: Callable[[float], float], seen: _Seen, fine: float) -> Zero | None:
    """Return the end of the range in which a function has values, None where it does not tend to zero there."""
    if seen.beyond is None or seen.is_nothing:
        return None
    beyond = seen.beyond
    near = min((seen.a, seen.b), key=lambda x: abs(x[0] - beyond))
    inside = (x for x in seen.points if isfinite(x[1]) and (near[0] - x[0]) * (beyond - near[0]) > 0.0)
    far = min(inside, key=lambda x: abs(x[0] - near[0]), default=near)
    size, whole = abs(far[1]), abs(beyond - far[0])
    for last, without in _towards_end(function, near, beyond):
        width = abs(without - last[0])
        if abs(last[1]) > size * (width / whole) ** _SLOWEST:
            return None
        if width <= fine * abs(without):
            return Zero(*last, fine=fine, is_last=True) if abs(last[1]) <= _NO_ROOT * size else None
    raise AssertionError
