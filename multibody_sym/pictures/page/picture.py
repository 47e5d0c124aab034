"""What a picture is made of: lines, arcs, arrows, hatching and letters on a page, in points (1/72 inch), y upwards.

Every mark says what it belongs to by `role` (body, joint, rope, dimension, ...) and `name`. Marks of a greater `layer`
hide those of a smaller one; within a layer those of a greater `depth` (nearer to the reader) do, then those that come
later. `Wish`, `Measure`, `Bend` and `LegendLine` are marks whose place the layout still has to find.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from itertools import pairwise
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from multibody_sym.errors import InputError, Where, short_repr
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.printer import GREEK, SYMBOL, read_parts

# ----------------------------------------------------------------------------------------------------------------------
# Letters of labels: runs of one style each, and their widths in the metrics of Times, which all backends keep to.


Run = tuple[str, str]
"""Some letters and their style: roman, italic, small (roman, smaller) or subscript (small, lower)."""
HEIGHT: Final = 0.72
"""From the baseline to the top of tall letters, in sizes of the type."""
DESCENT: Final = 0.24
"""From the baseline down to the lowest letters and subscripts."""
SIZES: Final = {"roman": 1.0, "italic": 1.0, "small": 0.8, "subscript": 0.8}
"""Sizes of the styles; beside 10 pt letters names and subscripts have 8 pt, the least that is printed."""
DROPS: Final = {"roman": 0.0, "italic": 0.0, "small": 0.0, "subscript": 0.16}
"""How far the letters of a style stand below the baseline, in sizes of the type."""
LONGEST: Final = 40
"""Characters of a label that are shown; what is longer ends in an ellipsis."""
_OTHER: Final = 0.62
"""Width of a letter that has no entry: wide enough for Greek and Cyrillic."""
_WIDE: Final = 1.0

_ROMAN: Final = (
    "250 333 408 500 500 833 778 333 333 333 500 564 250 333 250 278 500 500 500 500 500 500 500 500 500 500 278 278 "
    "564 564 564 444 921 722 667 667 722 611 556 722 722 333 389 722 611 889 722 722 556 722 667 556 611 722 722 944 "
    "722 722 611 333 278 333 469 500 333 444 500 444 500 444 333 500 500 278 278 500 278 778 500 500 500 500 333 389 "
    "278 500 500 722 500 500 444 480 200 480 541"
)
_ITALIC: Final = (
    "250 333 420 500 500 833 778 333 333 333 500 675 250 333 250 278 500 500 500 500 500 500 500 500 500 500 333 333 "
    "675 675 675 500 920 611 611 667 722 611 611 722 722 333 444 667 556 833 667 722 611 722 611 500 556 722 611 833 "
    "611 556 556 389 278 389 422 500 333 500 500 444 500 444 278 500 500 278 278 444 278 722 500 500 500 500 389 389 "
    "278 500 444 667 444 444 389 400 275 400 541"
)
_WIDTHS: Final = {
    style: {chr(32 + i): int(w) / 1000 for i, w in enumerate(table.split())}
    for style, table in (("roman", _ROMAN), ("italic", _ITALIC), ("small", _ROMAN), ("subscript", _ROMAN))
}
_THIN_SPACE: Final = "\u2009"
_SIGNS: Final = {
    _THIN_SPACE: 0.167, "−": 0.564, "≤": 0.549, "≥": 0.549, "≈": 0.549, "°": 0.4, "·": 0.25,
    **dict.fromkeys("¹²³⁴⁵⁶⁷⁸⁹⁰⁻", 0.3),
}
"""Widths of signs, which are upright in all styles."""
_SHORT: Final = rf"(?:{'|'.join(GREEK)}|[A-Za-z]{{1,2}})(?:_?[0-9]+)?"
_TERM: Final = rf"(?:(?:{_SHORT}|[0-9.]+)|(?:sin|cos|exp)\((?:{_SHORT}|[0-9.]+)(?: ?[-+*/] ?(?:{_SHORT}|[0-9.]+))*\))"
_FORMULA: Final = re.compile(rf"-?{_TERM}(?: ?[-+*/] ?{_TERM})+")
"""Sums and quotients of symbols of a letter or two, and of functions; names with a hyphen are longer words."""


_TOKENS: Final = re.compile(r"[A-Za-z]\w*|[0-9.]+|[-+*/=,()²³]|(?<=[-+*/=,]) | (?=[-+*/=])", re.ASCII)
"""Names and numbers with signs between them, and spaces around signs only."""
_TIME: Final = re.compile(r"\bt((?:\*[A-Za-z]\w*(?![\w(]))+)", re.ASCII)
_EXPONENT: Final = re.compile(r"\^(-?[0-9]+)")
_RAISED: Final = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_RELATION: Final = re.compile(r"(.+) ([≤≥]) (.+)")
"""A coordinate and a limit of it."""


def width_of(runs: Sequence[Run], size: float) -> float:
    """Return the width of letters of a size, in the unit of the size."""
    return sum(run_width(run, size) for run in runs)


def run_width(run: Run, size: float) -> float:
    """Return the width of one run in letters of a size."""
    text, style = run
    table = _WIDTHS[style]
    return size * SIZES[style] * sum(table.get(letter) or _width_of_unlisted(letter) for letter in text)


def _width_of_unlisted(letter: str) -> float:
    if unicodedata.combining(letter):
        return 0.0
    if letter in _SIGNS:
        return _SIGNS[letter]
    return _WIDE if unicodedata.east_asian_width(letter) in "WF" else _OTHER


def letters(name: str) -> tuple[Run, ...]:
    """Return a symbol as a book writes it: theta_1 and theta1 as θ with the index 1, l as an italic l, words upright.

    Words that follow each other are read as such (crank_angle), and so are symbols in a formula, such as R - r or l/2.
    What is neither stands as it is.
    """
    shown = printable(name)
    if SYMBOL.fullmatch(shown):
        return _symbol(shown)
    limit = _RELATION.fullmatch(shown)
    if limit is not None:
        return (*letters(limit[1]), (f" {limit[2]} ", "roman"), *letters(limit[3]))
    return _formula(shown) if _FORMULA.fullmatch(shown) else words(shown)


def formula(text: str) -> tuple[Run, ...]:
    """Return an expression, or several with commas between them, as a book sets it: F sin(ωt), 2 m, μ_s, μ_k.

    The time stands behind other letters. What is no expression stands in upright letters.
    """
    shown = _TIME.sub(lambda product: f"{product[1][1:]}*t", printable(text)).replace("^2", "²").replace("^3", "³")
    return _formula(shown) if "".join(_TOKENS.findall(shown)) == shown else letters(text)


def _formula(text: str) -> tuple[Run, ...]:
    """Return the runs of an expression, with signs as they are set."""
    runs: list[Run] = []
    for part in re.findall(r"[A-Za-z]\w*|[^A-Za-z]+", text, re.ASCII):
        signs: Run = (part.replace("-", "−").replace("*", _THIN_SPACE), "roman")
        runs += _symbol(part) if SYMBOL.fullmatch(part) else [signs]
    return tuple(runs)


def _symbol(name: str) -> tuple[Run, ...]:
    letter, *below = read_parts(name)
    head: Run = (GREEK.get(letter, letter), "italic" if letter in GREEK or len(letter) == 1 else "roman")
    return (head, (",".join(GREEK.get(part, part) for part in below), "subscript")) if below else (head,)


def typeset_unit(unit: str) -> str:
    """Return a unit as a book sets it: kg*m^2/s as kg m²/s."""
    return _EXPONENT.sub(lambda power: power[1].translate(_RAISED), unit).replace("*", _THIN_SPACE)


def small(name: str) -> tuple[Run, ...]:
    """Return a name in small upright letters, such as beside the letters of what it names."""
    return ((printable(name) or " ", "small"),)


def words(text: str) -> tuple[Run, ...]:
    """Return text as it stands, in upright letters."""
    return ((printable(text) or " ", "roman"),)


def printable(text: str) -> str:
    """Return text on one line without characters that control how others are shown, cut to a length that fits.

    Characters that no backend can show stand as a replacement character.
    """
    kept = []
    for c in text[: LONGEST + 1]:
        unseen = unicodedata.category(c)[0] == "C"  # a control, a direction, a surrogate or unassigned
        kept.append(" " if c.isspace() else "\ufffd" if unseen else c)
    line = " ".join("".join(kept).split())
    return line if len(text) <= LONGEST else line[:LONGEST] + "…"


# ----------------------------------------------------------------------------------------------------------------------

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
    closed: ClassVar[bool] = False

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
    """A line through `points` (n, 2) with a head of `head` points length at its end, or at both ends.

    The head is filled; an `open` one is two lines.
    """

    points: Floats
    pen: Pen
    both: bool = False
    head: float = 6.0
    open: bool = False


@dataclass(frozen=True, eq=False)
class TextMark(Mark):
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

    `prefer` is a direction from there in which they stand best, `clear` how far from it they stay in points; `inside`
    is a place right on it where they stand best of all, such as the mass of a block on the block. Where not all letters
    find room those of a lower `rank` do.
    """

    about: Floats
    runs: tuple[Run, ...]
    prefer: tuple[float, float] | None = None
    clear: float = 3.0
    size: float = 10.0
    colour: str = "#000000"
    inside: Floats | None = None
    rank: int = 0


@dataclass(frozen=True, eq=False)
class Measure(Mark):
    """A dimension line that wants a place beside the line from `a` to `b` (points of the page), with its letters.

    A coordinate is measured from the `datum` a: an arrow from a dot there. What is measured reaches `beyond` (pt) to
    both sides of the line.
    """

    a: Floats
    b: Floats
    runs: tuple[Run, ...]
    size: float = 10.0
    datum: bool = False
    beyond: float = 0.0


@dataclass(frozen=True, eq=False)
class AngleArc(Mark):
    """An angle that wants an arc about `at`, counterclockwise from `start` to `stop` in radians, with its letters.

    `lines` says for each of the two sides whether a thin line must show it, because nothing drawn lies there;
    `tip` is the end (1 or 0) that gets an arrow head, None for an angle that counts no way. Its radius is at most
    `reach` (pt).
    """

    at: Floats
    start: float
    stop: float
    runs: tuple[Run, ...]
    lines: tuple[bool, bool] = (False, False)
    tip: int | None = None
    size: float = 10.0
    reach: float = 70.0


@dataclass(frozen=True, eq=False)
class LegendLine(Mark):
    """One line of letters of the legend, which stands below all that is drawn."""

    runs: tuple[Run, ...]
    size: float = 10.0


Placed = Stroke | Arc | Hatch | Arrow | TextMark
"""A mark that has its place."""
Simple = Stroke | Arc | TextMark
"""A mark that a backend draws."""
Wanted = Wish | Measure | AngleArc | LegendLine


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


def shifted_mark(mark: Placed, shift: Floats) -> Placed:
    """Return a mark farther by `shift` (2)."""
    if isinstance(mark, Arc):
        return replace(mark, centre=np.asarray(mark.centre) + shift)
    if isinstance(mark, TextMark):
        return replace(mark, at=np.asarray(mark.at) + shift)
    return replace(mark, points=np.asarray(mark.points) + shift)


def box_of(mark: Simple) -> Box:
    """Return what a mark covers, half the width of its pen included."""
    if isinstance(mark, TextMark):
        return mark.box
    points = np.asarray(mark.points)
    edge = mark.pen.width / 2 if mark.pen else 0.0
    (left, bottom), (right, top) = points.min(0) - edge, points.max(0) + edge
    return Box("fill" if mark.fill else "line", float(left), float(bottom), float(right), float(top))


def simple(mark: Placed) -> list[Simple]:
    """Return a mark as strokes, arcs and texts."""
    if isinstance(mark, Hatch):
        # ticks lean back at 45 degrees and stay within the length of the line
        named, found = fields_of(mark), list[Simple]()
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
    if isinstance(mark, Arrow):
        # the shaft ends inside the heads
        named, points = fields_of(mark), np.asarray(mark.points, float).copy()
        length = float(np.hypot(*np.diff(points, axis=0).T).sum())
        size = min(mark.head, 0.8 * length / (2 if mark.both else 1))
        heads: list[Simple] = []
        for end in (-1, 0) if mark.both else (-1,):
            tip = points[end].copy()
            away = tip - _shorten_end(points, end, size)[end]
            away = away / (np.hypot(*away) or 1.0)
            across = np.array([-away[1], away[0]]) * size * 0.32
            foot = tip - size * away
            if mark.open:
                heads.append(Stroke(np.array([foot + across, tip, foot - across]), replace(mark.pen, dash=()), **named))
                continue
            head = np.array([tip, foot + across, foot + 0.15 * size * away, foot - across])
            heads.append(Stroke(head, None, closed=True, fill=mark.pen.colour, **named))
            points = _shorten_end(points, end, size * 0.7)
        return [Stroke(points, mark.pen, **named), *heads]
    return [mark]


def fields_of(mark: Mark, layer: float | None = None) -> dict[str, Any]:
    """Return what a mark says of itself, in another layer if one is given."""
    own = mark.layer if layer is None else float(layer)
    return {"role": mark.role, "name": mark.name, "layer": own, "depth": mark.depth}


def _shorten_end(points: Floats, end: int, size: float) -> Floats:
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


# ----------------------------------------------------------------------------------------------------------------------
# Pens, colours, sizes and layers of pictures, in one place: points of a page (72 to the inch).


INK: Final = Pen(0.9)
"""Outlines of bodies and symbols."""
BOLD: Final = Pen(1.4)
"""What stands still: faces of ground."""
THIN: Final = Pen(0.5)
"""Dimension lines, extension lines, leaders, axes of angles."""
HIDDEN: Final = Pen(0.5, dash=(3.0, 2.0))
"""What lies behind or does not exist as a thing: paths, lines of reference."""
CHAIN: Final = Pen(2.6, dash=(3.0, 4.6))
"""A chain: its links."""
AXIS: Final = Pen(0.5, dash=(7.0, 2.0, 1.5, 2.0))
"""Axes of rotation and symmetry."""
ROPE: Final = Pen(1.1, "#5b3a1e")
SPRING: Final = Pen(0.9)
FORCE: Final = Pen(1.3, "#cc0000")
"""Forces and torques, with filled heads."""
REACTION: Final = Pen(1.3, "#000060")
VELOCITY: Final = Pen(0.9, "#1565c0")
"""Speeds at the start and prescribed motions, with open heads."""
COORDINATE: Final = Pen(0.5)
"""Coordinates: thin arrows from the dot of their datum."""
MARKED: Final = Pen(1.6, "#d05a00")
"""What a question singles out: redundant rows, the place of an error."""

BODY: Final = "#e4e7eb"
"""Fill of bodies."""
DARK: Final = "#c3c9d1"
"""Fill of bodies on others, such as blocks of sliders."""
PAPER: Final = "#ffffff"
BLACK: Final = "#000000"

PIN: Final = 2.6
"""Radius of a joint's pin."""
ROD: Final = 6.0
"""Width of a rod or link."""
DOT: Final = 2.2
"""Radius of a point or a particle that has no size."""
BLOCK: Final = (20.0, 12.0)
"""Length and height of a slider's block that has no size."""
DATUM: Final = 1.2
"""Radius of the dot from which a coordinate is measured."""
SUPPORT: Final = 12.0
"""Height of the triangle under a pivot on ground."""

LAYER_GROUND, LAYER_BODY, LAYER_STRAND, LAYER_JOINT, LAYER_ARROW, LAYER_TEXT = range(6)
"""What hides what in a plane picture; in space depth decides among bodies, strands and joints."""


# ----------------------------------------------------------------------------------------------------------------------
# From places in space to places on a page: the direction of view, the scale, and what is nearer to the reader.


WIDTH: Final = 255.0
PAGE_HEIGHT: Final = 215.0
"""What the mechanism itself covers at most (pt): 90 mm wide, with room for labels around it within 150 mm."""
LEAST: Final = 60.0
"""The length (pt) of a mechanism whose extent is zero or all but zero in one direction decides nothing by itself."""
_STEEPEST: Final = 90.0
VIEWS: Final = {
    "front": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "back": ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "top": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    "right": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "left": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
}
"""Views by name where y points up: the directions to the right and up on the page, in space."""
ISO: Final = (45.0, math.degrees(math.atan(math.sqrt(0.5))))
"""Azimuth and elevation (deg) of the isometric view."""


@dataclass(frozen=True)
class Projection:
    """A parallel projection: unit vectors to the right and up on the page, and its scale in points per metre."""

    right: tuple[float, float, float]
    up: tuple[float, float, float]
    scale: float = 1.0
    flat: bool = False

    @property
    def toward(self) -> Floats:
        """The unit vector from the page to the reader."""
        return np.cross(self.right, self.up)

    def page(self, points: Floats | Sequence[Sequence[float]]) -> Floats:
        """Return where points (.., 3) in space (m) are on the page (.., 2) in points."""
        return np.asarray(self.scale * (np.asarray(points, dtype=float) @ np.array([self.right, self.up]).T))

    def depth(self, points: Floats | Sequence[Sequence[float]]) -> Floats:
        """Return how far points (.., 3) are towards the reader (m)."""
        return np.asarray(np.asarray(points, dtype=float) @ self.toward)

    def scaled(self, extent: Floats, times: float = 1.0, most: float = math.inf) -> Projection:
        """Return this view at the scale at which points (n, 3) fill the page, as far as they have an extent.

        A page `times` as large as usual; the scale (pt/m) is at most `most`.
        """
        spans = np.ptp(Projection(self.right, self.up).page(extent), axis=0) if len(extent) else np.zeros(2)
        spans = np.where(np.isfinite(spans), spans, 0.0)
        wide = spans > 1e-9 * spans.max()
        page = np.array([WIDTH, PAGE_HEIGHT])
        room = [times * limit / span for limit, span in zip(page[wide], spans[wide], strict=True)]
        return Projection(self.right, self.up, float(min([most, *(room or [LEAST])])), self.flat)


def view_of(
    asked: str | Sequence[float] | None,
    usual: Projection,
    upward: Sequence[float] = (0.0, 1.0, 0.0),
    plane: Sequence[float] | None = None,
) -> Projection:
    """Return the projection that was asked for: a name of VIEWS, iso, azimuth and elevation in degrees, None for usual.

    `upward` is the direction in space that points up where azimuth and elevation are asked for. `plane` is the normal
    of a plane mechanism: seen along it the picture is flat. Raises InputError.
    """
    if asked is None:
        return usual
    if isinstance(asked, str) and (asked == "iso" or asked in VIEWS):
        axes = _axes(upward)
        named = [_vector(axes @ np.array(way)) for way in VIEWS.get(asked, ())]
        right, up = named or _turned_view(*ISO, upward)
    else:
        right, up = _turned_view(*_angles(asked), upward)
    toward = np.cross(right, up)
    flat = plane is not None and abs(float(np.dot(toward, np.asarray(plane, dtype=float)))) > 1.0 - 1e-9
    return Projection(right, up, 1.0, flat)


def _angles(asked: str | Sequence[float]) -> tuple[float, float]:
    """Return azimuth and elevation in degrees. Raises InputError."""
    try:
        words = re.split(r"\s*,\s*|\s+", asked.strip()) if isinstance(asked, str) else list(asked)
        azimuth, elevation = (float(word) for word in words)
    except (TypeError, ValueError, OverflowError):
        message = f"expected a view by name or as AZIMUTH,ELEVATION such as 30,20 (degrees), got {short_repr(asked)}"
        named = [*VIEWS, "iso"]
        raise InputError(message, where=Where(path=("view",)), word=str(asked), known=named) from None
    if not math.isfinite(azimuth) or not abs(elevation) <= _STEEPEST:
        message = "a view has a finite azimuth, and an elevation from -90 to 90 degrees"
        raise InputError(message, where=Where(path=("view",)))
    return azimuth, elevation


Pair = tuple[tuple[float, float, float], tuple[float, float, float]]


def _axes(upward: Sequence[float]) -> Floats:
    """Return the columns right, up and toward of the front view, where `upward` points up."""
    up = np.asarray(upward, dtype=float)
    up = up / (np.linalg.norm(up) or 1.0)
    right = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    right = right - up * float(right @ up)
    right /= np.linalg.norm(right)
    return np.column_stack((right, up, np.cross(right, up)))


def _turned_view(azimuth: float, elevation: float, upward: Sequence[float]) -> Pair:
    """Return the page's axes of a reader who went around by the azimuth, from the front to the right, and then up."""
    a, e = math.radians(azimuth), math.radians(elevation)
    axes = _axes(upward)
    right = axes @ np.array([math.cos(a), 0.0, -math.sin(a)])
    up = axes @ np.array([-math.sin(a) * math.sin(e), math.cos(e), -math.cos(a) * math.sin(e)])
    return _vector(right), _vector(up)


def _vector(values: Floats) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 15) + 0.0 for value in values)
    return x, y, z
