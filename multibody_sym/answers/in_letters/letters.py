"""The letters of formulas: what they are worth at the start, and how formulas over them are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.quotient_functions import doubled, exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.expressions.printer import text
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.traversal import flatten, leaves, postorder

_WORK: Final = 50_000
_MOST_TERMS: Final = 40
_MOST_OF_LOOP: Final = 30
"""Terms of an equation that closes a loop; of loops in space with as many all that follows grows too long."""
_LONGEST: Final = 400
_ANGLES: Final = 2_000
_AGREEMENT: Final = 1e-9
_TURNING: Final = ("sin", "cos", "tan")
_BESIDE_LETTER: Final = 1e-11
"""The part of a number that is rounding in formulas whose letters are known to a double."""


@dataclass
class Letters:
    """Letters over one field, with their `values` in floats; `shown`: those that stand for others in what is written.

    `known` is what letters are in formulas, `plain` each as itself.
    """

    shown: Mapping[Node, Node]
    known: dict[Node, Quotient] = field(default_factory=dict)
    plain: dict[Node, Quotient] = field(default_factory=dict)
    values: dict[Node, float] = field(default_factory=dict)
    field: Field = field(default_factory=lambda: Field(_WORK, expands=True))

    def add(self, node: Node, value: float, letter: Letter | None = None) -> None:
        """Make a symbol a letter of the field."""
        self.values[node] = value
        self.plain[node] = self.field.letter(node, letter or Letter(node, PRECISE.mpf(value)))
        self.known[node] = self.plain[node]

    def put_in(self, node: Node, stands: Node) -> None:
        """Let a letter be an expression of others, but where formulas are still to be differentiated."""
        self.known[node] = self.of([stands])[0]

    def of(self, nodes: Iterable[object]) -> list[Quotient]:
        """Return expressions over the letters; raises NoClosedFormError where they are too long."""
        return exact(self.field, map(as_node, nodes), self.known)

    def simplified(self, node: Node) -> Node:
        """Return an expression in its book form, over all letters; raises NoClosedFormError where it is too long."""
        (found,) = exact(self.field, [node], self.plain)
        if found.size > _MOST_OF_LOOP:
            raise NoClosedFormError("how a loop closes is too long for formulas in letters")
        return book_form(found)

    def renew(self) -> None:
        """Let as much work be done again."""
        self.field.work = _WORK

    def written(self, found: Quotient) -> Node:
        """Return a quotient as it is told; raises NoClosedFormError where that is too long, or is not its value."""
        if found.size > _MOST_TERMS:
            raise NoClosedFormError("a formula in letters is too long")
        form = _with_plain_sums(substituted(with_doubles(book_form(doubled(found))), self.shown))
        try:
            again = evaluate_float([form], self.values)[0]
        except (KeyError, *UNDEFINED):
            raise NoClosedFormError("a formula in letters has no value") from None
        if abs(again - float(found.sample)) > _AGREEMENT * abs(again) + _BESIDE_LETTER:
            raise NoClosedFormError("a formula in letters loses too many digits")
        if len(text(form)) > _LONGEST:
            raise NoClosedFormError("a formula in letters is too long")
        return form


def substituted(node: Node, shown: Mapping[Node, Node]) -> Node:
    return as_node(evaluate([node], lambda leaf: shown.get(leaf, leaf))[0])


def _with_plain_sums(form: Node) -> Node:
    """Return a form with sums in their shortest form in angles, and of symbols: psi for phi + psi - phi."""
    made: dict[Node, Node] = {}
    for n in postorder([form]):
        args = [made[a] for a in n.args]
        if n.op in _TURNING:
            args = [_plain(args[0])]
        made[n] = BUILD[n.op](*n.own, *args) if args else n
        if n.op == "add" and _is_of_symbols(made[n]):
            made[n] = _plain(made[n])
    return made[form]


def _is_of_symbols(total: Node) -> bool:
    """Return whether the same symbol is met more than once in a sum of symbols alone."""
    sizes = [x.args[0] if x.op == "neg" else x for x in flatten("add", total)]
    return all(x.op == "symbol" for x in sizes) and len(set(sizes)) < len(sizes)


def _plain(total: Node) -> Node:
    """Return a sum in its shortest form."""
    field = Field(_ANGLES)
    named = enumerate(leaves([total], "symbol"))
    try:
        known = {n: field.letter(n, Letter(n, PRECISE.mpf(1) / (k + 3))) for k, n in named}
        return book_form(exact(field, [total], known)[0])
    except NoClosedFormError:
        return total
