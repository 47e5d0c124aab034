"""Four-bars with rough pins: friction in each pin is mu times its radius times the length of its reaction."""

from __future__ import annotations

from math import hypot, sin

import pytest

import multibody_sym as mbs

BARS = """
multibody_sym: 1
name: four_bar
gravity: [0, -9.81, 0]
bodies:
  ground: {{points: {{d: [1, 0, 0]}}}}
  b0: {{mass: 1, com: [0.2, 0, 0], inertia: {{Izz: 0.01}}, points: {{e: [0.4, 0, 0]}}}}
  b1: {{mass: 1, com: [0.5, 0, 0], inertia: {{Izz: 0.08}}, points: {{e: [1, 0, 0]}}}}
  b2: {{mass: 1, com: [0.4, 0, 0], inertia: {{Izz: 0.05}}, points: {{e: [0.8, 0, 0]}}}}
joints:
  A: {{type: revolute, parent: ground, child: b0, axis: z, q: q0, initial: {{q: 1, u: {speed}, known: true}}}}
  B: {{type: revolute, parent: b0.e, child: b1, axis: z, q: q1}}
  D: {{type: revolute, parent: ground.d, child: b2, axis: z, q: q2, initial: {{q: 1.5}}}}
  C: {{type: revolute, parent: b1.e, child: b2.e, axis: z, cut: true}}
forces: {{{forces}}}
simulation: {{t_end: 0.5 s}}
"""
MU, RADIUS = 0.3, 0.05


def bars(pins: str, speed: float) -> mbs.System:
    law = f"static: {MU}, kinetic: {MU}, radius: {RADIUS}"
    forces = ", ".join(f"f{pin}: {{type: friction, joint: {pin}, {law}}}" for pin in pins)
    return mbs.loads(BARS.format(speed=speed, forces=forces))


@pytest.mark.parametrize("speed", [0.0, 3.0])
@pytest.mark.parametrize("pins", ["ABD", "AB"])
def test_couples_of_all_pins_are_at_their_limit_where_they_slide(pins: str, speed: float) -> None:
    found = mbs.solve(bars(pins, speed))
    for pin in pins:
        force = found.reactions[pin]
        limit = MU * RADIUS * hypot(force["fx"].value, force["fy"].value)
        couple = abs(found.reactions[f"f{pin}"]["friction"].value)
        assert found.states[f"f{pin}"].startswith("slide")
        assert couple == pytest.approx(limit, rel=1e-9)


def test_friction_takes_what_the_energy_loses() -> None:
    run = mbs.simulate(bars("A", 0.0))
    assert run.friction_work["fA"].total < 0.0
    assert abs(run.energy_residual) < 1e-8


MASSLESS = """
multibody_sym: 1
name: massless
gravity: [0, -9.81, 0]
bodies:
  swing: {shape: {rod: 0.783, mass: 2.45}, points: {e: [0.783, 0, 0]}}
  near: {mass: 0, points: {e: [0.769, 0, 0]}}
  far: {mass: 0, points: {e: [1.152, 0, 0]}}
  weight: {shape: {rod: 0.582, mass: 0.175}}
joints:
  o:
    type: revolute
    parent: ground
    child: swing
    initial: {q: -0.522, u: 3.326}
    limits: {lower: -1.02, upper: -0.284, restitution: 0}
  A: {type: revolute, parent: swing.e, child: near, initial: {q: -0.26, u: 0.758}}
  B: {type: revolute, parent: near.e, child: far, q: b, initial: {q: -0.104}}
  C: {type: revolute, parent: far.e, child: weight, initial: {q: -0.048, u: 0.167}}
forces:
  held: {type: friction, joint: o, static: 1.5, radius: 0.032}
  rub: {type: friction, joint: A, static: 0.1, radius: 0.045}
"""


def test_friction_that_makes_all_of_what_presses_it_is_named() -> None:
    """Two massless links push along the outer one, whose line comes to touch the circle of friction, of radius mu r."""
    with pytest.raises(mbs.MultibodyError, match=r"friction jams at .*: rub makes nearly all") as failed:
        mbs.simulate(mbs.loads(MASSLESS), t_end=1, samples=1001)
    b = failed.value.trajectory["b"][-1]
    assert 0.0045 < 0.769 * abs(sin(b)) < 0.02
