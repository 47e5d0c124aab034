"""The works of an impact: the impulse along each row times the mean speed along it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.impact.resting import ImpactInstant, row_impulses
from multibody_sym.answers.instant import AGREEMENT, Solved
from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.values import Value
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node


def works(told: ImpactInstant, rows: Sequence[str], striking: Mapping[str, Node]) -> list[tuple[Any, Any]]:
    """Return the impulse along each row, and twice its mean speed.

    Were impulses to grow in proportion that would be their work; of all rows it is exact. Rows that are `striking` do
    so with these speeds, after a push; others act from the start.
    """
    both = ((striking.get(row, told.rows_before[row].phidot), told.rows_after[row].phidot) for row in rows)
    return [(p, v + w) for p, (v, w) in zip(row_impulses(told, rows), both, strict=True)]


def taken(pairs: Sequence[tuple[Any, Any]]) -> Any:
    """Return minus the sum of works."""
    return -sum((p * v for p, v in pairs), 0) / 2


def by_works(solved: Solved, pairs: Sequence[tuple[Any, Any]], known: Value) -> Value:
    """Return an energy that has no formula in one piece as minus the works, each impulse beside its speeds.

    As it is where one of these has none either, or where they are not the energy.
    """
    if solved.forms is None or known.value is None:
        return known
    found: Node = ZERO
    try:
        for pair in pairs:
            impulse, speeds = (book_form(x) for x in solved.forms.of([as_node(x) for x in pair]))
            found = found - impulse * speeds / 2
        sample = {node: float(letter.sample) for node, letter in solved.symbolic.letters.items()}
        number = float(evaluate_float([found], sample)[0])
    except (NoClosedFormError, ExpressionError, *UNDEFINED):
        return known
    return replace(known, expression=found) if abs(number - known.value) <= AGREEMENT * abs(known.value) else known
