"""Ropes on the page: the wheels in their bends, and pieces that are tangent to these in every frame; supports, pulleys.

A wheel without a radius has one on the page. What carries it has its centre; one on ground lies in the corner that the
rope has at the start, so that both straight pieces keep their lines, and stays there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.sheet import DRUM, WHEEL, Sheet, fillet, hatched, left, unit2
from multibody_sym.pictures.page.picture import (
    BODY,
    BOLD,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_JOINT,
    PAPER,
    PIN,
    ROD,
    ROPE,
    SUPPORT,
    Arc,
    Mark,
    Stroke,
)
from multibody_sym.pictures.scene.items import Face, Item, PlacedStrand, Rail, Symbol
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


def place_of(sheet: Sheet, item: Item) -> Floats:
    """Return where a pulley without a radius is on the page: one on ground may be displaced."""
    assert item.symbol is not None
    at = sheet.at(item.body, item.symbol.at)
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
        moved = place_of(sheet, pulley) - place_of(home, pulley)
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
        return place_of(home, pulley), sign
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
        return np.asarray(pieces + moved.folds[placed.strand.name])
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
    return np.asarray(wheel.centre + wheel.radius * np.column_stack((np.cos(angles), np.sin(angles))))


# ----------------------------------------------------------------------------------------------------------------------
# Supports of what stands on ground: triangles and stems that end on hatched lines, on the side where nothing is held.


_STEP: Final = 46.0
"""How long a step of ground is drawn (pt)."""
_ROLLER: Final = 2.2
"""The radius of the wheels of a support (pt)."""
_STRUCK: Final = 8.0
"""Half the length of what is struck (pt)."""


def support(sheet: Sheet, item: Any, at: Floats, away: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a triangle on hatched ground under a place, for an item or a strand."""
    across, foot, pen = left(away), at + SUPPORT * away, sheet.pen(item)
    corners = np.array([at, foot + 0.6 * SUPPORT * across, foot - 0.6 * SUPPORT * across])
    yield Stroke(corners, pen, closed=True, fill=PAPER, **named)
    ends = np.array([foot - SUPPORT * across, foot + SUPPORT * across])
    yield hatched(ends, pen, away, **named)


def support_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the support of a beam: a pin on a triangle, which stands on two wheels where it is a roller."""
    at, away = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along))
    named, pen, across = sheet.named(item, LAYER_GROUND + 0.5), sheet.pen(item), left(away)
    rolls = symbol.kind == "roller"
    foot = at + (SUPPORT - 2.0 * _ROLLER * rolls) * away
    corners = np.array([at, foot + 0.6 * SUPPORT * across, foot - 0.6 * SUPPORT * across])
    yield Stroke(corners, pen, closed=True, fill=PAPER, **named)
    for way in (-0.4, 0.4) if rolls else ():
        yield Arc(foot + _ROLLER * away + way * SUPPORT * across, _ROLLER, pen, fill=PAPER, **named)
    ends = at + SUPPORT * away + np.outer([SUPPORT, -SUPPORT], across)
    yield hatched(ends, pen, away, **named)
    yield Arc(at, PIN, pen, fill=PAPER, **sheet.named(item, LAYER_JOINT))


def struck_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a hatched line where the edge of what strikes it comes to."""
    at, away = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along))
    rods = (i.form for i in sheet.touched.get(item.bodies[1], ()) if i.role == "body")
    half = ROD / 2 if any(form.open_line is not None for form in rods) else 0.0
    ends = at + (half + BOLD.width / 2) * away + np.outer([_STRUCK, -_STRUCK], left(away))
    yield hatched(ends, sheet.pen(item, BOLD), away, **sheet.named(item, LAYER_GROUND))


def support_side(sheet: Sheet, item: Item, at: Floats) -> Floats:
    """Return the direction in which a support stands: down, or up where what it carries hangs."""
    hanging = 0.0
    for body in item.bodies:
        if body < 0:
            continue
        for other in sheet.touched.get(body, ()):
            points = sheet.projection.page(sheet.home.world(body, other.form.bounds)) - at
            hanging += float((points @ sheet.down).mean())
    return -sheet.down if hanging > 6.0 else sheet.down


def stand(sheet: Sheet, item: Item, at: Floats, away: Floats, length: float) -> Iterator[Mark]:
    """Yield a short stem that ends on hatched ground."""
    named, across, foot = sheet.named(item, LAYER_GROUND + 0.5), left(away), at + length * away
    yield Stroke(np.array([at, foot]), sheet.pen(item, BOLD), **named)
    ends = np.array([foot - 8.0 * across, foot + 8.0 * across])
    yield hatched(ends, sheet.pen(item), away, **named)


def step_marks(sheet: Sheet, item: Item, at: Floats) -> Iterator[Mark]:
    """Yield the step from a plane of ground up to a point of ground that a body touches, such as a kerb."""
    if not sheet.flat or item.body not in sheet.ground:
        return
    for contact in (i for i in sheet.scene.items if i.role == "contact" and item.name in i.touching):
        other = next((body for body in contact.bodies if body not in sheet.ground), None)
        for face in (i for i in sheet.scene.items if isinstance(i.form, Face) and i.body == item.body):
            if other is None or not isinstance(face.form, Face):
                continue
            normal = unit2(sheet.way(face.body, face.form.normal))
            height = float((at - sheet.through(face, face.form)) @ normal)
            away = left(normal) * (1.0 if float((at - sheet.at(other, (0.0, 0.0, 0.0))) @ left(normal)) > 0.0 else -1.0)
            if height > 1.0:
                points = np.array([at - height * normal, at, at + _STEP * away])
                yield hatched(points, sheet.pen(item, BOLD), away, **sheet.named(item, LAYER_GROUND))
                return


# ----------------------------------------------------------------------------------------------------------------------
# Pulleys: their axles and what holds them, and small wheels where a rope bends at a point.


def pulley_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a small wheel in the bend of the rope that runs over a point."""
    centre, named = wheel_centre(sheet, item), sheet.named(item, LAYER_BODY, symbol.at)
    at = place_of(sheet, item) if centre is None else centre
    if item.on_ground and not any(lies_on(sheet, item, other) for other in sheet.scene.items):
        yield from stand(sheet, item, at, _held_side(sheet, item, at), WHEEL + 6.0)
    yield Arc(at, WHEEL if centre is not None else 4.0, sheet.pen(item), fill=BODY, **named)
    yield Arc(at, 1.6, sheet.pen(item), fill=PAPER, **named)


def lies_on(sheet: Sheet, pulley: Item, line: Item) -> bool:
    """Return whether a pulley on ground is on the line of a rail or a face of ground, which holds it then."""
    if line.body != pulley.body or pulley.symbol is None or pulley.name in sheet.settled.pulleys:
        return False
    apart = np.subtract(pulley.symbol.at, getattr(line.form, "at", getattr(line.form, "through", (0.0, 0.0, 0.0))))
    if isinstance(line.form, Rail) and not line.form.light:
        across = apart - float(apart @ np.array(line.form.axis)) * np.array(line.form.axis)
    elif isinstance(line.form, Face) and line.form.ends is None and sheet.flat:
        across = float(apart @ np.array(line.form.normal)) * np.array(line.form.normal)
    else:
        return False
    return float(np.linalg.norm(across)) < 1e-6 * sheet.scene.size


def wheels_on(sheet: Sheet, line: Item) -> list[Floats]:
    """Return the centres (2) of the small wheels that a rail or face of ground holds."""
    found = []
    for item in sheet.scene.items:
        if item.role == "pulley" and item.symbol is not None and item.symbol.kind == "pulley":
            centre = wheel_centre(sheet, item) if lies_on(sheet, item, line) else None
            found += [] if centre is None else [centre]
    return found


def held_wheel(sheet: Sheet, at: Floats) -> Floats | None:
    """Return the centre (2) of the small wheel that ground holds at a place of the page, None where there is none."""
    for item in sheet.scene.items:
        if item.role != "pulley" or not item.on_ground or item.symbol is None:
            continue
        if item.symbol.kind == "pulley" and float(np.linalg.norm(sheet.at(item.body, item.symbol.at) - at)) < 1.0:
            return wheel_centre(sheet, item)
    return None


def axle_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the axle of a pulley, held by ground where it is fixed there."""
    named, at = sheet.named(item, LAYER_JOINT, symbol.at), sheet.at(item.body, symbol.at)
    if item.on_ground:
        wheel = next((i.form for i in sheet.scene.items if i.path == item.path and i is not item), None)
        radius = getattr(wheel, "radius", 0.0) * sheet.projection.scale
        side = _held_side(sheet, item, at)
        yield from stand(sheet, item, at, side, radius + 8.0)
    yield Arc(at, PIN, sheet.pen(item), fill=PAPER, **named)


def _held_side(sheet: Sheet, item: Item, at: Floats) -> Floats:
    """Return the side on which a pulley is held: where its ropes do not pull it to."""
    wheel = next((i.form for i in sheet.scene.items if i.path == item.path and i is not item), None)
    reach = float(getattr(wheel, "radius", 0.0)) * sheet.projection.scale + WHEEL
    pull = np.zeros(2)
    for rope in sheet.placed.strands:
        for piece in drawn_pieces(sheet, rope):
            for end, other in ((piece[0], piece[1]), (piece[1], piece[0])):
                if float(np.linalg.norm(end - at)) < 4.0 + reach:
                    pull += unit2(other - end, (0.0, 0.0))
    if float(np.linalg.norm(pull)) < 1e-6:
        return -sheet.down
    sides = [-sheet.down, left(sheet.down), -left(sheet.down), sheet.down]
    return max(sides, key=lambda side: -float(side @ pull) + 0.01 * float(side @ -sheet.down))
