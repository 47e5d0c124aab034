"""Ends of ranges in which rest is possible, and ranges put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from math import pi
from typing import Final

from multibody_sym.analysis.rest.statics import Choice, RestLimit
from multibody_sym.records import dataclass

_ONE: Final = 1e-12


@dataclass(frozen=True)
class RestEnd:
    """An end of a range: its value, infinite where there is none, and what gives way beyond it.

    `equal` and `limits` are the conditions that contradict each other beyond: places of the equations of balance, and
    limits, each with its share in this, with this `choice` of what presses. All are empty where the search ends, or
    what the parameter may be. `on_circles`: limits are friction's circles themselves, not tangents near them.
    """

    value: float
    equal: tuple[int, ...] = ()
    limits: tuple[RestLimit, ...] = ()
    choice: Choice = field(default_factory=Choice)
    shares: tuple[float, ...] = ()
    on_circles: bool = False


Range = tuple[RestEnd, RestEnd]


def united(ranges: Sequence[Range]) -> list[Range]:
    """Return ranges that overlap or touch as one, ascending."""
    found: list[Range] = []
    for low, high in sorted(ranges, key=lambda each: each[0].value):
        if found and low.value <= found[-1][1].value + _ONE * abs(low.value):
            if high.value > found[-1][1].value:
                found[-1] = (found[-1][0], high)
        else:
            found.append((low, high))
    return found


def about_pi(ranges: Sequence[Range]) -> Sequence[Range]:
    """Return ranges of an angle with the two halves of the one about pi as one, past pi."""
    if len(ranges) < 2:
        return ranges
    (first, end), (begin, last) = ranges[0], ranges[-1]
    if first.value > -pi or last.value < pi or begin.value == last.value:
        return ranges
    return [*ranges[1:-1], (begin, replace(end, value=end.value + 2 * pi))]


def turn_with(ranges: Sequence[Range]) -> tuple[float, float]:
    """Return the turn that has all ranges of an angle within: from -pi to pi, or up to the end of the one about pi."""
    last = max((high.value for _, high in ranges), default=pi)
    return (last - 2 * pi, last) if last > pi else (-pi, pi)
