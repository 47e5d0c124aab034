"""Zeros of functions that may have no value in places, and ranges in which they vanish, by their values alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from math import copysign, inf, isfinite, log2, nan
from typing import Final

import numpy as np

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
_NOTHING: Final = 1e-10
"""The part of the largest value met that is zero to rounding, where a function vanishes over a whole range."""
_ROUNDING: Final = 1e-2
"""The part of that which runs leave of what vanishes, beside places where it is exactly zero."""
_RISE: Final = 1e3
"""How many times what is left in such a range a value beside it is at least."""
_BESIDE: Final = 0.1
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
    `noise`: the part of the function's value that is none. `fine`: to which part of it the place was looked for.
    """

    at: float
    residual: float
    through: float | None = None
    noise: float = 0.0
    fine: float = 0.0
    other: Zero | None = None

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
) -> list[Zero]:
    """Return where a function vanishes: all that a scan between bounds shows, the nearest to the sample first.

    Without bounds the one that is met first on ways out from the sample, to both sides up to `limits`; of a function
    that is `cheap` a few. Where the function is nan, it has no value. Of a range in which it vanishes everywhere, the
    end is returned, of two ends the upper one. `size`: how large the terms are that cancel where it vanishes.
    """
    if bounds is not None:
        points = [(x, function(x)) for x in map(float, np.linspace(*bounds, _PARTS + 1))]
        brackets = (_with_values(function, a, b) for a, b in pairwise(points))
        walk: Iterator[_Seen] = (_Seen(a, b, points, size) for a, b in brackets)
    else:
        walk = _outwards(function, sample, size, limits)
    fine = _ACCURACY if cheap else _FINE
    met = (zero for seen in walk if (zero := _edge(function, seen) or _zero(function, seen, fine)) is not None)
    found = list(islice(met, None if bounds is not None else _MOST if cheap else 1))
    if found and bounds is None and found[-1].through is not None:  # the other end of the range too
        found += islice(met, 1)
    return _apart(sorted({zero.at: zero for zero in found}.values(), key=lambda zero: abs(zero.at - sample)))


def _apart(found: list[Zero]) -> list[Zero]:
    """Return zeros without those that lie in a range in which all are, of whose two ends the upper is kept."""
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
    way = _FIRST * (abs(sample) or 1.0) * (_GROWTH**_WIDENED - 1) / (_GROWTH - 1)
    return max(sample - way, limits[0]), min(sample + way, limits[1])


def _changes(a: Point, b: Point) -> bool:
    return isfinite(a[1]) and isfinite(b[1]) and (a[1] == 0.0 or a[1] * b[1] < 0.0)


@dataclass(frozen=True)
class _Seen:
    """A bracket among the points at which a function of so large terms was looked at, in their order."""

    a: Point
    b: Point
    points: Sequence[Point]
    size: float

    @property
    def little(self) -> float:
        """What is zero to rounding."""
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
    step = _FIRST * (abs(sample) or 1.0)
    for k in range(_WIDENED):
        before = ends
        ways = {side: min(max(last[0] + side * step, low), high) for side, last in before.items()}
        ends = {side: (x, function(x)) for side, x in ways.items() if x != before[side][0]}
        points += ends.values()
        if k == 0 and here[1] == 0.0 and all(not abs(y) <= _NOTHING * size for _, y in ends.values()):
            yield _Seen(here, here, points, size)
        for side, end in ends.items():
            yield _Seen(*_with_values(function, before[side], end), tuple(sorted(points)), size)
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


def _edge(function: Callable[[float], float], seen: _Seen) -> Zero | None:
    """Return the end of a range in which a function vanishes, to rounding, None where none ends in a bracket.

    It vanishes at one end of the bracket, and on from there as well: that tells a range from a zero that was hit.
    """
    zero, other = sorted((seen.a, seen.b), key=lambda x: abs(x[1]))
    if not (isfinite(zero[1]) and isfinite(other[1]) and abs(zero[1]) <= seen.little < abs(other[1])):
        return None
    through = seen.through(zero, other)
    way = _BESIDE * (zero[0] - other[0]) if through != zero[0] else _BESIDE * (other[0] - zero[0])
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
