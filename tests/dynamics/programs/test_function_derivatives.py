"""Derivatives along the tree against forward differentiation of whole Programs, over random trees of all joints."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.programs.function_derivatives import (
    Derivatives,
    Variable,
    differentiated,
    differentiated_accelerations,
    differentiated_forces,
)
from multibody_sym.dynamics.programs.state_functions import STATE_FUNCTIONS, FunctionOptions
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.program.program import Program, interpret

NEAR = 1e-11


def program(found: Derivatives) -> Program:
    """Return the Program of all derivatives, by names of results and variables."""
    return found.trace.finish({f"{name}_by_{by}": slope for (name, by), slope in found.slopes.items()})


def assert_same(found: Derivatives, forward: Derivatives, given: list[Any]) -> None:
    along, whole = program(found), program(forward)
    wanted = dict(zip((output.name for output in whole.outputs), interpret(whole, *given), strict=True))
    for output, slope in zip(along.outputs, interpret(along, *given), strict=True):
        size = max(1.0, float(np.abs(wanted[output.name]).max(initial=0.0)))
        np.testing.assert_allclose(slope, wanted[output.name], rtol=0, atol=NEAR * size, err_msg=output.name)


@pytest.mark.parametrize("seed", range(10))
def test_derivatives_along_a_tree_are_those_of_its_equations(seed: int) -> None:
    case = random_case(seed, bodies=(1, 4))
    resolved: Mechanism = case.mechanism
    rng, declared = np.random.default_rng(seed), tuple(resolved.inputs)[seed % 2 :]
    t, q, u = random_state(rng, case)
    given = [t, q, u, case.parameters, rng.standard_normal(len(resolved.inputs)), []]
    by: list[Variable] = ["q", "u", "t", "inputs"]
    options = FunctionOptions(FORMALISMS[cheapest(resolved)])
    whole, forces = (STATE_FUNCTIONS[name](resolved, options) for name in ("state_derivative", "inverse_dynamics"))
    found = differentiated_accelerations(resolved, whole, by, declared=declared)
    assert_same(found, differentiated(resolved, whole, by, declared=declared), given)
    by.append("udot")
    found = differentiated_forces(resolved, forces, by, declared=declared)
    forward = differentiated(resolved, forces, by, declared=declared)
    assert_same(found, forward, [*given, rng.standard_normal(len(u))])
