"""Where the matrix of a solve may differ from zero, and where its elimination in the order of the rows does."""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.program.statements import Rows
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node


@dataclass(frozen=True)
class Span:
    """One row: its elements from `first` up to `end` may differ from zero, when eliminated those from `low` to `high`.

    The reflection that eliminates row k mixes the columns from k up to its `high`, and so those of every later row that
    reaches into them.
    """

    first: int
    end: int
    low: int
    high: int


def column_order(matrix: Rows, columns: int) -> list[int]:
    """Return the columns in the order in which rows first use them, which keeps spans short; last those never used."""
    first: dict[int, int] = {}
    for j, places in enumerate(matrix.columns):
        for k in places:
            first.setdefault(k, j)
    return sorted(range(columns), key=lambda k: first.get(k, len(matrix)))


def row_spans(matrix: Sequence[Sequence[Node]]) -> list[Span]:
    """Return the span of each row of a matrix (s x n)."""
    spans: list[Span] = []
    for j, row in enumerate(matrix):
        used = [k for k, element in enumerate(row) if element is not ZERO]
        first, end = (used[0], used[-1] + 1) if used else (0, 0)
        low = next((k for k, before in enumerate(spans) if before.high > first), j)
        reached = (before.high for before in spans[low:])
        spans.append(Span(first, end, min(low, first), min(max(end, j + 1, *reached), len(row))))
    return spans


def elimination_cost(spans: Sequence[Span]) -> int:
    """Return how many elements of vectors the elimination reads, about half of its multiplications."""
    return sum((span.high - span.low) * (j - span.low + 1) for j, span in enumerate(spans))
