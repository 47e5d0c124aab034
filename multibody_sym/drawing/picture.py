"""What a picture is made of: lines, arcs, arrows, hatching and letters on a page, in points (1/72 inch), y upwards.

Every mark says what it belongs to by `role` (body, joint, rope, dimension, ...) and `name`. Marks of a greater `layer`
hide those of a smaller one; within a layer those of a greater `depth` (nearer to the reader) do, then those that come
later. `Wish`, `Measure`, `Bend` and `Note` are marks whose place the layout still has to find.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.drawing.lettering import DESCENT, HEIGHT, Run, width_of
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

ARC_STEP: Final = 7.5
"""Degrees between the points of an arc where it is looked at as a polyline: flat to 0.2 % of its radius."""


@dataclass(frozen=True)
class Pen:
    """How a line is drawn: width and dash lengths in points, a colour as #rrggbb."""

    width: float
    colour: str = "#000000"
    dash: tuple[float, ...] = ()


class Box(NamedTuple):
    """What a mark covers of the page; `kind` is text, line or fill."""

    kind: str
    left: float
    bottom: float
    right: float
    top: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Mark:
    """What all marks say: what they belong to, and what they hide."""

    role: str = ""
    name: str = ""
    layer: float = 0.0
    depth: float = 0.0


@dataclass(frozen=True, eq=False)
class Stroke(Mark):
    """A polyline or polygon through `points` (n, 2); `pen` None for a filled area without an outline."""

    points: Floats
    pen: Pen | None
    closed: bool = False
    fill: str | None = None


@dataclass(frozen=True, eq=False)
class Arc(Mark):
    """An arc of a circle, counterclockwise from `start` to `stop` in radians; a full circle from 0 to 2 pi."""

    centre: Floats
    radius: float
    pen: Pen | None
    start: float = 0.0
    stop: float = 2 * np.pi
    fill: str | None = None

    @property
    def full(self) -> bool:
        """Whether this is a whole circle."""
        return bool(abs(self.stop - self.start) >= 2 * np.pi - 1e-9)

    @property
    def points(self) -> Floats:
        """Return points along the arc, (n, 2)."""
        count = max(2, int(np.ceil(np.degrees(abs(self.stop - self.start)) / ARC_STEP)) + 1)
        angles = np.linspace(self.start, self.stop, count)
        return np.asarray(self.centre) + self.radius * np.column_stack((np.cos(angles), np.sin(angles)))


@dataclass(frozen=True, eq=False)
class Hatch(Mark):
    """A line through `points` (n, 2) with ticks on one side: +1 to the left of its direction, -1 to the right."""

    points: Floats
    pen: Pen
    side: int = 1
    tick: float = 5.0
    gap: float = 4.0
    line: bool = True


@dataclass(frozen=True, eq=False)
class Arrow(Mark):
    """A line through `points` (n, 2) with a filled head of `head` points length at its end, or at both ends."""

    points: Floats
    pen: Pen
    both: bool = False
    head: float = 6.0


@dataclass(frozen=True, eq=False)
class Text(Mark):
    """One line of letters; `at` is the left end of its baseline, `size` in points."""

    at: Floats
    runs: tuple[Run, ...]
    size: float
    colour: str = "#000000"

    @property
    def box(self) -> Box:
        """Return what the letters cover."""
        x, y = self.at
        low, high = DESCENT * self.size, HEIGHT * self.size
        return Box("text", float(x), float(y - low), float(x) + width_of(self.runs, self.size), float(y + high))


@dataclass(frozen=True, eq=False)
class Wish(Mark):
    """Letters that want a place near `about` (n, 2): one point, or a line along which any place will do.

    `prefer` is a direction from there in which they stand best, `clear` how far from it they stay in points.
    """

    about: Floats
    runs: tuple[Run, ...]
    prefer: tuple[float, float] | None = None
    clear: float = 3.0
    size: float = 10.0
    colour: str = "#000000"


@dataclass(frozen=True, eq=False)
class Measure(Mark):
    """A dimension line that wants a place beside the line from `a` to `b` (points of the page), with its letters."""

    a: Floats
    b: Floats
    runs: tuple[Run, ...]
    size: float = 10.0


@dataclass(frozen=True, eq=False)
class Bend(Mark):
    """An angle that wants an arc about `at`, counterclockwise from `start` to `stop` in radians, with its letters.

    `lines` says for each of the two sides whether a thin line must show it, because nothing drawn lies there;
    `tip` is the end (1 or 0) that gets an arrow head, None for both.
    """

    at: Floats
    start: float
    stop: float
    runs: tuple[Run, ...]
    lines: tuple[bool, bool] = (False, False)
    tip: int | None = None
    size: float = 10.0


@dataclass(frozen=True, eq=False)
class Note(Mark):
    """One line of letters of the legend, which stands below all that is drawn."""

    runs: tuple[Run, ...]
    size: float = 10.0


Placed = Stroke | Arc | Hatch | Arrow | Text
"""A mark that has its place."""
Simple = Stroke | Arc | Text
"""A mark that a backend draws."""
Wanted = Wish | Measure | Bend | Note


@dataclass(frozen=True, eq=False)
class Picture:
    """Marks on a page of `width` and `height` in points, in the order in which they are drawn."""

    width: float
    height: float
    marks: Sequence[Placed]
    title: str
    description: str = ""
    _simple: list[Simple] = field(default_factory=list, init=False, repr=False)

    @property
    def simple(self) -> Sequence[Simple]:
        """The marks as strokes, arcs and texts alone."""
        if not self._simple:
            self._simple.extend(s for mark in self.marks for s in simple(mark))
        return self._simple

    def boxes(self) -> dict[tuple[str, str], list[Box]]:
        """Return what each thing covers of the page, by role and name."""
        found: dict[tuple[str, str], list[Box]] = {}
        for mark in self.simple:
            found.setdefault((mark.role, mark.name), []).append(box_of(mark))
        return found


def in_order(marks: Iterable[Placed]) -> list[Placed]:
    """Return marks in the order of drawing: what hides others comes later."""
    return sorted(marks, key=lambda mark: (mark.layer, mark.depth))


def moved(mark: Placed, shift: Floats) -> Placed:
    """Return a mark farther by `shift` (2)."""
    if isinstance(mark, Arc):
        return replace(mark, centre=np.asarray(mark.centre) + shift)
    if isinstance(mark, Text):
        return replace(mark, at=np.asarray(mark.at) + shift)
    return replace(mark, points=np.asarray(mark.points) + shift)


def box_of(mark: Simple) -> Box:
    """Return what a mark covers, half the width of its pen included."""
    if isinstance(mark, Text):
        return mark.box
    points = np.asarray(mark.points)
    edge = mark.pen.width / 2 if mark.pen else 0.0
    (left, bottom), (right, top) = points.min(0) - edge, points.max(0) + edge
    return Box("fill" if mark.fill else "line", float(left), float(bottom), float(right), float(top))


def simple(mark: Placed) -> list[Simple]:
    """Return a mark as strokes, arcs and texts."""
    if isinstance(mark, Hatch):
        return _hatched(mark)
    if isinstance(mark, Arrow):
        return _with_heads(mark)
    return [mark]


def _named(mark: Mark) -> dict[str, Any]:
    return {"role": mark.role, "name": mark.name, "layer": mark.layer, "depth": mark.depth}


def _hatched(mark: Hatch) -> list[Simple]:
    """Return the line and its ticks, which lean back at 45 degrees and stay within the length of the line."""
    named, found = _named(mark), list[Simple]()
    points = np.asarray(mark.points, float)
    if mark.line:
        found.append(Stroke(points, mark.pen, **named))
    fine = Pen(min(mark.pen.width, 0.5), mark.pen.colour)
    left_over = mark.gap
    for start, end in pairwise(points):
        length = float(np.hypot(*(end - start)))
        if length == 0.0:
            continue
        along = (end - start) / length
        away = mark.side * np.array([-along[1], along[0]])
        for at in np.arange(left_over, length + 1e-9, mark.gap):
            foot = start + at * along
            found.append(Stroke(np.array([foot, foot + mark.tick * (away - along) / np.sqrt(2)]), fine, **named))
        left_over = max(0.0, (mark.gap - (length - left_over)) % mark.gap) or mark.gap
    return found


def _with_heads(mark: Arrow) -> list[Simple]:
    """Return the shaft, ended inside the heads, and the heads."""
    named, points = _named(mark), np.asarray(mark.points, float).copy()
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    size = min(mark.head, 0.8 * length / (2 if mark.both else 1))
    found: list[Simple] = []
    for end in (-1, 0) if mark.both else (-1,):
        tip, back = points[end].copy(), _back(points, end, size)
        away = tip - back
        away = away / (np.hypot(*away) or 1.0)
        across = np.array([-away[1], away[0]]) * size * 0.32
        foot = tip - size * away
        head = np.array([tip, foot + across, foot + 0.15 * size * away, foot - across])
        found.append(Stroke(head, None, closed=True, fill=mark.pen.colour, **named))
        points = _cut(points, end, size * 0.7)
    return [Stroke(points, mark.pen, **named), *found]


def _back(points: Floats, end: int, size: float) -> Floats:
    """Return the point of a polyline that lies `size` before one of its ends."""
    return np.asarray(_cut(points, end, size)[end])


def _cut(points: Floats, end: int, size: float) -> Floats:
    """Return a polyline shorter by `size` at one of its ends."""
    ordered = points if end == -1 else points[::-1]
    kept, left = [np.asarray(p) for p in ordered], size
    while len(kept) > 1:
        step = kept[-1] - kept[-2]
        length = float(np.hypot(*step))
        if length > left:
            kept[-1] = kept[-1] - step * (left / length)
            break
        left -= length
        if len(kept) == 2:
            kept[-1] = kept[-2] + step * 1e-3
            break
        kept.pop()
    cut = np.array(kept)
    return cut if end == -1 else cut[::-1]
