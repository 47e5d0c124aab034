"""Belts, which come back to the wheel where they begin, and bands that brake a drum."""

from __future__ import annotations

import math

import pytest
from solved_starts import solved_start

import multibody_sym as mbs
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.state import StartState, examined_state


def acting(text: str) -> tuple[StartState, StateQuantities]:
    """Return the start of a model in the mode that the law finds, solved."""
    found = examined_state(mbs.loads(text))
    return found, solved_start(found.mechanism, found.start, "block_ldl")


BRAKE = """\
multibody_sym: 1
name: band_brake
parameters: {mu: 0.3, F: 100, R: 0.2}
bodies:
  ground: {points: {hub: [0, 0, 0], pin: [0.2, -1, 0], fulcrum: [-0.6, -1, 0]}}
  drum: {shape: {disc: R, mass: 50}}
  lever: {mass: 0.5, inertia: {Izz: 0.1}, points: {band: [0.4, 0, 0], end: [1.2, 0, 0]}}
joints:
  axle: {type: revolute, parent: ground.hub, child: drum, q: phi, initial: {u: SPIN}}
  lever: {type: revolute, parent: ground.fulcrum, child: lever, q: angle}
pulleys: {drum: {body: drum, radius: R, rough: mu}}
constraints: {band: {type: rope, path: [lever.band, drum, ground.pin]}}
forces: {hand: {type: force, on: lever, at: end, value: [0, -F, 0]}}
outputs: {loose: "tension(band, 1)", tight: "tension(band, 2)"}
"""


@pytest.mark.parametrize(("spin", "tight"), [(30.0, 2), (-30.0, 1)])
def test_a_band_brake_holds_with_its_loose_end_on_the_lever(spin: float, tight: int) -> None:
    """The band's lever side has T = F 1.2/0.4; over half the drum T2/T1 = exp(mu pi), as the drum turns.

    Path: up from the lever on the left, over the top, down to the pin: clockwise. A drum that turns counter-clockwise
    drags the band back, towards the lever, so that the pin's side is tight.
    """
    found, at = acting(BRAKE.replace("SPIN", str(spin)))
    assert found.words["drum"] == ("slip+" if spin > 0 else "slip-")
    lever, pin = at.tensions["band.1"], at.tensions["band.2"]
    ratio = math.exp(0.3 * math.pi) if tight == 2 else math.exp(-0.3 * math.pi)
    assert lever == pytest.approx(100 * 1.2 / 0.4, rel=1e-12)
    assert pin / lever == pytest.approx(ratio, rel=1e-12)
    assert at.udot[0] == pytest.approx((lever - pin) * 0.2 / (50 * 0.2**2 / 2), rel=1e-12)


def test_a_drum_at_rest_is_held_by_its_band() -> None:
    found, at = acting(BRAKE.replace("SPIN", "0"))
    assert found.words["drum"] == "grip"
    assert at.udot == pytest.approx([0.0, 0.0], abs=1e-12)
