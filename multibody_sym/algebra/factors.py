"""Polynomials in irreducible factors.

What is of the first degree in some letter, p = A x + B, is gcd(A, B) times a factor that is irreducible. Most
polynomials of mechanics are such, and one greatest common divisor takes far less time than a general factorisation.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Final

from sympy.polys.heuristicgcd import HeuristicGCDFailed
from sympy.polys.rings import PolyRing

_REMEMBERED: Final = 1024

Poly = Any
"""A polynomial of a sympy ring with integer coefficients: a map from tuples of exponents to coefficients."""


def factored(p: Poly) -> tuple[int, list[tuple[Poly, int]]]:
    """Return the integer content (with the sign) and the irreducible factors with their exponents."""
    content, rest = p.primitive()
    if rest.LC < 0:
        content, rest = -content, -rest
    shared, rest = _without_shared_letters(rest)
    exponents: dict[Poly, int] = {}
    for factor, exponent in (*_letters(p.ring, shared), *_irreducible(rest)):
        exponents[factor] = exponents.get(factor, 0) + exponent
    return int(content), list(exponents.items())


def _without_shared_letters(p: Poly) -> tuple[tuple[int, ...], Poly]:
    shared = tuple(map(min, zip(*p, strict=True)))
    if not any(shared):
        return shared, p
    divided = {tuple(e - s for e, s in zip(m, shared, strict=True)): c for m, c in p.items()}
    return shared, p.ring.from_dict(divided)


def _letters(ring: Any, exponents: tuple[int, ...]) -> Iterator[tuple[Poly, int]]:
    return ((ring.gens[k], exponent) for k, exponent in enumerate(exponents) if exponent)


def _irreducible(p: Poly) -> Iterator[tuple[Poly, int]]:
    """Yield the factors of a primitive polynomial that no single letter divides."""
    while not p.is_ground:
        degrees = [max(exponents) for exponents in zip(*p, strict=True)]
        if 1 not in degrees:
            yield from _in_general(p)
            return
        k = degrees.index(1)
        linear = p.ring.from_dict({(*m[:k], 0, *m[k + 1 :]): c for m, c in p.items() if m[k]})
        constant = p.ring.from_dict({m: c for m, c in p.items() if not m[k]})
        try:
            shared = linear.gcd(constant)
        except HeuristicGCDFailed:
            yield from _in_general(p)
            return
        yield _with_positive_lead(p.exquo(shared)), 1
        p = shared


def _in_general(p: Poly) -> Iterator[tuple[Poly, int]]:
    """Yield the factors found by sympy, in a ring of those letters only that occur."""
    used = [k for k, exponents in enumerate(zip(*p, strict=True)) if any(exponents)]
    terms = frozenset((tuple(m[k] for k in used), c) for m, c in p.items())
    for factor, exponent in _found_by_sympy(p.ring.domain, p.ring.order, len(used), terms):
        whole = {}
        for m, c in factor:
            exponents = [0] * p.ring.ngens
            for k, e in zip(used, m, strict=True):
                exponents[k] = e
            whole[tuple(exponents)] = c
        yield _with_positive_lead(p.ring.from_dict(whole)), exponent


@lru_cache(maxsize=_REMEMBERED)
def _found_by_sympy(domain: Any, order: Any, letters: int, terms: frozenset[Any]) -> tuple[tuple[Any, int], ...]:
    """Return the factors of a polynomial by their terms: forms of one formula ask for the same ones again and again."""
    ring = PolyRing([f"g{k}" for k in range(letters)], domain, order)
    factors = ring.from_dict(dict(terms)).factor_list()[1]
    return tuple((tuple(factor.items()), exponent) for factor, exponent in factors)


def _with_positive_lead(p: Poly) -> Poly:
    return p if p.LC > 0 else -p
