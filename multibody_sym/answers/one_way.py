"""What holds one way only, as it is at a solved start: its forces and how it moves, over any scalar."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.rows import RowMotion, friction_factors, row_motions
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import (
    INACTIVE,
    STICKS,
    FrictionPart,
    Mode,
    OneWay,
)
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import S, Vec


def mode_of(mechanism: Mechanism) -> Mode:
    """Return the mode that a mechanism is in."""
    return mechanism.mode or Mode({})


def is_active(mechanism: Mechanism, element: OneWay) -> bool:
    """Return whether an element acts: friction in joints always does."""
    return not element.unilateral or mode_of(mechanism).sides.get(element.name, INACTIVE) != INACTIVE


def slip_of(mechanism: Mechanism, part: FrictionPart) -> int:
    """Return how a part slips: 0 sticks, 1 and -1, 2 in space."""
    return mode_of(mechanism).slips.get(part.name, STICKS)


def rubs(part: FrictionPart) -> bool:
    """Return whether there is friction at all."""
    return part.enough or part.static is not ZERO or part.kinetic is not ZERO


# --- forces --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Acting:
    """The elements of a mechanism in its mode at an instant, and their forces."""

    instant: Instant

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in its mode."""
        return self.instant.motion.mechanism

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {row.name: k for k, row in enumerate(self.mechanism.rows)}

    def multiplier(self, row: str) -> S:
        """Return the multiplier of a row by name, 0 where it does not act."""
        place = self._places.get(row)
        return 0 if place is None else self.instant.multipliers[place]

    def normal(self, element: OneWay) -> S:
        """Return the force with which an element presses, pulls or stops."""
        return self.multiplier(element.normals[0].name)

    def pressing(self, element: OneWay, part: FrictionPart) -> S:
        """Return N of a part's friction law, for normal forces with the signs that they have in the mode."""
        sides = mode_of(self.mechanism).sides
        components = [self.multiplier(element.normals[k].name) for k in part.normals]
        if part.norm and sum(x is not ZERO for x in components) > 1:
            return sqrt(sum(x * x for x in components))
        total: S = 0
        for k in part.normals:
            name = element.normals[k].name
            side = 1 if element.unilateral else sides.get(name, sides.get(element.name, 1))
            total = total + (self.multiplier(name) if side >= 0 else -self.multiplier(name))
        return total

    def friction(self, part: FrictionPart) -> list[S]:
        """Return the friction of a part along its rows (1, or 2 in space)."""
        if slip_of(self.mechanism, part) == STICKS:
            return [self.multiplier(row.name) for row in part.rows]
        total: list[S] = [0 for _ in part.rows]
        for row in self.mechanism.rows:
            for sliding in row.frictions if isinstance(row, SlidingRow) else ():
                if sliding.rows == part.rows:
                    factors = friction_factors(sliding, [self.rows[x.name] for x in part.rows], self.instant.motion)
                    if part.norm:
                        return [factor * self.pressing(self._element_of(part), part) for factor in factors]
                    force = self.multiplier(row.name)
                    total = [x + factor * force for x, factor in zip(total, factors, strict=True)]
        return total

    def _element_of(self, part: FrictionPart) -> OneWay:
        return next(element for element in self.mechanism.one_way if part in element.frictions)

    def begins(self, part: FrictionPart) -> list[S]:
        """Return the direction along a part's rows in which it begins to slide in space; nothing for others."""
        for row in self.mechanism.rows:
            for sliding in row.frictions if isinstance(row, SlidingRow) else ():
                if sliding.rows == part.rows and sliding.starts is not None:
                    return self.instant.motion.state.values(sliding.starts)
        return []

    # --- motion ---------------------------------------------------------------------------------------------------

    @cached_property
    def rows(self) -> Mapping[str, RowMotion]:
        """The rows of all elements, whether they act or not, by name; those that define forces are left out."""
        motion = self.instant.motion
        every = tuple(_kinematic(self.mechanism))
        whole = replace(motion, mechanism=replace(self.mechanism, rows=every))
        return dict(zip((row.name for row in every), row_motions(whole), strict=True))

    def acceleration(self, row: str) -> S:
        """Return H udot - gamma of a row: how fast it opens or slips faster."""
        moved = self.rows[row]
        return sum((h * a for h, a in zip(moved.jacobian, self.instant.udot, strict=True)), -moved.gamma)

    def starting(self, part: FrictionPart) -> S:
        """Return how fast what begins to slide does so faster, the way that it slides."""
        slip, direction = slip_of(self.mechanism, part), self.begins(part)
        rates = [self.acceleration(row.name) for row in part.rows]
        return sum((d * a for d, a in zip(direction, rates, strict=True)), 0) if direction else slip * rates[0]

    def place(self, element: OneWay) -> Vec | None:
        """Return where a contact's force acts, if it is at a point of a body."""
        row = element.normals[0]
        if not isinstance(row, ContactRow):
            return None
        points = [skin.place for skin in row.skins if getattr(skin, "radius", None) is ZERO]
        return position(self.instant.motion, points[0]) if points else None


def _kinematic(mechanism: Mechanism) -> Iterator[Row]:
    for element in mechanism.one_way:
        if element.unilateral:
            yield element.normals[0]
        for part in element.frictions:
            yield from part.rows
