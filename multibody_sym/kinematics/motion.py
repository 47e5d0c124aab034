"""Motion: positions and velocities of all bodies, and the accelerations that given udot produce."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

from multibody_sym.kinematics.joints import JointMotion, prescribed, seen_from
from multibody_sym.kinematics.state import State
from multibody_sym.kinematics.steps import step_rates, stepped
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import IDENTITY, ORIGIN, Pose
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    combination,
    cross,
    product,
    subtract,
    transpose,
)


@dataclass(frozen=True)
class BodyMotion:
    """One body's motion; B is the body, P its parent, W the world. `v_WB` is the velocity of the body's origin,
    `gravity` the acceleration of free fall.

    `linear[k]`, `angular[k]`: partial velocities of the joint's speeds relative to the parent; `given_linear`,
    `given_angular`: what its prescribed motion adds. `linear_bias`, `angular_bias`: what the joint adds to the
    accelerations besides udot (Coriolis terms, relative accelerations). All in body axes, except `p_PB` (in the
    parent's).
    """

    R_PB: Mat
    p_PB: Vec
    w_WB: Vec
    v_WB: Vec
    linear: tuple[Vec, ...]
    angular: tuple[Vec, ...]
    given_linear: Vec
    given_angular: Vec
    linear_bias: Vec
    angular_bias: Vec
    gravity: Vec


@dataclass(frozen=True)
class BodyMass:
    """Mass, centre of mass and inertia about it over a scalar, in body axes."""

    mass: S
    com: Vec
    inertia: Mat


@dataclass(frozen=True)
class Motion:
    """All bodies' motion at a state, in tree order, with their masses and the gravity vector over the same scalar."""

    mechanism: Mechanism
    state: State
    bodies: tuple[BodyMotion, ...]
    masses: tuple[BodyMass, ...]
    gravity: Vec

    @cached_property
    def poses(self) -> list[tuple[Mat, Vec]]:
        """Orientation R_WB and position p_WB (world axes) of every body."""
        found: list[tuple[Mat, Vec]] = []
        for body, moved in zip(self.mechanism.bodies, self.bodies, strict=True):
            found.append(body_pose(moved, found[body.parent] if body.parent >= 0 else (UNIT_MATRIX, ZERO_VECTOR)))
        return found

    def rotation(self, body: int) -> Mat:
        """Return R_WB; the unit matrix for a ground at rest."""
        return self.poses[body][0] if body >= 0 else UNIT_MATRIX

    def point(self, marker: Marker) -> Vec:
        """Return a marker's position in its body's axes."""
        return _triple(self.state, marker.pose.position)


@dataclass(frozen=True)
class PlacedMotion(Motion):
    """Motion whose poses were found elsewhere."""

    placed: list[tuple[Mat, Vec]]

    @cached_property
    def poses(self) -> list[tuple[Mat, Vec]]:
        """Orientation R_WB and position p_WB (world axes) of every body."""
        return self.placed


def motion_of(mechanism: Mechanism, state: State) -> Motion:
    """Return the motion of all bodies at a state (forward recursion from the world)."""
    moved: list[BodyMotion] = []
    masses = []
    world = moving_parent(ZERO_VECTOR, ZERO_VECTOR, _triple(state, mechanism.gravity))
    for body in mechanism.bodies:
        parent = moved[body.parent] if body.parent >= 0 else world
        moved.append(body_motion(body, parent, state))
        masses.append(body_mass(body, state))
    return Motion(mechanism, state, tuple(moved), tuple(masses), world.gravity)


def moving_parent(w_WB: Vec, v_WB: Vec, gravity: Vec) -> BodyMotion:
    """Return what the motion of a child depends on: its parent's velocities and gravity, in the parent's axes."""
    return replace(_WORLD, w_WB=w_WB, v_WB=v_WB, gravity=gravity)


def body_motion(body: TreeBody, parent: BodyMotion, state: State) -> BodyMotion:
    """Return the motion of one body, given that of its parent."""
    u = [state.u[k] for k in body.u]
    R_PB, p_PB, joint = _relative(body, state)
    w_rel, v_rel = joint.turning, add(combination(joint.linear, u), joint.given_linear)
    w_parent = apply_transposed(R_PB, parent.w_WB)
    v_point = add(parent.v_WB, cross(parent.w_WB, p_PB))
    return BodyMotion(
        R_PB=R_PB,
        p_PB=p_PB,
        w_WB=add(w_parent, w_rel),
        v_WB=add(apply_transposed(R_PB, v_point), v_rel),
        linear=joint.linear,
        angular=joint.angular,
        given_linear=joint.given_linear,
        given_angular=joint.given_angular,
        linear_bias=add(_twice(cross(w_parent, v_rel)), joint.linear_bias),
        angular_bias=add(cross(w_parent, w_rel), joint.angular_bias),
        gravity=apply_transposed(R_PB, parent.gravity),
    )


def _relative(body: TreeBody, state: State) -> tuple[Mat, Vec, JointMotion]:
    """Return R_PB, p_PB, and the motion of B's origin relative to P in B's axes, as the joint's own is in M's."""
    R_PF, p_PF = pose(state, body.frame_on_parent)
    R_BM, p_BM = pose(state, body.frame_on_body)
    joint = _joint_motion(body, state)
    R_PB = product(product(R_PF, joint.rotation), transpose(R_BM))
    p_PB = subtract(add(p_PF, apply(R_PF, joint.position)), apply(R_PB, p_BM))
    return R_PB, p_PB, seen_from(joint, R_BM, p_BM)


def _joint_motion(body: TreeBody, state: State) -> JointMotion:
    moved, free_steps = JointMotion(), iter(body.free_steps)
    for step, given in zip(body.steps, body.given, strict=True):
        if given is None:
            free = next(free_steps)
            moved = stepped(step, moved, [state.q[k] for k in free.q], [state.u[k] for k in free.u], state)
        else:
            q, rate, acceleration = state.values(given)
            moved = prescribed(stepped(step, moved, [q], [rate], state), rate, acceleration)
    return moved


def accelerations(motion: Motion, udot: Sequence[S], base: Vec = ZERO_VECTOR) -> list[tuple[Vec, Vec]]:
    """Return each body's (acceleration of its origin, angular acceleration) in body axes for given udot.

    `base` is the world's acceleration: with -g the result contains the weight (an apparent acceleration).
    """
    found: list[tuple[Vec, Vec]] = []
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        parent = found[body.parent] if body.parent >= 0 else (base, ZERO_VECTOR)
        w_parent = motion.bodies[body.parent].w_WB if body.parent >= 0 else ZERO_VECTOR
        found.append(body_acceleration(moved, w_parent, parent, [udot[k] for k in body.u]))
    return found


def body_acceleration(
    moved: BodyMotion, w_parent: Vec, parent: tuple[Vec, Vec], udot: Sequence[S]
) -> tuple[Vec, Vec]:
    """Return one body's accelerations, given its parent's angular velocity and accelerations and the joint's udot."""
    a_parent, alpha_parent = parent
    carried = apply_transposed(moved.R_PB, add(a_parent, apply(spread(alpha_parent, w_parent), moved.p_PB)))
    a = add(carried, add(combination(moved.linear, udot), moved.linear_bias))
    alpha_carried = apply_transposed(moved.R_PB, alpha_parent)
    return a, add(alpha_carried, add(combination(moved.angular, udot), moved.angular_bias))


def from_parent(moved: BodyMotion, parent: tuple[Vec, Vec]) -> tuple[Vec, Vec]:
    """Return the accelerations (linear, angular) that a body at rest shares with its parent, in the body's axes."""
    a, alpha = parent
    return apply_transposed(moved.R_PB, add(a, cross(alpha, moved.p_PB))), apply_transposed(moved.R_PB, alpha)


def spread(alpha: Vec, w: Vec) -> Mat:
    """Return [alpha] + [w][w]: times r it is how much more a point at r accelerates than the reference point."""
    xx, yy, zz = w[0] * w[0], w[1] * w[1], w[2] * w[2]
    xy, xz, yz = w[0] * w[1], w[0] * w[2], w[1] * w[2]
    return (
        (-(yy + zz), xy - alpha[2], xz + alpha[1]),
        (xy + alpha[2], -(xx + zz), yz - alpha[0]),
        (xz - alpha[1], yz + alpha[0], -(xx + yy)),
    )


def coordinate_rates(mechanism: Mechanism, q: Sequence[S], u: Sequence[S]) -> list[S]:
    """Return qdot = N(q) u of the whole mechanism."""
    qdot: list[S] = []
    for body in mechanism.bodies:
        qdot.extend(joint_rates(body, q, u))
    return qdot


def joint_rates(body: TreeBody, q: Sequence[S], u: Sequence[S]) -> list[S]:
    """Return the part of qdot = N(q) u that belongs to the joint of `body`; q and u are those of the mechanism."""
    return [
        rate
        for free in body.free_steps
        for rate in step_rates(free.step, [q[k] for k in free.q], [u[k] for k in free.u])
    ]


def pose(state: State, declared: Pose) -> tuple[Mat, Vec]:
    """Return a declared pose (rotation, position) over the state's scalar."""
    position = _triple(state, declared.position) if declared.position is not ORIGIN else ZERO_VECTOR
    if declared.rotation is IDENTITY:
        return UNIT_MATRIX, position
    rows = [_triple(state, row) for row in declared.rotation]
    return (rows[0], rows[1], rows[2]), position


def _triple(state: State, nodes: Sequence[Node]) -> Vec:
    x, y, z = state.values(nodes)
    return x, y, z


def body_pose(moved: BodyMotion, parent: tuple[Mat, Vec]) -> tuple[Mat, Vec]:
    """Return R_WB and p_WB of one body, given those of its parent."""
    R_WP, p_WP = parent
    return product(R_WP, moved.R_PB), add(p_WP, apply(R_WP, moved.p_PB))


def body_mass(body: TreeBody, state: State) -> BodyMass:
    """Return the mass of one body."""
    xx, yy, zz, xy, xz, yz = state.values(body.mass.inertia)
    inertia: Mat = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return BodyMass(state.values([body.mass.mass])[0], _triple(state, body.mass.com), inertia)


def _twice(a: Vec) -> Vec:
    return add(a, a)


_WORLD = BodyMotion(UNIT_MATRIX, ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR, (), (), *(ZERO_VECTOR,) * 5)
