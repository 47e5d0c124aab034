"""Sums of products as dictionaries, so that terms can be looked up, merged and changed factor by factor."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import lru_cache
from math import comb, gcd
from typing import Any, Final

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


# ----------------------------------------------------------------------------------------------------------------------
# Absolute values and signs in sums of products, and the whole numbers that a factor's terms share.


def with_signs(terms: Terms) -> Terms:
    """Return the terms with |x| written as x sign(x), so that x^2 / |x| and |x| are one; sign(x)^2 is 1 beside an x."""
    return _with_keys(terms, _with_signs) if _has(terms, sympy.Abs, sympy.sign) else terms


def with_sizes(terms: Terms) -> Terms:
    """Return the terms with x sign(x) written as |x|, and sign(x) / x as 1 / |x|."""
    return _with_keys(terms, _with_sizes) if _has(terms, sympy.sign) else terms


def _has(terms: Terms, *functions: Any) -> bool:
    return any(isinstance(base, functions) for key in terms for base, _ in key)


def _with_keys(terms: Terms, changed: Callable[[Monomial], Monomial]) -> Terms:
    result: Terms = {}
    for key, factor in terms.items():
        add_to(result, changed(key), factor)
    return result


def _with_signs(key: Monomial) -> Monomial:
    powers = dict(key)
    for x in {base.args[0] for base in powers if isinstance(base, (sympy.Abs, sympy.sign))}:
        size, sign = sympy.Abs(x), sympy.sign(x)
        plain, sizes, signs = found = [powers.get(base, sympy.S.Zero) for base in (x, size, sign)]
        alone = plain == sizes == 0  # sign(x)^2 is not 1 where x is 0
        if all(e.is_Integer for e in found) and not alone:
            powers |= {x: plain + sizes, size: sympy.S.Zero, sign: (sizes + signs) % 2}
    return monomial(powers)


def _with_sizes(key: Monomial) -> Monomial:
    powers = dict(key)
    for sign in [base for base, exponent in key if isinstance(base, sympy.sign) and exponent == 1]:
        (x,) = sign.args
        exponent = powers.get(x, sympy.S.Zero)
        if exponent.is_Integer and exponent != 0:
            outer = sympy.sign(exponent)
            powers |= {x: exponent - outer, sympy.Abs(x): outer, sign: sympy.S.Zero}
    return monomial(powers)


def with_numbers_outside(expression: Any) -> Any:
    """Return an expression with the whole numbers that the terms of a factor share before it: 4 (a - b)^2, 2 |a|."""
    return replaced(expression, _shares_number, _number_outside)


def _shares_number(e: Any) -> bool:
    return any(part.is_Add and _shared_number(part) != 1 for part in _factors_of(e))


def _factors_of(e: Any) -> tuple[Any, ...]:
    """Return the parts of a product, power or absolute value before which a number may be written."""
    is_power = e.is_Pow and e.exp.is_Integer
    return e.args if e.is_Mul else (e.args[0],) if is_power or isinstance(e, sympy.Abs) else ()


def _shared_number(total: Any) -> Any:
    number = total.primitive()[0]
    return number if number.is_Integer else sympy.S.One


def _number_outside(e: Any) -> Any:
    factor, parts = sympy.S.One, []
    for part in _factors_of(e):
        shared = _shared_number(part) if part.is_Add else sympy.S.One
        factor *= shared
        parts.append(part if shared == 1 else sympy.Add(*(x / shared for x in part.args)))
    inner = sympy.Mul(*parts) if e.is_Mul else e.func(parts[0], *e.args[1:])
    return (factor**e.exp if e.is_Pow else factor) * inner


# ----------------------------------------------------------------------------------------------------------------------
# Sums of products as one expression: what shares a denominator, a factor or a number is written together.


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
