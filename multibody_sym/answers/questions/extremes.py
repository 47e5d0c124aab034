"""The largest and least value of an expression over a motion, and when it is reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial import Polynomial

from multibody_sym.answers.questions.simulated_motion import ASKED, Simulated
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.kinks import is_condition
from multibody_sym.scalars.node import Node, negate
from multibody_sym.simulation.trajectory import Trajectory

_BESIDE: Final = 4
"""So many samples on each side of the extreme one make the polynomial that is searched."""
_REAL: Final = 1e-9
_SAME: Final = 1e-13
"""The part of an extreme by which what is reached first may fall short of it, as rounding does."""
_UNTIL: Final = "until"


@dataclass(frozen=True)
class Extreme:
    """An extreme value and the time at which it is reached, first if more than once."""

    value: float
    t: float


def extreme(motion: Simulated, question: Ask) -> Extreme | None:
    """Return the extreme of a question, from its `after` to its `until` or the end of the run; None if that is before.

    The samples tell where to look, a polynomial through those near by when, and a run to that time how much.
    """
    asked = question.max if question.max is not None else negate(_given(question.min))
    begin = 0.0 if question.after is None else motion.number(question.after)
    run = _run(motion, asked, question)
    inside = run.t >= begin
    if not inside.any():
        return None
    times = _candidates(run, run[ASKED], inside, begin)
    values = [motion.value(asked, t) for t in times]
    largest = max(values)
    found = next(Extreme(x, t) for x, t in zip(values, times, strict=True) if x >= largest - _SAME * abs(largest))
    return found if question.max is not None else Extreme(-found.value, found.t)


def _given(node: Node | None) -> Node:
    assert node is not None
    return node


def _run(motion: Simulated, asked: Node, question: Ask) -> Trajectory:
    until = question.until
    if isinstance(until, Node) and not is_condition(until):
        return motion.along(asked, motion.number(until))
    if until is None:
        return motion.along(asked, None, motion.system.stop)
    if isinstance(until, Node):
        return motion.along(asked, None, Names({_UNTIL: until}))
    time = motion.moment(until)
    return motion.along(asked, time)


def _candidates(run: Trajectory, y: Floats, inside: np.ndarray, begin: float) -> list[float]:
    """Return the times at which the largest value may be: near the largest sample, at the begin, at changes."""
    k = int(np.argmax(np.where(inside, y, -np.inf)))
    times = [begin, float(run.t[k]), float(run.t[-1])]
    changes = [float(change["t"]) for change in run.changes]
    times += [t for t in changes if begin <= t and abs(t - run.t[k]) <= run.t[1] - run.t[0]]
    times += [t for t in _turns(run.t, y, k, changes) if t >= begin]
    return sorted(set(times))


def _turns(t: Floats, y: Floats, k: int, changes: list[float]) -> list[float]:
    """Return where the polynomial through the samples around one turns back, between its neighbours."""
    first, last = max(k - _BESIDE, 0), min(k + _BESIDE, len(t) - 1)
    for change in changes:
        first = max(first, int(np.searchsorted(t, change))) if change <= t[k] else first
        last = min(last, int(np.searchsorted(t, change)) - 1) if change > t[k] else last
    near, values = t[first : last + 1], y[first : last + 1]
    if len(near) < 3 or not np.isfinite(values).all():
        return []
    fitted = Polynomial.fit(near, values, len(near) - 1)
    roots = fitted.deriv().roots()
    real = roots[np.abs(roots.imag) <= _REAL * (near[-1] - near[0])].real
    low, high = t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)]
    return [float(x) for x in real if low <= x <= high]
