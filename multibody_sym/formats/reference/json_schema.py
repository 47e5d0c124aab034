"""The JSON Schema of model files, from which editors complete and explain keys."""

from __future__ import annotations

from typing import Any, Final

from multibody_sym.formats.reference.elements import element_schema
from multibody_sym.formats.reference.kinds import words_of
from multibody_sym.formats.reference.registry import Schema, any_of, kind_of, listing, reference_to
from multibody_sym.model.declaration.constraints import CONSTRAINTS
from multibody_sym.model.declaration.fields import Element, fields_of
from multibody_sym.model.declaration.file_tree import REPEAT_KEY, VERSION, VERSION_KEY, Repeat
from multibody_sym.model.declaration.forces import FORCES
from multibody_sym.model.declaration.joints import JOINTS
from multibody_sym.model.declaration.system import System

DRAFT: Final = "https://json-schema.org/draft/2020-12/schema"
VERSION_SAYS: Final = "the version of the format of model files, which is 1"
REPEAT_SAYS: Final = "a chain of like bodies, or a list of several chains"
TYPED: Final = {"joints": JOINTS, "forces": FORCES, "constraints": CONSTRAINTS}
_TYPES: Final = {cls: words_of(part, name) for part in TYPED.values() for name, cls in part.table.items()}
"""The words that `type:` takes for each class that is chosen by it."""


def schema() -> dict[str, Any]:
    """Return a JSON Schema (draft 2020-12) of model files: keys, what they take, and what they mean.

    It takes every file that `load` takes, and tells of keys that nobody knows, of missing ones, of wrong words and of
    wrong kinds of content. What depends on other parts of the file (names, units, which keys go together) only `check`
    knows.
    """
    whole = element_schema(System)
    own: Schema = {
        VERSION_KEY: {"enum": [int(VERSION), VERSION], "description": VERSION_SAYS},
        REPEAT_KEY: {**any_of(reference_to(Repeat), listing(reference_to(Repeat))), "description": REPEAT_SAYS},
    }
    own[REPEAT_KEY]["anyOf"].append({"type": "null"})
    return {
        "$schema": DRAFT,
        **whole,
        "title": "a model of multibody_sym",
        "properties": {**own, **whole["properties"]},
        "required": [VERSION_KEY, *whole["required"]],
        "$defs": _definitions(),
    }


def _definitions() -> dict[str, Schema]:
    """Return the schemas of all elements that a system is made of, by the names of their classes."""
    found: dict[str, Schema] = {}
    pending: list[type[Element]] = [Repeat, *_parts(System)]
    while pending:
        cls = pending.pop(0)
        if cls.__name__ not in found:
            found[cls.__name__] = _definition(cls)
            pending += _parts(cls)
    return dict(sorted(found.items()))


def _parts(cls: type[Element]) -> list[type[Element]]:
    return [part for field in fields_of(cls).values() for part in kind_of(field).elements]


def _definition(cls: type[Element]) -> Schema:
    words = _TYPES.get(cls)
    if words is None:
        return element_schema(cls)
    found = element_schema(cls, {"type": {"enum": words, "description": f"which kind it is: {', '.join(words)}"}})
    return {**found, "required": ["type", *found["required"]]}
