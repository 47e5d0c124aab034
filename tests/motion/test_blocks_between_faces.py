"""Blocks in a corner of several faces: what each face carries is not unique, and some carry nothing."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

import multibody_sym as mbs

CORNER = """\
multibody_sym: 1
name: in a corner
gravity: [0, -9.81, 0]
bodies:
  held: {mass: 10}
  swinging: {mass: 1.52}
  ground:
    surfaces:
      face1: {plane: [0, 0, 0], normal: [0.537977, 0.842959, 0]}
      face2: {plane: [0, 0, 0], normal: [0.842959, -0.537977, 0]}
      face3: {plane: [0, 0, 0], normal: [-0.107592, 0.994195, 0]}
      face4: {plane: [0, 0, 0], normal: [0.994195, 0.107592, 0]}
joints:
  j1: {type: point, parent: ground, child: held, q: [x1, y1]}
  j2: {type: point, parent: ground, child: swinging, q: [x, y], initial: {q: [0.8, 0.3]}}
forces:
  pull1: {type: force, on: held, value: [183.448, -230.129, 0]}
  pull2: {type: force, on: swinging, value: [-7.797, 20.293, 0]}
contacts:
  c1: {between: [held, ground.face1], static: 0.3, restitution: 0}
  c2: {between: [held, ground.face2], static: 0.7, restitution: 1}
  c3: {between: [held, ground.face3], static: enough, restitution: 1}
  c4: {between: [held, ground.face4], static: 0.1, restitution: 0.5}
constraints:
  rope1: {type: rope, path: [held, swinging], slack: true, restitution: 0.5}
  rope2: {type: rope, path: [held, swinging], slack: true, restitution: 1}
"""
"""Both ropes are as long, and struck when the other block has swung around: it was refused, "no state lasts"."""


def test_a_face_at_both_its_limits_carries_nothing() -> None:
    run = mbs.simulate(mbs.loads(CORNER), t_end=1)
    assert np.abs(run.q[:, :2]).max() < 1e-12
    last = run.events[-1]
    assert (last["kind"], round(last["t"], 2)) == ("taut", 0.81)
    assert abs(run.energy_residual) < 1e-9

    long, pull = np.hypot(0.8, 0.3), np.array([-7.797, 20.293 - 1.52 * 9.81]) / 1.52
    x, y, dx, dy = [run[name][850] for name in ("x", "y", "u_x", "u_y")]

    def swings(_: float, s: np.ndarray) -> list[float]:
        return [s[1], (pull[1] * np.cos(s[0]) - pull[0] * np.sin(s[0])) / long]

    angle = np.arctan2(y, x)
    start = [angle, (dy * np.cos(angle) - dx * np.sin(angle)) / long]
    end = solve_ivp(swings, (0.85, 1.0), start, rtol=1e-11, atol=1e-12).y[0, -1]
    np.testing.assert_allclose([run["x"][-1], run["y"][-1]], [long * np.cos(end), long * np.sin(end)], atol=1e-7)
