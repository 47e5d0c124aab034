"""Random systems of blocks, slopes, stacks and ropes: the state found is the one that trying all of them finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from random_friction import World, random_world, system_of, the_state
from random_loops import blocks

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.mechanics.motion import state_of


def _size(world: World, wanted: np.ndarray) -> float:
    return max(float(np.abs(wanted).max()), world.gravity)


def _compared(seed: int) -> None:
    world = random_world(seed)
    (wanted,) = the_state(world)
    found = examined_state(system_of(world))
    begin = found.start
    state = state_of(found.mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
    udot = forward_dynamics(composite_body(found.mechanism, state)).udot.reshape(-1, 2)
    assert np.abs(udot - wanted.accelerations).max() <= 1e-8 * _size(world, wanted.accelerations), seed


@pytest.mark.parametrize("block", blocks(4, quick=2))
def test_the_state_is_the_one_that_all_others_contradict(block: int) -> None:
    for seed in range(10 * block, 10 * block + 10):
        _compared(seed)


def test_a_rope_does_not_push_a_gram_beside_a_heavy_block() -> None:
    """The least block slides freely with g sin(angle); kept taut, its rope would push with 1.2e-7 N."""
    world = random_world(2864)
    (state,) = the_state(world)
    assert state.accelerations[2][0] == pytest.approx(-world.gravity * math.sin(world.angles[2]), rel=1e-12)
    _compared(2864)


@pytest.mark.parametrize("seed", [3, 17])
def test_solve_tells_that_state(seed: int) -> None:
    world = random_world(seed)
    (wanted,) = the_state(world)
    solution = mbs.solve(system_of(world))
    found = np.array([[solution.accelerations[f"j{i}_{x}"].value for x in "xy"] for i in range(len(world.masses))])
    assert np.abs(found - wanted.accelerations).max() <= 1e-8 * _size(world, wanted.accelerations)
    largest = max(float(np.abs(wanted.normals).max()), 1e-300)
    for k, contact in enumerate(world.contacts):
        normal = solution.reactions[contact.name]["normal"]
        if normal.unique:
            assert (normal.value or 0.0) == pytest.approx(wanted.normals[k], abs=1e-8 * largest)


@pytest.mark.long
@pytest.mark.parametrize("start", range(1000, 3000, 100))
def test_the_state_is_right_in_many_systems(start: int) -> None:
    for seed in range(start, start + 100):
        _compared(seed)
