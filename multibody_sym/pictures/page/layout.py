"""Places on the page for labels, dimension lines and angles, clear of each other; the page grows around all of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.pictures.page.picture import (
    BLACK,
    COORDINATE,
    DATUM,
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
    Box,
    LegendLine,
    Mark,
    Measure,
    Picture,
    Placed,
    Run,
    Simple,
    Stroke,
    TextMark,
    Wish,
    box_of,
    fields_of,
    in_order,
    printable,
    shifted_mark,
    simple,
    width_of,
)
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# What of a page is taken: lines that no letters may touch, letters that nothing may touch, areas that are filled.


AIR: Final = 1.2
"""Points that stay free between letters and lines."""
_CLOSE: Final = 1.6
"""Within this distance (pt) two lines are hard to tell apart."""
_ACTING: Final = frozenset(("force", "torque", "impulse", "spring", "damper", "spring_damper", "rope"))
"""What dimension lines stay clear of."""
_STRIDE: Final = 3.0
"""Distance (pt) of the places at which a line is compared with others."""


def segments_of(mark: Simple) -> Floats:
    """Return the lines of a mark as (n, 4): from x, y to x, y; none of letters and of areas without an outline."""
    if isinstance(mark, TextMark):
        return np.zeros((0, 4))
    dark = mark.fill is not None and int(mark.fill[1:3], 16) < 0xC0  # such as the head of an arrow
    if mark.pen is None and not dark:
        return np.zeros((0, 4))
    points = np.asarray(mark.points, dtype=float)
    around = np.vstack((points, points[:1])) if mark.closed else points
    return np.hstack((around[:-1], around[1:]))


def crossings(boxes: Floats, segments: Floats) -> Floats:
    """Return how many of the segments (n, 4) meet each of the boxes (m, 4) of left, bottom, right, top: (m,)."""
    if not len(boxes) or not len(segments):
        return np.zeros(len(boxes))
    centre, half = (boxes[:, :2] + boxes[:, 2:]) / 2, (boxes[:, 2:] - boxes[:, :2]) / 2
    middle, reach = (segments[:, :2] + segments[:, 2:]) / 2, (segments[:, 2:] - segments[:, :2]) / 2
    d = middle[None] - centre[:, None]
    wide = np.abs(d) > half[:, None] + np.abs(reach)[None]
    apart = wide[..., 0] | wide[..., 1]
    turn = np.abs(reach[None, :, 0] * d[..., 1] - reach[None, :, 1] * d[..., 0])
    apart |= turn > half[:, None, 0] * np.abs(reach)[None, :, 1] + half[:, None, 1] * np.abs(reach)[None, :, 0]
    return np.asarray((~apart).sum(1).astype(float))


def overlaps(boxes: Floats, others: Floats) -> Floats:
    """Return how many of the others (n, 4) each of the boxes (m, 4) meets: (m,)."""
    if not len(boxes) or not len(others):
        return np.zeros(len(boxes))
    beyond = (boxes[:, None, :2] >= others[None, :, 2:]) | (boxes[:, None, 2:] <= others[None, :, :2])
    apart = beyond[..., 0] | beyond[..., 1]
    return np.asarray((~apart).sum(1).astype(float))


_SPACE: Final = 4.0
"""How far letters stand from others on their line (pt): closer ones are read as a product."""


class Room:
    """A page on which marks take their places one after the other."""

    def __init__(self, marks: Iterable[Placed]) -> None:
        self._segments: list[Floats] = []
        self._letters: list[tuple[float, ...]] = []
        self._areas: list[Floats] = []
        self._acting: list[Floats] = []
        self._reaches = np.zeros((0, 4))
        for mark in marks:
            self.take(mark)

    def copied(self) -> Room:
        """Return a room with the same marks, in which others can be tried."""
        found = Room(())
        found._segments, found._letters, found._areas = [*self._segments], [*self._letters], [*self._areas]
        found._acting = [*self._acting]
        return found

    @property
    def segments(self) -> Floats:
        """All lines (n, 4)."""
        if len(self._segments) > 1:
            self._segments = [np.vstack(self._segments)]
        return self._segments[0] if self._segments else np.zeros((0, 4))

    @property
    def letters(self) -> Floats:
        """The boxes of all letters (n, 4)."""
        return np.array(self._letters).reshape(-1, 4)

    def take(self, mark: Placed) -> None:
        """Let a mark take its place."""
        for part in simple(mark):
            if isinstance(part, TextMark):
                self._letters.append(part.box[1:])
            else:
                self._segments.append(segments_of(part))
                if part.role in _ACTING:
                    self._acting.append(self._segments[-1])
                if part.fill is not None and len(part.points) > 2:
                    self._areas.append(np.asarray(part.points))

    def forget(self, letters: TextMark) -> None:
        """Let letters give up their place."""
        self._letters.remove(letters.box[1:])

    def near(self, about: Floats, reach: float) -> Floats:
        """Return the lines within a distance of points (n, 2)."""
        lines = self.segments
        if len(self._reaches) != len(lines):
            ends = lines[:, :2], lines[:, 2:]
            self._reaches = np.hstack((np.maximum(*ends), -np.minimum(*ends)))
        low, high = about.min(0) - reach, about.max(0) + reach
        return np.asarray(lines[(self._reaches >= np.array([*low, *-high])).all(1)])

    def touched(self, boxes: Floats, lines: Floats) -> Floats:
        """Return how many lines and letters each of the boxes (m, 4) would touch, with some air around: (m,)."""
        wide = boxes + AIR * np.array([-1.0, -1.0, 1.0, 1.0])
        spaced = boxes + np.array([-_SPACE, -AIR, _SPACE, AIR])
        return crossings(wide, lines) + overlaps(spaced, self.letters)

    def acts_across(self, start: Floats, stop: Floats) -> bool:
        """Return whether a line crosses the arrow of a load, a spring or a rope."""
        return bool(self._acting) and crossing_count(start, stop, np.vstack(self._acting)) > 0

    def covered(self, points: Floats) -> Floats:
        """Return in how many filled areas each of the points (m, 2) lies: (m,)."""
        total = np.zeros(len(points))
        for area in self._areas:
            x, y = points[:, 0][:, None], points[:, 1][:, None]
            (ax, ay), (bx, by) = area.T, np.roll(area, -1, axis=0).T
            straddles = (ay[None] > y) != (by[None] > y)
            with np.errstate(divide="ignore", invalid="ignore"):
                cut = ax + (y - ay) * (bx - ax) / (by - ay)
            total += (straddles & (x < cut)).sum(1) % 2
        return total

    def crowded(self, start: Floats, stop: Floats) -> float:
        """Return the length of a line (pt) along which another is hard to tell from it; letters on it count tenfold."""
        length = float(np.hypot(*(stop - start)))
        count = max(2, int(length / _STRIDE))
        places = start + np.linspace(0.0, 1.0, count)[:, None] * (stop - start)
        lines = self.near(places, _CLOSE)
        close = (distances(places, lines).min(1) < _CLOSE).sum() if len(lines) else 0
        text = crossings(self.letters, np.array([[*start, *stop]])).sum()
        return float(close * _STRIDE + 40.0 * text)


def crossing_count(start: Floats, stop: Floats, lines: Floats) -> int:
    """Return how many lines (n, 4) a line crosses."""
    one, two, way = lines[:, :2], lines[:, 2:], stop - start

    def turn(a: Floats, b: Floats) -> Floats:
        return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])

    apart = turn(way, one - start) * turn(way, two - start) < 0.0
    across = turn(two - one, start - one) * turn(two - one, stop - one) < 0.0
    return int((apart & across).sum())


def distances(points: Floats, lines: Floats) -> Floats:
    """Return the distances (m, n) of points (m, 2) from segments (n, 4)."""
    start, along = lines[:, :2], lines[:, 2:] - lines[:, :2]
    size = np.maximum((along**2).sum(1), 1e-12)
    offset = points[:, None] - start[None]
    part = np.clip((offset * along[None]).sum(-1) / size, 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - part[..., None] * along[None], axis=-1))


def box_at(centre: Floats, wide: float, high: float) -> Floats:
    """Return boxes (m, 4) of a size about centres (m, 2)."""
    half = np.array([wide, high]) / 2
    return np.asarray(np.hstack((centre - half, centre + half)))


def bounds(boxes: Iterable[Box]) -> tuple[float, float, float, float]:
    """Return the left, bottom, right and top of all boxes; of none a point."""
    table = np.array([box[1:] for box in boxes]).reshape(-1, 4)
    if not len(table):
        return 0.0, 0.0, 0.0, 0.0
    left, bottom = table[:, :2].min(0)
    right, top = table[:, 2:].max(0)
    return float(left), float(bottom), float(right), float(top)


# ----------------------------------------------------------------------------------------------------------------------
# Places for labels: candidates around what they name, the cheapest that touches nothing; a leader where it is far.


STEPS: Final = (0.0, 2.5, 5.5, 9.0, 13.0)
"""Distances (pt) beyond the nearest at which a label is tried first."""
FURTHER: Final = ((18.0, 25.0), (34.0, 46.0), (62.0, 85.0))
"""Rings that follow until one has a free place; letters without one stand in the legend."""
ANGLES: Final = np.radians([45, 90, 135, 0, 180, 315, 225, 270, 22, 67, 112, 157, 337, 292, 247, 202])
"""Directions from a point, those that a book takes first first."""
_ALONG: Final = (0.5, 0.38, 0.62, 0.25, 0.75, 0.12, 0.88)
"""Where along a line a label is tried."""
_SHORT: Final = 2.0
"""A line below this length (pt) is a point: it has no sides."""
LEADER: Final = 11.0
"""From this distance (pt) on a thin line leads to what a label names."""
_TURNED: Final = 7.0
"""Cost of a place straight opposite to the preferred one, halved; in points of distance."""
_MISLEADING: Final = 12.0
"""Cost of a place nearer to what another label names."""
FOREIGN: Final = 9.0
"""Cost of a place on something filled."""


class Candidates:
    """Places for one label: centres (m, 2), where each starts from (m, 2), its distance and cost (m,)."""

    def __init__(self, wish: Wish, steps: Sequence[float]) -> None:
        self.wish = wish
        self.wide = width_of(wish.runs, wish.size)
        self.high = (HEIGHT + DESCENT) * wish.size
        rows = list(_starts(np.asarray(wish.about, dtype=float), steps))
        base, way, step, extra = (np.array(column) for column in zip(*rows, strict=True))
        half = np.array([self.wide, self.high]) / 2
        self.base = base
        self.distance = step
        reach = (wish.clear + step)[:, None]
        self.centres = base + way * reach + np.clip(1.5 * way, -1.0, 1.0) * half
        turned = np.zeros(len(step))
        if wish.prefer is not None:
            liked = np.asarray(wish.prefer) / (np.hypot(*wish.prefer) or 1.0)
            turned = _TURNED * (1.0 - way @ liked)
        self.cost = step + extra + turned
        if wish.inside is not None:
            self.centres = np.vstack((wish.inside, self.centres))
            self.base = np.vstack((wish.inside, base))
            self.distance = np.insert(step, 0, 0.0)
            self.cost = np.insert(self.cost, 0, -FOREIGN - 1.0)
        self.boxes = box_at(self.centres, self.wide, self.high)


def _starts(about: Floats, steps: Sequence[float]) -> Iterator[tuple[Floats, Floats, float, float]]:
    """Yield places to start from, directions, distances and costs of their own."""
    short = len(about) == 1 or float(np.hypot(*np.diff(about, axis=0).T).sum()) < _SHORT
    if short or steps[0] > 0.0:
        base = about[0] if short else _point_along(about, 0.5)[0]
        for step in steps:
            for i, angle in enumerate(ANGLES):
                yield base, np.array([np.cos(angle), np.sin(angle)]), step, 0.15 * i
    if short:
        return
    for rank, part in enumerate(_ALONG):
        at, along = _point_along(about, part)
        for side in (1.0, -1.0):
            way = side * np.array([-along[1], along[0]])
            slight = 0.2 * (way[1] < -1e-9) + 0.1 * (way[0] < -1e-9)
            for step in steps:
                yield at, way, step, 0.8 * rank + slight


def _point_along(line: Floats, part: float) -> tuple[Floats, Floats]:
    """Return the point at a part of a polyline's length, and the unit direction there."""
    steps = np.diff(line, axis=0)
    lengths = np.hypot(*steps.T)
    ends = np.cumsum(lengths)
    goal = part * ends[-1]
    i = min(int(np.searchsorted(ends, goal)), len(steps) - 1)
    along = steps[i] / (lengths[i] or 1.0)
    if lengths[i] == 0.0:
        along = np.array([1.0, 0.0])
    return line[i] + (goal - (ends[i] - lengths[i])) * along, along


def place_labels(room: Room, wishes: Sequence[Wish]) -> tuple[list[Placed], list[Wish]]:
    """Return the letters and leaders of all wishes with a place in the room, and the wishes that find none.

    Those with the fewest free places come first, so that others leave them what they need; where that leaves some
    without a place those of the lowest rank come first.
    """
    tried = [Candidates(wish, STEPS) for wish in wishes]
    free = [int((room.touched(one.boxes, _lines(room, one)) == 0).sum()) for one in tried]
    order = sorted(range(len(wishes)), key=lambda i: (free[i] > 0, free[i], i))
    found, lost = _placed_in_order(room.copied(), tried, order)
    if lost:
        order = sorted(order, key=lambda i: wishes[i].rank)
        found, lost = _placed_in_order(room.copied(), tried, order)
    return found, [wishes[i] for i in lost]


def _placed_in_order(room: Room, tried: list[Candidates], order: Sequence[int]) -> tuple[list[Placed], list[int]]:
    found: list[Placed] = []
    lost: list[int] = []
    for i in order:
        others = [np.asarray(one.wish.about, dtype=float) for j, one in enumerate(tried) if j != i]
        marks = _marks_at_best(room, tried[i], others)
        for steps in FURTHER:  # away from everything
            marks = marks or _marks_at_best(room, Candidates(tried[i].wish, steps), others)
        for mark in marks:
            room.take(mark)
        found.extend(marks)
        lost += [] if marks else [i]
    return found, lost


def _lines(room: Room, one: Candidates) -> Floats:
    reach = float(one.distance.max()) + one.wish.clear + one.wide + 2 * one.high
    about = np.asarray(one.wish.about, dtype=float)
    return room.near(about if one.wish.inside is None else np.vstack((about, one.wish.inside)), reach)


def _marks_at_best(room: Room, one: Candidates, others: Sequence[Floats]) -> list[Placed]:
    """Return the letters at the cheapest free candidate, with a leader where they are far; nothing if none is free."""
    lines = _lines(room, one)
    free = np.flatnonzero(room.touched(one.boxes, lines) == 0)
    if not len(free):
        return []
    # places that seem to belong to something else cost more
    centres = one.centres[free]
    foreign = FOREIGN * np.minimum(1.0, room.covered(centres))
    own = _apart(centres, np.asarray(one.wish.about, dtype=float))
    for other in others:
        foreign += np.where(_apart(centres, other) < own, _MISLEADING / 2, 0.0)
    cost = one.cost[free] + foreign
    best: tuple[float, int, Floats | None] | None = None
    for k in np.argsort(cost, kind="stable"):
        i = int(free[k])
        if best is not None and cost[k] >= best[0]:
            break
        leader = None  # a line to a label that is far
        if one.distance[i] >= LEADER:
            base, box = one.base[i], one.boxes[i]
            end = np.clip(base, box[:2] - 1.5, box[2:] + 1.5)
            way = (end - base) / (np.hypot(*(end - base)) or 1.0)
            leader = np.array([base + min(one.wish.clear, 2.0) * way, end])
        if leader is None:
            dear = cost[k]
        elif crossings(room.letters, leader.reshape(1, 4)).any():  # over letters it never goes
            continue
        else:
            dear = cost[k] + 0.5 * room.crowded(*leader)
        best = min(best or (dear, i, leader), (dear, i, leader), key=lambda tried: tried[0])
    if best is None:
        return []
    _, i, leader = best
    wish, box = one.wish, one.boxes[i]
    at = np.array([box[0], box[1] + DESCENT * wish.size])
    marks: list[Placed] = [TextMark(at, wish.runs, wish.size, wish.colour, **fields_of(wish, LAYER_TEXT))]
    if leader is not None:
        marks.append(Stroke(leader, replace(THIN, colour=wish.colour), **fields_of(wish, LAYER_TEXT)))
    return marks


def _apart(points: Floats, about: Floats) -> Floats:
    """Return the distances (m,) of points (m, 2) from a point or polyline (n, 2)."""
    line = np.vstack((about, about)) if len(about) == 1 else about
    return np.asarray(distances(points, np.hstack((line[:-1], line[1:]))).min(1))


# ----------------------------------------------------------------------------------------------------------------------
# The page: dimension lines, angles and labels find places that touch nothing; then the page grows around all of it.


# ----------------------------------------------------------------------------------------------------------------------
# Dimension lines beside what they measure, with extension lines and arrows; angles as arcs with letters.


_OFFSETS: Final = (13.0, 17.0, 22.0, 28.0, 35.0, 43.0, 52.0, 62.0, 74.0, 88.0, 105.0, 125.0, 150.0, 180.0, 220.0, 270.0)
"""Distances (pt) of a dimension line from what it measures that are tried."""
_RADII: Final = (18.0, 23.0, 29.0, 36.0, 44.0, 14.0, 54.0, 66.0)
"""Radii (pt) of the arc of an angle that are tried."""
_TINY: Final = 6.0
"""Cost of a point by which an arc is too short for its head; in points of radius."""
_HEAD: Final = 4.5
_OUTSIDE: Final = 9.0
"""Length (pt) of the lines outside of a dimension too short for its arrows."""
_GAP, _BEYOND = 3.0, 2.5
"""What an extension line leaves free at what is measured, and how far it goes past the dimension line."""
_PARTS: Final = (0.5, 0.34, 0.66)
"""Where along a dimension line its letters are tried."""
_OFF_MIDDLE: Final = 12.0
"""Cost of letters at the end of their line, doubled; in points of distance."""
_WITHIN: Final = 24.0
"""Cost of a line on something filled; in points of distance."""
_ACROSS: Final = 40.0
"""Cost of a line across a load, a spring or a rope; in points of distance."""
_SMALL: Final = np.radians(4.0)
"""An angle below is told in letters: an arc of it could not be seen."""
_BESIDE: Final = (4.0, 9.0)
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
        # none costs less than its distance, so that those further out need no look
        best = _Line(room, one, _OFFSETS[0], _PARTS[0])
        for part in _PARTS:
            for offset in _OFFSETS:
                if offset + _OFF_MIDDLE * abs(part - 0.5) > best.cost:
                    break
                for side in (1, -1):
                    best = min(best, _Line(room, one, offset * side, part, best.cost), key=lambda line: line.cost)
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


class _Line:
    """A dimension line at an offset to the left of the direction from a to b, its letters at a part of its length."""

    def __init__(self, room: Room, one: Measure, offset: float, part: float, limit: float = np.inf) -> None:
        self.one = one
        self.feet = np.array([one.a, one.b], dtype=float)
        self.length = float(np.hypot(*(self.feet[1] - self.feet[0])))
        self.along = (self.feet[1] - self.feet[0]) / self.length
        self.away = np.sign(offset) * np.array([-self.along[1], self.along[0]])
        self.feet = self.feet + one.beyond * self.away
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
        return np.asarray(end + way * self.along * (self.gap / 2 + (_OUTSIDE + 1.0 if self._short else 2.0)))

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
        if cost < limit:
            cost += _WITHIN * float(room.covered(self.centre[None])[0] > 0)
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
        named = fields_of(self.one, LAYER_ARROW)
        found: list[Placed] = [Stroke(line, THIN, **named) for line in self._extensions()]
        if self.one.datum:
            found.append(Arc(self.ends[0], DATUM, None, fill=BLACK, **named))
        if self.inside and gap:
            half = self.gap / 2 * self.along
            tails, tips = [self.centre - half, self.centre + half], self.ends
        elif self._short:
            tails, tips = [self.ends[0] - _OUTSIDE * self.along, self.ends[1] + _OUTSIDE * self.along], self.ends
        else:
            return [*found, Arrow(self.ends, COORDINATE, both=not self.one.datum, head=_HEAD, **named)]
        if self.one.datum:
            found.append(Stroke(np.array([tails[0], tips[0]]), COORDINATE, **named))
            tails, tips = tails[1:], tips[1:]
        return [*found, *(Arrow(np.array(pair), THIN, head=_HEAD, **named) for pair in zip(tails, tips, strict=True))]

    @property
    def letters(self) -> TextMark:
        at = np.array([self.box[0, 0], self.box[0, 1] + DESCENT * self.one.size])
        return TextMark(at, self.one.runs, self.one.size, **fields_of(self.one, LAYER_TEXT))

    @property
    def wish(self) -> Wish:
        """The letters without a place, near the line."""
        one = self.one
        return Wish(self.ends, one.runs, clear=2.0, size=one.size, role=one.role, name=one.name)

    def take(self, room: Room) -> None:
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
        radius = min((r for r in _RADII if r <= one.reach), key=lambda r: _arc_cost(room, one, r))
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
    """Return what an arc of this radius costs: it lies where it can be told from other lines, and has its head."""
    points = Arc(np.asarray(one.at), radius, THIN, one.start, one.stop).points
    inner = points[1:-1] if len(points) > 4 else points
    crowded = sum(room.crowded(p, q) for p, q in pairwise(inner))
    lacking = max(0.0, 2.0 * _HEAD - radius * abs(one.stop - one.start))
    return radius + 1.5 * crowded + _TINY * lacking


def _arc_marks(one: AngleArc, radius: float) -> list[Placed]:
    named, at = fields_of(one, LAYER_ARROW), np.asarray(one.at, dtype=float)
    arc = Arc(at, radius, THIN, one.start, one.stop)
    marks: list[Placed] = [
        Stroke(_ray(at, angle, PIN + 0.6, radius + 9.0), HIDDEN, **named)
        for angle, wanted in zip((one.start, one.stop), one.lines, strict=True)
        if wanted
    ]
    if one.tip is None:
        return [*marks, replace(arc, **named)]
    head = min(_HEAD, 0.45 * radius * abs(one.stop - one.start))
    return [*marks, Arrow(arc.points[::-1] if one.tip == 0 else arc.points, THIN, head=head, **named)]


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
    labels, lost = place_labels(room, [*letters, *told, *(mark for mark in given if isinstance(mark, Wish))])
    drawn: list[Placed] = [*placed, *arcs, *lines, *labels]  # type: ignore[list-item]
    shown = [mark.runs for mark in (*lines, *labels) if isinstance(mark, TextMark)]
    lost = sorted((wish for wish in lost if wish.runs not in shown), key=lambda wish: wish.rank)
    entries = [(*wish.runs, (f" ({printable(wish.name)})", "small")) for wish in lost]
    more = legend_lines("no room", "without room: ", entries, len(entries)) if entries else ()
    # the legend stands below all that is drawn, from its left edge on
    begin, under, _, _ = bounds(box_of(part) for mark in drawn for part in simple(mark))
    legend = []
    for k, note in enumerate([*more, *(mark for mark in given if isinstance(mark, LegendLine))], 1):
        at = np.array([begin, under - 4.0 - _LINE * k * note.size])
        legend.append(TextMark(at, note.runs, note.size, role=note.role, name=note.name, layer=note.layer))
    marks = in_order([*drawn, *legend])
    left, bottom, right, top = bounds(box_of(part) for mark in marks for part in simple(mark))
    shift = np.array([MARGIN - left, MARGIN - bottom])
    width, height = right - left + 2 * MARGIN, top - bottom + 2 * MARGIN
    return Picture(width, height, [shifted_mark(mark, shift) for mark in marks], title, description)


_WIDE: Final = 250.0
"""How wide a line of the legend is at most (pt)."""
_MOST: Final = 6
"""So many lines words and their entries have at most."""
_MORE: Final = ((", ..", "roman"),)
Runs = tuple[Run, ...]


def legend_lines(name: str, words: str, entries: Sequence[Runs], most: int = _MOST) -> Iterator[LegendLine]:
    """Yield words and entries behind them as `most` lines that are no wider than a legend, named `name`."""
    line: list[Run] = [(words, "roman")]
    count = held = 0
    for k, entry in enumerate(entries):
        parted = [*entry, ("," if k + 1 < len(entries) else "", "roman")]
        apart: list[Run] = [(" ", "roman")] if held else []
        if held and width_of([*line, *apart, *parted], LegendLine.size) > _WIDE:
            count += 1
            if count == most:
                yield _line(name, [*line, *_MORE])
                return
            yield _line(name, line)
            line, held, apart = [], 0, []
        line += [*apart, *parted]
        held += 1
    yield _line(name, line)


def _line(name: str, runs: Sequence[Run]) -> LegendLine:
    return LegendLine(tuple(run for run in runs if run[0]), role="legend", name=name, layer=float(LAYER_TEXT))
