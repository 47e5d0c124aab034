"""The sign of a quotient at the sample, decided exactly: by 50 digits, and where these are all zero by proof.

What is left after 40 zeros is written in the exact values of its letters. A sum of products of integers, roots and
sines of rational multiples of pi is an algebraic integer of known degree D, and so are its conjugates, of which none
exceeds a number U that is read off. Their product is a whole number, hence a value that is not zero is at least
1 / U^(D - 1): so many digits decide. (The same that a minimal polynomial decides, for degrees far beyond.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import lcm, log10
from typing import Any, Final

from mpmath import MPContext

from multibody_sym.algebra.factors import Poly
from multibody_sym.algebra.quotient_functions import exact, sqrt
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.scalars.node import Node

_UNDECIDED: Final = PRECISE.mpf(10) ** -40
_WORK: Final = 10_000
_MOST_DIGITS: Final = 20_000
_SPARE_DIGITS: Final = 20


def decided_sign(a: Quotient, values: Mapping[Node, Node]) -> int | None:
    """Return the sign of a quotient where its symbols have exact `values`; None where it is not decided."""
    if a.is_zero:
        return 0
    if abs(a.sample) > _UNDECIDED * _size(a):
        return 1 if a.sample > 0 else -1
    if not a.symbols <= values.keys():
        return None
    try:
        there = _at(a, values)
    except NoClosedFormError:
        return None
    return 0 if there.is_zero or _is_zero(there.field, there.above) else None


def _size(a: Quotient) -> Any:
    """Return the sum of the sizes of a quotient's terms at the sample."""
    field = a.field
    terms = (abs(field.value(field.ring.from_dict({m: c}))) for m, c in field.in_ring(a.above).items())
    return sum(terms, PRECISE.mpf(0)) / abs(field.value(a.below))


def _at(a: Quotient, values: Mapping[Node, Node]) -> Quotient:
    """Return a quotient with the values of its symbols put in, in a field of numbers."""
    there = Field(_WORK)
    known = dict(zip(values, exact(there, values.values(), {}), strict=True))
    letters: dict[int, Quotient] = {}
    for k in sorted(_used(a.field, a.above)):
        node = a.field.letters[k].node
        if node is None:
            letters[k] = sqrt(_value(there, a.field.letters[k].square, letters))
        else:
            (letters[k],) = exact(there, [node], known)
    return _value(there, a.above, letters)


def _value(field: Field, p: Poly, letters: Mapping[int, Quotient]) -> Quotient:
    total = field.constant(0)
    for m, c in p.items():
        term = field.constant(int(c))
        for k, e in enumerate(m):
            term = term * letters[k].power(e) if e else term
        total = total + term
    return total


# --- algebraic integers --------------------------------------------------------------------------------------------


def _is_zero(field: Field, p: Poly) -> bool:
    """Return whether a polynomial of roots and sines is zero by its bound; False also where this is not decided."""
    degree = _degree([field.letters[k] for k in _used(field, p)])
    if degree is None:
        return False
    halves = max((sum(m) for m in p), default=0)
    digits = degree * (log10(1 + _largest(field, p)) + halves * log10(2)) + _SPARE_DIGITS
    if digits > _MOST_DIGITS:
        return False
    context = MPContext()
    context.dps = int(digits) + _SPARE_DIGITS
    return bool(abs(_precise(field, p, context)) < context.mpf(10) ** -int(digits))


def _degree(letters: Sequence[Letter]) -> int | None:
    """Return a bound of the degree of all numbers made of letters, None where one is not known to be algebraic.

    Each root doubles it; sines of multiples of pi/n all lie among the numbers made of one root of unity, the (4n)-th.
    """
    turns = [_turns(letter.node) for letter in letters if letter.node is not None]
    known = [x for x in turns if x is not None]
    if len(known) < len(turns):
        return None
    return int(2 ** (len(letters) - len(turns)) * 4 * lcm(*(x.denominator for x in known)))


def _used(field: Field, p: Poly) -> set[int]:
    """Return the places of the letters of a polynomial and of the radicands in it."""
    waiting, seen = [p], set[int]()
    while waiting:
        for m in waiting.pop():
            new = {k for k, e in enumerate(m) if e} - seen
            seen |= new
            waiting += [field.letters[k].square for k in new if field.letters[k].node is None]
    return seen


def _turns(node: Node) -> Fraction | None:
    """Return x of sin(x pi) or cos(x pi), a rational number."""
    if node.op not in ("sin", "cos"):
        return None
    angle = exact(Field(_WORK), node.args, {})[0]
    is_multiple = angle.below.is_ground and all(m[0] == 1 == sum(m) for m in angle.above)
    return Fraction(int(angle.above.LC), int(angle.below.LC)) if is_multiple else None


def _largest(field: Field, p: Poly) -> float:
    """Return a bound of all conjugates: each root at most the root of its radicand's bound, each sine at most 1."""
    total = 0.0
    for m, c in p.items():
        term = float(abs(int(c)))
        for k, e in enumerate(m):
            if e and field.letters[k].node is None:
                term *= max(1.0, _largest(field, field.letters[k].square)) ** (e / 2)
        total += term
    return total


def _precise(field: Field, p: Poly, context: Any) -> Any:
    """Return a polynomial's value in a context of many digits."""
    total = context.mpf(0)
    for m, c in p.items():
        term = context.mpf(int(c))
        for k, e in enumerate(m):
            if e:
                term *= _letter(field, field.letters[k], context) ** e
        total += term
    return total


def _letter(field: Field, letter: Letter, context: Any) -> Any:
    if letter.node is None:
        return context.sqrt(_precise(field, letter.square, context))
    turns = _turns(letter.node)
    assert turns is not None
    function = context.sinpi if letter.node.op == "sin" else context.cospi
    return function(context.mpf(turns.numerator) / turns.denominator)
