"""Exponentials: multiples of an exponent that is known are powers, and products are written with one exponent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import reduce
from operator import add
from typing import Final

from multibody_sym.algebra.quotients import Field, Quotient
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node

_HIGHEST_MULTIPLE: Final = 12


def known_power(exponent: Quotient) -> Quotient | None:
    """Return exp(exponent) as a power of an exponential that is a letter, None where there is no such."""
    field = exponent.field
    for node, known in field.arguments.items():
        place = field.position(node)
        if node.op != "exp" or place is None:
            continue
        ratio = exponent / known
        if ratio.above.is_ground and ratio.below.is_ground:
            times = Fraction(int(ratio.above.LC), int(ratio.below.LC))
            if times.denominator == 1 and 0 < abs(times) <= _HIGHEST_MULTIPLE:
                return field.letter(node, field.letters[place]).power(int(times))
    return None


def with_one_exponent(
    field: Field, powers: Sequence[tuple[Node, int]], written: Callable[[Quotient], Node]
) -> list[tuple[Node, int]]:
    """Return the factors of a product with exp(a)^2 exp(b) written as exp(2 a + b)."""
    found = [(node, e) for node, e in powers if node.op == "exp" and node in field.arguments]
    if sum(abs(e) for _, e in found) < 2:
        return list(powers)
    work = field.work
    exponent = written(reduce(add, (field.arguments[node] * e for node, e in found)))
    field.work = work
    return [*(pair for pair in powers if pair not in found), (BUILD["exp"](exponent), 1)]
