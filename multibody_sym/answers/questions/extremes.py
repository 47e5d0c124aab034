"""The largest and least value of an expression over a motion, and when it is reached."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial import Polynomial

from multibody_sym.answers.questions.bends import bends
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


def extreme(motion: Simulated, question: Ask) -> Extreme | None:
    """Return the extreme of a question, from its `after` to its `until` or the end of the run; None if that is before.

    The samples tell where to look, a polynomial through those near by when, and a run to that time how much.
    """
    largest = question.max is not None
    asked = question.max if question.max is not None else negate(_given(question.min))
    begin = 0.0 if question.after is None else motion.number(question.after)
    run, is_cut_off = _run(motion, asked, question)
    y = run[ASKED]
    inside = (run.t >= begin) & np.isfinite(y)
    if not inside.any():
        return None
    ends = {float(run.t[0]): float(y[0]), float(run.t[-1]): float(y[-1])}
    found = _first(
        _likely(run, y, inside, begin),
        lambda t: ends[t] if t in ends else motion.value(asked, t),
        motion.rtol * float(np.ptp(y[inside])),
        {float(change["t"]) for change in run.changes},
    )
    told = _cut_off(run, found.t, "largest" if largest else "least") if is_cut_off else ()
    told += (_LEFT_OUT,) if not np.isfinite(y[run.t >= begin]).all() else ()
    return Extreme(found.value if largest else 0.0 - found.value, found.t, told)


def _first(
    likely: list[tuple[float, float]], value: Callable[[float], float], rounding: float, changes: Collection[float]
) -> Extreme:
    """Return the largest value, and the first of times that have it; `likely`: times with about what they are worth.

    At `changes` of state a run has the values of the state before, a little beyond what ends it: those of times within
    a state count where they differ by no more than `rounding`.
    """
    best = sorted(likely, key=lambda each: -each[1])[:_EXACTLY]
    best.append(max(likely, key=lambda each: (each[1], each[0])))  # a sample behind changes that are worth as much
    found = {time: value(time) for time, _ in best}
    largest = max(found.values())
    within = max((x for time, x in found.items() if time not in changes), default=-np.inf)
    clear = within if within >= largest - rounding else None
    for time, _ in likely:
        here = value(time)
        if here >= largest - _SAME * rounding:
            return Extreme(max(here, largest) if clear is None else clear, time)
    raise AssertionError("one of the best is among them")


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
    time = motion.moment(until)
    return motion.along(asked, time), time is None


def _likely(run: Trajectory, y: Floats, inside: np.ndarray, begin: float) -> list[tuple[float, float]]:
    """Return the times at which the largest value may be first, with about what they are worth, in their order.

    At the begin, at the end, where samples are larger than those beside them, and at changes and bends near by.
    """
    looked = np.where(inside, y, -np.inf)
    top, last = int(np.argmax(looked)), len(y) - 1
    times = {begin: float(np.interp(begin, run.t, y)), float(run.t[-1]): float(y[-1])}
    if not np.isfinite(list(times.values())).all():
        times[float(run.t[top])] = float(y[top])
    changes, states = bends(run), {float(each["t"]) for each in run.changes if each["kind"] != "impact"}
    beside = [abs(float(y[top] - y[k])) for k in (max(top - 1, 0), min(top + 1, last)) if inside[k]]
    lowest = float(y[top]) - max(beside, default=0.0)
    between = list[float]()
    for k in _peaks(looked, lowest, top):
        found = {t: value for t, value in _turns(run.t, y, k, changes) if t >= begin}
        step = run.t[1] - run.t[0]
        near = changes[bisect_left(changes, max(begin, run.t[k] - step)) : bisect_right(changes, run.t[k] + step)]
        found.update({t: float(y[k]) for t in near})  # a change has the value before it, the sample that after it
        jumps = [t for t in near if begin < t and t not in states]
        found.update({t + side * _APART * run.t_final: float(y[k]) for t in jumps for side in (-1, 1)})
        times.update(found if found and not near else {**found, float(run.t[k]): float(y[k])})
        between += [(a + b) / 2 for a, b in pairwise(sorted(set(near)))]  # a state that no sample may have
    times = {t: value for t, value in times.items() if np.isfinite(value)}
    largest = max(times.values())
    times.update(dict.fromkeys(between[:_EXACTLY], largest))
    little = max(_LIKELY * float(np.ptp(y[inside])), abs(largest - float(y[top])) if changes else 0.0)
    return sorted((t, value) for t, value in times.items() if value >= largest - little)


def _peaks(y: Floats, lowest: float, top: int) -> list[int]:
    """Return the samples from `lowest` on that are not less than those beside them, the top one among them."""
    before, after = np.r_[-np.inf, y[:-1]], np.r_[y[1:], -np.inf]
    found = np.flatnonzero((y > before) & (y >= after) & (y >= lowest))[:_MOST_PEAKS]
    return sorted({*(int(k) for k in found), top})


def _turns(t: Floats, y: Floats, k: int, changes: list[float]) -> list[tuple[float, float]]:
    """Return where the polynomial through the samples around one turns back, between its neighbours, and its values."""
    first, last = max(k - _BESIDE, 0), min(k + _BESIDE, len(t) - 1)
    for change in changes[bisect_left(changes, t[first]) : bisect_right(changes, t[last])]:
        first = max(first, int(np.searchsorted(t, change))) if change <= t[k] else first
        last = min(last, int(np.searchsorted(t, change)) - 1) if change > t[k] else last
    near, values = t[first : last + 1], y[first : last + 1]
    if len(near) < 3 or not np.isfinite(values).all():
        return []
    fitted = Polynomial.fit(near, values, len(near) - 1)
    roots = fitted.deriv().roots()
    real = roots[np.abs(roots.imag) <= _REAL * (near[-1] - near[0])].real
    low, high = t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)]
    return [(float(x), float(fitted(x))) for x in real if low <= x <= high]
