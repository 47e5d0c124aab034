"""Looks at switching functions within a step, until they are certain to keep their signs; `looks.c` is the same in C.

A function that has one sign at both ends of a piece of a step, and changes at rates known there, is certain to keep it
if its rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way.
A piece of which neither is true is halved. So a body that can reach another within a step is looked at ever more
closely where it comes near, and few looks are taken at what stays away.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats

PROBE: Final = 2.0**-10  # part of a piece over which rates at its ends are measured
LEAST_PIECE: Final = 2.0**-40  # part of a step that is not halved any more
MOST_LOOKS: Final = 1000  # halvings in a step for one function, which is zero but for round-off if they do not suffice


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


@dataclass(frozen=True)
class Look:
    """A function's value at theta, a part of the step, and its rates before and after it."""

    theta: float
    value: float
    before: float
    after: float


def _uncertain(start: Floats, end: Floats, rise: Floats, fall: Floats) -> NDArray[np.bool_]:
    """Tell where values at both ends and changes at the rates there do not say that a function keeps its sign."""
    change = end - start
    bend = np.maximum(np.abs(rise - change), np.abs(fall - change))
    found: NDArray[np.bool_] = (np.minimum(start, end) < bend) & (bend > 0.5 * np.abs(change))
    return found


def first_seen(value: Callable[[float], float], start: Look, end: Look) -> float | None:
    """Return a part of the step at which a function is negative, near the first there is; None if it never is."""
    left = iter(range(MOST_LOOKS))
    return _seen(value, start, end, left)


def _seen(value: Callable[[float], float], a: Look, b: Look, left: Iterator[int]) -> float | None:
    if b.value < 0.0:
        return b.theta
    width = b.theta - a.theta
    change, rise, fall = b.value - a.value, a.after * width, b.before * width
    bend = max(abs(rise - change), abs(fall - change))
    if not (min(a.value, b.value) < bend and bend > 0.5 * abs(change)) or not width > LEAST_PIECE:
        return None
    if next(left, None) is None:
        return None
    half = 0.5 * width
    middle, probe = a.theta + half, PROBE * half
    here, before, after = value(middle), value(middle - probe), value(middle + probe)
    if before < 0.0:
        return middle - probe
    look = Look(middle, here, (here - before) / probe, (after - here) / probe)
    found = _seen(value, a, look, left)
    return _seen(value, look, b, left) if found is None else found
