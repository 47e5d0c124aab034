"""What each kind of field takes: in words, and as a JSON Schema (draft 2020-12).

A model file's values are text to its reader, which an editor reads as numbers, true and false: either is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from multibody_sym.formats.reference.elements import element_schema
from multibody_sym.formats.reference.registry import Kind, Schema, any_of, kind_of, listing, reference_to, tells
from multibody_sym.model.declaration import (
    bodies,
    constraints,
    contacts,
    fields,
    file_tree,
    impacts,
    joints,
    parameters,
    settings,
    states,
    surfaces,
    tables,
    values,
)
from multibody_sym.model.declaration.curves.curve import Curve, CurveField
from multibody_sym.model.declaration.fields import Element, fields_of

NUMBER: Final[Schema] = {"type": ["number", "string"], "minLength": 1}
_CONDITION: Final[Schema] = {"type": "string", "minLength": 1}
_NAME: Final[Schema] = {"type": ["string", "number", "boolean"], "minLength": 1}
_FLAG: Final[Schema] = {"enum": [True, False, "true", "false"]}
_VECTOR: Final = listing(NUMBER, 3, 3)
_NUMBER_WORDS: Final = "number or expression"


# --- numbers, directions, words ------------------------------------------------------------------------------------


@tells(values.Scalar, contacts.KineticField)
def _scalar(_field: Any) -> Kind:
    return Kind(_NUMBER_WORDS, NUMBER)


@tells(contacts.CoefficientField)
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


@tells(file_tree.AnyMap)
def _copied(field: file_tree.AnyMap) -> Kind:
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


@tells(impacts.ImpactsField)
def _impacts(_field: Any) -> Kind:
    cls, whole = impacts.Impact, {}
    for name in ("law", "sequence"):
        whole[name] = kind_of(fields_of(impacts.Impacts)[name]).schema
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
