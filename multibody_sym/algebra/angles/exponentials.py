"""Exponentials: of logarithms what these are of, of multiples of known exponents powers; products have one exponent."""

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
    """Return exp(exponent) as 1 or as a power of an exponential that is a letter, None where there is no such."""
    field = exponent.field
    if exponent.is_zero:
        return field.constant(1)
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


def of_logarithms(exponent: Quotient) -> tuple[Quotient, Quotient]:
    """Return exp of whole multiples of logarithms in an exponent, and the exponent that is left, itself without them.

    exp(2 log x + a) is x^2 exp(a).
    """
    field, power, rest = exponent.field, exponent.field.constant(1), exponent
    if not exponent.below.is_ground:
        return power, rest
    for m, c in exponent.above.items():
        letter = field.letters[m.index(1)] if sum(m) == 1 else None
        times = Fraction(int(c), int(exponent.below.LC))
        inside = field.logarithms.get(letter.node) if letter is not None and letter.node is not None else None
        if inside is not None and times.denominator == 1 and abs(times) <= _HIGHEST_MULTIPLE:
            power = power * inside.power(int(times))
            rest = rest - field.whole(field.ring.gens[m.index(1)]) * int(times)
    return power, rest


def of_hyperbolic(op: str, a: Quotient) -> Quotient | None:
    """Return sinh, cosh or tanh of logarithms without functions, (x - 1/x)/2 for sinh(log(x)); None for all else."""
    if op not in ("sinh", "cosh", "tanh") or a.is_zero:
        return None
    x, rest = of_logarithms(a)
    if not rest.is_zero:
        return None
    odd, even = (x - x.power(-1)) / 2, (x + x.power(-1)) / 2
    return odd / even if op == "tanh" else odd if op == "sinh" else even


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


def square_of_root(a: Quotient) -> Quotient | None:
    """Return the square of what is nothing but a root of something without roots, None for all else."""
    field = a.field
    roots = [k for k, letter in enumerate(field.letters) if letter.node is None]
    if len(a.above) != 1 or not _names(a, roots):
        return None
    square = a * a
    return None if _names(square, roots) else square


def _names(a: Quotient, places: Sequence[int]) -> bool:
    """Return whether letters at any of these places stand in a quotient."""
    terms = [m for p in (a.above, a.below) for m in a.field.in_ring(p)]
    return any(m[k] for m in terms for k in places)
