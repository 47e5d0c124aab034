"""What a mode is called: a word for each one-way element, and for friction parts that are told beside it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from multibody_sym.mechanics.law_elements import ALONG_VELOCITY, STICKS, FrictionPart, LawElement, Mode
from multibody_sym.model.states import STRIKES, VERBS

SEVERAL: Final = "several states"
"""The word for the event of an element of which the laws leave several states."""
_ENDINGS: Final = {1: "+", -1: "-", ALONG_VELOCITY: ""}


def mode_words(elements: Iterable[LawElement], mode: Mode) -> dict[str, str]:
    """Return the state of each element by name, and of friction parts that have a name of their own.

    Contacts `stick`, `slide+`, `slide-`, `slide` (in space), `closed` where nothing rubs, `open`; ropes and stops
    the words they have; friction in joints as contacts; rolling `roll`, `slip+`, `slip-`; wheels `grip`.
    """
    return {name: word for element in elements for name, word in _words(element, mode)}


def possible_words(elements: Iterable[LawElement]) -> dict[str, set[str]]:
    """Return the words of all states in which elements, and friction parts with a name of their own, may be.

    What may close may strike too.
    """
    found: dict[str, set[str]] = {}
    for element in elements:
        rubbing = [part for part in element.frictions if part.rubs]
        acts = () if any(part.name == element.name for part in rubbing) else element.words[:1]
        words = (*acts, *element.words[1:], *VERBS[STRIKES]) if element.unilateral else acts
        found.setdefault(element.name, set()).update(words)
        for part in rubbing:
            rests, moves = _rubbing(element, part)
            ways = [_ENDINGS[ALONG_VELOCITY]] if len(part.rows) > 1 else [_ENDINGS[1], _ENDINGS[-1]]
            found.setdefault(part.name, set()).update((rests, *(moves + way for way in ways)))
    return found


def _words(element: LawElement, mode: Mode) -> Iterator[tuple[str, str]]:
    active = not element.unilateral or mode.acts(element)
    rubbing = [part for part in element.frictions if part.rubs]
    own = next((part for part in rubbing if part.name == element.name), None)
    if own is None or not active:
        yield element.name, element.words[0 if active else 1]
    if active:
        yield from ((part.name, _word(element, part, mode)) for part in rubbing)


def _word(element: LawElement, part: FrictionPart, mode: Mode) -> str:
    slip = mode.slip(part)
    rests, moves = _rubbing(element, part)
    return rests if slip == STICKS else moves + _ENDINGS[slip]


def _rubbing(element: LawElement, part: FrictionPart) -> tuple[str, str]:
    """Return the words for friction that holds, and for what moves against it."""
    if part.name.endswith(".rolling") or (element.kind == "contact" and element.path[0] == "constraints"):
        return "roll", "slip"
    return ("grip", "slip") if element.kind == "rope" else ("stick", "slide")
