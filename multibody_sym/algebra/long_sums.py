"""Sums and products as expressions: positive terms first, and terms that differ in one letter only together."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from fractions import Fraction
from functools import lru_cache, reduce
from itertools import combinations
from math import gcd, lcm
from typing import Any, Final

from multibody_sym.algebra.quotients import factors_of
from multibody_sym.scalars.elementary import flatten
from multibody_sym.scalars.node import ONE, ZERO, Node, add, multiply, number, power
from multibody_sym.text.printer import text as printed

Exponents = tuple[int, ...]
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
