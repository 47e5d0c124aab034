"""Shorter writings of a formula's parts, equal for all parameters: |x| as x, nested roots as sums, acos(..) as atan.

In: a Node in letters with samples. Out: a Node of the same value, never longer. Each rule decides its identity exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property, reduce
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import surely_positive
from multibody_sym.algebra.long_sums import product_node
from multibody_sym.algebra.quotient_functions import exact, sqrt, with_whole_angles
from multibody_sym.algebra.quotients import Field, Letter, NoClosedFormError, Quotient
from multibody_sym.errors import ExpressionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD, flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ONE, PI, ZERO, Node, add, divide, multiply
from multibody_sym.text.printer import text

_WORK: Final = 20_000
_LONGEST: Final = 150
"""Letters of a part that is looked at."""
_NESTED: Final = 3
"""Letters by which one fraction in place of fractions in each other may be longer."""
_AGREEMENT: Final = 1e-12
_NEVER_NEGATIVE: Final = ("sqrt", "exp", "abs", "cosh", "acos")
_OF_PARTS: Final = ("add", "mul", "div", "min", "sinh", "tanh", "atan", "asin")
"""Never negative where their arguments are."""


@dataclass
class ShortForms:
    """Shorter writings of expressions in `letters`: symbols with their samples, and which are positive."""

    letters: Mapping[Node, Letter]
    _positive: dict[Node, bool] = field(default_factory=dict)

    @cached_property
    def _sample(self) -> dict[Node, float]:
        return {node: float(letter.sample) for node, letter in self.letters.items()}

    def shortest(self, form: Node) -> Node:
        """Return an expression in its shortest writing that is known; itself where it names other symbols."""
        if not self.letters.keys() >= {*leaves([form], "symbol")} or leaves([form], "quantity"):
            return form
        found = min((self._by_rules(x) for x in (form, *self._expanded(form))), key=lambda x: len(text(x)))
        return found if len(text(found)) < len(text(form)) and self._agree(found, form) else form

    def _expanded(self, form: Node) -> Iterator[Node]:
        """Yield an expression with sums of angles multiplied out where they cancel, else put together."""
        sums = (n for n in postorder([form]) if n.op in ("sin", "cos", "tan") and len(leaves(n.args, "symbol")) > 1)
        if next(sums, None) is not None and len(text(form)) <= _LONGEST:
            try:
                yield book_form(with_whole_angles(self._exact(form, expands=True)))
            except (NoClosedFormError, ExpressionError, *UNDEFINED):
                return

    def _by_rules(self, form: Node) -> Node:
        made: dict[Node, Node] = {}
        for n in postorder([form]):
            made[n] = self._shorter(BUILD[n.op](*n.own, *(made[x] for x in n.args)) if n.args else n)
        return made[form]

    def _shorter(self, node: Node) -> Node:
        rule = self._rules.get(node.op)
        if rule is None or len(text(node)) > _LONGEST:
            return node
        try:
            found = min(rule(node), key=lambda x: len(text(x)), default=node)
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return node
        nested = node.op in ("mul", "div") and any(x.op == "div" for x in node.args)
        return found if len(text(found)) < len(text(node)) + _NESTED * nested else node

    @cached_property
    def _rules(self) -> Mapping[str, Callable[[Node], Iterator[Node]]]:
        return {
            "abs": self._absolute,
            "sqrt": self._root,
            "acos": self._angle,
            "asin": self._angle,
            "atan": self._arc,
            "atan2": self._direction,
            "mul": self._fraction,
            "div": self._fraction,
        }

    def _agree(self, a: Node, b: Node) -> bool:
        try:
            x, y = evaluate_float([a, b], self._sample)
        except (ExpressionError, *UNDEFINED):
            return False
        return abs(x - y) <= _AGREEMENT * abs(y)

    def _exact(self, node: Node, *, expands: bool = False) -> Quotient:
        over = Field(_WORK, expands)
        (found,) = exact(over, [node], {x: over.letter(x, letter) for x, letter in self.letters.items()})
        return found

    def _never_negative(self, node: Node) -> bool:
        """Return whether an expression is zero or more for all parameters, as its parts show."""
        for n in postorder([node]):
            if n in self._positive:
                continue
            if n.op in _OF_PARTS:
                found = all(self._positive[x] for x in n.args)
            elif n.op == "pow":
                exponent = n.args[1].data if n.args[1].op == "number" else Fraction(1)
                found = exponent.denominator > 1 or exponent % 2 == 0 or self._positive[n.args[0]]
            elif n.op == "symbol":
                found = self.letters[n].positive
            else:
                found = n is PI or n.op in _NEVER_NEGATIVE or (n.shadow is not None and n.shadow >= 0.0)
            self._positive[n] = found
        return self._positive[node]

    # --- rules: each yields expressions that equal a node for all parameters ----------------------------------------

    def _absolute(self, node: Node) -> Iterator[Node]:
        """Yield |a b/c| without what is never negative outside the bars."""
        above, below = _factors(node.args[0])
        inside, under = ([x for x in each if not self._never_negative(x)] for each in (above, below))
        outside, divisor = ([x for x in each if self._never_negative(x)] for each in (above, below))
        over, divided = (BUILD["abs"](_product(each)) if each else ONE for each in (inside, under))
        yield divide(multiply(_product(outside), over), multiply(_product(divisor), divided))
        if inside:
            size = BUILD["abs"](divide(_product(inside), _product(under)))
            yield divide(multiply(_product(outside), size), _product(divisor))

    def _root(self, node: Node) -> Iterator[Node]:
        """Yield sqrt((A + D)/2) +- sqrt((A - D)/2) for sqrt(A +- B sqrt(C)), D = sqrt(A^2 - B^2 C) without a root."""
        inside = self._exact(node.args[0])
        over = inside.field
        places = [k for k, letter in enumerate(over.letters) if letter.node is None]
        for k in (k for k in places if any(m[k] for m in over.in_ring(inside.above))):
            above = over.in_ring(inside.above)
            parts = [over.ring.from_dict({m: c for m, c in above.items() if m[k] == e}) for e in (0, 1)]
            a, b = (over.whole(p) / over.whole(inside.below) for p in parts)
            square, roots = a * a - b * b, len(over.letters)
            d = sqrt(square)
            grown = len(over.letters) > roots or any(m[k] for m in over.in_ring(d.above))
            sides = [b * side for side in (1, -1) if surely_positive(b * side)]
            if not grown and sides and (square.is_zero or surely_positive(d)):
                first, second = (book_form(with_whole_angles(sqrt((a + d * side) / 2))) for side in (1, -1))
                yield add(first, second if b.sample > 0 else -second)

    def _angle(self, node: Node) -> Iterator[Node]:
        """Yield atan(..) for asin(x) and acos(x), where x is never negative."""
        if self._never_negative(node.args[0]):
            square = self._exact(multiply(node.args[0], node.args[0]))
            ratio = square / (-square + 1)
            tangent = sqrt(ratio if node.op == "asin" else ratio.power(-1))
            yield BUILD["atan"](book_form(with_whole_angles(tangent)))

    def _arc(self, node: Node) -> Iterator[Node]:
        """Yield pi/4 + atan(x)/2 for atan(x + sqrt(x^2 + 1)), and acos(..) and asin(..) where x is never negative."""
        (x,) = node.args
        terms = flatten("add", x)
        for k, term in enumerate(terms):
            if term.op == "sqrt":
                rest = reduce(add, [*terms[:k], *terms[k + 1 :]], ZERO)
                if self._exact(term.args[0] - rest * rest - 1).is_zero:
                    yield add(PI / 4, BUILD["atan"](rest) / 2)
        if self._never_negative(x):
            square = self._exact(multiply(x, x))
            for op, part in (("acos", square + 1), ("asin", (square + 1) / square)):
                yield BUILD[op](book_form(with_whole_angles(sqrt(part.power(-1)))))

    def _direction(self, node: Node) -> Iterator[Node]:
        """Yield acos(x/h) for atan2(y, x), where y is never negative and h = sqrt(x^2 + y^2) is no root."""
        y, x = node.args
        if self._never_negative(y):
            square = self._exact(x * x + y * y)
            over = square.field
            roots = len(over.letters)
            h = sqrt(square)
            if surely_positive(h) and len(over.letters) == roots:
                along = exact(over, [x], {n: over.letter(n, letter) for n, letter in self.letters.items()})[0]
                yield BUILD["acos"](book_form(with_whole_angles(along / h)))

    def _fraction(self, node: Node) -> Iterator[Node]:
        """Yield one fraction, with sin(x + atan(p/q)) for a sum of waves over its amplitude."""
        above, below = _factors(node)
        yield divide(_product(above), _product(below))
        yield from self._wave(above, below)

    def _wave(self, above: list[Node], below: list[Node]) -> Iterator[Node]:
        """Yield sin(x + atan(p/q)) for (p cos(x) + q sin(x))/sqrt(p^2 + q^2), where p and q are never negative."""
        for k, total in enumerate(above):
            waves = {op: _wave_of(total, op) for op in ("cos", "sin")} if total.op == "add" else {}
            pair = [x for x in waves.values() if x is not None]
            if len(pair) < 2 or pair[0][1] is not pair[1][1] or not all(self._never_negative(p) for p, _ in pair):
                continue
            (p, angle), (q, _) = pair
            for j, root in enumerate(below):
                if root.op == "sqrt" and self._exact(root.args[0] - p * p - q * q).is_zero:
                    rest = divide(_product([*above[:k], *above[k + 1 :]]), _product([*below[:j], *below[j + 1 :]]))
                    yield multiply(rest, BUILD["sin"](add(angle, BUILD["atan"](divide(p, q)))))
                    yield multiply(rest, BUILD["cos"](add(angle, -BUILD["atan"](divide(q, p)))))


def _factors(node: Node) -> tuple[list[Node], list[Node]]:
    """Return the factors above and below of products and quotients in each other."""
    if node.op not in ("mul", "div"):
        return [] if node is ONE else [node], []
    (above, below), (other, under) = map(_factors, node.args)
    if node.op == "div":
        other, under = under, other
    return [*above, *other], [*below, *under]


def _product(factors: Sequence[Node]) -> Node:
    return product_node([(x, 1) for x in factors])


def _wave_of(total: Node, op: str) -> tuple[Node, Node] | None:
    """Return (p, x) of the term p cos(x) (or p sin(x)) of a sum of two terms; None where it has none."""
    terms = flatten("add", total)
    for term in terms if len(terms) == 2 else ():
        factors = flatten("mul", term)
        wave = next((x for x in factors if x.op == op), None)
        if wave is not None:
            return _product([x for x in factors if x is not wave]), wave.args[0]
    return None
