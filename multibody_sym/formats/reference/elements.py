"""The JSON Schema of an element: one property for each of its fields, with what people read beside it."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from multibody_sym.formats.reference.registry import Schema, kind_of
from multibody_sym.formats.yaml_tree import read_text
from multibody_sym.model.declaration.fields import Element, fields_of, unit_of


def element_schema(cls: type[Element], more: Mapping[str, Schema] = MappingProxyType({})) -> Schema:
    """Return the schema of a map with the fields of an element, and of `more` keys that stand beside them."""
    kinds = fields_of(cls)
    properties = {f.name: _property(f, kinds[f.name]) for f in dataclasses.fields(cls)}
    return {
        "type": "object",
        "title": cls.__name__,
        "description": (cls.__doc__ or "").split("\n\n")[0].strip(),
        "properties": {**more, **properties},
        "required": [f.name for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING],
        "additionalProperties": False,
    }


def _property(f: dataclasses.Field[Any], field: Any) -> Schema:
    """Return the schema of one key, with what people read beside it."""
    says, such, unit = f.metadata["says"], f.metadata["such"], unit_of(field)
    found = {**kind_of(field).schema, "description": f"{says} [{unit}]" if unit else says}
    default = default_of(f)
    if default is not None:
        found["default"] = typed(default)
    if such:
        found["examples"] = [typed(read_text(f"{f.name}: {such}\n", "example").data[f.name])]
    return found


def default_of(f: dataclasses.Field[Any]) -> Any:
    """Return what a key is when it is left out, as a file holds it; None for nothing."""
    if f.default is dataclasses.MISSING or f.default is None or f.default in ((), {}):
        return None
    return f.metadata["field"].tree(f.metadata["field"].accept(f.default))


def typed(value: Any) -> Any:
    """Return a file's content as editors have it: with numbers, true, false and null for texts that spell them."""
    if isinstance(value, dict):
        return {key: typed(x) for key, x in value.items()}
    if isinstance(value, list):
        return [typed(x) for x in value]
    if value in _WORDS:
        return _WORDS[value]
    if not isinstance(value, str) or not _PLAIN_NUMBER.fullmatch(value):
        return value
    return int(value) if _WHOLE_NUMBER.fullmatch(value) else float(value)


_WORDS: Final = {"true": True, "false": False, "null": None, "~": None, "": None}
_WHOLE_NUMBER: Final = re.compile(r"[-+]?[0-9]+")
_PLAIN_NUMBER: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
