"""Stops of joints that rub: what runs into one rests there, and friction need not hold it as well."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs


@pytest.mark.parametrize("friction", ["static: 0.5", "kinetic: 0.5"])
def test_a_slider_that_rubs_runs_into_its_stop_and_rests(friction: str) -> None:
    """30 N less 0.5 * 20 N of friction on 2 kg: 10 m/s^2 over 0.5 m."""
    run = mbs.simulate(
        mbs.loads(f"""multibody_sym: 1
name: case
gravity: [0, -10, 0]
bodies: {{b: {{mass: 2}}}}
joints:
  j:
    {{type: prismatic, parent: ground, child: b, axis: x, q: s,
     limits: {{lower: 0, upper: 1, restitution: 0}}, initial: {{q: 0.5}}}}
forces:
  f: {{type: force, on: b, value: [-30, 0, 0]}}
  rub: {{type: friction, joint: j, {friction}}}
"""),
        t_end=1.0,
        samples=11,
    )
    assert [event["t"] for event in run.events] == pytest.approx([math.sqrt(0.1)] * len(run.events), rel=1e-9)
    assert "j.lower" in {event["element"] for event in run.events}
    assert abs(run["s"][-1]) < 1e-14
    assert run["u_s"][-1] == 0.0
