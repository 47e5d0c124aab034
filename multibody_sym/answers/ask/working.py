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
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Poly, Quotient
from multibody_sym.algebra.roots import Roots, shortest_node
from multibody_sym.answers.instant.letters import acceleration_names, quotient_of
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, power, symbol
from multibody_sym.scalars.node import number as number_node
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


# ----------------------------------------------------------------------------------------------------------------------
# How an equation is solved for a letter, line by line as on paper.
#
# The root is known already; what led to it are the steps of `algebra.roots`: the factor that vanishes, roots alone on a
# side and squared, sines and cosines of one degree by the tangent, a function by its inverse.


_SAME: Final = 1e-8
"""How near, relative to it or 1, a root must be to the known one."""
_MOST_ROOTS: Final = 2
_LONGEST: Final = 200
"""Letters of a line that is still read."""


class _Traced(Roots):
    """Roots with what was done on the way to each: `moves` at the time at which one is yielded."""

    def __init__(self, field: Field, unknown: Node) -> None:
        super().__init__(field, unknown)
        self.moves: list[Formula] = []
        self._tangent: Node | None = None
        self._factors: dict[Formula, Quotient] = {}

    def says_more(self, whole: Quotient, move: Formula) -> bool:
        """Return whether a line is no factor with which an equation vanishes by constants alone."""
        factor = self._factors.get(move)
        return factor is None or self.unknown in (whole / factor).symbols

    def of_factor(self, p: Poly, left: int) -> Iterator[Node]:
        before, factor = len(self.moves), self.field.whole(self.field.in_ring(p))
        self.moves.append(equation(written(factor), ZERO, "this factor vanishes"))
        self._factors[self.moves[-1]] = factor
        yield from super().of_factor(p, left)
        del self.moves[before:]

    def without_root(self, p: Poly, k: int) -> Poly:
        field = self.field
        plain = field.ring.from_dict({m: c for m, c in p.items() if not m[k]})
        rooted = field.ring.from_dict({m: c for m, c in p.items() if m[k]})
        if plain:
            left, right = written(field.whole(rooted)), written(-field.whole(plain))
            self.moves.append(equation(left, right, "the root alone"))
            squares = (written(field.whole(field.reduced(x**2))) for x in (rooted, plain))
            self.moves.append(equation(next(squares), next(squares), "squared"))
        return super().without_root(p, k)

    def polynomial_roots(self, coefficients: list[Quotient]) -> Iterator[Quotient]:
        tangent, self._tangent = self._tangent, None
        for value in super().polynomial_roots(coefficients):
            before = len(self.moves)
            if tangent is not None:
                self.moves.append(equation(tangent, shortest_node(value), "so"))
            yield value
            del self.moves[before:]

    def inverted(self, node: Node, value: Quotient) -> Iterator[Node]:
        before = len(self.moves)
        if node is not self.unknown and not value.is_zero:
            self.moves.append(equation(node, shortest_node(value), "so"))
        yield from super().inverted(node, value)
        del self.moves[before:]

    def of_circle(self, p: Poly, s: int, c: int) -> Iterator[Node]:
        node, before = self.field.letters[s].node, len(self.moves)
        self._tangent = None if node is None else BUILD["tan"](node.args[0])
        yield from super().of_circle(p, s, c)
        self._tangent = None
        del self.moves[before:]

    def in_tangent(self, terms: dict[tuple[int, int], Quotient], highest: int) -> list[Quotient]:
        found = super().in_tangent(terms, highest)
        if self._tangent is not None:
            powers = (written(x) * power(self._tangent, number_node(k)) for k, x in enumerate(found) if x.size)
            cosine = power(BUILD["cos"](self._tangent.args[0]), number_node(highest))
            self.moves.append(equation(sum(powers, ZERO), ZERO, f"divided by {text(cosine)}"))
        return found

    def of_line(self, angle: Node, a: Quotient, b: Quotient, d: Quotient) -> Iterator[Node]:
        self._tangent = None
        yield from super().of_line(angle, a, b, d)


def solving_lines(
    zero: Node, unknown: Node, root: Node, letters: Mapping[Node, Letter], sample: Mapping[Node, float]
) -> list[Formula]:
    """Return the lines between `zero` = 0 and `unknown` = `root`, with the others' letters and samples.

    None where the root follows at once, or by steps that are not known.
    """
    with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
        at = evaluate_float([root], sample)[0]
        positive = unknown in letters and letters[unknown].positive
        found = quotient_of(zero, {**letters, unknown: Letter(unknown, PRECISE.mpf(at), positive)})
        traced = _Traced(found.field, unknown)
        for each in traced.of(found.field.in_ring(found.above), _MOST_ROOTS):
            if abs(evaluate_float([each], sample)[0] - at) <= _SAME * max(1.0, abs(at)):
                return _told(zero, [move for move in traced.moves if traced.says_more(found, move)])
    return []


def _told(zero: Node, moves: list[Formula]) -> list[Formula]:
    """Return the lines that say something new, none longer than is read."""
    found, seen = list[Formula](), {(text(zero), "0")}
    for line in moves:
        sides = text(line.sides[0]), text(line.sides[1])
        if sides not in seen and all(len(side) <= _LONGEST for side in sides):
            seen.add(sides)
            found.append(line)
    return found
