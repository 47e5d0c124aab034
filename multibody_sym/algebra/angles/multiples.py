"""Polynomials in sines and cosines of an angle written with the multiples of it that a model names: cos(3 a) again.

Sums and multiples of angles are written out when exact quotients are made: cos(3 a) becomes 4 cos(a)^3 - 3 cos(a). Only
multiples that were met are written, so that sin(a) cos(a) stays as it is where nobody speaks of 2 a.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import comb

from multibody_sym.algebra.factors import Poly
from multibody_sym.algebra.quotients import Field
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node, multiply, number

Exponents = tuple[int, ...]
Waves = dict[tuple[Exponents, str, int], Fraction]
"""Coefficients of what stands beside the angle's letters, times `cos` or `sin` of so many times the angle."""


def angles_with_multiples(field: Field) -> Iterator[tuple[int, int]]:
    """Yield the places of (sine, cosine) of angles of which multiples were met."""
    if all(max(met) == 1 for met in field.multiples.values()):
        return
    for s, letter in enumerate(list(field.letters)):
        if letter.cosine is not None and max(_met(field, s)) > 1:
            yield s, letter.cosine


def is_of_angle(field: Field, p: Poly, s: int, c: int) -> bool:
    """Return whether a polynomial has no other letters than the sine and the cosine of an angle, and one of them."""
    used = {k for m in field.in_ring(p) for k, e in enumerate(m) if e}
    return bool(used) and used <= {s, c}


def single_wave(field: Field, p: Poly, s: int, c: int) -> tuple[Node, Fraction] | None:
    """Return (cos or sin of a multiple of an angle, coefficient) if a polynomial is nothing else, None if it is."""
    found = waves(field, p, s, c) or {}
    ((_, kind, n), x), *others = found.items() or [(((), "", 0), Fraction(0))]
    return None if others or n < 2 else (wave(field, s, kind, n), x)


def waves(field: Field, p: Poly, s: int, c: int) -> Waves | None:
    """Return a polynomial as a sum over multiples of the angle with letters s and c; None if some were never named."""
    found: Waves = {}
    for m, coefficient in p.items():
        rest = tuple(0 if k in (s, c) else e for k, e in enumerate(m))
        for (kind, n), x in _of_powers(m[s], m[c]).items():
            key = rest, kind, n
            found[key] = found.get(key, Fraction(0)) + x * Fraction(int(coefficient))
    found = {key: x for key, x in found.items() if x}
    return found if all(n in _met(field, s) for _, _, n in found) else None


def wave(field: Field, s: int, kind: str, n: int) -> Node:
    """Return cos or sin of n times the angle of the letter s; 1 for n = 0."""
    return BUILD[kind](multiply(number(n), _angle(field, s)))


def _angle(field: Field, s: int) -> Node:
    node = field.letters[s].node
    assert node is not None
    return node.args[0]


def _met(field: Field, s: int) -> set[int]:
    """Return the multiples of an angle that were met, and those that need no other sines."""
    return {0, 1, *field.multiples.get(_angle(field, s), ())}


def _of_powers(i: int, j: int) -> dict[tuple[str, int], Fraction]:
    """Return sin^i cos^j by multiples: with z = exp(i a), sin = (z - 1/z)/(2 i) and cos = (z + 1/z)/2."""
    of_z: dict[int, int] = {}
    for k in range(i + 1):
        for h in range(j + 1):
            n = i - 2 * k + j - 2 * h
            of_z[n] = of_z.get(n, 0) + (-1) ** k * comb(i, k) * comb(j, h)
    kind, sign = ("sin" if i % 2 else "cos"), (-1) ** (i // 2)
    found: dict[tuple[str, int], Fraction] = {}
    for n, x in of_z.items():
        turned = -1 if kind == "sin" and n < 0 else 1
        key = kind, abs(n)
        found[key] = found.get(key, Fraction(0)) + Fraction(sign * turned * x, 2 ** (i + j))
    return {key: x for key, x in found.items() if x}
