"""Elimination as it is done by hand: accelerations by each other, friction by its law, then force after force."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.quotient_functions import exact, register_angles, with_whole_angles
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.answers.records import Words
from multibody_sym.derivation.notation import Symbols
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import as_node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy

# ----------------------------------------------------------------------------------------------------------------------
# Exact coefficients of equations at an instant: from Nodes in the names of the model to what is printed.


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
        return to_sympy(with_doubles(book_form(with_whole_angles(quotient))), self._leaves)


def in_number(quotient: Quotient) -> Any:
    """Return a quotient's value in sympy, as a decimal of 12 digits."""
    value = Fraction(f"{float(quotient.sample):.12g}")
    near = value if abs(value - round(value)) > _NEAR else Fraction(round(value))
    return sympy.Rational(near.numerator, near.denominator)


@dataclass
class LinearForm:
    """sum terms[x] x + rest, x being symbols of unknowns."""

    terms: dict[Any, Quotient]
    rest: Quotient

    def of(self, x: Any) -> Quotient | None:
        """Return the coefficient of an unknown."""
        return self.terms.get(x)

    def plus(self, other: LinearForm, factor: Quotient | int = 1) -> LinearForm:
        """Return this plus a multiple of another."""
        terms = dict(self.terms)
        for x, a in other.terms.items():
            total = terms[x] + a * factor if x in terms else a * factor
            if total.is_zero:
                terms.pop(x, None)
            else:
                terms[x] = total
        return LinearForm(terms, self.rest + other.rest * factor)

    def times(self, factor: Quotient | int) -> LinearForm:
        """Return a multiple."""
        return LinearForm({x: a * factor for x, a in self.terms.items()}, self.rest * factor)

    def with_known(self, x: Any, value: LinearForm) -> LinearForm:
        """Return this with an expression in place of an unknown."""
        factor = self.terms.get(x)
        if factor is None:
            return self
        return LinearForm({y: a for y, a in self.terms.items() if y != x}, self.rest).plus(value, factor)

    def with_all(self, known: Mapping[Any, LinearForm]) -> LinearForm:
        """Return this with expressions in place of all unknowns that are known."""
        found = self
        for x in self.terms:
            found = found.with_known(x, known[x]) if x in known else found
        return found

    def without(self, x: Any) -> LinearForm:
        """Return this without an unknown that vanishes."""
        return LinearForm({y: a for y, a in self.terms.items() if y != x}, self.rest)

    @property
    def vanishes(self) -> bool:
        """Whether nothing is in it."""
        return not self.terms and self.rest.is_zero


def linear(terms: Iterable[tuple[Any, Quotient]], rest: Quotient) -> LinearForm:
    """Return a linear form of pairs, zeros left out."""
    found = LinearForm({}, rest)
    for x, a in terms:
        if not a.is_zero:
            found = found.plus(LinearForm({x: a}, rest * 0))
    return found


def in_sympy(exactly: Exactly, form: LinearForm) -> Any:
    """Return a linear form in sympy."""
    parts = [exactly.written(a) * x for x, a in form.terms.items()]
    return sympy.Add(exactly.written(form.rest), *parts)


@dataclass
class NumberedEquation:
    """left = right, with the number by which it is named, and where it comes from.

    `kind` is "body", "relation" or "law"; `about` tells the direction or what it says.
    """

    left: LinearForm
    right: LinearForm
    kind: str
    about: tuple[Any, ...] = ()
    tag: int = 0
    about_turning: bool = field(default=False)

    @cached_property
    def form(self) -> LinearForm:
        """Left less right, which is zero."""
        return self.left.plus(self.right, -1)

    def sides(self, exactly: Exactly) -> tuple[Any, Any]:
        """Return both sides in sympy."""
        return in_sympy(exactly, self.left), in_sympy(exactly, self.right)

    def changed(self, change: Any) -> NumberedEquation:
        """Return it with both sides changed."""
        return replace(self, left=change(self.left), right=change(self.right))


def unit_sign(values: Sequence[Quotient]) -> list[int]:
    """Return the sign of each value at the sample, 0 where it is zero."""
    return [0 if x.is_zero else 1 if x.sample > 0 else -1 for x in values]


# ----------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class EliminationStep:
    """One step of an elimination: `unknown` = `value`, from an equation; `becomes` where others have changed it."""

    equation: NumberedEquation
    unknown: Any
    value: LinearForm
    becomes: NumberedEquation | None


@dataclass
class HandElimination:
    """What elimination of `equations` finds: `steps` in their order and `results`, each unknown's value.

    `idle` are equations that follow from others; `only` these unknowns are looked for, where that is given.
    """

    exactly: Exactly
    accelerations: Sequence[Any]
    steps: list[EliminationStep] = field(default_factory=list)
    results: dict[Any, LinearForm] = field(default_factory=dict)
    idle: list[NumberedEquation] = field(default_factory=list)
    only: Collection[Any] | None = None

    def run(self, equations: Sequence[NumberedEquation]) -> None:
        """Eliminate; raises NoClosedFormError where formulas grow too long or equations contradict each other."""
        waiting = list(equations)
        given = {e.tag: e for e in equations}
        while waiting:
            waiting = self._without_idle(waiting)
            chosen = self._pivot(waiting)
            if chosen is None:
                break
            equation, x = chosen
            waiting.remove(equation)
            form = equation.form
            value = form.without(x).times(-(form.rest.field.constant(1) / form.terms[x]))
            changed = None if equation is given[equation.tag] else equation
            self.steps.append(EliminationStep(given[equation.tag], x, value, changed))
            waiting = [
                replace(e, left=e.left.with_known(x, value), right=e.right.with_known(x, value))
                if x in e.left.terms or x in e.right.terms
                else e
                for e in waiting
            ]
        self._put_back()

    def _without_idle(self, waiting: Sequence[NumberedEquation]) -> list[NumberedEquation]:
        left = []
        for e in waiting:
            form = e.form
            if form.terms:
                left.append(e)
                continue
            if not form.rest.is_zero:
                raise NoClosedFormError("the equations contradict each other in symbols")
            self.idle.append(e)
        return left

    def _pivot(self, waiting: Sequence[NumberedEquation]) -> tuple[NumberedEquation, Any] | None:
        """Return the equation and the unknown for which it is solved next."""
        ranked = [
            (self._rank(e, x, a, waiting), i, e, x)
            for i, e in enumerate(waiting)
            for x, a in e.form.terms.items()
            if not a.vanishes and (self.only is None or x in self.only)
        ]
        if not ranked:
            return None
        _, _, equation, x = min(ranked, key=lambda found: found[:2])
        return equation, x

    def _rank(self, e: NumberedEquation, x: Any, a: Quotient, waiting: Sequence[NumberedEquation]) -> tuple[Any, ...]:
        """Return how late a pivot comes.

        Relations between accelerations come first, for the one named last, then laws, then what names one unknown
        force alone, then the force that fills in least; accelerations that are left come last.
        """
        moving = x in self.accelerations
        alone = len(e.form.terms) == 1
        if moving and e.kind == "relation" and all(y in self.accelerations for y in e.form.terms):
            return 0, not _is_unit(a), -self.accelerations.index(x)
        if e.kind == "law" and e.left.of(x) is not None and not moving:
            return 1, 0, 0
        uses = sum(x in other.form.terms for other in waiting)
        filled = (len(e.form.terms) - 1) * (uses - 1)
        return (3 if moving else 2), 0 if alone else 1, filled, not _is_unit(a), a.size

    def _put_back(self) -> None:
        """Find each unknown from what the later ones were found to be."""
        for found in reversed(self.steps):
            value = found.value
            for x in list(value.terms):
                if x in self.results:
                    value = value.with_known(x, self.results[x])
            self.results[found.unknown] = value

    def unsolved(self, unknowns: Collection[Any]) -> list[Any]:
        """Return the unknowns whose value still names others, and those that have none."""
        return [x for x in unknowns if x not in self.results or self.results[x].terms]


def _is_unit(a: Quotient) -> bool:
    return (a - 1).is_zero or (a + 1).is_zero


def accelerations_left(e: NumberedEquation, accelerations: Collection[Any]) -> NumberedEquation:
    """Return an equation with accelerations on the left and all else on the right, with few signs."""
    form = e.form
    zero = form.rest * 0
    left = LinearForm({x: a for x, a in form.terms.items() if x in accelerations}, zero)
    right = LinearForm({x: -a for x, a in form.terms.items() if x not in accelerations}, -form.rest)
    first = next(iter(left.terms.values()), None)
    if first is not None and first.sample < 0:
        left, right = left.times(-1), right.times(-1)
    if not left.terms:
        left, right = right, LinearForm({}, zero)
    return replace(e, left=left, right=right)


# ----------------------------------------------------------------------------------------------------------------------
# Directions in words: up, to the right, or their components.


_LEFT_RIGHT: Final = {(0, 1): "to the right", (0, -1): "to the left"}
_LONGEST: Final = 40


def short(direction: Words, instead: Words) -> Words:
    """Return a direction, or other words where its components are long."""
    return direction if sum(len(str(word)) for word in direction) <= _LONGEST else instead


class Directions:
    """How directions are called, given which way is up (world, the sign of each axis; zeros where there is no up)."""

    def __init__(self, exactly: Exactly, gravity: Sequence[Quotient], *, plane: bool) -> None:
        signs = [-s for s in unit_sign(gravity)]
        self._up = signs if sum(map(abs, signs)) == 1 else [0, 0, 0]
        self._exactly, self.plane = exactly, plane

    def of(self, vector: Sequence[Quotient]) -> tuple[Quotient, Words]:
        """Return a vector's size and direction; the size of one along no axis is 1 and the words hold components."""
        signs = unit_sign(vector)
        along = [k for k in range(3) if signs[k]]
        if len(along) == 1:
            k = along[0]
            return vector[k] * signs[k], (self._word(k, signs[k]),)
        return self._exactly.constant(1), ("along ", *self.components(vector))

    def turning(self, vector: Sequence[Quotient]) -> tuple[Quotient, Words]:
        """Return the size and direction of a moment."""
        size, words = self.of(vector)
        if self.plane and not vector[2].is_zero:
            return size, ("counter-clockwise" if vector[2].sample > 0 else "clockwise",)
        return size, words

    def _word(self, axis: int, sign: int) -> str:
        if self._up[axis]:
            return "up" if sign == self._up[axis] else "down"
        upright = self.plane and axis == 0 and (self._up[1] == 1 or not any(self._up))
        letter = "xyz"[axis]
        return _LEFT_RIGHT[0, sign] if upright else f"along {letter}" if sign > 0 else f"against {letter}"

    def components(self, vector: Sequence[Quotient]) -> Words:
        """Return a vector's components in brackets, two in the plane."""
        shown: list[Any] = ["("]
        for k, x in enumerate(vector[: 2 if self.plane else 3]):
            shown += [", "] if k else []
            shown.append(self._exactly.written(x))
        return (*shown, ")")
