"""Four-bars with rough pins: friction in each pin is mu times its radius times the length of its reaction."""

from __future__ import annotations

from math import hypot

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
