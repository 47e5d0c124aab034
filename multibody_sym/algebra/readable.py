"""Expressions as a person would write them: terms merged, sin^2 + cos^2 gone, angles added, like terms grouped.

Works on sums of products and only where they stay small; everything larger is left as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import combinations, product
from math import comb, gcd
from typing import Any, Final

import sympy

LARGEST_SUM: Final = 600
"""Terms that an expression may have when its products are multiplied out; past it nothing is rewritten."""

_LARGEST_DENOMINATOR: Final = 12
_LONGEST_NUMBER: Final = 512
"""Bits of a number that polynomials are still factorised with: products of ten ordinary doubles have them."""
_LONGEST_NUMERATOR: Final = 12
_REWRITTEN_POWERS: Final = range(2, 7)
Monomial = tuple[tuple[Any, Any], ...]
"""A product of powers: (base, exponent) pairs, ordered by the text of the base."""
Terms = dict[Monomial, Any]
"""A sum: the rational factor of each product."""


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
        inside = expression.replace(_has_inside, self._inside)
        before = terms_of(inside)
        after = with_sizes(with_angle_sums(self._reduced(with_signs(before))))
        found = grouped(with_squares(after, self.speeds, _sums(inside)), self.speeds)
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
    return _is_whole(e) or bool(e.is_Function and e.args[0].is_Add)


def _is_count(exponent: Any) -> bool:
    return bool(exponent.is_Integer and exponent > 0)


# --- sums of products ----------------------------------------------------------------------------------------------


def expanded_size(expression: Any) -> int:
    """Return how many terms an expression has at most once its products are multiplied out."""
    if expression.is_Add:
        return sum(expanded_size(a) for a in expression.args)
    if expression.is_Mul:
        size = 1
        for a in expression.args:
            size *= expanded_size(a)
        return size
    if expression.is_Pow and _is_count(expression.exp):
        return comb(expanded_size(expression.base) + int(expression.exp) - 1, int(expression.exp))
    return 1


def terms_of(expression: Any) -> Terms:
    """Return an expression, multiplied out, as terms; sums under roots and in denominators stay whole."""
    letters: dict[Any, Any] = {}

    def hide(e: Any) -> Any:
        return letters.setdefault(e.base, sympy.Symbol(f"sum {len(letters)}", positive=True)) ** e.exp

    hidden = expression.replace(_is_whole, hide)
    whole: dict[Any, Any] = {}
    for base, letter in letters.items():
        whole[letter] = base.xreplace(whole)
    terms: Terms = {}
    for term in sympy.Add.make_args(sympy.expand(hidden, power_base=False, power_exp=False, log=False)):
        factor, product = term.as_coeff_Mul()
        powers = dict(part.as_base_exp() for part in sympy.Mul.make_args(product) if part != 1)
        _added(terms, _monomial({base.xreplace(whole): exponent for base, exponent in powers.items()}), factor)
    return terms


def _is_whole(e: Any) -> bool:
    return bool(e.is_Pow and e.base.is_Add and not _is_count(e.exp))


def expression_of(terms: Mapping[Monomial, Any]) -> Any:
    """Return terms as one expression."""
    return sympy.Add(*(factor * _product(key) for key, factor in terms.items()))


def _product(key: Monomial) -> Any:
    return sympy.Mul(*(base**exponent for base, exponent in key))


def _monomial(powers: Mapping[Any, Any]) -> Monomial:
    return tuple(sorted(((b, e) for b, e in powers.items() if e != 0), key=_text))


def _text(power: tuple[Any, Any]) -> str:
    return _spelt(power[0])


_spelt = lru_cache(maxsize=10_000)(str)


def _changed(key: Monomial, changes: Mapping[Any, int]) -> Monomial:
    """Return a product with the exponents of some factors changed."""
    powers = dict(key)
    for base, change in changes.items():
        powers[base] = powers.get(base, sympy.S.Zero) + change
    return _monomial(powers)


def _added(terms: Terms, key: Monomial, factor: Any) -> None:
    total = terms.get(key, sympy.S.Zero) + factor
    if total == 0:
        terms.pop(key, None)
    else:
        terms[key] = total


# --- signs and numbers ---------------------------------------------------------------------------------------------


def with_signs(terms: Terms) -> Terms:
    """Return the terms with |x| written as x sign(x), so that x^2 / |x| and |x| are one; sign(x)^2 is 1 beside an x."""
    return _with_keys(terms, _with_signs)


def with_sizes(terms: Terms) -> Terms:
    """Return the terms with x sign(x) written as |x|, and sign(x) / x as 1 / |x|."""
    return _with_keys(terms, _with_sizes)


def _with_keys(terms: Terms, changed: Callable[[Monomial], Monomial]) -> Terms:
    result: Terms = {}
    for key, factor in terms.items():
        _added(result, changed(key), factor)
    return result


def _with_signs(key: Monomial) -> Monomial:
    powers = dict(key)
    for x in {base.args[0] for base in powers if isinstance(base, (sympy.Abs, sympy.sign))}:
        size, sign = sympy.Abs(x), sympy.sign(x)
        plain, sizes, signs = found = [powers.get(base, sympy.S.Zero) for base in (x, size, sign)]
        alone = plain == sizes == 0  # sign(x)^2 is not 1 where x is 0
        if all(e.is_Integer for e in found) and not alone:
            powers |= {x: plain + sizes, size: sympy.S.Zero, sign: (sizes + signs) % 2}
    return _monomial(powers)


def _with_sizes(key: Monomial) -> Monomial:
    powers = dict(key)
    for sign in [base for base, exponent in key if isinstance(base, sympy.sign) and exponent == 1]:
        (x,) = sign.args
        exponent = powers.get(x, sympy.S.Zero)
        if exponent.is_Integer and exponent != 0:
            outer = sympy.sign(exponent)
            powers |= {x: exponent - outer, sympy.Abs(x): outer, sign: sympy.S.Zero}
    return _monomial(powers)


def with_numbers_outside(expression: Any) -> Any:
    """Return an expression with the whole numbers that the terms of a factor share before it: 4 (a - b)^2, 2 |a|."""
    return expression.replace(_shares_number, _number_outside)


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


# --- sin^2 + cos^2 = 1 ---------------------------------------------------------------------------------------------


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
            _added(result, key, factor)
            continue
        pending.append((_changed(key, {gone: -2}), factor))
        pending.extend((_changed(key, {gone: -2, other: 2}), -factor) for other in others)
    return result


# --- cos(a + b) ----------------------------------------------------------------------------------------------------


def with_angle_sums(terms: Terms) -> Terms:
    """Return the terms with cos a cos b - sin a sin b = cos(a + b) and its like put together."""
    result = dict(terms)
    while True:
        found = next(_pairs(result), None)
        if found is None:
            return result
        first, second, made, factor = found
        del result[first], result[second]
        _added(result, made, factor)


def _pairs(terms: Terms) -> Iterator[tuple[Monomial, Monomial, Monomial, Any]]:
    """Yield two terms that make the cosine or sine of a sum or difference, and the term that they make."""
    for key, factor in terms.items():
        cosines = [b.args[0] for b, e in key if isinstance(b, sympy.cos) and _is_count(e)]
        sines = [b.args[0] for b, e in key if isinstance(b, sympy.sin) and _is_count(e)]
        for a, b in combinations(cosines, 2):
            partner = _changed(key, {sympy.cos(a): -1, sympy.cos(b): -1, sympy.sin(a): 1, sympy.sin(b): 1})
            if abs(terms.get(partner, 0)) == abs(factor):
                angle = a + b if terms[partner] == -factor else a - b
                yield key, partner, *_with(key, {sympy.cos(a): -1, sympy.cos(b): -1}, sympy.cos(angle), factor)
        for a, b in product(sines, cosines):
            partner = _changed(key, {sympy.sin(a): -1, sympy.cos(b): -1, sympy.cos(a): 1, sympy.sin(b): 1})
            if a != b and abs(terms.get(partner, 0)) == abs(factor):
                angle = a + b if terms[partner] == factor else a - b
                yield key, partner, *_with(key, {sympy.sin(a): -1, sympy.cos(b): -1}, sympy.sin(angle), factor)


def _with(key: Monomial, changes: Mapping[Any, int], function: Any, factor: Any) -> tuple[Monomial, Any]:
    """Return the term with some factors changed and a function put in; sympy turns sin(-x) into -sin x."""
    sign, plain = function.as_coeff_Mul()
    return _changed(key, {**changes, plain: 1}), sign * factor


# --- squares -------------------------------------------------------------------------------------------------------


def _sums(expression: Any) -> frozenset[Any]:
    """Return the sums that an expression has in powers."""
    return frozenset(power.base for power in expression.atoms(sympy.Pow) if power.base.is_Add)


def with_squares(terms: Terms, speeds: frozenset[Any], known: frozenset[Any] = frozenset()) -> Terms:
    """Return the terms with k x^2 - 2 k x y + k y^2 as k (x - y)^2, and what there is more of one square beside it.

    x and y are symbols that are no speeds: m (R - r)^2 + 2 m r^2/5 for m R^2 - 2 m R r + 7 m r^2/5. A difference that
    is `known` keeps its sign.
    """
    result = dict(terms)
    for key, factor in terms.items():
        plain = [b for b, e in key if e == 1 and b.is_Symbol and b not in speeds]
        for x, y in combinations(plain, 2):
            squares = [_changed(key, {x: 1, y: -1}), _changed(key, {x: -1, y: 1})]
            sizes = [result.get(square, sympy.S.Zero) * sympy.sign(result.get(squares[0], 1)) for square in squares]
            if result.get(key) != factor or min(sizes) != abs(factor) / 2:
                continue
            half = abs(factor) / 2 * sympy.sign(result[squares[0]])
            del result[key]
            for square in squares:
                _added(result, square, -half)
            first, second = (x, y) if sizes[1] >= sizes[0] else (y, x)
            together = first + second * sympy.sign(factor * half)
            together = -together if -together in known else together
            _added(result, _changed(key, {x: -1, y: -1, together: 2}), half)
            break
    return result


# --- grouping ------------------------------------------------------------------------------------------------------


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
        return with_like_terms(terms, speeds) * _product(below)
    sign = -1 if all(factor < 0 for factor in terms.values()) else 1
    positive = {key: sign * factor for key, factor in terms.items()}
    written, factorized = with_like_terms(positive, speeds), _product_of_factors(expression_of(positive))
    shorter = factorized if factorized.count_ops() < written.count_ops() else written
    return sympy.Mul(sign, shorter, _product(below))


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
    """Return an expression factorised; as it is where its numbers are so long that sympy looks for a longer prime."""
    longest = max((max(abs(x.p), x.q) for x in whole.atoms(sympy.Rational)), default=1)
    return sympy.factor(whole) if longest.bit_length() <= _LONGEST_NUMBER else whole


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
                    groups.setdefault((_changed(key, {base: -1}), abs(factor)), []).append((key, base))
        (rest, size), members = max(groups.items(), key=lambda group: len(group[1]), default=(((), 1), []))
        if len(members) < 2:
            return sympy.Add(*parts, expression_of(remaining))
        signs = [remaining.pop(key) / size for key, _ in members]
        sign = -1 if all(s < 0 for s in signs) else 1
        like = sympy.Add(*(sign * s * base for s, (_, base) in zip(signs, members, strict=True)))
        parts.append(sympy.Mul(sign * size, _product(rest), like))
