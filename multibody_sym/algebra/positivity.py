"""Signs that follow from those of parameters: squares and products of these, sines and cosines between -1 and 1."""

from __future__ import annotations

from collections.abc import Collection
from math import prod

from multibody_sym.algebra.angles.squares import trigonometric_forms
from multibody_sym.algebra.factors import Poly
from multibody_sym.algebra.quotients import Field, Quotient

Exponents = tuple[int, ...]


def least_sign(field: Field, p: Poly, assumed: Collection[int] | None = None) -> int | None:
    """Return 1 where a polynomial is positive whatever its letters are, 0 where it is never negative, None else.

    Parameters keep the sign that they are declared to have, and those in the places `assumed` (None: all that do not
    turn) the one that they have at the sample, if they are not zero there.
    """
    found = [_of_form(field, form, assumed) for form in trigonometric_forms(field, p)]
    return max((sign for sign in found if sign is not None), default=None)


def undeclared(field: Field, p: Poly) -> set[int]:
    """Return the places of a polynomial's parameters that have a sign at the sample which no declaration gives them."""
    used = {k for m in p for k, e in enumerate(m) if e % 2}
    return {k for k in used if not field.letters[k].positive and _letter_sign(field, k, None)}


def _of_form(field: Field, p: Poly, assumed: Collection[int] | None) -> int | None:
    """Return the same by bounds: the terms with the same positive factors are at least what |sin|, |cos| <= 1 leave."""
    least: dict[Exponents, int] = {}
    for m, c in p.items():
        outside, inside = _parts(field, m)
        sign = prod(_letter_sign(field, k, assumed) for k, e in enumerate(outside) if e % 2)
        if sign == 0:
            return None
        certain = c * sign > 0 and not any(e % 2 for e in inside)
        gain = int(c) * sign if not any(inside) else 0 if certain else -abs(int(c))
        least[outside] = least.get(outside, 0) + gain
    if any(bound < 0 for bound in least.values()):
        return None
    return int(any(bound > 0 and _never_zero(field, outside) for outside, bound in least.items()))


def _parts(field: Field, m: Exponents) -> tuple[Exponents, Exponents]:
    """Return the exponents of a term's letters without, and with those of sines and cosines alone."""
    cosines = {letter.cosine for letter in field.letters if letter.cosine is not None}
    turning = [letter.cosine is not None or k in cosines for k, letter in enumerate(field.letters)]
    outside = tuple(0 if turns else e for e, turns in zip(m, turning, strict=False))
    return outside, tuple(e if turns else 0 for e, turns in zip(m, turning, strict=False))


def _letter_sign(field: Field, place: int, assumed: Collection[int] | None) -> int:
    """Return the sign that a letter keeps, 0 if it may change."""
    letter = field.letters[place]
    if letter.positive:
        return 1
    kept = letter.node is not None and letter.node.op == "symbol" and not letter.turns
    known = kept and (assumed is None or place in assumed)
    return int(letter.sample > 0) - int(letter.sample < 0) if known else 0


def _never_zero(field: Field, m: Exponents) -> bool:
    return all(_letter_sign(field, k, None) for k, e in enumerate(m) if e)


def surely_positive(a: Quotient) -> bool:
    """Return whether all terms are positive because their letters are."""
    letters = a.field.letters
    return all(
        c > 0 and all(letters[k].positive or e % 2 == 0 for k, e in enumerate(m))
        for p in (a.above, a.below)
        for m, c in p.items()
    )
