"""Reactions in loops by a second route: another joint of the loop is cut, and each body is balanced by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from mechanisms import Case
from random_loops import closed

import multibody_sym as mbs
from multibody_sym.analysis.check import partial_velocities
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.redundancy import redundancy
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.mechanism import TIME
from multibody_sym.mechanics.motion import Motion, State, accelerations, motion_of, pose
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.fields import Names
from multibody_sym.text.printer import COMPONENTS

Floats = np.ndarray


@dataclass(frozen=True)
class Solved:
    """A mechanism at a state, with its accelerations by name and the reactions of all joints."""

    motion: Motion
    udot: dict[str, float]
    reactions: dict[str, dict[str, float]]
    ambiguous: dict[str, tuple[str, ...]]


def solved(case: Case, state: State) -> Solved:
    motion, dynamics = motion_of(case.mechanism, state), composite_body(case.mechanism, state)
    found = forward_dynamics(dynamics)
    told = reactions(motion, found.udot.tolist(), dynamics.rows, found.multipliers.tolist())
    names = [speed.name for speed in case.mechanism.speeds]
    return Solved(
        motion,
        dict(zip(names, found.udot.tolist(), strict=True)),
        {name: {c: float(x) for c, x in parts.items()} for name, parts in told.items()},
        dict(redundancy(motion, dynamics).ambiguous),
    )


def cut_elsewhere(case: Case, state: State) -> tuple[Case, State] | None:
    """Return the same loop at the same state, cut at the joint that carried the child of the joint cut before.

    The frames of that one are in one place there: its coordinates are zero, and its speeds those with which the child
    moves as before. None where no rows can stand for the joint.
    """
    joints = case.system.joints
    child = joints["L0"].child.partition(".")[0]
    other = next(name for name, joint in joints.items() if name != "L0" and joint.child.partition(".")[0] == child)
    changed = {**joints, "L0": replace(joints["L0"], cut=None), other: replace(joints[other], cut=True)}
    try:
        system = replace(case.system, joints=Names(changed))
        resolved = mbs.mechanism(system)
    except ModelError:
        return None
    again = Case(case.seed, system, resolved, parameter_values(resolved, {}))
    q_known = dict(zip((c.name for c in case.mechanism.coordinates), state.q, strict=True))
    u_known = dict(zip((s.name for s in case.mechanism.speeds), state.u, strict=True))
    t, ones = state.slots[TIME], {"L0_qw": 1.0}
    q = [q_known.get(c.name, ones.get(c.name, 0.0)) for c in resolved.coordinates]
    u = np.array([u_known.get(s.name, 0.0) for s in resolved.speeds])
    sought = [k for k, s in enumerate(resolved.speeds) if s.name not in u_known]

    def twist(of: Case, q: list[float], u: list[float]) -> Floats:
        moved = of.motion(t, q, u).bodies[of.mechanism.body_index(child)]
        return np.array([*moved.v_WB, *moved.w_WB], dtype=float)

    rest = twist(again, q, u.tolist())
    columns = [twist(again, q, (u + unit).tolist()) - rest for unit in np.eye(len(u))[sought]]
    wanted = twist(case, list(state.q), list(state.u)) - rest
    u[sought] = np.linalg.lstsq(np.array(columns).reshape(-1, 6).T, wanted, rcond=None)[0]
    rows = row_motions(again.motion(t, q, u.tolist()))
    assert max((abs(x) for row in rows for x in (row.phi or 0.0, row.phidot)), default=0.0) < 1e-8
    return again, again.state(t, q, u.tolist())


def unbalanced(found: Solved) -> float:
    """Return the largest force or moment that is missing on a body, relative to the largest there is."""
    motion, mechanism = found.motion, found.motion.mechanism
    count = len(motion.bodies)
    forces, moments, sizes = np.zeros((count, 3)), np.zeros((count, 3)), np.ones(count)

    def act(body: int, force: Floats, moment: Floats, place: Floats) -> None:
        if body >= 0:
            R, p = (np.array(x, dtype=float) for x in motion.poses[body])
            arm = place - p - R @ np.array(motion.masses[body].com, dtype=float)
            forces[body] += force
            moments[body] += moment + np.cross(arm, force)
            sizes[body] += np.linalg.norm(force) * (1 + np.linalg.norm(arm)) + np.linalg.norm(moment)

    for name, parent, R_PF, child, p_CM in joints_of(found.motion):
        R_W = rotation(motion, parent) @ R_PF
        place = position(motion, child) + rotation(motion, child) @ p_CM
        parts = np.array([found.reactions[name][c] for c in COMPONENTS])
        force, moment = R_W @ parts[:3], R_W @ parts[3:]
        act(carried(motion, child), force, moment, place)
        act(parent, -force, -moment, place)
    udot = [found.udot[s.name] for s in mechanism.speeds]
    partials, loads = partial_velocities(motion), applied_forces(motion).of_body
    for k, (a, alpha) in enumerate(accelerations(motion, udot)):
        R, mass, com = partials[k].rotation, float(motion.masses[k].mass), np.array(motion.masses[k].com, dtype=float)
        tensor, w = np.array(motion.masses[k].inertia, dtype=float), np.array(motion.bodies[k].w_WB, dtype=float)
        alpha = np.array(alpha, dtype=float)
        a_com = np.array(a, dtype=float) + np.cross(alpha, com) + np.cross(w, np.cross(w, com))
        force, moment = (np.array(x, dtype=float) for x in loads[k])
        forces[k] += R @ (force - mass * a_com)
        moments[k] += R @ (moment - np.cross(com, force) - tensor @ alpha - np.cross(w, tensor @ w))
        sizes[k] += np.linalg.norm(force) + mass * np.linalg.norm(a_com) + np.linalg.norm(moment)
    missing = np.abs(np.hstack([forces, moments])).max(axis=1)
    return float((missing / sizes.max()).max())


def joints_of(motion: Motion) -> list[tuple[str, int, Floats, int, Floats]]:
    """Return each joint's name, its parent with the frame's rotation there, and its child with the point there."""
    found = []
    for k, body in enumerate(motion.mechanism.bodies):
        R_PF, p_BM = pose(motion.state, body.frame_on_parent)[0], pose(motion.state, body.frame_on_body)[1]
        found.append((body.joint_name, body.parent, np.array(R_PF, float), k, np.array(p_BM, float)))
    for cut in motion.mechanism.cuts:
        frame, point = cut.frames
        R_PF = np.array(pose(motion.state, frame.pose)[0], float)
        found.append((cut.name, frame.body, R_PF, point.body, np.array(motion.point(point), float)))
    return found


def carried(motion: Motion, body: int) -> int:
    """Return the body that a joint acts on: for the massless double that a cut joint carries, the body itself."""
    name = motion.mechanism.bodies[body].name
    if not name.startswith("double of "):
        return body
    child, _, _ = name.removeprefix("double of ").partition(" at ")
    return motion.mechanism.body_index(child.partition(".")[0])


def rotation(motion: Motion, body: int) -> Floats:
    return np.array(motion.rotation(body), dtype=float)


def position(motion: Motion, body: int) -> Floats:
    return np.array(motion.poses[body][1], dtype=float) if body >= 0 else np.zeros(3)


@pytest.mark.parametrize("block", [k if k < 1 else pytest.param(k, marks=pytest.mark.long) for k in range(12)])
def test_reactions_do_not_depend_on_the_joint_that_is_cut(block: int) -> None:
    compared = 0
    for seed in range(8 * block, 8 * block + 8):
        case, state = closed(seed)
        other = cut_elsewhere(case, state)
        if other is None:
            continue
        one, two = solved(case, state), solved(*other)
        assert unbalanced(one) < 1e-13, f"seed {seed}"
        assert unbalanced(two) < 1e-13, f"seed {seed}"
        largest = max(abs(x) for name in two.reactions for x in two.reactions[name].values())
        for name in one.reactions.keys() & two.reactions.keys():
            hidden = {*one.ambiguous.get(name, ()), *two.ambiguous.get(name, ())}
            for component in set(COMPONENTS) - hidden:
                a, b = one.reactions[name][component], two.reactions[name][component]
                assert a == pytest.approx(b, rel=1e-9, abs=1e-10 * largest), f"seed {seed}: {name} {component}"
                compared += 1
    assert compared > 50
