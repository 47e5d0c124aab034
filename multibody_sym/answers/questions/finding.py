"""For which value: the parameter or start value for which an equation between answers holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice, pairwise
from math import isfinite, nan
from typing import Final

import numpy as np
from scipy.optimize import brentq

from multibody_sym.records import dataclass

_FIRST: Final = 0.05
_GROWTH: Final = 1.6
_WIDENED: Final = 14
_PARTS: Final = 24
_HALVINGS: Final = 8
"""How closely the place is looked for from which on a function has no value: a zero may lie before it."""
_MOST: Final = 4
_ACCURACY: Final = 4 * float(np.finfo(float).eps)
_FINE: Final = 1e-13
"""The part of a root to which it is looked for by runs, which are not more accurate."""
_NO_ROOT: Final = 1e-5
"""The part of the values beside it that is left at a change of sign which is a jump, or a pole, and no zero."""


@dataclass(frozen=True)
class Zero:
    """Where a function vanishes, and what is left of it there."""

    at: float
    residual: float


def zeros(
    function: Callable[[float], float], sample: float, bounds: tuple[float, float] | None, *, cheap: bool = False
) -> list[Zero]:
    """Return where a function vanishes: all that a scan between bounds shows, the nearest to the sample first.

    Without bounds the one that is met first on ways out from the sample, to both sides; of a function that is `cheap`
    a few. Where the function is nan, it has no value.
    """
    if bounds is not None:
        edges = [float(x) for x in np.linspace(*bounds, _PARTS + 1)]
        scanned = pairwise([(x, function(x)) for x in edges])
        brackets: Iterator[tuple[Point, Point]] = (_with_values(function, a, b) for a, b in scanned)
    else:
        brackets = _outwards(function, sample)
    fine = _ACCURACY if cheap else _FINE
    met = (zero for pair in brackets if _changes(*pair) and (zero := _zero(function, *pair, fine)) is not None)
    found = islice(met, None if bounds is not None else _MOST if cheap else 1)
    return sorted({zero.at: zero for zero in found}.values(), key=lambda zero: abs(zero.at - sample))


def vanishes_about(
    function: Callable[[float], float], sample: float, bounds: tuple[float, float] | None, little: float
) -> bool:
    """Return whether a function is `little` at the sample, and wherever it has a value among some that lie about it."""
    if not abs(function(sample)) <= little:
        return False
    width = abs(sample) / 2 or 0.5
    low, high = bounds if bounds is not None else (sample - width, sample + width)
    known = [x for part in _ABOUT if isfinite(x := function(low + (high - low) * part))]
    return len(known) >= _ENOUGH and all(abs(x) <= little for x in known)


_ABOUT: Final = (0.0, 0.137, 0.391, 0.618, 0.853, 1.0)
"""Where between bounds a function is looked at that may vanish everywhere."""
_ENOUGH: Final = 4


def reach(sample: float) -> tuple[float, float]:
    """Return the least and the largest value that are tried without bounds."""
    way = _FIRST * (abs(sample) or 1.0) * (_GROWTH**_WIDENED - 1) / (_GROWTH - 1)
    return sample - way, sample + way


Point = tuple[float, float]


def _changes(a: Point, b: Point) -> bool:
    return isfinite(a[1]) and isfinite(b[1]) and (a[1] == 0.0 or a[1] * b[1] < 0.0)


def _outwards(function: Callable[[float], float], sample: float) -> Iterator[tuple[Point, Point]]:
    """Yield the brackets that are met on the way from the sample outwards, to one side and the other in turn."""
    here = (sample, function(sample))
    if here[1] == 0.0:
        yield here, here
    ends = {1.0: here, -1.0: here}
    step = _FIRST * (abs(sample) or 1.0)
    for _ in range(_WIDENED):
        for side, last in tuple(ends.items()):
            x = last[0] + side * step
            ends[side] = (x, function(x))
            bracket = _with_values(function, last, ends[side])
            if _changes(*bracket):
                yield bracket
        step *= _GROWTH


def _with_values(function: Callable[[float], float], a: Point, b: Point) -> tuple[Point, Point]:
    """Return two points; for one without a value, the last on the way there that has one, or another sign."""
    if isfinite(a[1]) == isfinite(b[1]):
        return a, b
    known, without = (a, b[0]) if isfinite(a[1]) else (b, a[0])
    begin = last = known
    for _ in range(_HALVINGS):
        x = (last[0] + without) / 2
        value = function(x)
        if not isfinite(value):
            without = x
            continue
        last = (x, value)
        if _changes(begin, last):
            break
    return (begin, last) if known is a else (last, begin)


def _zero(function: Callable[[float], float], a: Point, b: Point, fine: float) -> Zero | None:
    """Return the zero in a bracket, None where the function jumps there."""
    if a[1] == 0.0:
        return Zero(a[0], 0.0)
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
    return Zero(root, left) if abs(left) <= _NO_ROOT * max(abs(a[1]), abs(b[1])) else None


UNKNOWN: Final = nan
"""The value of a function where it has none."""
