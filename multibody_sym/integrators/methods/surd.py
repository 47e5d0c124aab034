"""Exact numbers a + b sqrt(d) of one quadratic field: what the nodes of Gauss and Radau methods are made of."""

from __future__ import annotations

from fractions import Fraction
from math import isqrt
from typing import Final

from multibody_sym.records import dataclass

_SCALE: Final = 10**40


@dataclass(frozen=True)
class Surd:
    """The number a + b sqrt(d), for a whole d that is no square; numbers of different d do not mix."""

    a: Fraction
    b: Fraction
    d: int

    def __add__(self, other: Surd | Fraction | int) -> Surd:
        y = self._alike(other)
        return Surd(self.a + y.a, self.b + y.b, self.d)

    def __neg__(self) -> Surd:
        return Surd(-self.a, -self.b, self.d)

    def __sub__(self, other: Surd | Fraction | int) -> Surd:
        return self + -self._alike(other)

    def __mul__(self, other: Surd | Fraction | int) -> Surd:
        y = self._alike(other)
        return Surd(self.a * y.a + self.d * self.b * y.b, self.a * y.b + self.b * y.a, self.d)

    def __truediv__(self, other: Surd | Fraction | int) -> Surd:
        y = self._alike(other)
        norm = y.a**2 - self.d * y.b**2
        return self * Surd(y.a / norm, -y.b / norm, self.d)

    def __pow__(self, n: int) -> Surd:
        result = self._alike(1)
        for _ in range(n):
            result = result * self
        return result

    def __float__(self) -> float:
        root = Fraction(isqrt(self.d * _SCALE**2), _SCALE)
        return float(self.a + self.b * root)

    def _alike(self, other: Surd | Fraction | int) -> Surd:
        if isinstance(other, Surd):
            assert other.d == self.d
            return other
        return Surd(Fraction(other), Fraction(0), self.d)


def surd(a: str, b: str = "0", d: int = 2) -> Surd:
    """Return a + b sqrt(d) from fractions in words, such as `1/2`; d does not matter where b is zero."""
    return Surd(Fraction(a), Fraction(b), d)
