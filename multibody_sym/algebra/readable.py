"""Expressions as a person would write them: terms merged, sin^2 + cos^2 gone, angles added, like terms grouped.

Works on sums of products and only where they stay small; everything larger is left as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from itertools import combinations, product
from typing import Any, Final

import sympy

from multibody_sym.algebra.grouping import grouped
from multibody_sym.algebra.signs import with_numbers_outside, with_signs, with_sizes
from multibody_sym.algebra.terms import (
    Monomial,
    Terms,
    add_to,
    changed,
    expanded_size,
    is_count,
    is_whole,
    replaced,
    terms_of,
)
from multibody_sym.records import dataclass

LARGEST_SUM: Final = 600
"""Terms that an expression may have when its products are multiplied out; past it nothing is rewritten."""

_REWRITTEN_POWERS: Final = range(2, 7)


@dataclass(frozen=True)
class Readable:
    """Rewrites expressions. `speeds` are grouped last; `circles` are the tuples of symbols whose squares add to one."""

    speeds: frozenset[Any]
    circles: tuple[tuple[Any, ...], ...] = ()
    known: dict[Any, Any] = field(default_factory=dict)

    def __call__(self, expression: Any) -> Any:
        """Return the expression as a person would write it; itself where nothing vanishes and it is the shorter one."""
        if expression not in self.known:
            found = self._rewritten(expression) if expanded_size(expression) <= LARGEST_SUM else expression
            self.known[expression] = self.known[found] = found
        return self.known[expression]

    def _rewritten(self, expression: Any) -> Any:
        inside = replaced(expression, _has_inside, self._inside)
        before = terms_of(inside)
        after = with_sizes(with_angle_sums(self._reduced(with_signs(before))))
        found = grouped(with_squares(after, self.speeds, inside), self.speeds)
        vanished = len(after) < len(before)
        return with_numbers_outside(inside if not vanished and inside.count_ops() < found.count_ops() else found)

    def _inside(self, outer: Any) -> Any:
        return outer.func(*(self(part) for part in outer.args))

    def _reduced(self, terms: Terms) -> Terms:
        """Return the terms with sin^2 + cos^2 = 1, and each quaternion's squares, used wherever fewer terms remain."""
        angles = _angles(terms)
        circles = [(sympy.sin(a), sympy.cos(a)) for a in angles] + list(self.circles)
        for _ in range(len(circles) + 1):
            candidates = [_without_square(terms, c[k], (*c[:k], *c[k + 1 :])) for c in circles for k in range(len(c))]
            best = min(candidates, key=len, default=terms)
            if len(best) >= len(terms):
                break
            terms = best
        return terms


def _has_inside(e: Any) -> bool:
    return is_whole(e) or bool(e.is_Function and e.args[0].is_Add)


# --- sin^2 + cos^2 = 1 -----------------------------------------------------------------------------------------------


def _angles(terms: Terms) -> list[Any]:
    found = {b.args[0]: None for key in terms for b, _ in key if isinstance(b, (sympy.sin, sympy.cos))}
    return sorted(found, key=str)


def _without_square(terms: Terms, gone: Any, others: Sequence[Any]) -> Terms:
    """Return the terms with gone^2 = 1 - (sum of the squares of others), in powers that a person would rewrite."""
    result: Terms = {}
    pending = list(terms.items())
    while pending:
        key, factor = pending.pop()
        exponent = dict(key).get(gone, 0)
        if exponent not in _REWRITTEN_POWERS:
            add_to(result, key, factor)
            continue
        pending.append((changed(key, {gone: -2}), factor))
        pending.extend((changed(key, {gone: -2, other: 2}), -factor) for other in others)
    return result


# --- cos(a + b) ------------------------------------------------------------------------------------------------------


def with_angle_sums(terms: Terms) -> Terms:
    """Return the terms with cos a cos b - sin a sin b = cos(a + b) and its like put together."""
    result = dict(terms)
    while True:
        found = next(_pairs(result), None)
        if found is None:
            return result
        first, second, made, factor = found
        del result[first], result[second]
        add_to(result, made, factor)


def _pairs(terms: Terms) -> Iterator[tuple[Monomial, Monomial, Monomial, Any]]:
    """Yield two terms that make the cosine or sine of a sum or difference, and the term that they make."""
    for key, factor in terms.items():
        cosines = [b.args[0] for b, e in key if isinstance(b, sympy.cos) and is_count(e)]
        sines = [b.args[0] for b, e in key if isinstance(b, sympy.sin) and is_count(e)]
        for a, b in combinations(cosines, 2):
            partner = changed(key, {sympy.cos(a): -1, sympy.cos(b): -1, sympy.sin(a): 1, sympy.sin(b): 1})
            if abs(terms.get(partner, 0)) == abs(factor):
                angle = a + b if terms[partner] == -factor else a - b
                yield key, partner, *_with(key, {sympy.cos(a): -1, sympy.cos(b): -1}, sympy.cos(angle), factor)
        for a, b in product(sines, cosines):
            partner = changed(key, {sympy.sin(a): -1, sympy.cos(b): -1, sympy.cos(a): 1, sympy.sin(b): 1})
            if a != b and abs(terms.get(partner, 0)) == abs(factor):
                angle = a + b if terms[partner] == factor else a - b
                yield key, partner, *_with(key, {sympy.sin(a): -1, sympy.cos(b): -1}, sympy.sin(angle), factor)


def _with(key: Monomial, changes: Mapping[Any, int], function: Any, factor: Any) -> tuple[Monomial, Any]:
    """Return the term with some factors changed and a function put in; sympy turns sin(-x) into -sin x."""
    sign, plain = function.as_coeff_Mul()
    return changed(key, {**changes, plain: 1}), sign * factor


# --- squares ---------------------------------------------------------------------------------------------------------


def _sums(expression: Any) -> frozenset[Any]:
    """Return the sums that an expression has in powers."""
    return frozenset(power.base for power in expression.atoms(sympy.Pow) if power.base.is_Add)


def with_squares(terms: Terms, speeds: frozenset[Any], written: Any = sympy.S.Zero) -> Terms:
    """Return the terms with k x^2 - 2 k x y + k y^2 as k (x - y)^2, and what there is more of one square beside it.

    x and y are symbols that are no speeds: m (R - r)^2 + 2 m r^2/5 for m R^2 - 2 m R r + 7 m r^2/5. A difference that
    has a power in `written` keeps its sign.
    """
    squared = {b for key in terms for b, e in key if b.is_Symbol and e == 2 and b not in speeds}
    if len(squared) < 2:
        return terms
    result, known = dict(terms), _sums(written)
    for key, factor in terms.items():
        plain = [b for b, e in key if b in squared and e == 1]
        for x, y in combinations(plain, 2):
            squares = [changed(key, {x: 1, y: -1}), changed(key, {x: -1, y: 1})]
            sizes = [result.get(square, sympy.S.Zero) * sympy.sign(result.get(squares[0], 1)) for square in squares]
            if result.get(key) != factor or min(sizes) != abs(factor) / 2:
                continue
            half = abs(factor) / 2 * sympy.sign(result[squares[0]])
            del result[key]
            for square in squares:
                add_to(result, square, -half)
            first, second = (x, y) if sizes[1] >= sizes[0] else (y, x)
            together = first + second * sympy.sign(factor * half)
            together = -together if -together in known else together
            add_to(result, changed(key, {x: -1, y: -1, together: 2}), half)
            break
    return result
