"""Equations of ropes and springs on the side on which they start, against the kinematics, which know none."""

from __future__ import annotations

import numpy as np

import multibody_sym as mbs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions

ATWOOD = """\
multibody_sym: 1
name: atwood
gravity: [0, -g, 0]
parameters:
  g: {value: 9.81, positive: true}
  m1: {value: 1, positive: true}
  m2: {value: 2, positive: true}
  R: {value: 0.1, positive: true}
  h: {value: 3, positive: true}
  k: {value: 50, positive: true}
bodies:
  ground: {points: {top: [0, h, 0], left: [-R, 0, 0], right: [R, 0, 0]}}
  one: {mass: m1}
  two: {mass: m2}
joints:
  L: {type: prismatic, parent: ground.left, child: one, axis: y, q: y1, initial: {q: 0.5}}
  N: {type: prismatic, parent: ground.right, child: two, axis: y, q: y2, initial: {q: -0.5}}
pulleys: {P: {at: ground.top, radius: R}}
constraints: {string: {type: rope, path: [one, P, two]}}
"""
SPRING = "forces: {spring: {type: spring_damper, between: [ground.left, one], stiffness: k, length: 0.2}}\n"


def test_equations_are_those_of_the_programs_on_that_side() -> None:
    """H and gamma of the derivation, which knows the side, against the kinematics, which knows none."""
    system = mbs.loads(ATWOOD.replace("axis: y, q: y1", "axis: [-0.6, -0.8, 0], q: y1") + SPRING)
    resolved = mechanism(system)
    begin = start(resolved)
    terms = mbs.derive(system).lambdify("terms")
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = [0.4 + rng.uniform(0, 1), rng.uniform(-1, 1)]
        u = rng.uniform(-1, 1, 2).tolist()
        _M, _f, H, gamma = terms(q, u)
        rows = row_motions(motion_of(resolved, state_of(resolved, float, 0.0, q, u, begin.parameters)))
        np.testing.assert_allclose(H, [row.jacobian for row in rows], atol=1e-13)
        np.testing.assert_allclose(gamma, [row.gamma for row in rows], atol=1e-12)
