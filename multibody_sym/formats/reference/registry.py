"""What is told of each kind of field, entered by class: its words for people and its JSON Schema."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

from multibody_sym.model.declaration.fields import Element

Schema = dict[str, Any]


class Kind(NamedTuple):
    """What a field takes: in words, as a schema, and the elements that the schema refers to."""

    words: str
    schema: Schema
    elements: tuple[type[Element], ...] = ()


_KINDS: Final[dict[type[Any], Callable[[Any], Kind]]] = {}
_Told = TypeVar("_Told", bound=Callable[[Any], Kind])


def kind_of(field: Any) -> Kind:
    """Return what a field takes. Raises KeyError for a class of fields of which nothing is told here."""
    return _KINDS[type(field)](field)


def told_classes() -> frozenset[type[Any]]:
    """Return the classes of fields of which something is told."""
    return frozenset(_KINDS)


def tells(*classes: type[Any]) -> Callable[[_Told], _Told]:
    def enter(told: _Told) -> _Told:
        for cls in classes:
            _KINDS[cls] = told
        return told

    return enter


def reference_to(cls: type[Element]) -> Schema:
    """Return the schema that stands for an element defined elsewhere in the document."""
    return {"$ref": f"#/$defs/{cls.__name__}"}


def any_of(*schemas: Schema) -> Schema:
    """Return a schema that takes what one of others takes."""
    return {"anyOf": list(schemas)}


def listing(item: Schema, least: int = 0, most: int | None = None) -> Schema:
    """Return the schema of a list."""
    found: Schema = {"type": "array", "items": item}
    if least:
        found["minItems"] = least
    if most is not None:
        found["maxItems"] = most
    return found
