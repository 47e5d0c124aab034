"""Cut joints: whatever way a joint enters the equations, as freedoms of a tree or as rows, the motion is the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.model.joints import Joint
from multibody_sym.model.system import System

TILTED = {"position": [0.1, 0.2, -0.1], "rotate": [{"axis": "x", "angle": 0.4}, {"axis": "y", "angle": -0.7}]}
OBLIQUE = [1, 2, -2]
BODY = {
    "mass": 2,
    "com": [0.1, -0.2, 0.3],
    "inertia": {"Ixx": 0.3, "Iyy": 0.4, "Izz": 0.5, "Ixy": 0.02, "Ixz": -0.03, "Iyz": 0.01},
    "frames": {"end": {"position": [0.3, 0.1, -0.2], "rotate": [{"axis": "z", "angle": 0.5}]}},
}
JOINTS: Mapping[str, tuple[type[Joint], dict[str, Any], list[float], list[float]]] = {
    "revolute": (mbs.Revolute, {"axis": "z"}, [0.4], [1.2]),
    "oblique revolute": (mbs.Revolute, {"axis": OBLIQUE}, [0.4], [1.2]),
    "prismatic": (mbs.Prismatic, {"axis": "x"}, [0.3], [-0.6]),
    "oblique prismatic": (mbs.Prismatic, {"axis": OBLIQUE}, [0.3], [-0.6]),
    "cylindrical": (mbs.Cylindrical, {"axis": "y"}, [0.3, -0.4], [0.7, 1.1]),
    "universal": (mbs.Universal, {"axes": ["x", "y"]}, [0.3, -0.4], [0.7, 1.1]),
    "oblique universal": (mbs.Universal, {"axes": ["x", [1, 2, 0]]}, [0.3, -0.4], [0.7, 1.1]),
    "planar": (mbs.Planar, {}, [0.3, -0.4, 0.8], [0.7, 1.1, -0.5]),
    "spherical": (mbs.Spherical, {}, [0.8, 0.2, -0.4, 0.4], [0.5, -0.6, 0.9]),
    "angles": (mbs.Spherical, {"angles": "zxz"}, [0.8, 0.5, -0.4], [0.5, -0.6, 0.9]),
    "fixed": (mbs.Fixed, {}, [], []),
    "screw": (mbs.Screw, {"axis": "z", "pitch": 0.2}, [0.4], [1.2]),
    "custom": (mbs.Custom, {"free": [{"rotate": "z"}, {"translate": "x"}]}, [0.3, 0.2], [0.7, -0.4]),
}


def system(joint: Joint, extra: Mapping[str, Joint]) -> System:
    return mbs.System(
        "body on a joint",
        gravity=[0.5, -9.81, 1.0],
        bodies={"ground": {"frames": {"base": TILTED}}, "body": BODY},
        joints={**extra, "J": joint},
        forces={"push": mbs.Force("body", [3, -2, "4*cos(t)"], at="end", frame="body")},
    )


def instant(of: System) -> StateQuantities:
    resolved = mbs.mechanism(of)
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(composite_body(resolved, state))
    return StateQuantities(motion_of(resolved, state), found.udot.tolist(), found.multipliers.tolist())


def quaternion(rotation: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(
        [
            [rotation[0, 0] - rotation[1, 1] - rotation[2, 2], 0, 0, 0],
            [rotation[0, 1] + rotation[1, 0], rotation[1, 1] - rotation[0, 0] - rotation[2, 2], 0, 0],
            [rotation[0, 2] + rotation[2, 0], rotation[1, 2] + rotation[2, 1],
             rotation[2, 2] - rotation[0, 0] - rotation[1, 1], 0],
            [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1],
             np.trace(rotation)],
        ]
    )
    x, y, z, w = vectors[:, np.argmax(values)]
    return np.array([w, x, y, z])


def free_start(tree: StateQuantities) -> Mapping[str, Any]:
    """Return the start of a free joint at which the body moves as in `tree`."""
    rotation, position = (np.array(part, dtype=float) for part in tree.motion.poses[0])
    body = tree.motion.bodies[0]
    velocity = rotation @ np.array(body.v_WB, dtype=float)
    return {"q": [*position, *quaternion(rotation)], "u": [*velocity, *body.w_WB]}


@pytest.mark.parametrize("name", JOINTS)
def test_a_joint_as_rows_moves_and_loads_a_body_as_it_does_in_a_tree(name: str) -> None:
    cls, keys, q, u = JOINTS[name]
    moving = {"initial": {"q": q, "u": u}} if q else {}
    joint = cls("ground.base", "body.end", **keys, **moving)
    tree = instant(system(joint, {}))
    other = cls("ground.base", "body.end", **keys, cut=True)
    loop = instant(system(other, {"free": mbs.Free("ground", "body", initial=free_start(tree))}))
    assert loop.motion.mechanism.rows
    a, alpha = (np.array(part, dtype=float) for part in tree.bodies[0])
    np.testing.assert_allclose(np.concatenate(loop.bodies[0]), [*a, *alpha], rtol=1e-9, atol=1e-9)
    expected = tree.reactions["J"]
    assert loop.reactions["J"] == pytest.approx(expected, rel=1e-8, abs=1e-8)
    assert all(abs(x) < 1e-8 for x in loop.reactions["free"].values())
