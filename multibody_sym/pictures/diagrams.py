"""Diagrams to scale: N, V and M along a beam as signed areas, and plans of velocities and accelerations.

In: numbers along beams with their letters, vectors of points. Out: a Picture, or one with them below another.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.page.picture import (
    HIDDEN,
    INK,
    THIN,
    VELOCITY,
    Arc,
    Arrow,
    Picture,
    Placed,
    Run,
    Stroke,
    TextMark,
    formula,
    shifted_mark,
    small,
    width_of,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_WIDTH, _HEIGHT, _GAP, _MARGIN, _SIDE = 260.0, 44.0, 10.0, 8.0, 30.0
"""Points: a beam's length, the largest value, between areas, around all, and beside the base line."""
_PLAN: Final = 150.0
"""Points of the longest vector of a plan."""
_SIZE: Final = 9.0
_ROOM: Final = 16.0
"""Points of height and width that a sign needs."""
_FILL: Final = "#dfe8f2"
_FLAT: Final = 1e-9
"""The part of the largest number of its kind below which a value is zero."""
_APART: Final = 0.02
"""The part of a beam within which values share a place."""


@dataclass(frozen=True, eq=False)
class DiagramValue:
    """A value at the place `x` (m), with the text that stands there."""

    x: float
    y: float
    text: str


@dataclass(frozen=True, eq=False)
class Diagram:
    """What `name` says of `beam` along x (m): y over x stretch by stretch, and `values` that are named.

    The sides of numbers are the same for all: positive ones stand above, or below where it `hangs`, as moments do on
    the side of tension.
    """

    beam: str
    name: str
    curves: Sequence[tuple[Floats, Floats]]
    values: Sequence[DiagramValue]
    hangs: bool = False

    @property
    def ends(self) -> tuple[float, float]:
        """Where the beam begins and ends (m)."""
        return float(self.curves[0][0][0]), float(self.curves[-1][0][-1])

    @property
    def largest(self) -> float:
        """The size of the largest number."""
        return max(float(np.abs(y).max()) for _, y in self.curves)


@dataclass(frozen=True, eq=False)
class VectorPlan:
    """The velocities or accelerations (`name`) of `points` of a linkage in the plane, all from one origin.

    `joined` are pairs of points of one body, whose difference is drawn.
    """

    name: str
    unit: str
    points: Mapping[str, tuple[float, float]]
    joined: Sequence[tuple[str, str]]

    @property
    def _tips(self) -> dict[str, Floats]:
        scale = _PLAN / max(float(np.hypot(*v)) for v in self.points.values())
        return {name: scale * np.array(v) for name, v in self.points.items()}

    @property
    def _box(self) -> tuple[Floats, Floats]:
        every = np.array([*self._tips.values(), np.zeros(2)])
        return every.min(0), every.max(0)

    @property
    def high(self) -> float:
        """How far it reaches above its origin, letters included."""
        return float(self._box[1][1]) + 2 * _SIZE

    @property
    def low(self) -> float:
        """How far it reaches below its origin, as a negative number."""
        return float(self._box[0][1]) - 2 * _SIZE

    @property
    def words(self) -> str:
        """The plan in words."""
        told = (f"{name} {float(np.hypot(*v)):.4g} {self.unit}" for name, v in self.points.items())
        return f"Plan of {self.name}: {', '.join(told)}."

    def marks(self) -> Iterator[Placed]:
        """Yield the vectors from their origin, what points of one body differ by, and names at the tips."""
        named: Any = {"role": "plan", "name": self.name}
        low, high = self._box
        at = np.array([(_WIDTH - low[0] - high[0]) / 2, 0.0])
        for one, other in self.joined:
            yield Stroke(np.array([self._tips[one], self._tips[other]]) + at, HIDDEN, **named)
        for name, tip in self._tips.items():
            if np.hypot(*tip) < 1.0:
                continue
            yield Arrow(np.array([np.zeros(2), tip]) + at, VELOCITY, **named)
            runs = small(f"{name}: {float(np.hypot(*self.points[name])):.4g} {self.unit.replace('^2', _RAISED['2'])}")
            wide, side = width_of(runs, _SIZE), tip / np.hypot(*tip)
            left = tip[0] + (4.0 if side[0] >= 0.0 else -4.0 - wide)
            yield TextMark(np.array([left, tip[1] + 4.0 * side[1] - 3.0]) + at, runs, _SIZE, **named)
        yield Arc(at, 1.6, None, fill=INK.colour, **named)


def below_figure(picture: Picture | None, diagrams: Sequence[Diagram | VectorPlan]) -> Picture:
    """Return a picture with diagrams below it, or of these alone; those of one name have one scale."""
    areas = [each for each in diagrams if isinstance(each, Diagram)]
    several = len({each.beam for each in areas}) > 1
    rows = [_Area(each, _scale(each, areas), named=several) if isinstance(each, Diagram) else each for each in diagrams]
    side = max([_SIDE, *(width_of(small(each.beam), _SIZE) for each in areas if several)])
    heights = [row.high - row.low + _GAP for row in rows]
    wide = _WIDTH + 2 * (_MARGIN + side)
    width = max(wide, picture.width if picture is not None else 0.0)
    total = sum(heights) + 2 * _MARGIN
    height = total + (picture.height if picture is not None else 0.0)
    marks: list[Placed] = []
    if picture is not None:
        marks += [shifted_mark(mark, np.array([(width - picture.width) / 2, total])) for mark in picture.marks]
    top = total - _MARGIN
    for row, room in zip(rows, heights, strict=True):
        at = np.array([(width - _WIDTH) / 2, top - _GAP / 2 - row.high])
        marks += [shifted_mark(mark, at) for mark in row.marks()]
        top -= room
    told = " ".join(row.words for row in rows)
    title = picture.title if picture is not None else "diagrams"
    description = f"{picture.description} {told}" if picture is not None else told
    return Picture(width, height, marks, title, description)


def _scale(diagram: Diagram, diagrams: Sequence[Diagram]) -> float:
    """Return points for one unit, the same for all of a name."""
    largest = max(each.largest for each in diagrams if each.name == diagram.name)
    return _HEIGHT / largest if largest > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class _Area:
    """A diagram on the page, its base line from (0, 0) to (_WIDTH, 0); `named`: with the name of its beam."""

    diagram: Diagram
    scale: float
    named: bool = False

    @property
    def _sign(self) -> float:
        return -1.0 if self.diagram.hangs else 1.0

    @property
    def high(self) -> float:
        """How far it reaches above its base line, letters included."""
        return max(2 * _SIZE, *(float(y.max()) for _, y in self._outlines)) + 1.5 * _SIZE

    @property
    def low(self) -> float:
        """How far it reaches below its base line, as a negative number."""
        return min(-_SIZE, *(float(y.min()) for _, y in self._outlines)) - 1.5 * _SIZE

    @property
    def _outlines(self) -> list[tuple[Floats, Floats]]:
        return [(self._across(x), self._sign * self.scale * y) for x, y in self.diagram.curves]

    def _across(self, x: Floats) -> Floats:
        begin, end = self.diagram.ends
        return _WIDTH * (x - begin) / (end - begin)

    @property
    def words(self) -> str:
        """The diagram in words."""
        told = ", ".join(f"{each.text} at {each.x:.4g} m" for each in self.diagram.values)
        return f"{self.diagram.name} along {self.diagram.beam}: {told or 'zero'}."

    def marks(self) -> Iterator[Placed]:
        """Yield the area, its outline, the base line, signs and values."""
        name = f"{self.diagram.name} along {self.diagram.beam}"
        named: Any = {"role": "diagram", "name": name}
        x, y = (np.concatenate(part) for part in zip(*self._outlines, strict=True))
        outline = np.column_stack((np.concatenate((x[:1], x, x[-1:])), np.concatenate(([0.0], y, [0.0]))))
        yield Stroke(outline, None, closed=True, fill=_FILL, **named)
        yield Stroke(outline, INK, **named)
        yield Stroke(np.array([[-4.0, 0.0], [_WIDTH + 4.0, 0.0]]), THIN, **named)
        letter = _runs(self.diagram.name)
        yield TextMark(np.array([-8.0 - width_of(letter, _SIZE + 1), -3.0]), letter, _SIZE + 1, **named)
        if self.named:
            beam = small(self.diagram.beam)
            yield TextMark(np.array([-8.0 - width_of(beam, _SIZE), -3.0 - _SIZE]), beam, _SIZE, **named)
        for at, sign in self._signs(x, y):
            yield TextMark(at, ((sign, "roman"),), _SIZE, **named)
        yield from (TextMark(at, runs, _SIZE, **named) for at, runs in self._values())

    def _signs(self, x: Floats, y: Floats) -> Iterator[tuple[Floats, str]]:
        """Yield the sign of each part of the area that has room for it, with its place."""
        side = np.sign(np.where(np.abs(y) > _FLAT * _HEIGHT, y, 0.0))
        for part in np.split(np.arange(len(y)), np.flatnonzero(np.diff(side)) + 1):
            weights = np.abs(y[part])
            if side[part[0]] == 0.0 or weights.max() < _ROOM or np.ptp(x[part]) < _ROOM:
                continue
            middle = float(np.average(x[part], weights=weights))
            height = float(np.interp(middle, x[part], y[part]))
            if abs(height) >= 1.4 * _SIZE:
                sign = "+" if self._sign * side[part[0]] > 0.0 else "\u2212"
                yield np.array([middle - 2.5, height / 2 - 3.0]), sign

    def _values(self) -> Iterator[tuple[Floats, tuple[Run, ...]]]:
        """Yield the place of the letters of each value, beyond the curve and not on letters before."""
        taken: list[tuple[float, float, bool]] = []
        for each in sorted(self.diagram.values, key=lambda each: -abs(each.y)):
            runs = _runs(each.text)
            wide = width_of(runs, _SIZE)
            (x,) = self._across(np.array([each.x]))
            y = self._sign * self.scale * each.y
            up = y >= 0.0
            left = float(min(max(x - wide / 2, 0.0), _WIDTH - wide))
            if any(side == up and left < right + 3.0 and begin < left + wide + 3.0 for begin, right, side in taken):
                continue
            taken.append((left, left + wide, up))
            yield np.array([left, y + (3.0 if up else -_SIZE)]), runs


_POWER: Final = re.compile(r"\^(\d)")
_RAISED: Final = dict(zip("0123456789", "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079", strict=True))


def _runs(text: str) -> tuple[Run, ...]:
    """Return an expression with raised powers, or a number with its unit."""
    runs: list[Run] = []
    for k, part in enumerate(_POWER.split(text)):
        runs += [(_RAISED[part], "roman")] if k % 2 else formula(part) if part else []
    return tuple(runs)


def named_values(values: Sequence[DiagramValue], length: float) -> list[DiagramValue]:
    """Return the values that are named: not zero ones, and of equal neighbours the first."""
    largest = max((abs(each.y) for each in values), default=0.0)
    kept: list[DiagramValue] = []
    for each in values:
        same = any(abs(x.x - each.x) <= _APART * length and abs(x.y - each.y) <= _FLAT * largest for x in kept)
        if abs(each.y) > _FLAT * largest and not same and not (kept and kept[-1].text == each.text):
            kept.append(each)
    return kept
