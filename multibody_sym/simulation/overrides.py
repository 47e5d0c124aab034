"""A system with other parameter values and settings: what `--set` and the arguments of a call change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from multibody_sym.errors import ModelError, at, suggestion
from multibody_sym.expressions.parser import parse_scalar
from multibody_sym.model.declaration.doors import values_by_name
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.parameters import Parameter
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.model.declaration.values import scalar


def with_values(system: System, values: Mapping[str, Any] | None) -> System:
    """Return the system with new parameter values: numbers, expressions, or text such as `500 g` or `2*r`.

    Raises InputError for a name that is no parameter and for a value of another dimension.
    """
    verify_system(system)
    given = values_by_name("parameters", values)
    if not given:
        return system
    changed = dict(system.parameters)
    for name, value in given.items():
        with at(name):
            if name not in changed:
                raise ModelError(f"there is no parameter {name!r}{suggestion(name, changed)}")
            changed[name] = _with_value(changed[name], value)
    return replace(system, parameters=Names(changed))


def _with_value(parameter: Parameter, value: Any) -> Parameter:
    if not isinstance(value, str):
        return replace(parameter, value=scalar(value, None))
    node, dimension = parse_scalar(value)
    if None not in (dimension, parameter.dimension) and dimension != parameter.dimension:
        raise ModelError(f"'{value}' does not fit: the parameter is a quantity in {parameter.dimension}")
    return replace(parameter, value=node, dimension=dimension or parameter.dimension)


def with_settings(system: System, settings: Mapping[str, Any]) -> System:
    """Return the system with those `settings` (keys of `simulation:`) that are not None.

    A new `step` takes the place of tolerances in the file, and new tolerances that of a step.
    """
    given = {name: value for name, value in settings.items() if value is not None}
    if not given:
        return system
    if "step" in given:
        given = {"rtol": None, "atol": None, **given}
    elif "rtol" in given or "atol" in given:
        given = {"step": None, **given}
    with at("simulation"):
        return replace(system, simulation=replace(system.simulation, **given))
