"""The general theorems along every example: 1e-9 beside the sum of absolute terms, at each instant and as integrals."""

from __future__ import annotations

import pytest
from twins import FILES, from_file

import multibody_sym as mbs

FEW = ["pendulum", "cart_pole", "gyroscope", "lift"]


def assert_theorems_hold(name: str, backend: str | None) -> None:
    system = from_file(name)
    kept, method = system.simulation.constraints, "dormand_prince_8"
    # So near the rounding of a stiff rod's force radau_5 has no longer steps than explicit methods.
    instead = "projection" if kept is not None and kept.index_2 else None
    run = mbs.simulate(system, samples=3, rtol=1e-11, atol=1e-12, method=method, constraints=instead, backend=backend)
    assert {theorem: miss for theorem, miss in run.verified().items() if not miss.relative <= 1e-9} == {}


@pytest.mark.parametrize("name", FEW)
def test_along_a_handful(name: str) -> None:
    assert_theorems_hold(name, "python")


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_along_every_example(name: str) -> None:
    assert_theorems_hold(name, None)
