"""The least values of a parameter, a force say, that hold and that end rest, over all values of another one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf
from typing import Final, Literal

from multibody_sym.analysis.rest.position import Position
from multibody_sym.analysis.rest.ranges import Kind, search_of
from multibody_sym.analysis.rest.rest_ends import Range, RestEnd
from multibody_sym.errors import NoSolutionError
from multibody_sym.records import dataclass

_SHARP: Final = 1e-10
_LEVEL: Final = 1e-9
_HUGE: Final = 1e100


@dataclass(frozen=True)
class Least:
    """The least `end` over the values of the parameter `vary`, at its value `at`, of ranges of rest of `least`.

    `side`: 0 for the ends from which on it holds, 1 for those at which rest ends. `falls`: that value is the last one
    that was looked at, and the end still falls there: none is least.
    """

    least: str
    vary: str
    side: Literal[0, 1]
    end: RestEnd
    at: float
    kind: Kind
    falls: bool = False


def least_ends(position: Position, least: str, vary: str) -> tuple[Least | None, Least | None]:
    """Return the least value >= 0 that holds and the least one that ends rest, over the values of another parameter.

    The first is None where 0 holds at each value at which there is rest, the second where rest never ends. Of equal
    ones that whose other parameter is nearest to its declared value. Raises NoSolutionError where nothing holds.
    """
    search = search_of(position, vary, {least: position.value[least]})
    grid = search.grid(search.kind, search.searched)
    grid = grid if search.kind == "coefficient" else [*grid[:-1:2], grid[-1]]
    known: dict[float, Range | None] = {}

    def range_at(x: float) -> Range | None:
        if x not in known:
            known[x] = first_range(position, least, {vary: x})
        return known[x]

    looked = [there for x in grid if (there := range_at(x)) is not None]
    if not looked:
        raise NoSolutionError(f"rest is possible at no {least} >= 0, whatever {vary} is", number="N110")

    def lowest(side: Literal[0, 1]) -> Least | None:
        def end(x: float) -> RestEnd | None:
            there = range_at(x)
            return None if there is None else there[side]

        found = list(_minima(end, grid))
        if not found:
            return None
        low = min(end.value for _, end in found)
        level = [pair for pair in found if not _less(low, pair[1].value)]
        at, first = min(level, key=lambda pair: abs(pair[0] - position.value[vary]))
        return Least(least, vary, side, first, at, search.kind, search.kind != "angle" and _falls(grid, end, at))

    return None if all(low.value == 0.0 for low, _ in looked) else lowest(0), lowest(1)


def first_range(position: Position, least: str, others: dict[str, float]) -> Range | None:
    """Return the first range of rest from 0 upwards: from 0 itself where it holds, to infinity where rest never ends.

    None where there is no such position, or no rest.
    """
    search = search_of(position, least, others)
    if all(look is None for look in search.looks) or not position.has_start(others):
        return None
    for low, high in search.ranges():
        if high.value > 0.0 or (high.value == 0.0 and search.has_start(0.0)):
            is_last = not (high.limits or high.equal) and high.value >= search.searched[1]
            return low if low.value > 0.0 else RestEnd(0.0), RestEnd(inf) if is_last else high
    return None


Ends = Callable[[float], RestEnd | None]


def _less(low: float, high: float) -> bool:
    """Return whether a value is less than another one by more than rounding."""
    return high > low + _LEVEL * abs(low)


def _value(end: RestEnd | None) -> float:
    """Return the value of an end, infinite where there is no rest."""
    return inf if end is None else end.value


def _falls(grid: Sequence[float], end: Ends, at: float) -> bool:
    """Return whether a place is the last one looked at in a direction, and the end still falls there.

    Zero itself is a place that nothing is beyond, unless what is looked at begins below.
    """
    for inward, last in ((1, grid[:2]), (-1, grid[-1:])):
        here = next((x for x in last if end(x) is not None), 0.0)
        if at == here != 0.0 and _less(_value(end(here)), _value(end(grid[grid.index(here) + inward]))):
            return True
    return False


def _minima(end: Ends, grid: Sequence[float]) -> Iterator[tuple[float, RestEnd]]:
    """Yield the places and ends of local minima, sharpened between their neighbours."""
    from scipy.optimize import minimize_scalar

    for k, x in enumerate(grid):
        here, low, high = end(x), grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
        beside = [_value(end(y)) for y in (low, high)]
        if here is None or here.value == inf or _less(min(beside), here.value):
            continue
        if here.value == 0.0 or not _less(here.value, max(beside)):  # nothing is less, or all is level
            yield x, here
            continue
        options = {"xatol": _SHARP * max(abs(low), abs(high))}
        sharp = minimize_scalar(
            lambda y: min(_value(end(float(y))), _HUGE), bounds=(low, high), method="bounded", options=options
        )
        there = end(float(sharp.x))
        yield (float(sharp.x), there) if there is not None and there.value < here.value else (x, here)
