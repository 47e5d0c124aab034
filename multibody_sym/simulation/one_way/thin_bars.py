"""Points at bars without thickness, which they touch on the side from which they come.

Place alone does not tell that side where they touch: a run remembers it. There a bar has two sides, each solid behind
without limit, of which one is live. What comes past an end and in again from behind that side is on the other one from
then on. A run is looked at sample by sample, too: one in which a point has come out on the other side is no motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.mechanism.contact_rows import ContactRow, Flat, Round
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO
from multibody_sym.simulation.one_way.decision import NextState
from multibody_sym.simulation.one_way.facts import Facts

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

    sides: tuple[OneWay, OneWay]

    @property
    def told(self) -> str:
        """What passes through what."""
        row = self.sides[0].normals[0]
        assert isinstance(row, ContactRow)
        point, bar = sorted((skin for skin in row.skins), key=lambda skin: isinstance(skin, Flat))
        return f"{point.place.name} is a point and {bar.place.name} a bar without thickness"

    def side(self, facts: Facts) -> int | None:
        """Return the side, 1 or -1, on which the point is clear of the bar; 0 beyond its ends, None near it."""
        for side, element in zip((1, -1), self.sides, strict=True):
            allowed = facts.allowed_gap(element)
            if facts.gap(element) > allowed and _reaches(facts, element) > allowed:
                return side
        beyond = all(_reaches(facts, element) < -facts.allowed_gap(element) for element in self.sides)
        return 0 if beyond else None

    def hidden(self, facts: Facts) -> OneWay | None:
        """Return the side on which the point is not; None where it is at the bar."""
        side = self.side(facts)
        if side == 0:  # past the ends: whichever it comes in from behind will be exchanged
            side = 1 if facts.gap(self.sides[0]) >= 0.0 else -1
        return None if side is None else self.sides[side > 0]

    def verify_leaving(self, facts: Facts) -> None:
        """Raise ModelError where a point at the bar moves across it: it leaves one side, or strikes the other one."""
        if {facts.standing(element) for element in self.sides} == {"closing", "leaving"}:
            with at(*self.sides[0].path):
                raise ModelError(
                    f"{self.told}: nothing tells which side of it the point starts from; {_CURE}", number="M114"
                )


def thin_bars(mechanism: Mechanism) -> tuple[ThinBar, ...]:
    """Return the bars without thickness that points may strike on either side."""
    sides = [element for element in mechanism.one_way if element.unilateral and _is_thin(element)]
    return tuple(_pairs(sides))


def with_one_side(mechanism: Mechanism) -> tuple[Mechanism, tuple[ThinBar, ...]]:
    """Return a mechanism in whose motion points at thin bars are on the side that the run knows, and these bars."""
    bars = thin_bars(mechanism)
    one_sided = {side.name: _one_sided(side) for bar in bars for side in bar.sides}
    elements = tuple(one_sided.get(element.name, element) for element in mechanism.one_way)
    return replace(mechanism, one_way=elements), tuple(
        ThinBar((one_sided[bar.sides[0].name], one_sided[bar.sides[1].name])) for bar in bars
    )


def _one_sided(element: OneWay) -> OneWay:
    """Return a side of a bar that is touched wherever it is within reach, and at its very ends."""

    def row_of(row: Row) -> Row:
        if not isinstance(row, ContactRow):
            return row
        first, second = (
            replace(skin, beside=(), at_end=True) if isinstance(skin, Flat) else skin for skin in row.skins
        )
        return replace(row, skins=(first, second))

    frictions = tuple(replace(part, rows=tuple(map(row_of, part.rows))) for part in element.frictions)
    return replace(element, normals=tuple(map(row_of, element.normals)), frictions=frictions)


def hidden_sides(
    bars: Sequence[ThinBar], facts: Facts, decide: Callable[[tuple[str, ...]], NextState]
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


def turned_round(bars: Sequence[ThinBar], element: OneWay, hidden: Sequence[str]) -> list[str] | None:
    """Return the hidden sides once a point has come in from behind a side of its bar; None where it is at none."""
    for bar in bars:
        names = [side.name for side in bar.sides]
        if element.name in names:
            return [x for x in hidden if x not in names] + [element.name]
    return None


def is_behind(facts: Facts, element: OneWay) -> bool:
    """Return whether what comes within reach of a face that ends is behind it, and so does not touch it."""
    return facts.gap(element) < -_BEHIND * facts.allowed_gap(element)


def why_behind(element: OneWay) -> str:
    """Return why nothing is known of what has come in behind a face."""
    row = element.normals[0]
    skins = row.skins if isinstance(row, ContactRow) else ()
    in_space = any(isinstance(skin, Flat) and skin.beside and skin.ends is None for skin in skins)
    return _INSIDE if in_space else _FROM_BEHIND


def passed_through(bars: tuple[ThinBar, ...], samples: Iterator[Facts]) -> str:
    """Return which point got through a bar between samples of a run, when, and what to do; nothing where none did."""
    last: dict[ThinBar, int] = {}
    for facts in samples:
        for bar in bars:
            side = bar.side(facts)
            if side and last.get(bar, side) == -side:
                return f"{bar.told}: it gets through before t = {facts.t:.6g} s; {_CURE}"
            if side is not None:
                last[bar] = side
    return ""


def _reaches(facts: Facts, element: OneWay) -> float:
    reaches: Floats = facts.known["reaches"]
    return float(reaches[facts.laws.elements[element.name]])


def _is_thin(element: OneWay) -> bool:
    row = element.normals[0]
    if not isinstance(row, ContactRow):
        return False
    points = [skin for skin in row.skins if isinstance(skin, Round) and skin.radius is ZERO]
    return bool(points) and any(
        isinstance(skin, Flat) and skin.ends is not None and [face.place for face in skin.beside] == [skin.ends[0]]
        for skin in row.skins
    )


def _pairs(sides: list[OneWay]) -> Iterator[ThinBar]:
    """Yield the two sides of each bar together: those that the same two places touch."""
    waiting: dict[tuple[object, ...], OneWay] = {}
    for element in sides:
        row = element.normals[0]
        assert isinstance(row, ContactRow)
        key = (element.group, *(skin.place for skin in row.skins))
        if key in waiting:
            yield ThinBar((waiting.pop(key), element))
        else:
            waiting[key] = element
