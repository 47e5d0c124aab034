"""A system as a call overrides it: with other parameters, start values, inputs, coordinates than were declared.

Functions take these options by name, commands hand them on; nothing else changes a declaration.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.spanning_tree import coordinate_names, speed_names
from multibody_sym.model.argument_checks import flag, state_by_name, values_by_name
from multibody_sym.model.fields import Names, is_gap, scalar
from multibody_sym.model.joints import Initial, MovingJoint
from multibody_sym.model.parameters import InputField
from multibody_sym.model.run_options import MODEL_OVERRIDES, ModelOptions
from multibody_sym.model.system import System, verify_system
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.text.parser import parse_scalar


@dataclass(frozen=True)
class Overrides:
    """The options that every function takes beside a system, and every command beside a model file.

    None leaves all as declared. `parameters`: values by name (numbers, expressions, or text such as `500 g` or `2*r`);
    `initial`: coordinates and speeds at t = 0 by name, None for one that is to be found, or the `final` of a run;
    `inputs`: expressions or tables by name; `coordinates`: "relative" or "absolute"; `project`: whether all start
    values change, known ones too, as little as constraints need.
    """

    parameters: Mapping[str, Any] | None = None
    initial: Mapping[str, Any] | None = None
    inputs: Mapping[str, Any] | None = None
    coordinates: str | None = None
    project: bool | None = None

    def of(self, system: System) -> System:
        """Return the system, changed. Raises InputError with the option and the name in `where.path`."""
        verify_system(system)
        with at("parameters"):
            changed = with_values(system, self.parameters)
        with at("inputs"):
            changed = with_inputs(changed, self.inputs)
        with at("initial"):
            changed = with_initial(changed, self.initial)
        project = None if self.project is None else flag("project", self.project)
        return with_settings(changed, {"coordinates": self.coordinates, "project": project})


def with_overrides(system: System, options: ModelOptions) -> System:
    """Return the system, changed as a call asks. Raises InputError as `Overrides.of` does."""
    changes: dict[str, Any] = {name: options.get(name) for name in MODEL_OVERRIDES}
    return Overrides(**changes).of(system)


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
                raise ModelError(f"there is no parameter {name!r}", number="M106", word=name, known=changed)
            parameter = changed[name]
            if not isinstance(value, str):
                changed[name] = replace(parameter, value=scalar(value, None))
                continue
            node, dimension = parse_scalar(value)
            if None not in (dimension, parameter.dimension) and dimension != parameter.dimension:
                message = f"'{value}' does not fit: the parameter is a quantity in {parameter.dimension}"
                raise ModelError(message, number="M105")
            new = replace(parameter, value=node, dimension=dimension or parameter.dimension)
            changed[name] = new.declared_as(value)
    return replace(system, parameters=Names(changed))


def with_inputs(system: System, inputs: Mapping[str, Any] | None) -> System:
    """Return the system with other inputs: numbers, expressions, tables. Raises InputError for a name of none."""
    changed: dict[str, Any] = dict(system.inputs)
    for name, value in values_by_name("inputs", inputs).items():
        with at(name):
            if name not in changed:
                raise ModelError(f"there is no input {name!r}", number="M106", word=name, known=changed)
            changed[name] = InputField().accept(value)
    return replace(system, inputs=Names(changed)) if inputs else system


class _Place(NamedTuple):
    """Where a start value stands: under `key` (q, u) of a joint's `initial`, at a `number`, in `unit`."""

    joint: str
    key: str
    number: int
    unit: str


def with_initial(system: System, values: Mapping[str, Any] | None) -> System:
    """Return the system with other start values of coordinates, speeds and states, by name; None: to be found.

    `values` may be the `final` of a run, from which another one goes on; its time is left out: runs begin at t = 0.
    Raises InputError for a name that is neither's, for a value of another dimension, and for a part of a quaternion.
    """
    given = state_by_name("initial", values)
    places: dict[str, _Place] = {}
    for joint, declared in system.joints.items():
        named = ("q", coordinate_names(joint, declared)), ("u", speed_names(joint, declared))
        units = {"q": declared.coordinate_units, "u": declared.speed_units}
        for key, names in named:
            places |= {name: _Place(joint, key, k, units[key][k]) for k, name in enumerate(names)}
    found: dict[str, dict[str, Node | None]] = {}
    states = dict(system.states)
    for name, value in given.items():
        with at(name):
            if name in system.states:
                state = system.states[name]
                if is_gap(value):
                    raise ModelError("a state needs a value at the start: its rate does not tell one", number="M102")
                unit = None if state.dimension is None else str(state.dimension)
                states[name] = replace(state, initial=scalar(value, unit))
                continue
            if name not in places:
                from multibody_sym.mechanics.absolute import unknown_coordinate

                raise unknown_coordinate(name, system, (*places, *system.states))
            found.setdefault(places[name].joint, {})[name] = start_value(value, places[name].unit)
    joints = dict(system.joints)
    for joint, new in found.items():
        with at(next(iter(new))):
            moving = joints[joint]
            assert isinstance(moving, MovingJoint)
            initial, counts = moving.initial or Initial(), (len(moving.coordinate_units), len(moving.speed_units))
            starts = {key: list(initial.values(key, count)) for key, count in zip("qu", counts, strict=True)}
            for name, value in new.items():
                starts[places[name].key][places[name].number] = value
            keys = {places[name].key for name in new}
            changed: dict[str, Any] = {key: values for key, values in starts.items() if key in keys}
            joints[joint] = replace(moving, initial=replace(initial, **changed))
    return replace(system, joints=Names(joints), states=Names(states)) if given else system


def start_value(value: Any, unit: str) -> Node | None:
    """Return a start value in SI units, None where it is to be found; raises InputError for another dimension."""
    return None if is_gap(value) else scalar(value, unit)


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
