"""Sums of products as one expression: what shares a denominator, a factor or a number is written together."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from math import gcd
from typing import Any, Final

import sympy

from multibody_sym.algebra.terms import Monomial, Terms, changed, expression_of, product_of

_LARGEST_DENOMINATOR: Final = 12
_LONGEST_NUMBER: Final = 512
"""Bits of a number that polynomials are still factorised with: products of ten ordinary doubles have them."""
_LONGEST_NUMERATOR: Final = 12


def grouped(terms: Terms, speeds: frozenset[Any]) -> Any:
    """Return terms as one expression: those over one denominator together, factorised where that is shorter."""
    by_denominator: dict[Monomial, Terms] = {}
    for key, factor in terms.items():
        below = tuple(pair for pair in key if _is_quotient(pair))
        above = tuple(pair for pair in key if not _is_quotient(pair))
        by_denominator.setdefault(below, {})[above] = factor
    return sympy.Add(*(_quotient(above, below, speeds) for below, above in by_denominator.items()))


def _is_quotient(power: tuple[Any, Any]) -> bool:
    base, exponent = power
    return bool(base.is_Add and exponent.is_negative)


def _quotient(terms: Terms, below: Monomial, speeds: frozenset[Any]) -> Any:
    if not below or not 1 < len(terms) <= _LONGEST_NUMERATOR:
        return with_like_terms(terms, speeds) * product_of(below)
    sign = -1 if all(factor < 0 for factor in terms.values()) else 1
    positive = {key: sign * factor for key, factor in terms.items()}
    written, factorized = with_like_terms(positive, speeds), _product_of_factors(expression_of(positive))
    shorter = factorized if factorized.count_ops() < written.count_ops() else written
    return sympy.Mul(sign, shorter, product_of(below))


def with_like_terms(terms: Terms, speeds: frozenset[Any]) -> Any:
    """Return terms as one expression: products of speeds that share a factor together, then sums of like parameters."""
    by_factor: dict[Monomial, Terms] = {}
    for key, factor in terms.items():
        still = tuple(pair for pair in key if pair[0] not in speeds)
        by_factor.setdefault(still, {})[tuple(pair for pair in key if pair[0] in speeds)] = factor
    by_motion: dict[Any, Terms] = {}
    for still, moving in by_factor.items():
        content, primitive = _factorized(expression_of(moving))
        by_motion.setdefault(primitive, {})[still] = content
    parts = []
    for motion, rests in by_motion.items():
        common = _common_number(rests.values())
        parts.append(sympy.Mul(common, _with_sums({key: factor / common for key, factor in rests.items()}), motion))
    return sympy.Add(*parts)


@lru_cache(maxsize=1000)
def _factorized(whole: Any) -> tuple[Any, Any]:
    """Return a polynomial in speeds as a number and a factorised polynomial."""
    number, polynomial = (_product_of_factors(whole) if whole.is_Add else whole).as_coeff_Mul()
    return number, polynomial


def _product_of_factors(whole: Any) -> Any:
    """Return an expression factorised; as it is where its numbers are so long that sympy looks for a longer prime.

    A root is one letter: sympy takes it apart, sqrt(2*R*h - h^2) into sqrt(h)*sqrt(2*R - h), and may search for long.
    """
    longest = max((max(abs(x.p), x.q) for x in whole.atoms(sympy.Rational)), default=1)
    if longest.bit_length() > _LONGEST_NUMBER:
        return whole
    powers = sorted(whole.atoms(sympy.Pow), key=sympy.default_sort_key)
    roots = {power: sympy.Dummy(f"root_{k}") for k, power in enumerate(powers) if not power.exp.is_Integer}
    if not roots:
        return sympy.factor(whole)
    number, factors = sympy.factor(whole.xreplace(roots)).as_coeff_Mul()
    written = factors.xreplace({letter: root for root, letter in roots.items()})
    return number * written if number == 1 or not written.is_Add else sympy.Mul(number, written, evaluate=False)


def _common_number(factors: Collection[Any]) -> Any:
    """Return the number that is written before a sum: a minus sign, or the denominator that all terms share."""
    denominator = gcd(*(factor.q for factor in factors))
    sign = -1 if all(factor < 0 for factor in factors) else 1
    return sympy.Rational(sign, denominator if denominator <= _LARGEST_DENOMINATOR else 1)


def _with_sums(terms: Terms) -> Any:
    """Return the sum of terms with k m1 r + k m2 r written k (m1 + m2) r, the largest group first."""
    remaining, parts = dict(terms), list[Any]()
    while True:
        groups: dict[tuple[Monomial, Any], list[tuple[Monomial, Any]]] = {}
        for key, factor in remaining.items():
            for base, exponent in key:
                if exponent == 1 and base.is_Symbol:
                    groups.setdefault((changed(key, {base: -1}), abs(factor)), []).append((key, base))
        (rest, size), members = max(groups.items(), key=lambda group: len(group[1]), default=(((), 1), []))
        if len(members) < 2:
            return sympy.Add(*parts, expression_of(remaining))
        signs = [remaining.pop(key) / size for key, _ in members]
        sign = -1 if all(s < 0 for s in signs) else 1
        like = sympy.Add(*(sign * s * base for s, (_, base) in zip(signs, members, strict=True)))
        parts.append(sympy.Mul(sign * size, product_of(rest), like))
