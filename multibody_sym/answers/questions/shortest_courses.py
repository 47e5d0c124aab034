"""Courses of coordinates as a book writes them: forced parts over one divisor, what fades with one exponential."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import reduce
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import doubled, exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError
from multibody_sym.algebra.sums.grouped import multiplied, text
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import ZERO, Node, add, divide, multiply
from multibody_sym.scalars.traversal import flatten, postorder

_WORK: Final = 20_000
"""How much is done for one way to write a course, in products of terms."""

_PLAIN: Final = frozenset(("number", "pi", "symbol", "neg", "add", "mul", "div", "pow", "sqrt"))


def shortest_course(course: Node, letters: Mapping[Node, Letter], time: Node) -> Node:
    """Return a formula of time in the shortest of the ways to put its terms together; `letters`: its other symbols.

    The particular solution is one quotient, and so is what each exponential stands before.
    """
    shortest = _Shortest({**letters, time: Letter(time, PRECISE.mpf(1), True)})
    terms = flatten("add", course)
    fading = [term for term in terms if any(part.op == "exp" for part in postorder([term]))]
    lasting = reduce(add, (term for term in terms if term not in fading), ZERO)
    together = reduce(add, map(shortest, fading), shortest(lasting))
    return min((together, shortest(course)), key=_length)


def _product(parts: list[Node]) -> Node:
    """Return a product in the order of books: m/k*log(x), but F*exp(-c*t)*(k - m)/S."""
    below = [part.args[1] for part in parts if part.op == "div"]
    if below and not any(part.op == "exp" for part in parts):
        return reduce(multiply, parts)
    above = multiplied((part.args[0] if part.op == "div" else part, 1) for part in parts)
    return reduce(divide, below, above)


def _length(node: Node) -> int:
    return len(text(node))


@dataclass(frozen=True)
class _Shortest:
    """Writes a formula as one quotient or as what its parts are written as, whichever is shorter."""

    letters: Mapping[Node, Letter]
    known: dict[Node, Node] = field(default_factory=dict)

    def __call__(self, node: Node) -> Node:
        if node not in self.known:
            self.known[node] = min(self._ways(node), key=_length)
        return self.known[node]

    def _ways(self, node: Node) -> Iterator[Node]:
        """Yield the ways, among equals that one first which books prefer: c*t/(2*m), but m/k*log(x)."""
        if not node.args:
            yield node
            return
        quotient = self._quotient(node)
        if quotient is not None and all(part.op in _PLAIN for part in postorder([quotient])):
            yield quotient
        if node.op in ("add", "mul"):
            parts = [self(part) for part in flatten(node.op, node)]
            yield reduce(add, parts) if node.op == "add" else _product(parts)
        else:
            yield BUILD[node.op](*node.own, *map(self, node.args))
        yield node if quotient is None else quotient
        if node.op == "div" and node.args[1].op == "div":  # a/(b/c) as a c/b, each term of a by itself
            above, below = node.args[1].args
            terms = (self(multiply(below, term)) for term in flatten("add", node.args[0]))
            yield divide(reduce(add, terms), self(above))

    def _quotient(self, node: Node) -> Node | None:
        """Return a formula as one quotient, None where it is too long."""
        own = Field(_WORK)
        try:
            known = {symbol: own.letter(symbol, letter) for symbol, letter in self.letters.items()}
            return book_form(doubled(exact(own, [node], known)[0]), apart=1.0)
        except NoClosedFormError:
            return None
