"""Clamped ends: what is fixed to ground, or to another body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.drawing.look.settle import MASS
from multibody_sym.drawing.look.sheet import Sheet, left
from multibody_sym.drawing.look.supports import stand, support_side
from multibody_sym.drawing.picture import Hatch, Mark, Stroke
from multibody_sym.drawing.style import BLACK, BOLD, LAYER_GROUND, LAYER_JOINT
from multibody_sym.scene.forms import Symbol
from multibody_sym.scene.items import Item

_UNDER: Final = 19.0
"""How far ground reaches on either side of a mass that is fixed to it (pt)."""


def weld_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a clamped end: hatched ground through the place, or between bodies a filled corner.

    Under a mass without a size ground alone is seen.
    """
    at, named = sheet.at(item.body, symbol.at), sheet.named(item, LAYER_JOINT, symbol.at)
    if item.on_ground and sheet.flat and item.bodies[-1] in sheet.settled.leans:
        if item.bodies[-1] in sheet.settled.bodies:  # it stands on ground that is drawn
            return
        across = sheet.settled.leans[item.bodies[-1]]
        below = at - MASS[1] / 2 * left(across)
        ends = np.array([below - _UNDER * across, below + _UNDER * across])
        yield Hatch(ends, sheet.pen(item, BOLD), side=-1, **{**named, "layer": LAYER_GROUND})
        return
    if item.on_ground:
        yield from stand(sheet, item, at, support_side(sheet, item, at), 3.0)
    square = np.array([(-2.6, -2.6), (2.6, -2.6), (2.6, 2.6), (-2.6, 2.6)])
    yield Stroke(at + square, sheet.pen(item), closed=True, fill=BLACK, **named)

