"""Parameters, inputs and state variables as they are declared: numbers with units, expressions, tables."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import pairwise
from math import inf, isfinite
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.fields import (
    TEXTS,
    Choice,
    Element,
    Flag,
    ListOf,
    Scalar,
    Text,
    content_of,
    describe,
    fields_of,
    fields_tree,
    from_fields,
    holds,
    is_text,
    list_items,
    scalar,
    verify_keys,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import maximum, minimum, table, where
from multibody_sym.scalars.node import ZERO, Node, add, as_node, less_equal, multiply, number, sqrt, subtract, symbol
from multibody_sym.scalars.tabulated import Kind, Tabulated, TabulatedRows
from multibody_sym.text.parser import parse_scalar
from multibody_sym.text.printer import text
from multibody_sym.text.units import DIMENSIONLESS, Dimension, parse_unit, rate_unit


@dataclass(frozen=True)
class DimensionField:
    """The dimension of a parameter, written as a unit that has it, such as `N*m` or `rad`."""

    def accept(self, value: Any) -> Dimension:
        return value if isinstance(value, Dimension) else parse_unit(Text().accept(value))[1]

    def tree(self, value: Dimension) -> str:
        return "rad" if value == DIMENSIONLESS else str(value)


@dataclass(frozen=True)
class Parameter(Element):
    """A named number: its value (SI) or an expression of others, its dimension where stated, its sign where known."""

    meant: ClassVar[Mapping[str, str]] = {"unit": "the unit stands behind the number: {value: 1 kg}"}

    value: Node = holds(
        Scalar(), says="its number, with a unit if it has one, or an expression of other parameters", such="9.81 m/s^2"
    )
    dimension: Dimension | None = holds(
        DimensionField(), None, says="a unit of its dimension, where the value states none", such="N*m"
    )
    positive: bool = holds(
        Flag(), False, says="whether it is positive, so that roots and signs come out simpler", such="true"
    )
    label: str | None = holds(Text(), None, says="the letter that typeset formulas and pictures show", such="mu_0")

    def declared_as(self, text: str) -> Parameter:
        """Return the same with the text of its value, which `given` returns."""
        new = replace(self)
        getattr(new, TEXTS)["value"] = text
        return new


def in_letters(text: str, book: Mapping[str, str]) -> str:
    """Return an expression's text with labels in place of names, such as `rho*g` of `density*g`."""
    return re.sub(r"[A-Za-z_]\w*", lambda name: book.get(name[0], name[0]), text) if book else text


@dataclass(frozen=True)
class ParameterField:
    """A parameter: a number, `1 kg`, an expression of others, or the long form with `value`, `positive`, `label`."""

    def accept(self, value: Any) -> Parameter:
        if isinstance(value, Parameter):
            return value
        long = isinstance(value, Mapping)
        content = dict(value) if long else {"value": value}
        if long:
            verify_keys(content, fields_of(Parameter), Parameter.meant)
        number = content.get("value")
        if number is None or is_text(number, ""):
            advice = (
                ": write value: and a number" if long
                else "; numbers have a decimal point, 9.81, as a comma begins the next entry"
            )
            raise ModelError(f"a parameter needs a sample value{advice}", number="M102")
        if isinstance(number, str):
            content["value"], dimension = parse_scalar(number)
            if dimension is not None:
                content.setdefault("dimension", dimension)
        parameter = from_fields(Parameter, content)
        assert isinstance(parameter, Parameter)
        return parameter.declared_as(number) if isinstance(number, str) else parameter

    def tree(self, value: Parameter) -> Any:
        return with_unit(fields_tree(value))


_SHORT_DECIMAL: Final = re.compile(r"-?[0-9]+(\.[0-9]+)?")


def with_unit(tree: dict[str, Any]) -> Any:
    """Return the tree of a value with a dimension in its shortest form: `3 N`."""
    if "dimension" in tree and _SHORT_DECIMAL.fullmatch(tree["value"]):
        tree["value"] = f"{tree['value']} {tree.pop('dimension')}"
    return tree["value"] if set(tree) == {"value"} else tree


# ----------------------------------------------------------------------------------------------------------------------
# Inputs: expressions, numbers with a unit, and tables, interpolated at the time or another expression.


MOST_ROWS: Final = 1_000_000
_SPLINES: Final = ("spline", "splines", "cubic_spline", "natural", "smooth")
_SURE: Final = 15
"""Two decimals of so many digits never have the same float."""
_SMALLEST: Final = 1e-290  # below, floats have fewer digits
_ZERO: Final = frozenset("0.")
_LARGEST_WHOLE: Final = 1 << 53
DECIMAL: Final = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True)
class TableRows:
    """Pairs of numbers (argument, value) whose arguments increase strictly; from a list or an array (m x 2)."""

    of_any_unit: ClassVar[bool] = True

    def accept(self, value: Any) -> TabulatedRows:
        if isinstance(value, TabulatedRows):
            return value
        rows = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(rows, Mapping):
            raise ModelError("a table file is read with its model file; here give its rows (numpy.loadtxt)")
        if not isinstance(rows, (list, tuple)):
            raise ModelError(f"expected a list of rows [argument, value], got {describe(rows)}", number="M103")
        if not 2 <= len(rows) <= MOST_ROWS:
            raise ModelError(f"a table has 2 to {MOST_ROWS:,} rows, got {len(rows)}", number="M103")
        x, y, exact = array("d"), array("d"), {}
        for index, row in enumerate(rows):
            if not isinstance(row, (list, tuple)) or len(row) != 2:
                with at(index):
                    raise ModelError(f"expected a row [argument, value], got {describe(row)}", number="M103")
            for column, cell in enumerate(row):
                if _is_float(cell):
                    number = float(cell)
                else:
                    with at(index):
                        node = scalar(cell, None)
                        if node.shadow is None:
                            raise ModelError(f"a table holds numbers, got {text(node)}", number="M103")
                    number = node.shadow
                    if node is not as_node(number):
                        exact[index, column] = node
                (y if column else x).append(number)
        table_rows = TabulatedRows(x, y, exact)
        for index, (before, after) in enumerate(pairwise(x), 1):
            if not before < after:
                with at(index):
                    first, second = text(table_rows[index - 1][0]), text(table_rows[index][0])
                    raise ModelError(
                        f"row {index + 1} begins with {second}, which does not come after {first}", number="M103"
                    )
        return table_rows

    def tree(self, value: TabulatedRows) -> list[list[str]]:
        return [[text(x) for x in row] for row in value]


def _is_float(cell: Any) -> bool:
    """Return whether a number is the decimal that its float prints as, as most are."""
    if isinstance(cell, str):
        if not DECIMAL.fullmatch(cell):
            return False
        sure = len(cell) <= _SURE and (_SMALLEST < abs(float(cell)) < inf or set(cell) <= _ZERO)
        return sure or cell == repr(float(cell))
    if type(cell) is float:
        return isfinite(cell)
    return type(cell) is int and abs(cell) < _LARGEST_WHOLE


OUTSIDE: Final = ("hold", "extrapolate", "error")
_OUTSIDE_MEANT: Final = tuple(
    (x, to) for to, words in (("hold", "clip clamp constant nearest"), ("extrapolate", "linear"), ("error", "nan none"))
    for x in words.split()
)  # fmt: skip
_KINDS: Final = Choice(("linear", "cubic"), tuple((x, "cubic") for x in _SPLINES))


_INTERPOLATION_SAYS: Final = "straight lines between the numbers, or natural splines"
_OUTSIDE_SAYS: Final = "beyond the arguments: the value at the nearest end, straight on, or an error"
_DIMENSION_SAYS: Final = "a unit of the values' dimension, where the numbers state none"


class Tabled(Element):
    """Base of inputs that are given by numbers: what there is between and outside of them."""

    interpolation: str
    outside: str
    dimension: Dimension | None

    @property
    def kind(self) -> Kind:
        """How it goes on between the numbers."""
        return "cubic" if self.interpolation == "cubic" else "linear"

    @property
    def arguments(self) -> tuple[Node, ...]:
        """What it is a function of."""
        raise NotImplementedError

    def value(self, name: str) -> Node:
        """Return the value of the input `name` as an expression."""
        raise NotImplementedError

    def verify_arguments(self, units: Sequence[str | None]) -> None:
        """Raise ModelError where an argument was given in another unit than that of `units`; None for any."""
        raise NotImplementedError

    def _take_dimension(self, key: str, values: Iterable[str]) -> None:
        """Take the dimension that values state, if no other is given. Raises ModelError for values of two."""
        if self.dimension is not None:
            return
        with at(key):
            found = (parse_scalar(value)[1] for value in values)
            dimensions = list(dict.fromkeys(dimension for dimension in found if dimension is not None))
            if len(dimensions) > 1:
                message = f"the values are in {dimensions[0]} and in {dimensions[1]}; a table is of one quantity"
                raise ModelError(message, number="M105")
        object.__setattr__(self, "dimension", dimensions[0] if dimensions else None)


@dataclass(frozen=True)
class Table(Tabled):
    """Values between the rows (argument, value) of `table`, at the argument `of` (default: the time).

    `linear`, or `cubic`: the natural spline, whose second derivative is continuous and zero at both ends. `outside` of
    the range of the table the value is that of the nearest end (`hold`), goes straight on (`extrapolate`), or there is
    none, which ends a run (`error`). `dimension` is that of the values, where they have units.
    """

    table: TabulatedRows = holds(
        TableRows(), such="[[0, 0], [1 s, 2 N]]",
        says="rows [argument, value] with growing arguments, or the file that has them",
    )
    of: Node = holds(Scalar(), "t", says="the argument of the table; the time if left out", such="x")
    interpolation: str = holds(_KINDS, "linear", such="cubic", says=_INTERPOLATION_SAYS)
    dimension: Dimension | None = holds(DimensionField(), None, such="N", says=_DIMENSION_SAYS)
    outside: str = holds(Choice(OUTSIDE, _OUTSIDE_MEANT), "hold", such="extrapolate", says=_OUTSIDE_SAYS)

    def __post_init__(self) -> None:
        rows = self.table
        super().__post_init__()
        if self.of is symbol("t"):
            self.verify_arguments(["s"])
        self._take_dimension("table", (value for _, value in _texts_in(rows, 1)))

    @property
    def arguments(self) -> tuple[Node, ...]:
        return (self.of,)

    def verify_arguments(self, units: Sequence[str | None]) -> None:
        (unit,) = units
        with at("table"):
            for index, argument in _texts_in(getattr(self, TEXTS)["table"], 0):
                content_of(index, argument, Scalar(unit))

    def value(self, name: str) -> Node:
        found = _along(Tabulated(name, self.table, self.kind), self.of, self.outside)
        return _within([(self.table[0][0], self.of, self.table[-1][0])], found) if self.outside == "error" else found


def _texts_in(rows: Any, column: int) -> Iterator[tuple[int, str]]:
    """Yield the texts of a column that are no decimals, with their row numbers; TabulatedRows have none."""
    for index, row in enumerate(() if isinstance(rows, TabulatedRows) else rows):
        if isinstance(row[column], str) and not DECIMAL.fullmatch(row[column]):
            yield index, row[column]


@dataclass(frozen=True)
class GridNumbers:
    """Numbers that increase: the arguments along one side of a grid; from a list or an array."""

    of_any_unit: ClassVar[bool] = True

    def accept(self, value: Any) -> tuple[Node, ...]:
        numbers = _constants(value)
        for index, (before, after) in enumerate(pairwise(numbers), 1):
            if not _float_of(before) < _float_of(after):
                with at(index):
                    message = f"arguments increase; {text(after)} comes after {text(before)}"
                    raise ModelError(message, number="M103")
        if len(numbers) < 2:
            raise ModelError("a grid has at least two arguments along each side", number="M103")
        return numbers

    def tree(self, value: tuple[Node, ...]) -> list[str]:
        return [text(x) for x in value]


@dataclass(frozen=True)
class GridValues:
    """The values of a grid, a list for each x with one value for each y; from lists or an array."""

    of_any_unit: ClassVar[bool] = True

    def accept(self, value: Any) -> tuple[tuple[Node, ...], ...]:
        rows = list_items(value)
        if rows is None:
            raise ModelError(f"expected a list for each x, got {describe(value)}", number="M103")
        found = []
        for index, row in enumerate(rows):
            with at(index):
                found.append(_constants(row))
        return tuple(found)

    def tree(self, value: tuple[tuple[Node, ...], ...]) -> list[list[str]]:
        return [[text(x) for x in row] for row in value]


def _constants(value: Any) -> tuple[Node, ...]:
    """Return the numbers of a list or array. Raises ModelError for what is no list of numbers."""
    items = list_items(value)
    if items is None:
        raise ModelError(f"expected a list of numbers, got {describe(value)}", number="M103")
    found = []
    for index, x in enumerate(items):
        with at(index):
            node = scalar(x, None)
            if node.shadow is None:
                raise ModelError(f"a grid holds numbers, got {text(node)}", number="M103")
            found.append(node)
    return tuple(found)


MOST_OF_GRID: Final = 250_000
_MOST_TERMS: Final = 256


@dataclass(frozen=True)
class Grid(Tabled):
    """Values over two arguments `of`, given at all points of a grid: `values[i][j]` is that at `x[i]`, `y[j]`.

    `linear`: straight along x and y between four points. `cubic`: natural splines along both, of which all second
    derivatives are continuous. Both are the sum of what the columns give along one argument, each times its weight
    along the other. `outside`, units and `dimension` as of a `Table`, for each argument.
    """

    x: tuple[Node, ...] = holds(GridNumbers(), such="[0, 100 rad/s]", says="the growing first arguments")
    y: tuple[Node, ...] = holds(GridNumbers(), such="[0, 0.5, 1]", says="the growing second arguments")
    values: tuple[tuple[Node, ...], ...] = holds(
        GridValues(), such="[[0, 1, 3], [0, 2, 5]]", says="for each x a list with the value at each y"
    )
    of: tuple[Node, ...] = holds(ListOf(Scalar(), 2, 2), such="[u_phi, throttle]", says="the two arguments")
    interpolation: str = holds(_KINDS, "linear", such="cubic", says=_INTERPOLATION_SAYS)
    dimension: Dimension | None = holds(DimensionField(), None, such="N", says=_DIMENSION_SAYS)
    outside: str = holds(Choice(OUTSIDE, _OUTSIDE_MEANT), "hold", such="extrapolate", says=_OUTSIDE_SAYS)

    def __post_init__(self) -> None:
        given = self.values
        super().__post_init__()
        if len(self.x) * len(self.y) > MOST_OF_GRID or min(len(self.x), len(self.y)) > _MOST_TERMS:
            most = f"{MOST_OF_GRID:,} values, and {_MOST_TERMS} along its shorter side"
            raise ModelError(f"a grid has at most {most}; this one is {len(self.x)} x {len(self.y)}", number="M103")
        for index, row in enumerate(self.values):
            if len(row) != len(self.y):
                with at("values", index):
                    raise ModelError(f"there are {len(self.y)} numbers y, but {len(row)} values here", number="M103")
        with at("values"):
            if len(self.values) != len(self.x):
                raise ModelError(f"there are {len(self.x)} numbers x, but values for {len(self.values)}", number="M103")
        self.verify_arguments(["s" if of is symbol("t") else None for of in self.of])
        cells = (x for row in list_items(given) or () for x in list_items(row) or ())
        self._take_dimension("values", (x for x in cells if isinstance(x, str) and not DECIMAL.fullmatch(x)))

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        """Yield the arguments: all else are numbers."""
        yield ("of",), self.of, None

    @property
    def arguments(self) -> tuple[Node, ...]:
        return self.of

    def verify_arguments(self, units: Sequence[str | None]) -> None:
        for name, unit in zip(("x", "y"), units, strict=True):
            if unit is not None:
                self.verify_unit(name, unit)

    def value(self, name: str) -> Node:
        """Return the value of the input `name` as an expression: a sum over the shorter side."""
        (x, y), (of_x, of_y), columns = (self.x, self.y), self.of, list(zip(*self.values, strict=True))
        if len(x) < len(y):
            (x, y), (of_x, of_y), columns = (y, x), (of_y, of_x), list(self.values)
        found = ZERO
        for k, column in enumerate(columns):
            weights = [as_node(int(j == k)) for j in range(len(y))]
            along = _along(Tabulated(name, _rows_of(x, column), self.kind), of_x, self.outside)
            weight = _along(Tabulated(name, _rows_of(y, weights), self.kind), of_y, self.outside)
            found = add(found, multiply(along, weight))
        return _within([(x[0], of_x, x[-1]), (y[0], of_y, y[-1])], found) if self.outside == "error" else found


def _rows_of(x: Sequence[Node], y: Sequence[Node]) -> TabulatedRows:
    """Return rows of numbers, which stay exact."""
    pairs = [(_float_of(a), _float_of(b)) for a, b in zip(x, y, strict=True)]
    nodes = {(k, c): node for k, row in enumerate(zip(x, y, strict=True)) for c, node in enumerate(row)}
    exact = {place: node for place, node in nodes.items() if node is not as_node(_float_of(node))}
    return TabulatedRows((a for a, _ in pairs), (b for _, b in pairs), exact)


def _float_of(node: Node) -> float:
    assert node.shadow is not None
    return float(node.shadow)


def _along(function: Tabulated, of: Node, outside: str) -> Node:
    """Return a tabulated function of an argument, beyond its rows as `outside` says."""
    found = table(function, 0, of)
    if outside != "extrapolate":
        return found
    ends = ((0, 0, minimum), (len(function.rows) - 2, len(function.rows) - 1, maximum))
    for piece, end, beyond in ends:  # from its end on, by the slope of the last piece there
        place = function.rows[end][0]
        slope = function.piece(1, function.rows.x[piece], place)
        found = add(found, multiply(slope, beyond(subtract(of, place), ZERO)))
    return found


_NOTHING: Final = number(-1)


def _within(ranges: Sequence[tuple[Node, Node, Node]], value: Node) -> Node:
    """Return a value where arguments are within ranges (low, argument, high), elsewhere one that is no number."""
    inside = [condition for low, of, high in ranges for condition in (less_equal(low, of), less_equal(of, high))]
    of = ranges[0][1]
    return where(reduce(minimum, inside), value, sqrt(subtract(_NOTHING, multiply(of, of))))


@dataclass(frozen=True)
class Constant(Element):
    """An input that is a number with a unit: its value (SI) and its dimension."""

    value: Node = holds(Scalar(), says="the number", such="3 N")
    dimension: Dimension = holds(DimensionField(), says="a unit of its dimension", such="N")


@dataclass(frozen=True)
class InputField:
    """An input: an expression, a number with a unit, a table, or a grid."""

    def accept(self, value: Any) -> Node | Element:
        if isinstance(value, (Tabled, Constant)):
            return value
        if isinstance(value, Mapping):
            kind = Constant if "value" in value else Grid if "values" in value else Table
            return from_fields(kind, value)
        dimension = parse_scalar(value)[1] if isinstance(value, str) else None
        node = scalar(value, None)
        return node if dimension is None else Constant(node, dimension)

    def tree(self, value: Node | Tabled | Constant) -> Any:
        if not isinstance(value, Element):
            return text(value)
        return with_unit(fields_tree(value)) if isinstance(value, Constant) else fields_tree(value)


def input_dimensions(inputs: Mapping[str, Node | Tabled | Constant]) -> dict[str, Dimension]:
    """Return the dimensions of tables and constants that state one."""
    stated = {name: x.dimension for name, x in inputs.items() if isinstance(x, Element)}
    return {name: dimension for name, dimension in stated.items() if dimension is not None}


# ----------------------------------------------------------------------------------------------------------------------
# State variables: a pressure, a current, the integral of an error. They have a rate, and no speed.


@dataclass(frozen=True)
class StateVariable(Element):
    """A state beside those of the joints: the expression of its rate, its value at t = 0, and its dimension if stated.

    Raises ModelError where `rate` is a number in another unit than that of the state over a second.
    """

    meant: ClassVar[Mapping[str, str]] = {
        "derivative": "rate", "value": "initial", "unit": "the unit stands behind the number: {initial: 1 bar}",
    }

    rate: Node = holds(
        Scalar(), says="its time derivative, an expression of the motion, inputs, parameters, t and other states",
        such="(Q - A*u_s)/C",
    )
    initial: Node = holds(Scalar(), says="its value at t = 0, with a unit if it has one", such="1 bar")
    dimension: Dimension | None = holds(
        DimensionField(), None, says="a unit of its dimension, where `initial` states none", such="Pa"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self.given("initial")
        if self.dimension is None and isinstance(given, str):
            object.__setattr__(self, "dimension", parse_scalar(given)[1])
        if self.dimension is not None:
            self.verify_unit("initial", unit_text(self.dimension))
            self.verify_unit("rate", rate_unit(str(self.dimension)))


def unit_text(dimension: Dimension) -> str:
    """Return the unit of a dimension as text, empty for a pure number."""
    return "" if dimension == DIMENSIONLESS else str(dimension)
