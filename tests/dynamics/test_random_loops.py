"""Random trees closed by one more joint of any kind: routes agree, and rows planted twice are named.

The frames of the joint are computed at a random state of the tree, so that it is closed there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

import multibody_sym as mbs
from multibody_sym.dynamics.agreement import LARGEST_WITH_ROWS, agreement
from multibody_sym.dynamics.composite_body import composite_body
from multibody_sym.dynamics.dalembert import dalembert
from multibody_sym.dynamics.formalisms import FORMALISMS
from multibody_sym.dynamics.massless import massless_speeds
from multibody_sym.dynamics.redundancy import redundancy
from multibody_sym.dynamics.start import parameter_values
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.model.joints import Joint
from multibody_sym.model.mechanism import TIME
from multibody_sym.model.slots import Names

NUMERIC = {name: route for name, route in FORMALISMS.items() if name not in ("lagrange", "multipliers")}
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


def blocks(count: int, *, quick: int) -> list[Any]:
    """Return the numbers of blocks of seeds, all but the `quick` ones marked as long."""
    return [k if k < quick else pytest.param(k, marks=pytest.mark.long) for k in range(count)]


def frame(rotation: np.ndarray, position: np.ndarray) -> mbs.Frame:
    """Return a frame at a position, turned about a fixed axis."""
    angle = float(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    turn = mbs.Turn([float(x) for x in axis / np.linalg.norm(axis)], angle)
    return mbs.Frame(position=[float(x) for x in position], rotate=[turn])


def rotation(rng: np.random.Generator) -> np.ndarray:
    found, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return found * np.linalg.det(found)


def closed(seed: int, *, times: int = 1) -> tuple[Case, State]:
    """Return a random tree with `times` equal joints more between two of its bodies, and a state that they allow.

    Where prescribed motions of the tree contradict one, another is drawn.
    """
    draws = (drawn(seed, draw, times) for draw in range(50))
    return next(found for found in draws if found is not None)


def drawn(seed: int, draw: int, times: int) -> tuple[Case, State] | None:
    """Return a closed tree and its state, None where its rows contradict each other there."""
    rng = np.random.default_rng([seed, draw])
    tree = random_case(20_000 + seed + 1000 * draw, bodies=(2, 7))
    t, q, u = random_state(rng, tree)
    motion = tree.motion(t, q, u)
    poses = {"ground": (np.eye(3), np.zeros(3))}  # unless its motion is prescribed
    for body, (R, p) in zip(tree.mechanism.bodies, motion.poses, strict=True):
        poses[body.name] = np.array(R, dtype=float), np.array(p, dtype=float)
    first, second = sorted(rng.permutation(list(poses))[:2].tolist(), key=list(poses).index)
    place, axes = rng.uniform(-1, 1, 3), rotation(rng)
    bodies = dict(tree.system.bodies)
    for name in (first, second):
        R, p = poses[name]
        known = bodies[name]
        frames = Names({**known.frames, "loop": frame(R.T @ axes, R.T @ (place - p))})
        bodies[name] = replace(known, frames=frames)
    close = CLOSING[seed % len(CLOSING)]
    extra: dict[str, Joint] = {f"L{k}": close(f"{first}.loop", f"{second}.loop") for k in range(times)}
    joints = Names({**tree.system.joints, **extra})
    system = replace(tree.system, bodies=Names(bodies), joints=joints)
    resolved = mbs.mechanism(system)
    assert resolved.speeds == tree.mechanism.speeds
    case = Case(seed, system, resolved, parameter_values(resolved, {}))
    allowed = admissible(case, t, q, u)
    return None if allowed is None else (case, case.state(t, q, allowed))


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
    is_rounding = 0 < size < 1e-12  # in a loop held by prescribed motions there is no size to measure residuals by
    return None if contradicts or is_rounding else allowed


@pytest.mark.parametrize("block", blocks(10, quick=3))
def test_routes_agree_on_random_loops(block: int) -> None:
    for seed in range(30 * block, 30 * block + 30):
        case, state = closed(seed)
        found = agreement(case.mechanism, [state], NUMERIC)
        assert max(found.values()) <= LARGEST_WITH_ROWS, f"seed {seed}: {found}"


def lightened(case: Case, state: State) -> tuple[Case, State] | None:
    """Return the case with its outermost bodies as particles or without mass, None where no row holds them then."""
    carriers = {body.parent for body in case.mechanism.bodies}
    outer = [body.name for k, body in enumerate(case.mechanism.bodies) if k not in carriers and body.name != "ground"]
    mass = {"mass": None} if case.seed % 3 == 0 else {}
    bodies = {**case.system.bodies, **{n: replace(case.system.bodies[n], inertia=None, **mass) for n in outer}}
    system = replace(case.system, bodies=Names(bodies))
    light = Case(case.seed, system, mbs.mechanism(system), parameter_values(mbs.mechanism(system), {}))
    t, count = state.slots[TIME], len(light.mechanism.speeds)
    found = dalembert(motion_of(light.mechanism, light.state(t, list(state.q), list(state.u))))
    lengths = np.linalg.norm(found.constraint_jacobian, axis=1, keepdims=True)
    _, sizes, v = np.linalg.svd(found.constraint_jacobian / np.where(lengths == 0.0, 1.0, lengths))
    free = v[int((sizes > 1e-8).sum()) :].T
    left = np.linalg.eigvalsh(free.T @ found.mass_matrix @ free) if free.size else np.zeros(1)
    if len(massless_speeds(light.mechanism)) in (0, count) or left[0] < 1e-6 * found.mass_matrix.max():
        return None
    return light, light.state(t, list(state.q), list(state.u))


@pytest.mark.parametrize("block", blocks(12, quick=1))
def test_routes_agree_where_only_rows_hold_what_has_no_inertia(block: int) -> None:
    routes = {name: NUMERIC[name] for name in ("newton_euler", "dalembert_lagrange", "composite_body")}
    cases = [lightened(*closed(seed)) for seed in range(30 * block, 30 * block + 30)]
    singular = [found for found in cases if found is not None]
    assert len(singular) >= 2
    for case, state in singular:
        found = agreement(case.mechanism, [state], routes)
        assert max(found.values()) <= LARGEST_WITH_ROWS, f"seed {case.seed}: {found}"


@pytest.mark.parametrize("block", blocks(3, quick=1))
def test_a_joint_that_stands_twice_is_named(block: int) -> None:
    for seed in range(20 * block, 20 * block + 20):
        (once, state), (twice, there) = closed(seed), closed(seed, times=2)
        one, two = (
            redundancy(motion_of(case.mechanism, at), composite_body(case.mechanism, at))
            for case, at in ((once, state), (twice, there))
        )
        rows = len(once.mechanism.rows)
        assert two.rank == one.rank, f"seed {seed}"
        assert len(two.redundant) == 2 * rows - one.rank, f"seed {seed}"
        assert {row.name for row in twice.mechanism.rows} <= set(two.not_unique), f"seed {seed}"
