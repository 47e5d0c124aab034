"""What holds one way only, as it is at a solved start: its forces and how it moves, over any scalar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from multibody_sym.dynamics.programs.one_way_forces import OneWayForces, is_active, slip_of
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.model.mechanism.one_way import STICKS, FrictionPart
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import S

_ROUNDING: Final = 1e-10
"""Part of the largest force by which a force may be beyond its limit."""


@dataclass(frozen=True, eq=False)
class Acting(OneWayForces):
    """The elements of a mechanism in its mode at an instant, with their forces and accelerations."""

    udot: Sequence[S]

    @classmethod
    def at(cls, instant: Instant) -> Acting:
        """Return what acts at an instant."""
        return cls(instant.motion, instant.multipliers, instant.udot)

    @property
    def tensions(self) -> Mapping[str, S]:
        """All tensions of ropes, by what they are asked by."""
        return Instant(self.motion, self.udot, self.multipliers).tensions

    @property
    def beyond(self) -> str:
        """What the forces (floats) would do that the mode does not allow, by element; empty where they may be so."""
        least = _ROUNDING * max((abs(float(x)) for x in self.multipliers), default=0.0)
        for element in (x for x in self.mechanism.one_way if is_active(self.mechanism, x)):
            if element.unilateral and float(self.normal(element)) < -least:
                return f"{element.name} would pull" if element.kind != "rope" else f"{element.name} would push"
            for part in element.frictions:
                sticks = not part.enough and slip_of(self.mechanism, part) == STICKS
                if sticks and float(self.room(element, part)) < -least:
                    return f"{part.name} would need more friction than there is"
        return ""

    # --- motion ---------------------------------------------------------------------------------------------------

    def acceleration(self, row: Row) -> S:
        """Return H udot - gamma of a row: how fast it opens or slips faster."""
        moved = self.row(row)
        return sum((h * a for h, a in zip(moved.jacobian, self.udot, strict=True)), -moved.gamma)

    def starting(self, part: FrictionPart) -> S:
        """Return how fast what begins to slide does so faster, the way that it slides."""
        slip, direction = slip_of(self.mechanism, part), self.begins(part)
        rates = [self.acceleration(row) for row in part.rows]
        return sum((d * a for d, a in zip(direction, rates, strict=True)), 0) if direction else slip * rates[0]
