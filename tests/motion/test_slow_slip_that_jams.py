"""A rough box on one corner: as slow slip turns, friction jams, an impact without collision stops it, and it sticks."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

BOX = """
multibody_sym: 1
name: box
gravity: [-1.94896111, 0, -9.61445313]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [0.355, 0.323, 0.354], mass: 0.177}}
contacts:
  c: {between: [box, ground.floor], static: 1.5, restitution: 0.5, open: true}
joints:
  free:
    type: free
    parent: ground
    child: box
    initial:
      q: [0.3132152054922735, 0.050769870522722346, 0.2475129674744354,
        0.888775452903575, -0.014830731780130729, 0.457117811800035, 0.030025819656738787]
      u: [1.4349673523021524, 0.09308538486499432, -0.23460721564499215,
        0.187021058149306, 5.6509238336937315, -0.16724694671745122]
forces: {push: {type: force, on: box, value: [1.917, 0, -0.3886]}}
simulation: {t_end: 1e-4}
"""


@pytest.mark.parametrize("samples", [2, 2001])
def test_a_jam_of_slow_slip_ends_it_and_no_time_is_lost(samples: int) -> None:
    """The slip, 2e-5 m/s, is far below 1e-6 of the box's speeds; the power of the push (2.7 W) shows lost time."""
    run = mbs.simulate(mbs.loads(BOX), samples=samples)
    assert [event["kind"] for event in run.events] == ["open", "slide", "stick"]
    assert run.events[-1]["t"] - run.events[0]["t"] < 2e-7
    assert run.energy_residual is not None
    assert abs(run.energy_residual) < 3e-8
