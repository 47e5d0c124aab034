"""A hint about a model: what its author may have meant, and where."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Self


class Hint(str):
    """The text of a hint; `path` is the part of the model that it is about."""

    path: tuple[str, ...]

    def __new__(cls, told: str, *path: str) -> Self:
        """Return the text with its path."""
        hint = super().__new__(cls, told)
        hint.path = path
        return hint


def first_at_each_place(hints: Iterable[Hint]) -> list[Hint]:
    """Return the first hint about each part of the model: what repeats has the same about all its copies."""
    found: dict[tuple[str, ...], Hint] = {}
    for hint in hints:
        found.setdefault(hint.path, hint)
    return list(found.values())
