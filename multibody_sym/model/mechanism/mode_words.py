"""What a mode is called: a word for each one-way element, and for friction parts that are told beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from multibody_sym.model.mechanism.one_way import ALONG_VELOCITY, INACTIVE, STICKS, FrictionPart, Mode, OneWay
from multibody_sym.scalars.node import ZERO

_ENDINGS: Final = {1: "+", -1: "-", ALONG_VELOCITY: ""}


def mode_words(elements: Iterable[OneWay], mode: Mode) -> dict[str, str]:
    """Return the state of each element by name, and of friction parts that have a name of their own.

    Contacts `stick`, `slide+`, `slide-`, `slide` (in space), `closed` where nothing rubs, `open`; ropes and stops
    the words they have; friction in joints as contacts; rolling `roll`, `slip+`, `slip-`; wheels `grip`.
    """
    return {name: word for element in elements for name, word in _words(element, mode)}


def _words(element: OneWay, mode: Mode) -> Iterator[tuple[str, str]]:
    active = not element.unilateral or mode.sides.get(element.name, INACTIVE) != INACTIVE
    rubbing = [part for part in element.frictions if part.enough or not (part.static is part.kinetic is ZERO)]
    own = next((part for part in rubbing if part.name == element.name), None)
    if own is None or not active:
        yield element.name, element.words[0 if active else 1]
    if active:
        yield from ((part.name, _word(element, part, mode)) for part in rubbing)


def _word(element: OneWay, part: FrictionPart, mode: Mode) -> str:
    slip = mode.slips.get(part.name, STICKS)
    rests, moves = "stick", "slide"
    if part.name.endswith(".rolling") or (element.kind == "contact" and element.path[0] == "constraints"):
        rests, moves = "roll", "slip"
    elif element.kind == "rope":
        rests, moves = "grip", "slip"
    return rests if slip == STICKS else moves + _ENDINGS[slip]
