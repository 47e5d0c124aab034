"""Exact quotients and sums as a book prints them: factored, with sin^2 or 1 - cos^2, tan and one root.

In: a quotient. Out: the shortest of its forms as a Node; with doubles in place of long numbers where people read it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import field, replace
from fractions import Fraction
from functools import lru_cache, reduce
from itertools import combinations
from math import gcd, isqrt, lcm
from operator import mul
from typing import Any, Final

from multibody_sym.algebra.quotients import Exponents, Field, NoClosedFormError, Poly, Quotient, cofactors, factors_of
from multibody_sym.algebra.trigonometry import (
    AngleSums,
    angles_with_multiples,
    contract_squares,
    single_wave,
    trigonometric_forms,
    wave,
    waves,
    with_one_exponent,
    with_tangents,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD, flatten, postorder
from multibody_sym.scalars.node import ONE, ZERO, Node, add, divide, multiply, negate, number, power
from multibody_sym.text.printer import is_halved
from multibody_sym.text.printer import text as printed

# ----------------------------------------------------------------------------------------------------------------------
# Sums and products as expressions: positive terms first, and terms that differ in one letter only together.


Terms = Mapping[Exponents, Fraction]
"""A sum: the number before each product of letters."""
Powers = Callable[[Exponents], list[tuple[Node, int]]]
"""The expressions of the letters of a product, with their exponents."""
Written = tuple[Node, Fraction]
"""A term of a sum as an expression, and the number before it."""

_WHOLE: Final = Fraction(1)
_PLACES: Final = {"number": -1, "pi": 0, "symbol": 1, "pow": 2, "sqrt": 4, "add": 5}


text = lru_cache(maxsize=10_000)(printed)
"""The text of an expression, kept: many ways to write a sum share parts."""


def sum_node(terms: Iterable[Written]) -> Node:
    """Return a sum, its positive terms first."""
    ordered = sorted(terms, key=lambda term: (term[1] < 0, term[0] is ONE, text(term[0])))
    return reduce(add, (multiply(number(c), node) for node, c in ordered), ZERO)


Power = tuple[Node, int | Fraction]


def product_node(powers: Iterable[Power]) -> Node:
    """Return the product of powers: letters first, then their powers, functions, roots, sums."""
    factors = [power(part, number(e)) for node, e in merged(powers) if e for part in flatten("mul", node)]
    return reduce(multiply, sorted(factors, key=_place_in_product), ONE)


def merged(powers: Iterable[Power]) -> list[Power]:
    """Return powers with x^(3/2) for x*sqrt(x) and x^(2/3) for (x^(1/3))^2."""
    found: dict[Node, Fraction] = {}
    for node, e in powers:
        is_power = node.op == "pow" and node.args[1].op == "number"
        base, exponent = (node.args[0], node.args[1].data * e) if is_power else (node, Fraction(e))
        found[base] = found.get(base, Fraction(0)) + exponent
    for root in [x for x in found if x.op == "sqrt" and found.get(x.args[0])]:
        total = found[root.args[0]] + found[root] / 2
        alone = abs(total) == Fraction(1, 2)
        found[root], found[root.args[0]] = (2 * total, Fraction(0)) if alone else (Fraction(0), total)
    return [(node, e) for node, e in found.items() if e]


def _place_in_product(node: Node) -> tuple[int, str]:
    op = node.args[0].op if node.op == "pow" and node.args[0].op != "symbol" else node.op
    return _PLACES.get(op, 3), text(node)


def plain(terms: Terms, powers: Powers) -> list[Written]:
    return [(product_node(powers(m)), c) for m, c in terms.items()]


def group_terms(terms: Terms, powers: Powers) -> list[Written]:
    """Return terms that differ in one letter only as a product of their shared factor and a sum."""
    left = dict(terms)
    products: list[Written] = []
    while True:
        groups: dict[Exponents, list[Exponents]] = {}
        for m in left:
            for k, exponent in enumerate(m):
                if exponent == 1:
                    groups.setdefault((*m[:k], 0, *m[k + 1 :]), []).append(m)
        worth = [x for x, group in groups.items() if any(x) or _share_number(left, group)]
        shared = max(worth, key=lambda x: (len(groups[x]), _evenness(left, groups[x]), sum(x), x), default=None)
        if shared is None or len(groups[shared]) < 2:
            return [*products, *plain(left, powers)]
        inside = {divide_exponents(m, shared): left.pop(m) for m in groups[shared]}
        side = shared_number(inside.values())
        inner = sum_node(plain({m: c / side for m, c in inside.items()}, powers))
        products.append((product_node([*powers(shared), (inner, 1)]), side))


def divide_exponents(m: Exponents, shared: Exponents) -> Exponents:
    return tuple(e - s for e, s in zip(m, shared, strict=True))


def shared_number(numbers: Collection[Fraction]) -> Fraction:
    """Return the number before a sum: the common divisor of whole numbers, or equal decimals; negative if all are."""
    sign = -1 if all(c < 0 for c in numbers) else 1
    if all(c.denominator == 1 for c in numbers):
        return sign * Fraction(gcd(*(int(c) for c in numbers)))
    sizes = {abs(c) for c in numbers}
    return sign * (sizes.pop() if len(sizes) == 1 else _WHOLE)


def _share_number(terms: Terms, group: Collection[Exponents]) -> bool:
    """Return whether a part of a sum has one number other than 1 before all its letters."""
    sizes = {abs(terms[m]) for m in group}
    return len(sizes) == 1 and sizes != {_WHOLE} and len(group) < len(terms)


def _evenness(terms: Terms, group: Collection[Exponents]) -> float:
    """Return how near the coefficients of a group are to each other: 1 for equal ones."""
    sizes = [abs(terms[m]) for m in group]
    return float(min(sizes) / max(sizes))


# ----------------------------------------------------------------------------------------------------------------------
# The shortest way to write a sum by taking letters out, completing squares and factorising the rest.
#
# m sin(a) - m mu cos(a) - M mu is m (sin(a) - mu cos(a)) - M mu, and m R^2 - 2 m R r + m r^2 + J is m (R - r)^2 + J.


_NESTED: Final = 1.1
_LOOKS: Final = 16
_FEW: Final = 6
_MANY: Final = 25
_FACTORED: Final = 4


def _with_length(way: list[Written], weight: float = 1.0) -> tuple[float, list[Written]]:
    return weight * len(text(sum_node(way))), way


class Nested:
    """Writes sums over the letters of one ring, and remembers them."""

    def __init__(self, ring: Any, powers: Powers) -> None:
        self._ring = ring
        self.powers = powers
        self._looks = 0
        self._known: dict[frozenset[tuple[Exponents, Fraction]], list[Written]] = {}

    def shortest(self, terms: Terms) -> list[Written]:
        """Return a sum as terms to be added, by the shortest way found with bounded effort."""
        self._looks = _LOOKS
        return self.parts(terms)

    def parts(self, terms: Terms) -> list[Written]:
        """Return a sum inside another one as terms to be added."""
        key = frozenset(terms.items())
        if key in self._known:
            return self._known[key]
        self._looks -= 1
        way = min(self._ways(terms), key=lambda way: way[0])[1]
        if self._looks >= 0:  # a way found without effort left is none for another sum, which has its own effort
            self._known[key] = way
        return way

    def _ways(self, terms: Terms) -> Iterator[tuple[float, list[Written]]]:
        """Yield ways to write a sum with their lengths, longer by a tenth for ways that no book would take."""
        if len(terms) > 1:
            yield _with_length(group_terms(terms, self.powers))
        yield _with_length(plain(terms, self.powers))
        if not _MANY > len(terms) > 2 or self._looks < 0:
            return
        for way in self._with_squares(terms) if len(terms) <= 2 * _FEW else ():
            yield _with_length(way)
        for k in self._letters(terms):
            inside = {m: c for m, c in terms.items() if m[k]}
            outside = {m: c for m, c in terms.items() if not m[k]}
            yield _with_length(
                [self._product(inside), *(self.parts(outside) if outside else ())], _NESTED if outside else 1.0
            )

    def _letters(self, terms: Terms) -> list[int]:
        """Return the letters that most terms have, fewer of them the longer the sum is."""
        uses = [sum(1 for m in terms if m[k]) for k in range(self._ring.ngens)]
        places = sorted((k for k, n in enumerate(uses) if n > 1), key=lambda k: -uses[k])
        return places[: 3 if len(terms) <= _FEW else 2 if len(terms) <= 2 * _FEW else 1]

    def _product(self, terms: Terms) -> Written:
        """Return terms that share a letter as a product."""
        shared = tuple(map(min, zip(*terms, strict=True)))
        side = shared_number(terms.values())
        inside = {divide_exponents(m, shared): c / side for m, c in terms.items()}
        factors = [(inside, 1)] if len(inside) < _FACTORED else self._factors(inside)
        sums = [(sum_node(self.parts(factor)), e) for factor, e in factors]
        return product_node([*self.powers(shared), *sums]), side

    def _factors(self, terms: Terms) -> list[tuple[Terms, int]]:
        below = lcm(*(c.denominator for c in terms.values()))
        polynomial = self._ring.from_dict({m: int(c * below) for m, c in terms.items()})
        content, factors = factors_of(polynomial)
        if len(factors) == 1 and factors[0][1] == 1:
            return [(terms, 1)]
        found = [({m: Fraction(int(c)) for m, c in p.items()}, e) for p, e in factors]
        scale, odd = Fraction(content, below), next((k for k, (_, e) in enumerate(found) if e == 1), None)
        if scale == 1:
            return [*found]
        if odd is None:
            return [(terms, 1)]
        found[odd] = ({m: c * scale for m, c in found[odd][0].items()}, 1)
        return [*found]

    def _with_squares(self, terms: Terms) -> Iterator[list[Written]]:
        """Yield the sum with k x^2 + 2 k x y + k y^2 written as k (x + y)^2, for pairs of terms that allow it."""
        for (first, a), (second, b) in combinations(terms.items(), 2):
            shared = tuple(map(min, first, second))
            x, y = divide_exponents(first, shared), divide_exponents(second, shared)
            if a * b < 0 or any(e % 2 for e in (*x, *y)):
                continue
            x, y = (tuple(e // 2 for e in m) for m in (x, y))
            across = tuple(s + i + j for s, i, j in zip(shared, x, y, strict=True))
            if across in terms and abs(terms[across]) <= 2 * min(abs(a), abs(b)):
                yield self._with_square(terms, (first, second, across), (shared, x, y))

    def _with_square(self, terms: Terms, gone: tuple[Exponents, ...], square: tuple[Exponents, ...]) -> list[Written]:
        shared, x, y = square
        size = abs(terms[gone[2]]) / 2 * (1 if terms[gone[0]] > 0 else -1)
        alike = 1 if terms[gone[2]] * size > 0 else -1
        left = dict(terms)
        del left[gone[2]]
        for m in gone[:2]:
            left[m] -= size
            if not left[m]:
                del left[m]
        first, second = sorted((product_node(self.powers(m)) for m in (x, y)), key=text)
        inner = sum_node([(first, Fraction(1)), (second, Fraction(alike))])
        node = product_node([*self.powers(shared), (inner, 2)])
        if len(left) < _FACTORED:
            return [(node, size), *(self.parts(left) if left else ())]
        return [(node, size), *min(([self._product(left)], self.parts(left)), key=lambda way: len(text(sum_node(way))))]


# ----------------------------------------------------------------------------------------------------------------------

# ----------------------------------------------------------------------------------------------------------------------
# Numbers with more digits than anyone gave, and the decimals that are printed for them.


_MOST_GIVEN: Final = 8
_DIGITS_OF_A_DOUBLE: Final = 15
_TEN: Final = 10


def is_long(value: Fraction, digits: int = _MOST_GIVEN) -> bool:
    """Return whether a number has more digits than people give to the numbers of a model."""
    return any(len(str(abs(whole)).rstrip("0")) > digits for whole in (value.numerator, value.denominator))


def nearest_double(value: Fraction) -> Fraction:
    """Return a long number as the decimal that identifies its double, 0.2572... for 6098.../2370...; others stay."""
    if not is_long(value):
        return value
    places = value.denominator.bit_length()
    digits = str(abs(value.numerator) * _TEN**places // value.denominator).strip("0")
    exact = is_exact_decimal(value.denominator) and len(digits) <= _DIGITS_OF_A_DOUBLE
    return value if exact else Fraction(repr(float(value)))


def with_doubles(form: Node) -> Node:
    """Return a form with doubles in place of long numbers: for people, no longer exact."""
    shown = dict[Node, Node]()
    for n in postorder([form]):
        if n.op == "number":
            shown[n] = number(nearest_double(Fraction(n.data)))
        else:
            shown[n] = BUILD[n.op](*n.own, *(shown[x] for x in n.args)) if n.args else n
    return shown[form]


def is_exact_decimal(denominator: int) -> bool:
    """Return whether quotients by a whole number are finite decimals."""
    for prime in (2, 5):
        while denominator % prime == 0:
            denominator //= prime
    return denominator == 1


# ----------------------------------------------------------------------------------------------------------------------
# Sums of closed forms that come from decimals of the model, and the divisors that show these again.
#
# Polynomials have whole coefficients: a - 0.001 appears as 1000 a - 1.


_FIVE: Final = 5
_LARGE: Final = 100
_LONGEST_DECIMAL: Final = 10**8
_MOST_DIGITS: Final = 6


def looks_decimal(field: Field, p: Poly, least: int = _TEN) -> bool:
    """Return whether the whole numbers of a sum may come from decimals: large ones, or fives beside a bare number.

    Large are those of 100 and more, and multiples of five from `least` on.
    """
    if len(p) < 2:
        return False
    if any(abs(c) >= _LARGE or (abs(c) >= least and c % _FIVE == 0) for c in p.values()):
        return True
    others = [int(c) for m, c in p.items() if sum(m[1:])]
    nodes = (field.letters[k].node for m in p for k, e in enumerate(m) if e)
    fives = 0 < len(others) < len(p) and gcd(*others) % _FIVE == 0
    return fives and any(node is not None and node.op == "symbol" for node in nodes)


def decimal_scales(p: Poly, value: Fraction) -> set[Fraction]:
    """Return the factors that give a sum short decimals."""
    coefficients = [int(c) for c in p.values()]
    tried = {abs(value), *(Fraction(1, abs(c)) for c in coefficients), *(Fraction(1, _TEN**k) for k in range(1, 7))}
    return {scale for scale in tried - {1} if all(_is_short_decimal(c * scale) for c in coefficients)}


def _is_short_decimal(value: Fraction) -> bool:
    digits = str(value.numerator * _LONGEST_DECIMAL // value.denominator).rstrip("0")
    return _LONGEST_DECIMAL % value.denominator == 0 and len(digits.lstrip("-")) <= _MOST_DIGITS


def power_scale(p: Poly, power: int = 1) -> Fraction:
    """Return a power of ten (its exponent a multiple of `power`) that leaves the largest number of a sum few digits.

    It is 1 for a sum without long numbers.
    """
    if not any(is_long(Fraction(int(c)), _MOST_DIGITS) for c in p.values()):
        return Fraction(1)
    places = len(str(max(abs(int(c)) for c in p.values()))) - 1
    return Fraction(1, _TEN ** (places - places % power))


def exact_root(value: Fraction) -> Fraction:
    """Return the root of a fraction, 0 where it is irrational."""
    above, below = isqrt(value.numerator), isqrt(value.denominator)
    return Fraction(above, below) if above**2 == value.numerator and below**2 == value.denominator else Fraction(0)


# ----------------------------------------------------------------------------------------------------------------------

_MOST_PARTS: Final = 3
_SHORT_SUM: Final = 3
_FEW_SUMS: Final = 5
"""Terms of sums that may be multiplied out, and how many of these are looked at."""
_MOST_TERMS: Final = 120
_MOST_TERMS_TRIED: Final = 30
_FEW_TERMS: Final = 12
_LONGEST: Final = 600
_MUCH_SHORTER: Final = 0.7
_SMALL: Final = 12
_HUNDRED: Final = 100
_WHOLE_FOR_DECIMAL: Final = 4
_FIRST_PAST_TEN: Final = 15


def book_form(a: Quotient, apart: float = _MUCH_SHORTER) -> Node:
    """Return a quotient in the shortest of its forms; raises NoClosedFormError for one that is too long to read.

    A sum is divided part by part where this makes its length less than `apart` times that of one quotient.
    """
    if a.is_zero:
        return ZERO
    if a.size > _MOST_TERMS:
        raise NoClosedFormError("the closed form is too long")
    field = a.field
    above, below = (trigonometric_forms(field, p) for p in (a.above, a.below))
    pairs = dict.fromkeys(field.cancelled(x, y) for x in above for y in below)  # in order: each bounds the effort left
    forms = [_fraction(field, *pair) for pair in pairs]
    roots_below = _with_roots_below(field, field.in_ring(a.above), field.in_ring(a.below))
    forms += [_single_fraction(field, *roots_below)] if roots_below is not None else []
    form = min(forms, key=_length_and_text)
    parts = [node for pair in pairs if (node := _term_by_term(field, *pair)) is not None]
    form = min((x for x in parts if len(text(x)) < apart * len(text(form))), key=_length_and_text, default=form)
    if len(text(form)) > _LONGEST:
        raise NoClosedFormError("the closed form is too long")
    return form


def factored_form(a: Quotient) -> Node:
    """Return a quotient as what all its terms share times a sum by roots: r*w*sin(theta)*(1 + r*cos(theta)/sqrt(c)).

    Raises NoClosedFormError as book_form does.
    """
    if a.is_zero:
        return ZERO
    field = a.field
    powers = tuple(map(min, zip(*field.in_ring(a.above), strict=True)))
    shared = field.whole(field.ring.from_dict({powers: 1}))
    rest = a / shared
    roots = [k for k, letter in enumerate(field.letters) if letter.node is None]
    groups: dict[Exponents, dict[Exponents, Any]] = {}
    for m, c in field.in_ring(rest.above).items():
        groups.setdefault(tuple(m[k] for k in roots), {})[m] = c
    below = field.whole(rest.below)
    forms = [book_form(field.whole(field.ring.from_dict(group)) / below) for group in groups.values()]
    negative = all(form.op == "neg" or (form.shadow or 0) < 0 for form in forms)
    terms = sorted((negate(form) if negative else form for form in forms), key=_length_and_text)
    product = multiply(book_form(shared), reduce(add, terms))
    return negate(product) if negative else product


def _with_roots_below(field: Field, above: Poly, below: Poly) -> tuple[Poly, Poly] | None:
    """Return A + B r over C as A^2 - B^2 r^2 over C (A - B r), None where there is no such root r above.

    m/(sqrt(h) + sqrt(l)) is shorter than m (sqrt(h) - sqrt(l))/(h - l).
    """
    shared = field.ring.from_dict({tuple(map(min, zip(*above, strict=True))): 1})
    total = above.exquo(shared)  # shared letters stay above, as a root may be among them
    for k in reversed(range(len(field.letters))):
        plain = field.ring.from_dict({m: c for m, c in total.items() if not m[k]})
        if field.letters[k].node is None and plain and len(plain) < len(total) <= _FEW_TERMS >= len(below):
            other = 2 * plain - total
            above, other_below = field.cancelled(field.reduced(total * other) * shared, below)
            return field.cancelled(above, other_below * other)
    return None


def _length_and_text(node: Node) -> tuple[int, str]:
    written = text(node)
    return len(written), written


@dataclass(frozen=True)
class _Product:
    """number x factors, each a polynomial with a whole exponent (negative below), written times its scale."""

    number: Fraction
    factors: tuple[tuple[Poly, int], ...]
    scales: Mapping[Poly, Fraction] = field(default_factory=dict)


def _fraction(field: Field, above: Poly, below: Poly) -> Node:
    """Return above / below as one product, or as a whole part and the rest where that is much shorter."""
    single = _single_fraction(field, above, below)
    content, primitive = below.primitive()
    whole, rest = above.div(primitive)
    if not whole or not field.reduced(rest) or below.is_ground:
        return single
    parts = add(_single_fraction(field, whole, field.ring(content)), _single_fraction(field, rest, below))
    size = single.args[0] if single.op == "neg" else single
    is_product = size.op == "div" and size.args[0].op == "mul"
    return parts if len(text(parts)) < (_MUCH_SHORTER if is_product else 1) * len(text(single)) else single


def _term_by_term(field: Field, above: Poly, below: Poly) -> Node | None:
    """Return above / below with its one long sum divided part by part, by sines and cosines; None where none is.

    cos b/sqrt(c) + l sin b/(3 c + l^2) has no shorter common denominator.
    """
    product = _product_of(above, below)
    factors = sorted(((p, e) for p, e in product.factors if e > 0), key=lambda factor: -len(factor[0]))
    divisors = [(p, -e) for p, e in product.factors if e < 0]
    if not factors or not divisors or factors[0][1] != 1 or len(factors[0][0]) > _FEW_TERMS:
        return None
    longest, others = factors[0][0], factors[1:]
    nodes = [letter.node for letter in field.letters]
    angles = [k for k, node in enumerate(nodes) if node is not None and node.op in ("sin", "cos")]
    parts: dict[Exponents, dict[Exponents, Any]] = {}
    for m, c in field.in_ring(longest).items():
        parts.setdefault(tuple(m[k] for k in angles), {})[m] = c
    if not 1 < len(parts) <= _MOST_PARTS:
        return None
    divisor = reduce(mul, (field.in_ring(p) ** e for p, e in divisors))
    turned = 1 if product.number > 0 else -1
    shares = [field.cancelled(field.ring.from_dict(x) * turned, divisor) for x in parts.values()]
    outside = replace(product, number=abs(product.number), factors=tuple(others))
    shared = factors_of(reduce(lambda a, b: cofactors(a, b)[0], (below for _, below in shares)))[1]
    under = reduce(mul, (p**e for p, e in shared), field.ring.one)
    taken = replace(outside, factors=(*outside.factors, *((p, -e) for p, e in shared)))
    ways = [_sum_of_shares(field, outside, shares)]
    if shared:
        ways.append(_sum_of_shares(field, taken, [(above, below.exquo(under)) for above, below in shares]))
    return min(ways, key=_length_and_text)


def _sum_of_shares(field: Field, outside: _Product, shares: Iterable[tuple[Poly, Poly]]) -> Node:
    """Return a product with a sum of fractions as one more factor."""
    terms = sorted((_single_fraction(field, *x) for x in shares), key=lambda x: (x.op == "neg", text(x)))
    return _product_node(field, outside, [(reduce(add, terms), 1)])


def _single_fraction(field: Field, above: Poly, below: Poly) -> Node:
    """Return above / below as a product with one root."""
    product, inside = _split_roots(field, _product_of(above, below))
    outside = product.number
    for p, e in inside.factors:  # sums under the root with decimals: 5 sqrt(d^2 + 0.04)
        scale = _square_scale(field, p)
        outside /= exact_root(scale) ** e
        if e == 1 and scale == power_scale(p, 2) != 1:  # long numbers take in the number before their sum
            scale, inside = scale * inside.number, replace(inside, number=_WHOLE)
        inside = replace(inside, scales={**inside.scales, p: scale})
    product = _with_decimals(field, _with_few_signs(field, replace(product, number=outside)))
    if inside.factors and all(e < 0 for _, e in inside.factors) and inside.number.numerator == 1:
        divisor = _Product(1 / inside.number, tuple((p, -e) for p, e in inside.factors), inside.scales)
        root = [(BUILD["sqrt"](_product_node(field, divisor)), -1)]
    else:
        radicand = _product_node(field, inside)
        root = [] if radicand is ONE else [(BUILD["sqrt"](radicand), 1)]
    node = _product_node(field, replace(product, number=abs(product.number)), root)
    return node if product.number > 0 else negate(node)


def _product_of(above: Poly, below: Poly) -> _Product:
    content, factors = factors_of(above)
    other, other_factors = factors_of(below)
    exponents = [*factors, *((p, -e) for p, e in other_factors)]
    return _Product(Fraction(int(content), int(other)), tuple(exponents))


def _split_roots(field: Field, product: _Product) -> tuple[_Product, _Product]:
    """Return the product without its roots, and the radicand of the one root that they make.

    A radicand that also divides goes below the root, sqrt(f) / f = sqrt(1 / f); a number does so only beside others.
    """
    radicands = [field.in_ring(r) for p, _ in product.factors if (r := _radicand(field, p)) is not None]
    plain = [(p, e) for p, e in product.factors if _radicand(field, p) is None]
    numeric = [int(r.LC) for r in radicands if r.is_ground]
    inside, outside, under = [], product.number, Fraction(1)
    for radicand in (r for r in radicands if not r.is_ground):
        k = next((k for k, (p, e) in enumerate(plain) if e < 0 and p in (radicand, -radicand)), None)
        inside.append((radicand, 1 if k is None else -1))
        if k is not None:
            outside = outside if plain[k][0] == radicand else -outside
            plain[k] = (plain[k][0], plain[k][1] + 1)
    for prime in numeric:
        moved = bool(inside) and outside.denominator % prime == 0
        outside, under = (outside * prime, under / prime) if moved else (outside, under * prime)
    return _Product(outside, tuple((p, e) for p, e in plain if e)), _Product(under, tuple(inside))


def _radicand(field: Field, factor: Poly) -> Poly | None:
    """Return the radicand of a factor that is nothing but the letter of a root."""
    if len(factor) != 1:
        return None
    letters = [k for k, exponent in enumerate(factor.LM) if exponent]
    letter = field.letters[letters[0]] if len(letters) == 1 else None
    return letter.square if letter is not None and letter.node is None else None


def _with_few_signs(field: Field, product: _Product) -> _Product:
    """Return the product with sums below that are positive, others without leading signs, and few signs before it.

    -5 g / (14 (R - r)), not 5 g / (14 (r - R)) where R is the larger one; g (m1 - m2) for -g (m2 - m1).
    """
    value, factors = product.number, list(product.factors)
    for k, (p, e) in enumerate(factors):
        is_difference = any(c > 0 for c in p.values())
        if field.value(p) < 0 if e < 0 and is_difference else not is_difference:
            factors[k], value = (-p, e), -value if e % 2 else value
    if value < 0:
        for k, (p, e) in enumerate(factors):
            if e > 0 and e % 2 and any(c < 0 for c in p.values()):
                factors[k], value = (-p, e), -value
                break
    return _Product(value, tuple(factors))


def _with_decimals(field: Field, product: _Product) -> _Product:
    """Return the product with decimals in sums where this makes it shorter: 2 (a - 0.001) for (1000 a - 1) / 500."""
    for p, e in product.factors:
        if not decimal_scales(p, product.number if e == 1 else _WHOLE):
            product = _divide_by_scale(product, p, e, power_scale(p))
    products, together = [product], product
    for p, e in product.factors:
        if product.scales.get(p, _WHOLE) != _WHOLE:
            continue
        scales = decimal_scales(p, product.number if e == 1 else _WHOLE) if looks_decimal(field, p) else set()
        if e == 1 and len(p) > 1 and any(m[0] == 1 == sum(m) for m in p):  # an angle with a multiple of pi
            scales.add(abs(product.number))
        products += [_divide_by_scale(product, p, e, scale) for scale in sorted(scales)]
        together = _divide_by_scale(together, p, e, _shortest(field, p, scales or {_WHOLE}))
    return min((*products, together), key=lambda x: _length(field, x)) if len(products) > 1 else product


def _shortest(field: Field, p: Poly, scales: Iterable[Fraction]) -> Fraction:
    first, *others = scales
    return first if not others else min((first, *others), key=lambda scale: (len(text(_sum(field, p, scale))), scale))


def _square_scale(field: Field, p: Poly) -> Fraction:
    """Return the square that gives a sum under a root short decimals, 1 if whole numbers are as short."""
    squares = [s for s in decimal_scales(p, _WHOLE) if exact_root(s)] if looks_decimal(field, p) else []
    return _shortest(field, p, (_WHOLE, *squares)) if squares else power_scale(p, 2)


def _divide_by_scale(product: _Product, p: Poly, exponent: int, scale: Fraction) -> _Product:
    return replace(product, number=product.number / scale**exponent, scales={**product.scales, p: scale})


def _length(field: Field, product: _Product) -> tuple[int, int]:
    """Return the length of a product's text, longer by each sum whose whole numbers look like decimals, and how many
    numbers its sums have.

    Tens do not look so: (10 u + 3 w)/7 is no worse than 10 (u + 0.3 w)/7.
    """
    scales = [(p, product.scales.get(p, _WHOLE)) for p, _ in product.factors]
    whole = sum(looks_decimal(field, p, _FIRST_PAST_TEN) and scale == 1 for p, scale in scales)
    numbers = sum(abs(int(c) * scale) != 1 for p, scale in scales for c in p.values())
    return len(text(_product_node(field, product))) + _WHOLE_FOR_DECIMAL * whole, numbers


def _product_node(field: Field, product: _Product, atoms: Iterable[tuple[Node, int]] = ()) -> Node:
    """Return a product with a positive number as one quotient, with `atoms`, more factors with exponents."""
    product, waves_in_it = _split_multiples(field, product)
    product = _with_short_products(field, product)
    if product.number < 0 and not product.scales:
        product = _with_few_signs(field, product)
    if product.number < 0:
        return negate(_product_node(field, replace(product, number=-product.number), [*atoms, *waves_in_it]))
    powers = [*atoms, *waves_in_it, *((_sum(field, p, product.scales.get(p, _WHOLE)), e) for p, e in product.factors)]
    signed = merged(with_tangents(with_one_exponent(field, powers, book_form)))
    above = product_node([(node, e) for node, e in signed if e > 0])
    below = product_node([(node, -e) for node, e in signed if e < 0])
    return _with_number(product.number, above, below)


def _split_multiples(field: Field, product: _Product) -> tuple[_Product, list[tuple[Node, int]]]:
    """Return a product without factors that together are the sine or cosine of a multiple of an angle, and these.

    cos(3 a) has the factors cos(a) and 4 cos(a)^2 - 3.
    """
    multiples: list[tuple[Node, int]] = []
    for s, c in angles_with_multiples(field):
        for side in (1, -1):
            own = []
            for p, e in product.factors:
                used = {k for m in field.in_ring(p) for k, exponent in enumerate(m) if exponent}
                if e * side > 0 and used and used <= {s, c}:
                    own.append((field.in_ring(p), e))
            single = single_wave(field, reduce(mul, (p ** abs(e) for p, e in own), field.ring.one), s, c)
            if single is not None:
                left = tuple((p, e) for p, e in product.factors if (field.in_ring(p), e) not in own)
                product = replace(product, number=product.number * single[1] ** side, factors=left)
                multiples.append((single[0], side))
    return product, multiples


def _with_short_products(field: Field, product: _Product) -> _Product:
    """Return a product with factors multiplied out where that is shorter: p^4 - 1 for (p + 1)*(p - 1)*(p^2 + 1)."""
    sums = [x for x in product.factors if 1 < len(x[0]) <= _SHORT_SUM and product.scales.get(x[0], _WHOLE) == 1]
    if not 1 < len(sums) <= _FEW_SUMS:
        return product
    for chosen in (x for size in range(len(sums), 1, -1) for x in combinations(sums, size)):
        side = 1 if chosen[0][1] > 0 else -1
        if any(e * side < 0 for _, e in chosen):
            continue
        times = side * min(abs(e) for _, e in chosen)
        whole = field.reduced(reduce(mul, (field.in_ring(p) for p, _ in chosen)))
        if 1 < len(whole) < sum(len(p) for p, _ in chosen):
            left = [(p, e - times) for p, e in chosen if e != times]
            if _length_of(field, [*left, (whole, times)]) < _length_of(field, chosen):
                others = (x for x in product.factors if x not in chosen)
                return _with_short_products(field, replace(product, factors=(*others, *left, (whole, times))))
    return product


def _length_of(field: Field, factors: Iterable[tuple[Poly, int]]) -> int:
    return len(text(product_node([(_sum(field, p), abs(e)) for p, e in factors])))


def _with_number(value: Fraction, above: Node, below: Node) -> Node:
    """Return value x above / below: short quotients stand on both sides, others make a decimal where they can."""
    if below is ONE:
        return multiply(number(value), above)
    if is_long(value):
        return divide(multiply(number(value), above), below)
    short = value.denominator <= _SMALL or max(value.numerator, value.denominator) < _HUNDRED or is_halved(value)
    if short or not is_exact_decimal(value.denominator):
        above, below = multiply(number(value.numerator), above), multiply(number(value.denominator), below)
        return divide(above, below)
    return divide(multiply(number(value), above), below)


def _sum(field: Field, p: Poly, scale: Fraction = _WHOLE) -> Node:
    """Return a polynomial times `scale` as a sum, positive terms first.

    g m1 + g m2 becomes g (m1 + m2) where that is shorter.
    """
    key = ("sum", p.ring.ngens, frozenset(p.items()), scale)
    if key not in field.remembered:
        forms = [sum_node(_shortest_parts(field, p, scale))]
        whole = field.in_ring(p)
        for s, c in angles_with_multiples(field):
            multiples = waves(field, whole, s, c)
            if multiples is not None and any(n > 1 for _, _, n in multiples):
                terms = (
                    (product_node([*_powers(field, rest), (wave(field, s, kind, n), 1)]), x * scale)
                    for (rest, kind, n), x in multiples.items()
                )
                forms.append(sum_node(terms))
        field.remembered[key] = min(forms, key=lambda node: len(text(node)))
    node: Node = field.remembered[key]
    return node


def _shortest_parts(field: Field, p: Poly, scale: Fraction) -> list[Written]:
    """Return a polynomial times `scale` as terms to be added."""
    terms = {m: c * scale for m, c in contract_squares(field, p).items()}
    remembered = field.remembered
    if "nested" not in remembered:
        remembered["nested"] = Nested(field.ring, lambda m: _powers(field, m))
    ways: list[list[Written]] = [remembered["nested"].shortest(terms)]
    if len(terms) < len(p) <= _MOST_TERMS_TRIED:
        way = remembered["nested"].shortest({m: c * scale for m, c in field.in_ring(p).items()})
        ways += [way] if len(text(sum_node(way))) < _MUCH_SHORTER * len(text(sum_node(ways[0]))) else []
    if len(terms) > 1 and sum(letter.cosine is not None for letter in field.letters) > 1:
        if "angle sums" not in remembered:
            remembered["angle sums"] = sums = AngleSums(field, book_form)
            remembered["nested sums"] = Nested(sums.ring, lambda m: _powers(field, m, sums))
        together = remembered["angle sums"].put_together(terms)
        ways += [remembered["nested sums"].shortest(together)] if together is not None else []
    return min(ways, key=lambda way: len(text(sum_node(way))))


def _powers(field: Field, exponents: Exponents, sums: AngleSums | None = None) -> list[tuple[Node, int]]:
    """Return a product of letters as expressions with exponents, sqrt(a) sqrt(b) as sqrt(a b)."""
    powers = []
    for k, exponent in enumerate(exponents):
        if exponent and sums is not None and (node := sums.node(k)) is not None:
            powers.append((node, exponent))
        elif exponent and (own := field.letters[k].node) is not None:
            powers.append((own, exponent))
        elif exponent:  # 10 and sqrt(h^2 + 0.09)
            square = field.in_ring(field.letters[k].square)
            scale = _square_scale(field, square)
            powers.append((number(1 / exact_root(scale)), exponent))
            powers.append((BUILD["sqrt"](_sum(field, square, scale)), exponent))
    powers = with_one_exponent(field, powers, book_form)
    roots = [node for node, e in powers if node.op == "sqrt" and e == 1]
    if len(roots) < 2:
        return powers
    squares = [field.in_ring(x.square) for x, e in zip(field.letters, exponents, strict=False) if e and x.node is None]
    if len(squares) == len(roots) and all(_square_scale(field, p) == 1 for p in squares):
        inside = _product_node(field, _Product(_WHOLE, tuple((p, 1) for p in squares)))
    else:
        inside = product_node([(node.args[0], 1) for node in roots])
    return [*(pair for pair in powers if pair[0] not in roots), (BUILD["sqrt"](inside), 1)]
