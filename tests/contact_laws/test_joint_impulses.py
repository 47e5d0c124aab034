"""Impulses in joints of random trees and loops: by the recursion, and from one system with all impulses unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from mechanisms import random_case, random_state
from random_loops import blocks, closed

from multibody_sym.analysis.check import LARGEST_WITH_ROWS, dalembert, ratio
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.dynamics.contact.impact_problem import Blow, pose, struck_rows
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.impacts import state_in_impact
from multibody_sym.mechanics.law_elements import LawElement, MeetingRow, StruckImpacts
from multibody_sym.mechanics.load_records import BodyTorque, PointForce
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, State, from_parent, motion_of
from multibody_sym.mechanics.motion import pose as frame_of
from multibody_sym.mechanics.points import generalized_forces, to_parent
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import Pose
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import real
from multibody_sym.text.printer import COMPONENTS

EPSILON = float(np.finfo(float).eps)
DEPENDENT, UNIQUE = 1e-10, 1e-6
STIFF, VALUES = 1e7, 1e-8
"""Conditions up to which impulses themselves are compared, and how near they come beside the largest."""


def vector(x: Floats) -> tuple[object, object, object]:
    a, b, c = (real(float(v)) for v in x)
    return a, b, c


def random_blow(rng: np.random.Generator, mechanism: Mechanism, state: State) -> Blow:
    """Return a mechanism struck by ground somewhere, with an impulse on one body and a couple on another."""
    last, other = (int(rng.integers(len(mechanism.bodies))) for _ in range(2))
    place = Marker("place", last, Pose(vector(rng.uniform(-1, 1, 3))))  # type: ignore[arg-type]
    ground = Marker("ground", -1, Pose())
    loads = (
        PointForce("push", Marker("there", other, Pose()), vector(rng.normal(size=3)), -1),  # type: ignore[arg-type]
        BodyTorque("turn", last, vector(rng.normal(size=3)), -1),  # type: ignore[arg-type]
    )
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    for sign in (1.0, -1.0):
        row = MeetingRow("hit.normal", (place, ground), vector(sign * normal), ground)  # type: ignore[arg-type]
        element = LawElement("hit", "contact", ("impact", "hit"), (row,), restitution=real(0.5))
        blow = Blow(mechanism, state, StruckImpacts((element,), (), loads, {}, ()), (element,))
        if float(blow.rows[-1].phidot) < 0:
            break
    return blow if moves(blow) else replace(blow, elements=())


def moves(blow: Blow) -> bool:
    """Return whether the place that is struck can give way, which constraints and prescribed motions may forbid."""
    *others, normal = (np.array(blow.dynamics.factors.weighted(row.jacobian), dtype=float) for row in blow.rows)
    lengths = np.array([np.linalg.norm(row) or 1.0 for row in others])
    unit = np.array(others).reshape(len(others), len(normal)) / lengths[:, None]
    left = normal - np.linalg.lstsq(unit.T, normal, rcond=1e-7)[0] @ unit
    return bool(np.linalg.norm(left) > 1e-3 * np.linalg.norm(normal))


@dataclass(frozen=True)
class Found:
    """What the recursion finds: jumps (n), multipliers (s), impulses in joints, the motion at rest and its rows."""

    jumps: Floats
    multipliers: Floats
    joints: dict[str, dict[str, float]]
    motion: Motion
    rows: list[RowMotion]


def by_recursion(blow: Blow) -> Found:
    struck = struck_rows(blow, strike(pose(blow, "newton", "simultaneous", {"hit": (0.5, 0.0)})))
    state = state_in_impact(blow.motion.state, struck.jumps)
    solved = forward_dynamics(composite_body(struck.mechanism, state))
    motion = motion_of(struck.mechanism, state)
    rows = row_motions(motion)
    joints = reactions(motion, solved.udot.tolist(), rows, solved.multipliers.tolist())
    return Found(solved.udot, solved.multipliers, {k: dict(v) for k, v in joints.items()}, motion, rows)


# --- one system ----------------------------------------------------------------------------------------------------


def moving(moved: object) -> Floats:
    """Return how a body's twist follows from its parent's (6 x 6)."""
    found = np.zeros((6, 6))
    for k in range(6):
        unit = np.eye(6)[k]
        v, w = from_parent(moved, (tuple(unit[:3]), tuple(unit[3:])))  # type: ignore[arg-type]
        found[:, k] = (*v, *w)
    return found


def to_parents(moved: object) -> Floats:
    found = np.zeros((6, 6))
    for k in range(6):
        unit = np.eye(6)[k]
        f, m = to_parent(moved, (tuple(unit[:3]), tuple(unit[3:])))  # type: ignore[arg-type]
        found[:, k] = (*f, *m)
    return found


def inertia(motion: Motion, k: int) -> Floats:
    mass = motion.masses[k]
    m, (x, y, z) = float(mass.mass), (float(c) for c in mass.com)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    J = np.array(mass.inertia, dtype=float) - m * skew @ skew
    return np.block([[m * np.eye(3), -m * skew], [m * skew, J]])


def one_system(found: Found) -> tuple[Floats, Floats]:
    """Return K, b for the unknowns du (n), the jumps of all bodies' twists (6 N), R (6 N), multipliers (s)."""
    motion, rows = found.motion, found.rows
    n, count, s = len(motion.state.u), len(motion.bodies), len(rows)
    w, R, p = n, n + 6 * count, n + 12 * count
    K, b = np.zeros((n + 12 * count + s, p + s)), np.zeros(n + 12 * count + s)
    given = applied_forces(motion).of_body
    drives = [np.array(r.jacobian, dtype=float) - np.array(generalized_forces(motion, r.of_body), float) for r in rows]
    for i, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        own, parent = slice(6 * i, 6 * i + 6), body.parent
        twist = slice(n + 6 * i, n + 6 * i + 6)
        K[own, w + 6 * i : w + 6 * i + 6] = np.eye(6)
        if parent >= 0:
            K[own, w + 6 * parent : w + 6 * parent + 6] = -moving(moved)
        free = np.array([(*v, *x) for v, x in zip(moved.linear, moved.angular, strict=True)], float).reshape(-1, 6)
        K[own, list(body.u)] = -free.T
        second = slice(6 * count + 6 * i, 6 * count + 6 * i + 6)
        K[second, twist] = inertia(motion, i)
        K[second, R + 6 * i : R + 6 * i + 6] = -np.eye(6)
        if parent >= 0:
            K[6 * count + 6 * parent : 6 * count + 6 * parent + 6, R + 6 * i : R + 6 * i + 6] += to_parents(moved)
        b[second] = (*given[i][0], *given[i][1])
        projected = [12 * count + k for k in body.u]
        K[projected, R + 6 * i : R + 6 * i + 6] = free
        for j, row in enumerate(rows):
            wrench = np.array((*row.of_body[i][0], *row.of_body[i][1]), dtype=float)
            K[second, p + j] -= wrench
            K[12 * count + n + j, twist] += wrench
            K[projected, p + j] -= drives[j][list(body.u)]
    for j, row in enumerate(rows):
        K[12 * count + n + j, :n] = drives[j]
        b[12 * count + n + j] = float(row.gamma)
    return K, b


def by_one_system(K: Floats, b: Floats) -> tuple[Floats, Floats, float]:
    """Return x of least norm (scaled), which unknowns are unique, and the condition of the system."""
    left, right = np.ones(len(K)), np.ones(K.shape[1])
    for _ in range(20):
        scaled = np.abs(left[:, None] * K * right)
        left /= np.sqrt(np.where(scaled.max(axis=1) > 0, scaled.max(axis=1), 1.0))
        right /= np.sqrt(np.where(scaled.max(axis=0) > 0, scaled.max(axis=0), 1.0))
    u, sizes, v = np.linalg.svd(left[:, None] * K * right)
    rank = int((sizes > DEPENDENT * sizes[0]).sum())
    inverse = (v[:rank].T / sizes[:rank]) @ u[:, :rank].T
    y = inverse @ (left * b)
    y = y + inverse @ (left * b - (left[:, None] * K * right) @ y)
    return right * y, np.abs(v[rank:]).max(axis=0, initial=0.0) < UNIQUE, float(sizes[0] / sizes[rank - 1])


def told(found: Found) -> Floats:
    """Return the same unknowns as the recursion finds them, impulses in joints as they are told of each joint."""
    motion, twists, wrenches = found.motion, list[Floats](), list[Floats]()
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        free = np.array([(*v, *x) for v, x in zip(moved.linear, moved.angular, strict=True)], float).reshape(-1, 6)
        twist = free.T @ found.jumps[list(body.u)]
        twists.append(twist + moving(moved) @ twists[body.parent] if body.parent >= 0 else twist)
        turn = np.array(frame_of(motion.state, body.frame_on_parent)[0], float).T @ np.array(moved.R_PB, float)
        point = np.array(frame_of(motion.state, body.frame_on_body)[1], dtype=float)
        values = np.array([found.joints[body.joint_name][c] for c in COMPONENTS])
        force, moment = turn.T @ values[:3], turn.T @ values[3:]
        wrenches.append(np.concatenate([force, moment + np.cross(point, force)]))
    return np.concatenate([found.jumps, *twists, *wrenches, found.multipliers])


def sizes(found: Found, x: Floats) -> Floats:
    """Return the absolute terms of which unknowns are made: of a twist those of its own jumps and of its parent's.

    A heavy body may stand nearly still on a light one that is kicked away fast: its twist is what rounding leaves.
    """
    n, motion, made = len(found.jumps), found.motion, np.abs(x)
    for k, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        free = np.array([(*v, *w) for v, w in zip(moved.linear, moved.angular, strict=True)], float).reshape(-1, 6)
        terms = np.abs(free).T @ made[list(body.u)]
        if body.parent >= 0:
            terms = terms + np.abs(moving(moved)) @ made[n + 6 * body.parent : n + 6 * body.parent + 6]
        made[n + 6 * k : n + 6 * k + 6] = terms
    return made


def largest_ratio(found: Found, K: Floats, b: Floats) -> float:
    """Return how well jumps and impulses fulfil the equations: those of all bodies beside their terms, and as measured.

    The agreement measure takes M, Q and rows of the mechanism at rest from d'Alembert's route.
    """
    x, count = told(found), len(found.motion.bodies)
    missed, terms = np.abs(K @ x - b), np.abs(K) @ sizes(found, x) + np.abs(b)
    each = (y[: 12 * count].reshape(2, count, 2, 3).max(axis=(1, 3)) for y in (missed, terms))  # motions and momenta
    miss, size = each
    of_bodies = np.divide(miss, size, out=np.zeros((2, 2)), where=size > 0.0) / (EPSILON * len(K))
    reference = dalembert(found.motion)
    idle = np.abs(reference.applied).max(initial=0.0) <= EPSILON * len(K) * float(np.abs(b).max())
    if idle and not len(found.multipliers):  # joints bear all that is given, and what is left of it is its rounding
        return float(of_bodies.max())
    return max(float(of_bodies.max()), ratio(reference, found.jumps, found.multipliers))


def values_agree(found: Found, K: Floats, b: Floats) -> bool | None:
    """Return whether unique components of impulses in joints are those of the one system; None if it is too stiff."""
    x, unique, condition = by_one_system(K, b)
    if condition > STIFF:
        return None
    other, n, count = told(found), len(found.jumps), len(found.motion.bodies)
    joints = slice(n + 6 * count, n + 12 * count)
    largest = max(np.abs(x[joints]).max(initial=0.0), np.abs(b[6 * count : 12 * count]).max())
    return bool((np.abs(x - other)[joints] * unique[joints]).max(initial=0.0) <= VALUES * largest)


def agree(found: Found, called: str) -> bool:
    """Return whether values could be compared as well; the equations are fulfilled in any case."""
    K, b = one_system(found)
    worst = largest_ratio(found, K, b)
    assert worst <= LARGEST_WITH_ROWS, (called, worst)
    compared = values_agree(found, K, b)
    assert compared is not False, called
    return compared is not None


@pytest.mark.parametrize("block", blocks(10, quick=2))
def test_of_random_trees(block: int) -> None:
    compared = 0
    for seed in range(50 * block, 50 * block + 50):
        rng = np.random.default_rng(seed)
        case = random_case(seed, bodies=(1, 8))
        found = by_recursion(random_blow(rng, case.mechanism, case.state(*random_state(rng, case))))
        compared += agree(found, f"tree {seed}")
    assert compared > 25


@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("block", blocks(10, quick=2))
def test_of_random_loops(block: int, times: int) -> None:
    """With two equal joints more the rows depend on each other, and only the sums of their impulses are unique."""
    compared = 0
    for seed in range(25 * block, 25 * block + 25):
        case, state = closed(seed, times=times)
        found = by_recursion(random_blow(np.random.default_rng(seed), case.mechanism, state))
        compared += agree(found, f"loop {seed}")
    assert compared > 12
