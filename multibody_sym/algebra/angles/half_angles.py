"""Fractions in the sine and cosine of an angle in lowest terms, sin^2 + cos^2 = 1 seen.

Sines and cosines of an angle are forms of even degree in a = cos(angle/2) and b = sin(angle/2). Such forms have their
irreducible factors, which polynomials modulo sin^2 + cos^2 - 1 have not: sin^2 - 2 mu sin cos + mu^2 cos^2 is a square
there, and nothing of the kind when sin^2 is written as 1 - cos^2. With a = 1 they are polynomials in t = tan(angle/2).
"""

from __future__ import annotations

from functools import lru_cache
from math import comb
from typing import Final

from multibody_sym.algebra.factors import Poly

Exponents = tuple[int, ...]
Row = tuple[int, ...]
"""Coefficients of 1, t, t^2, ..."""

_PRIME: Final = 2**31 - 1


def turning_degree(p: Poly, s: int, c: int) -> int:
    """Return the highest degree of a term in the sine and cosine of an angle."""
    return max((m[s] + m[c] for m in p), default=0)


# --- there and back ------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1000)
def _row(i: int, j: int, n: int) -> Row:
    """Return cos^i sin^j (1 + t^2)^n: the coefficients of (1 - t^2)^i (2 t)^j (1 + t^2)^(n - i - j)."""
    k = n - i - j
    row = [0] * (2 * n + 1)
    for x in range(i + 1):
        for y in range(k + 1):
            row[2 * (x + y) + j] += (-1) ** x * comb(i, x) * comb(k, y) * 2**j
    return tuple(row)


@lru_cache(maxsize=1000)
def _turned(k: int, n: int) -> Row:
    """Return 2^n a^(2n - k) b^k without its sine: the coefficients of (1 + cos)^i (1 - cos)^j in cos."""
    i, j = n - (k + 1) // 2, k // 2
    row = [0] * (i + j + 1)
    for x in range(i + 1):
        for y in range(j + 1):
            row[x + y] += (-1) ** y * comb(i, x) * comb(j, y)
    return tuple(row)


def with_half(p: Poly, s: int, c: int, n: int) -> Poly:
    """Return p (1 + t^2)^n over one angle, written in t in the place of the sine."""
    found: dict[Exponents, int] = {}
    for m, coefficient in p.items():
        rest = list(m)
        rest[c] = 0
        for k, x in enumerate(_row(m[c], m[s], n)):
            if x:
                rest[s] = k
                key = tuple(rest)
                found[key] = found.get(key, 0) + coefficient * x
    return p.ring.from_dict({m: x for m, x in found.items() if x})


def with_whole(p: Poly, s: int, c: int, n: int) -> Poly:
    """Return 2^n p / (1 + t^2)^n, t in the place of the sine, written in the sine and cosine: the other way round."""
    found: dict[Exponents, int] = {}
    for m, coefficient in p.items():
        rest = list(m)
        rest[s] = m[s] % 2
        for k, x in enumerate(_turned(m[s], n)):
            if x:
                rest[c] = k
                key = tuple(rest)
                found[key] = found.get(key, 0) + coefficient * x
    return p.ring.from_dict({m: x for m, x in found.items() if x})


# --- what is shared ------------------------------------------------------------------------------------------------


def shared_degree(above: Poly, below: Poly, s: int, c: int, n: int) -> int:
    """Return the degree of what two polynomials (1 + t^2)^n share in a and b, for some values of all other letters.

    For nearly all of these it is that of their greatest common divisor, else it is larger.
    """
    first, second = (_in_numbers(p, s, c, n) for p in (above, below))
    missing = 2 * n + 1 - max(len(first), len(second))
    while second:
        first, second = second, _remainder(first, second)
    return len(first) - 1 + missing


def _in_numbers(p: Poly, s: int, c: int, n: int) -> list[int]:
    """Return the coefficients of p (1 + t^2)^n modulo a prime, the highest first, with numbers for other letters."""
    total = [0] * (2 * n + 1)
    for m, coefficient in p.items():
        factor = int(coefficient) % _PRIME
        for k, e in enumerate(m):
            if e and k not in (s, c):
                factor = factor * pow(48_271 * k + 16_807, e, _PRIME) % _PRIME
        for k, x in enumerate(_row(m[c], m[s], n)):
            total[k] += factor * x
    return _stripped([x % _PRIME for x in reversed(total)])


def _stripped(row: list[int]) -> list[int]:
    first = next((k for k, x in enumerate(row) if x), len(row))
    return row[first:]


def _remainder(first: list[int], second: list[int]) -> list[int]:
    inverse = pow(second[0], -1, _PRIME)
    while len(first) >= len(second):
        factor = first[0] * inverse % _PRIME
        rest = [(x - factor * y) % _PRIME for x, y in zip(first[1:], second[1:], strict=False)]
        first = _stripped([*rest, *first[len(second) :]])
    return first
