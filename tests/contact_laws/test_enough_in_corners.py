"""Corners between three faces, one of which never lets a body slip: Lemke's method proposed no mode for it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

import multibody_sym as mbs
from multibody_sym.dynamics.start.state import examined_state

MODEL = """\
multibody_sym: 1
name: corners
gravity: [0, -9.81, 0]
bodies:
  b1: {mass: 0.1}
  b2: {mass: 10.0}
  b3: {mass: 2.93}
  ground:
    surfaces:
      face1: {plane: [0.0, 0.0, 0], normal: [0.833683, 0.552244, 0]}
      face2: {plane: [0.0, 0.0, 0], normal: [0.552244, -0.833683, 0]}
      face3: {plane: [0.8, 0.3, 0], normal: [-0.780739, 0.624858, 0]}
      face4: {plane: [0.8, 0.3, 0], normal: [0.624858, 0.780739, 0]}
      face5: {plane: [1.6, 0.6, 0], normal: [-0.432042, 0.901853, 0]}
      face6: {plane: [1.6, 0.6, 0], normal: [0.901853, 0.432042, 0]}
      face7: {plane: [0.0, 0.0, 0], normal: [-0.232587, 0.972576, 0]}
      face8: {plane: [0.8, 0.3, 0], normal: [0.995815, -0.091393, 0]}
    motion: {x: 0.0246*sin(2.916*t)}
joints:
  j1: {type: point, parent: ground, child: b1, q: [b1_x, b1_y], initial: {q: [0.0, 0.0]}}
  j2: {type: point, parent: ground, child: b2, q: [b2_x, b2_y], initial: {q: [0.8, 0.3]}}
  j3: {type: point, parent: ground, child: b3, q: [b3_x, b3_y], initial: {q: [1.6, 0.6]}}
forces:
  pull1: {type: force, on: b1, value: [0.019, -0.021, 0]}
  pull2: {type: force, on: b2, value: [4.917, -182.922, 0]}
  pull3: {type: force, on: b3, value: [0.0, -0.556, 0]}
contacts:
  c1: {between: [b1, ground.face1], static: 0.3}
  c2: {between: [b1, ground.face2], static: enough}
  c3: {between: [b2, ground.face3], static: 0.1}
  c4: {between: [b2, ground.face4], static: 1.5}
  c5: {between: [b3, ground.face5], static: 0.1}
  c6: {between: [b3, ground.face6], static: 0.3}
  c7: {between: [b1, ground.face7], static: 1.5}
  c8: {between: [b2, ground.face8], static: enough}
"""


def test_bodies_that_several_faces_may_hold_have_a_state() -> None:
    """A linear program finds forces that hold all of it at rest, within friction; so there is a state."""
    state = examined_state(mbs.loads(MODEL))
    assert state.posed is not None
    assert state.found is not None
    laws = state.posed.problem
    W, unit = laws.matrix @ laws.exerted.T + laws.coupling, np.eye(len(laws.right))
    within = [-unit[k] for part in laws.parts for k in part.normals]
    for part in (part for part in laws.parts if not part.enough):
        normal = sum(unit[k] for k in part.normals)
        within += [sign * unit[part.rows[0]] - part.static * normal for sign in (1.0, -1.0)]
    held = linprog(np.zeros(len(W)), np.array(within), np.zeros(len(within)), W, laws.right, (None, None))
    assert held.status == 0
    assert state.found.states
    assert state.found.states[0].x == pytest.approx(laws.exerted.T @ held.x, abs=1e-6)
