"""Random trees closed by one more joint of any kind, with frames that make it closed at a random state."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

import multibody_sym as mbs
from multibody_sym.analysis.check import partial_velocities
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.motion import Motion, State
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.fields import Names
from multibody_sym.model.joints import Joint

CLOSING = [
    lambda *ends: mbs.Revolute(*ends, axis="z", cut=True),
    lambda *ends: mbs.Revolute(*ends, axis=[1, 2, -2], cut=True),
    lambda *ends: mbs.Prismatic(*ends, axis="x", cut=True),
    lambda *ends: mbs.Cylindrical(*ends, axis="y", cut=True),
    lambda *ends: mbs.Universal(*ends, axes=["x", "y"], cut=True),
    lambda *ends: mbs.Planar(*ends, cut=True),
    lambda *ends: mbs.Spherical(*ends, cut=True),
    lambda *ends: mbs.Fixed(*ends, cut=True),
]


def frame(rotation: np.ndarray, position: np.ndarray) -> mbs.Frame:
    """Return a frame at a position, turned about a fixed axis."""
    angle = float(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    turn = mbs.Turn([float(x) for x in axis / np.linalg.norm(axis)], angle)
    return mbs.Frame(position=[float(x) for x in position], rotate=[turn])


def rotation(rng: np.random.Generator) -> np.ndarray:
    found, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return found * np.linalg.det(found)


def turn_in_plane(rng: np.random.Generator) -> np.ndarray:
    c, s = np.cos(angle := rng.uniform(0.1, 3)), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


@cache
def closed(seed: int, *, times: int = 1, flat: bool = False, extreme: bool = False) -> tuple[Case, State]:
    """Return a random tree with `times` equal joints more between two of its bodies, and a state that they allow.

    Where prescribed motions of the tree contradict one, another is drawn. `flat` asks for a tree that moves in a plane,
    and hinges across it, `extreme` for masses of 1e-6 to 1e6 and links of none.
    """
    draws = (drawn(seed, draw, times, flat, extreme) for draw in range(1000))
    return next(found for found in draws if found is not None)


def drawn(seed: int, draw: int, times: int, flat: bool = False, extreme: bool = False) -> tuple[Case, State] | None:
    """Return a closed tree and its state, None where its rows contradict each other there."""
    rng = np.random.default_rng([seed, draw])
    tree = random_case(20_000 + seed + 1000 * draw, bodies=(2, 7), extreme=extreme)
    t, q, u = random_state(rng, tree)
    motion = tree.motion(t, q, u)
    if flat and not _moves_in_a_plane(motion):
        return None
    poses = {"ground": (np.eye(3), np.zeros(3))}  # unless its motion is prescribed
    for body, (R, p) in zip(tree.mechanism.bodies, motion.poses, strict=True):
        poses[body.name] = np.array(R, dtype=float), np.array(p, dtype=float)
    first, second = sorted(rng.permutation(list(poses))[:2].tolist(), key=list(poses).index)
    place, axes = rng.uniform(-1, 1, 3), turn_in_plane(rng) if flat else rotation(rng)
    bodies = dict(tree.system.bodies)
    for name in (first, second):
        R, p = poses[name]
        known = bodies[name]
        frames = Names({**known.frames, "loop": frame(R.T @ axes, R.T @ (place - p))})
        bodies[name] = replace(known, frames=frames)
    close = CLOSING[0 if flat else seed % len(CLOSING)]
    extra: dict[str, Joint] = {f"L{k}": close(f"{first}.loop", f"{second}.loop") for k in range(times)}
    joints = Names({**tree.system.joints, **extra})
    system = replace(tree.system, bodies=Names(bodies), joints=joints)
    resolved = mbs.mechanism(system)
    assert resolved.speeds == tree.mechanism.speeds
    case = Case(seed, system, resolved, parameter_values(resolved, {}))
    allowed = admissible(case, t, q, u)
    return None if allowed is None else (case, case.state(t, q, allowed))


def _moves_in_a_plane(motion: Motion) -> bool:
    parts = partial_velocities(motion)
    return len(parts) > 1 and all(
        np.abs(part.linear[2]).max(initial=0) < 1e-12 and np.abs(part.angular[:2]).max(initial=0) < 1e-12
        for part in parts
    )


def admissible(case: Case, t: float, q: list[float], u: list[float]) -> list[float] | None:
    """Return the speeds nearest to u that the rows allow, None where there are none, or no accelerations."""
    rows = row_motions(case.motion(t, q, u))
    assert max(abs(row.phi) for row in rows) < 1e-12, "the loop is closed"
    jacobian = np.array([row.jacobian for row in rows], dtype=float)
    change, *_ = np.linalg.lstsq(jacobian, [-float(row.phidot) for row in rows], rcond=1e-10)
    allowed = [float(x) if abs(x) > 1e-12 else 0.0 for x in np.array(u) + change]  # what is held is at rest
    rows = row_motions(case.motion(t, q, allowed))
    gamma = np.array([row.gamma for row in rows], dtype=float)
    missed = jacobian @ np.linalg.lstsq(jacobian, gamma, rcond=1e-10)[0] - gamma
    size = float(np.abs(gamma).max())
    contradicts = max(abs(row.phidot) for row in rows) > 1e-9 or np.abs(missed).max() > 1e-8 * (1 + size)
    return None if contradicts else allowed


def blocks(count: int, *, quick: int) -> list[Any]:
    """Return the numbers of blocks of seeds, all but the `quick` ones marked as long."""
    return [k if k < quick else pytest.param(k, marks=pytest.mark.long) for k in range(count)]
