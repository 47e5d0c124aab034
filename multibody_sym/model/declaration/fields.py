"""Fields of elements: lists, maps and records of values, and the elements that are made of fields."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, ItemsView, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Final, Self

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.doors import as_meant, verify_arguments
from multibody_sym.model.declaration.values import (
    Direction,
    Field,
    OptionalScalars,
    Scalar,
    ScalarOrVector,
    Scalars,
    Text,
    Vector,
    content_of,
    described,
    is_empty,
    is_gap,
    scalar,
)
from multibody_sym.records import dataclass


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
