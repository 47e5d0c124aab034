"""How forces look: strands (an entry in STRANDS each), arrows at points and beside the figure, cones of friction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import pairwise
from math import atan
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.pictures.marks.ropes import drawn_pieces, rope_marks, support
from multibody_sym.pictures.marks.shapes import capsule, outline_of
from multibody_sym.pictures.marks.sheet import MASS, Sheet, left, unit2
from multibody_sym.pictures.page.layout import crossing_count, distances, segments_of
from multibody_sym.pictures.page.picture import (
    AXIS,
    BLACK,
    BODY,
    COORDINATE,
    DARK,
    DATUM,
    DOT,
    FORCE,
    HIDDEN,
    LAYER_ARROW,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_TEXT,
    PAPER,
    PIN,
    REACTION,
    ROPE,
    SPRING,
    THIN,
    VELOCITY,
    AngleArc,
    Arc,
    Arrow,
    Hatch,
    Mark,
    Pen,
    Run,
    Stroke,
    Wish,
    formula,
    letters,
    simple,
)
from multibody_sym.pictures.scene.items import (
    BLOCKS,
    Anchor,
    ArrowItem,
    Axes,
    Disc,
    Item,
    PlacedStrand,
    Sphere,
    Symbol,
    Vector,
    rim,
    unit,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_AMPLITUDE: Final = 5.0
_COIL: Final = 12.0
"""How long a coil of a spring is where there is room (pt)."""
_HELD: Final = ("spring", "damper", "spring_damper", "rope", "rod")
"""Strands whose ends are fixed to something."""
_LEAD: Final = 7.0
_PLATE: Final = 8.0
"""How far beyond its end the plate reaches at which a spring begins (pt)."""
_LEVEL: Final = 0.2
"""How far a rod may rise (its slope) towards its end on ground, which then stands below it still."""
_SIDE_BY_SIDE: Final = 7.0
"""How far a spring and a damper in parallel are from their middle line (pt)."""
Look = Callable[[Sheet, PlacedStrand, Floats, dict[str, Any]], Iterator[Mark]]


def strand_marks(sheet: Sheet, placed: PlacedStrand) -> Iterator[Mark]:
    """Yield how a strand looks."""
    if not np.all(np.isfinite(placed.pieces)) or not len(placed.pieces):
        return
    middle = placed.pieces.reshape(-1, 3).mean(axis=0)
    named = sheet.named(placed.strand, LAYER_BODY - 0.2, middle, body=-1)
    named["role"] = placed.strand.kind
    pieces = drawn_pieces(sheet, placed)
    yield from STRANDS[placed.strand.kind](sheet, placed, pieces, named)
    if placed.strand.kind in _HELD:
        yield from _fixed_ends(sheet, placed, pieces, named)


def _fixed_ends(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield hatched ground across the ends that are fixed there, unless a joint or pulley shows it."""
    anchors = placed.strand.anchors
    for anchor, end, other in ((anchors[0], pieces[0][0], pieces[0][1]), (anchors[-1], pieces[-1][1], pieces[-1][0])):
        items = sheet.touched.get(anchor.body, ()) if anchor.body not in sheet.ground else ()
        signs = (item.symbol for item in items if item.role == "body" and item.symbol is not None)
        if placed.strand.loose and anchor is anchors[0] and any(sign.kind in BLOCKS for sign in signs):
            away = unit2(end - other)  # a plate on the block at which the spring begins
            across = left(away) if float(left(away) @ sheet.down) > 0.0 else -left(away)
            foot, top = end + MASS[1] / 2 * across, end - _PLATE * across
            corners = np.array([foot, top, top + 3.0 * away, foot + 3.0 * away])
            yield Stroke(corners, sheet.pen(placed.strand), closed=True, fill=BODY, **named)
        if anchor.body not in sheet.ground or any(_shows(sheet, item, end) for item in sheet.scene.items):
            continue
        away = unit2(end - other, -sheet.down)
        if placed.strand.kind == "rod" and sheet.flat:
            down = sheet.down if float(away @ sheet.down) > -_LEVEL else -sheet.down
            yield from support(sheet, placed.strand, end, down, {**named, "layer": LAYER_GROUND})
            continue
        ends = np.array([end - 9.0 * left(away), end + 9.0 * left(away)])
        yield Hatch(ends, sheet.pen(placed.strand), side=-1, **{**named, "layer": LAYER_GROUND})


def _shows(sheet: Sheet, item: Item, end: Floats) -> bool:
    """Return whether a sign of ground stands at a place of the page."""
    if item.body not in sheet.ground or item.role not in ("joint", "pulley") or item.symbol is None:
        return False
    return float(np.linalg.norm(sheet.at(item.body, item.symbol.at) - end)) < 3.0


def zigzag(a: Floats, b: Floats) -> Floats:
    """Return the points of a spring from a to b (n, 2)."""
    length = float(np.linalg.norm(b - a))
    along = unit2(b - a)
    lead = min(_LEAD, 0.15 * length)
    coils = int(np.clip(round((length - 2.0 * lead) / _COIL), 5, 18))
    ways = np.linspace(lead, length - lead, 2 * coils + 1)
    ups = np.array([0.0, *(_AMPLITUDE if k % 2 else -_AMPLITUDE for k in range(2 * coils - 1)), 0.0])
    turns = a + ways[:, None] * along + ups[:, None] * left(along)
    return np.vstack([a, turns, b])


def dashpot(a: Floats, b: Floats, pen: Pen, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a piston in a cup from a to b."""
    along, length = unit2(b - a), float(np.linalg.norm(b - a))
    across, middle = left(along), (a + b) / 2
    half = min(9.0, 0.3 * length)
    back, front = middle - half * along, middle + half * along
    yield Stroke(np.array([a, back]), pen, **named)
    cup = np.array([front + 5.0 * across, back + 5.0 * across, back - 5.0 * across, front - 5.0 * across])
    yield Stroke(cup, pen, **named)
    head = middle + 0.2 * half * along
    yield Stroke(np.array([head + 3.6 * across, head - 3.6 * across]), Pen(1.6, pen.colour), **named)
    yield Stroke(np.array([head, b]), pen, **named)


def _both(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a spring and a damper side by side between two bars."""
    a, b = pieces[0]
    along, length = unit2(b - a), float(np.linalg.norm(b - a))
    across, lead, pen = left(along), min(_LEAD, 0.1 * length), sheet.pen(placed.strand, SPRING)
    first, second = a + lead * along, b - lead * along
    for end, bar in ((a, first), (b, second)):
        yield Stroke(np.array([end, bar]), pen, **named)
        yield Stroke(np.array([bar - _SIDE_BY_SIDE * across, bar + _SIDE_BY_SIDE * across]), pen, **named)
    yield Stroke(zigzag(first + _SIDE_BY_SIDE * across, second + _SIDE_BY_SIDE * across), pen, **named)
    yield from dashpot(first - _SIDE_BY_SIDE * across, second - _SIDE_BY_SIDE * across, pen, named)


def _rod(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a thin rod without mass, with a pin at both ends."""
    pen = sheet.pen(placed.strand)
    yield Stroke(capsule(pieces[0][0], pieces[0][1], 3.0), pen, closed=True, fill=BODY, **named)
    for end in pieces[0]:
        yield Arc(end, PIN, pen, fill=PAPER, **{**named, "layer": named["layer"] + 1.0})


def _attraction(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    yield Stroke(pieces[0], sheet.pen(placed.strand, HIDDEN), **named)
    for anchor, end in zip(placed.strand.anchors, pieces[0], strict=True):
        if anchor.body in sheet.ground:  # a centre of force
            yield Arc(end, 2.0 * DOT, sheet.pen(placed.strand), fill=DARK, **named)


def _pull(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    yield Stroke(pieces[0], sheet.pen(placed.strand, AXIS), **named)


def _tie(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a dashed line from joint to joint whose coordinates are tied."""
    for piece in pieces:
        yield Stroke(piece, sheet.pen(placed.strand, HIDDEN), **{**named, "role": "constraint"})


STRANDS: Final[Mapping[str, Look]] = {
    "spring": lambda sheet, placed, pieces, named: iter(
        [Stroke(zigzag(*pieces[0]), sheet.pen(placed.strand, SPRING), **named)]
    ),
    "damper": lambda sheet, placed, pieces, named: dashpot(
        pieces[0][0], pieces[0][1], sheet.pen(placed.strand, SPRING), named
    ),
    "spring_damper": _both,
    "rope": rope_marks,
    "rod": _rod,
    "pull": _pull,
    "potential": _pull,
    "attraction": _attraction,
    "tie": _tie,
}
"""How each kind of strand looks."""


# ----------------------------------------------------------------------------------------------------------------------
# Arrows: gravity beside the figure, forces at their points, torques as bows around them.


_FORCE: Final = 34.0
_SHORTEST: Final = 0.2
"""The part of the longest arrow of a row below which one is left out."""
_TORQUE: Final = 15.0
_GRAVITY: Final = 30.0
_MOVING: Final = 24.0
_BESIDE: Final = 6.0
"""How far arrows of the same place and way are apart (pt)."""
_NEAR: Final = 2.0
"""Within this distance (pt) places are one."""
_SAME_WAY: Final = 0.98
_OPEN: Final = (3.5, 2.5)
"""The dashes of an arrow that others would do for as well (pt)."""
_SIDES: Final = 9
"""Bodies with so many corners at most have flat sides."""
_CLEAR: Final = 0.05
"""The part of an arrow at its tail that may touch what it acts on."""


def arrow_marks(sheet: Sheet, drawn: Sequence[Mark] = ()) -> Iterator[Mark]:
    """Yield the arrows at bodies with their letters, those of loads where they cross the least that is `drawn`."""
    lines = lines_of([mark for mark in drawn if getattr(mark, "pen", None) != HIDDEN])
    taken, rows = _Taken(), dict[str, list[Floats]]()
    for item, now in zip(sheet.scene.arrows, sheet.placed.vectors, strict=True):
        vector = now if np.any(now) else np.asarray(item.way)
        named: dict[str, Any] = {"role": item.role, "name": item.name, "layer": LAYER_ARROW}
        at = _place(sheet, item)
        if item.role in ("torque", "couple"):
            pen = _arrow_pen(item, REACTION if item.role == "couple" else FORCE)
            yield from _torque(sheet, at, vector, item.label, named, pen, taken.radius(at, drawn))
        elif item.turning:
            yield from _spin(sheet, item, at, vector, named, lines)
        elif item.role not in ("gravity", "motion"):
            pen = _arrow_pen(item, {"reaction": REACTION, "velocity": VELOCITY}.get(item.role, FORCE))
            if any(item.lever):
                thread = _thread(sheet, item, at, vector)
                yield Stroke(thread, ROPE, **{**named, "role": "rope", "layer": LAYER_BODY + 0.2})
                at = thread[1]
            at = at + (taken.aside(at, sheet.projection.page(vector)) if item.share is None else 0.0)
            declared = item.role in ("force", "drag") and item.path[0] == "forces"
            hold = _hold(sheet, item, at, vector, drawn) if declared else _Hold(at, at)
            if item.role == "drag" and any(i.role == "flow" for i in sheet.touched.get(item.at.body, ())):
                hold = hold._replace(pushes=True)  # where gas leaves no arrow is seen
            yield from _force(sheet, hold, vector, item, named, pen, lines if declared else None)
            if item.share is not None:
                shaft = item.share * _FORCE * unit2(sheet.projection.page(vector)) if np.any(vector) else np.zeros(2)
                rows.setdefault(item.name, []).append(hold.behind - shaft)
    for name, tails in rows.items():
        yield Stroke(np.array(tails), replace(THIN, colour=FORCE.colour), role="force", name=name, layer=LAYER_ARROW)


class _Hold(NamedTuple):
    """Where a force acts on the page: from where it pulls, where it pushes, and whether it `pushes` in any case."""

    ahead: Floats
    behind: Floats
    pushes: bool = False


def _hold(sheet: Sheet, item: ArrowItem, at: Floats, vector: Floats, drawn: Sequence[Mark]) -> _Hold:
    """Return where the line of a force leaves the body with flat sides in which it acts, else where it acts.

    It pushes where only the side behind is square to it.
    """
    way = unit2(sheet.projection.page(vector))
    bodies = {(each.role, each.name) for each in sheet.touched.get(item.at.body, ()) if each.role == "body"}
    for mark in drawn:
        if not sheet.flat or not isinstance(mark, Stroke) or not mark.closed or (mark.role, mark.name) not in bodies:
            continue
        corners = np.asarray(mark.points)
        if len(corners) > _SIDES:
            continue
        ahead, behind = _exit(corners, at, way), _exit(corners, at, -way)
        if ahead is None or behind is None:
            continue
        return _Hold(ahead[0], behind[0], behind[1] and not ahead[1])
    return _Hold(at, at)


def _exit(corners: Floats, at: Floats, way: Floats) -> tuple[Floats, bool] | None:
    """Return where a way from inside a polygon crosses a side, and whether square to it; None where it does not."""
    for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side, to = q - p, p - at
        across = float(way[0] * side[1] - way[1] * side[0])
        if abs(across) < 1e-9:
            continue
        far, part = float(to[0] * side[1] - to[1] * side[0]) / across, float(to[0] * way[1] - to[1] * way[0]) / across
        if far > _NEAR and 0.0 <= part <= 1.0:
            return at + far * way, abs(across) > _SAME_WAY * float(np.linalg.norm(side))
    return None


def _thread(sheet: Sheet, item: ArrowItem, at: Floats, vector: Floats) -> Floats:
    """Return the ends (2, 2) of a thread that a force pulls from a drum: from its rim to beyond the body around it."""
    start = at + sheet.projection.page(np.cross(unit(vector), item.lever))
    arm = float(np.linalg.norm(start - at))
    discs = (i.form for i in sheet.touched.get(item.at.body, ()) if isinstance(i.form, Disc))
    radius = sheet.projection.scale * max((disc.radius for disc in discs), default=0.0)
    way = unit2(sheet.projection.page(vector))
    return np.array([start, start + (np.sqrt(max(radius**2 - arm**2, 0.0)) + _BESIDE) * way])


def _arrow_pen(item: ArrowItem, pen: Pen) -> Pen:
    """Return the pen of an arrow, dashed for what is not unique."""
    return replace(pen, dash=_OPEN) if item.open else pen


def _place(sheet: Sheet, item: ArrowItem) -> Floats:
    """Return where an arrow acts on the page: on a body whose size is the page's affair, in its middle."""
    body, at = item.at.body, sheet.at(item.at.body, item.at.point)
    if item.role == "gravity" or not sheet.flat:
        return at
    for other in sheet.touched.get(body, ()):
        if other.role in ("point", "mass centre") and _near(sheet.at(body, other.form.bounds[0]), at):
            return at
    for other in sheet.touched.get(body, ()):
        if other.role == "body" and other.form.endless and not other.on_ground:
            return np.asarray(outline_of(sheet, other).mean(axis=0))
    return at


@dataclass
class _Taken:
    """Where arrows are: one that would lie on another stands beside it, a bow about another."""

    forces: list[tuple[Floats, Floats]] = field(default_factory=list)
    torques: list[Floats] = field(default_factory=list)

    def aside(self, at: Floats, way: Floats) -> Floats:
        """Return how far (2) a force that starts at a place moves across its way."""
        along = unit2(way)
        same = [1 for other, ahead in self.forces if _near(at, other) and float(along @ ahead) > _SAME_WAY]
        self.forces.append((at, along))
        side = (len(same) + 1) // 2 * (1 if len(same) % 2 else -1)
        return np.asarray(_BESIDE * side * left(along))

    def radius(self, at: Floats, drawn: Sequence[Mark]) -> float:
        """Return the radius of the bow of a torque about a place, beside circles that are drawn about it."""
        same = sum(_near(at, other) for other in self.torques)
        self.torques.append(at)
        circles = [mark.radius for mark in drawn if isinstance(mark, Arc) and _near(at, np.asarray(mark.centre))]
        found = _TORQUE + _BESIDE * same
        while any(abs(found - radius) < _BESIDE / 2 for radius in circles):
            found += _BESIDE
        return found


def _near(a: Floats, b: Floats) -> bool:
    return float(np.linalg.norm(a - b)) < _NEAR


def arrows_beside(sheet: Sheet, corner: Floats) -> Iterator[Mark]:
    """Yield gravity and the motion of ground beside the `corner` of what is drawn."""
    for item, now in zip(sheet.scene.arrows, sheet.placed.vectors, strict=True):
        vector = now if np.any(now) else np.asarray(item.way)
        named: dict[str, Any] = {"role": item.role, "name": item.name, "layer": LAYER_ARROW}
        way, moves = sheet.projection.page(vector) / sheet.projection.scale, item.role == "motion"
        if item.role not in ("gravity", "motion") or np.linalg.norm(way) < 0.05 * (moves or np.linalg.norm(vector)):
            continue
        along, top = unit2(way), corner + np.array([30.0, 0.0])
        points, pen = top + np.outer([0.0, _GRAVITY], along), THIN
        if moves:  # below gravity
            points, pen = top - [0.0, _GRAVITY + _MOVING] + np.outer([-0.5, 0.5], _MOVING * along), VELOCITY
        yield Arrow(points, pen, open=moves, **named)
        text: dict[str, Any] = {**named, "layer": LAYER_TEXT}
        yield Wish(points.mean(axis=0)[None, :], formula(item.label), prefer=(1.0, 0.0), colour=pen.colour, **text)


def _force(
    sheet: Sheet, hold: _Hold, vector: Floats, item: ArrowItem, named: dict[str, Any], pen: Pen, lines: Floats | None
) -> Iterator[Mark]:
    """Yield a force or speed along its direction, unless it is zero or points at the reader.

    It begins where it pulls. It ends where it pushes if it has to, or if it crosses fewer `lines` so. Its angle stands
    at its tail.
    """
    way = sheet.projection.page(vector) / sheet.projection.scale
    size, share = float(np.linalg.norm(vector)), 1.0 if item.share is None else item.share
    if size == 0.0 or float(np.linalg.norm(way)) < 0.05 * size or share < _SHORTEST:
        return
    at, end = hold.ahead, hold.behind
    points = np.array([at, at + share * _FORCE * unit2(way) * max(0.4, float(np.linalg.norm(way)) / size)])
    pushes, shaft = hold.pushes, points[1] - points[0]
    if lines is not None:
        aside = 1e-3 * left(shaft)  # of a corner that is met one side is crossed
        starts = at, end - (1.0 + _CLEAR) * shaft
        away, into = (
            max(crossing_count(start + _CLEAR * shaft + way, start + shaft + way, lines) for way in (aside, -aside))
            for start in starts
        )
        pressed = float(unit2(shaft) @ sheet.down) > _SAME_WAY
        pushes = pushes or into < away or (pressed and into == away > 0)  # a load lies on a beam
    if pushes or item.share is not None:
        points = np.array([end - shaft, end])
    yield Arrow(points, pen, open=item.role == "velocity", **named)
    if not item.label:
        return
    side = left(unit2(points[1] - points[0]))
    prefer = (float(side[0]), float(side[1]))
    free = points[:1] if pushes else points[1:]
    yield Wish(free, formula(item.label), prefer=prefer, colour=pen.colour, **{**named, "layer": LAYER_TEXT})
    if item.angle and item.beside is not None and sheet.flat:
        first, second = (float(np.arctan2(y, x)) for x, y in (sheet.way(item.beside.body, item.beside.point), way))
        turn = (second - first + np.pi) % (2 * np.pi) - np.pi
        low, high = min(first, first + turn), max(first, first + turn)
        about, lines_shown = (points[0], low, high, formula(item.angle)), (turn > 0.0, turn < 0.0)
        yield AngleArc(*about, lines_shown, None, role="angle", name=item.name, layer=LAYER_TEXT)


def _torque(
    sheet: Sheet, at: Floats, vector: Floats, label: str, named: dict[str, Any], pen: Pen, radius: float
) -> Iterator[Mark]:
    """Yield a torque about a place of the page: most of a circle around its axis, as it turns."""
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        return
    ways = sheet.projection.page(rim(unit(vector), np.linspace(-0.5, 4.0, 36)))
    points = at + radius * ways / sheet.projection.scale
    yield Arrow(points, pen, head=5.0, **named)
    yield Wish(points, formula(label), colour=pen.colour, **{**named, "layer": LAYER_TEXT})


_SPIN, _SPIN_IN_SPACE = (0.9, 18.0, 6.0), 2.6
"""The angle of the bow of an angular velocity, its radius about a hinge, and how far outside of a round body (pt)."""
_STARTS: Final = np.arange(0.0, 2.0 * np.pi, np.pi / 6.0)


def round_radius(sheet: Sheet, body: int, at: Floats, axis: Floats | None = None) -> float:
    """Return the radius (pt) of what is round about a place of a body, about an `axis` (world) if given; else zero."""
    found = [0.0]
    for item in sheet.touched.get(body, ()):
        form = item.form
        if not isinstance(form, (Disc, Sphere)) or not _near(sheet.at(body, form.centre), at):
            continue
        along = None if axis is None or isinstance(form, Sphere) else sheet.placed.turned(body, form.axis) @ axis
        if along is None or abs(float(along)) > _SAME_WAY:
            found.append(sheet.settled.drums.get(body, form.radius * sheet.projection.scale))
    return max(found)


def _spin(
    sheet: Sheet, item: ArrowItem, at: Floats, vector: Floats, named: dict[str, Any], lines: Floats
) -> Iterator[Mark]:
    """Yield an angular velocity: a bow about its axis where it crosses the fewest lines, outside of what is round."""
    span, radius, beyond = _SPIN
    axis = np.array(unit(vector))
    span = span if sheet.flat else _SPIN_IN_SPACE
    wheel = round_radius(sheet, item.at.body, at, axis)
    radius = max(radius, wheel + beyond) if wheel else radius
    tried = []
    for start in _STARTS:
        ways = sheet.projection.page(rim(axis, np.linspace(start, start + span, 16)))
        points = at + radius * ways / sheet.projection.scale
        count = sum(crossing_count(p, q, lines) for p, q in pairwise(points))
        tried.append((count - 1e-3 * float(points[:, 1].mean() - at[1]), points))
    _, points = min(tried, key=lambda each: each[0])
    if float(np.ptp(points, axis=0).max()) < 4.0:
        return
    yield Arrow(points, VELOCITY, open=True, head=5.0, **named)
    middle = points[len(points) // 2][None, :]
    prefer = tuple(float(x) for x in middle[0] - at)
    text: dict[str, Any] = {**named, "layer": LAYER_TEXT}
    yield Wish(middle, formula(item.label), prefer=(prefer[0], prefer[1]), colour=VELOCITY.colour, **text)


# ----------------------------------------------------------------------------------------------------------------------
# Coordinates that are asked of what moves freely; arrows of what is driven.


COORDINATE_LENGTH, _CROSS = 24.0, 44.0
"""How long (pt) the arrow of a coordinate is, and how long both axes of what moves in x and y."""
_ASIDE, _AHEAD, _ROOM = 10.0, 14.0, 38.0
"""How far (pt) such an arrow is from its body, begins before its middle, and reaches with its letter."""
_THIN: Final = 20.0
"""Beside a body that is no wider (pt) the arrow is near its front."""
_OFF_CORNER: Final = 0.35
"""A body is a wedge where a corner of the box about it is so far from it, in parts of the box's smaller side."""
_TURN: Final = (1.0, 14.0, 0.78)
"""The angle of the bow of what turns, its radius (pt), and the part of the radius of a round body."""
_AXES_BESIDE, _DRIVEN, _ABOUT = 16.0, 24.0, 12.0
"""How far (pt) the arrow of a drive is from what slides, its length, and its radius about what turns."""


def free_axes(sheet: Sheet, drawn: Sequence[Mark]) -> Iterator[Mark]:
    """Yield the coordinates in the questions of each joint that leaves a body free, beside the body that is `drawn`.

    Both axes of what moves in two directions begin where its coordinates do.
    """
    lines = lines_of(drawn)
    for item in sheet.scene.items:
        form = item.form
        if not isinstance(form, Axes):
            continue
        named: dict[str, Any] = {"role": item.role, "name": item.name, "layer": LAYER_ARROW}
        if form.of_equation:
            yield from () if not sheet.flat else _axes_of_equation(sheet, item, form, named)
            continue
        asked = [k for k, name in enumerate(form.names[: len(form.axes)]) if name in sheet.scene.asked]
        origin = sheet.at(item.body, form.at)
        outline = outline_drawn(sheet, item.bodies[1], drawn)
        outline = outline if len(outline) else origin[None]
        for k in asked:
            way = sheet.way(item.body, form.axes[k])
            if float(np.linalg.norm(way)) < 0.1:
                continue
            letter = letters(sheet.scene.book.get(form.names[k], form.names[k]))
            if len(asked) > 1:
                yield from coordinate_arrow(origin, origin + _CROSS * way, letter, named)
            else:
                start = clear_start(outline, way, lines)
                yield from coordinate_arrow(start, start + COORDINATE_LENGTH * way, letter, named)
        if len(form.axes) == 2 and len(form.names) == 3 and form.names[-1] in sheet.scene.asked:
            yield from _counted_turn(sheet, item, form, named)


def _axes_of_equation(sheet: Sheet, item: Item, form: Axes, named: Mapping[str, Any]) -> Iterator[Mark]:
    """Yield the axes in which a curve has its equation, as thin arrows."""
    origin = sheet.at(item.body, form.at)
    for name, axis in zip(form.names, form.axes, strict=True):
        tip = origin + _CROSS * sheet.way(item.body, axis)
        yield Arrow(np.array([origin, tip]), THIN, head=4.0, **named)
        x, y = tip - origin
        yield Wish(tip[None, :], letters(name), prefer=(float(x), float(y)), **{**named, "layer": LAYER_TEXT})


def lines_of(drawn: Sequence[Mark]) -> Floats:
    """Return the lines (n, 4) of marks that have their place."""
    placed = (mark for mark in drawn if isinstance(mark, (Stroke, Arc, Hatch, Arrow)))
    return np.vstack([np.zeros((0, 4)), *(segments_of(part) for mark in placed for part in simple(mark))])


def outline_drawn(sheet: Sheet, body: int, drawn: Sequence[Mark], place: Floats | None = None) -> Floats:
    """Return the points (n, 2) between which a body is `drawn`, none where it is not seen.

    Of one that has several parts those about a `place` are meant, if there are some.
    """
    own = [mark for mark in drawn if body >= 0 and (mark.role, mark.name) == ("body", sheet.scene.bodies[body])]
    parts = [part for mark in own if len(part := lines_of([mark]).reshape(-1, 2))]
    about = [x for x in parts if place is not None and np.all((x.min(axis=0) <= place) & (place <= x.max(axis=0)))]
    return np.vstack([np.zeros((0, 2)), *(about or parts)])


def coordinate_arrow(start: Floats, tip: Floats, letter: Sequence[Run], named: Mapping[str, Any]) -> Iterator[Mark]:
    """Yield the arrow of a coordinate from its datum dot, with its letter ahead."""
    yield Arc(start, DATUM, None, fill=BLACK, **named)
    yield Arrow(np.array([start, tip]), COORDINATE, head=4.5, **named)
    x, y = tip - start
    yield Wish(tip[None, :], tuple(letter), prefer=(float(x), float(y)), **{**named, "layer": LAYER_TEXT})


def clear_start(outline: Floats, way: Floats, lines: Floats) -> Floats:
    """Return where the arrow of a coordinate begins: beside its body, ahead of it or behind, clear of other lines.

    Of equally free places the first is on the left of the way, near the front; of a wedge ahead of it.
    """
    along, side = unit2(way), left(unit2(way))
    middle = (outline.min(axis=0) + outline.max(axis=0)) / 2
    on_axes = (outline - middle) @ np.transpose([along, side])
    (back, low), (front, high) = on_axes.min(axis=0), on_axes.max(axis=0)
    ahead = max(_AHEAD, float(front) - 2 * COORDINATE_LENGTH) if high - low < _THIN else _AHEAD
    beside = [(x, y) for x in (ahead, -COORDINATE_LENGTH - _AHEAD) for y in (high + _ASIDE, low - _ASIDE)]
    heights = [low + part * (high - low) for part in (0.5, 0.25, 0.75)]
    ends = [(x, y) for x in (front + _ASIDE, back - _ASIDE - _ROOM) for y in heights]
    corners = np.array([[x, y] for x in (back, front) for y in (low, high)])
    off = [float(np.linalg.norm(on_axes - corner, axis=1).min()) for corner in corners]
    wedge = max(off) > _OFF_CORNER * min(front - back, high - low) > _ASIDE
    tried = [middle + x * along + y * side for x, y in ([*ends, *beside] if wedge else [*beside, *ends])]
    parts = np.linspace(0.0, _ROOM, 12)[:, None] * along
    costs = [0.2 * k for k in range(len(tried))]
    if len(lines):  # of each place the points of its arrow that have a line nearer than half of a letter's height
        near = [distances(start + parts, lines).min(axis=1) < _ASIDE / 2 for start in tried]
        costs = [cost + float(each.sum()) for cost, each in zip(costs, near, strict=True)]
    return np.asarray(tried[int(np.argmin(costs))])


def _counted_turn(sheet: Sheet, item: Item, form: Axes, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield the bow in which the angle of what moves in the plane counts: in what is round, else about its middle."""
    body = item.bodies[1]
    if any(angle.name == form.names[-1] for angle in sheet.scene.angles):
        return
    span, radius, part = _TURN
    centres = (i for i in sheet.touched.get(body, ()) if i.role in ("mass centre", "body"))
    at = next((sheet.page(body, i.form.bounds).mean(axis=0) for i in centres), sheet.at(item.body, form.at))
    radius = max(radius, part * round_radius(sheet, body, at))
    first, second = (sheet.way(item.body, axis) for axis in form.axes)
    angles = np.linspace(1.9, 1.9 + span, 16)[:, None]
    points = at + radius * (np.cos(angles) * first + np.sin(angles) * second)
    yield Arrow(points, COORDINATE, head=4.5, **named)
    letter = letters(sheet.scene.book.get(form.names[-1], form.names[-1]))
    yield Wish(points[len(points) // 2][None, :], letter, clear=1.5, **{**named, "layer": LAYER_TEXT})


def driven_points(sheet: Sheet, item: Item, symbol: Symbol) -> Floats:
    """Return the points (n, 2) of the arrow by which a prescribed motion is seen."""
    at = sheet.at(item.body, symbol.at)
    if symbol.kind == "drive_along":
        way = unit2(sheet.way(item.body, symbol.axis), (0.0, 1.0))
        start = at - _AXES_BESIDE * left(way)
        return np.array([start, start + _DRIVEN * way])
    ways = [sheet.way(item.body, way) for way in rim(symbol.axis, np.linspace(0.3, 4.6, 32))]
    return np.asarray(at + _ABOUT * np.array(ways))


# ----------------------------------------------------------------------------------------------------------------------
# Cones of friction: within them lies the force of a contact that sticks.


_LENGTH, _RADIUS = 58.0, 24.0
"""Points of its sides, and of the arc between them."""
_FLAT: Final = 0.1
"""A normal that is shorter on the page looks at the reader, and its cone is left out."""


@dataclass(frozen=True)
class FrictionCone:
    """The cone of a contact at a place of a body, about the `normal` (body axes) into it, of half angle atan(mu)."""

    name: str
    at: Anchor
    normal: Vector
    coefficient: float


def cone_marks(sheet: Sheet, cones: Sequence[FrictionCone]) -> Iterator[Mark]:
    """Yield the two sides of each cone, and an arc between them."""
    for cone in cones:
        at, way = sheet.at(cone.at.body, cone.at.point), sheet.way(cone.at.body, cone.normal)
        if np.linalg.norm(way) < _FLAT or not sheet.flat:
            continue
        middle, half = float(np.arctan2(way[1], way[0])), atan(cone.coefficient)
        for angle in (middle - half, middle + half):
            side = at + _LENGTH * np.array([np.cos(angle), np.sin(angle)])
            yield Stroke(np.array([at, side]), HIDDEN, role="friction cone", name=cone.name)
        yield Arc(at, _RADIUS, THIN, middle - half, middle + half, role="friction cone", name=cone.name)
