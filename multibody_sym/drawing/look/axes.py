"""Axes of what moves freely, below the figure: its coordinates with their directions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.lettering import letters
from multibody_sym.drawing.look.sheet import Sheet
from multibody_sym.drawing.picture import Arc, Arrow, Mark, Wish
from multibody_sym.drawing.style import BLACK, LAYER_ARROW, LAYER_TEXT, THIN
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Axes

_LENGTH: Final = 22.0
_APART: Final = 58.0


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
