"""Theorems hold for right accelerations only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.analysis.check import short_run_misses
from multibody_sym.dynamics.balance import balance_terms, rates_of, theorems
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State

TENSOR = {"Ixx": 2, "Iyy": 3, "Izz": 4, "Ixy": 0.5}


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(15))
def test_hold_at_random_states(seed: int, rows: bool) -> None:
    case = random_case(seed, rows=rows)
    state = case.state(*random_state(np.random.default_rng(seed), case))
    found = forward_dynamics(composite_body(case.mechanism, state))
    at = balance_terms(case.mechanism, rates_of(case.mechanism), state, found)
    assert max(theorems([at]).values()) < 1e-11


@pytest.mark.parametrize("rows", [False, True])
def test_power_theorem_sees_wrong_accelerations(rows: bool) -> None:
    for seed in range(5):
        case = random_case(seed, rows=rows)
        state = case.state(*random_state(np.random.default_rng(seed), case))
        found = forward_dynamics(composite_body(case.mechanism, state))
        wrong = replace(found, udot=found.udot * (1 + 1e-5) + 1e-5)
        residuals = theorems([balance_terms(case.mechanism, rates_of(case.mechanism), state, wrong)])
        assert residuals["power"] > 1e-9


@pytest.mark.parametrize("rows", [False, True])
def test_changes_along_a_short_run_are_impulses_and_work(rows: bool) -> None:
    for seed in range(3):
        case = random_case(seed, bodies=(1, 4), rows=rows)
        state = case.state(*random_state(np.random.default_rng(seed), case))
        found = short_run_misses(case.mechanism, composite_body, state)
        assert set(found) == {"impulse", "angular_impulse", "work"}
        assert max(found.values()) < 1e-10


def test_work_of_a_force_that_the_motion_does_not_feel_is_missed() -> None:
    for seed in range(20):
        case = random_case(seed, bodies=(1, 3))
        if len(case.mechanism.loads) and case.mechanism.speeds:
            break
    state = case.state(*random_state(np.random.default_rng(seed), case))

    def forgetful(mechanism: Mechanism, at: State) -> TreeDynamics:
        return composite_body(replace(mechanism, loads=()), at)

    assert short_run_misses(case.mechanism, forgetful, state)["work"] > 1e-6
