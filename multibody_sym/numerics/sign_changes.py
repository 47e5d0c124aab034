"""Where a function of one variable changes its sign: looks at it until it is certain to keep one.

A function that has one sign at both ends of a piece, and changes at rates known there, is certain to keep it if its
rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way. A
piece of which neither is true is halved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Final

from multibody_sym.records import dataclass

PROBE: Final = 2.0**-10  # part of a piece over which rates at its ends are measured
LEAST_PROBE: Final = 2.0**-18  # part of a step over which rates within it are measured at least, ...
NEAR: Final = 2.0**-5  # ... and of half a piece over which at most: rounding must not say what they are
LEAST_PIECE: Final = 2.0**-40  # part of a step that is not halved any more
MOST_LOOKS: Final = 1000  # halvings in a step for one function, which is zero but for round-off if they do not suffice
PIECES: Final = 64  # of a time, in which zeros are looked for

Function = Callable[[float], float]


@dataclass(frozen=True)
class Look:
    """A function's value at theta, a part of the step, and its rates before and after it."""

    theta: float
    value: float
    before: float
    after: float


def first_seen(value: Callable[[float], float], start: Look, end: Look, unseen: float = 0.0) -> float | None:
    """Return a part of the step at which a function is negative, near the first there is; None if it never is.

    What is no farther than `unseen` from zero all along a piece is zero there but for round-off.
    """
    left = iter(range(MOST_LOOKS))
    return _seen(value, start, end, unseen, left)


def _seen(value: Callable[[float], float], a: Look, b: Look, unseen: float, left: Iterator[int]) -> float | None:
    if b.value < 0.0:
        return b.theta
    width = b.theta - a.theta
    change, rise, fall = b.value - a.value, a.after * width, b.before * width
    bend = max(abs(rise - change), abs(fall - change))
    if a.value <= unseen and b.value <= unseen and bend <= unseen:
        return None
    if not (min(a.value, b.value) < bend and bend > 0.5 * abs(change)) or not width > LEAST_PIECE:
        return None
    if next(left, None) is None:
        return None
    half = 0.5 * width
    middle, probe = a.theta + half, max(PROBE * half, min(NEAR * half, LEAST_PROBE))
    here, before, after = value(middle), value(middle - probe), value(middle + probe)
    if before < 0.0:
        return middle - probe
    look = Look(middle, here, (here - before) / probe, (after - here) / probe)
    found = _seen(value, a, look, unseen, left)
    return _seen(value, look, b, unseen, left) if found is None else found


def looks_at_ends(value: Callable[[float], float], start: float, end: float) -> tuple[Look, Look]:
    """Return the looks at the ends of a step, where a function of its parts has the values `start` and `end`."""
    rise, fall = (value(PROBE) - start) / PROBE, (end - value(1.0 - PROBE)) / PROBE
    return Look(0.0, start, rise, rise), Look(1.0, end, fall, fall)


def zeros(g: Function, t_end: float) -> Iterator[float]:
    """Yield the times in (0, t_end) at which g changes its sign, in their order."""
    side = 0.0
    for start, end in pairwise([t_end * k / PIECES for k in range(PIECES + 1)]):
        while start < end:
            side = side or _sign(g(start)) or _sign(g(start + PROBE * (end - start)))
            high = _other_side(g, side, start, end)
            if high is None:
                break
            low = start
            while low < (middle := 0.5 * (low + high)) < high:
                low, high = (low, middle) if side * g(middle) < 0.0 else (middle, high)
            if 0.0 < low < t_end:
                yield high
            start, side = high, -side


def _other_side(g: Function, side: float, start: float, end: float) -> float | None:
    """Return a time in [start, end] at which g is seen on the other side of zero; None if it never is."""
    width = end - start

    def value(theta: float) -> float:
        return side * g(start + theta * width)

    theta = first_seen(value, *looks_at_ends(value, max(value(0.0), 0.0), value(1.0)))
    return None if theta is None else start + theta * width


def _sign(value: float) -> float:
    return float((value > 0.0) - (value < 0.0))
