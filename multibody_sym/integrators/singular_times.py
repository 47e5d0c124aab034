"""When a step passed singular positions, by how independent the rows were within it; `singular.c` is the same in C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final

from multibody_sym.integrators.flow import Step
from multibody_sym.numerics.arrays import Floats

MARGIN: Final = 0.05  # of the largest independence about a step: nothing in it may be nearer to zero than that
LOOKS: Final = 16  # how often the independence is looked at within a step, ...
FEW_LOOKS: Final = 4  # ... if looked at so often it may be zero, ...
STEEPER: Final = 3.0  # ... going so many times as steeply as between any two looks
SEEN: Final = 1.1  # at most, what was seen otherwise is beside the looks
_ROUNDS: Final = 5


def singular_times(
    step: Step, independence: Callable[[float, Floats], float], seen: tuple[float, float]
) -> tuple[float, ...]:
    """Return when a step passes singular positions, in which the least and the largest independence was `seen`.

    Beside one the independence goes down, and up again, in proportion to the distance.
    """

    def at(theta: float) -> float:
        return independence(step.t + theta * step.h, step.value(theta))

    end = (step.t_new - step.t) / step.h
    places = [end * k / LOOKS for k in range(LOOKS + 1)]
    few = {k: at(places[k]) for k in range(0, LOOKS + 1, LOOKS // FEW_LOOKS)}
    if _vanishes_nowhere([*few.values()], seen):
        return ()
    looks = [few[k] if k in few else at(theta) for k, theta in enumerate(places)]
    found = []
    for k, here in enumerate(looks):
        low, high = max(k - 1, 0), min(k + 1, LOOKS)
        if (k == 0 or here < looks[low]) and (k == LOOKS or here <= looks[high]) and _may_vanish(looks, low, high):
            theta, left = _dip(at, (places[low], places[high]), (looks[low], looks[high]))
            if left < 0.5 * min(looks[low], looks[high]) and left < MARGIN * max(looks):
                found.append(step.t + theta * step.h)
    return tuple(found)


def _vanishes_nowhere(looks: Sequence[float], seen: tuple[float, float]) -> bool:
    """Tell whether the independence goes one way all along, as a few looks and all slopes of the step have it."""
    if sorted(looks) not in (looks, looks[::-1]) or any(_may_vanish(looks, k, k + 1) for k in range(len(looks) - 1)):
        return False
    return seen[0] >= min(looks) / SEEN and seen[1] <= max(looks) * SEEN


def _may_vanish(looks: Sequence[float], low: int, high: int) -> bool:
    """Tell whether the independence may be zero between two looks, if it goes about as steeply as it does elsewhere."""
    steepest = max(abs(b - a) for a, b in pairwise(looks))
    return not looks[low] + looks[high] > STEEPER * steepest * (high - low)


def _dip(at: Callable[[float], float], places: tuple[float, float], values: tuple[float, float]) -> tuple[float, float]:
    """Return where between two places a function goes down to zero and up again as steeply, and its value beside it."""
    (low, high), (at_low, at_high) = places, values
    theta = low
    for _ in range(_ROUNDS):
        theta, width = low + (high - low) * (at_low / (at_low + at_high)), 0.125 * (high - low)
        low, high = max(theta - width, places[0]), min(theta + width, places[1])
        at_low, at_high = at(low), at(high)
    return theta, min(at_low, at_high)
