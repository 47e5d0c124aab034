"""Elimination as it is done by hand: accelerations by each other, friction by its law, then force after force."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import field, replace
from typing import Any

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.worked.exactly import Equality, Exactly, Linear
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Found:
    """One step of an elimination: `unknown` = `value`, from an equation; `becomes` where others have changed it."""

    equation: Equality
    unknown: Any
    value: Linear
    becomes: Equality | None


@dataclass
class Elimination:
    """What elimination of `equations` finds: `steps` in their order and `results`, each unknown's value.

    `idle` are equations that follow from others; `only` these unknowns are looked for, where that is given.
    """

    exactly: Exactly
    accelerations: Sequence[Any]
    steps: list[Found] = field(default_factory=list)
    results: dict[Any, Linear] = field(default_factory=dict)
    idle: list[Equality] = field(default_factory=list)
    only: Collection[Any] | None = None

    def run(self, equations: Sequence[Equality]) -> None:
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
            value = _solved(equation.form, x)
            changed = None if equation is given[equation.tag] else equation
            self.steps.append(Found(given[equation.tag], x, value, changed))
            waiting = [_with(e, x, value) for e in waiting]
        self._put_back()

    def _without_idle(self, waiting: Sequence[Equality]) -> list[Equality]:
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

    def _pivot(self, waiting: Sequence[Equality]) -> tuple[Equality, Any] | None:
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

    def _rank(self, e: Equality, x: Any, a: Quotient, waiting: Sequence[Equality]) -> tuple[Any, ...]:
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


def _solved(form: Linear, x: Any) -> Linear:
    """Return x from form = 0."""
    return form.without(x).times(-(form.rest.field.constant(1) / form.terms[x]))


def _with(e: Equality, x: Any, value: Linear) -> Equality:
    if e.left.of(x) is None and e.right.of(x) is None:
        return e
    return replace(e, left=e.left.with_known(x, value), right=e.right.with_known(x, value))


def _is_unit(a: Quotient) -> bool:
    return (a - 1).is_zero or (a + 1).is_zero


def arranged(e: Equality, accelerations: Collection[Any]) -> Equality:
    """Return an equation with accelerations on the left and all else on the right, with few signs."""
    form = e.form
    zero = form.rest * 0
    left = Linear({x: a for x, a in form.terms.items() if x in accelerations}, zero)
    right = Linear({x: -a for x, a in form.terms.items() if x not in accelerations}, -form.rest)
    first = next(iter(left.terms.values()), None)
    if first is not None and first.sample < 0:
        left, right = left.times(-1), right.times(-1)
    if not left.terms:
        left, right = right, Linear({}, zero)
    return replace(e, left=left, right=right)
