"""Theorems hold for right accelerations only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.analysis.theorems.balance import instant_of, rates_of, theorems
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics

TENSOR = {"Ixx": 2, "Iyy": 3, "Izz": 4, "Ixy": 0.5}


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(15))
def test_hold_at_random_states(seed: int, rows: bool) -> None:
    case = random_case(seed, rows=rows)
    state = case.state(*random_state(np.random.default_rng(seed), case))
    found = forward_dynamics(composite_body(case.mechanism, state))
    at = instant_of(case.mechanism, rates_of(case.mechanism), state, found)
    assert max(theorems([at]).values()) < 1e-11


@pytest.mark.parametrize("rows", [False, True])
def test_power_theorem_sees_wrong_accelerations(rows: bool) -> None:
    for seed in range(5):
        case = random_case(seed, rows=rows)
        state = case.state(*random_state(np.random.default_rng(seed), case))
        found = forward_dynamics(composite_body(case.mechanism, state))
        wrong = replace(found, udot=found.udot * (1 + 1e-5) + 1e-5)
        residuals = theorems([instant_of(case.mechanism, rates_of(case.mechanism), state, wrong)])
        assert residuals["power"] > 1e-9
