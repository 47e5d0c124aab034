"""Runs that end say what is proved, or what was not found and what was tried."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.simulation.one_way import chained

OVER = """
multibody_sym: 1
name: thrown_over
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {post: [0, 0, 0], side: [0.1, -1, 0]}}
  a: {mass: 0.1}
  b: {mass: 5}
joints:
  A: {type: point, parent: ground, child: a, q: [x, y], initial: {q: [-0.5, 1.5], u: [3, 1]}}
  B: {type: prismatic, parent: ground.side, child: b, axis: -y, q: s}
pulleys: {drum: {at: ground.post, radius: 0.1, rough: 0.2}}
constraints: {rope: {type: rope, path: [a, drum, b]WRAP}}
"""


def test_a_rope_that_would_change_to_the_other_side_of_a_wheel_names_both() -> None:
    """b hangs at (0.1, -1 - s): a is in one line with it and the centre where x (1 + s) = -0.1 y."""
    with pytest.raises(mbs.RunError, match=r"rope comes there to the line through the centre of drum") as caught:
        mbs.simulate(mbs.loads(OVER.replace("WRAP", "")), t_end=0.4, samples=3)
    assert 'wrap: {drum: "-"} keeps it' in str(caught.value)
    done = caught.value.trajectory.integration
    x, y, s = done.q_final
    assert x * (1.0 + s) == pytest.approx(-0.1 * y, abs=1e-6)
    held = mbs.simulate(mbs.loads(OVER.replace("WRAP", ', wrap: {drum: "-"}')), t_end=0.17, samples=3)
    assert abs(held.energy_residual) < 1e-8


STUCK = """
multibody_sym: 1
name: pushed
gravity: [0, -9.81, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, a: {mass: 1}}
joints: {A: {type: point, parent: ground, child: a, q: [x, y]}}
contacts: {c: {between: [a, ground.floor], static: 0.3}}
forces: {push: {type: force, on: a, value: [6*sin(5*t), 0, 0]}}
"""


def test_states_that_follow_each_other_without_time_are_told_as_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chained.Returns, "to", lambda returns, time, mode: 21)
    with pytest.raises(mbs.RunError, match=r"no state of .* was found that lasts: 21 times the same one followed"):
        mbs.simulate(mbs.loads(STUCK), t_end=1, samples=3)
