"""Two ropes between the same bodies: one carries, the other is neither loose nor has anything to hold."""

from __future__ import annotations

from typing import Any

import pytest

import multibody_sym as mbs

ROPES = """
multibody_sym: 1
name: ropes
gravity: [0, -9.81, 0]
bodies:
  bead: {mass: 0.1}
  block: {mass: 1.49}
  ground: {surfaces: {slope: {plane: [0, 0, 0], normal: [0.151475, 0.988461, 0]}}}
joints:
  j1: {type: point, parent: ground, child: bead, q: [x1, y1], initial: {q: [0, 0]}}
  j2: {type: point, parent: ground, child: block, q: [x2, y2], initial: {q: [0.8, 0.3]}}
forces: {pull: {type: force, on: block, value: [12.784, 3.801, 0]}}
contacts: {c: {between: [bead, ground.slope], static: 0, restitution: 0}}
constraints:
"""
ONE = "  rope: {type: rope, path: [bead, block], slack: true, restitution: 1}\n"
OTHER = "  other: {type: rope, path: [bead, block], slack: true, restitution: 0}\n"


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_rope_that_holds_nothing_changes_no_step(backend: Any) -> None:
    """Off the constraints, between two steps, it would be loose and taut again; 12,000 steps were taken for 235."""
    one, both = (mbs.simulate(mbs.loads(ROPES + ropes), t_end=0.7, backend=backend) for ropes in (ONE, ONE + OTHER))
    assert both.statistics["steps"] == one.statistics["steps"]
    assert both.q[-1] == pytest.approx(one.q[-1], abs=1e-11)
    assert both.changes == one.changes == []


@pytest.fixture(scope="module")
def prepared() -> list[mbs.Prepared]:
    """One rope, and both, ready to run."""
    return [mbs.prepare(mbs.loads(ROPES + ropes)) for ropes in (ONE, ONE + OTHER)]


@pytest.mark.parametrize("t_end", [0.75, 0.95, 1.0, 1.01, 1.1])
def test_a_rope_that_becomes_taut_with_another_began_no_flight_before(
    t_end: float, prepared: list[mbs.Prepared]
) -> None:
    """It closes at a rate that is rounding: half a second ago was when it would have begun to."""
    one, both = (ready.run(t_end=t_end) for ready in prepared)
    assert both.q[-1] == pytest.approx(one.q[-1], abs=1e-9)
    times = [leg.problem.start for leg in both.modes.legs]
    assert times == sorted(times)
    assert times[1:] == pytest.approx([0.909383737] * len(times[1:]), abs=1e-8)
