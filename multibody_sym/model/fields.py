"""What a field may hold where that is a number, a direction or a word: how it is read, and how it is written back."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, ItemsView, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Final, Protocol, Self

from multibody_sym.errors import ArgumentError, ModelError, at, short_repr
from multibody_sym.model.argument_checks import as_meant, verify_arguments
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import node_of
from multibody_sym.scalars.node import ONE, ZERO, Node, negate, number
from multibody_sym.scalars.sign_changes import is_condition
from multibody_sym.text.parser import parse_scalar
from multibody_sym.text.printer import text
from multibody_sym.text.tokens import plain_number
from multibody_sym.text.units import DIMENSIONLESS, Dimension, parse_unit

Point = tuple[Node, Node, Node]
AXES = ("x", "y", "z")
QUATERNION = ("w", *AXES)
_NOTHING = "null"
_EQUATION = re.compile(r"(?<![<>!])=(?![<>])")
_GAP = ("", _NOTHING, "~")
"""What a file holds where a list leaves a place out."""


class Field(Protocol):
    """What a field may hold."""

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
            raise ModelError(f"expected a number or an expression, got {describe(value)}", number="M103") from None
    if (plain := plain_number(value)) is not None:
        return number(plain)
    node, dimension = parse_scalar(value)
    if dimension is not None and unit is not None and dimension != dimension_of_unit(unit):
        raise ModelError(
            f"{describe(value)} does not fit here: expected a quantity in {unit or 'no unit'}", number="M105"
        )
    return node


@cache
def dimension_of_unit(unit: str) -> Dimension:
    """Return the dimension of a unit's text; an empty text stands for a pure number."""
    return parse_unit(unit)[1] if unit else DIMENSIONLESS


def describe(value: object) -> str:
    """Return the words for a wrong value in an error."""
    if isinstance(value, Mapping):
        return "a map"
    if isinstance(value, (list, tuple)):
        return "a list"
    return "nothing" if is_empty(value) else short_repr(value)


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
            raise ModelError(f"expected a comparison such as y < 0, got {describe(value)}", number="M103")
        if node.shadow is not None:
            raise ModelError(f"{describe(value)} compares two constants; name something that changes")
        return node

    def tree(self, value: Node) -> str:
        return text(value)


def _not_three(value: Any, items: list[Any] | None) -> str:
    """Return the words for a value where a list of three is wanted, and how to mend it; `items` are those of a list."""
    if items is None:
        is_one = isinstance(value, (int, float, str)) and not is_empty(value)
        along = f"; along x it is [{value}, 0, 0], along y [0, {value}, 0]" if is_one else ""
        return f"{describe(value)}{along}"
    if len(items) > 3 and all(isinstance(x, str) for x in items):
        return f"a list of {len(items)}; numbers have a decimal point, 0.5, as a comma begins the next entry"
    if len(items) == 1 and isinstance(items[0], str):
        return "a list of 1; commas stand between the components, [x, y, z]"
    return f"a list of {len(items)}" + ("; of vectors in the x-y plane the third is 0" if len(items) == 2 else "")


def _scalars(items: Sequence[Any], unit: str | None) -> tuple[Node, ...]:
    return tuple(content_of(i, x, Scalar(unit)) for i, x in enumerate(items))


@dataclass(frozen=True)
class Vector:
    """Three numbers or expressions."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node, Node, Node]:
        items = list_items(value)
        if items is None or len(items) != 3:
            raise ModelError(
                f"expected a list of three numbers or expressions, got {_not_three(value, items)}", number="M103"
            )
        x, y, z = _scalars(items, self.unit)
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
                    f"{describe(value)} is no direction: write x, y, z, -x, -y, -z or a list of three", number="M103"
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
        return [text(component) for component in value] if isinstance(value, tuple) else text(value)


@dataclass(frozen=True)
class Scalars:
    """One number or expression, or a list of any length; held as a tuple."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node, ...]:
        if isinstance(value, (list, tuple)):
            return _scalars(value, self.unit)
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
            advice = "; give a place a name under points of its body: points: {NAME: [x, y, z]}"
            message = f"expected a name, got {describe(value)}{advice if list_items(value) else ''}"
            raise ModelError(message, number="M103")
        return value.strip()

    def tree(self, value: str) -> str:
        return value


@dataclass(frozen=True)
class Prose(Text):
    """Sentences, in lines and paragraphs as they are written."""

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or not value.strip() or not all(line.isprintable() for line in value.split("\n")):
            raise ModelError(f"expected sentences, got {describe(value)}", number="M103")
        return value.strip()


@dataclass(frozen=True)
class Choice(Text):
    """One of a few words; `meant`, pairs of a word that others use and the one for it here."""

    words: tuple[str, ...]
    meant: tuple[tuple[str, str], ...] = ()

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or value not in self.words:
            word, meant = str(value), dict(self.meant).get(str(value).lower())
            message = f"{describe(value)} is no choice here"
            raise ModelError(message, number="M104", word=word, known=self.words, meant=meant)
        return str(value)


@dataclass(frozen=True)
class Flag:
    """true or false."""

    def accept(self, value: Any) -> bool:
        if isinstance(value, bool):
            return value
        if is_text(value, "true", "false"):
            return bool(value == "true")
        raise ModelError(f"expected true or false, got {describe(value)}", number="M103")

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
            raise ModelError(f"expected a whole number, at least {self.least}, got {describe(value)}", number="M103")
        return node.data

    def tree(self, value: int) -> str:
        return str(value)


def content_of(index: int, value: Any, field: Field) -> Any:
    """Return the content that `field` makes of item number `index`; errors name the index."""
    with at(index):
        return field.accept(value)


def list_items(value: Any) -> list[Any] | None:
    """Return the items of a list, tuple or array in their order; None for a value without items."""
    if isinstance(value, (str, bytes)) or not (isinstance(value, Sequence) or hasattr(value, "tolist")):
        return None
    try:
        return list(value)
    except TypeError:  # an array without dimensions
        return None


def is_text(value: object, *words: str) -> bool:
    """Return whether a value is one of some words; an array, which compares item by item, is none."""
    return isinstance(value, str) and value in words


def is_gap(value: object) -> bool:
    """Return whether a place in a list is left out."""
    return value is None or is_text(value, *_GAP)


def is_empty(value: object) -> bool:
    """Return whether a value is None or the empty text, by which a file says nothing."""
    return value is None or (isinstance(value, str) and not value)


# ----------------------------------------------------------------------------------------------------------------------
# Fields of elements: lists, maps and records of values, and the elements that are made of fields.


@dataclass(frozen=True)
class ListOf:
    """A list, held as a tuple; `least` and `most` bound its length. One item may stand without brackets."""

    item: Field
    least: int = 0
    most: int | None = None

    def accept(self, value: Any) -> tuple[Any, ...]:
        items = list(value) if isinstance(value, (list, tuple)) else [value]
        if len(items) < self.least or (self.most is not None and len(items) > self.most):
            wanted = str(self.least) if self.least == self.most else f"at least {self.least}"
            raise ModelError(f"expected a list of {wanted}, got {len(items)}", number="M103")
        return tuple(content_of(i, x, self.item) for i, x in enumerate(items))

    def tree(self, value: tuple[Any, ...]) -> list[Any]:
        return [self.item.tree(x) for x in value]


@dataclass(frozen=True)
class MapOf:
    """A map from names to contents, in the order in which they were written; equality includes that order."""

    item: Field

    def accept(self, value: Any) -> Mapping[str, Any]:
        if is_empty(value):
            return Names()
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map of names, got {describe(value)}{_map_advice(value)}", number="M103")
        content = {}
        for name, x in value.items():
            with at(name):
                content[Text().accept(name)] = self.item.accept(x)
        return Names(content)

    def tree(self, value: Mapping[str, Any]) -> dict[str, Any]:
        return {name: self.item.tree(x) for name, x in value.items()}


def _map_advice(value: Any) -> str:
    """Return the advice how to write a text or a list of elements as a map of names."""
    if isinstance(value, str):
        return f"; write it under a name: {{NAME: {value}}}"
    first = value[0] if isinstance(value, (list, tuple)) and value else None
    if not isinstance(first, Mapping) or not first:
        return ""
    given = first.get("name")
    name = given if isinstance(given, str) else next(iter(first)) if len(first) == 1 else "NAME"
    return f"; write each under its name, without dashes: {{{name}: {{..}}}}"


@dataclass(frozen=True)
class OneOrMap:
    """A map from names to contents, or one content for all names, which is held under the empty name."""

    item: Field

    def accept(self, value: Any) -> Mapping[str, Any]:
        if isinstance(value, Mapping) or is_empty(value):
            return value if isinstance(value, Names) else MapOf(self.item).accept(value)
        return Names({"": self.item.accept(value)})

    def tree(self, value: Mapping[str, Any]) -> Any:
        return self.item.tree(value[""]) if "" in value else MapOf(self.item).tree(value)


class Names(Mapping[str, Any]):
    """A read-only map whose equality includes the order of its names (order decides the order of coordinates)."""

    __slots__ = ("_content",)

    def __init__(self, content: Mapping[str, Any] | None = None) -> None:
        self._content = MappingProxyType(dict(content or {}))

    def __getitem__(self, name: str) -> Any:
        return self._content[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    def items(self) -> ItemsView[str, Any]:
        return self._content.items()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Names) and list(self.items()) == list(other.items())

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __reduce__(self) -> tuple[type[Names], tuple[dict[str, Any]]]:
        return Names, (dict(self._content),)

    def __repr__(self) -> str:
        return repr(dict(self._content))


@dataclass(frozen=True)
class Record:
    """An element of one class, written as a map of its fields."""

    cls: type[Element]

    def accept(self, value: Any) -> Element:
        if isinstance(value, self.cls):
            return value
        if not isinstance(value, Mapping):
            such = next((f"{{{f.name}: {f.metadata['such']}}}" for f in fields(self.cls) if f.metadata["such"]), "")
            raise ModelError(
                f"expected a map with {', '.join(fields_of(self.cls))}{such and ', such as ' + such}, "
                f"got {describe(value)}",
                number="M103",
            )
        return from_fields(self.cls, value)

    def tree(self, value: Element) -> dict[str, Any]:
        return fields_tree(value)


@dataclass(frozen=True)
class OneOf:
    """An element of one of several classes, chosen by its `type` key; `meant` of types as `Element.meant` of keys."""

    table: Mapping[str, type[Element]]
    aliases: Mapping[str, str]
    meant: Mapping[str, str]

    def accept(self, value: Any) -> Element:
        if isinstance(value, Element) and isinstance(value, tuple(self.table.values())):
            return value
        if not isinstance(value, Mapping):
            raise ModelError(
                f"expected a map with a type ({', '.join(self.table)}), got {describe(value)}", number="M103"
            )
        if "type" not in value:
            verify_keys(value, {"type", *(name for cls in self.table.values() for name in fields_of(cls))})
            raise ModelError(f"type is missing; known: {', '.join(self.table)}", number="M102")
        return from_fields(self._class(value["type"]), {k: v for k, v in value.items() if k != "type"})

    def _class(self, word: Any) -> type[Element]:
        name = self.aliases.get(word, word) if isinstance(word, str) else word
        if not isinstance(name, str) or name not in self.table:
            with at("type"):
                advice, members = as_meant(str(word), [*self.table, *self.aliases], self.meant)
                raise ModelError(f"{describe(word)} is no known type{advice}", number="M104", **members)
        return self.table[name]

    def tree(self, value: Element) -> dict[str, Any]:
        kind = next(name for name, cls in self.table.items() if type(value) is cls)
        return {"type": kind, **fields_tree(value)}


_UNITLESS: Final = (Scalar, Scalars, OptionalScalars, ScalarOrVector)
TEXTS: Final = "_texts"
"""The attribute in which an element keeps the given texts of fields that take any unit; no field, it never compares."""


@dataclass(frozen=True)
class Element:
    """Base of declared records: each Field converts the value given for it when the record is made.

    `meant`: for wrong keys that people write and that no likeness explains, the right key, or advice.
    """

    meant: ClassVar[Mapping[str, str]] = {}

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        """Yield the contents of given fields: the path in a file, the content, and the unit in which it is read."""
        kind: Any = type(self)
        for name, field, unit in _contents(kind):
            value = getattr(self, name)
            if value is None:
                continue
            keys: tuple[str, ...] | None = getattr(field, "keys", None)
            if type(value) is tuple and keys is not None:
                yield from (((name, key), x, unit) for key, x in zip(keys, value, strict=True))
            elif type(value) is tuple and len(value) == 1 and isinstance(field, (Scalars, OptionalScalars)):
                yield (name,), value[0], unit  # one number stands without a list
            else:
                yield (name,), value, unit

    def __post_init__(self) -> None:
        texts: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            with at(key_of(f.name)):
                if value is None and f.default is MISSING:
                    raise ModelError("it is missing", number="M102")
                value = f.default if value is None else value
                if value is not None:
                    field = f.metadata["field"]
                    object.__setattr__(self, f.name, field.accept(value))
                    numbers = isinstance(field, _UNITLESS) or isinstance(getattr(field, "item", None), Scalar)
                    if (numbers or getattr(field, "of_any_unit", False)) and not unit_of(field):
                        texts[f.name] = value
        object.__setattr__(self, TEXTS, texts)
        self.verify()

    @classmethod
    def verify_call(cls, values: Sequence[Any], named: Mapping[str, Any]) -> None:
        """Raise ArgumentError where the call lacks arguments, or has unknown or surplus ones."""
        every = fields(cls)
        verify_arguments(
            cls.__name__,
            "field",
            {f.name: f"{f.name}, {f.metadata['says']}" for f in every if f.default is MISSING},
            [f.name for f in every if not f.kw_only],
            [f.name for f in every],
            values,
            named,
            cls.meant,
        )

    def verify_unit(self, name: str, units: str | Sequence[str]) -> None:
        """Raise ModelError where the field `name` was given in another unit than `units`: one for all, or one for each.

        For fields whose unit depends on other fields. A content has no unit; only the given texts state one.
        """
        given = getattr(self, TEXTS).get(name)
        with at(name):
            if isinstance(given, str) and not is_gap(given):
                scalar(given, units if isinstance(units, str) else units[0])
            elif isinstance(given, (list, tuple)):
                each = [units] * len(given) if isinstance(units, str) else units
                for i, (x, unit) in enumerate(zip(given, each, strict=True)):
                    if isinstance(x, str) and not is_gap(x):
                        content_of(i, x, Scalar(unit))
            elif isinstance(given, Mapping):
                for key, x in given.items():
                    content_of(key, x, Scalar(units if isinstance(units, str) else units[0]))

    def given(self, name: str) -> Any:
        """Return the value given for a field that takes any unit, as it was written; None for other fields."""
        return getattr(self, TEXTS).get(name)

    def with_fields(self, changed: Mapping[str, Any]) -> Self:
        """Return the element with other contents of fields; the texts of constants stay."""
        new = dataclasses.replace(self, **changed)
        object.__setattr__(new, TEXTS, getattr(self, TEXTS))
        return new

    def verify(self) -> None:
        """Raise ModelError where the fields contradict each other."""


def holds(field: Field, default: Any = MISSING, *, keyword: bool = False, says: str = "", such: str = "") -> Any:
    """Declare a field of an element, and its entry in the reference.

    Without a default it must be given; by keyword only if it is marked so or its class is `kw_only`. `says` is its
    meaning in one sentence; `such` is an example as a model file writes it.
    """
    only: Any = keyword or MISSING
    return dataclasses.field(default=default, kw_only=only, metadata={"field": field, "says": says, "such": such})


def fields_of(cls: type[Element]) -> dict[str, Field]:
    return {f.name: f.metadata["field"] for f in fields(cls)}


@cache
def _contents(cls: Any) -> tuple[tuple[str, Field, str | None], ...]:
    """Return names and fields of an element class with their units (kept: large models ask for every element)."""
    return tuple((name, field, unit_of(field)) for name, field in fields_of(cls).items())


def key_of(name: str) -> str:
    """Return the key of a field in files; the field of a key that Python reserves ends with `_`."""
    return name.removesuffix("_")


def holds_vectors(cls: type[Element]) -> bool:
    """Return whether an element, or a record in it, has a field for three components."""
    return any(_is_vector(field) for field in fields_of(cls).values())


def _is_vector(field: Any) -> bool:
    if isinstance(field, Record):
        return holds_vectors(field.cls)
    item = getattr(field, "item", None)
    return isinstance(field, Vector | Direction | ScalarOrVector) or (item is not None and _is_vector(item))


def unit_of(field: Field) -> str | None:
    """Return the unit that a field's expressions are read in, None where any fits."""
    unit: str | None = getattr(field, "unit", None)
    item = getattr(field, "item", None)
    return unit if item is None else unit_of(item)


def verify_keys(keys: Iterable[str], known: Collection[str], meant: Mapping[str, str] | None = None) -> None:
    """Raise ModelError at the first key that is not known; `meant` as `Element.meant`."""
    for key in keys:
        if key not in known:
            with at(key):
                advice, members = as_meant(str(key), known, meant)
                raise ModelError(f"unknown key {key!r}{advice}", number="M101", **members)


def from_fields(cls: type[Element], tree: Mapping[str, Any]) -> Element:
    """Return the element that a map of fields describes; unknown and missing fields are errors."""
    known = fields_of(cls)
    verify_keys(tree, known, cls.meant)
    missing = [f for f in fields(cls) if f.default is MISSING and is_empty(tree.get(f.name))]
    if missing:
        message = f"{' and '.join(f.name for f in missing)} {'are' if missing[1:] else 'is'} missing"
        meanings = []
        for f in missing:
            if says := f.metadata["says"]:
                such = f.metadata["such"]
                meanings.append(f"{says}, such as {f.name}: {such}" if such else says)
        if meanings:
            message = f"{message}: {'; '.join(meanings)}"
        raise ModelError(message, number="M102", word=missing[0].name)
    for key, value in tree.items():
        if isinstance(value, str) and not value and not isinstance(known[key], MapOf):
            with at(key):
                raise ModelError(f"{key} is empty: write what it is, or leave it out", number="M102")
    return cls(**tree)


def fields_tree(element: Element) -> dict[str, Any]:
    """Return the fields of an element that differ from their defaults, as a file holds them."""
    tree = {}
    for f in fields(element):
        value, field = getattr(element, f.name), f.metadata["field"]
        default = None if f.default is MISSING or f.default is None else field.accept(f.default)
        empty = isinstance(value, Mapping) and not value
        if value is not None and value != default and not empty:
            tree[f.name] = field.tree(value)
    return tree
