"""Parameters, inputs and state variables as they are declared: numbers with units, expressions, tables."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import inf, isfinite
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.fields import (
    TEXTS,
    Choice,
    Element,
    Flag,
    Scalar,
    Text,
    content_of,
    describe,
    fields_of,
    fields_tree,
    from_fields,
    holds,
    is_text,
    scalar,
    verify_keys,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import table
from multibody_sym.scalars.node import Node, as_node, symbol
from multibody_sym.scalars.tabulated import Kind, Rows, Tabulated
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


def letters_of(parameters: Mapping[str, Parameter]) -> dict[str, str]:
    """Return the labels of the parameters that have one, by name."""
    return {name: parameter.label for name, parameter in parameters.items() if parameter.label}


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
        return parameter

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

    def accept(self, value: Any) -> Rows:
        if isinstance(value, Rows):
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
        table_rows = Rows(x, y, exact)
        for index, (before, after) in enumerate(pairwise(x), 1):
            if not before < after:
                with at(index):
                    first, second = text(table_rows[index - 1][0]), text(table_rows[index][0])
                    raise ModelError(
                        f"row {index + 1} begins with {second}, which does not come after {first}", number="M103"
                    )
        return table_rows

    def tree(self, value: Rows) -> list[list[str]]:
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


@dataclass(frozen=True)
class Table(Element):
    """Values between the rows (argument, value) of `table`, at the argument `of` (default: the time).

    `linear`, or `cubic`: the natural spline, whose second derivative is continuous and zero at both ends. Outside the
    range of the table the value is that of the nearest end. `dimension` is that of the values, where they have units.
    """

    table: Rows = holds(
        TableRows(), such="[[0, 0], [1 s, 2 N]]",
        says="rows [argument, value] with growing arguments, or the file that has them",
    )
    of: Node = holds(Scalar(), "t", says="the argument of the table; the time if left out", such="x")
    interpolation: str = holds(
        Choice(("linear", "cubic"), tuple((x, "cubic") for x in _SPLINES)), "linear", such="cubic",
        says="straight lines between the rows, or a natural spline",
    )
    dimension: Dimension | None = holds(
        DimensionField(), None, says="a unit of the values' dimension, where rows state none", such="N"
    )

    def __post_init__(self) -> None:
        rows = self.table
        super().__post_init__()
        if self.of is symbol("t"):
            self.verify_arguments("s")
        if self.dimension is None:
            values = (parse_scalar(value)[1] for _, value in _texts_in(rows, 1))
            with at("table"):
                dimensions = list(dict.fromkeys(dimension for dimension in values if dimension is not None))
                if len(dimensions) > 1:
                    message = f"the values are in {dimensions[0]} and in {dimensions[1]}; a table is of one quantity"
                    raise ModelError(message, number="M105")
            object.__setattr__(self, "dimension", dimensions[0] if dimensions else None)

    def verify_arguments(self, unit: str) -> None:
        """Raise ModelError where an argument was given in another unit than `unit`."""
        with at("table"):
            for index, argument in _texts_in(getattr(self, TEXTS)["table"], 0):
                content_of(index, argument, Scalar(unit))


def _texts_in(rows: Any, column: int) -> Iterator[tuple[int, str]]:
    """Yield the texts of a column that are no decimals, with their row numbers; Rows have none."""
    for index, row in enumerate(() if isinstance(rows, Rows) else rows):
        if isinstance(row[column], str) and not DECIMAL.fullmatch(row[column]):
            yield index, row[column]


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


def table_value(name: str, given: Table) -> Node:
    """Return the value of a tabulated input as an expression."""
    kind: Kind = "cubic" if given.interpolation == "cubic" else "linear"
    return table(Tabulated(name, given.table, kind), 0, given.of)


def input_dimensions(inputs: Mapping[str, Node | Table | Constant]) -> dict[str, Dimension]:
    """Return the dimensions of tables and constants that state one."""
    stated = {name: x.dimension for name, x in inputs.items() if not isinstance(x, Node)}
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
            self.verify_unit("initial", _unit_text(self.dimension))
            self.verify_unit("rate", rate_unit(str(self.dimension)))


def _unit_text(dimension: Dimension) -> str:
    return "" if dimension == DIMENSIONLESS else str(dimension)
