"""The largest and least value of an expression over a motion, and when it is reached."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Collection, Mapping
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial import Polynomial

from multibody_sym.answers.questions.bends import Crossing, bends
from multibody_sym.answers.questions.sides import Sides
from multibody_sym.answers.questions.simulated_motion import ASKED, Simulated
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.kinks import is_condition
from multibody_sym.scalars.node import Node, negate
from multibody_sym.simulation.trajectory import Trajectory

_BESIDE: Final = 4
"""So many samples on each side of the extreme one make the polynomial that is searched."""
_REAL: Final = 1e-9
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
_LEFT_OUT: Final = "it has no value at some of the time, which is left out"


@dataclass(frozen=True)
class Extreme:
    """An extreme value and the time at which it is reached, first if more than once; `told`: what it rests on."""

    value: float
    t: float
    told: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Place:
    """A time `t` that may have the extreme, before (`side` -1) or behind (1) a bend or jump there; 0 where none is.

    It is about `value`, and may be larger by `unsure` where few samples tell.
    """

    t: float
    value: float
    side: int = 0
    unsure: float = 0.0

    @property
    def most(self) -> float:
        """The largest value that there may be."""
        return self.value + self.unsure


def extreme(motion: Simulated, question: Ask) -> Extreme | None:
    """Return the extreme of a question, from its `after` to its `until` or the end of the run; None if that is before.

    The samples tell where to look, a polynomial through those near by when, and the run to that time how much.
    """
    largest = question.max is not None
    run, is_cut_off = _searched(motion, question)
    begin = 0.0 if question.after is None else motion.number(question.after)
    y = run[ASKED]
    inside = (run.t >= begin) & np.isfinite(y)
    if not inside.any():
        return None
    rounding, changes = motion.rtol * float(np.ptp(y[inside])), bends(run)
    likely = _likely(run, y, inside, begin, list(changes))
    found = _first(likely, _Reached(run, changes, rounding), rounding)
    told = _cut_off(run, found.t, "largest" if largest else "least") if is_cut_off else ()
    told += (_LEFT_OUT,) if not np.isfinite(y[run.t >= begin]).all() else ()
    return Extreme(found.value if largest else 0.0 - found.value, found.t, told)


def size(motion: Simulated, question: Ask) -> float:
    """Return the largest absolute value in the run that is searched for an extreme."""
    y = _searched(motion, question)[0][ASKED]
    return float(np.abs(y[np.isfinite(y)]).max(initial=0.0))


def _searched(motion: Simulated, question: Ask) -> tuple[Trajectory, bool]:
    """Return the run that is searched for what is to be largest, and whether nothing but its time ends that."""
    return _run(motion, question.max if question.max is not None else negate(_given(question.min)), question)


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
        if side == 0:
            return t, self._ends[t] if t in self._ends else self._sides.value(t)
        if t in self.states:
            return t, self._sides.beside(t, side)
        crossing = self._changes[t]
        t = t if crossing is None else self._sides.when(crossing)
        at, beside = self._sides.value(t), self._sides.value(t + side * self._apart)
        return t, max(at, beside) if abs(at - beside) <= _SAME * self._rounding else beside


def _first(likely: list[_Place], reached: _Reached, rounding: float) -> Extreme:
    """Return the largest value, and the first of the `likely` times that have it.

    Where a mode ends a run is a little beyond what ends it: of values that differ by no more than `rounding` those
    within a mode count before those with which one begins, and these before those with which one ends.
    """
    best = sorted(likely, key=lambda each: -each.value)[:_EXACTLY]
    best += [*sorted(likely, key=lambda each: -each.most)[:_EXACTLY], likely[-1]]
    largest = max(reached(place)[1] for place in best)
    alike = [place for place in best if reached(place)[1] >= largest - rounding]
    clear = max(alike, key=lambda place: (_clearness(place, reached.states), reached(place)[1]))
    value = reached(clear)[1]
    for place in likely:
        t, here = reached(place)
        if here >= largest - _SAME * rounding:
            return Extreme(here if here > largest else value, t)
    raise AssertionError("one of the best is among them")


def _clearness(place: _Place, states: Collection[float]) -> int:
    return 2 if place.t not in states else max(place.side, 0)


def _cut_off(run: Trajectory, time: float, which: str) -> tuple[str, ...]:
    """Return what is to be said of an extreme at the end of a run that nothing ended but its time."""
    if time < float(run.t[-1]):
        return ()
    more = "larger" if which == "largest" else "smaller"
    end = f"the {which} value is that at the end of the run, t_end = {run.t_final:.6g} s"
    return (f"{end}: a longer one (simulation: t_end) may show a {more} one",)


def _given(node: Node | None) -> Node:
    assert node is not None
    return node


def _run(motion: Simulated, asked: Node, question: Ask) -> tuple[Trajectory, bool]:
    """Return the run that is searched, and whether nothing but its time ends it."""
    until = question.until
    if isinstance(until, Node) and not is_condition(until):
        return motion.along(asked, motion.number(until)), False
    if until is None or isinstance(until, Node):
        run = motion.along(asked, None, motion.system.stop if until is None else Names({_UNTIL: until}))
        return run, run.stop is None
    time = motion.moment(until) or None  # a state that is there from the start ends nothing
    return motion.along(asked, time), time is None


def _likely(run: Trajectory, y: Floats, inside: np.ndarray, begin: float, changes: list[float]) -> list[_Place]:
    """Return the places at which the largest value may be first, in their order.

    The begin, the end, where the polynomials through samples turn back, and both sides of changes and bends.
    """
    looked = np.where(inside, y, -np.inf)
    top, first = int(np.argmax(looked)), int(np.argmax(run.t >= begin))
    legs, little = _Legs(run, y, looked, changes), _LIKELY * float(np.ptp(y[inside]))
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

    def __init__(self, run: Trajectory, y: Floats, looked: Floats, changes: list[float]) -> None:
        self.t, self.y, self.looked, self.changes = run.t, y, looked, changes
        self.number = np.searchsorted(changes, run.t, side="right")
        """Of each sample how many changes it has behind it: a change has the value before it, a sample there not."""
        self.begins = np.r_[True, self.number[1:] != self.number[:-1]]
        self.ends = np.r_[self.begins[1:], True]

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
        first = max(k - _BESIDE, int(np.searchsorted(self.number, leg)))
        last = min(k + _BESIDE, int(np.searchsorted(self.number, leg, side="right")) - 1)
        near, values = t[first : last + 1], self.y[first : last + 1]
        if not np.isfinite(values).all():
            return [self.sample(k)]
        fitted = Polynomial.fit(near, values, len(near) - 1, domain=[near[0] - self.step, near[-1] + self.step])
        low, high = t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)]
        found = list[_Place]()
        if self.begins[k] and k:
            low = self.changes[leg - 1]
            found.append(_Place(low, float(fitted(low)), 1, self._unsure(near, k, low)))
        if self.ends[k] and k < len(t) - 1:
            high = self.changes[leg]
            found.append(_Place(high, float(fitted(high)), -1, self._unsure(near, k, high)))
        roots = fitted.deriv().roots() if len(near) > 2 else np.array([])
        real = roots[np.abs(roots.imag) <= _REAL * (near[-1] - near[0])].real
        found += [_Place(float(x), float(fitted(x))) for x in real if low <= x <= high]
        return found if found and not (self.begins[k] or self.ends[k]) else [*found, self.sample(k)]

    def sample(self, k: int) -> _Place:
        """Return the place of a sample."""
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
        """The time between samples."""
        return float(self.t[1] - self.t[0])
