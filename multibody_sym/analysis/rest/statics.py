"""What rest needs: forces in balance, each within its limits.

    f + C^T z = 0        gamma = D z  (rows that define forces)        limits: sums of multiples of z >= 0

z are the multipliers of all rows, of one-way elements too; limits are normal forces and tensions, and what is left of
friction, mu N -+ t. A limit with the size of a reaction is one for each of its signs (`Choice`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import product
from math import cos, pi, sin
from typing import Final

from multibody_sym.dynamics.formalisms.inverse_dynamics import inverse_dynamics
from multibody_sym.dynamics.laws.assemble import Numbered
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.ropes import wrap_angle
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.model.mechanism.every_mode import every_row
from multibody_sym.model.mechanism.limits import taut_ropes
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay, OneWayKind
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import Kind, most
from multibody_sym.scalars.node import ONE, Node, as_node, negate
from multibody_sym.scalars.vectors import S

DIRECTIONS: Final = 8
"""In how many directions the circle of friction in space is first cut; and those of a reaction first tried."""

Direction = tuple[float, float]
Cuts = Mapping[str, tuple[Direction, ...]]
"""By friction part in space, the directions in which its circle is cut."""


@dataclass(frozen=True)
class Curve:
    """The curved limit that cuts stand for: t . t <= coefficient^2 N . N, t and N being multipliers by number."""

    rubbing: tuple[int, ...]
    coefficient: Node
    pressing: tuple[int, ...]


@dataclass(frozen=True)
class RestLimit:
    """The sum of factors times multipliers (by number) that is >= 0 at rest.

    `part` is the friction part or the element, `group` the declared element that it belongs to, `of` its kind; `along`
    the direction in which a circle of friction is cut. `curve` is what the limit is a tangent of. `idle`: the
    multipliers that are nothing where this normal force is.
    """

    kind: Kind
    of: OneWayKind
    group: str
    part: str
    terms: tuple[tuple[int, Node], ...]
    along: Direction | None = None
    curve: Curve | None = None
    idle: tuple[int, ...] = ()

    def turned_to(self, along: Direction) -> RestLimit:
        """Return the tangent of the same circle in another direction."""
        assert self.curve is not None
        normals = tuple(term for term in self.terms if term[0] not in self.curve.rubbing)
        tangents = zip(self.curve.rubbing, along, strict=True)
        return replace(self, along=along, terms=(*normals, *((k, as_node(-x)) for k, x in tangents if x)))


@dataclass(frozen=True)
class Choice:
    """Which side of joints presses: for each such reaction, by its first row, a sign or a direction."""

    sides: Mapping[int, int] = field(default_factory=dict)
    directions: Mapping[int, Direction] = field(default_factory=dict)


@dataclass(frozen=True)
class Balance:
    """Over a scalar: `equal` E (e x m), `right` r (e) and `limits` G (g x m) of E z = r, G z >= 0."""

    equal: list[list[S]]
    right: list[S]
    limits: list[list[S]]


@dataclass(frozen=True)
class Statics:
    """A mechanism with the rows of all its one-way elements, as if all touched and stuck, and where each row is.

    `cuts` are the first ones.
    """

    mechanism: Mechanism
    numbered: Numbered
    places: Mapping[int, int]
    cuts: Cuts = field(default_factory=dict)

    def place(self, row: Row) -> int:
        """Return the number of a row."""
        return self.places[id(row)]

    # --- limits -------------------------------------------------------------------------------------------------

    def limits(self, choice: Choice, cuts: Cuts | None = None) -> tuple[RestLimit, ...]:
        """Return all limits, with the sides that press of joints; `cuts` in place of the first ones."""
        found: list[RestLimit] = []
        for k, row in taut_ropes(self.mechanism):
            found.append(RestLimit("force", "rope", row.name, row.name, ((k, ONE),)))
        for element in self.mechanism.one_way:
            found += self._of_element(element, choice, cuts or self.cuts)
        return tuple(found)

    def _of_element(self, element: OneWay, choice: Choice, cuts: Cuts) -> Iterator[RestLimit]:
        group = element.group or element.name
        if element.unilateral:
            idle = tuple(self.place(row) for part in element.frictions for row in part.rows)
            terms = ((self.place(element.normals[0]), ONE),)
            yield RestLimit("force", element.kind, group, element.name, terms, idle=idle)
        for normal in () if element.unilateral else element.normals:
            place = self.place(normal)
            if place in choice.sides:
                yield RestLimit("side", element.kind, group, element.name, ((place, as_node(choice.sides[place])),))
        for part in element.frictions:
            if not part.enough:
                yield from self._of_friction(element, part, choice, cuts)

    def _of_friction(self, element: OneWay, part: FrictionPart, choice: Choice, cuts: Cuts) -> Iterator[RestLimit]:
        """Yield mu N - d . t >= 0, d being both ways of a line or the directions in which a circle is cut."""
        normals = [(k, most(part.static, factor)) for k, factor in self._pressing(element, part, choice)]
        rows = [self.place(row) for row in part.rows]
        pressing = tuple(map(self.place, element.normals_of(part)))
        curved = len(rows) == 2 or (part.norm and len(pressing) > 1)
        curve = Curve(tuple(rows), part.static, pressing) if curved else None
        ways: Sequence[Direction] = ((1, 0), (-1, 0)) if len(rows) == 1 else cuts[part.name]
        for way in ways:
            against = tuple((k, negate(as_node(x))) for k, x in zip(rows, way, strict=False) if x)
            along = way if len(rows) == 2 else None
            group, terms = element.group or element.name, (*normals, *against)
            yield RestLimit("cone", element.kind, group, part.name, terms, along, curve)

    def _pressing(self, element: OneWay, part: FrictionPart, choice: Choice) -> Iterator[tuple[int, Node]]:
        """Yield the multipliers that make the normal force of friction, each with its factor."""
        places = list(map(self.place, element.normals_of(part)))
        direction = choice.directions.get(places[0])
        for number, place in enumerate(places):
            factor = direction[number] if direction is not None else choice.sides.get(place, 1)
            yield place, as_node(factor)

    # --- choices ------------------------------------------------------------------------------------------------

    def choices(self) -> list[Choice]:
        """Return all choices of the sides that press, and some of their directions."""
        signs: list[int] = []
        circles: list[int] = []
        for element in self.mechanism.one_way:
            for part in () if element.unilateral else element.frictions:
                places = list(map(self.place, element.normals_of(part)))
                if part.norm and len(places) > 1:
                    circles.append(places[0])
                else:
                    signs += [place for place in places if place not in signs]
        chosen = product(product((1, -1), repeat=len(signs)), product(around(DIRECTIONS), repeat=len(circles)))
        return [
            Choice(dict(zip(signs, sides, strict=True)), dict(zip(circles, directions, strict=True)))
            for sides, directions in chosen
        ]

    # --- balance ------------------------------------------------------------------------------------------------

    def balance(self, motion: Motion, limits: Sequence[RestLimit], rows: Sequence[RowMotion]) -> Balance:
        """Return the conditions at a state at rest; `rows` are all rows there, None for what is out of touch."""
        forces = applied_generalized_forces(motion, applied(motion))
        needed = inverse_dynamics(motion, [0] * len(forces))
        equal = [[row.forces[k] for row in rows] for k in range(len(forces))]
        right = [c - q for q, c in zip(forces, needed, strict=True)]
        for row in rows:
            if not row.kinematic:
                equal.append([row.coupling.get(k, 0) for k in range(len(rows))])
                right.append(row.gamma)
        factors = iter(
            motion.state.values([factor for limit in limits for _, factor in limit.terms], self.wraps(motion))
        )
        cone = []
        for limit in limits:
            line: list[S] = [0] * len(rows)
            for (k, _), factor in zip(limit.terms, factors, strict=False):
                line[k] = line[k] + factor
            cone.append(line)
        return Balance(equal, right, cone)

    def wraps(self, motion: Motion) -> dict[Node, S]:
        """Return the angles over which ropes are in touch with rough wheels, by what stands for them."""
        slips = [row for row in self.mechanism.rows if isinstance(row, RopeSlipRow)]
        return {row.wrap: wrap_angle(motion, row.rope, row.bend) for row in slips}


def around(count: int) -> tuple[Direction, ...]:
    """Return directions evenly around a circle, those along axes exactly."""
    angles = [2 * pi * k / count for k in range(count)]
    return tuple((round(cos(angle), 15), round(sin(angle), 15)) for angle in angles)


def statics(mechanism: Mechanism) -> Statics:
    """Return what rest of a mechanism needs, which is in no mode.

    Raises NoSolutionError where forces with three components rub or press.
    """
    for element in mechanism.one_way:
        _verify_plane(element)
    rows = every_row(mechanism)
    cuts = {
        part.name: around(DIRECTIONS)
        for element in mechanism.one_way
        for part in element.frictions
        if len(part.rows) == 2 and not part.enough
    }
    whole = replace(mechanism, rows=rows)
    return Statics(whole, Numbered(mechanism), {id(row): k for k, row in enumerate(rows)}, cuts)


def _verify_plane(element: OneWay) -> None:
    for part in element.frictions:
        if len(part.rows) > 2 or (part.norm and len(part.normals) > 2):
            raise NoSolutionError(
                f"ranges of rest are found for friction along lines and in planes; {part.name} rubs with, or is "
                "pressed by, a vector in space: ask solve for one value of the parameter after the other",
                where=Where(path=element.path),
                number="N110",
            )
