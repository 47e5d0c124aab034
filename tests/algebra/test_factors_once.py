"""Factors of polynomials: what was factored is not factored again, and comes out the same."""

from __future__ import annotations

from typing import Any

import pytest
from sympy.polys.domains import ZZ
from sympy.polys.orderings import lex
from sympy.polys.rings import PolyElement, PolyRing

from multibody_sym.algebra.quotients import factors_of


def test_a_polynomial_is_factored_once_whatever_its_number_and_ring(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    plain = PolyElement.factor_list
    monkeypatch.setattr(PolyElement, "factor_list", lambda self: (asked.append(self), plain(self))[1])
    small, large = (PolyRing([f"g{k}" for k in range(count)], ZZ, lex) for count in (1, 3))
    x, z = small.gens[0], large.gens[2]
    content, factors = factors_of(6 * (x**2 + 7) * (x**2 - 7 * x + 41) ** 2)
    other, others = factors_of(-9 * (z**2 + 7) * (z**2 - 7 * z + 41) ** 2)
    assert (content, other) == (6, -9)
    assert dict(factors) == {x**2 + 7: 1, x**2 - 7 * x + 41: 2}
    assert dict(others) == {z**2 + 7: 1, z**2 - 7 * z + 41: 2}
    assert len(asked) == 1
