"""cos(a) cos(b) + sin(a) sin(b) written as cos(a - b), and its like, in sums over the letters of a field.

A sine or cosine that is no letter of the field is written in a place behind its letters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import permutations

from sympy.polys.domains import ZZ
from sympy.polys.orderings import lex

from multibody_sym.algebra.factors import polynomial_ring
from multibody_sym.algebra.quotients import Field, Quotient
from multibody_sym.algebra.sums.grouped import Exponents, Terms
from multibody_sym.expressions.printer import text
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node

_PLACES = 6
"""How many sines and cosines of sums of angles one formula may have."""

_Angle = tuple[int, int, Quotient]
"""The places of an angle's sine and cosine, and the angle."""
_Pair = tuple[Exponents, Exponents, str, int, tuple[int, int]]
"""Two terms that make one, what they make, with which sign the second angle is added, and the places of the angles."""


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

    def put_together(self, terms: Terms) -> dict[Exponents, Fraction] | None:
        """Return terms with fewer sines and cosines, in as many places as the ring has letters; None where none go."""
        left = {(*m, *(0,) * _PLACES): c for m, c in terms.items()}
        used = [x for x in self._angles if sum(1 for m in terms if m[x[0]] or m[x[1]]) > 1]
        changed = False
        while (found := next(self._pairs(left, used), None)) is not None:
            first, second, function, side, (i, j) = found
            place, turned = self._place(function, used[i], used[j], side)
            if place is None:
                break
            changed = True
            factor = left.pop(first) * turned
            del left[second]
            made = _changed(first, (used[i][0] if function == "sin" else used[i][1], used[j][1]), (place,))
            left[made] = left.get(made, Fraction(0)) + factor
            if not left[made]:
                del left[made]
        return left if changed else None

    def _pairs(self, terms: Terms, used: list[_Angle]) -> Iterator[_Pair]:
        for (i, (s, c, _)), (j, (t, d, _)) in permutations(enumerate(used), 2):
            for m in terms:
                if m[c] and m[d] and i < j:
                    other = _changed(m, (c, d), (s, t))
                    if abs(terms.get(other, 0)) == abs(terms[m]):
                        yield m, other, "cos", -1 if terms[other] == terms[m] else 1, (i, j)
                if m[s] and m[d]:
                    other = _changed(m, (s, d), (c, t))
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
        found = [(sign, self._written(angle * sign)) for sign in (1, -1)]
        self._field.work = work
        turned, node = min(found, key=lambda x: (x[1].op == "neg", len(text(x[1])), text(x[1])))
        return node, turned

    def node(self, place: int) -> Node | None:
        """Return what stands in a place behind the letters of the field."""
        return self.nodes[place - self._size] if place >= self._size else None


def _changed(m: Exponents, less: tuple[int, ...], more: tuple[int, ...]) -> Exponents:
    changed = list(m)
    for k in less:
        changed[k] -= 1
    for k in more:
        changed[k] += 1
    return tuple(changed)
