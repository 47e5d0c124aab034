"""Inverse kinematics against the law of cosines, limits, quaternions and closed loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import multibody_sym as mbs

ARM = """
multibody_sym: 1
name: arm
bodies:
  upper: {mass: 1, com: [0.2, 0, 0], points: {end: [0.5, 0, 0]}}
  lower: {mass: 1, com: [0.1, 0, 0], points: {tip: [0.3, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: upper, q: a}
  B: {type: revolute, parent: upper.end, child: lower, q: b, limits: {lower: 0 deg, upper: 150 deg, acts: false}}
"""
FOUR_BAR = """
multibody_sym: 1
name: bars
bodies:
  ground: {points: {right: [0.9, 0, 0]}}
  crank: {mass: 0.3, com: [0.1, 0, 0], points: {end: [0.3, 0, 0]}}
  coupler: {mass: 0.8, com: [0.4, 0, 0], points: {end: [0.8, 0, 0], pen: [0.4, 0.2, 0]}}
  rocker: {mass: 0.6, com: [0.3, 0, 0], points: {end: [0.6, 0, 0]}}
joints:
  a: {type: revolute, parent: ground, child: crank, q: a, initial: {q: 0.7}}
  b: {type: revolute, parent: crank.end, child: coupler, q: b, initial: {q: 0}}
  c: {type: revolute, parent: ground.right, child: rocker, q: c, initial: {q: 1.5}}
  d: {type: revolute, parent: coupler.end, child: rocker.end}
"""
FLYING = """
multibody_sym: 1
name: flying
bodies:
  hull: {mass: 5, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}
  arm: {mass: 1, inertia: {Ixx: 0.1, Iyy: 0.1, Izz: 0.1}, points: {hand: [0.4, 0, 0.1]}}
joints:
  base: {type: free, parent: ground, child: hull}
  turn: {type: revolute, parent: hull, child: arm, axis: y, q: turn}
"""


@pytest.mark.parametrize(("x", "y"), [(0.6, 0.2), (-0.3, 0.4), (0.1, -0.45)])
def test_an_arm_of_two_links_has_the_angles_of_the_law_of_cosines(x: float, y: float) -> None:
    found = mbs.inverse_kinematics(mbs.loads(ARM), "lower.tip", [x, y, 0])
    b = np.arccos((x * x + y * y - 0.25 - 0.09) / 0.3)
    a = np.arctan2(y, x) - np.arctan2(0.3 * np.sin(b), 0.5 + 0.3 * np.cos(b))
    assert found.reached
    assert found.state["b"] == pytest.approx(b, abs=1e-9)  # not -b, which the limits forbid
    assert np.remainder(found.state["a"] - a + 1, 2 * np.pi) == pytest.approx(1, abs=1e-9)
    assert found.as_json()["reached"] is True


def test_what_is_out_of_reach_is_told() -> None:
    far = mbs.inverse_kinematics(mbs.loads(ARM), "lower.tip", [1, 1, 0])
    assert not far.reached
    assert far.missed == pytest.approx(np.sqrt(2) - 0.8, rel=1e-6)
    np.testing.assert_allclose(far.q, [np.pi / 4, 0], atol=1e-4)
    near = mbs.inverse_kinematics(mbs.loads(ARM), "lower.tip", [0.21, 0, 0])  # within, but for the limit of 150 deg
    assert not near.reached
    assert near.state["b"] == pytest.approx(np.radians(150), rel=1e-9)
    assert mbs.inverse_kinematics(mbs.loads(ARM), "lower.tip", [0.21, 0, 0], limits=False).reached


def test_loops_stay_closed() -> None:
    system = mbs.loads(FOUR_BAR)
    pen = mbs.function(system, "frame", frame="coupler.pen")
    rows = mbs.function(system, "constraints")
    at = mbs.inverse_kinematics(system, "coupler.pen", [0.35, 0.5, 0], initial={"a": 1.2})
    assert at.missed < 0.5  # a curve of the pen, which does not go through every point
    assert np.abs(rows(0.0, at.q, np.zeros(3)).phi).max() < 1e-14
    there = pen(0.0, at.q, np.zeros(3)).position
    again = mbs.inverse_kinematics(system, "coupler.pen", there)
    assert again.reached


def test_attitudes_are_reached_by_bodies_that_fly() -> None:
    system = mbs.loads(FLYING)
    frame = mbs.function(system, "frame", frame="arm.hand", backend="python")
    for seed in range(5):
        wanted = Rotation.random(random_state=seed).as_matrix()
        found = mbs.inverse_kinematics(system, "arm.hand", [seed, -1.0, 0.3], wanted)
        assert found.reached
        assert np.linalg.norm(found.q[3:7]) == pytest.approx(1, rel=1e-14)
        there = frame(0.0, found.q, np.zeros(7))
        np.testing.assert_allclose(there.rotation, wanted, atol=1e-9)
        np.testing.assert_allclose(there.position, [seed, -1.0, 0.3], atol=1e-9)


def test_wrong_goals_are_told() -> None:
    system = mbs.loads(ARM)
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"frame": "lower.tap", "position": [0, 0, 0]}, "no frame 'lower.tap'; did you mean lower.tip"),
        ({"frame": "lower.tip", "position": [0, 0]}, r"position has the shape \(2,\), not \(3,\)"),
        ({"frame": "lower.tip", "position": [0, 0, 0], "rotation": [1, 0, 0, 0]}, r"shape \(4,\), not \(3, 3\)"),
        ({"frame": "lower.tip", "position": [0, 0, 0], "rotation": "x"}, "rotation is to be real numbers"),
        ({"frame": "lower.tip", "position": [0, 0, 0], "rotation": 2 * np.eye(3)}, "rows are not orthonormal"),
        ({"frame": "lower.tip", "position": [0, 0, 0], "rotation": -np.eye(3)}, "reflection"),
    ]
    for given, match in wrong:
        with pytest.raises(mbs.InputError, match=match):
            mbs.inverse_kinematics(system, **given)


def test_stops_and_contacts_of_the_start_do_not_hold_a_posture() -> None:
    """A rod that lies on its stop is lifted; without limits it may start beyond the stop, and goes anywhere."""
    text = """
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
bodies:
  rod: {shape: {rod: 1, mass: 1}, points: {end: [1, 0, 0]}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {A: {type: revolute, parent: ground, child: rod, q: a, limits: {lower: 0, upper: 1}, initial: {q: START}}}
contacts: {c: {between: [rod.end, ground.floor], static: 0.3}}
"""
    lying, beyond = (mbs.loads(text.replace("START", start)) for start in ("0", "2"))
    at = [[np.cos(a), np.sin(a), 0] for a in (0.5, 2.5)]
    assert mbs.inverse_kinematics(lying, "rod.end", at[0]).state["a"] == pytest.approx(0.5, abs=1e-10)
    assert mbs.inverse_kinematics(beyond, "rod.end", at[0]).state["a"] == pytest.approx(0.5, abs=1e-10)
    assert not mbs.inverse_kinematics(beyond, "rod.end", at[1]).reached
    free = mbs.inverse_kinematics(beyond, "rod.end", at[1], limits=False)
    assert free.state["a"] == pytest.approx(2.5, abs=1e-10)
