"""Inputs: expressions, numbers with a unit, and tables, interpolated at the time or another expression."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.parser import parse_scalar
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.units import Dimension
from multibody_sym.model.declaration.fields import TEXTS, Element, fields_tree, from_fields, holds
from multibody_sym.model.declaration.parameters import DimensionField, with_unit
from multibody_sym.model.declaration.values import Choice, Scalar, content_of, described, scalar
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import where
from multibody_sym.scalars.node import Node, as_node, less, symbol

MOST_ROWS: Final = 1_000
Row = tuple[Node, Node]


@dataclass(frozen=True)
class TableRows:
    """Pairs of numbers (argument, value) whose arguments increase strictly; from a list or an array (m x 2)."""

    of_any_unit: ClassVar[bool] = True

    def accept(self, value: Any) -> tuple[Row, ...]:
        rows = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(rows, Mapping):
            raise ModelError("a table file is read with its model file; here give its rows (numpy.loadtxt)")
        if not isinstance(rows, (list, tuple)):
            raise ModelError(f"expected a list of rows [argument, value], got {described(rows)}", number="M103")
        if not 2 <= len(rows) <= MOST_ROWS:
            raise ModelError(f"a table has 2 to {MOST_ROWS:,} rows, got {len(rows)}", number="M103")
        read: list[Row] = []
        for index, row in enumerate(rows):
            with at(index):
                read.append(_row(row))
                if index and not _float(read[-2][0]) < _float(read[-1][0]):
                    after, before = text(read[-1][0]), text(read[-2][0])
                    raise ModelError(
                        f"row {index + 1} begins with {after}, which does not come after {before}", number="M103"
                    )
        return tuple(read)

    def tree(self, value: tuple[Row, ...]) -> list[list[str]]:
        return [[text(x) for x in row] for row in value]


def _row(row: Any) -> Row:
    if not isinstance(row, (list, tuple)) or len(row) != 2:
        raise ModelError(f"expected a row [argument, value], got {described(row)}", number="M103")
    argument, value = (scalar(x, None) for x in row)
    for node in (argument, value):
        if node.shadow is None:
            raise ModelError(f"a table holds numbers, got {text(node)}", number="M103")
    return argument, value


@dataclass(frozen=True)
class Table(Element):
    """Values between the rows (argument, value) of `table`, at the argument `of` (default: the time).

    `linear`, or `cubic`: the natural spline, whose second derivative is continuous and zero at both ends. Outside the
    range of the table the value is that of the nearest end. `dimension` is that of the values, where they have units.
    """

    table: tuple[Row, ...] = holds(
        TableRows(), such="[[0, 0], [1 s, 2 N]]",
        says="rows [argument, value] with growing arguments, or the file that has them",
    )
    of: Node = holds(Scalar(), "t", says="the argument of the table; the time if left out", such="x")
    interpolation: str = holds(
        Choice(("linear", "cubic")), "linear", says="straight lines between the rows, or a natural spline", such="cubic"
    )
    dimension: Dimension | None = holds(
        DimensionField(), None, says="a unit of the values' dimension, where rows state none", such="N"
    )

    def __post_init__(self) -> None:
        given = self.table
        super().__post_init__()
        if self.of is symbol("t"):
            self.verify_arguments("s")
        if self.dimension is None:
            with at("table"):
                object.__setattr__(self, "dimension", _dimension_of_values(given))

    def verify_arguments(self, unit: str) -> None:
        """Raise ModelError where an argument was given in another unit than `unit`."""
        given = getattr(self, TEXTS)["table"]
        with at("table"):
            for index, (argument, _) in enumerate(given):
                if isinstance(argument, str):
                    content_of(index, argument, Scalar(unit))


def _dimension_of_values(rows: Sequence[Sequence[Any]]) -> Dimension | None:
    """Return the dimension that the values of a table were given in, None where they have no unit."""
    stated = (parse_scalar(value)[1] for _, value in rows if isinstance(value, str))
    found = list(dict.fromkeys(dimension for dimension in stated if dimension is not None))
    if len(found) > 1:
        raise ModelError(f"the values are in {found[0]} and in {found[1]}; a table is of one quantity", number="M105")
    return found[0] if found else None


@dataclass(frozen=True)
class Constant(Element):
    """An input that is a number with a unit: its value (SI) and its dimension."""

    value: Node = holds(Scalar(), says="the number", such="3 N")
    dimension: Dimension = holds(DimensionField(), says="a unit of its dimension", such="N")


@dataclass(frozen=True)
class InputField:
    """An input: an expression, a number with a unit, or a table."""

    def accept(self, value: Any) -> Node | Element:
        if isinstance(value, (Table, Constant)):
            return value
        if isinstance(value, Mapping):
            return from_fields(Constant if "value" in value else Table, value)
        dimension = parse_scalar(value)[1] if isinstance(value, str) else None
        node = scalar(value, None)
        return node if dimension is None else Constant(node, dimension)

    def tree(self, value: Node | Table | Constant) -> Any:
        if isinstance(value, Node):
            return text(value)
        return with_unit(fields_tree(value)) if isinstance(value, Constant) else fields_tree(value)


@lru_cache(maxsize=64)
def interpolated(given: Table) -> Node:
    """Return the value of a table as an expression: the piece is found in as few comparisons as halving needs."""
    rows = given.table
    between = _lines(given) if given.interpolation == "linear" else _cubics(given)
    return _chosen(given.of, [argument for argument, _ in rows], [rows[0][1], *between, rows[-1][1]])


def bends(given: Table) -> list[Node]:
    """Return functions that are zero where the slope of a table jumps."""
    rows = given.table if given.interpolation == "linear" else (given.table[0], given.table[-1])
    return [given.of - argument for argument, _ in rows]


def _chosen(x: Node, edges: Sequence[Node], pieces: Sequence[Node]) -> Node:
    """Return the piece that holds at x: pieces[k] between edges[k - 1] and edges[k]."""
    if not edges:
        return pieces[0]
    k = len(edges) // 2
    low, high = _chosen(x, edges[:k], pieces[: k + 1]), _chosen(x, edges[k + 1 :], pieces[k + 1 :])
    return where(less(x, edges[k]), low, high)


def _lines(given: Table) -> list[Node]:
    pairs = zip(given.table[:-1], given.table[1:], strict=True)
    return [y0 + (y1 - y0) / (x1 - x0) * (given.of - x0) for (x0, y0), (x1, y1) in pairs]


def _cubics(given: Table) -> list[Node]:
    """Return the pieces y + d (b + d (m / 2 + d c)) with d = x - x_k, by the second derivatives m at the rows."""
    x, y = ([_float(row[i]) for row in given.table] for i in (0, 1))
    m, pieces = _second_derivatives(x, y), []
    for k in range(len(x) - 1):
        h = x[k + 1] - x[k]
        b = (y[k + 1] - y[k]) / h - h * (2 * m[k] + m[k + 1]) / 6
        d = given.of - given.table[k][0]
        pieces.append(given.table[k][1] + d * (b + d * (as_node(m[k] / 2) + d * ((m[k + 1] - m[k]) / (6 * h)))))
    return pieces


def _second_derivatives(x: Sequence[float], y: Sequence[float]) -> list[float]:
    """Return y'' at the rows of a natural spline: h y''_k-1 + 2 (h + h') y''_k + h' y''_k+1 = 6 (slope' - slope).

    Gauss elimination of the tridiagonal system; source: any textbook of numerical analysis.
    """
    n = len(x)
    h = [x[k + 1] - x[k] for k in range(n - 1)]
    slope = [(y[k + 1] - y[k]) / h[k] for k in range(n - 1)]
    pivot, right = [1.0] * n, [0.0] * n
    for k in range(1, n - 1):
        factor = h[k - 1] / pivot[k - 1] if k > 1 else 0.0
        pivot[k] = 2 * (h[k - 1] + h[k]) - factor * h[k - 1]
        right[k] = 6 * (slope[k] - slope[k - 1]) - factor * right[k - 1]
    m = [0.0] * n
    for k in range(n - 2, 0, -1):
        m[k] = (right[k] - h[k] * m[k + 1]) / pivot[k]
    return m


def _float(constant: Node) -> float:
    assert constant.shadow is not None
    return constant.shadow
