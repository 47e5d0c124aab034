"""The forces of what holds one way only, in the mode of a mechanism, over any scalar."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, reduce
from operator import add

from multibody_sym.expressions.components import AT
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.rows import RowMotion, friction_factors, row_motions
from multibody_sym.model.mechanism.contact_rows import presses_at
from multibody_sym.model.mechanism.every_mode import ModeNodes
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import (
    FRICTION,
    INACTIVE,
    PRESSING,
    STICKS,
    FrictionPart,
    Mode,
    OneWay,
    component_names,
    components_of,
    exerted_by,
)
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import maximum, sqrt, where
from multibody_sym.scalars.node import ONE, ZERO, less
from multibody_sym.scalars.vectors import S, Vec


def mode_of(mechanism: Mechanism) -> Mode:
    """Return the mode that a mechanism is in."""
    return mechanism.mode or Mode({})


def is_active(mechanism: Mechanism, element: OneWay) -> bool:
    """Return whether an element acts: friction in joints always does, and any may `in_every_mode`."""
    if mechanism.mode_numbers or not element.unilateral:
        return True
    return mode_of(mechanism).sides.get(element.name, INACTIVE) != INACTIVE


def slip_of(mechanism: Mechanism, part: FrictionPart) -> int:
    """Return how a part slips: 0 sticks, 1 and -1, 2 in space."""
    return mode_of(mechanism).slips.get(part.name, STICKS)


def rubs(part: FrictionPart) -> bool:
    """Return whether there is friction at all."""
    return part.enough or part.static is not ZERO or part.kinetic is not ZERO


@dataclass(frozen=True, eq=False)
class OneWayForces:
    """The elements of a mechanism in its mode, in motion, with the multipliers (ns) of its rows."""

    motion: Motion
    multipliers: Sequence[S]

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in its mode."""
        return self.motion.mechanism

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {row.name: k for k, row in enumerate(self.mechanism.rows)}

    def multiplier(self, row: str) -> S:
        """Return the multiplier of a row by name, 0 where it does not act."""
        place = self._places.get(row)
        return 0 if place is None else self.multipliers[place]

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
        """Return the friction of a part along its rows (1, or 2 in space).

        What sticks has a row of its own, but for what a mode of rest carries at its limit as if it slid.
        """
        if self.mechanism.mode_numbers:
            return [self.multiplier(row.name) for row in part.rows]
        if slip_of(self.mechanism, part) == STICKS and (self._rests(part) or part.name not in self._carried):
            return [self.multiplier(row.name) for row in part.rows]
        total: list[S] = [0 for _ in part.rows]
        for row in self.mechanism.rows:
            for sliding in row.frictions if isinstance(row, SlidingRow) else ():
                if sliding.rows == part.rows:
                    factors = friction_factors(sliding, [self.rows[x.name] for x in part.rows], self.motion)
                    if part.norm:
                        return [factor * self.pressing(self._element_of(part), part) for factor in factors]
                    force = self.multiplier(row.name)
                    total = [x + factor * force for x, factor in zip(total, factors, strict=True)]
        return total

    def _rests(self, part: FrictionPart) -> bool:
        return any(row.name in self._places for row in part.rows)

    @property
    def _carried(self) -> Mapping[str, int]:
        return mode_of(self.mechanism).carried

    def _element_of(self, part: FrictionPart) -> OneWay:
        return next(element for element in self.mechanism.one_way if part in element.frictions)

    @cached_property
    def rows(self) -> Mapping[str, RowMotion]:
        """The rows of all elements, whether they act or not, by name; those that define forces are left out."""
        motion = self.motion
        every = tuple(_kinematic(self.mechanism))
        whole = replace(motion, mechanism=replace(self.mechanism, rows=every))
        return dict(zip((row.name for row in every), row_motions(whole), strict=True))

    def of(self, element: OneWay) -> dict[str, S]:
        """Return the forces of an element by component: what presses, then friction, of two parts in space."""
        parts = [part for part in element.frictions if rubs(part)]
        found: dict[str, S] = {}
        if element.unilateral:
            found[PRESSING[element.kind]] = self.normal(element)
        elif parts and not parts[0].norm:
            found["normal"] = self.pressing(element, parts[0])
        acts = is_active(self.mechanism, element)
        for part in parts:
            forces = self.friction(part) if acts else [0 for _ in part.rows]
            found |= dict(zip(component_names(element, part), forces, strict=True))
        return found

    def presses_at(self, elements: Iterable[OneWay]) -> list[tuple[S, Vec]]:
        """Return the normal force of each element that acts, and where; nothing where one of them is at no point."""
        acts = [element for element in elements if is_active(self.mechanism, element)]
        found = [(self.normal(x), at) for x in acts if (at := self.place(x)) is not None]
        return found if len(found) == len(acts) else []

    def place(self, element: OneWay) -> Vec | None:
        """Return where a contact's force acts, if it is at a point of a body."""
        point = presses_at(element)
        return None if point is None else position(self.motion, point)

    def middle(self, elements: Sequence[OneWay]) -> dict[str, S]:
        """Return where the sum of normal forces acts, the middle of elements that do not press; nothing without points.

        Normal forces whose sum vanishes as an expression alone have no place, and a division by zero there.
        """
        pairs = self.presses_at(elements)
        if self.mechanism.mode_numbers:
            pairs = self._or_middle([x for x in elements if self.place(x) is not None], pairs)
        elif all(isinstance(force, (int, float)) and force == 0 for force, _ in pairs):
            pairs = [(1, at) for at in map(self.place, elements) if at is not None]
        total: S = reduce(add, (force for force, _ in pairs), 0)
        return {name: reduce(add, (force * at[k] for force, at in pairs)) / total for k, name in enumerate(AT) if pairs}

    def _or_middle(self, elements: Sequence[OneWay], pairs: list[tuple[S, Vec]]) -> list[tuple[S, Vec]]:
        """Return normal forces and places, ones where none of the elements acts."""
        acts = [ModeNodes(self.mechanism).acts(element.normals[0]) for element in elements]
        some = reduce(maximum, acts, ZERO)
        return [(where(less(ZERO, some), force, ONE), at) for force, at in pairs]

    def asked(self, name: str, component: str) -> S:
        """Return a component by the names of `exerted_by`, of a contact's corners together; 0 where there is none."""
        if component in AT:
            return self.middle([x for x in self.mechanism.one_way if name in exerted_by(x)])[component]
        return reduce(add, (self._asked(element, name, component) for element in self.mechanism.one_way), 0)

    def _asked(self, element: OneWay, name: str, component: str) -> S:
        if name not in exerted_by(element):
            return 0
        part = next((x for x in element.frictions if x.name == name and not element.unilateral), None)
        if part is None:
            return self.of(element).get(component, 0)
        if component == PRESSING[element.kind]:
            return self.pressing(element, part)
        return dict(zip(components_of(part, FRICTION), self.friction(part), strict=True))[component]


def _kinematic(mechanism: Mechanism) -> Iterator[Row]:
    for element in mechanism.one_way:
        if element.unilateral:
            yield element.normals[0]
        for part in element.frictions:
            yield from part.rows
