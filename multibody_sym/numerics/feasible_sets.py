"""For which values of a parameter linear conditions that depend on it can hold together: all intervals, exact ends.

Where conditions contradict each other at one value, the same few rows do so around it, up to where their weights change
sign or their contradiction vanishes: a root of one function. So a contradiction excludes an interval, the next value is
looked at where it ends, and an end of what is possible is such a root, found to the last bits, with the rows that give
way there. An interval of possible values within one step of the search is found too, single values included; a gap
within one step is not, nor a single value where a contradiction vanishes and comes back as it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.numerics.feasibility import Conditions, Contradiction, contradiction
from multibody_sym.records import dataclass

_MOST: Final = 60
"""How many contradictions may follow each other in one step of the search."""
_LOOKS: Final = 2
_ASIDE: Final = 1e-3
"""The part of a step by which a value is left at which more rows depend on each other than around it."""
_HALVED: Final = 1e-17
"""The part of a step to which it is halved, where no rounding ends this before."""
_ONE: Final = 1e-12
"""The part of their size up to which two ends are one value."""

ConditionsAt = Callable[[float], Conditions | None]
"""The conditions at a value of the parameter; None where they are not defined."""


@dataclass(frozen=True)
class End:
    """An end of an interval: its value, and what contradicts beyond it; None at the end of the search."""

    value: float
    gives_way: Contradiction | None = None


@dataclass(frozen=True)
class Interval:
    """Values from one end to the other, both included; a single value has two equal ends."""

    low: End
    high: End


def feasible_set(conditions: ConditionsAt, grid: Sequence[float]) -> list[Interval]:
    """Return the intervals within a grid (ascending) at whose values the conditions hold together, in their order."""
    return list(_Search(conditions).intervals(sorted(set(map(float, grid)))))


@dataclass(frozen=True)
class _Looked:
    """A value, whether its conditions hold together there, and what contradicts, if it is known."""

    value: float
    possible: bool
    against: Contradiction | None = None


@dataclass(frozen=True)
class _Search:
    conditions: ConditionsAt

    def look(self, value: float) -> _Looked:
        found = self.conditions(value)
        if found is None:
            return _Looked(value, False)
        against = contradiction(found)
        return _Looked(value, against is None, against)

    def intervals(self, grid: Sequence[float]) -> Iterator[Interval]:
        looks = [self.look(value) for value in grid]
        low = End(grid[0]) if looks[0].possible else None
        for a, b in pairwise(looks):
            if a.possible and not b.possible:
                assert low is not None
                yield Interval(low, self.edge(b, a.value))
                low = None
            elif b.possible and not a.possible:
                low = self.edge(a, b.value)
            elif not (a.possible or b.possible):
                yield from self.between(a, b)
        if low is not None:
            yield Interval(low, End(grid[-1]))

    def between(self, a: _Looked, b: _Looked) -> Iterator[Interval]:
        """Yield the interval of possible values between two that are not, if one is met."""
        if a.against is None or b.against is None:
            return
        low = self.reached(a, b.value)
        if low is not None:
            high = self.reached(b, low.value)
            yield Interval(low, End(low.value, b.against) if high is None or _is_one(low.value, high.value) else high)

    def edge(self, look: _Looked, goal: float) -> End:
        """Return the end between a value that is not possible and a goal that is, if only just."""
        end, last = self.walked(look, goal)
        if end is not None:
            return end
        there = self.conditions(goal)
        if last.against is not None and there is not None and last.against.excess(there) >= 0.0:
            return End(goal, last.against)
        return self.halved(look, goal)

    def reached(self, look: _Looked, goal: float) -> End | None:
        """Return the first possible value on the way from one that is not to the goal; None if none is met."""
        return self.walked(look, goal)[0]

    def walked(self, look: _Looked, goal: float) -> tuple[End | None, _Looked]:
        """Return the same, and the last value on the way that is not possible."""
        for _ in range(_MOST):
            value = None if look.against is None else self.lapses(look, goal)
            if value is None:
                break
            there = self.look(value)
            if there.possible:
                return End(value, look.against), look
            look = self.look(value + _ASIDE * (goal - value)) if value == look.value else there
            if look.possible:  # what contradicts at one value only
                return self.halved(there, look.value), there
        return None, look

    def lapses(self, look: _Looked, goal: float) -> float | None:
        """Return the value at which what contradicts at one value ceases to do so; None if it does up to the goal."""
        from scipy.optimize import brentq

        against = look.against
        assert against is not None

        def excess(value: float) -> float:
            found = self.conditions(value)
            return float("nan") if found is None else against.excess(found)

        last = look.value
        for value in np.linspace(look.value, goal, _LOOKS + 1)[1:].tolist():
            there = excess(value)
            if not there > 0.0:
                if there != there or not excess(last) > 0.0:
                    return last
                return float(brentq(excess, last, value, xtol=1e-300, rtol=8.9e-16, maxiter=200))
            last = value
        return None

    def halved(self, look: _Looked, goal: float) -> End:
        """Return the end between a value that is not possible and one that is, by halving; the first where all are."""
        first, low, high = look, look.value, goal
        step = abs(goal - low)
        while abs(high - low) > _HALVED * step and min(low, high) < (middle := 0.5 * (low + high)) < max(low, high):
            there = self.look(middle)
            low, high = (low, middle) if there.possible else (middle, high)
            look = look if there.possible else there
        if abs(high - first.value) <= _ONE * step:
            return End(first.value, first.against)
        return End(high, look.against)


def _is_one(a: float, b: float) -> bool:
    return abs(a - b) <= _ONE * max(abs(a), abs(b))
