"""States of what holds one way only as conditions: `c sticks`, `string slackens`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from multibody_sym.errors import ModelError, suggestion
from multibody_sym.model.declaration.values import Condition, described
from multibody_sym.scalars.node import Node

VERBS: Final[Mapping[str, tuple[str, ...]]] = {
    "sticks": ("stick",),
    "slides": ("slide", "slide+", "slide-"),
    "opens": ("open",),
    "closes": ("closed", "stick", "slide", "slide+", "slide-"),
    "tautens": ("taut",),
    "slackens": ("slack",),
    "grips": ("grip",),
    "rolls": ("roll",),
    "slips": ("slip", "slip+", "slip-"),
    "stops": ("lower", "upper"),
    "frees": ("free",),
}
"""What an element begins to do, and the words of the states in which it does."""
_STATED: Final = re.compile(rf"\s*(\S.*?)\s+({'|'.join(VERBS)})\s*")


@dataclass(frozen=True)
class StateCondition:
    """That an element, or a part of it that rubs, begins to be in a state: `c sticks`."""

    element: str
    verb: str

    def __str__(self) -> str:
        return f"{self.element} {self.verb}"

    def holds(self, words: Mapping[str, str]) -> bool:
        """Return whether it holds where elements are in the states that `words` tell."""
        return words.get(self.element) in VERBS[self.verb]

    def verify(self, names: Iterable[str]) -> None:
        """Raise ModelError where no element of that name holds one way only."""
        known = list(names)
        if self.element not in known:
            raise ModelError(
                f"{self.element!r} is no contact, rope that may slacken, stop or friction, which alone have states"
                f"{suggestion(self.element, known)}"
            )


def state_condition(value: Any) -> StateCondition | None:
    """Return what is written as an element and what it begins to do, None for all else."""
    if isinstance(value, StateCondition):
        return value
    found = _STATED.fullmatch(value) if isinstance(value, str) else None
    return None if found is None else StateCondition(*found.groups())


@dataclass(frozen=True)
class State:
    """A state that begins, such as `c sticks`."""

    def accept(self, value: Any) -> StateCondition:
        found = state_condition(value)
        if found is None:
            raise ModelError(f"expected a state such as c sticks ({', '.join(VERBS)}), got {described(value)}")
        return found

    def tree(self, value: StateCondition) -> str:
        return str(value)


@dataclass(frozen=True)
class StopCondition(Condition):
    """A comparison, or a state that begins."""

    def accept(self, value: Any) -> Any:
        return state_condition(value) or super().accept(value)

    def tree(self, value: Node | StateCondition) -> str:
        return str(value) if isinstance(value, StateCondition) else super().tree(value)
