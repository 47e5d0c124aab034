"""What a field may hold where that is a number, a direction or a word: how it is read, and how it is written back."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, ItemsView, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Final, Protocol, Self

from multibody_sym.errors import ArgumentError, ModelError, at, shown
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
            raise ModelError(f"expected a map of names, got {described(value)}{_named_list(value)}", number="M103")
        content = {}
        for name, x in value.items():
            with at(name):
                content[Text().accept(name)] = self.item.accept(x)
        return Names(content)

    def tree(self, value: Mapping[str, Any]) -> dict[str, Any]:
        return {name: self.item.tree(x) for name, x in value.items()}


def _named_list(value: Any) -> str:
    """Return how to write as a map what has no name, or a list of elements, each with its name in it or before it."""
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
                f"got {described(value)}",
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
                f"expected a map with a type ({', '.join(self.table)}), got {described(value)}", number="M103"
            )
        if "type" not in value:
            verify_keys(value, {"type", *(name for cls in self.table.values() for name in fields_of(cls))})
            raise ModelError(f"type is missing; known: {', '.join(self.table)}", number="M102")
        return from_fields(self._class(value["type"]), {k: v for k, v in value.items() if k != "type"})

    def _class(self, word: Any) -> type[Element]:
        name = self.aliases.get(word, word) if isinstance(word, str) else word
        if not isinstance(name, str) or name not in self.table:
            with at("type"):
                advice, right = as_meant(str(word), [*self.table, *self.aliases], self.meant)
                raise ModelError(f"{described(word)} is no known type{advice}", number="M104", **right)
        return self.table[name]

    def tree(self, value: Element) -> dict[str, Any]:
        kind = next(name for name, cls in self.table.items() if type(value) is cls)
        return {"type": kind, **fields_tree(value)}


_UNITLESS: Final = (Scalar, Scalars, OptionalScalars, ScalarOrVector)
TEXTS: Final = "_texts"
"""Where an element keeps what those of its fields were given that any unit fits; no field, so that it never counts."""


@dataclass(frozen=True)
class Element:
    """A frozen record that reads what its fields are given when it is made.

    `meant`: of keys that people write in their place, and that no likeness leads to, the right one, or advice.
    """

    meant: ClassVar[Mapping[str, str]] = {}

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        """Yield what given fields hold: the steps that lead to it in a file, it, and the unit that it is read in."""
        kind: Any = type(self)
        for name, field, unit in _contents(kind):
            value = getattr(self, name)
            if value is None:
                continue
            steps = _steps_of(field, value) if type(value) is tuple else None
            if steps is None:
                yield (name,), value, unit
            else:
                yield from (((name, *step), x, unit) for step, x in zip(steps, value, strict=True))

    def __post_init__(self) -> None:
        texts: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            with at(f.name):
                if value is None and f.default is MISSING:
                    raise ModelError("it is missing", number="M102")
                value = f.default if value is None else value
                if value is not None:
                    field = f.metadata["field"]
                    object.__setattr__(self, f.name, field.accept(value))
                    if _fits_any_unit(field):
                        texts[f.name] = value
        object.__setattr__(self, TEXTS, texts)
        self.verify()

    @classmethod
    def verify_call(cls, values: Sequence[Any], named: Mapping[str, Any]) -> None:
        """Raise ArgumentError where an element cannot be made of these arguments, whatever they are."""
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

        For fields whose unit depends on others; what was read no longer tells its unit, and only texts state one.
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
        """Return what a field was given as it was written, if any unit fits the field; None for other fields."""
        return getattr(self, TEXTS).get(name)

    def with_fields(self, changed: Mapping[str, Any]) -> Self:
        """Return the element with other contents of fields, of which constants are as they were given."""
        new = dataclasses.replace(self, **changed)
        object.__setattr__(new, TEXTS, getattr(self, TEXTS))
        return new

    def verify(self) -> None:
        """Raise ModelError where the fields contradict each other."""


def holds(field: Field, default: Any = MISSING, *, keyword: bool = False, says: str = "", such: str = "") -> Any:
    """Declare a field of an element, and what the reference says of it.

    Without a default it must be given; by keyword only if it is marked so or its class is `kw_only`. `says` what it
    means in one plain sentence; `such` is an example of it as a model file writes it.
    """
    only: Any = keyword or MISSING
    told = {"field": field, "says": says, "such": such}
    return dataclasses.field(default=default, kw_only=only, metadata=told)


def fields_of(cls: type[Element]) -> dict[str, Field]:
    """Return the fields of an element class by name."""
    return {f.name: f.metadata["field"] for f in fields(cls)}


@cache
def _contents(cls: Any) -> tuple[tuple[str, Field, str | None], ...]:
    """Return names and fields of an element class with their units; large models ask for every element."""
    return tuple((name, field, unit_of(field)) for name, field in fields_of(cls).items())


def holds_vectors(cls: type[Element]) -> bool:
    """Return whether an element, or a record in it, has a field for three components."""
    return any(_is_vector(field) for field in fields_of(cls).values())


def _is_vector(field: Any) -> bool:
    if isinstance(field, Record):
        return holds_vectors(field.cls)
    item = getattr(field, "item", None)
    return isinstance(field, Vector | Direction | ScalarOrVector) or (item is not None and _is_vector(item))


def _steps_of(field: Field, value: tuple[Any, ...]) -> list[tuple[str, ...]] | None:
    """Return under which steps a file holds the items of a tuple, where that is not by their numbers."""
    keys: tuple[str, ...] | None = getattr(field, "keys", None)
    if keys is not None:
        return [(key,) for key in keys]
    return [()] if len(value) == 1 and isinstance(field, (Scalars, OptionalScalars)) else None


def unit_of(field: Field) -> str | None:
    """Return the unit that a field's expressions are read in, None where any fits."""
    unit: str | None = getattr(field, "unit", None)
    item = getattr(field, "item", None)
    return unit if item is None else unit_of(item)


def _fits_any_unit(field: Field) -> bool:
    """Return whether a field holds numbers whose unit depends on other fields, or angles."""
    numbers = isinstance(field, _UNITLESS) or isinstance(getattr(field, "item", None), Scalar)
    return (numbers or getattr(field, "of_any_unit", False)) and not unit_of(field)


def verify_keys(keys: Iterable[str], known: Collection[str], meant: Mapping[str, str] | None = None) -> None:
    """Raise ModelError at the first key that is not known; `meant` as `Element.meant`."""
    for key in keys:
        if key not in known:
            with at(key):
                advice, right = as_meant(str(key), known, meant)
                raise ModelError(f"unknown key {key!r}{advice}", number="M101", **right)


def from_fields(cls: type[Element], tree: Mapping[str, Any]) -> Element:
    """Return the element that a map of fields describes; unknown and missing fields are errors."""
    known = fields_of(cls)
    verify_keys(tree, known, cls.meant)
    missing = [f for f in fields(cls) if f.default is MISSING and is_empty(tree.get(f.name))]
    if missing:
        told = f"{' and '.join(f.name for f in missing)} {'are' if missing[1:] else 'is'} missing"
        means = "; ".join(f"{f.metadata['says']}{_example(f)}" for f in missing if f.metadata["says"])
        raise ModelError(f"{told}{': ' if means else ''}{means}", number="M102", word=missing[0].name)
    for key, value in tree.items():
        if isinstance(value, str) and not value and not isinstance(known[key], MapOf):
            with at(key):
                raise ModelError(f"{key} is empty: write what it is, or leave it out", number="M102")
    return cls(**tree)


def _example(f: dataclasses.Field[Any]) -> str:
    """Return a field as the reference writes it in an example."""
    return f", such as {f.name}: {f.metadata['such']}" if f.metadata["such"] else ""


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
