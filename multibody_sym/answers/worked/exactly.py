"""Exact coefficients of equations at an instant: from Nodes in the names of the model to what is printed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.quotient_functions import doubled, exact, register_angles
from multibody_sym.algebra.quotients import Field, Quotient
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import as_node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy

WORK: Final = 200_000
"""How much is done for the equations of one instant, and again for their elimination, in products of terms."""
_ENDLESS: Final = 10**15
_NOTHING: Final = 1e-13
_NEAR: Final = 2e-12


class Exactly:
    """The field in which the steps are calculated, and how its quotients are written in sympy.

    In `numbers` all that is given is put in as numbers of 12 digits.
    """

    def __init__(self, mechanism: Mechanism, symbols: Symbols, given: SymbolicState, *, numbers: bool) -> None:
        self.numbers = numbers
        self.field = Field(self._work)
        self._known = {node: self.field.letter(node, letter) for node, letter in given.letters.items()}
        self._sample = {node: float(letter.sample) for node, letter in given.letters.items()}
        declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
        made = (*symbols.coordinates, *symbols.speeds, *symbols.parameters)
        self._leaves = {symbol(each.name): s for each, s in zip(declared, made, strict=True)}

    def quotients(self, values: Iterable[Any]) -> list[Quotient]:
        """Return values over Nodes as quotients; raises NoClosedFormError where there are none of bearable length."""
        nodes = [as_node(x) for x in values]
        if self.numbers:
            return [self._number(x) for x in evaluate_float(nodes, self._sample)]
        register_angles(self.field, nodes, self._known)
        return exact(self.field, nodes, self._known)

    def _number(self, value: float) -> Quotient:
        return self.field.constant(0 if abs(value) <= _NOTHING else Fraction(f"{value:.12g}"))

    def renew(self) -> None:
        """Let as much work be done again."""
        self.field.work = self._work

    @property
    def _work(self) -> int:
        """How much is done: with numbers, which do not grow, without an end."""
        return _ENDLESS if self.numbers else WORK

    def constant(self, value: int) -> Quotient:
        """Return a whole number."""
        return self.field.constant(value)

    def written(self, quotient: Quotient) -> Any:
        """Return a quotient in sympy; raises NoClosedFormError where it is too long to be read."""
        if self.numbers:
            return in_number(quotient)
        return to_sympy(with_doubles(book_form(doubled(quotient))), self._leaves)


def in_number(quotient: Quotient) -> Any:
    """Return a quotient's value in sympy, as a decimal of 12 digits."""
    value = Fraction(f"{float(quotient.sample):.12g}")
    near = value if abs(value - round(value)) > _NEAR else Fraction(round(value))
    return sympy.Rational(near.numerator, near.denominator)


@dataclass
class Linear:
    """sum terms[x] x + rest, x being symbols of unknowns."""

    terms: dict[Any, Quotient]
    rest: Quotient

    def of(self, x: Any) -> Quotient | None:
        """Return the coefficient of an unknown."""
        return self.terms.get(x)

    def plus(self, other: Linear, factor: Quotient | int = 1) -> Linear:
        """Return this plus a multiple of another."""
        terms = dict(self.terms)
        for x, a in other.terms.items():
            total = terms[x] + a * factor if x in terms else a * factor
            if total.is_zero:
                terms.pop(x, None)
            else:
                terms[x] = total
        return Linear(terms, self.rest + other.rest * factor)

    def times(self, factor: Quotient | int) -> Linear:
        """Return a multiple."""
        return Linear({x: a * factor for x, a in self.terms.items()}, self.rest * factor)

    def with_known(self, x: Any, value: Linear) -> Linear:
        """Return this with an expression in place of an unknown."""
        factor = self.terms.get(x)
        if factor is None:
            return self
        return Linear({y: a for y, a in self.terms.items() if y != x}, self.rest).plus(value, factor)

    def with_all(self, known: Mapping[Any, Linear]) -> Linear:
        """Return this with expressions in place of all unknowns that are known."""
        found = self
        for x in self.terms:
            found = found.with_known(x, known[x]) if x in known else found
        return found

    def without(self, x: Any) -> Linear:
        """Return this without an unknown that vanishes."""
        return Linear({y: a for y, a in self.terms.items() if y != x}, self.rest)

    @property
    def vanishes(self) -> bool:
        """Whether nothing is in it."""
        return not self.terms and self.rest.is_zero


def linear(terms: Iterable[tuple[Any, Quotient]], rest: Quotient) -> Linear:
    """Return a linear form of pairs, zeros left out."""
    found = Linear({}, rest)
    for x, a in terms:
        if not a.is_zero:
            found = found.plus(Linear({x: a}, rest * 0))
    return found


def shown(exactly: Exactly, form: Linear) -> Any:
    """Return a linear form in sympy."""
    parts = [exactly.written(a) * x for x, a in form.terms.items()]
    return sympy.Add(exactly.written(form.rest), *parts)


@dataclass
class Equality:
    """left = right, with the number by which it is named, and where it comes from.

    `kind` is "body", "relation" or "law"; `about` tells the direction or what it says.
    """

    left: Linear
    right: Linear
    kind: str
    about: tuple[Any, ...] = ()
    tag: int = 0
    about_turning: bool = field(default=False)

    @cached_property
    def form(self) -> Linear:
        """Left less right, which is zero."""
        return self.left.plus(self.right, -1)

    def sides(self, exactly: Exactly) -> tuple[Any, Any]:
        """Return both sides in sympy."""
        return shown(exactly, self.left), shown(exactly, self.right)

    def changed(self, change: Any) -> Equality:
        """Return it with both sides changed."""
        return Equality(change(self.left), change(self.right), self.kind, self.about, self.tag, self.about_turning)


def unit_sign(values: Sequence[Quotient]) -> list[int]:
    """Return the sign of each value at the sample, 0 where it is zero."""
    return [0 if x.is_zero else 1 if x.sample > 0 else -1 for x in values]
