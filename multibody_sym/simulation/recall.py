"""Programs of a system, compiled: recalled from the cache by the system's structure, or derived once."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from multibody_sym.dynamics.formalisms import FORMALISMS, cheapest
from multibody_sym.errors import InputError
from multibody_sym.model.declaration import tree_from_system
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.model.slots import at, suggestion
from multibody_sym.model.system import System
from multibody_sym.runtime import loading
from multibody_sym.runtime.cache import digest
from multibody_sym.runtime.loading import Backend, Compiled

if TYPE_CHECKING:
    from multibody_sym.program.programs import Form

_NOT_STRUCTURE = ("name", "ask", "simulation")


def formalism_name(name: str | None, mechanism: Mechanism) -> str:
    """Return the name of a formalism, that of the cheapest one for None; raises InputError."""
    if name is None:
        return cheapest(mechanism)
    if name not in FORMALISMS:
        with at("formalism"):
            raise InputError(f"there is no formalism {name!r}{suggestion(name, FORMALISMS)}")
    return name


def compiled(
    system: System,
    mechanism: Mechanism,
    formalism: str,
    form: Form = "explicit",
    *,
    native: bool = False,
    backend: Backend | None = None,
) -> Compiled:
    """Return the system's Programs by a formalism, ready to be called, with those that a method needs for its `form`.

    What was derived for a system of the same structure is recalled, whatever its parameters' values and start.
    """
    key = structure_key(system, formalism, form)
    recalled = loading.recall(key, native=native, backend=backend)
    if recalled is not None:
        return recalled.compiled
    from multibody_sym.dynamics.programs import programs  # a run that recalls needs none of it

    derived = programs(mechanism, FORMALISMS[formalism], form)
    made = loading.load(derived.as_mapping(), native=native, backend=backend)
    loading.remember(key, made, {})
    return made


def structure_key(system: System, formalism: str, form: Form = "explicit") -> str:
    """Return a hash of what a system's Programs follow from: all but its name, its numbers, its start and most
    settings."""
    tree = tree_from_system(system)
    tree["parameters"] = [(name, parameter.positive) for name, parameter in system.parameters.items()]
    tree["joints"] = {name: _without_start(joint) for name, joint in tree.get("joints", {}).items()}
    tree["coordinates"] = system.simulation.coordinates
    structure = json.dumps({key: x for key, x in tree.items() if key not in _NOT_STRUCTURE})
    return digest("system", formalism, form, system.simulation.multipliers, structure)


def _without_start(joint: Mapping[str, Any]) -> dict[str, Any]:
    return {key: x for key, x in joint.items() if key != "initial"}
