"""One form of a root in all formulas of a problem: where one has sqrt(k/m), another has m*sqrt(k/m) for sqrt(k*m).

Two roots are forms of one where their radicands differ by the square of a product of what is positive. Roots and other
functions are letters here without a square, so that nothing but the form of a root changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from fractions import Fraction
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.decimal_sums import exact_root
from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.factors import factored
from multibody_sym.algebra.positivity import surely_positive
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.parser import parse
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.values import Value
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, Node
from multibody_sym.scalars.traversal import postorder

_ARITHMETIC: Final = frozenset({"number", "real", "add", "mul", "neg", "div"})
_WITHOUT_LETTER: Final = frozenset({"symbol", "slot", "quantity", "declared", "less", "less_equal"})
_WORK: Final = 20_000
_MOST_ROOTS: Final = 16
_MOST_TRIED: Final = 4
_LONGEST_RATIO: Final = 24
_AGREEMENT: Final = 1e-9


def values_with_shared_roots(values: Sequence[Value], letters: Mapping[Node, Letter]) -> list[Value]:
    """Return values with one form of each root in all their expressions; `letters` as for `with_shared_roots`."""
    forms = list(dict.fromkeys(each.expression for each in values if each.expression is not None))
    changed = dict(zip(forms, with_shared_roots(forms, letters), strict=True))
    return [x if x.expression is None else replace(x, expression=changed[x.expression]) for x in values]


def with_shared_roots(forms: Sequence[Node], letters: Mapping[Node, Letter]) -> list[Node]:
    """Return expressions, all different, with one form of each root wherever that makes none of their texts longer.

    `letters`: symbols with their samples, and which are positive. The form that leaves the fewest others is taken, of
    these the first that is met. An expression that names other symbols stays.
    """
    roots = list(dict.fromkeys(n for n in postorder(forms) if n.op == "sqrt"))
    if not 2 <= len(roots) <= _MOST_ROOTS:
        return list(forms)
    made = _Roots({n: x for n, x in letters.items() if n.op == "symbol"})
    found = list(forms)
    for group in made.groups(roots):
        found = made.with_one(group, found)
    return found


@dataclass
class _Roots:
    """Roots over one field; `known`: the letters of symbols and functions, `ratios`: what roots are of each other."""

    letters: Mapping[Node, Letter]
    known: dict[Node, Quotient] = field(default_factory=dict)
    ratios: dict[tuple[Node, Node], Quotient | None] = field(default_factory=dict)
    field: Field = field(default_factory=lambda: Field(_WORK))

    def __post_init__(self) -> None:
        self.known = {node: self.field.letter(node, letter) for node, letter in self.letters.items()}
        self.sample = {node: float(letter.sample) for node, letter in self.letters.items()}

    def groups(self, roots: Sequence[Node]) -> list[list[Node]]:
        """Return the forms of each root that has more than one."""
        found: list[list[Node]] = []
        for root in roots:
            own = next((group for group in found if self.ratio(root, group[0]) is not None), None)
            if own is not None:
                own.append(root)
            else:
                found.append([root])
        return [group for group in found if len(group) > 1]

    def ratio(self, root: Node, other: Node) -> Quotient | None:
        """Return root / other where that is a product of what is positive."""
        if (root, other) not in self.ratios:
            a, b = self.exact(root.args[0]), self.exact(other.args[0])
            self.ratios[root, other] = None if a is None or b is None else self._root_of_quotient(a, b)
        return self.ratios[root, other]

    def _root_of_quotient(self, a: Quotient, b: Quotient) -> Quotient | None:
        self.field.work = _WORK
        try:
            return _positive_root(a / b)
        except NoClosedFormError:
            return None

    def exact(self, node: Node, changed: Mapping[Node, Quotient] | None = None) -> Quotient | None:
        """Return an expression over the field, in which functions are letters but for those `changed`."""
        self.field.work = _WORK
        try:
            if not all(self._has_letter(n) for n in postorder([node])):
                return None
            return exact(self.field, [node], {**self.known, **(changed or {})})[0]
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None

    def _has_letter(self, n: Node) -> bool:
        """Return whether a node is of arithmetic or known; a function becomes so."""
        whole = n.op == "pow" and n.args[1].op == "number" and Fraction(n.args[1].data).denominator == 1
        if n in self.known or n is PI or n.op in _ARITHMETIC or whole:
            return True
        if n.op in _WITHOUT_LETTER:
            return False
        sample = PRECISE.mpf(float(evaluate_float([n], self.sample)[0]))
        self.known[n] = self.field.letter(n, Letter(n, sample, n.op in ("sqrt", "exp") and sample > 0))
        return True

    # --- one form -------------------------------------------------------------------------------------------------

    def with_one(self, group: Sequence[Node], forms: Sequence[Node]) -> list[Node]:
        """Return expressions with that form of a root which leaves the fewest others, if fewer than there are."""
        ways = [list(forms), *([self._in_form(n, group, kept) for n in forms] for kept in group[:_MOST_TRIED])]
        return min(ways, key=lambda way: len(_of(group, way)))

    def _in_form(self, node: Node, group: Sequence[Node], kept: Node) -> Node:
        """Return an expression with one form of a root for the others, itself where that is longer."""
        others = [root for root in _of(group, [node]) if root is not kept]
        ratios = {root: self.ratio(root, kept) for root in others}
        if not others or self.exact(node) is None or self.exact(kept) is None:
            return node
        changed = {root: s * self.known[kept] for root, s in ratios.items() if s is not None}
        quotient = self.exact(node, changed)
        try:
            found = node if quotient is None else with_doubles(book_form(quotient))
        except (NoClosedFormError, ExpressionError):
            return node
        squared = any(n.op == "pow" and n.args[0].op == "sqrt" for n in postorder([found]))
        return node if squared or len(text(found)) > len(text(node)) or not self._equal(found, node) else found

    def _equal(self, a: Node, b: Node) -> bool:
        """Return whether the text of an expression reads back as the value of another one."""
        try:
            x, y = (float(evaluate_float([n], self.sample)[0]) for n in (parse(text(a)), b))
        except (ExpressionError, *UNDEFINED):
            return False
        return abs(x - y) <= _AGREEMENT * abs(y)


def _of(group: Sequence[Node], forms: Sequence[Node]) -> list[Node]:
    """Return the roots of a group that expressions have."""
    met = {n for n in postorder(forms) if n.op == "sqrt"}
    return [root for root in group if root in met]


def _positive_root(a: Quotient) -> Quotient | None:
    """Return the positive product of which a is the square, None where it is not one of what is positive."""
    if a.size > _LONGEST_RATIO:
        return None
    root = a.field.constant(1)
    for p, side in ((a.above, 1), (a.below, -1)):
        content, factors = factored(a.field.in_ring(p))
        number = exact_root(Fraction(content)) if content > 0 else None
        if not number:
            return None
        root = root * a.field.constant(number).power(side)
        for factor, exponent in factors:
            whole = a.field.whole(factor)
            if exponent % 2 or not surely_positive(whole):
                return None
            root = root * whole.power(side * exponent // 2)
    return root
