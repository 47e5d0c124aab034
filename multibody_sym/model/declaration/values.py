"""What a field may hold where that is a number, a direction or a word: how it is read, and how it is written back."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, Protocol

from multibody_sym.errors import ArgumentError, ModelError, at, shown
from multibody_sym.expressions.parser import parse_scalar
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.tokens import plain_number
from multibody_sym.expressions.units import DIMENSIONLESS, Dimension, parse_unit
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import node_of
from multibody_sym.scalars.kinks import is_condition
from multibody_sym.scalars.node import ONE, ZERO, Node, negate, number

Point = tuple[Node, Node, Node]
AXES = ("x", "y", "z")
_NOTHING = "null"
_EQUATION = re.compile(r"(?<![<>!])=(?![<>])")
_GAP = ("", _NOTHING, "~")
"""What a file holds where a list leaves a place out."""


class Field(Protocol):
    """One field's kind of content."""

    def accept(self, value: Any) -> Any:
        """Return the field's content; `value` is what Python or a model file holds. Raises InputError."""

    def tree(self, value: Any) -> Any:
        """Return the content as a file holds it: text, lists, maps."""


def scalar(value: Any, unit: str | None) -> Node:
    """Return a number, Node, sympy expression or text such as `45 deg` or `m1*r^2` as a Node in SI units."""
    if not isinstance(value, str):
        try:
            return node_of(value)
        except ArgumentError:
            raise ModelError(f"expected a number or an expression, got {described(value)}", number="M103") from None
    if (plain := plain_number(value)) is not None:
        return number(plain)
    node, dimension = parse_scalar(value)
    if dimension is not None and unit is not None and dimension != dimension_of_unit(unit):
        raise ModelError(
            f"{described(value)} does not fit here: expected a quantity in {unit or 'no unit'}", number="M105"
        )
    return node


@cache
def dimension_of_unit(unit: str) -> Dimension:
    """Return the dimension of a unit's text, the empty text standing for a pure number."""
    return parse_unit(unit)[1] if unit else DIMENSIONLESS


def described(value: object) -> str:
    """Return what a wrong value is, in a user's words."""
    if isinstance(value, Mapping):
        return "a map"
    if isinstance(value, (list, tuple)):
        return "a list"
    return "nothing" if is_empty(value) else shown(value)


@dataclass(frozen=True)
class Scalar:
    """One number or expression; `unit` is None where any dimension may stand."""

    unit: str | None = None

    def accept(self, value: Any) -> Node:
        return scalar(value, self.unit)

    def tree(self, value: Node) -> str:
        return text(value)


@dataclass(frozen=True)
class Condition:
    """A comparison of two expressions, such as `y < 0`, or several joined by `and` and `or`."""

    unit: str | None = None

    def accept(self, value: Any) -> Node:
        if isinstance(value, str) and _EQUATION.search(value):
            raise ModelError(
                f"{value!r} is an equation, which holds for an instant only; write a comparison that becomes true "
                "there, such as phi > 0",
                number="M103",
            )
        node = scalar(value, self.unit)
        if not is_condition(node):
            raise ModelError(f"expected a comparison such as y < 0, got {described(value)}", number="M103")
        if node.shadow is not None:
            raise ModelError(f"{described(value)} compares two constants; name something that changes")
        return node

    def tree(self, value: Node) -> str:
        return text(value)


def _counted(value: Any, items: list[Any] | None) -> str:
    """Return what stands where a list of three is wanted, which has `items` if it is a list, and how to mend it."""
    if items is None:
        written = isinstance(value, (int, float, str)) and not is_empty(value)
        along = f"; along x it is [{value}, 0, 0], along y [0, {value}, 0]" if written else ""
        return f"{described(value)}{along}"
    if len(items) > 3 and all(isinstance(x, str) for x in items):
        return f"a list of {len(items)}; numbers have a decimal point, 0.5, as a comma begins the next entry"
    if len(items) == 1 and isinstance(items[0], str):
        return "a list of 1; commas stand between the components, [x, y, z]"
    return f"a list of {len(items)}" + ("; of vectors in the x-y plane the third is 0" if len(items) == 2 else "")


@dataclass(frozen=True)
class Vector:
    """Three numbers or expressions."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node, Node, Node]:
        items = listed(value)
        if items is None or len(items) != 3:
            raise ModelError(
                f"expected a list of three numbers or expressions, got {_counted(value, items)}", number="M103"
            )
        x, y, z = (content_of(i, component, Scalar(self.unit)) for i, component in enumerate(items))
        return x, y, z

    def tree(self, value: tuple[Node, ...]) -> list[str]:
        return [text(component) for component in value]


@dataclass(frozen=True)
class Direction:
    """A direction: x, y, z, -x, -y, -z, or three numbers or expressions (of any length but zero)."""

    def accept(self, value: Any) -> tuple[Node, Node, Node]:
        if isinstance(value, str):
            letter, negative = value.strip().removeprefix("-"), value.strip().startswith("-")
            if letter not in AXES:
                raise ModelError(
                    f"{described(value)} is no direction: write x, y, z, -x, -y, -z or a list of three", number="M103"
                )
            unit = negate(ONE) if negative else ONE
            x, y, z = (unit if axis == letter else ZERO for axis in AXES)
            return x, y, z
        vector = Vector(None).accept(value)
        if all(component.shadow == 0 for component in vector):
            raise ModelError("a direction cannot be zero", number="M109")
        return vector

    def tree(self, value: tuple[Node, ...]) -> Any:
        for i, letter in enumerate(AXES):
            for sign, prefix in ((ONE, ""), (negate(ONE), "-")):
                if value == tuple(sign if k == i else ZERO for k in range(3)):
                    return prefix + letter
        return [text(component) for component in value]


@dataclass(frozen=True)
class ScalarOrVector:
    """One number or expression, or three of them."""

    unit: str | None = None

    def accept(self, value: Any) -> Node | tuple[Node, Node, Node]:
        if isinstance(value, (list, tuple)):
            return Vector(self.unit).accept(value)
        return scalar(value, self.unit)

    def tree(self, value: Any) -> Any:
        return text(value) if isinstance(value, Node) else [text(component) for component in value]


@dataclass(frozen=True)
class Scalars:
    """One number or expression, or a list of any length; held as a tuple."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node, ...]:
        if isinstance(value, (list, tuple)):
            return tuple(content_of(i, component, Scalar(self.unit)) for i, component in enumerate(value))
        return (scalar(value, self.unit),)

    def tree(self, value: tuple[Node, ...]) -> Any:
        return text(value[0]) if len(value) == 1 else [text(component) for component in value]


@dataclass(frozen=True)
class OptionalScalars:
    """One number or expression, or a list in which `null` (None) leaves a place out; held as a tuple."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node | None, ...]:
        items = value if isinstance(value, (list, tuple)) else (value,)
        left_out = [is_gap(x) for x in items]
        return tuple(None if left_out[i] else content_of(i, x, Scalar(self.unit)) for i, x in enumerate(items))

    def tree(self, value: tuple[Node | None, ...]) -> Any:
        written = [_NOTHING if x is None else text(x) for x in value]
        return written[0] if len(written) == 1 else written


@dataclass(frozen=True)
class Text:
    """A name or a reference such as `rod.pin`."""

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            place = "; give a place a name under points of its body: points: {NAME: [x, y, z]}" if listed(value) else ""
            raise ModelError(f"expected a name, got {described(value)}{place}", number="M103")
        return value.strip()

    def tree(self, value: str) -> str:
        return value


@dataclass(frozen=True)
class Prose:
    """Sentences, in lines and paragraphs as they are written."""

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or not value.strip() or not all(line.isprintable() for line in value.split("\n")):
            raise ModelError(f"expected sentences, got {described(value)}", number="M103")
        return value.strip()

    def tree(self, value: str) -> str:
        return value


@dataclass(frozen=True)
class Choice:
    """One of a few words; `meant`, pairs of a word that others use and the one for it here."""

    words: tuple[str, ...]
    meant: tuple[tuple[str, str], ...] = ()

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or value not in self.words:
            word, meant = str(value), dict(self.meant).get(str(value).lower())
            told = f"{described(value)} is no choice here"
            raise ModelError(told, number="M104", word=word, known=self.words, meant=meant)
        return str(value)

    def tree(self, value: str) -> str:
        return value


@dataclass(frozen=True)
class Flag:
    """true or false."""

    def accept(self, value: Any) -> bool:
        if isinstance(value, bool):
            return value
        if is_text(value, "true", "false"):
            return bool(value == "true")
        raise ModelError(f"expected true or false, got {described(value)}", number="M103")

    def tree(self, value: bool) -> str:
        return "true" if value else "false"


@dataclass(frozen=True)
class Flags:
    """true or false, or a list of these in which `null` (None) is false; a list is held as a tuple."""

    def accept(self, value: Any) -> bool | tuple[bool, ...]:
        if not isinstance(value, (list, tuple)):
            return Flag().accept(value)
        return tuple(not is_gap(x) and content_of(i, x, Flag()) for i, x in enumerate(value))

    def tree(self, value: bool | tuple[bool, ...]) -> Any:
        return Flag().tree(value) if isinstance(value, bool) else [Flag().tree(x) for x in value]


@dataclass(frozen=True)
class Count:
    """A whole number, at least `least`."""

    least: int = 1

    def accept(self, value: Any) -> int:
        node = scalar(value, None)
        if node.op != "number" or not isinstance(node.data, int) or node.data < self.least:
            raise ModelError(f"expected a whole number, at least {self.least}, got {described(value)}", number="M103")
        return node.data

    def tree(self, value: int) -> str:
        return str(value)


def content_of(index: int, value: Any, field: Field) -> Any:
    """Return what `field` holds of item number `index`, which an error is placed at."""
    with at(index):
        return field.accept(value)


def listed(value: Any) -> list[Any] | None:
    """Return the items of a list, tuple, vector or the like in their order, None for what has none."""
    if isinstance(value, (str, bytes)) or not (isinstance(value, Sequence) or hasattr(value, "tolist")):
        return None
    try:
        return list(value)
    except TypeError:  # an array without dimensions
        return None


def is_text(value: object, *words: str) -> bool:
    """Return whether a value, which may be an array that compares item by item, is one of some words."""
    return isinstance(value, str) and value in words


def is_gap(value: object) -> bool:
    """Return whether a place in a list is left out."""
    return value is None or is_text(value, *_GAP)


def is_empty(value: object) -> bool:
    """Return whether nothing was written; a file holds that as an empty text."""
    return value is None or (isinstance(value, str) and not value)
