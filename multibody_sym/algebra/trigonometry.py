"""Trigonometric forms: sums of angles, powers of exponentials, multiples of an angle, sin^2 and 1 - cos^2, tangents.

In: sums and products over the letters of a field, in which sums of angles and their multiples are written out. Out: the
same in fewer functions: cos(a - b) for cos(a) cos(b) + sin(a) sin(b).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import reduce
from itertools import permutations
from math import comb
from operator import add
from typing import Final

from sympy.polys.domains import ZZ
from sympy.polys.orderings import lex

from multibody_sym.algebra.quotients import Exponents, Field, Poly, Quotient, polynomial_ring
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node, multiply, number
from multibody_sym.text.printer import text

_PLACES = 6
"""Places behind the letters of a field, for sines and cosines of sums of angles that are no letters."""

_Angle = tuple[int, int, Quotient]
"""The places of an angle's sine and cosine, and the angle."""
_Pair = tuple[Exponents, Exponents, str, int, tuple[int, int]]
"""Two terms that make one, its function, the sign of the second angle, and the places of the angles."""


class AngleSums:
    """Puts angles together in sums over the letters that a field has now."""

    def __init__(self, field: Field, written: Callable[[Quotient], Node]) -> None:
        self._field = field
        self._written = written
        self._size = len(field.letters)
        self._angles = [
            (s, letter.cosine, field.arguments[letter.node.args[0]])
            for s, letter in enumerate(field.letters)
            if letter.cosine is not None and letter.node is not None and letter.node.args[0] in field.arguments
        ]
        self._known: dict[tuple[int, int, int], tuple[Node | None, int]] = {}
        self.nodes: list[Node] = []
        self.ring = polynomial_ring(ZZ, lex, self._size + _PLACES)

    def put_together(self, terms: Mapping[Exponents, Fraction]) -> dict[Exponents, Fraction] | None:
        """Return terms with fewer sines and cosines, in as many places as the ring has letters; None without any."""
        left = {(*m, *(0,) * _PLACES): c for m, c in terms.items()}
        used = [x for x in self._angles if sum(1 for m in terms if m[x[0]] or m[x[1]]) > 1]
        changed = False
        while (pair := next(self._pairs(left, used), None)) is not None:
            first, second, function, side, (i, j) = pair
            place, turned = self._place(function, used[i], used[j], side)
            if place is None:
                break
            changed = True
            factor = left.pop(first) * turned
            del left[second]
            joined = _exchange_factors(first, (used[i][0] if function == "sin" else used[i][1], used[j][1]), (place,))
            left[joined] = left.get(joined, Fraction(0)) + factor
            if not left[joined]:
                del left[joined]
            together = self._together(used[i], used[j], side)
            if together is not None and together[:2] not in [x[:2] for x in used]:
                used.append(together)
        return left if changed else None

    def _together(self, first: _Angle, second: _Angle, side: int) -> _Angle | None:
        """Return a sum or difference of angles as one that others may join, where its letters have places."""
        node, turned = self._known[first[0], second[0], side]
        sine, cosine = (BUILD[x](node) if node is not None else None for x in ("sin", "cos"))
        if sine not in self.nodes or cosine not in self.nodes:
            return None
        angle = (first[2] + second[2] * side) * turned
        return self._size + self.nodes.index(sine), self._size + self.nodes.index(cosine), angle

    def _pairs(self, terms: Mapping[Exponents, Fraction], used: list[_Angle]) -> Iterator[_Pair]:
        for (i, (s, c, _)), (j, (t, d, _)) in permutations(enumerate(used), 2):
            for m in terms:
                if m[c] and m[d] and i < j:
                    other = _exchange_factors(m, (c, d), (s, t))
                    if abs(terms.get(other, 0)) == abs(terms[m]):
                        yield m, other, "cos", -1 if terms[other] == terms[m] else 1, (i, j)
                if m[s] and m[d]:
                    other = _exchange_factors(m, (s, d), (c, t))
                    if abs(terms.get(other, 0)) == abs(terms[m]):
                        yield m, other, "sin", 1 if terms[other] == terms[m] else -1, (i, j)

    def _place(self, function: str, first: _Angle, second: _Angle, side: int) -> tuple[int | None, int]:
        """Return the place of the sine or cosine of a sum or difference of angles, and its sign there."""
        key = first[0], second[0], side
        if key not in self._known:
            self._known[key] = self._sum_of(first[2], second[2], side)
        node, turned = self._known[key]
        sign = turned if function == "sin" else 1
        if node is None:
            return None, sign
        known = self._field.position((function, node))
        if known is not None and known < self._size:
            return known, sign
        wanted = BUILD[function](node)
        if wanted not in self.nodes:
            if len(self.nodes) == _PLACES:
                return None, 1
            self.nodes.append(wanted)
        return self._size + self.nodes.index(wanted), sign

    def _sum_of(self, first: Quotient, second: Quotient, side: int) -> tuple[Node | None, int]:
        """Return a sum or difference of angles or its negative, whichever is shorter, and which; None for a number."""
        work = self._field.work
        angle = first + second * side
        if not angle.symbols:
            return None, 1
        forms = [(sign, self._written(angle * sign)) for sign in (1, -1)]
        self._field.work = work
        turned, node = min(forms, key=lambda x: (x[1].op == "neg", len(text(x[1])), text(x[1])))
        return node, turned

    def node(self, place: int) -> Node | None:
        """Return the expression in a place behind the letters of the field."""
        return self.nodes[place - self._size] if place >= self._size else None


def _exchange_factors(m: Exponents, less: tuple[int, ...], more: tuple[int, ...]) -> Exponents:
    changed = list(m)
    for k in less:
        changed[k] -= 1
    for k in more:
        changed[k] += 1
    return tuple(changed)


# ----------------------------------------------------------------------------------------------------------------------
# Exponentials: exp(log(x)) as x, those of multiples of known exponents as powers, and products with one exponent.


_HIGHEST_MULTIPLE: Final = 12


def known_power(exponent: Quotient) -> Quotient | None:
    """Return exp(exponent) as 1 or as a power of an exponential that is a letter; else None."""
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
    """Return exp of the whole multiples of logarithms in an exponent, and the exponent without these.

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


def of_hyperbolic(op: str, a: Quotient, root: Callable[[Quotient], Quotient]) -> Quotient | None:
    """Return sinh, cosh or tanh of logarithms without functions, (x - 1/x)/2 for sinh(log(x)); None for all else.

    Halves of logarithms have square roots.
    """
    if op not in ("sinh", "cosh", "tanh") or a.is_zero:
        return None
    x, rest = of_logarithms(a)
    if not rest.is_zero:
        square, rest = of_logarithms(a + a)
        if not rest.is_zero:
            return None
        x = root(square)
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
    """Return the square of a quotient that is nothing but a root of something without roots, else None."""
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


# ----------------------------------------------------------------------------------------------------------------------
# Polynomials in sines and cosines of an angle written with those multiples of it that a model names: cos(3 a) again.
#
# Exact quotients have sums and multiples of angles written out: cos(3 a) becomes 4 cos(a)^3 - 3 cos(a). Only named
# multiples are written, so that sin(a) cos(a) stays where no formula has 2 a.


Waves = dict[tuple[Exponents, str, int], Fraction]
"""Coefficients by the exponents of all other letters, `cos` or `sin`, and the multiple of the angle."""


def angles_with_multiples(field: Field) -> Iterator[tuple[int, int]]:
    """Yield the places of (sine, cosine) of angles with multiples."""
    if all(max(met) == 1 for met in field.multiples.values()):
        return
    for s, letter in enumerate(list(field.letters)):
        if letter.cosine is not None and max(_multiples_of(field, s)) > 1:
            yield s, letter.cosine


def single_wave(field: Field, p: Poly, s: int, c: int) -> tuple[Node, Fraction] | None:
    """Return (cos or sin of a multiple of an angle, coefficient) if a polynomial is nothing else, else None."""
    multiples = waves(field, p, s, c)
    if multiples is None or len(multiples) != 1:
        return None
    (((_, kind, n), x),) = multiples.items()
    return (wave(field, s, kind, n), x) if n > 1 else None


def waves(field: Field, p: Poly, s: int, c: int) -> Waves | None:
    """Return a polynomial as a sum over multiples of the angle with letters s and c; None if one was never named."""
    found: Waves = {}
    for m, coefficient in p.items():
        rest = tuple(0 if k in (s, c) else e for k, e in enumerate(m))
        for (kind, n), x in _waves_of_powers(m[s], m[c]).items():
            key = rest, kind, n
            found[key] = found.get(key, Fraction(0)) + x * Fraction(int(coefficient))
    found = {key: x for key, x in found.items() if x}
    return found if all(n in _multiples_of(field, s) for _, _, n in found) else None


def wave(field: Field, s: int, kind: str, n: int) -> Node:
    """Return cos or sin of n times the angle of the letter s; 1 for n = 0."""
    return BUILD[kind](multiply(number(n), _angle(field, s)))


def _angle(field: Field, s: int) -> Node:
    node = field.letters[s].node
    assert node is not None
    return node.args[0]


def _multiples_of(field: Field, s: int) -> set[int]:
    """Return the named multiples of an angle, and those that need no other sines."""
    return {0, 1, *field.multiples.get(_angle(field, s), ())}


def _waves_of_powers(i: int, j: int) -> dict[tuple[str, int], Fraction]:
    """Return sin^i cos^j by multiples: with z = exp(i a), sin = (z - 1/z)/(2 i) and cos = (z + 1/z)/2."""
    of_z: dict[int, int] = {}
    for k in range(i + 1):
        for h in range(j + 1):
            n = i - 2 * k + j - 2 * h
            of_z[n] = of_z.get(n, 0) + (-1) ** k * comb(i, k) * comb(j, h)
    kind, sign = ("sin" if i % 2 else "cos"), (-1) ** (i // 2)
    found: dict[tuple[str, int], Fraction] = {}
    for n, x in of_z.items():
        turned = -1 if kind == "sin" and n < 0 else 1
        key = kind, abs(n)
        found[key] = found.get(key, Fraction(0)) + Fraction(sign * turned * x, 2 ** (i + j))
    return {key: x for key, x in found.items() if x}


# ----------------------------------------------------------------------------------------------------------------------
# 1 - cos^2 written as sin^2, and 1 - sin^2 as cos^2.


_MOST_FORMS: Final = 8
_MOST_TERMS_TRIED: Final = 30


def contract_squares(field: Field, p: Poly) -> dict[Exponents, int]:
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
        partner = shift_exponent(m, squared, -2)
        if terms.get(partner) == -terms[m]:
            merged = shift_exponent(partner, made, 2)
            terms[merged] = terms.get(merged, 0) - terms.pop(m)
            del terms[partner]
            if not terms[merged]:
                del terms[merged]


def shift_exponent(m: Exponents, k: int, change: int) -> Exponents:
    return (*m[:k], m[k] + change, *m[k + 1 :])


def trigonometric_forms(field: Field, p: Poly) -> list[Poly]:
    """Return a polynomial with sin^2 as 1 - cos^2 and with cos^2 as 1 - sin^2, angle by angle."""
    forms = [field.in_ring(p)]
    for k, letter in enumerate(field.letters if len(p) <= _MOST_TERMS_TRIED else ()):
        if letter.cosine is not None and any(m[letter.cosine] > 1 for form in forms for m in form):
            square = 1 - field.ring.gens[k] ** 2
            forms += [field.replaced(form, letter.cosine, square) for form in forms]
    return forms[:_MOST_FORMS]


# ----------------------------------------------------------------------------------------------------------------------
# Sines over cosines written as tangents.


def with_tangents(powers: list[tuple[Node, int]]) -> list[tuple[Node, int]]:
    """Return the factors with sin a / cos a written as tan a."""
    exponents = dict(powers)
    for node, sine in powers:
        if node.op != "sin":
            continue
        cosine = exponents.get(BUILD["cos"](node.args[0]), 0)
        if sine * cosine < 0:
            shared = min(abs(sine), abs(cosine)) * (1 if sine > 0 else -1)
            exponents[node] = sine - shared
            exponents[BUILD["cos"](node.args[0])] = cosine + shared
            exponents[BUILD["tan"](node.args[0])] = shared
    return list(exponents.items())
