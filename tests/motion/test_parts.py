"""Parts of the runtime that a model does not enter are not compiled for it, and it runs to the same bits without."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.methods.multistep import MULTISTEP
from multibody_sym.motion.methods.table import LOOKING_BACK, METHODS
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of
from multibody_sym.motion.prepare.settings import form_of
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load_c
from multibody_sym.program.program import Program
from multibody_sym.program.target_layout import parts_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def of_runs(system: mbs.System) -> tuple[dict[str, Program], frozenset[str]]:
    """Return the Programs that runs of a system call, and the parts of the runtime that they enter."""
    ready = prepare_system(system)
    form = form_of(system.simulation, constrained=bool(ready.mechanism.rows))
    made = programs(ready.mechanism, FORMALISMS[ready.formalism], form).of_runs()
    return made, parts_of(made, multistep=form == "multistep")


@pytest.mark.parametrize(
    ("name", "changes", "parts"),
    [
        ("double_pendulum", {}, set()),
        ("double_pendulum", {"method": "stoermer_6", "step": 0.01}, {"multistep"}),
        ("double_pendulum", {"method": "radau_5"}, {"implicit", "rows"}),
        ("four_bar", {}, {"rows"}),
    ],
)
def test_a_run_without_the_other_parts_has_the_bits_of_one_with_all(
    name: str, changes: dict[str, Any], parts: set[str]
) -> None:
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    system = replace(system, simulation=replace(system.simulation, t_end=1, samples=11, **changes))
    made, entered = of_runs(system)
    assert entered == parts
    ready = prepare_system(system)
    signatures = [ready.compiled[program].signature for program in made]
    whole = load_c(signatures, f"whole {name} {changes}", lambda: c_source(made))
    assert whole.path != ready.compiled.path
    found, wanted = (integrate(problem_of(each, settings_of(each))) for each in (ready, replace(ready, compiled=whole)))
    assert found.statistics == wanted.statistics
    np.testing.assert_array_equal(np.hstack([found.q, found.u]), np.hstack([wanted.q, wanted.u]))


def test_a_run_that_stops_may_come_into_modes_with_rows() -> None:
    system = mbs.load(EXAMPLES / "double_pendulum.yaml")
    _, entered = of_runs(replace(system, stop={"through": "theta1 < 0"}))
    assert entered == {"events", "rows"}


def test_methods_that_look_back_are_told_by_their_names() -> None:
    assert set(LOOKING_BACK) == set(MULTISTEP)


def test_a_method_that_was_left_out_is_told() -> None:
    ready = prepare_system(mbs.load(EXAMPLES / "double_pendulum.yaml"))
    problem = replace(problem_of(ready, settings_of(ready)), method=METHODS["stoermer_6"], step=0.01)
    with pytest.raises(ValueError, match="stoermer_6 is not among the methods"):
        integrate(problem)


def test_what_is_never_run_comes_without_steps_that_look_back() -> None:
    made, _ = of_runs(mbs.load(EXAMPLES / "double_pendulum.yaml"))
    assert parts_of(made) == {"multistep"}
    assert parts_of({"energy": made["energy"]}) == set()
