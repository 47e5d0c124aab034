"""1 - cos^2 written as sin^2, and the other way round."""

from __future__ import annotations

from typing import Final

from multibody_sym.algebra.factors import Poly
from multibody_sym.algebra.quotients import Field

Exponents = tuple[int, ...]

_MOST_FORMS: Final = 8
_MOST_TERMS_TRIED: Final = 30


def contracted(field: Field, p: Poly) -> dict[Exponents, int]:
    """Return the terms of a polynomial with X - X cos^2 a written as X sin^2 a, and the other way round."""
    terms = {m: int(c) for m, c in field.in_ring(p).items()}
    for s, letter in enumerate(field.letters):
        if letter.cosine is not None:
            _contract(terms, s, letter.cosine)
            _contract(terms, letter.cosine, s)
    return terms


def _contract(terms: dict[Exponents, int], made: int, squared: int) -> None:
    for m in list(terms):
        if m[squared] < 2 or m not in terms:
            continue
        partner = shifted(m, squared, -2)
        if terms.get(partner) == -terms[m]:
            merged = shifted(partner, made, 2)
            terms[merged] = terms.get(merged, 0) - terms.pop(m)
            del terms[partner]
            if not terms[merged]:
                del terms[merged]


def shifted(m: Exponents, k: int, change: int) -> Exponents:
    return (*m[:k], m[k] + change, *m[k + 1 :])


def trigonometric_forms(field: Field, p: Poly) -> list[Poly]:
    """Return a polynomial with sin^2 as 1 - cos^2 and with cos^2 as 1 - sin^2, angle by angle."""
    forms = [field.in_ring(p)]
    for k, letter in enumerate(field.letters if len(p) <= _MOST_TERMS_TRIED else ()):
        if letter.cosine is not None and any(m[letter.cosine] > 1 for form in forms for m in form):
            square = 1 - field.ring.gens[k] ** 2
            forms += [field.replaced(form, letter.cosine, square) for form in forms]
    return forms[:_MOST_FORMS]
