"""Energies and centres of impacts in examples that are zero but for rounding."""

from __future__ import annotations

from pathlib import Path

import multibody_sym as mbs


def test_energies_and_centres_that_are_rounding_are_zero() -> None:
    """Elastic blocks one after the other lose nothing; a rod that is dropped on its end turns about a point beside."""
    examples = Path(__file__).parents[2] / "examples/impacts"
    lost = mbs.solve(mbs.load(examples / "eleven_rods.yaml")).impact.energy_lost
    assert lost.value == 0.0
    centres = mbs.solve(mbs.load(examples / "dropped_rod.yaml")).impact.instantaneous_centres
    assert centres["rod"]["centre"][1] == 0.0
