"""Parts of the runtime that a model does not enter are not compiled for it, and it runs to the same bits without."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.codegen.c import c_source
from multibody_sym.codegen.parts import parts_of
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.routes import FORMALISMS
from multibody_sym.program.program import Program
from multibody_sym.runtime.integration import integrate
from multibody_sym.runtime.loading import load_c
from multibody_sym.simulation.problem import problem_of, settings_of
from multibody_sym.simulation.runnable import runnable
from multibody_sym.simulation.settings import form_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def of_runs(system: mbs.System) -> dict[str, Program]:
    """Return the Programs that runs of a system call."""
    ready = runnable(system)
    form = form_of(system.simulation, constrained=bool(ready.mechanism.rows))
    return programs(ready.mechanism, FORMALISMS[ready.formalism], form).of_runs()


@pytest.mark.parametrize(
    ("name", "changes", "parts"),
    [
        ("double_pendulum", {}, set()),
        ("double_pendulum", {"method": "radau_5"}, {"implicit", "rows"}),
        ("four_bar", {}, {"rows"}),
    ],
)
def test_a_run_without_the_other_parts_has_the_bits_of_one_with_all(
    name: str, changes: dict[str, str], parts: set[str]
) -> None:
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    system = replace(system, simulation=replace(system.simulation, t_end=1, samples=11, **changes))
    made = of_runs(system)
    assert parts_of(made) == parts
    ready = runnable(system)
    signatures = [ready.compiled[program].signature for program in made]
    whole = load_c(signatures, f"whole {name} {changes}", lambda: c_source(made))
    assert whole.path != ready.compiled.path
    found, wanted = (integrate(problem_of(each, settings_of(each))) for each in (ready, replace(ready, compiled=whole)))
    assert found.statistics == wanted.statistics
    np.testing.assert_array_equal(np.hstack([found.q, found.u]), np.hstack([wanted.q, wanted.u]))


def test_a_run_that_stops_may_come_into_modes_with_rows() -> None:
    system = mbs.load(EXAMPLES / "double_pendulum.yaml")
    assert parts_of(of_runs(replace(system, stop={"through": "theta1 < 0"}))) == {"events", "rows"}
