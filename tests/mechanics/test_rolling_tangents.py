"""The tangents of rolling: in a plane model t1 = normal x z, in space ground's x on the plane; t2 = normal x t1."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from multibody_sym.answers.solve import solve
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.model_files import loads
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions

WHEEL = """\
multibody_sym: 1
name: wheel
gravity: [0, -10, 0]
parameters: {{a: {a}, m: 2, r: 0.5}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: {normal}}}}}}}
  wheel: {{shape: {{disc: r, mass: m}}, surfaces: {{rim: {{disc: r, axis: z}}}}}}
joints: {{ride: {{type: planar, parent: ground, child: wheel, initial: {{q: [-r*sin(a), r*cos(a), 0]}}}}}}
constraints: {{contact: {{type: rolling, body: wheel.rim, on: ground.floor}}}}
forces: {{drive: {{type: torque, on: wheel, value: [0, 0, 3]}}}}
"""


def multipliers(a: float, normal: str) -> dict[str, float]:
    found = solve(loads(WHEEL.format(a=a, normal=normal))).reactions
    return {name: parts["tension"].value or 0.0 for name, parts in found.items() if "tension" in parts}


@pytest.mark.parametrize("a", [-1e-9, 0.0, 1e-9, 0.3, -0.3, 3.0])
def test_multipliers_are_continuous_in_the_ramps_angle(a: float) -> None:
    """N = m g cos(a), and the friction uphill is (m g sin(a) - 2 M/r)/3: m s'' = F - m g sin(a), J s''/r = -M - F r."""
    found = multipliers(a, "[-sin(a), cos(a), 0]")
    assert found["contact.n"] == pytest.approx(20 * np.cos(a), rel=1e-12)
    assert found["contact.t1"] == pytest.approx((20 * np.sin(a) - 2 * 3 / 0.5) / 3, rel=1e-12)
    assert found["contact.t2"] == pytest.approx(0.0, abs=1e-12)


def test_two_spellings_of_a_floor_are_one() -> None:
    assert multipliers(0.0, "y") == pytest.approx(multipliers(0.0, "[-sin(a), cos(a), 0]"), rel=1e-12, abs=1e-12)


def directions(normal: Any, joint: str = "free") -> np.ndarray[Any, Any]:
    """Return n, t1 and t2 of a ball on a plane, as rows."""
    text = f"""\
multibody_sym: 1
name: ball
parameters: {{a: 0.4}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: {normal}}}}}}}
  ball: {{shape: {{sphere: 1, mass: 1}}, surfaces: {{skin: {{sphere: 1}}}}}}
joints: {{ride: {{type: {joint}, parent: ground, child: ball}}}}
constraints: {{contact: {{type: rolling, body: ball.skin, on: ground.floor}}}}
"""
    resolved = mechanism(loads(text))
    q, u = [float(c.initial.shadow) for c in resolved.coordinates], [0.0] * len(resolved.speeds)
    motion = motion_of(resolved, state_of(resolved, float, 0.0, q, u, parameter_values(resolved, {})))
    return np.array([row.of_body[0][0] for row in row_motions(motion)], dtype=float)


@pytest.mark.parametrize(
    ("normal", "t1"),
    [
        ("y", [1, 0, 0]),
        ("-y", [-1, 0, 0]),
        ("x", [0, -1, 0]),
        ("[-sin(a), cos(a), 0]", [np.cos(0.4), np.sin(0.4), 0]),
        ("[-3, 4, 0]", [0.8, 0.6, 0]),
    ],
)
def test_in_the_plane_t1_is_normal_x_z(normal: str, t1: list[float]) -> None:
    n, first, second = directions(normal, "planar")
    np.testing.assert_allclose(first, t1, atol=1e-15)
    np.testing.assert_allclose(second, np.cross(n, first), atol=1e-15)


@pytest.mark.parametrize(
    ("normal", "t1"),
    [
        ("z", [1, 0, 0]),
        ("-z", [1, 0, 0]),
        ("y", [1, 0, 0]),
        ("x", [0, 1, 0]),
        ("-x", [0, 1, 0]),
        ("[-sin(a), 0, cos(a)]", [np.cos(0.4), 0, np.sin(0.4)]),
        ("[0, -sin(a), cos(a)]", [1, 0, 0]),
        ("[2, 3, 6]", [45 / 49, -6 / 49, -12 / 49]),
    ],
)
def test_in_space_t1_is_grounds_x_on_the_plane(normal: str, t1: list[float]) -> None:
    n, first, second = directions(normal)
    np.testing.assert_allclose(first, np.array(t1) / np.linalg.norm(t1), atol=1e-15)
    np.testing.assert_allclose(second, np.cross(n, first), atol=1e-15)
