"""Strands: zigzags of springs, dashpots, ropes, rods. A new kind of strand is one entry in STRANDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.place_symbols import MASS, WHEEL, fillet
from multibody_sym.pictures.marks.shapes import capsule
from multibody_sym.pictures.marks.sheet import Sheet, left, unit2
from multibody_sym.pictures.marks.supports import drawn_pieces, is_turned, support
from multibody_sym.pictures.page.picture import (
    AXIS,
    BODY,
    DARK,
    DOT,
    HIDDEN,
    LAYER_BODY,
    LAYER_GROUND,
    PAPER,
    PIN,
    ROPE,
    SPRING,
    Arc,
    Hatch,
    Mark,
    Pen,
    Stroke,
)
from multibody_sym.pictures.scene.items import Item, PlacedStrand, Symbol
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
_APART: Final = 7.0
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
        signs = (item.form for item in items if item.role == "body" and isinstance(item.form, Symbol))
        if placed.strand.loose and anchor is anchors[0] and any(sign.kind == "block" for sign in signs):
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
    if item.body not in sheet.ground or item.role not in ("joint", "pulley") or not isinstance(item.form, Symbol):
        return False
    return float(np.linalg.norm(sheet.at(item.body, item.form.at) - end)) < 3.0


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


def _spring_marks(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    yield Stroke(zigzag(*pieces[0]), sheet.pen(placed.strand, SPRING), **named)


def _damper(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    yield from dashpot(pieces[0][0], pieces[0][1], sheet.pen(placed.strand, SPRING), named)


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
        yield Stroke(np.array([bar - _APART * across, bar + _APART * across]), pen, **named)
    yield Stroke(zigzag(first + _APART * across, second + _APART * across), pen, **named)
    yield from dashpot(first - _APART * across, second - _APART * across, pen, named)


def _rod(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a thin rod without mass, with a pin at both ends."""
    pen = sheet.pen(placed.strand)
    yield Stroke(capsule(pieces[0][0], pieces[0][1], 3.0), pen, closed=True, fill=BODY, **named)
    for end in pieces[0]:
        yield Arc(end, PIN, pen, fill=PAPER, **{**named, "layer": named["layer"] + 1.0})


def _rope(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a rope: straight pieces with the bows between them; round a small wheel where it bends at a point."""
    pen, points = sheet.pen(placed.strand, ROPE), [pieces[0][0]]
    bows = [sheet.projection.page(bow.points()) for bow in placed.turns]
    for first, second in pairwise(pieces):
        ends = np.array([first[1], second[0]])
        between = [bow for bow in bows if np.linalg.norm(bow[[0, -1]] - ends, axis=1).max() < 0.5]
        centre = fillet(first[0], first[1], second[1], WHEEL) if not between else None
        if between:
            points += list(between[0])
        elif placed.strand.name in sheet.settled.folds and is_turned(first, second):
            points += list(_back(first, second))
        elif centre is not None and float(np.linalg.norm(first[1] - second[0])) < 0.5:
            start, stop = (float(np.arctan2(foot[1], foot[0])) for foot in _feet(first, second, centre))
            angles = start + np.linspace(0.0, (stop - start + np.pi) % (2 * np.pi) - np.pi, 16)
            points += list(centre + WHEEL * np.column_stack((np.cos(angles), np.sin(angles))))
        else:
            points += [first[1], second[0]]
    points.append(pieces[-1][1])
    yield Stroke(np.array(points), pen, **named)
    for coil in placed.wound:
        yield Stroke(sheet.projection.page(coil.points()), pen, **named)


def _back(first: Floats, second: Floats) -> Floats:
    """Return the points of half a turn around a small wheel between two pieces, of which the second runs back."""
    centre = (first[1] + second[0]) / 2
    feet = _feet(first, second, centre)
    onward = unit2(first[1] - first[0])
    start = float(np.arctan2(feet[0][1], feet[0][0]))
    turn = float(np.arctan2(feet[1][1], feet[1][0])) - start
    forward = float(left(feet[0]) @ onward) > 0.0  # the rope goes on over the wheel before it comes back
    turn = turn % (2 * np.pi) if forward else -(-turn % (2 * np.pi))
    angles = start + np.linspace(0.0, turn, 24)
    before, after = (float(np.linalg.norm(foot)) for foot in feet)
    radii = np.linspace(before, after, 24)
    found: Floats = centre + radii[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    return found


def _feet(first: Floats, second: Floats, centre: Floats) -> list[Floats]:
    """Return where two pieces touch a wheel, from its centre."""
    ways = [(a, unit2(b - a)) for a, b in (first, second)]
    return [a + float((centre - a) @ along) * along - centre for a, along in ways]


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
    "spring": _spring_marks,
    "damper": _damper,
    "spring_damper": _both,
    "rope": _rope,
    "rod": _rod,
    "pull": _pull,
    "potential": _pull,
    "attraction": _attraction,
    "tie": _tie,
}
"""How each kind of strand looks."""
