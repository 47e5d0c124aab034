"""Source code of a system's Programs, with a table of names and a self-test, in a folder of its own."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.codegen.languages import LANGUAGES
from multibody_sym.codegen.selftest import Samples, spread_samples
from multibody_sym.dynamics.programs.switching import switchings
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.routes import FORMALISMS, verify_formalism
from multibody_sym.dynamics.start.state import examined_state, with_numbers_as_data
from multibody_sym.errors import InputError, at, shown
from multibody_sym.formats.files import path_name
from multibody_sym.model.declaration.doors import flag
from multibody_sym.model.declaration.doors import text as text_of
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.model.resolution.force_places import reasons
from multibody_sym.program.folding import folded
from multibody_sym.program.interpreter import interpret
from multibody_sym.program.program import Program
from multibody_sym.simulation.export_files import write_export
from multibody_sym.simulation.recall import formalism_name

_SAMPLES: Final = 2


def export(
    system: System,
    to: str,
    directory: str | os.PathLike[str],
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
    fold: bool = False,
) -> list[Path]:
    """Write a system's Programs as source code with a self-test and `names.json`; return the files.

    Neither C nor Python needs this package then; `integrate.py` beside the latter shows a loop that integrates it.

    Arguments: `to`, "c" or "python"; `directory`, made if need be; `parameters` .. `project`, what the call changes of
    the system (`Changes`); `formalism` by name, None for the cheapest; `fold` puts the values of all parameters into
    the code, which then reads none.
    Raises InputError for what the model contradicts and for files in the folder that no export wrote, NoSolutionError
    without a start, OutputError.
    """
    fold, folder = flag("fold", fold), path_name(directory, "a folder")
    if text_of("to", to) not in LANGUAGES:
        with at("to"):
            raise InputError(f"there is no language {shown(to)}", number="M104", word=to, known=LANGUAGES)
    asked = Changes(parameters, initial, inputs, coordinates, project).of(system)
    verify_formalism(formalism)
    placed = with_numbers_as_data(examined_state(asked))
    resolved, begin = placed.mechanism, placed.start
    name = formalism_name(formalism, resolved)
    made = programs(resolved, FORMALISMS[name]).exported()
    state = (0.0, begin.q, begin.u, begin.parameters)
    samples = _samples(made, state)
    if fold:
        made = {key: folded(program, "parameters", begin.parameters) for key, program in made.items()}
        samples = {key: [(*s[:3], begin.parameters, *s[4:]) for s in listed] for key, listed in samples.items()}
    texts = LANGUAGES[to].files(made, samples)
    ends = [f"{one.part.name if one.part else one.element.name} {one.told}" for one in switchings(resolved)]
    mode = {"mode": placed.words, "mode_ends": ends} if resolved.one_way else {}
    table = {"formalism": name, "folded": fold, **mode, **_names(resolved, state), "programs": _signatures(made)}
    return write_export(Path(folder), texts, table)


def _samples(made: Mapping[str, Program], state: tuple[ArrayLike, ...]) -> Samples:
    """Return the start and a few other states as samples for each Program."""
    inputs = interpret(made["inputs"], *state)[0]
    others = spread_samples(made, _SAMPLES)
    return {name: [_arguments(program, (*state, inputs, np.empty(0))), *others[name]] for name, program in made.items()}


def _arguments(program: Program, values: tuple[ArrayLike, ...]) -> list[ArrayLike]:
    return list(values[: len(program.inputs)])


def _names(resolved: Mechanism, state: tuple[Any, ...]) -> dict[str, Any]:
    """Return what the entries of the arrays stand for, with the values at the start."""
    _, q, u, parameters = state
    told = MechanismUnits(resolved)
    return {
        "system": resolved.name,
        "coordinates": [
            {"name": c.name, "unit": c.unit, "initial": x} for c, x in zip(resolved.coordinates, q, strict=True)
        ],
        "speeds": [{"name": s.name, "unit": s.unit, "initial": x} for s, x in zip(resolved.speeds, u, strict=True)],
        "parameters": [
            {"name": p.name, "unit": told.parameters[p.name], "value": x}
            for p, x in zip(resolved.parameters, parameters, strict=True)
        ],
        "inputs": list(resolved.inputs),
        "driving_inputs": list(resolved.driving_inputs),
        "outputs": list(resolved.outputs),
        "withheld_outputs": list(resolved.untold),
        "withheld_reasons": reasons(resolved.withheld),
        "constraints": [row.name for row in resolved.rows],
        "units": {"inputs": told.inputs, "outputs": told.outputs, "constraints": told.multipliers},
    }


def _signatures(made: Mapping[str, Program]) -> dict[str, Any]:
    return {
        name: {
            "inputs": {array.name: array.shape for array in program.inputs},
            "outputs": {output.name: output.shape for output in program.outputs},
        }
        for name, program in made.items()
    }
