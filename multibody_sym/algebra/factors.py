"""Polynomials in irreducible factors, and what two of them share.

What is of the first degree in some letter, p = A x + B, is gcd(A, B) times a factor that is irreducible. Most
polynomials of mechanics are such, and one greatest common divisor takes far less time than a general factorisation.

Most pairs of polynomials share nothing, which is seen in the integers modulo a prime. With numbers in place of all
letters but one, x, the degree in x of a common divisor of f and g is no larger than that of the divisor of their
images, where the leading coefficient of f or g in x has an image that is not 0. Where that degree is 0 for each letter
that both have, f and g share at most a number and powers of letters.

Source: Geddes, Czapor, Labahn, Algorithms for Computer Algebra (1992), 7.4.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from math import gcd
from typing import Any, Final

from sympy.polys.heuristicgcd import HeuristicGCDFailed
from sympy.polys.rings import PolyRing

from multibody_sym.records import dataclass

_REMEMBERED: Final = 1024
_MOST_BITS: Final = 512
"""Coefficients with more of them are products of measured numbers: primes beyond them take seconds to find."""
_PRIME: Final = 2**31 - 1
_MULTIPLIER: Final = 1_103_515_245
"""Spreads the numbers in place of letters over all residues; an unlucky one costs time and nothing else."""

Poly = Any
"""A polynomial of a sympy ring with integer coefficients: a map from tuples of exponents to coefficients."""
_Terms = frozenset[tuple[tuple[int, ...], Any]]


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
            long = any(int(c).bit_length() > _MOST_BITS for c in p.values())
            yield from [(p, 1)] if long else _in_general(p)
            return
        k = degrees.index(1)
        linear = p.ring.from_dict({(*m[:k], 0, *m[k + 1 :]): c for m, c in p.items() if m[k]})
        constant = p.ring.from_dict({m: c for m, c in p.items() if not m[k]})
        try:
            shared = cofactors(linear, constant)[0]
        except HeuristicGCDFailed:
            yield from _in_general(p)
            return
        yield _with_positive_lead(p.exquo(shared)), 1
        p = shared


def _in_general(p: Poly) -> Iterator[tuple[Poly, int]]:
    """Yield the factors found by sympy, in a ring of those letters only that occur."""
    used = _used(p)
    for factor, exponent in _found_by_sympy(p.ring.domain, p.ring.order, len(used), _terms(p, used)):
        yield _with_positive_lead(_among_all(factor, used, p.ring)), exponent


@lru_cache(maxsize=_REMEMBERED)
def _found_by_sympy(domain: Any, order: Any, letters: int, terms: _Terms) -> tuple[tuple[Poly, int], ...]:
    """Return the factors of a polynomial by its terms: forms of one formula ask for the same ones again and again."""
    return tuple(polynomial_ring(domain, order, letters).from_dict(dict(terms)).factor_list()[1])


@lru_cache(maxsize=_REMEMBERED)
def polynomial_ring(domain: Any, order: Any, letters: int) -> Any:
    """Return the ring of polynomials in so many letters; to make one takes longer than most products in it."""
    return PolyRing([f"g{k}" for k in range(letters)], domain, order)


def _used(*several: Poly) -> list[int]:
    """Return the letters that occur."""
    return [k for k, exponents in enumerate(zip(*(m for p in several for m in p), strict=True)) if any(exponents)]


def _terms(p: Poly, used: Sequence[int]) -> _Terms:
    """Return the terms of a polynomial in these letters only."""
    return frozenset((tuple([m[k] for k in used]), c) for m, c in p.items())


def _among_all(p: Poly, used: Sequence[int], ring: Any) -> Poly:
    """Return a polynomial in letters that are `used` as one in all letters of a ring."""
    whole = {}
    for m, c in p.items():
        exponents = [0] * ring.ngens
        for k, e in zip(used, m, strict=True):
            exponents[k] = e
        whole[tuple(exponents)] = c
    return ring.from_dict(whole)


def _with_positive_lead(p: Poly) -> Poly:
    return p if p.LC > 0 else -p


# --- what two polynomials share -------------------------------------------------------------------------------------


def cofactors(f: Poly, g: Poly) -> tuple[Poly, Poly, Poly]:
    """Return the greatest common divisor h and f/h, g/h; raises HeuristicGCDFailed where it is not found."""
    if len(f) < 2 or len(g) < 2:  # as quick as what follows
        found: tuple[Poly, Poly, Poly] = f.cofactors(g)
        return found
    shared = _shared_powers(f, g)
    if shared is None:
        used, ring = _used(f, g), f.ring
        parts = _shared_by_sympy(ring.domain, ring.order, len(used), _terms(f, used), _terms(g, used))
        h, first, second = (_among_all(p, used, ring) for p in parts)
        return h, first, second
    number = gcd(*map(int, f.values()), *map(int, g.values()))
    return f.ring.from_dict({shared: f.ring.domain(number)}), _divided(f, shared, number), _divided(g, shared, number)


@lru_cache(maxsize=_REMEMBERED)
def _shared_by_sympy(domain: Any, order: Any, letters: int, *both: _Terms) -> tuple[Poly, Poly, Poly]:
    """Return what `cofactors` does of two polynomials by their terms."""
    f, g = (polynomial_ring(domain, order, letters).from_dict(dict(terms)) for terms in both)
    found: tuple[Poly, Poly, Poly] = f.cofactors(g)
    return found


def _shared_powers(f: Poly, g: Poly) -> tuple[int, ...] | None:
    """Return the powers of letters that two polynomials share, None where it is not seen that this is all."""
    first, second = _Image.of(f), _Image.of(g)
    if not all(first.is_prime_to(second, k) for k in range(f.ring.ngens)):
        return None
    return tuple(map(min, first.least, second.least))


def _divided(p: Poly, shared: Sequence[int], number: int) -> Poly:
    """Return a polynomial over a number and powers of letters, its terms in falling order."""
    if any(shared):
        terms = ((tuple(e - s for e, s in zip(m, shared, strict=True)), c) for m, c in p.items())
    else:
        terms = p.items()
    return p.ring.from_dict({m: c // number for m, c in sorted(terms, reverse=True)})


@dataclass(frozen=True)
class _Image:
    """A polynomial at numbers: the residue of each term, and the `least` and `most` of each letter in its terms."""

    terms: Sequence[tuple[Sequence[int], int]]
    least: tuple[int, ...]
    most: tuple[int, ...]

    @classmethod
    def of(cls, p: Poly) -> _Image:
        terms = []
        for m, c in p.items():
            value = int(c)
            for k, exponent in enumerate(m):
                if exponent:
                    value = value * pow(_stands_for(k), exponent, _PRIME) % _PRIME
            terms.append((m, value))
        columns = list(zip(*p, strict=True))
        return cls(terms, tuple(map(min, columns)), tuple(map(max, columns)))

    def is_prime_to(self, other: _Image, k: int) -> bool:
        """Return whether it is seen that no common divisor but powers of it has letter k."""
        if self.least[k] == self.most[k] or other.least[k] == other.most[k]:
            return True
        a, b = self._in_letter(k), other._in_letter(k)
        return bool(a[-1] or b[-1]) and _are_prime(a, b)

    def _in_letter(self, k: int) -> list[int]:
        """Return the coefficients in letter k, without the powers of it that divide all, the lowest first."""
        found, low = [0] * (self.most[k] - self.least[k] + 1), self.least[k]
        back = pow(_stands_for(k), -1, _PRIME)
        for m, value in self.terms:
            found[m[k] - low] += value * pow(back, m[k], _PRIME)
        return [x % _PRIME for x in found]


def _stands_for(k: int) -> int:
    return (k + 1) * _MULTIPLIER % _PRIME


def _are_prime(a: list[int], b: list[int]) -> bool:
    """Return whether polynomials in one letter modulo the prime share no root, by Euclid's algorithm."""
    while True:
        a, b = (_without_leading_zeros(x) for x in (a, b))
        if not a or not b:
            return len(a) + len(b) == 1
        if len(a) < len(b):
            a, b = b, a
        factor, shift = a[-1] * pow(b[-1], -1, _PRIME), len(a) - len(b)
        a = [(x - factor * b[k - shift]) % _PRIME if k >= shift else x for k, x in enumerate(a)]


def _without_leading_zeros(p: list[int]) -> list[int]:
    while p and not p[-1]:
        p = p[:-1]
    return p
