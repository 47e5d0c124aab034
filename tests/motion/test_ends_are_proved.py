"""Runs that end say what is proved, or what was not found and what was tried."""

from __future__ import annotations

from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.motion.loop import python_loop
from multibody_sym.motion.switching import prepared

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


def test_a_rope_without_a_side_keeps_that_of_its_start_until_it_comes_off() -> None:
    """b hangs at (0.1, -1 - s) beside the drum: the rope lies around none of it where a is above b, at x = 0.1."""
    with pytest.raises(mbs.RunError, match=r"rope comes off drum at t = 0\.19") as caught:
        mbs.simulate(mbs.loads(OVER.replace("WRAP", "")), t_end=0.4, samples=3)
    x, y, _ = caught.value.trajectory.integration.q_final
    assert x == pytest.approx(0.1, abs=1e-6)
    assert y > 0.0
    free, held = (
        mbs.simulate(mbs.loads(OVER.replace("WRAP", wrap)), t_end=0.17, samples=3)
        for wrap in ("", ', wrap: {drum: "-"}')
    )
    assert free.q == pytest.approx(held.q, abs=1e-12)
    assert abs(free.energy_residual) < 1e-8


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
    monkeypatch.setattr(prepared.Returns, "to", lambda returns, time, mode: 21)
    with pytest.raises(mbs.RunError, match=r"no state of .* was found that lasts: 21 times the same one followed"):
        mbs.simulate(mbs.loads(STUCK), t_end=1, samples=3)


@pytest.mark.parametrize(
    ("backend", "steps", "cause"),
    [("c", 1 << 17, "next to nothing resists u_phi there: masses .* its axis"), ("python", 1 << 12, "phi is stiff")],
)
def test_masses_that_come_onto_the_axis_about_which_they_turn_are_named(
    monkeypatch: pytest.MonkeyPatch, backend: Any, steps: int, cause: str
) -> None:
    """A bead slides inwards on a light arm that a motor with a damper drives: steps shorten as r^2, without end."""
    model = """
multibody_sym: 1
name: arm
gravity: [0, 0, 0]
bodies: {arm: {mass: 0.001}, bead: {mass: 1}}
joints:
  A: {type: revolute, parent: ground, child: arm, axis: z, q: phi, initial: {u: 1}}
  S: {type: prismatic, parent: arm, child: bead, axis: x, q: r, initial: {q: 0.3, u: -1}}
forces:
  drag: {type: damper, joint: A, damping: 15}
  drive: {type: torque, on: arm, value: [0, 0, 15]}
"""
    monkeypatch.setattr(python_loop, "LEAST_PACE", steps)
    with pytest.raises(mbs.RunError, match=f"takes ever more steps, {steps} by now, .*: {cause}") as caught:
        mbs.simulate(mbs.loads(model), t_end=1.0, samples=3, backend=backend)
    assert 0.0 < caught.value.trajectory.final["coordinates"]["r"] < 0.01
