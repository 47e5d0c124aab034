"""Which numbers have more digits than anyone gave, and the decimals that are printed for them."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node, number
from multibody_sym.scalars.traversal import postorder

_MOST_GIVEN: Final = 8
_DIGITS_OF_A_DOUBLE: Final = 15
_TEN: Final = 10


def is_long(value: Fraction, digits: int = _MOST_GIVEN) -> bool:
    """Return whether a number has more digits than people give to the numbers of a model."""
    return any(len(str(abs(whole)).rstrip("0")) > digits for whole in (value.numerator, value.denominator))


def nearest_double(value: Fraction) -> Fraction:
    """Return a long number as the decimal that identifies its double, 0.2572... for 6098.../2370...; others stay."""
    exact = is_exact_decimal(value.denominator) and len(_digits(value)) <= _DIGITS_OF_A_DOUBLE
    return value if exact or not is_long(value) else Fraction(repr(float(value)))


def with_doubles(form: Node) -> Node:
    """Return a form with the doubles that its long numbers stand for: for people, no longer exact."""
    shown = dict[Node, Node]()
    for n in postorder([form]):
        if n.op == "number":
            shown[n] = number(nearest_double(Fraction(n.data)))
        else:
            shown[n] = BUILD[n.op](*n.own, *(shown[x] for x in n.args)) if n.args else n
    return shown[form]


def is_exact_decimal(denominator: int) -> bool:
    """Return whether quotients by a whole number are decimals that end."""
    for prime in (2, 5):
        while denominator % prime == 0:
            denominator //= prime
    return denominator == 1


def _digits(value: Fraction) -> str:
    """Return the digits of a decimal that ends."""
    places = value.denominator.bit_length()
    return str(abs(value.numerator) * _TEN**places // value.denominator).strip("0")
