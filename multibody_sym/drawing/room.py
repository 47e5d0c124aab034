"""What of a page is taken: lines that no letters may touch, letters that nothing may touch, areas that are filled."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from multibody_sym.drawing.picture import Arc, Box, Placed, Simple, Text, simple
from multibody_sym.numerics.arrays import Floats

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
    if isinstance(mark, Text) or (mark.pen is None and not _head(mark)):
        return np.zeros((0, 4))
    points = np.asarray(mark.points, dtype=float)
    if isinstance(mark, Arc):
        return np.hstack((points[:-1], points[1:]))
    around = np.vstack((points, points[:1])) if mark.closed else points
    return np.hstack((around[:-1], around[1:]))


def _head(mark: Simple) -> bool:
    """Whether an area without an outline is a dark mark of its own, such as an arrow's head, and no body's surface."""
    return not isinstance(mark, Text) and mark.fill is not None and int(mark.fill[1:3], 16) < 0xC0


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
    found: Floats = (~apart).sum(1).astype(float)
    return found


def overlaps(boxes: Floats, others: Floats) -> Floats:
    """Return how many of the others (n, 4) each of the boxes (m, 4) meets: (m,)."""
    if not len(boxes) or not len(others):
        return np.zeros(len(boxes))
    beyond = (boxes[:, None, :2] >= others[None, :, 2:]) | (boxes[:, None, 2:] <= others[None, :, :2])
    apart = beyond[..., 0] | beyond[..., 1]
    found: Floats = (~apart).sum(1).astype(float)
    return found


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
            if isinstance(part, Text):
                self._letters.append(part.box[1:])
            else:
                self._segments.append(segments_of(part))
                if part.role in _ACTING:
                    self._acting.append(self._segments[-1])
                if part.fill is not None and len(part.points) > 2:
                    self._areas.append(np.asarray(part.points))

    def forget(self, letters: Text) -> None:
        """Let letters give up their place."""
        self._letters.remove(letters.box[1:])

    def near(self, about: Floats, reach: float) -> Floats:
        """Return the lines within a distance of points (n, 2)."""
        lines = self.segments
        if len(self._reaches) != len(lines):
            ends = lines[:, :2], lines[:, 2:]
            self._reaches = np.hstack((np.maximum(*ends), -np.minimum(*ends)))
        low, high = about.min(0) - reach, about.max(0) + reach
        found: Floats = lines[(self._reaches >= np.array([*low, *-high])).all(1)]
        return found

    def touched(self, boxes: Floats, lines: Floats) -> Floats:
        """Return how many lines and letters each of the boxes (m, 4) would touch, with some air around: (m,)."""
        wide = boxes + AIR * np.array([-1.0, -1.0, 1.0, 1.0])
        return crossings(wide, lines) + overlaps(wide, self.letters)

    def acts_across(self, start: Floats, stop: Floats) -> bool:
        """Return whether a line crosses the arrow of a load, a spring or a rope."""
        return bool(self._acting) and crossed(start, stop, np.vstack(self._acting)) > 0

    def covered(self, points: Floats) -> Floats:
        """Return in how many filled areas each of the points (m, 2) lies: (m,)."""
        total = np.zeros(len(points))
        for area in self._areas:
            total += _inside(area, points)
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


def crossed(start: Floats, stop: Floats, lines: Floats) -> int:
    """Return how many lines (n, 4) a line crosses."""
    one, two, way = lines[:, :2], lines[:, 2:], stop - start

    def turn(a: Floats, b: Floats) -> Floats:
        found: Floats = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
        return found

    apart = turn(way, one - start) * turn(way, two - start) < 0.0
    across = turn(two - one, start - one) * turn(two - one, stop - one) < 0.0
    return int((apart & across).sum())


def distances(points: Floats, lines: Floats) -> Floats:
    """Return the distances (m, n) of points (m, 2) from segments (n, 4)."""
    start, along = lines[:, :2], lines[:, 2:] - lines[:, :2]
    size = np.maximum((along**2).sum(1), 1e-12)
    offset = points[:, None] - start[None]
    part = np.clip((offset * along[None]).sum(-1) / size, 0.0, 1.0)
    found: Floats = np.linalg.norm(offset - part[..., None] * along[None], axis=-1)
    return found


def _inside(area: Floats, points: Floats) -> Floats:
    """Return 1 for each of the points (m, 2) that lies in a polygon (n, 2), else 0."""
    x, y = points[:, 0][:, None], points[:, 1][:, None]
    (ax, ay), (bx, by) = area.T, np.roll(area, -1, axis=0).T
    straddles = (ay[None] > y) != (by[None] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = ax + (y - ay) * (bx - ax) / (by - ay)
    found: Floats = ((straddles & (x < cut)).sum(1) % 2).astype(float)
    return found


def box_at(centre: Floats, wide: float, high: float) -> Floats:
    """Return boxes (m, 4) of a size about centres (m, 2)."""
    half = np.array([wide, high]) / 2
    found: Floats = np.hstack((centre - half, centre + half))
    return found


def bounds(boxes: Iterable[Box]) -> tuple[float, float, float, float]:
    """Return the left, bottom, right and top of all boxes; of none a point."""
    table = np.array([box[1:] for box in boxes]).reshape(-1, 4)
    if not len(table):
        return 0.0, 0.0, 0.0, 0.0
    left, bottom = table[:, :2].min(0)
    right, top = table[:, 2:].max(0)
    return float(left), float(bottom), float(right), float(top)
