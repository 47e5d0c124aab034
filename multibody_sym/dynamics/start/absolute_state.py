"""Absolute coordinates and speeds of a state that is known in the joints' own, in floats.

Poses tell angles up to whole turns and unit quaternions up to their sign: these are chosen so that joints measure what
their coordinates are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position, velocity
from multibody_sym.kinematics.relative import angular_velocity
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Pose
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, symbol

_TURN: Final = 2 * math.pi
_DIGITS: Final = 6
"""Decimals in which misfits are compared; the smaller turn is taken where they are alike."""


def absolute_state(mechanism: Mechanism, motion: Motion, parameters: Sequence[float]) -> tuple[Floats, Floats]:
    """Return q and u of a mechanism in absolute coordinates, given the motion of the one in its joints' own."""
    known = _joint_coordinates(motion)
    q = np.array([known.get(c.name, 0.0) for c in mechanism.coordinates], dtype=float)
    u = np.array([known.get(s.name, 0.0) for s in mechanism.speeds], dtype=float)
    places = {body.name: index for index, body in enumerate(motion.mechanism.bodies)}
    free = {body.name: body for body in mechanism.bodies if body.joint_name not in mechanism.joint_names}
    for body in free.values():
        q[list(body.q)], u[list(body.u)] = _placed(motion, places[body.name], body)
    for carried in motion.mechanism.bodies:  # parents first
        if carried.name in free:
            told = [c.name for c in motion.mechanism.coordinates if c.joint == carried.joint_name]
            wanted = {mechanism.symbols[symbol(name)]: known[name] for name in told}
            q = min(_alike(free[carried.name], q, list(wanted.values())), key=_Misfit(mechanism, parameters, wanted))
    return q, u


def _joint_coordinates(motion: Motion) -> dict[str, float]:
    mechanism, state = motion.mechanism, motion.state
    names = (*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds))
    return dict(zip(names, (*state.q, *state.u), strict=True))


def _placed(motion: Motion, index: int, free: TreeBody) -> tuple[Floats, Floats]:
    """Return coordinates and speeds of one body relative to ground: its centre of mass, then how it is turned."""
    ground = motion.mechanism.body_index(GROUND)
    centre = Marker(free.name, index, Pose(free.frame_on_body.position))
    origin = Marker(GROUND, ground, Pose())
    R_WG, R_WB = (np.array(motion.rotation(k), dtype=float) for k in (ground, index))
    spin = np.array(angular_velocity(motion, ground), dtype=float)
    way = np.subtract(position(motion, centre), position(motion, origin))
    v = R_WG.T @ (np.subtract(velocity(motion, centre), velocity(motion, origin)) - np.cross(spin, way))
    w = np.array(angular_velocity(motion, index), dtype=float) - spin
    p, R_GB = R_WG.T @ way, R_WG.T @ R_WB
    if not free.quaternions:
        angle = math.atan2(R_GB[1, 0], R_GB[0, 0])
        return np.array([p[0], p[1], angle]), np.array([v[0], v[1], w @ R_WG[:, 2]])
    return np.array([*p, *_quaternion(R_GB)]), np.array([*v, *(R_WB.T @ w)])


def _quaternion(R: Floats) -> Floats:
    """Return the unit quaternion (w first) of a rotation, from its largest component (Shepperd 1978)."""
    trace = float(np.trace(R))
    squares = [trace, *(2 * R[k, k] - trace for k in range(3))]  # 4 q_k^2 - 1
    largest = int(np.argmax(squares))
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    if largest == 0:
        found = np.array([1 + trace, *skew])
    else:
        k = largest - 1
        found = np.array([skew[k], *(R[j, k] + R[k, j] for j in range(3))])
        found[largest] = 1 + squares[largest]
    unit: Floats = found / np.linalg.norm(found)
    return unit


def _alike(body: TreeBody, q: Floats, angles: Sequence[float]) -> list[Floats]:
    """Return coordinates that turn a body by whole turns, or change its quaternion's sign."""
    for places in body.quaternions:
        change = np.ones_like(q)
        change[list(places)] = -1.0
        return [q, q * change]
    most = 1 + math.ceil(max((abs(x) for x in (*angles, q[body.q[2]])), default=0.0) / _TURN)
    unit = np.zeros_like(q)
    unit[body.q[2]] = _TURN
    return sorted((q + k * unit for k in range(-most, most + 1)), key=lambda each: abs(float((each - q) @ unit)))


@dataclass(frozen=True)
class _Misfit:
    """How far what joints measure at coordinates q is from what is `wanted` of it."""

    mechanism: Mechanism
    parameters: Sequence[float]
    wanted: Mapping[Node, float]

    def __call__(self, q: Floats) -> float:
        at_rest = [0.0] * len(self.mechanism.speeds)
        state = state_of(self.mechanism, float, 0.0, q.tolist(), at_rest, self.parameters)
        found = np.array(state.values(list(self.wanted)), dtype=float)
        return float(np.abs(found - np.array(list(self.wanted.values()))).round(_DIGITS).sum())
