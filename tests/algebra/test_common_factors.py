"""Greatest common divisors, against what products were made of, and against sympy's."""

from __future__ import annotations

import random

import pytest
from sympy.polys.domains import ZZ
from sympy.polys.orderings import lex
from sympy.polys.rings import PolyElement, PolyRing

from multibody_sym.algebra.quotients import cofactors

RING = PolyRing(["a", "b", "c", "d", "e"], ZZ, lex)


def drawn(numbers: random.Random, terms: int) -> PolyElement:
    """Return a polynomial in a few letters, with numbers and powers of letters that may divide all terms."""
    p = RING(0)
    while len(p) < terms:
        p += RING.from_dict({tuple(numbers.choice((0, 0, 0, 1, 2)) for _ in RING.gens): numbers.randint(-9, 9)})
    outside = numbers.choice(RING.gens) ** numbers.randint(0, 2)
    return p * outside * numbers.choice((1, 1, 2, 6))


@pytest.mark.parametrize("seed", range(4))
def test_they_are_those_that_sympy_finds(seed: int) -> None:
    numbers = random.Random(seed)
    for _ in range(15):
        f, g, shared = drawn(numbers, 3), drawn(numbers, 2), drawn(numbers, numbers.randint(1, 2))
        for one, other in ((f, g), (f * shared, g * shared)):
            h, first, second = cofactors(one, other)
            theirs = one.gcd(other)
            assert h in (theirs, -theirs)
            assert (h * first, h * second) == (one, other)
            assert [list(p) for p in (first, second)] == [sorted(p, reverse=True) for p in (first, second)]


def test_what_shares_nothing_is_seen_without_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    a, b, c, d, e = RING.gens
    pairs = [(a * b + c, a * b - c), (6 * a * d * e + 4 * d * e, 2 * d * b + 8 * d), (a**2 - b**2, a**2 + b**2)]
    monkeypatch.setattr(PolyElement, "cofactors", None)
    assert [cofactors(f, g)[0] for f, g in pairs] == [1, 2 * d, 1]
    with pytest.raises(TypeError):  # here sympy is asked
        cofactors(a**2 - b**2, a * c - b * c)
