"""Axes of what moves freely, below the figure, with its coordinates; arrows of what is driven."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.lettering import letters
from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.drawing.picture import Arc, Arrow, Mark, Wish
from multibody_sym.drawing.style import BLACK, LAYER_ARROW, LAYER_TEXT, THIN
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Axes, Symbol, across
from multibody_sym.scene.items import Item

_LENGTH: Final = 22.0
_TURN: Final = 11.0
"""The radius of the bow of what turns (pt)."""
_APART: Final = 58.0
_BESIDE, _DRIVEN, _ABOUT = 16.0, 24.0, 12.0
"""How far (pt) the arrow of a drive is from what slides, its length, and its radius about what turns."""


def free_axes(sheet: Sheet, corner: Floats) -> Iterator[Mark]:
    """Yield the axes of each joint that leaves a body free, in a row below the `corner` of what is drawn."""
    free = [item for item in sheet.scene.items if isinstance(item.form, Axes)]
    for k, item in enumerate(free):
        assert isinstance(item.form, Axes)
        at = corner + np.array([6.0 + _APART * k, -44.0])
        named: dict[str, Any] = {"role": item.role, "name": item.name}
        yield Arc(at, 1.2, None, fill=BLACK, layer=LAYER_ARROW, **named)
        for axis, name in zip(item.form.axes, item.form.names, strict=False):
            way = _LENGTH * sheet.way(item.body, axis)
            if float(np.linalg.norm(way)) < 4.0:
                continue
            yield Arrow(np.array([at, at + way]), THIN, head=4.5, layer=LAYER_ARROW, **named)
            prefer = (float(way[0]), float(way[1]))
            yield Wish((at + way)[None, :], letters(name), prefer=prefer, layer=LAYER_TEXT, **named)
        if len(item.form.axes) == 2 and len(item.form.names) == 3:
            yield from _turn(sheet, item, at, named)


def _turn(sheet: Sheet, item: Item, at: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield the bow of what turns in the plane too, from the first axis towards the second, with its letter."""
    assert isinstance(item.form, Axes)
    first, second = (sheet.way(item.body, axis) for axis in item.form.axes)
    angles = np.linspace(0.15, 1.42, 12)[:, None]
    points = at + _TURN * (np.cos(angles) * first + np.sin(angles) * second)
    yield Arrow(points, THIN, head=3.5, layer=LAYER_ARROW, **named)
    middle, way = points[len(points) // 2][None, :], first + second
    name = letters(item.form.names[-1])
    yield Wish(middle, name, prefer=(float(way[0]), float(way[1])), clear=1.5, layer=LAYER_TEXT, **named)


def driven_points(sheet: Sheet, item: Item, symbol: Symbol) -> Floats:
    """Return the points (n, 2) of the arrow by which a prescribed motion is seen."""
    at = sheet.at(item.body, symbol.at)
    if symbol.kind == "drive_along":
        way = unit2(sheet.way(item.body, symbol.axis), (0.0, 1.0))
        start = at - _BESIDE * left(way)
        return np.array([start, start + _DRIVEN * way])
    e1 = np.array(across(symbol.axis))
    e2 = np.cross(symbol.axis, e1)
    angles = np.linspace(0.3, 4.6, 32)[:, None]
    rim = [sheet.way(item.body, point) for point in np.cos(angles) * e1 + np.sin(angles) * e2]
    found: Floats = at + _ABOUT * np.array(rim)
    return found
