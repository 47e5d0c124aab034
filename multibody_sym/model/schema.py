"""The JSON Schema of an element: one property for each of its fields, with what people read beside it."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypeVar

from multibody_sym.model import (
    bodies,
    constraints,
    contacts_and_impacts,
    fields,
    joints,
    parameters,
    settings,
    states,
    system,
)
from multibody_sym.model import bodies as surfaces
from multibody_sym.model import fields as values
from multibody_sym.model import parameters as tables
from multibody_sym.model.constraints import CONSTRAINTS
from multibody_sym.model.fields import Element, fields_of, unit_of
from multibody_sym.model.forces import FORCES
from multibody_sym.model.joints import JOINTS
from multibody_sym.model.steps import Curve, CurveField
from multibody_sym.model.system import REPEAT_KEY, VERSION, VERSION_KEY, Repeat, System
from multibody_sym.text.yaml_tree import read_text

# ----------------------------------------------------------------------------------------------------------------------
# What is told of each kind of field, entered by class: its words for people and its JSON Schema.


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


# ----------------------------------------------------------------------------------------------------------------------

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


# ----------------------------------------------------------------------------------------------------------------------
# What each kind of field takes: in words, and as a JSON Schema (draft 2020-12).
#
# A model file's values are text to its reader, which an editor reads as numbers, true and false: either is taken.


NUMBER: Final[Schema] = {"type": ["number", "string"], "minLength": 1}
_CONDITION: Final[Schema] = {"type": "string", "minLength": 1}
_NAME: Final[Schema] = {"type": ["string", "number", "boolean"], "minLength": 1}
_FLAG: Final[Schema] = {"enum": [True, False, "true", "false"]}
_VECTOR: Final = listing(NUMBER, 3, 3)
_NUMBER_WORDS: Final = "number or expression"


# --- numbers, directions, words ------------------------------------------------------------------------------------


@tells(values.Scalar, contacts_and_impacts.KineticField)
def _scalar(_field: Any) -> Kind:
    return Kind(_NUMBER_WORDS, NUMBER)


@tells(contacts_and_impacts.CoefficientField)
def _coefficient(_field: Any) -> Kind:
    return Kind(f"{_NUMBER_WORDS}, or `enough`", NUMBER)


@tells(surfaces.ProfileField)
def _profile(_field: Any) -> Kind:
    return Kind("expression of s", NUMBER)


@tells(values.Condition)
def _condition(_field: Any) -> Kind:
    return Kind("condition", _CONDITION)


@tells(states.State)
def _state(_field: Any) -> Kind:
    return Kind("state that begins", _CONDITION)


@tells(states.StopCondition)
def _stop(_field: Any) -> Kind:
    return Kind("condition, or a state that begins", _CONDITION)


def _reached(keys: Sequence[str] = ()) -> Schema:
    """Return the schema of one coordinate and its value; it has none of the names `keys`."""
    found: Schema = {"type": "object", "minProperties": 1, "maxProperties": 1, "additionalProperties": NUMBER}
    return {**found, "propertyNames": {"not": {"enum": list(keys)}}} if keys else found


@tells(states.MomentField)
def _moment(_field: Any) -> Kind:
    return Kind("moment: `{coordinate: value}`, a condition, or a state that begins", any_of(_CONDITION, _reached()))


@tells(states.TimeOrMoment)
def _time_or_moment(_field: Any) -> Kind:
    return Kind("time, or a moment", any_of(NUMBER, _reached()))


@tells(settings.EquationField)
def _equation(_field: Any) -> Kind:
    return Kind("equation, with `==`", {"type": "string", "pattern": "=="})


@tells(values.Vector)
def _vector(_field: Any) -> Kind:
    return Kind("list of three numbers or expressions", _VECTOR)


@tells(surfaces.EndField)
def _end(_field: Any) -> Kind:
    return Kind("name of a point, or three numbers or expressions", any_of(_NAME, _VECTOR))


@tells(values.Direction)
def _direction(_field: Any) -> Kind:
    letters = [sign + axis for axis in values.AXES for sign in ("", "-")]
    words = "direction: `x`, `-x`, `y`, `-y`, `z`, `-z`, or three numbers or expressions"
    return Kind(words, any_of({"enum": letters}, _VECTOR))


@tells(values.ScalarOrVector)
def _scalar_or_vector(_field: Any) -> Kind:
    return Kind("one or three numbers or expressions", any_of(NUMBER, _VECTOR))


@tells(values.Scalars)
def _scalars(_field: Any) -> Kind:
    return Kind("one or more numbers or expressions", any_of(NUMBER, listing(NUMBER)))


@tells(values.OptionalScalars)
def _optional_scalars(_field: Any) -> Kind:
    gap = {"type": ["number", "string", "null"]}
    return Kind("one or more numbers or expressions, or `null`", any_of(gap, listing(gap)))


@tells(values.Text)
def _text(_field: Any) -> Kind:
    return Kind("name", _NAME)


@tells(values.Prose)
def _prose(_field: Any) -> Kind:
    return Kind("sentences", {"type": "string", "minLength": 1})


@tells(values.Choice)
def _choice(field: values.Choice) -> Kind:
    return Kind("one of " + ", ".join(f"`{word}`" for word in field.words), {"enum": list(field.words)})


@tells(joints.Angles)
def _angles(_field: Any) -> Kind:
    pattern = "^(?!xx|yy|zz|.xx|.yy|.zz)[xyz]{3}$"
    return Kind("three axes, such as `zxz`", {"type": "string", "pattern": pattern})


@tells(values.Flag)
def _flag(_field: Any) -> Kind:
    return Kind("true or false", _FLAG)


@tells(values.Flags)
def _flags(_field: Any) -> Kind:
    listed = listing({"enum": [*_FLAG["enum"], None, "", "null", "~"]})
    return Kind("true or false, or a list of these", any_of(_FLAG, listed))


@tells(values.Count)
def _count(field: values.Count) -> Kind:
    schema = {"type": ["integer", "string"], "minimum": field.least, "minLength": 1}
    return Kind(f"whole number, at least {field.least}", schema)


@tells(parameters.DimensionField)
def _dimension(_field: Any) -> Kind:
    return Kind("unit", {"type": "string", "minLength": 1})


# --- lists, maps, elements -----------------------------------------------------------------------------------------


@tells(fields.ListOf)
def _list(field: fields.ListOf) -> Kind:
    item = kind_of(field.item)
    whole = listing(item.schema, field.least, field.most)
    least, most = field.least, field.most
    count = f"{least} of: " if least == most else f"at least {least} of: " if least > 1 else ""
    schema = whole if least > 1 else any_of(whole, item.schema)
    return Kind(f"list of {count}{item.words}", schema, item.elements)


@tells(fields.MapOf)
def _map(field: fields.MapOf) -> Kind:
    item = kind_of(field.item)
    return Kind(f"map of names to: {item.words}", _names(item.schema), item.elements)


def _names(item: Schema) -> Schema:
    return {"type": ["object", "null"], "additionalProperties": item, "propertyNames": {"minLength": 1}}


@tells(fields.OneOrMap)
def _one_or_map(field: fields.OneOrMap) -> Kind:
    item = kind_of(field.item)
    return Kind(f"{item.words}; or a map of names to it", any_of(item.schema, _names(item.schema)), item.elements)


@tells(fields.Record)
def _record(field: fields.Record) -> Kind:
    return _element(field.cls)


def _element(cls: type[Element], words: str = "") -> Kind:
    return Kind(words or f"map: {cls.__name__}", reference_to(cls), (cls,))


@tells(fields.OneOf)
def _one_of(field: fields.OneOf) -> Kind:
    words = [*field.table, *field.aliases]
    cases = [
        {"if": {"properties": {"type": {"enum": words_of(field, name)}}}, "then": reference_to(cls)}
        for name, cls in field.table.items()
    ]
    schema = {"type": "object", "required": ["type"], "properties": {"type": {"enum": words}}, "allOf": cases}
    return Kind("map with a `type`", schema, tuple(field.table.values()))


def words_of(field: fields.OneOf, name: str) -> list[str]:
    """Return the words that `type:` takes for one class: its name, and what people call it too."""
    return [name, *(alias for alias, meant in field.aliases.items() if meant == name)]


@tells(system.AnyMap)
def _copied(field: system.AnyMap) -> Kind:
    if not isinstance(field.like, fields.OneOf):
        return kind_of(field.like)
    keys = sorted({key for cls in field.like.table.values() for key in fields_of(cls)} | {"type"})
    schema = {
        "type": "object",
        "required": ["type"],
        "properties": {"type": {"enum": [*field.like.table, *field.like.aliases]}},
        "propertyNames": {"enum": keys},
    }
    return Kind("map with a `type`", schema)


# --- short and long forms of one thing -----------------------------------------------------------------------------


@tells(bodies.InertiaField)
def _inertia(field: bodies.InertiaField) -> Kind:
    elements = {key: {**NUMBER, "description": f"{key} in {field.unit}"} for key in field.keys}
    named = {"type": "object", "properties": elements, "additionalProperties": False}
    return Kind(f"map of {', '.join(field.keys)}", any_of(named, listing(NUMBER, 6, 6)))


@tells(bodies.MassField)
def _mass(_field: Any) -> Kind:
    cls = bodies.VariableMass
    return Kind(f"{_NUMBER_WORDS}, or map: {cls.__name__}", any_of(NUMBER, reference_to(cls)), (cls,))


@tells(bodies.ShapeField)
def _shape(_field: Any) -> Kind:
    sizes = {name: _sizes(name, keys) for name, keys in bodies.SHAPES.items()}
    mass = kind_of(bodies.MassField())
    schema = {
        "type": "object",
        "properties": {**sizes, "mass": {**mass.schema, "description": "its mass in kg"}},
        "required": ["mass"],
        "minProperties": 2,
        "maxProperties": 2,
        "additionalProperties": False,
    }
    return Kind(f"map of one of {', '.join(f'`{name}`' for name in sizes)}, and `mass`", schema, mass.elements)


def _sizes(name: str, keys: Sequence[str]) -> Schema:
    several = listing(NUMBER, len(keys), len(keys))
    schema = any_of(NUMBER, several) if len(keys) == 1 else several
    return {**schema, "description": f"a {name}: its {', '.join(keys)} in m"}


@tells(parameters.ParameterField)
def _parameter(_field: Any) -> Kind:
    cls = parameters.Parameter
    return Kind(f"{_NUMBER_WORDS}, or map: {cls.__name__}", any_of(NUMBER, reference_to(cls)), (cls,))


@tells(tables.InputField)
def _input(_field: Any) -> Kind:
    long = (tables.Table, tables.Constant)
    named = " or ".join(cls.__name__ for cls in long)
    return Kind(f"{_NUMBER_WORDS}, or map: {named}", any_of(NUMBER, *map(reference_to, long)), long)


@tells(tables.TableRows)
def _rows(_field: Any) -> Kind:
    file = {"type": "object", "properties": {"file": _NAME}, "required": ["file"], "additionalProperties": False}
    rows = {**listing(listing(NUMBER, 2, 2), 2, tables.MOST_ROWS)}
    return Kind("list of rows `[argument, value]`, or `{file: motor.csv}`", any_of(rows, file))


@tells(settings.AskField)
def _ask(_field: Any) -> Kind:
    cls = settings.Ask
    schema = any_of(NUMBER, reference_to(cls), _reached(tuple(fields_of(cls))))
    return Kind(f"expression, condition, `{{coordinate: value}}`, or map: {cls.__name__}", schema, (cls,))


@tells(contacts_and_impacts.ImpactsField)
def _impacts(_field: Any) -> Kind:
    cls, whole = contacts_and_impacts.Impact, {}
    for name in ("law", "sequence"):
        whole[name] = kind_of(fields_of(contacts_and_impacts.Impacts)[name]).schema
    one = element_schema(cls, whole)
    several = {"type": "object", "properties": whole, "additionalProperties": reference_to(cls)}
    words = f"map: {cls.__name__}, or map of names to several; or `closing`"
    return Kind(words, any_of({"const": "closing"}, one, several), (cls,))


@tells(constraints.RoughnessField)
def _roughness(_field: Any) -> Kind:
    cls = constraints.Roughness
    return Kind(f"{_NUMBER_WORDS}, or map: {cls.__name__}", any_of(NUMBER, reference_to(cls)), (cls,))


@tells(CurveField)
def _curve(_field: Any) -> Kind:
    return _element(Curve)


# ----------------------------------------------------------------------------------------------------------------------
# The JSON Schema of model files, from which editors complete and explain keys.


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
