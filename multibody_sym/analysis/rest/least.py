"""The least value of a parameter, a force say, at which rest ends, over all values of another one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf
from typing import Final

from multibody_sym.analysis.rest.position import Position
from multibody_sym.analysis.rest.ranges import Kind, ranges_of_rest, search_of
from multibody_sym.analysis.rest.rest_ends import RestEnd
from multibody_sym.records import dataclass

_SHARP: Final = 1e-10
_LEVEL: Final = 1e-9
_HUGE: Final = 1e300


@dataclass(frozen=True)
class Least:
    """Where rest ends first: the `end` of the parameter `least`, at the value `at` of the parameter `vary`."""

    least: str
    vary: str
    end: RestEnd
    at: float
    kind: Kind


def least_for_motion(position: Position, least: str, vary: str) -> Least | None:
    """Return the least value >= 0 at which rest ends, over the values of another parameter; None where it never ends.

    Of equal ones that whose other parameter is nearest to its declared value.
    """
    search = search_of(position, vary, {least: position.value[least]})
    grid = search.grid(search.kind, search.searched)

    def end(x: float) -> RestEnd:
        return first_end(position, least, {vary: x})

    found = list(_minima(end, grid[:: 2 if search.kind == "angle" else 1]))
    if not found:
        return None
    lowest = min(end.value for _, end in found)
    level = [pair for pair in found if pair[1].value <= lowest + _LEVEL * abs(lowest)]
    at, first = min(level, key=lambda pair: abs(pair[0] - position.value[vary]))
    return Least(least, vary, first, at, search.kind)


def first_end(position: Position, least: str, others: dict[str, float]) -> RestEnd:
    """Return the end of rest that is reached first from 0 upwards: 0 where there is no rest at 0, infinite for none."""
    for low, high in ranges_of_rest(position, least, others).ranges:
        if low.value <= 0.0 <= high.value:
            return high
    return RestEnd(0.0)


def _minima(end: Callable[[float], RestEnd], grid: Sequence[float]) -> Iterator[tuple[float, RestEnd]]:
    """Yield the places and ends of local minima, sharpened between their neighbours."""
    from scipy.optimize import minimize_scalar

    ends = [end(x) for x in grid]
    values = [x.value for x in ends]
    for k, (x, here) in enumerate(zip(grid, ends, strict=True)):
        beside = values[max(k - 1, 0)], values[min(k + 1, len(grid) - 1)]
        if here.value == inf or here.value > min(beside):
            continue
        if here.value == 0.0:  # no value is less: where nothing holds, all places are alike
            yield x, here
            continue
        bounds = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
        options = {"xatol": _SHARP * max(map(abs, bounds))}
        sharp = minimize_scalar(
            lambda y: min(end(float(y)).value, _HUGE), bounds=bounds, method="bounded", options=options
        )
        there = end(float(sharp.x))
        yield (float(sharp.x), there) if there.value < here.value else (x, here)
