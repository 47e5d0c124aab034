"""What holds one way only, as it is at a solved start: its forces and how it moves, over any scalar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from multibody_sym.dynamics.programs.one_way_forces import OneWayForces
from multibody_sym.dynamics.programs.quantities import Instant
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
        for limit in self.mode_limits:
            if limit.kind in ("force", "cone") and float(self.value(limit, self.acceleration)) < -least:
                if limit.part is not None:
                    return f"{limit.part.name} would need more friction than there is"
                return f"{limit.element.name} would {'push' if limit.element.kind == 'rope' else 'pull'}"
        return ""

    # --- motion ---------------------------------------------------------------------------------------------------

    def acceleration(self, row: Row) -> S:
        """Return H udot - gamma of a row: how fast it opens or slips faster."""
        moved = self.row(row)
        return sum((h * a for h, a in zip(moved.jacobian, self.udot, strict=True)), -moved.gamma)
