"""Prescribed motions: an arrow along the axis of what is driven, or most of a circle about it."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Symbol, across
from multibody_sym.scene.items import Item

_BESIDE: Final = 16.0
_LENGTH: Final = 24.0
_RADIUS: Final = 12.0


def driven_points(sheet: Sheet, item: Item, symbol: Symbol) -> Floats:
    """Return the points (n, 2) of the arrow by which a prescribed motion is seen."""
    at = sheet.at(item.body, symbol.at)
    if symbol.kind == "drive_along":
        way = unit2(sheet.way(item.body, symbol.axis), (0.0, 1.0))
        start = at - _BESIDE * left(way)
        return np.array([start, start + _LENGTH * way])
    e1 = np.array(across(symbol.axis))
    e2 = np.cross(symbol.axis, e1)
    angles = np.linspace(0.3, 4.6, 32)[:, None]
    rim = [sheet.way(item.body, point) for point in np.cos(angles) * e1 + np.sin(angles) * e2]
    found: Floats = at + _RADIUS * np.array(rim)
    return found
