"""Supports: what stands on ground: triangles and stems that end on hatched lines, on the side where nothing is held."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.place_symbols import WHEEL, fillet
from multibody_sym.pictures.marks.sheet import Sheet, left, unit2
from multibody_sym.pictures.page.picture import (
    BODY,
    BOLD,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_JOINT,
    PAPER,
    PIN,
    ROD,
    SUPPORT,
    Arc,
    Hatch,
    Mark,
    Stroke,
)
from multibody_sym.pictures.scene.items import Face, Item, PlacedStrand, Polyline, Rail, Symbol
from multibody_sym.scalars.arrays import Floats

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
    yield Hatch(ends, pen, side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)


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
    yield Hatch(ends, pen, side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)
    yield Arc(at, PIN, pen, fill=PAPER, **sheet.named(item, LAYER_JOINT))


def struck_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a hatched line where the edge of what strikes it comes to."""
    at, away = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along))
    rods = (i.form for i in sheet.touched.get(item.bodies[1], ()) if i.role == "body")
    half = ROD / 2 if any(isinstance(form, Polyline) and not form.closed for form in rods) else 0.0
    ends = at + (half + BOLD.width / 2) * away + np.outer([_STRUCK, -_STRUCK], left(away))
    side = 1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1
    yield Hatch(ends, sheet.pen(item, BOLD), side=side, **sheet.named(item, LAYER_GROUND))


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
    yield Hatch(ends, sheet.pen(item), side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)


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
            height = float((at - sheet.at(face.body, face.form.through)) @ normal)
            away = left(normal) * (1.0 if float((at - sheet.at(other, (0.0, 0.0, 0.0))) @ left(normal)) > 0.0 else -1.0)
            if height > 1.0:
                points = np.array([at - height * normal, at, at + _STEP * away])
                inside = float(left(points[1] - points[0]) @ away) > 0.0
                named = sheet.named(item, LAYER_GROUND)
                yield Hatch(points, sheet.pen(item, BOLD), side=1 if inside else -1, **named)
                return


# ----------------------------------------------------------------------------------------------------------------------
# Pulleys: their axles and what holds them, and small wheels where a rope bends at a point.


_ROUNDS: Final = 6
"""How often a corner is moved: each leaves of the wheel's distance its width over the rope's length."""
_STRAIGHT: Final = 0.99
"""The cosine up to which a rope bends so little that it lies on its wheel in one line."""


def pulley_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a small wheel in the bend of the rope that runs over a point."""
    centre, named = wheel_centre(sheet, item, symbol), sheet.named(item, LAYER_BODY, symbol.at)
    at = place_of(sheet, item, symbol) if centre is None else centre
    if item.on_ground and not any(lies_on(sheet, item, other) for other in sheet.scene.items):
        yield from stand(sheet, item, at, _held_side(sheet, item, at), WHEEL + 6.0)
    yield Arc(at, WHEEL if centre is not None else 4.0, sheet.pen(item), fill=BODY, **named)
    yield Arc(at, 1.6, sheet.pen(item), fill=PAPER, **named)


def place_of(sheet: Sheet, item: Item, symbol: Symbol) -> Floats:
    """Return where a pulley is on the page: one on ground may be displaced."""
    at = sheet.at(item.body, symbol.at)
    return at + sheet.settled.pulleys[item.name] if item.body < 0 and item.name in sheet.settled.pulleys else at


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
            centre = wheel_centre(sheet, item, item.symbol) if lies_on(sheet, item, line) else None
            found += [] if centre is None else [centre]
    return found


def held_wheel(sheet: Sheet, at: Floats) -> Floats | None:
    """Return the centre (2) of the small wheel that ground holds at a place of the page, None where there is none."""
    for item in sheet.scene.items:
        if item.role != "pulley" or not item.on_ground or item.symbol is None:
            continue
        if item.symbol.kind == "pulley" and float(np.linalg.norm(sheet.at(item.body, item.symbol.at) - at)) < 1.0:
            return wheel_centre(sheet, item, item.symbol)
    return None


def wheel_centre(sheet: Sheet, item: Item, symbol: Symbol) -> Floats | None:
    """Return the centre (2) of the small wheel of a pulley without a radius; None where its rope does not bend."""
    at = sheet.projection.page(sheet.placed.world(item.body, np.array([symbol.at])))[0]
    for rope in sheet.placed.strands:
        plain, drawn = sheet.projection.page(rope.pieces), drawn_pieces(sheet, rope)
        for k, (first, second) in enumerate(pairwise(plain)):
            if float(np.linalg.norm(first[1] - at)) > 0.1 or float(np.linalg.norm(second[0] - at)) > 0.1:
                continue
            if rope.strand.name in sheet.settled.folds and is_turned(drawn[k], drawn[k + 1]):
                return np.asarray((drawn[k][1] + drawn[k + 1][0]) / 2)
            bend = drawn[k][0], drawn[k][1], drawn[k + 1][1]
            if float(unit2(bend[0] - bend[1]) @ unit2(bend[2] - bend[1])) >= -_STRAIGHT:
                return fillet(*bend, WHEEL)
            across = left(unit2(bend[2] - bend[0]))  # the rope lies on the wheel in one line
            return np.asarray(bend[1] + WHEEL * (across if float(across @ sheet.down) >= 0.0 else -across))
    return None


def is_turned(first: Floats, second: Floats) -> bool:
    """Return whether two pieces that follow each other run beside each other, back and forth."""
    return float(np.linalg.norm(second[0] - first[1])) > WHEEL


def drawn_pieces(sheet: Sheet, placed: PlacedStrand) -> Floats:
    """Return the straight pieces of a strand on the page (n, 2, 2), ended where things without a size stand."""
    pieces, moved = sheet.projection.page(placed.pieces).copy(), sheet.settled
    if placed.strand.name in moved.folds:
        found: Floats = pieces + moved.folds[placed.strand.name]
        return _round_wheels(sheet, pieces, found)
    shifts = [moved.bodies.get(anchor.body, np.zeros(2)) for anchor in placed.strand.anchors]
    if not any(np.any(shift) for shift in shifts) or not len(pieces):
        return _round_wheels(sheet, pieces, pieces.copy()) if placed.strand.kind == "rope" else pieces
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


def _round_wheels(sheet: Sheet, plain: Floats, drawn: Floats) -> Floats:
    """Move the corners in which a rope bends on moving bodies, so that the wheel in the bend is about its pulley."""
    for item in sheet.scene.items:
        if item.role != "pulley" or item.body < 0 or item.symbol is None or item.symbol.kind != "pulley":
            continue
        at = sheet.projection.page(sheet.placed.world(item.body, np.array([item.symbol.at])))[0]
        centre = place_of(sheet, item, item.symbol)
        for k in range(len(drawn) - 1):
            if float(np.linalg.norm(plain[k][1] - at)) > 0.1 or is_turned(drawn[k], drawn[k + 1]):
                continue
            for _ in range(_ROUNDS):
                lies = fillet(drawn[k][0], drawn[k][1], drawn[k + 1][1], WHEEL)
                if lies is not None:
                    drawn[k][1] = drawn[k + 1][0] = drawn[k][1] + centre - lies
    return drawn


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
