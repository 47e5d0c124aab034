"""The page: dimension lines, angles and labels find places that touch nothing; then the page grows around all of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.page.free_space import Room, bounds, box_at, crossings, overlaps, place_labels
from multibody_sym.pictures.page.picture import (
    DESCENT,
    HEIGHT,
    HIDDEN,
    LAYER_ARROW,
    LAYER_TEXT,
    PIN,
    THIN,
    AngleArc,
    Arc,
    Arrow,
    LegendLine,
    Mark,
    Measure,
    Picture,
    Placed,
    Stroke,
    TextMark,
    Wish,
    box_of,
    in_order,
    shifted_mark,
    simple,
    width_of,
)
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Dimension lines beside what they measure, with extension lines and arrows; angles as arcs with letters.


_OFFSETS: Final = (13.0, 17.0, 22.0, 28.0, 35.0, 43.0, 52.0, 62.0, 74.0, 88.0, 105.0, 125.0, 150.0, 180.0, 220.0, 270.0)
"""Distances (pt) of a dimension line from what it measures that are tried."""
_RADII: Final = (18.0, 23.0, 29.0, 36.0, 44.0, 14.0, 54.0, 66.0)
"""Radii (pt) of the arc of an angle that are tried."""
_HEAD: Final = 4.5
_OUTSIDE: Final = 9.0
"""Length (pt) of the lines outside of a dimension too short for its arrows."""
_GAP, _BEYOND = 3.0, 2.5
"""What an extension line leaves free at what is measured, and how far it goes past the dimension line."""
_PARTS: Final = (0.5, 0.34, 0.66)
"""Where along a dimension line its letters are tried."""
_OFF_MIDDLE: Final = 12.0
"""Cost of letters at the end of their line, doubled; in points of distance."""
_ACROSS: Final = 40.0
"""Cost of a line across a load, a spring or a rope; in points of distance."""
_SMALL: Final = np.radians(4.0)
"""An angle below is told in letters: an arc of it could not be seen."""
_BESIDE: Final = (5.0, 16.0)
"""From where to where on its side (pt) the letters of such an angle stand: behind it the next hinge may be."""
_NONE: Final = 0.5
"""A length (pt) below is told in letters, such as one seen along its own direction."""


def place_measures(room: Room, measures: Sequence[Measure]) -> tuple[list[Placed], list[Wish]]:
    """Return the marks of dimension lines, which then have their places, and wishes for letters without one.

    Short ones come first, so that long ones lie further out. Letters that another's line crosses leave their gap.
    """
    lines: list[_Line] = []
    told: list[Wish] = []
    for one in sorted(measures, key=lambda m: round(float(np.hypot(*(np.asarray(m.b) - m.a))), 6)):
        if float(np.hypot(*(np.asarray(one.b) - one.a))) < _NONE:
            told.append(Wish(np.array([one.a]), one.runs, size=one.size, role=one.role, name=one.name))
            continue
        best = _cheapest(room, one)
        best.take(room)
        lines.append(best)
    found: list[Placed] = []
    for line in lines:
        if line.is_crossed(room):
            room.forget(line.letters)
            found.extend(line.marks(gap=False))
            told.append(line.wish)
        else:
            found.extend([*line.marks(gap=True), line.letters])
    return found, told


def _cheapest(room: Room, one: Measure) -> _Line:
    """Return the cheapest line; none costs less than its distance, so that those further out need no look."""
    best = _Line(room, one, _OFFSETS[0], _PARTS[0])
    for part in _PARTS:
        for offset in _OFFSETS:
            if offset + _OFF_MIDDLE * abs(part - 0.5) > best.cost:
                break
            for side in (1, -1):
                best = min(best, _Line(room, one, offset * side, part, best.cost), key=lambda line: line.cost)
    return best


def _mark_fields(one: Measure | AngleArc, layer: int = LAYER_ARROW) -> dict[str, Any]:
    return {"role": one.role, "name": one.name, "layer": float(layer)}


class _Line:
    """A dimension line at an offset to the left of the direction from a to b, its letters at a part of its length."""

    def __init__(self, room: Room, one: Measure, offset: float, part: float, limit: float = np.inf) -> None:
        self.one = one
        self.feet = np.array([one.a, one.b], dtype=float)
        self.length = float(np.hypot(*(self.feet[1] - self.feet[0])))
        self.along = (self.feet[1] - self.feet[0]) / self.length
        self.away = np.sign(offset) * np.array([-self.along[1], self.along[0]])
        self.ends = self.feet + abs(offset) * self.away
        wide, high = width_of(one.runs, one.size), (HEIGHT + DESCENT) * one.size
        x, y = np.abs(self.along)  # the gap is as long as the line within a box around its letters
        self.gap = float(min((wide + 3.0) / x if x > 1e-9 else np.inf, (high + 1.0) / y if y > 1e-9 else np.inf))
        self.inside = self.length * 2 * min(part, 1 - part) >= self.gap + 2 * _HEAD + 4.0
        self.centre = self.ends[0] + part * self.length * self.along if self.inside else self._beyond(part)
        self.box = box_at(self.centre[None], wide, high)
        self.cost = self._cost(room, offset, part, limit)

    def _beyond(self, part: float) -> Floats:
        """Return the middle of letters that do not fit between the arrows: in the line, beyond one of its ends."""
        end, way = (self.ends[1], 1.0) if part >= 0.5 else (self.ends[0], -1.0)
        found: Floats = end + way * self.along * (self.gap / 2 + (_OUTSIDE + 1.0 if self._short else 2.0))
        return found

    @property
    def _short(self) -> bool:
        """Whether the arrows stand outside."""
        return self.length < 2 * _HEAD + 4.0

    def _cost(self, room: Room, offset: float, part: float, limit: float) -> float:
        """Return what this place costs: distance, letters that it does not leave alone, lines that it crosses.

        Nothing is looked at any more once it costs more than the limit.
        """
        cost = abs(offset) + _OFF_MIDDLE * abs(part - 0.5)
        cost += 0.3 * float(self.away[1] > 1e-9) + 0.2 * float(self.away[0] < -1e-9)
        wide = float(np.ptp(self.box[0, 0::2]) + np.ptp(self.box[0, 1::2]))
        cost += 60.0 * float(room.touched(self.box, room.near(self.centre[None], wide))[0])
        if cost < limit:
            cost += 2.0 * room.crowded(*self.ends)
        cost += _ACROSS * float(cost < limit and room.acts_across(*self.ends))
        for line in self._extensions():
            if cost < limit:
                cost += 1.5 * room.crowded(line[0] + 3.0 * self.away, line[1])
        return cost

    def _extensions(self) -> list[Floats]:
        return [
            np.array([foot + _GAP * self.away, end + _BEYOND * self.away])
            for foot, end in zip(self.feet, self.ends, strict=True)
        ]

    def marks(self, *, gap: bool) -> list[Placed]:
        """Return the extension lines and the arrows, with a gap for the letters or without."""
        named = _mark_fields(self.one)
        found: list[Placed] = [Stroke(line, THIN, **named) for line in self._extensions()]
        if self.inside and gap:
            half = self.gap / 2 * self.along
            tails, tips = [self.centre - half, self.centre + half], self.ends
        elif self._short:
            tails, tips = [self.ends[0] - _OUTSIDE * self.along, self.ends[1] + _OUTSIDE * self.along], self.ends
        else:
            return [*found, Arrow(self.ends, THIN, both=True, head=_HEAD, **named)]
        return [*found, *(Arrow(np.array(pair), THIN, head=_HEAD, **named) for pair in zip(tails, tips, strict=True))]

    @property
    def letters(self) -> TextMark:
        """The letters in their place."""
        at = np.array([self.box[0, 0], self.box[0, 1] + DESCENT * self.one.size])
        return TextMark(at, self.one.runs, self.one.size, **_mark_fields(self.one, LAYER_TEXT))

    @property
    def wish(self) -> Wish:
        """The letters without a place, near the line."""
        one = self.one
        return Wish(self.ends, one.runs, clear=2.0, size=one.size, role=one.role, name=one.name)

    def take(self, room: Room) -> None:
        """Take the place."""
        for mark in (*self.marks(gap=True), self.letters):
            room.take(mark)

    def is_crossed(self, room: Room) -> bool:
        """Whether a line or other letters touch the letters."""
        return bool(crossings(self.box, room.segments)[0] + overlaps(self.box, room.letters)[0] > 1)


def place_bends(room: Room, bends: Sequence[AngleArc]) -> tuple[list[Placed], list[Wish]]:
    """Return the arcs of angles, which then have their places, and the wishes of their letters."""
    found: list[Placed] = []
    wishes: list[Wish] = []
    for one in bends:
        at = np.asarray(one.at, dtype=float)
        if abs(one.stop - one.start) < _SMALL:
            runs = (*one.runs, (" = 0" if abs(one.stop - one.start) < 1e-6 else " ≈ 0", "roman"))
            wishes.append(Wish(_ray(at, one.start, *_BESIDE), runs, size=one.size, role=one.role, name=one.name))
            continue
        radius = min(_RADII, key=lambda r: _arc_cost(room, one, r))
        marks = _arc_marks(one, radius)
        for mark in marks:
            room.take(mark)
        found.extend(marks)
        middle = (one.start + one.stop) / 2  # letters stand outside of the arc, in the middle if there is room
        points = Arc(at, radius, THIN, one.start, one.stop).points
        prefer = float(np.cos(middle)), float(np.sin(middle))
        wishes.append(Wish(points, one.runs, prefer, 2.0, one.size, role=one.role, name=one.name))
    return found, wishes


def _ray(at: Floats, angle: float, near: float, far: float) -> Floats:
    return at + np.outer((near, far), (np.cos(angle), np.sin(angle)))


def _arc_cost(room: Room, one: AngleArc, radius: float) -> float:
    """Return what an arc of this radius costs: it lies where it can be told from other lines."""
    points = Arc(np.asarray(one.at), radius, THIN, one.start, one.stop).points
    inner = points[1:-1] if len(points) > 4 else points
    crowded = sum(room.crowded(p, q) for p, q in pairwise(inner))
    return radius + 1.5 * crowded


def _arc_marks(one: AngleArc, radius: float) -> list[Placed]:
    named, at = _mark_fields(one), np.asarray(one.at, dtype=float)
    arc = Arc(at, radius, THIN, one.start, one.stop)
    marks: list[Placed] = [
        Stroke(_ray(at, angle, PIN + 0.6, radius + 9.0), HIDDEN, **named)
        for angle, wanted in zip((one.start, one.stop), one.lines, strict=True)
        if wanted
    ]
    head = min(_HEAD, 0.45 * radius * abs(one.stop - one.start))
    ordered = arc.points[::-1] if one.tip == 0 else arc.points
    marks.append(Arrow(ordered, THIN, both=one.tip is None, head=head, **named))
    return marks


# ----------------------------------------------------------------------------------------------------------------------

MARGIN: Final = 8.0
"""What stays white at the page's edges (pt)."""
_LINE: Final = 1.45
"""From one line of the legend to the next, in sizes of the type."""


def laid_out(marks: Iterable[Mark], title: str, description: str = "") -> Picture:
    """Return a picture of marks, those that want a place included; the same picture every time.

    Nothing is cut off: the page is as large as what is drawn.
    """
    given = list(marks)
    placed = [mark for mark in given if not isinstance(mark, (Wish, Measure, AngleArc, LegendLine))]
    room = Room(placed)  # type: ignore[arg-type]
    arcs, letters = place_bends(room, [mark for mark in given if isinstance(mark, AngleArc)])
    lines, told = place_measures(room, [mark for mark in given if isinstance(mark, Measure)])
    labels = place_labels(room, [*letters, *told, *(mark for mark in given if isinstance(mark, Wish))])
    drawn: list[Placed] = [*placed, *arcs, *lines, *labels]  # type: ignore[list-item]
    legend = _legend(drawn, [mark for mark in given if isinstance(mark, LegendLine)])
    marks = in_order([*drawn, *legend])
    left, bottom, right, top = bounds(box_of(part) for mark in marks for part in simple(mark))
    shift = np.array([MARGIN - left, MARGIN - bottom])
    width, height = right - left + 2 * MARGIN, top - bottom + 2 * MARGIN
    return Picture(width, height, [shifted_mark(mark, shift) for mark in marks], title, description)


def _legend(drawn: list[Placed], notes: list[LegendLine]) -> Iterator[TextMark]:
    """Yield the lines of a legend below all that is drawn, from its left edge on."""
    if not notes:
        return
    left, bottom, _, _ = bounds(box_of(part) for mark in drawn for part in simple(mark))
    for k, note in enumerate(notes, 1):
        at = np.array([left, bottom - 4.0 - _LINE * k * note.size])
        yield TextMark(at, note.runs, note.size, role=note.role, name=note.name, layer=note.layer)
