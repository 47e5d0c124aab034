"""Hinges of rings in space: where their axis meets the ring, as gimbals have them, not in the empty middle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.drawing.look.shapes import barrel
from multibody_sym.drawing.look.sheet import Sheet, unit2
from multibody_sym.drawing.look.supports import stand
from multibody_sym.drawing.picture import Mark, Stroke
from multibody_sym.drawing.style import BOLD, LAYER_BODY, LAYER_JOINT, PAPER
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Barrel, Disc, Symbol, unit, vector
from multibody_sym.scene.items import Item

_SAME: Final = 1e-6
_OUTSIDE: Final = 14.0
"""How far a ring's shaft reaches to its bearing in ground (pt)."""
_BUSH: Final = (2.6, 8.0)
"""Radius and length (pt) of a bearing."""


def ring_pins(sheet: Sheet, item: Item, symbol: Symbol) -> Floats | None:
    """Return from where to where (2, 3), along its axis on one side, a hinge's shaft is seen between rings.

    In the axes of the hinge's own body; None where neither body is a ring about whose diameter it turns.
    """
    radii = [radius for body in item.bodies for radius in _radii(sheet, item, symbol, body)]
    if not radii or sheet.flat:
        return None
    outer = max(radii)
    inner = min(radii) if len(radii) > 1 else 0.0
    if any(body in sheet.ground for body in item.bodies):
        inner, outer = outer, outer + sheet.metres(_OUTSIDE)
    axis, at = np.array(unit(symbol.axis)), np.array(symbol.at)
    return np.array([at + inner * axis, at + outer * axis])


def _radii(sheet: Sheet, item: Item, symbol: Symbol, body: int) -> Iterator[float]:
    """Yield the radii of rings of a body that have the hinge's axis as a diameter."""
    at = sheet.placed.world(item.body, np.array([symbol.at]))[0]
    axis = sheet.placed.turned(item.body, unit(symbol.axis))
    for other in sheet.touched.get(body, ()):
        if isinstance(other.form, Disc) and other.form.hollow:
            centre = sheet.placed.world(body, np.array([other.form.centre]))[0]
            across = abs(float(sheet.placed.turned(body, other.form.axis) @ axis))
            if float(np.linalg.norm(centre - at)) < _SAME * sheet.scene.size and across < _SAME:
                yield other.form.radius


def ring_marks(sheet: Sheet, item: Item, symbol: Symbol, pins: Floats) -> Iterator[Mark]:
    """Yield the shaft of a hinge on both sides, with a bearing where it ends, on a stem where that is ground."""
    for side in (1.0, -1.0):
        ends = np.array(symbol.at) + side * (pins - np.array(symbol.at))
        page, middle = sheet.page(item.body, ends), ends.mean(axis=0)
        if any(body in sheet.ground for body in item.bodies):
            yield from stand(sheet, item, page[1], unit2(page[1] - page[0], (0.0, -1.0)), 6.0)
        yield Stroke(page, sheet.pen(item, BOLD), **sheet.named(item, LAYER_BODY, middle))
        form = Barrel(vector(ends[1]), unit(symbol.axis), *map(sheet.metres, _BUSH))
        yield from barrel(sheet, item.body, form, sheet.pen(item), sheet.named(item, LAYER_JOINT, ends[1]), fill=PAPER)
