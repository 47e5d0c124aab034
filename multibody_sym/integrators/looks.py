"""Looks at switching functions within a step, until they are certain to keep their signs; `looks.c` is the same in C.

A function that has one sign at both ends of a piece of a step, and changes at rates known there, is certain to keep it
if its rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way.
A piece of which neither is true is halved. So a body that can reach another within a step is looked at ever more
closely where it comes near, and few looks are taken at what stays away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.sign_changes import PROBE, Look
from multibody_sym.records import dataclass

MOST_CHANGE: Final = (
    0.5  # part of its distance from zero by which a function that keeps steps short changes in one, ...
)
MOST_OF_ALL: Final = 0.1  # ... or of the largest it had


@dataclass(frozen=True)
class Ends:
    """Values (ng,) at both ends of a step, times the sides on which they were, and PROBE after and before them."""

    start: Floats
    after: Floats
    before: Floats
    end: Floats

    def uncertain(self) -> NDArray[np.bool_]:
        """Tell which functions may change their sign in the step."""
        rise, fall = (self.after - self.start) / PROBE, (self.end - self.before) / PROBE
        found: NDArray[np.bool_] = (self.end < 0.0) | _uncertain(self.start, self.end, rise, fall)
        return found

    def looks(self, index: int) -> tuple[Look, Look]:
        """Return the looks at one function at the ends of the step."""
        start, after, before, end = (float(values[index]) for values in (self.start, self.after, self.before, self.end))
        rise, fall = (after - start) / PROBE, (end - before) / PROBE
        return Look(0.0, start, rise, rise), Look(1.0, end, fall, fall)


def _uncertain(start: Floats, end: Floats, rise: Floats, fall: Floats) -> NDArray[np.bool_]:
    """Tell where values at both ends and changes at the rates there do not say that a function keeps its sign."""
    change = end - start
    bend = np.maximum(np.abs(rise - change), np.abs(fall - change))
    found: NDArray[np.bool_] = (np.minimum(start, end) < bend) & (bend > 0.5 * np.abs(change))
    return found


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
