"""The JSON Schema of model files (draft 2020-12), from which editors complete and explain keys.

In: the fields of elements, with their words for the reference. Out: the kind of each field; the schema of a file.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from multibody_sym.model import (
    bodies,
    constraints,
    contacts_and_impacts,
    fields,
    joints,
    parameters,
    settings,
    state_words,
    system,
)
from multibody_sym.model.constraints import CONSTRAINTS
from multibody_sym.model.fields import Element, fields_of, unit_of
from multibody_sym.model.forces import FORCES
from multibody_sym.model.joints import JOINTS
from multibody_sym.model.steps import Curve, CurveField
from multibody_sym.model.system import REPEAT_KEY, VERSION, VERSION_KEY, Repeat, System
from multibody_sym.text.yaml_tree import read_text

Schema = dict[str, Any]


class FieldKind(NamedTuple):
    """What a field takes: in words, as a schema, and the elements that the schema refers to."""

    words: str
    schema: Schema
    elements: tuple[type[Element], ...] = ()


def reference_to(cls: type[Element]) -> Schema:
    """Return the schema that stands for an element defined elsewhere in the document."""
    return {"$ref": f"#/$defs/{cls.__name__}"}


def any_of(*schemas: Schema) -> Schema:
    return {"anyOf": list(schemas)}


def array_schema(item: Schema, least: int = 0, most: int | None = None) -> Schema:
    """Return the schema of a list of `least` to `most` items."""
    schema: Schema = {"type": "array", "items": item}
    if least:
        schema["minItems"] = least
    if most is not None:
        schema["maxItems"] = most
    return schema


def element_schema(cls: type[Element], more: Mapping[str, Schema] = MappingProxyType({})) -> Schema:
    """Return the schema of a map with the fields of an element, and of `more` keys that stand beside them."""
    properties: dict[str, Schema] = {**more}
    for f in dataclasses.fields(cls):
        field: Any = f.metadata["field"]
        says, such, unit = f.metadata["says"], f.metadata["such"], unit_of(field)
        one = {**kind_of(field).schema, "description": f"{says} [{unit}]" if unit else says}
        if (default := default_of(f)) is not None:
            one["default"] = with_types(default)
        if such:
            one["examples"] = [with_types(read_text(f"{f.name}: {such}\n", "example").data[f.name])]
        properties[fields.key_of(f.name)] = one
    return {
        "type": "object",
        "title": cls.__name__,
        "description": (cls.__doc__ or "").split("\n\n")[0].strip(),
        "properties": properties,
        "required": [f.name for f in dataclasses.fields(cls) if f.default is dataclasses.MISSING],
        "additionalProperties": False,
    }


def default_of(f: dataclasses.Field[Any]) -> Any:
    """Return the default of a key as a file holds it; None for none."""
    if f.default is dataclasses.MISSING or f.default is None or f.default in ((), {}):
        return None
    return f.metadata["field"].tree(f.metadata["field"].accept(f.default))


_WORDS: Final = {"true": True, "false": False, "null": None, "~": None, "": None}
_WHOLE_NUMBER: Final = re.compile(r"[-+]?[0-9]+")
_PLAIN_NUMBER: Final = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")


def with_types(value: Any) -> Any:
    """Return a file's content as editors have it: with numbers, true, false and null for texts that spell them."""
    if isinstance(value, dict):
        return {key: with_types(x) for key, x in value.items()}
    if isinstance(value, list):
        return [with_types(x) for x in value]
    if value in _WORDS:
        return _WORDS[value]
    if not isinstance(value, str) or not _PLAIN_NUMBER.fullmatch(value):
        return value
    return int(value) if _WHOLE_NUMBER.fullmatch(value) else float(value)


# ----------------------------------------------------------------------------------------------------------------------
# What each kind of field takes: in words, and as a JSON Schema (draft 2020-12).
#
# A model file's values are text to its reader, which an editor reads as numbers, true and false: either is taken.


NUMBER: Final[Schema] = {"type": ["number", "string"], "minLength": 1}
_NUMBER_WORDS: Final = "number or expression"
_TEXT: Final[Schema] = {"type": "string", "minLength": 1}
_NAME: Final[Schema] = {"type": ["string", "number", "boolean"], "minLength": 1}
_FLAG: Final[Schema] = {"enum": [True, False, "true", "false"]}
_GAP: Final[Schema] = {"type": ["number", "string", "null"]}
_VECTOR: Final = array_schema(NUMBER, 3, 3)
_REACHED: Final[Schema] = {
    "type": "object", "minProperties": 1, "maxProperties": 1, "additionalProperties": NUMBER
}
"""One coordinate and its value."""
_TRANSMISSIBILITY: Final[Schema] = {
    "type": "object", "properties": {"transmissibility": _NAME, "from": _NAME},
    "required": ["transmissibility", "from"], "additionalProperties": False,
}
"""A question with a key that Python reserves."""
_INERTIA: Final = bodies.InertiaField()
_DIRECTIONS: Final = [sign + axis for axis in fields.AXES for sign in ("", "-")]


def _number_or(cls: type[Element]) -> FieldKind:
    """Return the kind of a field whose short form is a number."""
    return FieldKind(f"{_NUMBER_WORDS}, or map: {cls.__name__}", any_of(NUMBER, reference_to(cls)), (cls,))


def _map_of(cls: type[Element]) -> FieldKind:
    return FieldKind(f"map: {cls.__name__}", reference_to(cls), (cls,))


_KINDS: Final[dict[type[Any], FieldKind]] = {
    # numbers, directions, words
    fields.Scalar: FieldKind(_NUMBER_WORDS, NUMBER),
    contacts_and_impacts.KineticField: FieldKind(_NUMBER_WORDS, NUMBER),
    contacts_and_impacts.CoefficientField: FieldKind(f"{_NUMBER_WORDS}, or `enough`", NUMBER),
    bodies.ProfileField: FieldKind("expression of s", NUMBER),
    fields.Condition: FieldKind("condition", _TEXT),
    state_words.StateField: FieldKind("state that begins", _TEXT),
    state_words.StopCondition: FieldKind("condition, or a state that begins", _TEXT),
    state_words.MomentField: FieldKind(
        "moment: `{coordinate: value}`, a condition, or a state that begins", any_of(_TEXT, _REACHED)
    ),
    state_words.TimeOrMoment: FieldKind("time, or a moment", any_of(NUMBER, _REACHED)),
    settings.SamplesField: FieldKind(
        f"{_NUMBER_WORDS}, or list of times", any_of(NUMBER, array_schema(NUMBER, 1))
    ),
    settings.TendencyField: FieldKind("`{name: limit}`, a number, `oo` or `-oo`", _REACHED),
    settings.EquationField: FieldKind("equation, with `==`", {"type": "string", "pattern": "=="}),
    fields.Vector: FieldKind("list of three numbers or expressions", _VECTOR),
    bodies.EndField: FieldKind("name of a point, or three numbers or expressions", any_of(_NAME, _VECTOR)),
    fields.Direction: FieldKind(
        "direction: `x`, `-x`, `y`, `-y`, `z`, `-z`, or three numbers or expressions",
        any_of({"enum": _DIRECTIONS}, _VECTOR),
    ),
    fields.ScalarOrVector: FieldKind("one or three numbers or expressions", any_of(NUMBER, _VECTOR)),
    fields.Scalars: FieldKind("one or more numbers or expressions", any_of(NUMBER, array_schema(NUMBER))),
    fields.OptionalScalars: FieldKind(
        "one or more numbers or expressions, or `null`", any_of(_GAP, array_schema(_GAP))
    ),
    fields.Text: FieldKind("name", _NAME),
    fields.Prose: FieldKind("sentences", _TEXT),
    joints.Angles: FieldKind(
        "three axes, such as `zxz`", {"type": "string", "pattern": "^(?!xx|yy|zz|.xx|.yy|.zz)[xyz]{3}$"}
    ),
    fields.Flag: FieldKind("true or false", _FLAG),
    fields.Flags: FieldKind(
        "true or false, or a list of these",
        any_of(_FLAG, array_schema({"enum": [*_FLAG["enum"], None, "", "null", "~"]})),
    ),
    parameters.DimensionField: FieldKind("unit", _TEXT),
    # short and long forms of one thing
    bodies.InertiaField: FieldKind(
        f"map of {', '.join(_INERTIA.keys)}",
        any_of(
            {
                "type": "object",
                "properties": {key: {**NUMBER, "description": f"{key} in {_INERTIA.unit}"} for key in _INERTIA.keys},
                "additionalProperties": False,
            },
            array_schema(NUMBER, 6, 6),
        ),
    ),
    bodies.MassField: _number_or(bodies.VariableMass),
    parameters.ParameterField: _number_or(parameters.Parameter),
    constraints.RoughnessField: _number_or(constraints.Roughness),
    CurveField: _map_of(Curve),
    parameters.InputField: FieldKind(
        f"{_NUMBER_WORDS}, or map: Table, Grid or Constant",
        any_of(NUMBER, *map(reference_to, (parameters.Table, parameters.Grid, parameters.Constant))),
        (parameters.Table, parameters.Grid, parameters.Constant),
    ),
    parameters.GridNumbers: FieldKind("list of growing numbers", array_schema(NUMBER, 2)),
    parameters.GridValues: FieldKind("list of lists of numbers", array_schema(array_schema(NUMBER, 2), 2)),
    parameters.TableRows: FieldKind(
        "list of rows `[argument, value]`, or `{file: motor.csv}`",
        any_of(
            array_schema(array_schema(NUMBER, 2, 2), 2, parameters.MOST_ROWS),
            {"type": "object", "properties": {"file": _NAME}, "required": ["file"], "additionalProperties": False},
        ),
    ),
    settings.AskField: FieldKind(
        f"expression, condition, `{{coordinate: value}}`, or map: {settings.Ask.__name__}",
        any_of(
            NUMBER,
            reference_to(settings.Ask),
            _TRANSMISSIBILITY,
            {**_REACHED, "propertyNames": {"not": {"enum": [*map(fields.key_of, fields_of(settings.Ask))]}}},
        ),
        (settings.Ask,),
    ),
}
"""The kinds of fields that take the same whatever their attributes are."""


def kind_of(field: Any) -> FieldKind:
    """Return what a field takes. Raises KeyError for an unknown class of fields."""
    match field:
        case fields.Choice():
            return FieldKind("one of " + ", ".join(f"`{word}`" for word in field.words), {"enum": list(field.words)})
        case fields.Count():
            whole = {"type": ["integer", "string"], "minimum": field.least, "minLength": 1}
            return FieldKind(f"whole number, at least {field.least}", whole)
        case fields.Record():
            return _map_of(field.cls)
        case fields.ListOf():
            item, least, most = kind_of(field.item), field.least, field.most
            count = f"{least} of: " if least == most else f"at least {least} of: " if least > 1 else ""
            several = array_schema(item.schema, least, most)
            schema = several if least > 1 else any_of(several, item.schema)
            return FieldKind(f"list of {count}{item.words}", schema, item.elements)
        case fields.MapOf() | fields.OneOrMap():
            item = kind_of(field.item)
            named = {"type": ["object", "null"], "additionalProperties": item.schema, "propertyNames": {"minLength": 1}}
            if isinstance(field, fields.MapOf):
                return FieldKind(f"map of names to: {item.words}", named, item.elements)
            return FieldKind(f"{item.words}; or a map of names to it", any_of(item.schema, named), item.elements)
        case fields.OneOf():
            return _typed_map(field, whole=True)
        case system.AnyMap():
            like = field.like
            return _typed_map(like, whole=False) if isinstance(like, fields.OneOf) else kind_of(like)
        case bodies.ShapeField():
            return _shape_kind()
        case contacts_and_impacts.ImpactsField():
            return _impacts_kind()
    return _KINDS[type(field)]


def _typed_map(field: fields.OneOf, *, whole: bool) -> FieldKind:
    """Return the kind of a map with a `type`; if it is `whole`, with the keys that each type needs."""
    schema: Schema = {
        "type": "object",
        "required": ["type"],
        "properties": {"type": {"enum": [*field.table, *field.aliases]}},
    }
    if not whole:
        keys = {key for cls in field.table.values() for key in fields_of(cls)} | {"type"}
        return FieldKind("map with a `type`", {**schema, "propertyNames": {"enum": sorted(keys)}})
    schema["allOf"] = [
        {"if": {"properties": {"type": {"enum": words_of(field, name)}}}, "then": reference_to(cls)}
        for name, cls in field.table.items()
    ]
    return FieldKind("map with a `type`", schema, tuple(field.table.values()))


def words_of(field: fields.OneOf, name: str) -> list[str]:
    """Return the words that `type:` takes for one class: its name and its aliases."""
    return [name, *(alias for alias, meant in field.aliases.items() if meant == name)]


def _shape_kind() -> FieldKind:
    sizes = {}
    for name, keys in bodies.SHAPES.items():
        several = array_schema(NUMBER, len(keys), len(keys))
        schema = any_of(NUMBER, several) if len(keys) == 1 else several
        sizes[name] = {**schema, "description": f"a {name}: its {', '.join(keys)} in m"}
    mass = kind_of(bodies.MassField())
    whole = {
        "type": "object",
        "properties": {**sizes, "mass": {**mass.schema, "description": "its mass in kg"}},
        "required": ["mass"],
        "minProperties": 2,
        "maxProperties": 2,
        "additionalProperties": False,
    }
    return FieldKind(f"map of one of {', '.join(f'`{name}`' for name in sizes)}, and `mass`", whole, mass.elements)


def _impacts_kind() -> FieldKind:
    cls, of_all = contacts_and_impacts.Impact, fields_of(contacts_and_impacts.Impacts)
    beside = {name: kind_of(of_all[name]).schema for name in ("law", "sequence")}
    several = {"type": "object", "properties": beside, "additionalProperties": reference_to(cls)}
    schema = any_of({"const": "closing"}, element_schema(cls, beside), several)
    return FieldKind(f"map: {cls.__name__}, or map of names to several; or `closing`", schema, (cls,))


# ----------------------------------------------------------------------------------------------------------------------
# The whole file.


DRAFT: Final = "https://json-schema.org/draft/2020-12/schema"
VERSION_SAYS: Final = "the version of the format of model files, which is 1"
REPEAT_SAYS: Final = "a chain of like bodies, or a list of several chains"
TYPED: Final = {"joints": JOINTS, "forces": FORCES, "constraints": CONSTRAINTS}
_TYPES: Final = {cls: words_of(part, name) for part in TYPED.values() for name, cls in part.table.items()}
"""The words that `type:` takes for each class that is chosen by it."""


def schema() -> dict[str, Any]:
    """Return a JSON Schema (draft 2020-12) of model files: keys, their contents and their meanings.

    It takes every file that `load` takes. It refuses unknown and missing keys, wrong words and wrong kinds of content;
    `check` alone knows about names, units and keys that exclude each other.
    """
    whole = element_schema(System)
    own: Schema = {
        VERSION_KEY: {"enum": [int(VERSION), VERSION], "description": VERSION_SAYS},
        REPEAT_KEY: {
            **any_of(reference_to(Repeat), array_schema(reference_to(Repeat)), {"type": "null"}),
            "description": REPEAT_SAYS,
        },
    }
    definitions: dict[str, Schema] = {}
    pending: list[type[Element]] = [Repeat, *_parts(System)]
    while pending:
        cls = pending.pop(0)
        if cls.__name__ not in definitions:
            definitions[cls.__name__] = _definition(cls)
            pending += _parts(cls)
    return {
        "$schema": DRAFT,
        **whole,
        "title": "a model of multibody_sym",
        "properties": {**own, **whole["properties"]},
        "required": [VERSION_KEY, *whole["required"]],
        "$defs": dict(sorted(definitions.items())),
    }


def _parts(cls: type[Element]) -> list[type[Element]]:
    return [part for field in fields_of(cls).values() for part in kind_of(field).elements]


def _definition(cls: type[Element]) -> Schema:
    words = _TYPES.get(cls)
    if words is None:
        return element_schema(cls)
    definition = element_schema(cls, {"type": {"enum": words, "description": f"which kind it is: {', '.join(words)}"}})
    return {**definition, "required": ["type", *definition["required"]]}
