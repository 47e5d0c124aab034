"""Points that get through bars without thickness: a gap that is nothing for an instant only shows on neither side.

A point is on the side of such a bar from which it comes, and its place alone does not tell it where it touches. A run
is therefore looked at sample by sample, and one in which a point has come out on the other side is no motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.mechanism.contact_rows import ContactRow, Flat, Round
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import ZERO
from multibody_sym.simulation.one_way.facts import Facts

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

    def verify_leaving(self, facts: Facts) -> None:
        """Raise ModelError where a point at the bar moves across it: it leaves one side, or strikes the other one."""
        if {facts.standing(element) for element in self.sides} == {"closing", "leaving"}:
            with at(*self.sides[0].path):
                raise ModelError(f"{self.told}: nothing tells which side of it the point starts from; {_CURE}")


def thin_bars(mechanism: Mechanism) -> tuple[ThinBar, ...]:
    """Return the bars without thickness that points may strike on either side."""
    sides = [element for element in mechanism.one_way if element.unilateral and _is_thin(element)]
    return tuple(_pairs(sides))


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
