"""Sums of forces that are unique where the single ones of separate contacts are not: two feet share what they bear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, product
from typing import Any, Final

from multibody_sym.answers.instant import Solved
from multibody_sym.answers.one_way import Acting
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.quantities import force_name
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.one_way import OneWay

_MOST: Final = 4
"""How many forces are added at most: with either sign, and fewer of them where all together are not unique."""

Signed = tuple[tuple[OneWay, int], ...]


def unique_sums(solved: Solved, reactions: Mapping[str, Mapping[str, Value]]) -> dict[str, Value]:
    """Return the sums of one kind of force over separate contacts that are unique, though none of them is alone.

    By their words, such as `friction(c) + friction(d)`; the forces of one contact's corners stand together anyway.
    """
    found: dict[str, Value] = {}
    for word in ("normal", "friction", "tension"):
        alone = [x for x in solved.mechanism.one_way if _is_open(reactions, x, word)]
        if 2 <= len(alone) <= _MOST:
            found |= _of_word(solved, alone, word, reactions)
    return found


def _is_open(reactions: Mapping[str, Mapping[str, Value]], element: OneWay, word: str) -> bool:
    """Return whether an element has a force that is not unique, and is no part of several that are told together."""
    value = reactions.get(element.name, {}).get(word)
    together = element.group != element.name and word in reactions.get(element.group, {})
    return value is not None and not value.unique and not together


def _of_word(
    solved: Solved, elements: list[OneWay], word: str, reactions: Mapping[str, Mapping[str, Value]]
) -> dict[str, Value]:
    found: dict[str, Value] = {}
    told: set[str] = set()
    for size in range(len(elements), 1, -1):
        for chosen in combinations(elements, size):
            if told & {element.name for element in chosen}:
                continue
            name, value = next(_unique(solved, chosen, word, reactions), ("", None))
            if value is not None:
                found[name] = value
                told |= {element.name for element in chosen}
    return found


def _unique(
    solved: Solved, chosen: tuple[OneWay, ...], word: str, reactions: Mapping[str, Mapping[str, Value]]
) -> Iterator[tuple[str, Value]]:
    """Yield the sums and differences of forces that are unique."""
    for signs in product((1, -1), repeat=len(chosen) - 1):
        signed: Signed = tuple(zip(chosen, (1, *signs), strict=True))
        name = "".join(f" {'+' if sign > 0 else '-'} {force_name(each.name, word)}" for each, sign in signed)[3:]

        def of_sum(instant: Instant, signed: Signed = signed, name: str = name) -> Mapping[str, Any]:
            return {name: sum(sign * Acting.at(instant).of(element)[word] for element, sign in signed)}

        value = solved.values(of_sum, {name: reactions[chosen[0].name][word].unit})[name]
        if value.unique and value.value is not None:
            yield name, value
