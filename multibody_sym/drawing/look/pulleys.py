"""Pulleys: their axles and what holds them, and small wheels where a rope bends at a point."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.drawing.look.sheet import Sheet, Values, left, unit2
from multibody_sym.drawing.look.supports import stand
from multibody_sym.drawing.picture import Arc, Mark
from multibody_sym.drawing.style import BODY, LAYER_BODY, LAYER_JOINT, PAPER, PIN
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Symbol
from multibody_sym.scene.items import Item

_PULLEY: Final = 9.0
"""The radius of a wheel without a size (pt)."""


def pulley_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a small wheel in the bend of the rope that runs over a point."""
    centre = bend_centre(sheet, item.body, symbol.at)
    at = sheet.at(item.body, symbol.at) if centre is None else centre
    named = sheet.named(item, LAYER_BODY, symbol.at)
    if item.on_ground:
        yield from stand(sheet, item, at, _held_side(sheet, item, at), _PULLEY + 6.0)
    yield Arc(at, _PULLEY if centre is not None else 4.0, sheet.pen(item), fill=BODY, **named)
    yield Arc(at, 1.6, sheet.pen(item), fill=PAPER, **named)


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
    pull = np.zeros(2)
    for rope in sheet.placed.strands:
        for piece in sheet.projection.page(rope.pieces):
            for end, other in ((piece[0], piece[1]), (piece[1], piece[0])):
                if float(np.linalg.norm(end - at)) < 4.0 + _reach(sheet, item):
                    pull += unit2(other - end, (0.0, 0.0))
    if float(np.linalg.norm(pull)) < 1e-6:
        return -sheet.down
    sides = [-sheet.down, left(sheet.down), -left(sheet.down), sheet.down]
    return max(sides, key=lambda side: -float(side @ pull) + 0.01 * float(side @ -sheet.down))


def _reach(sheet: Sheet, item: Item) -> float:
    wheel = next((i.form for i in sheet.scene.items if i.path == item.path and i is not item), None)
    return float(getattr(wheel, "radius", 0.0)) * sheet.projection.scale + _PULLEY


def bend_centre(sheet: Sheet, body: int, point: Values) -> Floats | None:
    """Return the centre (2) of the small wheel that nestles in a rope's bend at a point; None where it has none."""
    at = sheet.at(body, point)
    for rope in sheet.placed.strands:
        pieces = sheet.projection.page(rope.pieces)
        for first, second in pairwise(pieces):
            if float(np.linalg.norm(first[1] - at)) < 0.1 and float(np.linalg.norm(second[0] - at)) < 0.1:
                return fillet(first[0], at, second[1], _PULLEY)
    return None


def fillet(a: Floats, corner: Floats, b: Floats, radius: float) -> Floats | None:
    """Return the centre of the circle in the corner of two lines that touches both; None where they hardly bend."""
    one, two = unit2(a - corner), unit2(b - corner)
    middle = one + two
    half = 0.5 * np.arccos(np.clip(float(one @ two), -1.0, 1.0))
    if half > 1.5 or half < 0.2:
        return None
    found: Floats = corner + unit2(middle) * radius / np.sin(half)
    return found
