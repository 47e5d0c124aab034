"""Worked: a solution step by step, as data to be written out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, NamedTuple

from multibody_sym.dynamics.derivation.notation import Notation
from multibody_sym.records import dataclass

Words = tuple[Any, ...]
"""A sentence: texts, and expressions (sympy) and quantities that stand in it."""


class Quantity(NamedTuple):
    """A number in an SI unit; empty for a pure number."""

    number: float
    unit: str


@dataclass(frozen=True)
class Sentence:
    """A line of words, with expressions between them."""

    words: Words


@dataclass(frozen=True)
class Formula:
    """A line of mathematics: `sides` (sympy) joined by `relation`; `before` are words before it.

    `tag` is the number by which other lines name it. `value` is what it comes to. Where it is
    `assumed`, its first side has this value under an assumption that is rejected.
    """

    sides: tuple[Any, ...]
    relation: str = "="
    tag: int | None = None
    before: Words = ()
    value: Quantity | None = None
    assumed: bool = False


Line = Sentence | Formula


@dataclass(frozen=True)
class WorkedStep:
    """One step: its title and its lines."""

    title: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Worked:
    """A solution as a book writes it: `steps` in order, and the `notation` of its symbols.

    `values` are the numbers (SI) of all symbols that stand in it: parameters, accelerations, forces.
    """

    name: str
    steps: tuple[WorkedStep, ...]
    notation: Notation
    values: Mapping[Any, float] = field(default_factory=dict)

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """All lines of mathematics."""
        return tuple(line for step in self.steps for line in step.lines if isinstance(line, Formula))
