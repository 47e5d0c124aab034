"""Coordinates that loops decide: by a formula where one equation alone gives one, else by the equations of closure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import roots
from multibody_sym.answers.in_letters.coordinates import Absolute
from multibody_sym.answers.in_letters.letters import Letters
from multibody_sym.errors import ExpressionError
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.traversal import flatten

Found = tuple[Node | None, tuple[Node, Node] | None]
"""An expression, or the two sides of an equation."""
_NEAR: Final = 1e-10


def places_of(letters: Letters, wanted: Sequence[Absolute], zeros: Sequence[Node]) -> dict[Node, Found]:
    """Return what gives each of the coordinates, by its name; `zeros` are the equations of closure."""
    equations = letters.of(zeros)
    found: dict[Node, Found] = {}
    waiting, left = list(wanted), list(equations)
    while (next_one := next(_alone(letters, waiting, left), None)) is not None:
        x, equation, root = next_one
        (value,) = letters.of([x.sense * (root - x.before[0])])
        found[x.own[0]] = letters.written(value), None
        waiting.remove(x)
        left.remove(equation)
    for x in waiting:
        its_own = next((e for e in left if x.letters[0] in e.symbols), None)
        if its_own is not None:
            left.remove(its_own)
            found[x.own[0]] = None, _sides(letters.written(its_own))
    return found


def _alone(
    letters: Letters, waiting: Sequence[Absolute], left: Sequence[Quotient]
) -> Iterator[tuple[Absolute, Quotient, Node]]:
    """Yield what one equation alone gives, as an expression of what is known by then."""
    unknown = {x.letters[0] for x in waiting}
    for equation in left:
        there = [x for x in waiting if x.letters[0] in equation.symbols & unknown]
        if len(there) != 1:
            continue
        (x,) = there
        try:
            for root in roots(equation, x.letters[0]):
                if abs(evaluate_float([root], letters.values)[0] - letters.values[x.letters[0]]) <= _NEAR:
                    yield x, equation, root
        except (NoClosedFormError, ExpressionError, KeyError, *UNDEFINED):
            continue


def _sides(zero: Node) -> tuple[Node, Node]:
    """Return the terms of a sum that vanishes, those with a minus on the right."""
    zero = zero.args[0] if zero.op == "neg" else zero
    terms = flatten("add", zero)
    left = [x for x in terms if x.op != "neg"]
    right = [x.args[0] for x in terms if x.op == "neg"]
    if not left:
        left, right = right, left
    return sum(left, ZERO), sum(right, ZERO)
