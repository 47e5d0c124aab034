"""How rough is enough in an impact: the least coefficient with which what never slips does not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from multibody_sym.answers.impact.resting import ImpactInstant, length, row_impulses
from multibody_sym.answers.instant import Solved
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.scalars.node import ONE

_NOTHING: Final = 1e-12
"""The part of the largest impulse below which nothing presses."""


def needed_friction(solved: Solved, elements: Sequence[OneWay]) -> Iterator[tuple[str, Value]]:
    """Yield for each part that is rough `enough` the least coefficient that suffices: |p_t| / p_n."""
    largest = max((abs(float(x)) for x in solved.numbers.multipliers), default=0.0)
    for element in elements:
        for part in element.frictions if element.unilateral else ():
            pressing = _pressing(solved.numbers, element, part) if part.enough else 0.0
            if float(pressing) > _NOTHING * largest:
                yield part.name, _least(solved, element, part)


def _pressing(instant: Instant, element: OneWay, part: FrictionPart) -> Any:
    assert isinstance(instant, ImpactInstant)
    return sum(row_impulses(instant, [element.normals[k].name for k in part.normals]), 0)


def _along(instant: Instant, part: FrictionPart) -> list[Any]:
    assert isinstance(instant, ImpactInstant)
    return row_impulses(instant, [row.name for row in part.rows])


def _least(solved: Solved, element: OneWay, part: FrictionPart) -> Value:
    numbers = [float(x) for x in _along(solved.numbers, part)]
    sign = -1 if len(numbers) == 1 and numbers[0] < 0.0 else 1

    def ratio(instant: Instant) -> Mapping[str, Any]:
        along = _along(instant, part)
        (arm,) = instant.motion.state.values([part.arm])
        size = sign * along[0] if len(along) == 1 else length(along)
        return {"": size / (arm * _pressing(instant, element, part))}

    unit = "m" if part.rows[0].unit == "N*m" and part.arm is ONE else ""
    return solved.values(ratio, {"": unit})[""]
