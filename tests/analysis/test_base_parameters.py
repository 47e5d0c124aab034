"""Base parameters: those of textbooks, and the same forces from fewer numbers."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs

TWO = """
multibody_sym: 1
name: two
gravity: [0, -9.81, 0]
bodies:
  upper: {mass: 2, com: [0.3, 0.1, 0], inertia: {Izz: 0.03}, points: {end: [0.5, 0, 0]}}
  lower: {mass: 1, com: [0.2, 0, 0], inertia: {Izz: 0.01}}
joints:
  A: {type: revolute, parent: ground, child: upper, q: a}
  B: {type: revolute, parent: upper.end, child: lower, q: b}
"""
SPACE = """
multibody_sym: 1
name: space
gravity: [0, 0, -9.81]
bodies:
  base: {mass: 3, com: [0.1, 0.2, 0.3], inertia: {Ixx: 1, Iyy: 1.2, Izz: 0.9, Ixy: 0.1}, points: {p: [0.4, 0.1, 0.2]}}
  arm: {mass: 1, com: [0.2, 0, 0.1], inertia: {Ixx: 0.1, Iyy: 0.2, Izz: 0.15}}
joints:
  ball: {type: spherical, parent: ground, child: base}
  hinge: {type: revolute, parent: base.p, child: arm, axis: [0, 0.6, 0.8], q: b}
"""


def test_a_double_pendulum_has_the_six_of_textbooks() -> None:
    """Siciliano, Sciavicco, Villani, Oriolo, Robotics (2009), 7.2.2: a planar arm with two links, without motors."""
    base = mbs.base_parameters(mbs.loads(TWO))
    names = ["mx(upper) + 0.5*m(lower)", "my(upper)", "Izz(upper) + 0.25*m(lower)", "mx(lower)", "my(lower)"]
    assert list(base.names) == [*names, "Izz(lower)"]
    theta = mbs.function(mbs.loads(TWO), "regressor", backend="python")(0.0, [0, 0], [0, 0], [0, 0]).theta
    np.testing.assert_allclose(
        base.combination @ theta, [2 * 0.3 + 0.5, 0.2, 0.03 + 2 * 0.1 + 0.25, 0.2, 0, 0.01 + 0.04], rtol=1e-14
    )


def test_forces_follow_from_the_base_parameters() -> None:
    """Of a ball joint all but the mass count; of a hinge on it seven more, whatever its axis."""
    system = mbs.loads(SPACE)
    base, f = mbs.base_parameters(system), mbs.function(system, "regressor", backend="python")
    assert len(base.names) == 9 + 7
    rng = np.random.default_rng(2)
    q = rng.standard_normal(5)
    Y, theta = f(0.0, q, rng.standard_normal(4), rng.standard_normal(4))
    np.testing.assert_allclose(Y[:, base.columns] @ base.combination, Y, atol=1e-12)
    assert base.parameters[10] == "m(arm)"
    assert theta[10] == 1.0


def test_what_does_not_move_has_none() -> None:
    still = "multibody_sym: 1\nname: still\nbodies: {b: {mass: 1}}\n"
    still += "joints: {A: {type: fixed, parent: ground, child: b}}\n"
    with pytest.raises(mbs.ModelError, match="there are no speeds"):
        mbs.base_parameters(mbs.loads(still))
