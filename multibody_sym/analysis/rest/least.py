"""The least value of a parameter, a force say, at which rest ends, over all values of another one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf
from typing import Final

from multibody_sym.analysis.rest.position import Position
from multibody_sym.analysis.rest.ranges import Kind, search_of
from multibody_sym.analysis.rest.rest_ends import RestEnd
from multibody_sym.records import dataclass

_SHARP: Final = 1e-10
_LEVEL: Final = 1e-9
_HUGE: Final = 1e300


@dataclass(frozen=True)
class Least:
    """Where rest ends first: the `end` of the parameter `least`, at the value `at` of the parameter `vary`.

    `falls`: that value is the last one that was looked at, and the end still falls there: none is least.
    """

    least: str
    vary: str
    end: RestEnd
    at: float
    kind: Kind
    falls: bool = False


def least_for_motion(position: Position, least: str, vary: str) -> Least | None:
    """Return the least value >= 0 at which rest ends, over the values of another parameter; None where it never ends.

    Of equal ones that whose other parameter is nearest to its declared value.
    """
    search = search_of(position, vary, {least: position.value[least]})
    grid = search.grid(search.kind, search.searched)
    grid = grid if search.kind == "coefficient" else [*grid[:-1:2], grid[-1]]

    def end(x: float) -> RestEnd | None:
        return first_end(position, least, {vary: x})

    looked = [(x, there) for x in grid if (there := end(x)) is not None]
    found = list(_minima(end, looked))
    if not found:
        return None
    lowest = min(end.value for _, end in found)
    level = [pair for pair in found if not _less(lowest, pair[1].value)]
    at, first = min(level, key=lambda pair: abs(pair[0] - position.value[vary]))
    return Least(least, vary, first, at, search.kind, search.kind != "angle" and at in _open_ends(grid, looked))


def first_end(position: Position, least: str, others: dict[str, float]) -> RestEnd | None:
    """Return the end of rest that is reached first from 0 upwards: 0 where there is no rest at 0, infinite for none.

    None where there is no such position.
    """
    search = search_of(position, least, others)
    if all(look is None for look in search.looks):
        return None
    for low, high in search.ranges():
        if low.value <= 0.0 <= high.value:
            is_last = not (high.limits or high.equal) and high.value >= search.searched[1]
            return RestEnd(inf) if is_last else high
    return RestEnd(0.0)


Looked = list[tuple[float, RestEnd]]


def _less(low: float, high: float) -> bool:
    """Return whether a value is less than another one by more than rounding."""
    return high > low + _LEVEL * abs(low)


def _open_ends(grid: Sequence[float], looked: Looked) -> Iterator[float]:
    """Yield the last places looked at in either direction beyond which the end still falls, and there are others.

    Zero itself is a place that nothing is beyond, unless what is looked at begins below.
    """
    for k, others in ((0, grid[:2]), (-1, grid[-1:])):
        here = looked[k][0]
        if here != 0.0 and here in others and _less(looked[k][1].value, looked[(1, -2)[k]][1].value):
            yield here


def _minima(end: Callable[[float], RestEnd | None], looked: Looked) -> Iterator[tuple[float, RestEnd]]:
    """Yield the places and ends of local minima, sharpened between their neighbours."""
    from scipy.optimize import minimize_scalar

    last = len(looked) - 1
    for k, (x, here) in enumerate(looked):
        (low, before), (high, after) = looked[max(k - 1, 0)], looked[min(k + 1, last)]
        beside = before.value, after.value
        if here.value == inf or _less(min(beside), here.value):
            continue
        if here.value == 0.0 or not _less(here.value, max(beside)):  # nothing is less, or all is level
            yield x, here
            continue

        def value(y: float) -> float:
            there = end(float(y))
            return _HUGE if there is None else min(there.value, _HUGE)

        options = {"xatol": _SHARP * max(abs(low), abs(high))}
        sharp = minimize_scalar(value, bounds=(low, high), method="bounded", options=options)
        there = end(float(sharp.x))
        yield (float(sharp.x), there) if there is not None and there.value < here.value else (x, here)
