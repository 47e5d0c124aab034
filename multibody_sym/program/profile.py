"""Where the matrix of a solve may differ from zero, and where its elimination in the order of the rows does."""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.numerics.least_norm import Span, row_spans
from multibody_sym.scalars.node import ZERO, Node


def column_order(rows: Sequence[Sequence[int]], columns: int) -> list[int]:
    """Return the columns in the order in which rows first use them, which keeps spans short; last those never used."""
    first: dict[int, int] = {}
    for j, places in enumerate(rows):
        for k in places:
            first.setdefault(k, j)
    return sorted(range(columns), key=lambda k: first.get(k, len(rows)))


def spans_of(matrix: Sequence[Sequence[Node]]) -> list[Span]:
    """Return the span of each row of a matrix (s x n)."""
    return row_spans([[element is not ZERO for element in row] for row in matrix])


def elimination_cost(spans: Sequence[Span]) -> int:
    """Return how many elements of vectors the elimination reads, about half of its multiplications."""
    return sum((span.high - span.low) * (j - span.low + 1) for j, span in enumerate(spans))
