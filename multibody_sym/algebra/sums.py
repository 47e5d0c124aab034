"""Sums of products (sympy) as dictionaries, in which terms are looked up, merged and changed factor by factor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import comb, gcd
from typing import Any, Final

import sympy

Monomial = tuple[tuple[Any, Any], ...]
"""A product of powers: (base, exponent) pairs, ordered by the text of the base."""
Terms = dict[Monomial, Any]
"""A sum: the rational factor of each product."""


def expanded_size(expression: Any) -> int:
    """Return a bound of the number of terms of an expression with its products multiplied out."""
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

    hidden = replace_parts(expression, is_whole, hide)
    whole: dict[Any, Any] = {}
    for base, letter in letters.items():
        whole[letter] = base.xreplace(whole)
    terms: Terms = {}
    for term in sympy.Add.make_args(sympy.expand(hidden, power_base=False, power_exp=False, log=False)):
        factor, product = term.as_coeff_Mul()
        powers = dict(part.as_base_exp() for part in sympy.Mul.make_args(product) if part != 1)
        add_to(terms, monomial({base.xreplace(whole): exponent for base, exponent in powers.items()}), factor)
    return terms


def replace_parts(expression: Any, wanted: Callable[[Any], bool], made: Callable[[Any], Any]) -> Any:
    """Return an expression with made(part) for each wanted part, from the innermost on."""
    pending = [expression]
    while pending:  # most expressions have no such part, and this takes a fraction of the time of sympy's `replace`
        part = pending.pop()
        if wanted(part):
            return expression.replace(wanted, made)
        pending.extend(part.args)
    return expression


def is_whole(e: Any) -> bool:
    """Return whether an expression is a sum under a root or in a denominator, which is not multiplied out."""
    return bool(e.is_Pow and e.base.is_Add and not is_count(e.exp))


def expression_of(terms: Mapping[Monomial, Any]) -> Any:
    return sympy.Add(*(factor * product_of(key) for key, factor in terms.items()))


def product_of(key: Monomial) -> Any:
    return sympy.Mul(*(base**exponent for base, exponent in key))


def monomial(powers: Mapping[Any, Any]) -> Monomial:
    return tuple(sorted(((b, e) for b, e in powers.items() if e != 0), key=lambda power: _text(power[0])))


_text = lru_cache(maxsize=10_000)(str)


def with_exponents(key: Monomial, changes: Mapping[Any, int]) -> Monomial:
    """Return a product with the exponents of some factors changed."""
    powers = dict(key)
    for base, change in changes.items():
        powers[base] = powers.get(base, sympy.S.Zero) + change
    return monomial(powers)


def add_to(terms: Terms, key: Monomial, factor: Any) -> None:
    """Add a term to a sum; terms with the factor 0 are removed."""
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
    if not _has(terms, sympy.Abs, sympy.sign):
        return terms
    result: Terms = {}
    for key, factor in terms.items():
        powers = dict(key)
        for x in {base.args[0] for base in powers if isinstance(base, (sympy.Abs, sympy.sign))}:
            size, sign = sympy.Abs(x), sympy.sign(x)
            plain, sizes, signs = exponents = [powers.get(base, sympy.S.Zero) for base in (x, size, sign)]
            alone = plain == sizes == 0  # sign(x)^2 is not 1 where x is 0
            if all(e.is_Integer for e in exponents) and not alone:
                powers |= {x: plain + sizes, size: sympy.S.Zero, sign: (sizes + signs) % 2}
        add_to(result, monomial(powers), factor)
    return result


def with_sizes(terms: Terms) -> Terms:
    """Return the terms with x sign(x) written as |x|, and sign(x) / x as 1 / |x|."""
    if not _has(terms, sympy.sign):
        return terms
    result: Terms = {}
    for key, factor in terms.items():
        powers = dict(key)
        for sign in [base for base, exponent in key if isinstance(base, sympy.sign) and exponent == 1]:
            (x,) = sign.args
            exponent = powers.get(x, sympy.S.Zero)
            if exponent.is_Integer and exponent != 0:
                outer = sympy.sign(exponent)
                powers |= {x: exponent - outer, sympy.Abs(x): outer, sign: sympy.S.Zero}
        add_to(result, monomial(powers), factor)
    return result


def _has(terms: Terms, *functions: Any) -> bool:
    return any(isinstance(base, functions) for key in terms for base, _ in key)


def with_numbers_outside(expression: Any) -> Any:
    """Return an expression with the whole numbers that the terms of a factor share before it: 4 (a - b)^2, 2 |a|."""
    return replace_parts(expression, _shares_number, _number_outside)


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
# Sums of products as one expression: terms that share a denominator, a factor or a number stand together.


_LARGEST_DENOMINATOR: Final = 12
_LONGEST_NUMBER: Final = 512
"""Bits of a number with which polynomials are still factorised; products of ten ordinary doubles have them."""
_LONGEST_NUMERATOR: Final = 12


def group_by_denominator(terms: Terms, speeds: frozenset[Any]) -> Any:
    """Return terms as one expression: those over one denominator together, factorised where that is shorter."""
    by_denominator: dict[Monomial, Terms] = {}
    for key, factor in terms.items():
        below = tuple(pair for pair in key if _is_quotient(pair))
        above = tuple(pair for pair in key if not _is_quotient(pair))
        by_denominator.setdefault(below, {})[above] = factor
    quotients = []
    for below, numerator in by_denominator.items():
        if not below or not 1 < len(numerator) <= _LONGEST_NUMERATOR:
            quotients.append(with_like_terms(numerator, speeds) * product_of(below))
            continue
        sign = -1 if all(factor < 0 for factor in numerator.values()) else 1
        positive = {key: sign * factor for key, factor in numerator.items()}
        plain, factorized = with_like_terms(positive, speeds), _product_of_factors(expression_of(positive))
        shorter = factorized if factorized.count_ops() < plain.count_ops() else plain
        quotients.append(sympy.Mul(sign, shorter, product_of(below)))
    return sympy.Add(*quotients)


def _is_quotient(power: tuple[Any, Any]) -> bool:
    base, exponent = power
    return bool(base.is_Add and exponent.is_negative)


def with_like_terms(terms: Terms, speeds: frozenset[Any]) -> Any:
    """Return terms as one expression: products of speeds that share a factor together, then sums of like parameters."""
    by_factor: dict[Monomial, Terms] = {}
    for key, factor in terms.items():
        still = tuple(pair for pair in key if pair[0] not in speeds)
        by_factor.setdefault(still, {})[tuple(pair for pair in key if pair[0] in speeds)] = factor
    by_motion: dict[Any, Terms] = {}
    for still, moving in by_factor.items():
        content, primitive = _factorize(expression_of(moving))
        by_motion.setdefault(primitive, {})[still] = content
    parts = []
    for motion, rests in by_motion.items():
        # before a sum: a minus sign, or the denominator that all terms share
        denominator = gcd(*(factor.q for factor in rests.values()))
        sign = -1 if all(factor < 0 for factor in rests.values()) else 1
        common = sympy.Rational(sign, denominator if denominator <= _LARGEST_DENOMINATOR else 1)
        parts.append(sympy.Mul(common, _with_sums({key: factor / common for key, factor in rests.items()}), motion))
    return sympy.Add(*parts)


@lru_cache(maxsize=1000)
def _factorize(whole: Any) -> tuple[Any, Any]:
    """Return a polynomial in speeds as a number and a factorised polynomial."""
    number, polynomial = (_product_of_factors(whole) if whole.is_Add else whole).as_coeff_Mul()
    return number, polynomial


def _product_of_factors(whole: Any) -> Any:
    """Return an expression factorised; itself where its numbers are so long that sympy looks for a longer prime.

    A root is one letter, as sympy splits it, sqrt(2*R*h - h^2) into sqrt(h)*sqrt(2*R - h), and may search for long.
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


def _with_sums(terms: Terms) -> Any:
    """Return the sum of terms with k m1 r + k m2 r written k (m1 + m2) r, the largest group first."""
    remaining, parts = dict(terms), list[Any]()
    while True:
        groups: dict[tuple[Monomial, Any], list[tuple[Monomial, Any]]] = {}
        for key, factor in remaining.items():
            for base, exponent in key:
                if exponent == 1 and base.is_Symbol:
                    groups.setdefault((with_exponents(key, {base: -1}), abs(factor)), []).append((key, base))
        (rest, size), members = max(groups.items(), key=lambda group: len(group[1]), default=(((), 1), []))
        if len(members) < 2:
            return sympy.Add(*parts, expression_of(remaining))
        signs = [remaining.pop(key) / size for key, _ in members]
        sign = -1 if all(s < 0 for s in signs) else 1
        like = sympy.Add(*(sign * s * base for s, (_, base) in zip(signs, members, strict=True)))
        parts.append(sympy.Mul(sign * size, product_of(rest), like))
