"""Ropes on the page: the wheels in their bends, and pieces that are tangent to these in every frame of a motion.

A wheel without a radius has one on the page. What carries it has its centre; one on ground lies in the corner that the
rope has at the start, so that both straight pieces keep their lines, and stays there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.place_symbols import DRUM, WHEEL, fillet
from multibody_sym.pictures.marks.sheet import Sheet, left, unit2
from multibody_sym.pictures.page.picture import LAYER_BODY, ROPE, Mark, Stroke
from multibody_sym.pictures.scene.items import Item, PlacedStrand, Symbol
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_STRAIGHT: Final = 0.99
"""The cosine up to which a rope bends so little that it lies on its wheel in one line."""
_HERE: Final = 0.1
"""Within this distance (pt) a bend is at its pulley."""
_POINTS: Final = 41
"""So many points has a bow on a wheel, of any angle: a page moves each from frame to frame."""


@dataclass(frozen=True, eq=False)
class RopeWheel:
    """A wheel in a bend of a rope: centre and radius (pt), the `side` of the rope's way on which it lies (1 left).

    `name` is that of its pulley; it is nothing where a rope bends around no wheel, of radius zero. `turns` are whole
    ones that the rope makes about it.
    """

    name: str
    centre: Floats
    radius: float
    side: float
    turns: int = 0


def wheel_centre(sheet: Sheet, item: Item) -> Floats | None:
    """Return the centre (2) of the small wheel of a pulley without a radius; None where its rope does not bend."""
    for rope in sheet.placed.strands:
        for wheel in wheels(sheet, rope) if rope.strand.kind == "rope" else ():
            if wheel.name == item.name and wheel.radius > 0.0:
                return wheel.centre
    return None


def place_of(sheet: Sheet, item: Item, symbol: Symbol) -> Floats:
    """Return where a pulley is on the page: one on ground may be displaced."""
    at = sheet.at(item.body, symbol.at)
    return at + sheet.settled.pulleys[item.name] if item.body < 0 and item.name in sheet.settled.pulleys else at


def wheels(sheet: Sheet, rope: PlacedStrand) -> list[RopeWheel]:
    """Return the wheels in the bends of a rope, in their order."""
    if not rope.bows or not np.all(np.isfinite(rope.pieces)):
        return []
    home = sheet.moved(sheet.home)
    start = next(each for each in sheet.home.strands if each.strand.name == rope.strand.name)
    corners, plain, now = _shifted(home, start), sheet.projection.page(start.pieces), _shifted(sheet, rope)
    found: list[RopeWheel] = []
    for k, bow in enumerate(rope.bows):
        if bow.radius > 0.0:
            turn = bow.angle * float(np.array(bow.axis) @ sheet.projection.toward)
            centre, radius = sheet.projection.page(np.array(bow.centre)), bow.radius * sheet.projection.scale
            whole = int(abs(bow.angle) / (2.0 * np.pi))
            found.append(RopeWheel("", centre, radius, 1.0 if turn > 0.0 else -1.0, whole))
            continue
        pulley = _pulley_at(home, plain[k][1], [wheel.name for wheel in found])
        lies = None if pulley is None else _lie(home, pulley, corners[k], corners[k + 1])
        if pulley is None or lies is None:
            found.append(RopeWheel("", now[k][1], 0.0, 1.0))
            continue
        moved = _place(sheet, pulley) - _place(home, pulley)
        found.append(RopeWheel(pulley.name, lies[0] + moved, WHEEL, lies[1]))
    return found


def _pulley_at(home: Sheet, at: Floats, taken: Sequence[str]) -> Item | None:
    """Return the pulley without a radius at a place of the page at the start that is not taken yet."""
    for item in home.scene.items:
        if item.role == "pulley" and item.name not in taken and item.symbol is not None:
            place = home.projection.page(home.placed.world(item.body, np.array([item.symbol.at])))[0]
            if float(np.linalg.norm(place - at)) < _HERE:
                return item
    return None


def _place(sheet: Sheet, pulley: Item) -> Floats:
    assert pulley.symbol is not None
    return place_of(sheet, pulley, pulley.symbol)


def _lie(home: Sheet, pulley: Item, first: Floats, second: Floats) -> tuple[Floats, float] | None:
    """Return the centre of a wheel between two pieces at the start and its side of them; None of a sharp corner."""
    way, onward, apart = first[1] - first[0], second[1] - second[0], second[0] - first[1]
    if float(np.linalg.norm(apart)) > WHEEL:  # the pieces run beside each other, back and forth
        return (first[1] + second[0]) / 2, 1.0 if float(left(way) @ apart) > 0.0 else -1.0
    bends = float(unit2(way) @ unit2(onward)) <= _STRAIGHT
    across = left(unit2(second[1] - first[0]))
    side = float(left(way) @ onward) if bends else float(across @ home.down) or 1.0
    sign = 1.0 if side > 0.0 else -1.0
    if pulley.body not in home.ground:
        return _place(home, pulley), sign
    centre = fillet(first[0], first[1], second[1], WHEEL) if bends else first[1] + sign * WHEEL * across
    return None if centre is None else (centre, sign)


# ----------------------------------------------------------------------------------------------------------------------
# The straight pieces: ended where things without a size stand, tangent to the wheels between them.


def drawn_pieces(sheet: Sheet, placed: PlacedStrand) -> Floats:
    """Return the straight pieces of a strand on the page (n, 2, 2), ended where things without a size stand."""
    pieces, bends = _shifted(sheet, placed), wheels(sheet, placed) if placed.strand.kind == "rope" else []
    if not bends or (placed.turns and not sheet.flat):
        return pieces
    return np.array([tangent(first, second) for first, second in pairwise(_course(sheet, placed, pieces, bends))])


def course(sheet: Sheet, placed: PlacedStrand) -> list[RopeWheel]:
    """Return what a strand runs along on a page that shows its plane: its ends, and the wheels between them."""
    bends = wheels(sheet, placed) if placed.strand.kind == "rope" else []
    if bends:
        return _course(sheet, placed, _shifted(sheet, placed), bends)
    pieces = drawn_pieces(sheet, placed)
    return [RopeWheel("", end, 0.0, 1.0) for end in (pieces[0][0], pieces[-1][1])]


def _course(sheet: Sheet, placed: PlacedStrand, pieces: Floats, bends: Sequence[RopeWheel]) -> list[RopeWheel]:
    around = [_end(sheet, placed, pieces[0]), *bends, _end(sheet, placed, pieces[-1][::-1])]
    around[-1] = replace(around[-1], side=-around[-1].side)
    return around


def _end(sheet: Sheet, rope: PlacedStrand, piece: Floats) -> RopeWheel:
    """Return where a piece (2, 2) of a rope begins: at a point, or on the rim of the drum on which it is wound."""
    for drum in rope.wound if sheet.flat else ():
        start, centre = sheet.projection.page(np.array([drum.start, drum.centre]))
        radius = float(np.linalg.norm(start - centre))
        if float(np.linalg.norm(start - piece[0])) < _HERE < radius:
            side = float(left(piece[1] - piece[0]) @ (centre - start))
            return RopeWheel("", centre, radius, 1.0 if side > 0.0 else -1.0)
    return RopeWheel("", piece[0], 0.0, 1.0)


def tangent(first: RopeWheel, second: RopeWheel) -> Floats:
    """Return the straight piece (2, 2) of a rope from one wheel to the next; from centre to centre if one is inside."""
    way = second.centre - first.centre
    apart, reach = float(np.linalg.norm(way)), second.side * second.radius - first.side * first.radius
    if apart <= abs(reach) or apart == 0.0:
        return np.array([first.centre, second.centre])
    turned = float(np.arctan2(way[1], way[0])) + float(np.arccos(reach / apart))
    normal = np.array([np.cos(turned), np.sin(turned)])  # to the left of the piece
    return np.array([each.centre - each.side * each.radius * normal for each in (first, second)])


def _shifted(sheet: Sheet, placed: PlacedStrand) -> Floats:
    """Return the pieces of a strand on the page (n, 2, 2) by their corners, moved with what stands at their ends."""
    pieces, moved = sheet.projection.page(placed.pieces).copy(), sheet.settled
    if placed.strand.name in moved.folds:
        found: Floats = pieces + moved.folds[placed.strand.name]
        return found
    shifts = [moved.bodies.get(anchor.body, np.zeros(2)) for anchor in placed.strand.anchors]
    if not any(np.any(shift) for shift in shifts) or not len(pieces):
        return pieces
    if len(pieces) > 1 and not placed.turns and sheet.flat:
        # Shift the pieces at both ends of a rope with these ends, and bend it where they meet the next ones.
        for k, shift in ((0, shifts[0]), (-1, shifts[-1])):
            pieces[k] += shift
        for first, second in pairwise(pieces):
            a, b = first[1] - first[0], second[1] - second[0]
            turn = float(a[0] * b[1] - a[1] * b[0])
            if abs(turn) > 0.05 * float(np.linalg.norm(a) * np.linalg.norm(b)):
                apart = second[0] - first[0]
                corner = first[0] + a * float(apart[0] * b[1] - apart[1] * b[0]) / turn
                first[1], second[0] = corner, corner
    elif not placed.turns:
        if len(pieces) == 1 and placed.strand.kind != "rod":  # a rod ends at its pins
            across = left(unit2(pieces[0][1] - pieces[0][0]))
            for end, (own, other) in enumerate((shifts, shifts[::-1])):
                if not np.any(own):  # what is fixed there runs on beside, at the height of what stands on it
                    pieces[0][end] += float(other @ across) * across
        pieces[0][0] += shifts[0]
        pieces[-1][1] += shifts[-1]
    return pieces


# ----------------------------------------------------------------------------------------------------------------------


def rope_marks(sheet: Sheet, placed: PlacedStrand, pieces: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a rope: straight pieces with the bows between them, and what is wound on drums."""
    pen, points = sheet.pen(placed.strand, ROPE), [pieces[0][0]]
    if placed.wound and sheet.flat:  # over the wheel beside the drum
        named = {**named, "layer": LAYER_BODY + 0.2}
    bends = wheels(sheet, placed)
    for k, (first, second) in enumerate(pairwise(pieces)):
        if placed.bows and placed.bows[k].radius > 0.0 and not sheet.flat:
            points += list(sheet.projection.page(placed.bows[k].points()))
        else:
            points += list(_bow(first[1], second[0], bends[k])) if bends else [first[1], second[0]]
    points.append(pieces[-1][1])
    yield Stroke(np.array(points), pen, **named)
    for coil in placed.wound:
        if not sheet.settled.drums or coil.radius * sheet.projection.scale >= DRUM:
            yield Stroke(sheet.projection.page(coil.points()), pen, **named)


def _bow(start: Floats, stop: Floats, wheel: RopeWheel) -> Floats:
    """Return the points (n, 2) of a rope on a wheel between the ends of two pieces."""
    if wheel.radius == 0.0:
        return np.array([start, stop])
    first, last = (float(np.arctan2(*(end - wheel.centre)[::-1])) for end in (start, stop))
    turn = wheel.side * ((wheel.side * (last - first)) % (2.0 * np.pi) + 2.0 * np.pi * wheel.turns)
    angles = np.linspace(first, first + turn, _POINTS * (1 + wheel.turns))
    found: Floats = wheel.centre + wheel.radius * np.column_stack((np.cos(angles), np.sin(angles)))
    return found
