"""Parameters as they are declared: a number or an expression of others, with its dimension."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError
from multibody_sym.expressions.parser import parse_scalar
from multibody_sym.expressions.units import DIMENSIONLESS, Dimension, parse_unit
from multibody_sym.model.declaration.fields import Element, fields_of, fields_tree, from_fields, holds, verify_keys
from multibody_sym.model.declaration.values import Flag, Scalar, Text, is_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node


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
    """Return the book's letters of the parameters that have one, by their names."""
    return {name: parameter.label for name, parameter in parameters.items() if parameter.label}


def in_letters(text: str, book: Mapping[str, str]) -> str:
    """Return an expression in which names have the book's letters, such as `rho*g` of `density*g`."""
    return re.sub(r"[A-Za-z_]\w*", lambda name: book.get(name[0], name[0]), text) if book else text


@dataclass(frozen=True)
class ParameterField:
    """A parameter: a number, `1 kg`, an expression of others, or the long form with `value`, `positive`, `label`."""

    def accept(self, value: Any) -> Parameter:
        if isinstance(value, Parameter):
            return value
        if not isinstance(value, Mapping):
            return _parameter({"value": value})
        verify_keys(value, fields_of(Parameter), Parameter.meant)
        if value.get("value") is None or is_text(value["value"], ""):
            raise ModelError("a parameter needs a sample value: write value: and a number", number="M102")
        return _parameter(value)

    def tree(self, value: Parameter) -> Any:
        return with_unit(fields_tree(value))


def with_unit(tree: dict[str, Any]) -> Any:
    """Return the tree of a value and its dimension, if it has one, as short as it can be written: `3 N`."""
    if "dimension" in tree and _DECIMAL.fullmatch(tree["value"]):
        tree["value"] = f"{tree['value']} {tree.pop('dimension')}"
    return tree["value"] if set(tree) == {"value"} else tree


_DECIMAL: Final = re.compile(r"-?[0-9]+(\.[0-9]+)?")


def _parameter(tree: Mapping[str, Any]) -> Parameter:
    content, value = dict(tree), tree["value"]
    if value is None or is_text(value, ""):
        raise ModelError(
            "a parameter needs a sample value; numbers have a decimal point, 9.81, as a comma begins the next entry",
            number="M102",
        )
    if isinstance(value, str):
        content["value"], dimension = parse_scalar(value)
        if dimension is not None:
            content.setdefault("dimension", dimension)
    parameter = from_fields(Parameter, content)
    assert isinstance(parameter, Parameter)
    return parameter
