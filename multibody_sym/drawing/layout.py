"""The page: dimension lines, angles and labels find places that touch nothing; then the page grows around all of it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from multibody_sym.drawing.dimensions import place_bends, place_measures
from multibody_sym.drawing.labels import place_labels
from multibody_sym.drawing.picture import (
    Bend,
    Mark,
    Measure,
    Picture,
    Placed,
    Wish,
    box_of,
    in_order,
    moved,
    simple,
)
from multibody_sym.drawing.room import Room, bounds

MARGIN: Final = 8.0
"""What stays white at the page's edges (pt)."""


def laid_out(marks: Iterable[Mark], title: str, description: str = "") -> Picture:
    """Return a picture of marks, those that want a place included; the same picture every time.

    Nothing is cut off: the page is as large as what is drawn.
    """
    given = list(marks)
    placed = [mark for mark in given if not isinstance(mark, (Wish, Measure, Bend))]
    room = Room(placed)  # type: ignore[arg-type]
    arcs, letters = place_bends(room, [mark for mark in given if isinstance(mark, Bend)])
    lines, told = place_measures(room, [mark for mark in given if isinstance(mark, Measure)])
    labels = place_labels(room, [*letters, *told, *(mark for mark in given if isinstance(mark, Wish))])
    return _paged(in_order([*placed, *arcs, *lines, *labels]), title, description)  # type: ignore[list-item]


def _paged(marks: list[Placed], title: str, description: str) -> Picture:
    left, bottom, right, top = bounds(box_of(part) for mark in marks for part in simple(mark))
    shift = np.array([MARGIN - left, MARGIN - bottom])
    width, height = right - left + 2 * MARGIN, top - bottom + 2 * MARGIN
    return Picture(width, height, [moved(mark, shift) for mark in marks], title, description)
