"""What a scene looks like: the marks of all that is in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from multibody_sym.drawing.look.arrows import arrow_marks
from multibody_sym.drawing.look.axes import free_axes
from multibody_sym.drawing.look.labels import angle_marks, dimension_marks, label_marks, word_marks
from multibody_sym.drawing.look.rails import rail_marks
from multibody_sym.drawing.look.shapes import FORMS
from multibody_sym.drawing.look.sheet import Sheet
from multibody_sym.drawing.look.stops import stop_marks
from multibody_sym.drawing.look.strands import strand_marks
from multibody_sym.drawing.look.symbols import SYMBOLS
from multibody_sym.drawing.picture import Arc, Hatch, Mark, Stroke
from multibody_sym.drawing.projection import Projection
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Axes, Rail, Stop, Symbol, TurnStop
from multibody_sym.scene.items import Item, Path, Placed
from multibody_sym.scene.scene import Scene


def scene_marks(
    scene: Scene,
    placed: Placed,
    projection: Projection,
    *,
    frames: bool = False,
    names: bool = True,
    marked: Mapping[Path, str] | None = None,
) -> list[Mark]:
    """Return the marks of a scene at a state, in points of a page whose origin is that of space; labels are wishes.

    `frames` shows the axes of frames; `names` letters of bodies, joints, lengths and angles; `marked` paths are drawn
    in another colour.
    """
    sheet = Sheet(scene, placed, scene.at(), projection, marked or {})
    found = [mark for item in scene.items if _is_seen(item, frames) for mark in item_marks(sheet, item)]
    found += [mark for strand in placed.strands for mark in strand_marks(sheet, strand)]
    found += free_axes(sheet, _low_corner(found, sheet))
    found += arrow_marks(sheet, _corner(found, sheet), found)
    found += word_marks(sheet)
    if names:
        found += [*label_marks(sheet), *dimension_marks(sheet), *angle_marks(sheet)]
    return found


def _corner(marks: list[Mark], sheet: Sheet) -> Floats:
    """Return the place to the right and above of all that is drawn (2)."""
    high = [np.asarray(mark.points).max(axis=0) for mark in marks if isinstance(mark, (Stroke, Arc, Hatch))]
    found: Floats = np.max([*high, sheet.span[1]], axis=0)
    return found


def _low_corner(marks: list[Mark], sheet: Sheet) -> Floats:
    """Return the place to the left and below of all that is drawn (2)."""
    low = [np.asarray(mark.points).min(axis=0) for mark in marks if isinstance(mark, (Stroke, Arc, Hatch))]
    found: Floats = np.min([*low, sheet.span[0]], axis=0)
    return found


def _is_seen(item: Item, frames: bool) -> bool:
    return frames or item.role != "frame"


def item_marks(sheet: Sheet, item: Item) -> Iterator[Mark]:
    """Yield how one item looks."""
    if isinstance(item.form, Symbol):
        yield from SYMBOLS[item.form.kind](sheet, item, item.form)
    elif isinstance(item.form, Axes):
        return  # they stand beside the figure
    elif isinstance(item.form, Rail):
        yield from rail_marks(sheet, item, item.form)
    elif isinstance(item.form, (Stop, TurnStop)):
        yield from stop_marks(sheet, item, item.form)
    else:
        yield from FORMS[type(item.form)](sheet, item, item.form)
