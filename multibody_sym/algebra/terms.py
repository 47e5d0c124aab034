"""Sums of products as dictionaries, so that terms can be looked up, merged and changed factor by factor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import comb
from typing import Any

import sympy

Monomial = tuple[tuple[Any, Any], ...]
"""A product of powers: (base, exponent) pairs, ordered by the text of the base."""
Terms = dict[Monomial, Any]
"""A sum: the rational factor of each product."""


def expanded_size(expression: Any) -> int:
    """Return how many terms an expression has at most once its products are multiplied out."""
    if expression.is_Add:
        return sum(expanded_size(a) for a in expression.args)
    if expression.is_Mul:
        size = 1
        for a in expression.args:
            size *= expanded_size(a)
        return size
    if expression.is_Pow and is_count(expression.exp):
        return comb(expanded_size(expression.base) + int(expression.exp) - 1, int(expression.exp))
    return 1


def terms_of(expression: Any) -> Terms:
    """Return an expression, multiplied out, as terms; sums under roots and in denominators stay whole."""
    letters: dict[Any, Any] = {}

    def hide(e: Any) -> Any:
        return letters.setdefault(e.base, sympy.Symbol(f"sum {len(letters)}", positive=True)) ** e.exp

    hidden = replaced(expression, is_whole, hide)
    whole: dict[Any, Any] = {}
    for base, letter in letters.items():
        whole[letter] = base.xreplace(whole)
    terms: Terms = {}
    for term in sympy.Add.make_args(sympy.expand(hidden, power_base=False, power_exp=False, log=False)):
        factor, product = term.as_coeff_Mul()
        powers = dict(part.as_base_exp() for part in sympy.Mul.make_args(product) if part != 1)
        add_to(terms, monomial({base.xreplace(whole): exponent for base, exponent in powers.items()}), factor)
    return terms


def replaced(expression: Any, wanted: Callable[[Any], bool], made: Callable[[Any], Any]) -> Any:
    """Return an expression with made(part) for each part that is wanted, from the innermost on.

    That few expressions hold such parts is seen in a fraction of the time that sympy's `replace` takes.
    """
    return expression.replace(wanted, made) if _holds(expression, wanted) else expression


def _holds(expression: Any, wanted: Callable[[Any], bool]) -> bool:
    pending = [expression]
    while pending:
        part = pending.pop()
        if wanted(part):
            return True
        pending.extend(part.args)
    return False


def is_whole(e: Any) -> bool:
    """Return whether an expression is a sum to a power that is not multiplied out: a root, a denominator."""
    return bool(e.is_Pow and e.base.is_Add and not is_count(e.exp))


def expression_of(terms: Mapping[Monomial, Any]) -> Any:
    """Return terms as one expression."""
    return sympy.Add(*(factor * product_of(key) for key, factor in terms.items()))


def product_of(key: Monomial) -> Any:
    """Return a product as one expression."""
    return sympy.Mul(*(base**exponent for base, exponent in key))


def monomial(powers: Mapping[Any, Any]) -> Monomial:
    """Return the product of bases to their exponents."""
    return tuple(sorted(((b, e) for b, e in powers.items() if e != 0), key=_text))


def _text(power: tuple[Any, Any]) -> str:
    return _spelt(power[0])


_spelt = lru_cache(maxsize=10_000)(str)


def changed(key: Monomial, changes: Mapping[Any, int]) -> Monomial:
    """Return a product with the exponents of some factors changed."""
    powers = dict(key)
    for base, change in changes.items():
        powers[base] = powers.get(base, sympy.S.Zero) + change
    return monomial(powers)


def add_to(terms: Terms, key: Monomial, factor: Any) -> None:
    """Add a term to a sum; what adds up to nothing is gone."""
    total = terms.get(key, sympy.S.Zero) + factor
    if total == 0:
        terms.pop(key, None)
    else:
        terms[key] = total


def is_count(exponent: Any) -> bool:
    """Return whether an exponent is a whole number above 0."""
    return bool(exponent.is_Integer and exponent > 0)
