"""Sums and products as expressions: positive terms first, and terms that differ in one letter only together."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from fractions import Fraction
from functools import lru_cache, reduce
from math import gcd
from typing import Final

from multibody_sym.expressions.printer import text as printed
from multibody_sym.scalars.node import ONE, ZERO, Node, add, multiply, number, power
from multibody_sym.scalars.traversal import flatten

Exponents = tuple[int, ...]
Terms = Mapping[Exponents, Fraction]
"""A sum: the number before each product of letters."""
Powers = Callable[[Exponents], list[tuple[Node, int]]]
"""What the letters of a product are written as, with their exponents."""
Written = tuple[Node, Fraction]
"""A term of a sum as an expression, and the number before it."""

_WHOLE: Final = Fraction(1)
_PLACES: Final = {"number": -1, "pi": 0, "symbol": 1, "pow": 2, "sqrt": 4, "add": 5}


text = lru_cache(maxsize=10_000)(printed)
"""The text of an expression; many ways to write a sum have parts in common."""


def added(terms: Iterable[Written]) -> Node:
    """Return a sum, its positive terms first."""
    ordered = sorted(terms, key=lambda term: (term[1] < 0, term[0] is ONE, text(term[0])))
    return reduce(add, (multiply(number(c), node) for node, c in ordered), ZERO)


def multiplied(powers: Iterable[tuple[Node, int]]) -> Node:
    """Return the product of powers: letters first, then their powers, functions, roots, sums."""
    factors = [power(part, number(e)) for node, e in powers if e for part in flatten("mul", node)]
    return reduce(multiply, sorted(factors, key=_place_in_product), ONE)


def _place_in_product(node: Node) -> tuple[int, str]:
    op = node.args[0].op if node.op == "pow" and node.args[0].op != "symbol" else node.op
    return _PLACES.get(op, 3), text(node)


def plain(terms: Terms, powers: Powers) -> list[Written]:
    """Return each term by itself."""
    return [(multiplied(powers(m)), c) for m, c in terms.items()]


def grouped(terms: Terms, powers: Powers) -> list[Written]:
    """Return terms that differ in one letter only as a product of what they share and a sum."""
    left = dict(terms)
    found: list[Written] = []
    while True:
        groups: dict[Exponents, list[Exponents]] = {}
        for m in left:
            for k, exponent in enumerate(m):
                if exponent == 1:
                    groups.setdefault((*m[:k], 0, *m[k + 1 :]), []).append(m)
        worth = [x for x, group in groups.items() if any(x) or _share_number(left, group)]
        shared = max(worth, key=lambda x: (len(groups[x]), _evenness(left, groups[x]), sum(x), x), default=None)
        if shared is None or len(groups[shared]) < 2:
            return [*found, *plain(left, powers)]
        inside = {divided(m, shared): left.pop(m) for m in groups[shared]}
        side = shared_number(inside.values())
        inner = added(plain({m: c / side for m, c in inside.items()}, powers))
        found.append((multiplied([*powers(shared), (inner, 1)]), side))


def divided(m: Exponents, shared: Exponents) -> Exponents:
    """Return a product divided by another one."""
    return tuple(e - s for e, s in zip(m, shared, strict=True))


def shared_number(numbers: Collection[Fraction]) -> Fraction:
    """Return the number that is written before a sum: what whole numbers share, what decimals are if they are equal.

    It is negative where all are.
    """
    sign = -1 if all(c < 0 for c in numbers) else 1
    if all(c.denominator == 1 for c in numbers):
        return sign * Fraction(gcd(*(int(c) for c in numbers)))
    sizes = {abs(c) for c in numbers}
    return sign * (sizes.pop() if len(sizes) == 1 else _WHOLE)


def _share_number(terms: Terms, group: Collection[Exponents]) -> bool:
    """Return whether letters that are less than the whole sum have the same number before them, and one to be seen."""
    sizes = {abs(terms[m]) for m in group}
    return len(sizes) == 1 and sizes != {_WHOLE} and len(group) < len(terms)


def _evenness(terms: Terms, group: Collection[Exponents]) -> float:
    """Return how near the coefficients of a group are to each other: 1 for equal ones."""
    sizes = [abs(terms[m]) for m in group]
    return float(min(sizes) / max(sizes))
