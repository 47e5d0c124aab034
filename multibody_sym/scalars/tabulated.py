"""Rows of numbers, and the functions that are tabulated by them."""

from __future__ import annotations

import hashlib
import sys
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, Final, Literal, overload

from multibody_sym.scalars.floats import cubic, line, on_lines, on_spline, to_knot
from multibody_sym.scalars.node import Node, as_node

Row = tuple[Node, Node]
Kind = Literal["linear", "cubic", "knots"]
_DEGREES: Final[Mapping[Kind, int]] = {"linear": 1, "cubic": 3, "knots": 1}
_VALUES: Final[Mapping[Kind, Callable[[Sequence[Sequence[float]], int, float], float]]] = {
    "linear": on_lines, "cubic": on_spline, "knots": to_knot,
}  # fmt: skip


class TabulatedRows(Sequence[Row]):
    """Pairs (argument, value) whose arguments increase, held as floats `x` and `y`.

    A number is the decimal that its float prints as, but for those that are `exact` otherwise, such as pi/6, by their
    row and column.
    """

    def __init__(self, x: Iterable[float], y: Iterable[float], exact: Mapping[tuple[int, int], Node]) -> None:
        self.x, self.y, self.exact = array("d", x), array("d", y), dict(exact)

    def __len__(self) -> int:
        return len(self.x)

    @overload
    def __getitem__(self, k: int) -> Row: ...
    @overload
    def __getitem__(self, k: slice) -> Sequence[Row]: ...
    def __getitem__(self, k: int | slice) -> Row | Sequence[Row]:
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(len(self)))]
        place = range(len(self))[k]
        return self._node(place, 0), self._node(place, 1)

    def _node(self, row: int, column: int) -> Node:
        found = self.exact.get((row, column))
        return as_node((self.y if column else self.x)[row]) if found is None else found

    def __repr__(self) -> str:
        return f"<{len(self)} rows from {self.x[0]!r} to {self.x[-1]!r}>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TabulatedRows) and self.digest == other.digest and self.exact == other.exact

    def __hash__(self) -> int:
        return hash(self.digest)

    @cached_property
    def digest(self) -> bytes:
        """The hash of the floats, the same in every process."""
        return hash_columns((self.x, self.y))


def hash_columns(columns: Iterable[array[float]]) -> bytes:
    """Return the hash of columns of floats, the same in every process."""
    found = hashlib.sha256()
    for column in columns:
        words = array("d", column)
        if sys.byteorder == "big":
            words.byteswap()
        found.update(len(words).to_bytes(8, "little") + words.tobytes())
    return found.digest()


class Tabulated:
    """The function `name` that rows tabulate: straight lines between them, a natural cubic spline, or `knots`.

    The spline's second derivative is continuous and zero at both ends. Outside of the rows the value is that of the
    nearest end. `knots` is the function to do with another one that changes its sign where the slope of that jumps.
    """

    def __init__(self, name: str, rows: TabulatedRows, kind: Kind) -> None:
        self.name, self.rows, self.kind = name, rows, kind

    def __repr__(self) -> str:
        return f"{self.name} {self.kind} {self.digest.hex()}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tabulated) and self._identity == other._identity

    def __hash__(self) -> int:
        return hash((self.name, self.kind, self.rows))

    @property
    def _identity(self) -> tuple[str, TabulatedRows, Kind]:
        return self.name, self.rows, self.kind

    def __reduce__(self) -> tuple[Any, ...]:
        return Tabulated, self._identity

    def called(self, order: int) -> str:
        """Return the name of the function, or of its derivative of an order: f, f', f''."""
        return (f"knots of {self.name}" if self.kind == "knots" else self.name) + "'" * order

    @property
    def degree(self) -> int:
        """The degree of its pieces: higher derivatives are zero."""
        return _DEGREES[self.kind]

    @cached_property
    def columns(self) -> tuple[array[float], ...]:
        """What `value` reads: arguments, values and, of a spline, second derivatives."""
        x, y = self.rows.x, self.rows.y
        if self.kind == "knots":
            return (x,)
        return (x, y, array("d", _second_derivatives(x, y))) if self.kind == "cubic" else (x, y)

    @cached_property
    def digest(self) -> bytes:
        """The hash of all that values depend on, the same in every process."""
        return hash_columns(self.columns)

    def value(self, order: int, at: float) -> float:
        """Return the value, or the derivative of an order, at an argument."""
        return _VALUES[self.kind](self.columns, order, at)

    def values(self, order: int, at: Iterable[float]) -> array[float]:
        """Return the values, or the derivatives of an order, at many arguments."""
        return array("d", [self.value(order, x) for x in at])

    def piece(self, order: int, at: float, x: Node) -> Node:
        """Return the polynomial that holds around the argument `at` as an exact expression of x."""
        columns, k = self.columns, bisect_right(self.columns[0], at) - 1
        if self.kind == "knots" or not 0 <= k < len(self.rows) - 1:
            return as_node(self.value(order, at)) if order or self.kind == "knots" else self.rows[max(k, 0)][1]
        (x0, y0), (x1, y1) = self.rows[k], self.rows[k + 1]
        if self.kind == "linear":
            return as_node(line(order, x - x0, x1 - x0, y0, y1))
        return as_node(cubic(order, x - x0, x1 - x0, y0, y1, *map(as_node, columns[2][k : k + 2])))

    def edges(self, at: float) -> Sequence[float]:
        """Return the rows' arguments next to one: between them one polynomial holds."""
        k = bisect_right(self.columns[0], at)
        return self.columns[0][max(k - 1, 0) : k + 1]

    @property
    def bends(self) -> Tabulated:
        """The function that changes its sign where the slope of this one jumps."""
        last = len(self.rows) - 1
        return self.knots((0, last) if self.kind == "cubic" else range(last + 1))

    def knots(self, places: Sequence[int]) -> Tabulated:
        """Return the function that changes its sign at the arguments of some rows, whatever their values are."""
        x, exact = self.rows.x, self.rows.exact
        own = {(j, 0): exact[k, 0] for j, k in enumerate(places) if (k, 0) in exact}
        return Tabulated(self.name, TabulatedRows([x[k] for k in places], [0.0] * len(places), own), "knots")


def _second_derivatives(x: Sequence[float], y: Sequence[float]) -> list[float]:
    """Return y'' at the rows of a natural spline: h y''_k-1 + 2 (h + h') y''_k + h' y''_k+1 = 6 (slope' - slope).

    Gauss elimination of the tridiagonal system; source: any textbook of numerical analysis.
    """
    n = len(x)
    h = [after - before for before, after in pairwise(x)]
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
