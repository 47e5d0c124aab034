"""How rough is enough in an impact: the least coefficient with which what never slips does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from multibody_sym.answers.impact.resting import ImpactInstant, pressing, row_impulses
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.states import least_coefficient
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.scalars.vectors import S


def needed_friction(solved: Solved, elements: Sequence[OneWay]) -> Iterator[tuple[str, Value]]:
    """Yield for each part that is rough `enough` the least coefficient that suffices: |p_t| / p_n."""
    for element in elements:
        for part in element.frictions if element.unilateral else ():

            def impulses(instant: Instant, element: OneWay = element, part: FrictionPart = part) -> tuple[S, list[S]]:
                assert isinstance(instant, ImpactInstant)
                return pressing(instant, element, part, {}), row_impulses(instant, [row.name for row in part.rows])

            yield from least_coefficient(solved, part, impulses)
