"""The formulas of small motions: frequencies, periods, shapes, the shortest of the forms that have their numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from typing import Any, Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.exact_solve import exact_solve
from multibody_sym.algebra.quotient_functions import doubled, sqrt
from multibody_sym.algebra.quotients import PRECISE, NoClosedFormError, Quotient
from multibody_sym.answers.small_motions.matrices import Matrices
from multibody_sym.answers.small_motions.spectrum import Root
from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.parser import parse
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.values import Value
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, TWO, Node, divide, multiply, negate
from multibody_sym.scalars.traversal import leaves

AGREEMENT: Final = 1e-9
_LONGEST: Final = 600
_LONGEST_NUMBER: Final = 20
_SHAPES: Final = 100_000
_MOST_SHAPED: Final = 5
_ROOT_BELOW: Final = 3
_STILL: Final = 1e-12


@dataclass
class Formulas:
    """Makes values of what is found over the field of matrices; `reasons` collects why a formula was left out."""

    given: Matrices
    reasons: dict[str, None] = field(default_factory=dict)

    @property
    def sample(self) -> dict[Node, float]:
        """The values of the symbols."""
        return {x.node: float(x.sample) for x in self.given.field.letters if x.node is not None and not x.node.args}

    def value(self, a: Quotient, unit: str = "") -> Value:
        """Return a quotient as a value."""
        return self.shortest(float(a.sample), [lambda: book_form(doubled(a))], unit)

    def shortest(self, number: float, forms: Sequence[Callable[[], Node]], unit: str) -> Value:
        """Return a number with the shortest of the forms that have its value, without one where none has."""
        found = [node for node in map(self._made, forms) if node is not None and self._is(node, number)]
        node = min(found, key=_reading, default=None)
        if node is None or (not leaves([node], "symbol") and len(text(node)) > _LONGEST_NUMBER):
            return Value(number, None, unit)
        return Value(number, node, unit)

    def _made(self, form: Callable[[], Node]) -> Node | None:
        try:
            node = with_doubles(form())
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
            return None
        except ExpressionError as reason:
            self.reasons[reason.message] = None
            return None
        if len(text(node)) > _LONGEST:
            self.reasons["the closed form is too long"] = None
            return None
        return node

    def _is(self, node: Node, number: float) -> bool:
        try:
            again = evaluate_float([parse(text(node))], self.sample)[0]
        except (ExpressionError, *UNDEFINED):
            return False
        return abs(again - number) <= AGREEMENT * abs(number)

    # --- frequencies ----------------------------------------------------------------------------------------------

    def frequency(self, root: Root) -> Value:
        """Return omega = sqrt(x)."""
        return self.shortest(float(PRECISE.sqrt(root.value)), list(self._roots_of(root, turned=False)), "rad/s")

    def period(self, root: Root) -> Value:
        """Return T = 2 pi / sqrt(x)."""
        return self.shortest(float(2 * PRECISE.pi / PRECISE.sqrt(root.value)), list(self._periods(root)), "s")

    def rate(self, root: Root) -> Value:
        """Return sqrt(-x), with which what is not stable grows."""
        turned = Root(
            -root.value,
            None if root.node is None else negate(root.node),
            None if root.quotient is None else -root.quotient,
            root.times,
        )
        found = self.frequency(turned)
        return Value(found.value, found.expression, "1/s")

    def _roots_of(self, root: Root, *, turned: bool) -> Iterator[Callable[[], Node]]:
        """Yield forms of sqrt(x), or of sqrt(1 / x)."""
        node, x = root.node, root.quotient
        if x is not None:
            inside = x.power(-1) if turned else x
            yield lambda: book_form(doubled(sqrt(inside)))
            yield lambda: BUILD["sqrt"](book_form(doubled(inside)))
        if root.frequency is not None:
            swings = root.frequency.power(-1) if turned else root.frequency
            yield lambda: book_form(doubled(swings))
        if not turned:
            yield from (lambda form=form: BUILD["sqrt"](form) for form in root.forms)
        if node is not None and not turned:
            yield lambda: BUILD["sqrt"](node)

    def _periods(self, root: Root) -> Iterator[Callable[[], Node]]:
        if root.quotient is not None:
            turned = root.quotient.power(-1)
            circle = self.given.field.letter(PI, self.given.field.letters[0]) * 2
            yield lambda: book_form(doubled(circle * sqrt(turned)))
        for form in self._roots_of(root, turned=True):
            yield lambda form=form: multiply(multiply(TWO, PI), form())  # type: ignore[misc]
        for form in self._roots_of(root, turned=False):
            yield lambda form=form: divide(multiply(TWO, PI), form())  # type: ignore[misc]

    # --- shapes ---------------------------------------------------------------------------------------------------

    def shape(self, root: Root, numbers: Sequence[float], *, exactly: bool) -> list[Value]:
        """Return the amplitudes of a mode without gyroscopic terms, formulas for its numbers where there are any."""
        lead = next((k for k, x in enumerate(numbers) if abs(x) > _STILL), None)
        if lead is None or root.quotient is None or root.times > 1 or not exactly or len(numbers) > _MOST_SHAPED:
            return [Value(x) for x in numbers]
        try:
            found = self._solved_shape(root.quotient, lead, len(numbers))
        except NoClosedFormError:
            return [Value(x) for x in numbers]
        return [
            self.value(a) if abs(float(a.sample) - x) <= AGREEMENT * max(1.0, abs(x)) else Value(x)
            for a, x in zip(found, numbers, strict=True)
        ]

    def _solved_shape(self, x: Quotient, lead: int, size: int) -> list[Quotient]:
        """Return v with (K - x M) v = 0 and v = 1 at the place `lead`."""
        field, M, K = self.given.field, self.given.mass, self.given.stiffness
        field.work = max(field.work, _SHAPES)
        rows = [[b - x * a for a, b in zip(*pair, strict=True)] for pair in zip(M, K, strict=True)]
        others = [k for k in range(size) if k != lead]
        if not others:
            return [field.constant(1)]
        solved = exact_solve([[row[k] for k in others] for row in rows], [-row[lead] for row in rows])
        found: list[Any] = [field.constant(1)] * size
        for k, v in zip(others, solved, strict=True):
            found[k] = v
        return found


def _reading(node: Node) -> tuple[int, bool, bool, str]:
    """Return how long a form is to read, longer where a root divides it; 2 sqrt(a) is the shortest of equals."""
    divides = node.op == "div" and any(x.op == "sqrt" for x in (node.args[1], *node.args[1].args))
    numbered = node.op == "mul" and node.args[0].op == "number" and node.args[1].op == "sqrt"
    return len(text(node)) + _ROOT_BELOW * divides, not numbered, node.op != "sqrt", text(node)


def numbers(values: Sequence[Sequence[Quotient]]) -> list[list[float]]:
    """Return the values of a matrix at the sample."""
    return [[float(x.sample) for x in row] for row in values]

