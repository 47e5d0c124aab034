"""The legend below a figure: what its dashes mean, what it leaves out, lengths that it has no room for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from multibody_sym.drawing.lettering import Run, letters, width_of
from multibody_sym.drawing.picture import Note
from multibody_sym.drawing.shown import Shown
from multibody_sym.drawing.style import LAYER_TEXT

_WIDE: Final = 240.0
"""How wide a line of the legend is at most (pt)."""
_MOST: Final = 6
"""So many lines one entry has at most."""
_MORE: Final = ((", ..", "roman"),)

Runs = tuple[Run, ...]


def notes(shown: Shown) -> Iterator[Note]:
    """Yield what is to be said of forces that are not unique: dashed ones, and those that are left out."""
    if any(arrow.open for arrow in shown.reactions):
        yield from listed("not unique", "dashed: not unique, other values would do as well", ())
    if shown.undrawn:
        yield from listed("undrawn", "not unique, so not drawn: ", [letters(each) for each in shown.undrawn])


def listed(name: str, words: str, entries: Sequence[Runs]) -> Iterator[Note]:
    """Yield words and entries behind them as lines that are no wider than a legend, named `name`."""
    line: list[Run] = [(words, "roman")]
    count = 0
    for k, entry in enumerate(entries):
        parted = (*entry, *((("," if k + 1 < len(entries) else "", "roman"),)))
        if width_of([*line, (" ", "roman"), *parted], Note.size) > _WIDE and (line[1:] or not words):
            count += 1
            if count == _MOST:
                yield _line(name, [*line, *_MORE])
                return
            yield _line(name, line)
            line, words = [], ""
        line += [(" ", "roman"), *parted] if line[1:] or not words else parted
    yield _line(name, line)


def _line(name: str, runs: Sequence[Run]) -> Note:
    return Note(tuple(run for run in runs if run[0]), role="legend", name=name, layer=float(LAYER_TEXT))
