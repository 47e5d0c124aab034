"""Which sums of closed forms come from decimals of the model, and by what they are divided to show these again.

Polynomials have whole coefficients: a - 0.001 is met as 1000 a - 1.
"""

from __future__ import annotations

from fractions import Fraction
from math import gcd, isqrt
from typing import Final

from multibody_sym.algebra.decimals import is_long
from multibody_sym.algebra.factors import Poly
from multibody_sym.algebra.quotients import Field

_FIVE: Final = 5
_TEN: Final = 10
_LARGE: Final = 100
_LONGEST_DECIMAL: Final = 10**8
_MOST_DIGITS: Final = 6


def looks_decimal(field: Field, p: Poly, least: int = _TEN) -> bool:
    """Return whether the whole numbers of a sum may come from decimals: large ones, or fives beside a bare number.

    Large are those of 100 and more, and multiples of five from `least` on.
    """
    others = [int(c) for m, c in p.items() if sum(m[1:])]
    beside_number = 0 < len(others) < len(p) and gcd(*others) % _FIVE == 0 and any(_names_symbol(field, m) for m in p)
    large = (abs(c) >= _LARGE or (abs(c) >= least and c % _FIVE == 0) for c in p.values())
    return len(p) > 1 and (beside_number or any(large))


def _names_symbol(field: Field, m: tuple[int, ...]) -> bool:
    return any(e and (node := field.letters[k].node) is not None and node.op == "symbol" for k, e in enumerate(m))


def names_pi_alone(p: Poly) -> bool:
    """Return whether a sum, which is an angle then, has a multiple of pi among its terms."""
    return any(m[0] == 1 == sum(m) for m in p)


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
    """Return the root of a fraction, 0 where it is none."""
    above, below = isqrt(value.numerator), isqrt(value.denominator)
    return Fraction(above, below) if above**2 == value.numerator and below**2 == value.denominator else Fraction(0)
