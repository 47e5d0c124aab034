"""Coordinates and speeds as formulas of one variable, and where on such a course something happens."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.positivity import surely_positive
from multibody_sym.algebra.quotient_functions import doubled, exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import roots
from multibody_sym.answers.closed_form import WORK
from multibody_sym.answers.instant import AGREEMENT
from multibody_sym.answers.questions.anywhere import Anywhere
from multibody_sym.answers.questions.courses import InTime, least_conditions
from multibody_sym.answers.questions.naming import put_in
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves

_POLISHED: Final = 4
_ZERO: Final = 1e-14
_NEAR: Final = 1e-6
"""How near, relative to its size or 1, a number must be to a root that it is taken for."""


@dataclass(frozen=True, eq=False)
class Course:
    """Coordinates and speeds as formulas of one variable, which has the value `at` at the moment.

    `known` gives the formula of each, None where it has none. `turning` vanishes where the speed does, if that is so at
    the moment. `beside`: a value of the variable near by, at which formulas are simplified where they are no fractions
    of zeros; None leaves them as they are. `used` are the formulas put in so far. Values rest on `signs` of moving
    quantities, which say of parameters what `moving` holds.
    """

    there: Anywhere
    variable: Node
    known: Callable[[Node], InTime | None]
    at: float
    turning: Node | None = None
    beside: float | None = None
    used: dict[Node, InTime] = field(default_factory=dict)
    signs: list[Quotient] = field(default_factory=list)
    moving: list[str] = field(default_factory=list)

    def along(self, asked: Node) -> Node:
        """Return an expression of the model as a formula of the variable. Raises NoClosedFormError."""
        known = len(self.there.forms.field.positive)
        found = self.there.of(asked)
        self.signs.extend(x for x in self.there.forms.field.positive[known:] if not self.there.constant(x))
        return self.put_in(found)

    def put_in(self, asked: Quotient) -> Node:
        """Return what there is at any state as a formula of the variable. Raises NoClosedFormError."""
        found = book_form(doubled(asked))
        for node in (x for x in leaves([found], "symbol") if x in self.there.variables - {self.variable}):
            formula = self.known(node)
            if formula is None:
                raise NoClosedFormError("what is asked for depends on a coordinate whose course has no formula")
            self.used[node] = formula
        known = put_in(found, {node: each.formula for node, each in self.used.items()})
        return known if self.beside is None else simplified(self.there, known, {self.variable: self.beside})

    def granted(self) -> Iterator[str]:
        """Yield what the formulas of time that were used take for granted of parameters, each once."""
        used = [replace(each, until=None) for each in self.used.values()]
        yield from dict.fromkeys((*(condition for each in used for condition in each.conditions()), *self.moving))

    def place(self, zero: Node) -> Node:
        """Return the variable's value, near `at`, at which a formula of it vanishes. Raises NoClosedFormError."""
        solved = self.there.solved
        at = self._polished(zero)
        letters = {**solved.symbolic.letters, self.variable: Letter(self.variable, PRECISE.mpf(at))}
        field = Field(WORK)
        known = {node: field.letter(node, letter) for node, letter in letters.items()}
        (equation,) = exact(field, [zero], known)
        for root in roots(equation, self.variable):
            if abs(evaluate_float([root], solved.sample)[0] - at) <= AGREEMENT * max(1.0, abs(at)):
                return root
        raise NoClosedFormError(f"the moment is a root of no known kind in {self.variable.data}")

    def _polished(self, zero: Node) -> float:
        """Return the root near `at`, to rounding."""
        slope, x = derivative(zero, self.variable), self.at
        sample = self.there.solved.sample
        for _ in range(_POLISHED):
            value, rate = evaluate_float([zero, slope], {**sample, self.variable: x})
            x -= value / rate if rate else 0.0
        if abs(x) <= _ZERO:
            x = 0.0
        if abs(x - self.at) > _NEAR * max(1.0, abs(self.at)):
            raise NoClosedFormError("the formula vanishes elsewhere than the motion shows")
        return x

    def value(self, formula: Node, place: Node) -> Quotient:
        """Return a formula of the variable at a place. Raises NoClosedFormError."""
        field = Field(WORK)
        known = {node: field.letter(node, letter) for node, letter in self.there.solved.symbolic.letters.items()}
        signs = [put_in(self.put_in(sign), {self.variable: place}) for sign in self.signs]
        found, *positive = exact(field, [put_in(formula, {self.variable: place}), *signs], known)
        unsure = [x for x in positive if not surely_positive(field.whole(x.above * x.below))]
        self.moving.extend(map(str, least_conditions(unsure)))
        return found


def simplified(there: Anywhere, node: Node, values: Mapping[Node, float]) -> Node:
    """Return an expression of parameters and of what has values near by in its book form. Raises NoClosedFormError."""
    return book_form(doubled(in_letters(there, node, values)))


def in_letters(there: Anywhere, node: Node, values: Mapping[Node, float]) -> Quotient:
    """Return the same as a quotient."""
    letters = {**there.solved.symbolic.letters, **{x: Letter(x, PRECISE.mpf(y)) for x, y in values.items()}}
    field = Field(WORK)
    return exact(field, [node], {x: field.letter(x, letter) for x, letter in letters.items()})[0]
