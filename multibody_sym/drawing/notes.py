"""The legend below a figure: what its dashes mean, what it leaves out, lengths that it has no room for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Final

import numpy as np

from multibody_sym.drawing.lettering import Run, letters, width_of
from multibody_sym.drawing.picture import Note
from multibody_sym.drawing.shown import Shown
from multibody_sym.drawing.style import LAYER_TEXT
from multibody_sym.scene.items import Dimension
from multibody_sym.scene.scene import Scene

_WIDE: Final = 265.0
"""How wide a line of the legend is at most (pt)."""
MOST_LENGTHS: Final = 12
"""Of more lengths those to centres of mass stand in the legend."""
_CENTRE: Final = ".com"
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


def in_legend(scene: Scene) -> tuple[Scene, list[Note]]:
    """Return a scene without the places of centres of mass, and these as a legend, where more lengths are named.

    Such are seen already, and of so many dimension lines nobody could tell whose each is.
    """
    centres = [each for each in scene.dimensions if each.name.endswith(_CENTRE)]
    if len([each for each in scene.dimensions if not each.coordinate]) <= MOST_LENGTHS or not centres:
        return scene, []
    kept = tuple(each for each in scene.dimensions if each not in centres)
    entries = [_place(scene, name, list(group)) for name, group in groupby(centres, key=lambda each: each.name)]
    words = "centres of mass, in the axes of their bodies: "
    return replace(scene, dimensions=kept), list(listed("centres of mass", words, entries))


def _place(scene: Scene, name: str, given: Sequence[Dimension]) -> Runs:
    """Return the name of a body with the components of its centre of mass, of a plane mechanism x and y."""
    end = np.array(given[0].b.point)
    told = ["0" if x == 0.0 else f"{x:.3g}".replace("-", "−") for x in end]
    for each in given:
        told[int(np.argmax(np.abs(end - np.array(each.a.point))))] = each.component
    shown = [runs for text in told[: 2 if scene.plane else 3] for runs in ((", ", "roman"), *_signed(text))]
    return (*letters(name.removesuffix(_CENTRE)), (" (", "roman"), *shown[1:], (")", "roman"))


def _signed(text: str) -> Runs:
    return (("−", "roman"), *letters(text[1:])) if text[:1] == "-" else letters(text)


def listed(name: str, words: str, entries: Sequence[Runs]) -> Iterator[Note]:
    """Yield words and entries behind them as lines that are no wider than a legend, named `name`."""
    line: list[Run] = [(words, "roman")]
    count = held = 0
    for k, entry in enumerate(entries):
        parted = [*entry, ("," if k + 1 < len(entries) else "", "roman")]
        apart: list[Run] = [(" ", "roman")] if held else []
        if held and width_of([*line, *apart, *parted], Note.size) > _WIDE:
            count += 1
            if count == _MOST:
                yield _line(name, [*line, *_MORE])
                return
            yield _line(name, line)
            line, held, apart = [], 0, []
        line += [*apart, *parted]
        held += 1
    yield _line(name, line)


def _line(name: str, runs: Sequence[Run]) -> Note:
    return Note(tuple(run for run in runs if run[0]), role="legend", name=name, layer=float(LAYER_TEXT))
