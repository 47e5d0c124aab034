"""The mechanism of a run in no mode: whether one set of Programs serves all modes, and the sides of thin bars.

Place alone does not tell that side where they touch: a run remembers it. There a bar has two sides, each solid behind
without limit, of which one is live. What comes past an end and in again from behind that side is on the other one from
then on. A run is looked at sample by sample, too: one in which a point has come out on the other side is no motion.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.repeated_contacts import alike_rows
from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.contacts import corners_of
from multibody_sym.mechanics.law_elements import INACTIVE, LawElement, Mode
from multibody_sym.mechanics.mechanism import ARRAY, Mechanism, ParameterEntry, ParameterVector, Source
from multibody_sym.mechanics.modes import every_row, functions, in_every_mode, taking_part
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import direction, position, separation
from multibody_sym.mechanics.row_records import (
    ContactRow,
    ContactSurface,
    Marker,
    RoundSurface,
    Row,
    Vertex,
    is_point,
)
from multibody_sym.model.bodies import IDENTITY
from multibody_sym.model.fields import Point
from multibody_sym.model.settings import Settings
from multibody_sym.motion.prepare.settings import form_of, steps_over_contacts
from multibody_sym.motion.switching.decision import NextState
from multibody_sym.motion.switching.law_values import Laws, LawValues
from multibody_sym.program.runtime_constants import ROUNDED_GAP, TOUCHING
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats
from multibody_sym.scalars.node import ONE, ZERO, slot

if TYPE_CHECKING:
    from multibody_sym.program.programs import Form

_BEHIND: Final = 10.0
"""The multiple of what counts as touching from which on something is behind a face."""
_FROM_BEHIND: Final = (
    "what it touches comes in past its end from behind, where a surface that ends with a normal is solid without "
    "limit; end the run before, let it reach a little further, or let it be touched on both sides (a segment without "
    "a normal, a box, a rod)"
)
_INSIDE: Final = (
    "what touches it has come into the box through an edge, which touches other edges and bars only where it is named; "
    "declare a contact of both edges, such as between: [a.bottom_front, b.top_right], or end the run before"
)
_CURE: Final = "say on which side it strikes (surfaces: {..: {segment: [..], normal: y}}), or give one of them a radius"


@dataclass(frozen=True)
class ThinBar:
    """A point and the two sides of a bar without thickness, as the elements of their contact."""

    sides: tuple[LawElement, LawElement]

    @property
    def words(self) -> str:
        """What passes through what."""
        point, bar = sorted(self.sides[0].surfaces or (), key=lambda skin: skin.plane is not None)
        return f"{point.place.name} is a point and {bar.place.name} a bar without thickness"

    def side(self, facts: LawValues) -> int | None:
        """Return the side, 1 or -1, on which the point is clear of the bar; 0 beyond its ends, None near it."""
        for side, element in zip((1, -1), self.sides, strict=True):
            allowed = facts.allowed_gap(element)
            if facts.gap(element) > allowed and _reaches(facts, element) > allowed:
                return side
        beyond = all(_reaches(facts, element) < -facts.allowed_gap(element) for element in self.sides)
        return 0 if beyond else None

    def hidden(self, facts: LawValues) -> LawElement | None:
        """Return the side on which the point is not; None where it is at the bar."""
        side = self.side(facts)
        if side == 0:  # past the ends: whichever it comes in from behind will be exchanged
            side = 1 if facts.gap(self.sides[0]) >= 0.0 else -1
        return None if side is None else self.sides[side > 0]

    def verify_leaving(self, facts: LawValues) -> None:
        """Raise ModelError where a point at the bar moves across it: it leaves one side, or strikes the other one."""
        if {facts.standing(element) for element in self.sides} == {"closing", "leaving"}:
            with at(*self.sides[0].path):
                raise ModelError(
                    f"{self.words}: nothing tells which side of it the point starts from; {_CURE}", number="M114"
                )


def _thin_bars(mechanism: Mechanism) -> list[ThinBar]:
    """Return the bars without thickness that points may strike on either side: two elements of the same two places."""
    found, waiting = list[ThinBar](), dict[tuple[object, ...], LawElement]()
    for element in mechanism.one_way:
        skins = (element.surfaces if element.unilateral else None) or ()
        planes = (skin.plane for skin in skins if skin.plane is not None)
        thin = any(flat.ends is not None and [x.place for x in flat.beside] == [flat.ends[0]] for flat in planes)
        if not (thin and any(map(is_point, skins))):
            continue
        key = (element.group, *(skin.place for skin in skins))
        if key in waiting:
            found.append(ThinBar((waiting.pop(key), element)))
        else:
            waiting[key] = element
    return found


def with_one_side(mechanism: Mechanism) -> tuple[Mechanism, tuple[ThinBar, ...]]:
    """Return a mechanism in whose motion points at thin bars are on the side that the run knows, and these bars."""
    bars = _thin_bars(mechanism)
    one_sided = {side.name: _one_sided(side) for bar in bars for side in bar.sides}
    elements = tuple(one_sided.get(element.name, element) for element in mechanism.one_way)
    return replace(mechanism, one_way=elements), tuple(
        ThinBar((one_sided[bar.sides[0].name], one_sided[bar.sides[1].name])) for bar in bars
    )


def _one_sided(element: LawElement) -> LawElement:
    """Return a side of a bar that is touched wherever it is within reach, and at its very ends."""

    def row_of(row: Row) -> Row:
        if not isinstance(row, ContactRow):
            return row
        first, second = (
            skin if skin.plane is None else replace(skin.plane, beside=(), at_end=True) for skin in row.skins
        )
        return replace(row, skins=(first, second))

    frictions = tuple(replace(part, rows=tuple(map(row_of, part.rows))) for part in element.frictions)
    return replace(element, normals=tuple(map(row_of, element.normals)), frictions=frictions)


def hidden_sides(
    bars: Sequence[ThinBar], facts: LawValues, decide: Callable[[tuple[str, ...]], NextState]
) -> tuple[str, ...]:
    """Return the sides of bars on which points are not; where they rest that which carries less, as is decided."""
    places = {bar: bar.hidden(facts) for bar in bars}
    hidden = [side.name for side in places.values() if side is not None]
    resting = [bar for bar, side in places.items() if side is None]
    found = decide(tuple(hidden)) if resting else None
    for bar in resting:
        assert found is not None
        carried = {side.name: found.carried(side) for side in bar.sides}
        hidden.append(min(reversed(carried), key=carried.__getitem__))
    return tuple(hidden)


def is_behind(facts: LawValues, element: LawElement) -> bool:
    """Return whether what comes within reach of a face that ends is behind it, and so does not touch it."""
    return facts.gap(element) < -_BEHIND * facts.allowed_gap(element)


def why_behind(element: LawElement) -> str:
    """Return why nothing is known of what has come in behind a face."""
    planes = (skin.plane for skin in element.surfaces or () if skin.plane is not None)
    return _INSIDE if any(plane.beside and plane.ends is None for plane in planes) else _FROM_BEHIND


def passed_through(bars: tuple[ThinBar, ...], samples: Iterator[LawValues]) -> str:
    """Return which point got through a bar between samples of a run, when, and what to do; nothing where none did."""
    last: dict[ThinBar, int] = {}
    for facts in samples:
        for bar in bars:
            side = bar.side(facts)
            if side and last.get(bar, side) == -side:
                return f"{bar.words}: it gets through before t = {facts.t:.6g} s; {_CURE}"
            if side is not None:
                last[bar] = side
    return ""


def _reaches(facts: LawValues, element: LawElement) -> float:
    reaches: Floats = facts.known["reaches"]
    return float(reaches[facts.laws.elements[element.name]])


# ----------------------------------------------------------------------------------------------------------------------
# Points that meet without a normal: it is the direction in which they come together, and a run remembers it.
#
# Two points that are declared to touch meet so, and a point and the very end of a bar or of a segment, or two such
# ends; in a plane model corners of boxes, too. Where they are nearest to each other they have met if they are in one
# place. An end has a side as well: what comes from above that strikes the side, as far as to its end, and what comes
# from beyond it strikes the end. Where the corner of a body meets a corner or an end, a face strikes that the body is
# above; where there is none they strike each other if their way leads from one into the other, and else pass.


_FIRST: Final = (ONE, ZERO, ZERO)
"""The normal before anything has met."""
_ACROSS: Final = 1e-9
"""The part of a speed towards an end of a bar, from beyond it, below which what comes is above its side."""
_AGAIN: Final = 4.0
"""So many times what counts as one place points that have parted have to travel before they can meet from there."""
_ROUNDED_TIME: Final = 8.0 * EPSILON
"""The part of the time by which it is rounded when points meet."""
_LEAST: Final = 1e-300
"""The least r . v (m^2/s) that is not zero: points at rest do not come together."""


@dataclass(frozen=True)
class _End:
    """An end of a bar that a point may meet: the contact of the point with the bar's side, and the end's number."""

    side: LawElement
    number: int

    @property
    def row(self) -> ContactRow:
        row = self.side.normals[0]
        assert isinstance(row, ContactRow)
        return row

    @property
    def place(self) -> int:
        """Which of both skins is the bar's."""
        return next(k for k, skin in enumerate(self.row.skins) if skin.plane is not None)

    @property
    def ends(self) -> tuple[Marker, Marker]:
        """The bar's ends, this one first."""
        flat = self.row.skins[self.place].plane
        assert flat is not None
        assert flat.ends is not None
        return flat.ends if self.number == 0 else (flat.ends[1], flat.ends[0])

    @property
    def point(self) -> Marker:
        return self.row.skins[1 - self.place].place

    @property
    def pair(self) -> frozenset[Marker]:
        """What may meet."""
        return frozenset((self.point, self.ends[0]))

    @property
    def is_corner(self) -> bool:
        """Whether the end is a corner of a box, where two of its faces end."""
        flat = self.row.skins[self.place].plane
        return flat is not None and len(flat.beside) > 1

    @property
    def name(self) -> str:
        """The contact's name with the point's word, where it has one, and the end or corner, in the order of both."""
        words = self.side.name.removeprefix(self.side.group).split(".")
        point = next((word for word in words if word.startswith(("end", "corner"))), "")
        face = next((word for word in words if word not in ("", point)), "")
        end = corners_of(face)[self.number] if self.is_corner else f"end{self.number + 1}"
        parts = (point, end) if self.place else (end, point)
        return ".".join(filter(None, (self.side.group, *parts)))

    def inward(self, motion: Motion) -> Floats:
        """Return the unit vector (3,) from this end along the bar or face, in world axes."""
        this, other = (np.array(position(motion, marker), dtype=float) for marker in self.ends)
        along: Floats = (other - this) / np.linalg.norm(other - this)
        return along


def with_tips(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism in whose runs points meet points, and the very ends of bars."""
    ends: dict[tuple[str, frozenset[Marker]], list[_End]] = {}
    for end in _ends(mechanism):
        ends.setdefault((end.side.group, end.pair), []).append(end)
    elements, vector = list(mechanism.one_way), mechanism.parameters
    for k, element in enumerate(elements):
        row = element.normals[0] if element.normals else None
        if isinstance(row, ContactRow) and all(is_point(skin) for skin in row.skins):
            vector, normal = _with_normal(vector, element.name)
            first, second = row.skins
            elements[k] = _met_contact(element, element.name, (first, Vertex(second.place, normal)))
    for end, *others in ends.values():
        if end.is_corner and not others:
            continue  # a face that is named by itself
        vector, normal = _with_normal(vector, end.name)
        point, tip = RoundSurface(end.point), RoundSurface(end.ends[0])
        first, second = (point, tip) if end.place else (tip, point)
        corner = any(each.is_corner for each in (end, *others))
        elements.append(_met_contact(end.side, end.name, (first, Vertex(second.place, normal, corner=corner))))
    return replace(mechanism, one_way=tuple(elements), parameters=vector)


def _ends(mechanism: Mechanism) -> Iterator[_End]:
    """Yield the ends of bars and of the faces of boxes that points may meet."""
    for element in mechanism.one_way:
        skins = (element.surfaces if element.unilateral else None) or ()
        ends = any(skin.plane is not None and skin.plane.ends is not None for skin in skins)
        if ends and any(map(is_point, skins)):
            yield from (_End(element, number) for number in (0, 1))


def _with_normal(vector: ParameterVector, name: str) -> tuple[ParameterVector, Point]:
    """Return the parameters with the components of a normal, and these."""
    added = tuple(ParameterEntry(_entry(name, k), x, source=Source.CHOSEN) for k, x in enumerate(_FIRST))
    longer = ParameterVector((*vector.entries, *added))
    x, y, z = (slot(ARRAY, longer.places[entry.name]) for entry in added)
    return longer, (x, y, z)


def _entry(name: str, component: int) -> str:
    return f"normal of {name} {component + 1}"


def _met_contact(element: LawElement, name: str, skins: tuple[ContactSurface, ContactSurface]) -> LawElement:
    """Return a contact of two points that rubs and bounces as another one."""

    def row_of(row: Row) -> Row:
        assert isinstance(row, ContactRow)
        own = name + row.name.removeprefix(element.name)
        return replace(row, name=own, skins=skins, across=None, inner=None)

    frictions = tuple(
        replace(part, name=name + part.name.removeprefix(element.name), rows=tuple(map(row_of, part.rows)))
        for part in element.frictions
    )
    return replace(element, name=name, normals=tuple(map(row_of, element.normals)), frictions=frictions)


# --- in a run ---------------------------------------------------------------------------------------------------------


@dataclass
class VertexContacts:
    """The pairs of points of a run's mechanism that may meet, and when each last struck something there."""

    rows: dict[str, tuple[LawElement, ContactRow]]
    sides: dict[str, tuple[_End, ...]]
    _struck: dict[str, float] = field(default_factory=dict)

    @staticmethod
    def of(mechanism: Mechanism) -> VertexContacts:
        """Return those of a mechanism."""
        normals = ((x, row) for x in mechanism.one_way for row in x.normals[:1])
        rows = {x.name: (x, row) for x, row in normals if isinstance(row, ContactRow) and row.tip is not None}
        ends = list(_ends(mechanism)) if rows else []
        pairs = {name: frozenset(skin.place for skin in row.skins) for name, (_, row) in rows.items()}
        sides = {name: tuple(e for e in ends if e.pair == pair) for name, pair in pairs.items()}
        return VertexContacts(rows, sides)

    def meeting(self, facts: LawValues, active: Collection[str]) -> Laws:
        """Return the laws with the normals of what meets now; `active` ones keep those that they have."""
        laws = facts.laws
        for name in self._meeting(facts, active):
            towards = self._towards(facts, name)
            if towards is not None:
                laws = _remember_normal(facts, laws, name, self.rows[name][1], towards)
        return laws

    def aside(self, facts: LawValues, active: Collection[str]) -> tuple[str, ...]:
        """Return what takes no part although it touches: points without a normal, and sides of bars at met ends."""
        found = [end.side.name for name in active for end in self.sides.get(name, ())]
        for name in self._meeting(facts, active):
            strikes = self._towards(facts, name) is not None
            found += [end.side.name for end in self.sides[name]] if strikes else [name]
        return tuple(found)

    def striking(self, facts: LawValues, element: LawElement, others: Collection[str]) -> LawElement | None:
        """Return what strikes where an element closes; `others` take no part. None where points only pass by.

        Of an end and the side of its bar it may be the other one, and of points that are nearest at one instant, as to
        both ends of a bar, those that are in one place.
        """
        if element.name not in self.rows and element.name not in others:
            return element
        if element.name in self.rows and not self._together(facts, element.name):
            met = (self.striking(facts, self.rows[name][0], others) for name in self._meeting(facts, ()))
            return next((x for x in met if x is not None), None)
        beside = [end.side for end in self.sides.get(element.name, ())]
        beside += [self.rows[name][0] for name, ends in self.sides.items() if element in [end.side for end in ends]]
        near = (x for x in (element, *beside) if x.name not in others)
        return next((x for x in near if facts.standing(x) == "closing"), None)

    def resting(self, found: NextState) -> NextState:
        """Return what was decided with the sides of bars left out whose very ends are held by what meets them."""
        if found.mode is None:
            return found
        held = (name for name in self.rows if found.mode.sides.get(name, INACTIVE) != INACTIVE)
        idle = {end.side.name for name in held for end in self.sides[name]}.difference(found.mode.idle)
        return replace(found, mode=replace(found.mode, idle=(*found.mode.idle, *sorted(idle)))) if idle else found

    def strikes(self, facts: LawValues, element: LawElement, active: Collection[str]) -> bool:
        """Return whether an element is a contact of two points that strike, and is not `active`."""
        name = element.name
        meets = name in self.rows and name in self._meeting(facts, active)
        return meets and self._towards(facts, name) is not None

    def struck(self, facts: LawValues) -> None:
        """Note that something struck: what is in one place leaves it."""
        self._struck.update({name: facts.t for name in self.rows if self._together(facts, name)})

    def _together(self, facts: LawValues, name: str) -> bool:
        element = self.rows[name][0]
        reaches: Floats = facts.known["reaches"]
        return bool(reaches[facts.laws.elements[name]] >= -facts.allowed_gap(element))

    def _meeting(self, facts: LawValues, active: Collection[str]) -> list[str]:
        return [name for name in self.rows if name not in active and self._together(facts, name)]

    def _towards(self, facts: LawValues, name: str) -> Floats | None:
        """Return the direction in which the first of two points comes to the second; None where nothing strikes.

        So it is where they hardly move, or graze, where they part or have just struck, and above the side of a bar.
        """
        element, row = self.rows[name]
        away, rate = _separation(row, facts.motion)
        speed = float(np.linalg.norm(rate))
        if speed <= TOUCHING * facts.scale.speed:
            return None
        travelled = speed * (facts.t - self._struck.get(name, -np.inf))
        just_struck = travelled <= _AGAIN * facts.allowed_gap(element) and rate @ _normal(facts, name, row) > 0.0
        if just_struck or away @ rate > _AGAIN * rounded_meeting(facts, element):
            return None
        comes: Floats = rate / speed
        if not _yields(facts, name, row, comes):
            return None
        ends = self.sides[name]
        inward = [end.inward(facts.motion) * (1 if row.skins[0].place == end.point else -1) for end in ends]
        if all(end.row.inner is None for end in ends):
            return comes if all(comes @ way > _ACROSS for way in inward) else None
        on_side = any(end.row.inner is not None and facts.standing(end.side) == "closing" for end in ends)
        # Strictly within the convex cone of the directions inward it leads into a corner.
        across = [np.array([-y, x, 0.0]) for x, y, _ in inward]
        supports = (n for way in across for n in (way, -way) if all(other @ n > -_ACROSS for other in inward))
        return comes if not on_side and all(comes @ n > _ACROSS for n in supports) else None


def rounded_meeting(facts: LawValues, element: LawElement) -> float:
    """Return what rounding makes of r . v (m^2/s) of two points: of places, the time of an impact, and speeds.

    It is that of the speed with which they move now: slow ones turn back from so much nearer.
    """
    row = element.normals[0]
    assert isinstance(row, ContactRow)
    distance, now = (float(np.linalg.norm(vector)) for vector in _separation(row, facts.motion))
    speed = max(now, TOUCHING * facts.scale.speed)
    places = facts.rounding_of_gap(element) + _ROUNDED_TIME * abs(facts.t) * speed
    return max(speed * places + distance * ROUNDED_GAP * facts.scale.speed, _LEAST)


def is_tip(element: LawElement) -> bool:
    """Return whether an element is a contact of two points."""
    return bool(element.normals) and element.normals[0].tip is not None


def _separation(row: ContactRow, motion: Motion) -> Floats:
    """Return where the first of two points is from the second, and the rate of that (2, 3)."""
    first, second = row.skins
    return np.array(separation(motion, first.place, second.place), dtype=float)


def _remember_normal(facts: LawValues, laws: Laws, name: str, row: ContactRow, towards: Floats) -> Laws:
    """Return laws with a normal, in the axes of the body of the second point, against the way of the first.

    It stays where they come together along it but for a speed that counts as rest: they meet again along a line, and
    the slower they are the less the rounding of their speeds says of it.
    """
    tip = row.tip
    assert tip is not None
    known = _normal(facts, name, row)
    speed = float(np.linalg.norm(_separation(row, facts.motion)[1]))
    aside = speed * float(np.linalg.norm(towards - (towards @ known) * known))
    if towards @ known < 0.0 and aside <= TOUCHING * facts.scale.speed:
        return laws
    return _against(facts, laws, name, tip, towards)


def _against(facts: LawValues, laws: Laws, name: str, tip: Vertex, towards: Floats) -> Laws:
    """Return laws with a normal against a way, in the axes of the body of the second point."""
    new = {_entry(name, k): float(x) for k, x in enumerate(_axes(facts, tip) @ -towards)}
    return replace(laws, parameters=np.array(laws.mechanism.parameters.changed(laws.parameters.tolist(), new)))


def _yields(facts: LawValues, name: str, row: ContactRow, towards: Floats) -> bool:
    """Return whether impulses along a way move two points: not where both graze, which arms in line hold against it."""
    tip = row.tip
    assert tip is not None

    def moved(way: Floats) -> float:
        """Return the change of their speed along a way by a unit impulse along it (1/kg)."""
        laws = _against(facts, facts.laws, name, tip, way)
        there = laws.at(facts.t, facts.q, facts.u, facts.scale)
        matrix = there.by_mass[there.place(row)]
        return float(matrix @ matrix)

    return moved(towards) > TOUCHING * max(moved(axis) for axis in np.eye(3))


def _normal(facts: LawValues, name: str, row: ContactRow) -> Floats:
    """Return the normal that is remembered of two points, in world axes."""
    tip, entries, values = row.tip, facts.laws.mechanism.parameters, facts.laws.parameters.tolist()
    assert tip is not None
    normal: Floats = np.array([entries.value(values, _entry(name, k)) for k in range(3)]) @ _axes(facts, tip)
    return normal


def _axes(facts: LawValues, tip: Vertex) -> Floats:
    """Return the axes (3, 3) of the body of a tip in world axes."""
    return np.array([direction(facts.motion, tip.place, axis) for axis in IDENTITY], dtype=float)


def remembered_normals(at: LawValues, mode: Mode) -> tuple[float, ...]:
    """Return the normals of points that are held where they met: which speeds a mode holds at rest depends on them."""
    held = [x.name for x in taking_part(at.laws.mechanism, mode) if is_tip(x) and mode.acts(x)]
    places = at.laws.mechanism.parameters.places
    return tuple(float(at.laws.parameters[places[_entry(name, k)]]) for name in held for k in range(3))


# ----------------------------------------------------------------------------------------------------------------------
# Whether one set of Programs serves a run in all its modes, each of which is data then.


_MOST_ROWS: Final = 24
"""Rows up to which all are computed wherever one acts; of more, few act at a time."""
_MOST_WITH_KINDS: Final = 256
"""The same beside contacts that are derived by kinds and computed where they act, these among them."""
_MOST_BY_KINDS: Final = 25_000
"""Those of contacts by kinds alone: tables of so many take a minute."""
_MOST_ENTRIES: Final = 12
"""Elements of G^-1 for each row up to which they are computed: a robot on four feet has 117 and 12 rows, a row of
eleven rods with one contact 94, which took twice the time."""
_FORMS: Final = ("explicit", "multistep")
"""What methods ask for that take the derivative alone."""


@dataclass(frozen=True)
class LawMechanism:
    """A mechanism in no mode as runs take it: points meet points, and bars have one side; `bars` are those.

    `served`: what the Programs that serve it in all its modes are made for, None where each mode has its own. Those of
    methods that take the derivative are of the mechanism `in_every_mode`, `every`.
    """

    declared: Mechanism
    bars: tuple[ThinBar, ...]
    every: Mechanism | None = None
    served: Form | None = None

    @property
    def functions(self) -> int:
        """The number of the switching functions of all modes."""
        return 0 if self.every is None else len(functions(self.every))

    def numbers(self, mechanism: Mechanism, parameters: Floats) -> tuple[Floats, Floats]:
        """Return the parameters (np,) of Programs of all modes by those of a mechanism in a mode, and no mode (nm,)."""
        every = self.every or self.declared
        known = {entry.name: x for entry, x in zip(mechanism.parameters, parameters.tolist(), strict=True)}
        values = [known.get(entry.name, 0.0) for entry in every.parameters]
        return np.array(values, dtype=float), np.zeros(len(every.mode_numbers))

    @staticmethod
    def of(declared: Mechanism, settings: Settings) -> LawMechanism:
        """Return the mechanism of a run of a declared one by some settings."""
        taken, bars = with_one_side(with_tips(declared))
        if steps_over_contacts(settings, declared):
            return LawMechanism(taken, bars, served="impulses")
        form = form_of(settings, constrained=True, varies=True)
        if form not in _FORMS or not _serves_all_modes(taken):
            return LawMechanism(taken, bars)
        every = in_every_mode(taken)
        return LawMechanism(replace(taken, parameters=every.parameters), bars, every, form)


def _serves_all_modes(declared: Mechanism) -> bool:
    """Return whether one set of Programs serves all modes.

    Not where rows hold what has no mass, there are so many that few of them act at a time, or chains so long, with so
    few rows, that G^-1 takes longer than the motion itself.
    """
    rows, alike = len(every_row(declared)), alike_rows(declared)
    few = rows <= (_MOST_WITH_KINDS if alike else _MOST_ROWS)
    few = few or (rows - alike <= _MOST_ROWS and rows <= _MOST_BY_KINDS)
    entries, before = 0, list[int]()  # of G^-1: those of speeds and of the speeds before them in the tree
    for body in declared.bodies:
        above = before[body.parent] if body.parent >= 0 else 0
        before.append(above + len(body.u))
        entries += len(body.u) * above + len(body.u) * (len(body.u) + 1) // 2
    few = few and entries <= _MOST_ENTRIES * rows
    return few and not declared.minimum_norm and not massless_speeds(declared)
