"""All routes give the same motion: random trees of 1-12 bodies, masses 1e-3 to 1e3, with and without rows.

A route's accelerations and multipliers are put into the equations of motion of d'Alembert's principle, body by body.
"""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

from multibody_sym.dynamics.agreement import LARGEST_ON_TREES, LARGEST_WITH_ROWS, ratio
from multibody_sym.dynamics.dalembert import dalembert
from multibody_sym.dynamics.formalisms import FORMALISMS
from multibody_sym.dynamics.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.programs import programs
from multibody_sym.program.interpreter import interpret

NUMERIC = {name: FORMALISMS[name] for name in ("composite_body", "block_ldl")}
BLOCKS = 10


def worst_ratio(case: Case) -> float:
    """Return the worst ratio of a case's routes over floats, and of the Program that one of them gives."""
    t, q, u = random_state(np.random.default_rng(case.seed), case)
    state = case.state(t, q, u)
    reference = dalembert(case.motion(t, q, u))
    ratios = [ratio(reference, *accelerations(route(case.mechanism, state))) for route in NUMERIC.values()]
    name = sorted(NUMERIC)[case.seed % 2]
    return max(*ratios, ratio(reference, *program_accelerations(case, name, t, q, u)))


def accelerations(dynamics):
    found = forward_dynamics(dynamics)
    return found.udot, found.multipliers


def program_accelerations(case: Case, name: str, t: float, q: list[float], u: list[float]):
    made = programs(case.mechanism, FORMALISMS[name])
    inputs, = interpret(made.inputs, t, q, u, case.parameters)
    _, udot, multipliers, _ = interpret(made.state_derivative, t, q, u, case.parameters, inputs, [])
    return udot, multipliers


@pytest.mark.parametrize("block", range(BLOCKS))
def test_trees_agree(block: int) -> None:
    for seed in range(25 * block, 25 * block + 25):
        assert worst_ratio(random_case(seed)) <= LARGEST_ON_TREES, seed


@pytest.mark.parametrize("block", range(BLOCKS))
def test_constrained_systems_agree(block: int) -> None:
    for seed in range(25 * block, 25 * block + 25):
        assert worst_ratio(random_case(seed, rows=True)) <= LARGEST_WITH_ROWS, seed
