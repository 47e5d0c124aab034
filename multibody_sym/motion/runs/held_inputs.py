"""Inputs that are held: they are parameters of the system that is compiled, so that C, events and impacts take them.

In: a system and the names of inputs. Out: the system in which they are parameters, and the start of its run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, ModelError, at, short_repr
from multibody_sym.mechanics.spanning_tree import free_name, start_names
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.fields import Names, scalar
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.system import System
from multibody_sym.motion.results.samples import RunStart
from multibody_sym.program.program import interpret
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import ZERO, symbol

# ----------------------------------------------------------------------------------------------------------------------
# Inputs as parameters.

def held_names(system: System, given: Any) -> tuple[str, ...]:
    """Return the inputs that are held: those that are named, or all but those that drive a motion or constraint.

    Raises InputError for a name of none, and for a driving one.
    """
    driving = check_numbers(system).driving_inputs if system.inputs else ()
    if given is None:
        return tuple(name for name in system.inputs if name not in driving)
    named = listed_names("inputs", given)
    for name in named:
        if name not in system.inputs:
            raise InputError(f"there is no input {name!r}", number="M106", word=name, known=system.inputs)
        if name in driving:
            message = f"{name} drives a motion or a constraint, whose speeds would jump where a held value does"
            raise InputError(f"{message}: let a force follow it", number="M110")
    return tuple(dict.fromkeys(named))


class HeldInputs(NamedTuple):
    """Inputs of a system that are held, by the names of the parameters that they become."""

    parameters: Mapping[str, str]

    @classmethod
    def of(cls, system: System, names: Sequence[str]) -> HeldInputs:
        """Return the inputs of a system by these names."""
        taken, found = {*system.parameters, *system.inputs, *system.outputs, *start_names(system)}, dict[str, str]()
        for name in names:
            found[name] = free_name(f"held_{name}", {*taken, *found.values()})
        return cls(found)

    def in_system(self, system: System) -> System:
        """Return the system in which they are parameters."""
        parameters = {**system.parameters, **{name: Parameter(value=ZERO) for name in self.parameters.values()}}
        inputs = {**system.inputs, **{name: symbol(own) for name, own in self.parameters.items()}}
        return replace(system, parameters=Names(parameters), inputs=Names(inputs))

    def begun(self, begin: RunStart, values: Mapping[str, float], again: Callable[[], RunStart]) -> RunStart:
        """Return the start of a run with values (by parameter); where they decide what touches, it is made `again`."""
        if begin.modes is not None:
            return again() if any(values.values()) else begin
        problem, places = begin.problem, begin.ready.mechanism.parameters.places
        parameters = changed_parameters(problem.parameters, places, values)
        return begin._replace(problem=problem.with_numbers(parameters, problem.q0, problem.u0))

    def declared(self, system: System, begin: RunStart) -> Mapping[str, float]:
        """Return the values of their expressions at the start of a run."""
        mechanism = check_numbers(system)
        given = 0.0, begin.ready.q0, begin.ready.u0, np.array(parameter_values(mechanism, {}))
        values = dict(zip(mechanism.inputs, interpret(inputs_program(mechanism), *given)[0].tolist(), strict=True))
        return {own: values[name] for name, own in self.parameters.items()}


def changed_parameters(parameters: Floats, places: Mapping[str, int], values: Mapping[str, float]) -> Floats:
    """Return parameters (np,) with other values of those that are named."""
    changed = parameters.copy()
    for name, value in values.items():
        changed[places[name]] = value
    return changed


def positive_time(name: str, value: Any) -> float:
    """Return a time in s, or text such as `1 ms`, as a number. Raises ModelError."""
    with at(name):
        node = scalar(value, "s")
    found = float("nan") if node.shadow is None else float(node.shadow)
    if not 0.0 < found < float("inf"):
        raise ModelError(f"{name} is a time in s, or text such as '1 ms', not {short_repr(value)}")
    return found
