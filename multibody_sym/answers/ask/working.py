"""How an answer is found: notes on it, and the lines by which a book gets there.

Lines hold expressions of the model (Node); `worked.questions` spells them in the letters of a solution's steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import field
from typing import Final, NamedTuple

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import with_whole_angles
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.instant.letters import acceleration_names
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.printer import text

Lines = Callable[[], Iterable[Line]]


@dataclass(frozen=True)
class Working:
    """How an answer is found: `notes` on it, and in `steps` what yields its lines, asked where steps are printed."""

    notes: list[str] = field(default_factory=list)
    steps: list[Lines] = field(default_factory=list)

    def lines(self) -> list[Line]:
        """Return the lines, those left out that have no closed form."""
        found: list[Line] = []
        for step in self.steps:
            with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
                found.extend(step())
        return found


class WorkedAnswer(NamedTuple):
    """The working of a question, `asked` in words; `at_start`: an expression whose value at the start is the answer.

    `is_later`: it is about what happens after the start; `is_of_small_motion`: near a position of rest, wherever the
    start is. `parts` are the ends of the names of its answers.
    """

    asked: str
    working: Working
    at_start: Node | None = None
    is_later: bool = True
    is_of_small_motion: bool = False
    parts: tuple[str, ...] = ("",)


def acceleration(mechanism: Mechanism, k: int) -> Node:
    """Return the symbol of the rate of a speed, such as x''."""
    return symbol(f"{acceleration_names(mechanism)[k]}''")


def written(a: Quotient) -> Node:
    """Return a quotient in the form of a book."""
    return book_form(with_whole_angles(a))


def time_text(time: Node) -> str:
    """Return a time for people, a number with its unit."""
    return f"{text(time)} s" if not leaves([time], "symbol") else text(time)


def direction_text(along: Point) -> str:
    """Return a direction for people."""
    return f"({', '.join(map(text, along))})"


AT_START: Final = Sentence(("at the start",))
"""Says that an extreme is that at the start."""
BY_RUN: Final = Sentence(("the equations of motion are integrated numerically from the start",))
"""Begins the lines of an answer that runs alone have."""

OMEGA: Final = symbol("omega")
IMAGINARY: Final = symbol("i")
ZETA: Final = symbol("zeta")
OMEGA_0: Final = symbol("omega_0")
"""The damping ratio and the natural frequency of one freedom."""
_ROOTS: Final = 2
"""Other roots that are named beside the one that a question asks for."""
_NOW: Final = 1e-9


def other_times(at: float, others: Mapping[Node, float]) -> Iterator[Line]:
    """Yield why other times at which an equation holds (s, by their formulas) are not the one asked for, `at`."""
    for root, value in [*others.items()][:_ROOTS]:
        if abs(value) <= _NOW * max(1.0, abs(at)):
            yield Sentence(("not ", TIME, " = ", root, ", which is the start"))
        elif value < 0.0 or value > at:
            yield Sentence(("not ", TIME, " = ", root, f", which is {'before the start' if value < 0.0 else 'later'}"))


def equation(left: Node, right: Node, before: str = "") -> Formula:
    """Return an equation, with words before it."""
    return Formula((left, right), before=(before,) if before else ())


def integral_line(node: Node, integrand: Node, by: Node, start: Node) -> Sentence:
    """Return that the time, or a coordinate, is an integral."""
    return Sentence(("separation of variables: ", node, " is the integral of ", integrand, " by ", by, " from ", start))
