"""The forces of what holds one way only, in the mode of a mechanism, over any scalar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, reduce
from operator import add

from multibody_sym.expressions.components import AT
from multibody_sym.kinematics.contacts import touch
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.rows import RowMotion, coefficients, friction_factors, row_motion
from multibody_sym.model.mechanism.contact_rows import ContactRow, is_point
from multibody_sym.model.mechanism.every_mode import ModeNodes
from multibody_sym.model.mechanism.limits import Limit, limits_in
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import (
    ACTIVE,
    FRICTION,
    PRESSING,
    FrictionPart,
    Mode,
    OneWay,
    component_names,
    components_of,
    exerted_by,
)
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.functions import maximum, where
from multibody_sym.scalars.node import ONE, ZERO, Node, less
from multibody_sym.scalars.vectors import S, Vec


def mode_of(mechanism: Mechanism) -> Mode:
    """Return the mode that a mechanism is in."""
    return mechanism.mode or Mode({})


def is_active(mechanism: Mechanism, element: OneWay) -> bool:
    """Return whether an element acts: friction in joints always does, and any may `in_every_mode`."""
    if mechanism.mode_numbers or not element.unilateral:
        return True
    return mode_of(mechanism).acts(element)


@dataclass(frozen=True, eq=False)
class OneWayForces:
    """The elements of a mechanism in its mode, in motion, with the multipliers (ns) of its rows."""

    motion: Motion
    multipliers: Sequence[S]

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in its mode."""
        return self.motion.mechanism

    @property
    def mode(self) -> Mode:
        """That mode."""
        return mode_of(self.mechanism)

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
        normals = element.normals_of(part)
        forces = [self.multiplier(row.name) for row in normals]
        in_programs = self.mechanism.mode_numbers and any(isinstance(x, Node) for x in forces)  # numbers have a mode
        side = ModeNodes(self.mechanism).side if in_programs and not part.norm else self.side
        return limits.pressing(forces, [side(element, row) for row in normals], norm=part.norm)

    def side(self, element: OneWay, normal: Row) -> int:
        """Return the sign with which the force of a normal row counts."""
        return ACTIVE if element.unilateral else self.mode.side(element, normal) or ACTIVE

    def friction(self, part: FrictionPart) -> list[S]:
        """Return the friction of a part along its rows (1, or 2 in space).

        What does not slide, nor exerts its limit as if it did, has rows of its own.
        """
        found = list(self.slidings(part))
        if not found:
            return [self.multiplier(row.name) for row in part.rows]
        total: list[S] = [0 for _ in part.rows]
        for name, sliding in found:
            factors = friction_factors(sliding, [self.row(x) for x in part.rows], self.motion)
            if part.norm:
                return [factor * self.pressing(self._element_of(part), part) for factor in factors]
            force = self.multiplier(name)
            total = [x + factor * force for x, factor in zip(total, factors, strict=True)]
        return total

    def most(self, element: OneWay, part: FrictionPart) -> S:
        """Return how large the friction of a part can be while it sticks."""
        return limits.most(self._static(part), self.pressing(element, part))

    def room(self, element: OneWay, part: FrictionPart) -> S:
        """Return by how much the friction of a part is below that, negative beyond it."""
        return limits.room(self._static(part), self.pressing(element, part), self.friction(part))

    @property
    def mode_limits(self) -> Iterator[Limit]:
        """The limits of all elements in the mode."""
        for element in self.mechanism.one_way:
            yield from limits_in(self.mode, element)

    def value(self, limit: Limit, rate: Callable[[Row], S]) -> S:
        """Return what must not be negative, where rows move at a `rate`."""
        element, part = limit.element, limit.part
        if part is not None:
            return self.room(element, part) if limit.kind == "cone" else self.forward(part, rate)
        normal = element.normals[limit.normal]
        if limit.kind == "gap":
            return rate(normal)
        force = self.multiplier(normal.name)
        return force if limit.kind == "force" else limits.towards(self.mode.side(element, normal), force)

    def forward(self, part: FrictionPart, rate: Callable[[Row], S]) -> S:
        """Return how fast a part slips the way that it does, or begins to in space, where rows move at a `rate`."""
        return limits.along(self.begins(part) or [self.mode.slip(part)], [rate(row) for row in part.rows])

    def begins(self, part: FrictionPart) -> list[S]:
        """Return the direction along a part's rows in which it begins to slide in space; nothing for others."""
        starts = next((sliding.starts for _, sliding in self.slidings(part)), None)
        return [] if starts is None else self.motion.state.values(starts)

    def tension_ratio(self, part: FrictionPart) -> S:
        """Return how many times one tension of a rope on a rough wheel the other one can be."""
        return limits.tension_ratio(self._static(part))

    def _static(self, part: FrictionPart) -> S:
        return coefficients(self.motion, part.rows, [part.static])[0]

    def slidings(self, part: FrictionPart) -> Iterator[tuple[str, Sliding]]:
        """Yield how a part slides, with the name of each row whose multiplier it follows."""
        for row in self.mechanism.rows:
            for sliding in row.frictions if isinstance(row, SlidingRow) else ():
                if sliding.rows == part.rows:
                    yield row.name, sliding

    def _element_of(self, part: FrictionPart) -> OneWay:
        return next(element for element in self.mechanism.one_way if part in element.frictions)

    def row(self, row: Row) -> RowMotion:
        """Return how a row of an element moves, whether it acts or not, but for those that define forces."""
        if row.name not in self._moved:
            self._moved[row.name] = row_motion(row, self.motion, self._bias)
        return self._moved[row.name]

    @cached_property
    def _moved(self) -> dict[str, RowMotion]:
        return {}

    @cached_property
    def _bias(self) -> Sequence[tuple[Vec, Vec]]:
        return accelerations(self.motion, [0] * len(self.motion.state.u))

    def of(self, element: OneWay) -> dict[str, S]:
        """Return the forces of an element by component: what presses, then friction, of two parts in space."""
        parts = [part for part in element.frictions if part.rubs]
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
        """Return where a contact's force acts (m, world axes): at its point, or where its round skin is nearest."""
        row = element.normals[0]
        if not isinstance(row, ContactRow):
            return None
        point = next((skin.place for skin in row.skins if is_point(skin)), None)
        return touch(row.skins, self.motion, self._bias).place if point is None else position(self.motion, point)

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
        rows = max((len(exerted_by(x).get(name, {}).get(component, ())) for x in self.mechanism.one_way), default=0)
        if rows > 1:
            return limits.length([self.asked(name, f"{component}_{k}") for k in range(1, rows + 1)])
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
