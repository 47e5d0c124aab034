"""Slots: what one field of an element holds, how it is read from what users write, and how it is written back."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from types import MappingProxyType
from typing import Any, Protocol

from multibody_sym.errors import ArgumentError, ModelError, at, shown, suggestion
from multibody_sym.expressions.parser import parse_scalar
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.units import DIMENSIONLESS, Dimension, parse_unit
from multibody_sym.scalars.functions import node_of
from multibody_sym.scalars.kinks import is_condition
from multibody_sym.scalars.node import ONE, ZERO, Node, negate

AXES = ("x", "y", "z")
_NOTHING = "null"


class Slot(Protocol):
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
            raise ModelError(f"expected a number or an expression, got {described(value)}") from None
    node, dimension = parse_scalar(value)
    if dimension is not None and unit is not None and dimension != dimension_of_unit(unit):
        raise ModelError(f"{described(value)} does not fit here: expected a quantity in {unit or 'no unit'}")
    return node


def dimension_of_unit(unit: str) -> Dimension:
    """Return the dimension of a unit's text, the empty text standing for a pure number."""
    return parse_unit(unit)[1] if unit else DIMENSIONLESS


def described(value: object) -> str:
    """Return what a wrong value is, in a user's words."""
    if isinstance(value, Mapping):
        return "a map"
    if isinstance(value, (list, tuple)):
        return "a list"
    return "nothing" if _is_empty(value) else shown(value)


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
        node = scalar(value, self.unit)
        if not is_condition(node):
            raise ModelError(f"expected a comparison such as y < 0, got {described(value)}")
        if node.shadow is not None:
            raise ModelError(f"{described(value)} compares two constants; name something that changes")
        return node

    def tree(self, value: Node) -> str:
        return text(value)


@dataclass(frozen=True)
class Vector:
    """Three numbers or expressions."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node, Node, Node]:
        items = listed(value)
        if items is None or len(items) != 3:
            raise ModelError(f"expected a list of three numbers or expressions, got {described(value)}")
        x, y, z = (_item(i, component, Scalar(self.unit)) for i, component in enumerate(items))
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
                raise ModelError(f"{described(value)} is no direction: write x, y, z, -x, -y, -z or a list of three")
            unit = negate(ONE) if negative else ONE
            x, y, z = (unit if axis == letter else ZERO for axis in AXES)
            return x, y, z
        vector = Vector(None).accept(value)
        if all(component.shadow == 0 for component in vector):
            raise ModelError("a direction cannot be zero")
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
            return tuple(_item(i, component, Scalar(self.unit)) for i, component in enumerate(value))
        return (scalar(value, self.unit),)

    def tree(self, value: tuple[Node, ...]) -> Any:
        return text(value[0]) if len(value) == 1 else [text(component) for component in value]


@dataclass(frozen=True)
class OptionalScalars:
    """One number or expression, or a list in which `null` (None) leaves a place out; held as a tuple."""

    unit: str | None = None

    def accept(self, value: Any) -> tuple[Node | None, ...]:
        items = value if isinstance(value, (list, tuple)) else (value,)
        left_out = [x is None or is_text(x, "", _NOTHING) for x in items]
        return tuple(None if left_out[i] else _item(i, x, Scalar(self.unit)) for i, x in enumerate(items))

    def tree(self, value: tuple[Node | None, ...]) -> Any:
        written = [_NOTHING if x is None else text(x) for x in value]
        return written[0] if len(written) == 1 else written


@dataclass(frozen=True)
class Text:
    """A name or a reference such as `rod.pin`."""

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            raise ModelError(f"expected a name, got {described(value)}")
        return value.strip()

    def tree(self, value: str) -> str:
        return value


@dataclass(frozen=True)
class Choice:
    """One of a few words."""

    words: tuple[str, ...]

    def accept(self, value: Any) -> str:
        if not isinstance(value, str) or value not in self.words:
            raise ModelError(f"{described(value)} is no choice here{suggestion(str(value), self.words)}")
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
        raise ModelError(f"expected true or false, got {described(value)}")

    def tree(self, value: bool) -> str:
        return "true" if value else "false"


@dataclass(frozen=True)
class Count:
    """A whole number, at least `least`."""

    least: int = 1

    def accept(self, value: Any) -> int:
        node = scalar(value, None)
        if node.op != "number" or not isinstance(node.data, int) or node.data < self.least:
            raise ModelError(f"expected a whole number, at least {self.least}, got {described(value)}")
        return node.data

    def tree(self, value: int) -> str:
        return str(value)


@dataclass(frozen=True)
class ListOf:
    """A list, held as a tuple; `least` and `most` bound its length. One item may stand without brackets."""

    item: Slot
    least: int = 0
    most: int | None = None

    def accept(self, value: Any) -> tuple[Any, ...]:
        items = list(value) if isinstance(value, (list, tuple)) else [value]
        if len(items) < self.least or (self.most is not None and len(items) > self.most):
            wanted = str(self.least) if self.least == self.most else f"at least {self.least}"
            raise ModelError(f"expected a list of {wanted}, got {len(items)}")
        return tuple(_item(i, x, self.item) for i, x in enumerate(items))

    def tree(self, value: tuple[Any, ...]) -> list[Any]:
        return [self.item.tree(x) for x in value]


@dataclass(frozen=True)
class MapOf:
    """A map from names to contents, in the order in which they were written; equality includes that order."""

    item: Slot

    def accept(self, value: Any) -> Mapping[str, Any]:
        if _is_empty(value):
            return Names()
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map of names, got {described(value)}")
        content = {}
        for name, x in value.items():
            with at(name):
                content[Text().accept(name)] = self.item.accept(x)
        return Names(content)

    def tree(self, value: Mapping[str, Any]) -> dict[str, Any]:
        return {name: self.item.tree(x) for name, x in value.items()}


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

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Names) and list(self.items()) == list(other.items())

    def __hash__(self) -> int:
        return hash(tuple(self))

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
            raise ModelError(f"expected a map with {', '.join(slots_of(self.cls))}, got {described(value)}")
        return from_fields(self.cls, value)

    def tree(self, value: Element) -> dict[str, Any]:
        return fields_tree(value)


@dataclass(frozen=True)
class OneOf:
    """An element of one of several classes, chosen by its `type` key."""

    table: Mapping[str, type[Element]]
    aliases: Mapping[str, str]

    def accept(self, value: Any) -> Element:
        if isinstance(value, Element) and type(value) in self.table.values():
            return value
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map with a type ({', '.join(self.table)}), got {described(value)}")
        if "type" not in value:
            raise ModelError(f"type is missing; known: {', '.join(self.table)}")
        return from_fields(self._class(value["type"]), {k: v for k, v in value.items() if k != "type"})

    def _class(self, word: Any) -> type[Element]:
        name = self.aliases.get(word, word) if isinstance(word, str) else word
        if not isinstance(name, str) or name not in self.table:
            with at("type"):
                known = [*self.table, *self.aliases]
                raise ModelError(f"{described(word)} is no known type{suggestion(str(word), known)}")
        return self.table[name]

    def tree(self, value: Element) -> dict[str, Any]:
        kind = next(name for name, cls in self.table.items() if type(value) is cls)
        return {"type": kind, **fields_tree(value)}


def _item(index: int, value: Any, slot: Slot) -> Any:
    with at(index):
        return slot.accept(value)


# --- elements: frozen dataclasses whose fields are slots -----------------------------------------------------------


@dataclass(frozen=True)
class Element:
    """A frozen record whose fields read themselves through their slots when it is made."""

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        """Yield the contents of the fields: the steps that lead to each in a file, it, and the unit it is read in."""
        for name, slot in slots_of(type(self)).items():
            value, unit = getattr(self, name), unit_of(slot)
            steps = _steps_of(slot, value)
            if steps is None:
                yield (name,), value, unit
            else:
                yield from (((name, *step), x, unit) for step, x in zip(steps, value, strict=True))

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            with at(f.name):
                if value is None and f.default is MISSING:
                    raise ModelError("it is missing")
                value = f.default if value is None else value
                if value is not None:
                    object.__setattr__(self, f.name, f.metadata["slot"].accept(value))
        self.verify()

    def verify(self) -> None:
        """Raise ModelError where the fields contradict each other."""


def holds(slot: Slot, default: Any = MISSING, *, keyword: bool = False) -> Any:
    """Declare a dataclass field that holds `slot`.

    Without a default it must be given; by keyword only if it is marked so or its class is `kw_only`.
    """
    only: Any = keyword or MISSING
    return field(default=default, kw_only=only, metadata={"slot": slot})


def slots_of(cls: type[Element]) -> dict[str, Slot]:
    """Return the fields of an element class, each with its slot."""
    return {f.name: f.metadata["slot"] for f in fields(cls)}


def _steps_of(slot: Slot, value: Any) -> list[tuple[str, ...]] | None:
    """Return under which steps a file holds the items of a tuple, where that is not by their numbers."""
    if not isinstance(value, tuple):
        return None
    keys: tuple[str, ...] | None = getattr(slot, "keys", None)
    if keys is not None:
        return [(key,) for key in keys]
    return [()] if len(value) == 1 and isinstance(slot, (Scalars, OptionalScalars)) else None


def unit_of(slot: Slot) -> str | None:
    """Return the unit that a slot's expressions are read in, None where any fits."""
    unit: str | None = getattr(slot, "unit", None)
    item = getattr(slot, "item", None)
    return unit if item is None else unit_of(item)


def from_fields(cls: type[Element], tree: Mapping[str, Any]) -> Element:
    """Return the element that a map of fields describes; unknown and missing fields are errors."""
    known = slots_of(cls)
    for key in tree:
        if key not in known:
            with at(key):
                raise ModelError(f"unknown key {key!r}{suggestion(str(key), known)}")
    for f in fields(cls):
        if f.default is MISSING and _is_empty(tree.get(f.name)):
            raise ModelError(f"{f.name} is missing")
    for key, value in tree.items():
        if isinstance(value, str) and not value and not isinstance(known[key], MapOf):
            with at(key):
                raise ModelError(f"{key} is empty: write what it is, or leave it out")
    return cls(**tree)


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


def _is_empty(value: object) -> bool:
    """Return whether nothing was written; a file holds that as an empty text."""
    return value is None or (isinstance(value, str) and not value)


def fields_tree(element: Element) -> dict[str, Any]:
    """Return the fields of an element that differ from their defaults, as a file holds them."""
    tree = {}
    for f in fields(element):
        value, slot = getattr(element, f.name), f.metadata["slot"]
        default = None if f.default is MISSING or f.default is None else slot.accept(f.default)
        empty = isinstance(value, Mapping) and not value
        if value is not None and value != default and not empty:
            tree[f.name] = slot.tree(value)
    return tree
