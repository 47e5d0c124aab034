"""Inequalities under which a closed form holds, as few and as short as they can be said.

A condition is divided by what is positive anyway: by what declarations prove, by letters, which keep the sign that
they have, and by what another condition says. It is dropped where it then says nothing, and where no values of the
parameters break it alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.breaking import Breaking
from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.factors import Poly, factored
from multibody_sym.algebra.positivity import least_sign
from multibody_sym.algebra.quotients import Field, Quotient
from multibody_sym.expressions.printer import text
from multibody_sym.scalars.node import ZERO, Node, add, negate
from multibody_sym.scalars.traversal import flatten

_LONGEST_FACTORED: Final = 60


@dataclass(frozen=True, eq=False)
class Condition:
    """value > 0 where it is `strict`, else value >= 0; `broken` says what happens where it fails.

    `size` is (x, y) where this is one half of |x| <= y; a condition with both halves is `whole`.
    """

    value: Quotient
    strict: bool = False
    broken: str = ""
    size: tuple[Quotient, Quotient] | None = None
    whole: bool = False

    def __str__(self) -> str:
        """Return the comparison in the model's own language; raises NoClosedFormError where it is too long."""
        if self.size is not None and self.whole:
            x, y = self.size
            return f"abs({text(with_doubles(_short(x)))}) {'<' if self.strict else '<='} {text(_form(y))}"
        return comparison(self.value, self.strict)


def within(x: Quotient, y: Quotient, broken: str = "") -> list[Condition]:
    """Return |x| <= y as its two halves."""
    size = (x, y)
    return [Condition(y - x, False, broken, size), Condition(y + x, False, broken, size)]


def comparison(positive: Quotient, strict: bool = True) -> str:
    """Return `a > b` (`a >= b`) for what is positive: b holds what is subtracted, and is 0 where nothing is."""
    form = _form(positive)
    if form.op == "neg":
        return f"{text(form.args[0])} {'<' if strict else '<='} 0"
    sides: dict[bool, list[Node]] = {True: [], False: []}
    for term in flatten("add", form):
        subtracted = term.op == "neg" or (term.op == "number" and term.data < 0)
        sides[subtracted].append(negate(term) if subtracted else term)
    greater, less = (text(reduce(add, sides[subtracted], ZERO)) for subtracted in (False, True))
    return f"{greater} {'>' if strict else '>='} {less}"


def _form(a: Quotient) -> Node:
    return with_doubles(book_form(a))


def _short(a: Quotient) -> Node:
    """Return a or -a, whichever is shorter."""
    return min((book_form(a), book_form(-a)), key=lambda node: len(text(node)))


# --- fewer ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Said:
    """A condition with the factors on which its sign rests, their product positive where it holds."""

    condition: Condition
    factors: list[Poly]

    @property
    def value(self) -> Quotient:
        """The product of the factors."""
        field = self.condition.value.field
        return reduce(lambda a, b: a * b, (field.whole(field.in_ring(p)) for p in self.factors))


def reduced(conditions: Iterable[Condition]) -> list[Condition]:
    """Return the conditions that say something, none of which follows from the others, in their order.

    All are over one field, and hold at its sample.
    """
    said = [_Said(c, factors) for c in conditions if (factors := _undecided(c)) is not None]
    said = _without_doubles(_divided(said))
    if not said:
        return []
    breaking = Breaking(said[0].condition.value.field, [each.factors for each in said])
    kept = list(range(len(said)))
    for k in reversed(range(len(said))):
        if not breaking.broken_alone(k, kept):
            kept.remove(k)
    return list(_joined([replace(said[k].condition, value=said[k].value) for k in kept]))


def _undecided(condition: Condition) -> list[Poly] | None:
    """Return the factors whose signs decide a condition, none positive anyway; None where it holds anyway."""
    value = condition.value
    field, content, turned = value.field, 1, 1
    left: list[Poly] = []
    if value.is_zero:
        return None
    for p in (value.above, value.below):
        number, factors = (1, [(p, 1)]) if len(p) > _LONGEST_FACTORED else factored(p)
        content = content if number > 0 else -content
        for factor, exponent in factors:
            if exponent % 2 == 0:
                continue
            sign = _known_sign(field, factor, condition.strict)
            turned = turned if sign is None or sign > 0 else -turned
            left += [factor] if sign is None else []
    for k, p in enumerate(left):
        if content * turned < 0 and (field.value(p) < 0 or k == len(left) - 1):
            left[k], content = -p, -content
    return left or None


def _known_sign(field: Field, p: Poly, strict: bool) -> int | None:
    """Return the sign that a factor has whatever its letters are (that of the sample, for numbers), None if it varies.

    What can be zero is undecided only where zero is not enough.
    """
    p = field.in_ring(p)
    if not field.whole(p).symbols:
        return 1 if field.value(p) > 0 else -1
    for sign, q in ((1, p), (-1, -p)):
        least = least_sign(field, q)
        if least == 1 or (least == 0 and not strict):
            return sign
    return None


def _divided(said: Sequence[_Said]) -> list[_Said]:
    """Return the conditions without factors of which another one says that they are positive."""
    found = []
    for each in said:
        field = each.condition.value.field
        left = list(each.factors)
        for other in said:
            if other is not each and len(other.factors) == 1 and len(left) > 1:
                left = _without(field, left, other.factors[0])
        found.append(_Said(each.condition, left))
    return found


def _without(field: Field, factors: list[Poly], positive: Poly) -> list[Poly]:
    """Return factors without one that is positive; where its negative stands, another one takes the sign."""
    positive = field.in_ring(positive)
    for k, p in enumerate(map(field.in_ring, factors)):
        if p in (positive, -positive):
            left = [*factors[:k], *factors[k + 1 :]]
            return left if p == positive else [-left[0], *left[1:]]
    return factors


def _without_doubles(said: Sequence[_Said]) -> list[_Said]:
    found: list[_Said] = []
    for each in said:
        same = next((x for x in found if (x.value - each.value).is_zero), None)
        if same is None:
            found.append(each)
        elif each.condition.strict and not same.condition.strict:
            found[found.index(same)] = _Said(replace(same.condition, strict=True), same.factors)
    return found


def _joined(conditions: Sequence[Condition]) -> Iterator[Condition]:
    """Yield the conditions, the two halves of |x| <= y as one, without the factors that x and y share."""
    told: list[tuple[Quotient, Quotient]] = []
    for condition in conditions:
        if any(condition.size is size for size in told):
            continue
        halves = [c for c in conditions if c.size is not None and c.size is condition.size]
        size = _without_shared(*condition.size) if condition.size is not None and len(halves) > 1 else None
        if condition.size is not None and size is not None:
            told.append(condition.size)
            yield replace(condition, size=size, whole=True)
        else:
            yield condition


def _without_shared(x: Quotient, y: Quotient) -> tuple[Quotient, Quotient] | None:
    """Return (x, y) divided by what they share; None where that may change its sign."""
    ratio = x / y
    above, below = (ratio.field.whole(p) for p in (ratio.above, ratio.below))
    if below.sample < 0:
        above, below = -above, -below
    return (above, below) if _undecided(Condition(y / below)) is None else None
