"""The page: dimension lines, angles and labels find places that touch nothing; then the page grows around all of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from multibody_sym.drawing.dimensions import place_bends, place_measures
from multibody_sym.drawing.labels import place_labels
from multibody_sym.drawing.picture import (
    Bend,
    Mark,
    Measure,
    Note,
    Picture,
    Placed,
    Text,
    Wish,
    box_of,
    in_order,
    moved,
    simple,
)
from multibody_sym.drawing.room import Room, bounds

MARGIN: Final = 8.0
"""What stays white at the page's edges (pt)."""
_LINE: Final = 1.45
"""From one line of the legend to the next, in sizes of the type."""


def laid_out(marks: Iterable[Mark], title: str, description: str = "") -> Picture:
    """Return a picture of marks, those that want a place included; the same picture every time.

    Nothing is cut off: the page is as large as what is drawn.
    """
    given = list(marks)
    placed = [mark for mark in given if not isinstance(mark, (Wish, Measure, Bend, Note))]
    room = Room(placed)  # type: ignore[arg-type]
    arcs, letters = place_bends(room, [mark for mark in given if isinstance(mark, Bend)])
    lines, told = place_measures(room, [mark for mark in given if isinstance(mark, Measure)])
    labels = place_labels(room, [*letters, *told, *(mark for mark in given if isinstance(mark, Wish))])
    drawn: list[Placed] = [*placed, *arcs, *lines, *labels]  # type: ignore[list-item]
    legend = _legend(drawn, [mark for mark in given if isinstance(mark, Note)])
    return _paged(in_order([*drawn, *legend]), title, description)


def _legend(drawn: list[Placed], notes: list[Note]) -> Iterator[Text]:
    """Yield the lines of a legend below all that is drawn, from its left edge on."""
    if not notes:
        return
    left, bottom, _, _ = bounds(box_of(part) for mark in drawn for part in simple(mark))
    for k, note in enumerate(notes, 1):
        at = np.array([left, bottom - 4.0 - _LINE * k * note.size])
        yield Text(at, note.runs, note.size, role=note.role, name=note.name, layer=note.layer)


def _paged(marks: list[Placed], title: str, description: str) -> Picture:
    left, bottom, right, top = bounds(box_of(part) for mark in marks for part in simple(mark))
    shift = np.array([MARGIN - left, MARGIN - bottom])
    width, height = right - left + 2 * MARGIN, top - bottom + 2 * MARGIN
    return Picture(width, height, [moved(mark, shift) for mark in marks], title, description)
