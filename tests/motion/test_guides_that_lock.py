"""A guide that locks itself while what it guides moves: friction stops it at once, at a place that is known."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

HEAVY, MU = 3.0, 0.8
SLIDERS = f"""
multibody_sym: 1
name: sliders
gravity: [0, 0, 0]
bodies: {{a: {{mass: LIGHT}}, b: {{mass: {HEAVY}}}}}
joints:
  ja: {{type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {{q: 0.9, u: -6}}}}
  jb: {{type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {{q: 0.4}}}}
constraints:
  rod: {{type: distance, between: [a, b], value: 1}}
forces:
  pull: {{type: force, on: b, value: [0, PULL, 0]}}
  rub: {{type: friction, joint: ja, static: {MU}}}
outputs: {{E: total_energy()}}
simulation: {{t_end: 0.1, samples: 11}}
"""


@pytest.mark.parametrize(("light", "pull"), [(0.02, 1), (0.02, 20), (0.02, 200), (0.2, 20)])
def test_a_slider_that_is_drawn_along_a_rough_guide_stops_where_the_guide_locks(light: float, pull: float) -> None:
    """By hand: the rod pulls with T, its slope is s = tan(angle).

        A: T (cos - mu sin) = m x'',   B: M y'' = P - T sin,   m s^2 - M mu s + M = 0 where T has no bound.

    With T > 0 before and behind, the speed v there has v dv = -c dm/m: nothing gets across, however fast it comes.
    """
    run = mbs.simulate(mbs.loads(SLIDERS.replace("LIGHT", str(light)).replace("PULL", str(pull))))
    slope = (HEAVY * MU - math.sqrt((HEAVY * MU) ** 2 - 4.0 * light * HEAVY)) / (2.0 * light)
    angle = math.atan(slope)
    assert run.q[-1].tolist() == pytest.approx([math.cos(angle), math.sin(angle)], abs=1e-6)
    assert run.u[-1].tolist() == [0.0, 0.0]
    assert [event["kind"] for event in run.events] == ["stick"]
    assert run.impact_losses["rub"] > 1.0
    energy = float(run.outputs["E"][0])
    assert run.energy_residual == pytest.approx(0.0, abs=1e-6 * energy)
    taken = run.impact_losses["rub"] - run.friction_work["rub"].total
    assert taken == pytest.approx(energy + pull * (math.sin(angle) - float(run.q[0, 1])), rel=1e-6)
