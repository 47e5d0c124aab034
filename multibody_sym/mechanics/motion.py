"""How do bodies move: poses and velocities at a state, and accelerations for given udot, over any scalar?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, singledispatch
from typing import Any, Final

import numpy as np

from multibody_sym.mechanics.law_elements import INSTANT, JUMPED
from multibody_sym.mechanics.mechanism import TIME, Mechanism, TreeBody
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import IDENTITY, ORIGIN, Pose
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import Ball, CurveRates, Follow, OneCoordinate, Rotate, ScrewStep, Step, Translate
from multibody_sym.program.statements import Array
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ONE, Node, as_node, slot
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
    quaternion_product,
    quaternion_rates,
    quaternion_rotation,
    rotation_about,
    scale,
    subtract,
    transpose,
    turned_by,
)


@dataclass(frozen=True)
class State:
    """Time, coordinates q (nq), speeds u (nu), parameters and inputs over `scalar` (float, Node or sympy.Expr)."""

    scalar: type
    q: tuple[S, ...]
    u: tuple[S, ...]
    slots: Mapping[Node, S]

    def values(self, nodes: Sequence[Node], known: Mapping[Node, S] | None = None) -> list[Any]:
        """Return expressions in slots, and in further leaves that are `known`, over this state's scalar."""
        return evaluate(nodes, {**self.slots, **known} if known else self.slots, self.scalar)

    def vector(self, nodes: Sequence[Node]) -> Vec:
        """Return three expressions in slots as a vector over this state's scalar, computed once."""
        key = nodes[0], nodes[1], nodes[2]
        found = self._vectors.get(key)
        if found is None:
            x, y, z = self.values(nodes)
            found = self._vectors[key] = x, y, z
        return found

    @cached_property
    def _vectors(self) -> dict[tuple[Node, Node, Node], Vec]:
        return {}


def state_of(
    mechanism: Mechanism,
    scalar: type,
    t: S,
    q: Sequence[S],
    u: Sequence[S],
    parameters: Sequence[S],
    inputs: Sequence[S] | None = None,
) -> State:
    """Return the state with these values; inputs that are not given are computed from their declared expressions."""
    slots: dict[Node, S] = {slot("t", 0): t, INSTANT: t, JUMPED: 0}
    for array, values in (("q", q), ("u", u), ("parameters", parameters)):
        slots.update((slot(array, i), value) for i, value in enumerate(values))
    if inputs is None:
        inputs = evaluate(list(mechanism.inputs.values()), slots, scalar)
    slots.update((slot("inputs", i), value) for i, value in enumerate(inputs))
    return State(scalar, tuple(q), tuple(u), slots)


def slot_state(mechanism: Mechanism) -> State:
    """Return the state whose values are the slots themselves, from which Programs are made."""
    return state_of(
        mechanism,
        Node,
        slot("t", 0),
        [slot("q", i) for i in range(len(mechanism.coordinates))],
        [slot("u", i) for i in range(len(mechanism.speeds))],
        [slot("parameters", i) for i in range(len(mechanism.parameters))],
        [slot("inputs", i) for i in range(len(mechanism.inputs))],
    )


def arrays(mechanism: Mechanism) -> tuple[Array, ...]:
    """Return the inputs that every Program of a system has, in their order."""
    return (
        Array("t", ()),
        Array("q", (len(mechanism.coordinates),)),
        Array("u", (len(mechanism.speeds),)),
        Array("parameters", (len(mechanism.parameters),)),
        Array("inputs", (len(mechanism.inputs),)),
        Array("modes", (len(mechanism.mode_numbers),)),
    )


# ----------------------------------------------------------------------------------------------------------------------
# What a joint lets happen, over any scalar: the motion of its frame M relative to F, step by step.
#
# Vectors that describe the motion are in M's axes. One rule serves all joints: a joint is its elementary steps, and a
# ball if free rotation follows them.


@dataclass(frozen=True)
class JointMotion:
    """The motion of M relative to F.

    `rotation` R_FM, `position` of M in F's axes; `linear[k]`, `angular[k]`: velocity and angular velocity of M for a
    unit speed u[k], in M's axes; `given_linear`, `given_angular`: those of prescribed steps; `turning`: its whole
    angular velocity; `linear_bias`, `angular_bias`: its acceleration and angular acceleration relative to F
    without udot.
    """

    rotation: Mat = UNIT_MATRIX
    position: Vec = ZERO_VECTOR
    linear: tuple[Vec, ...] = ()
    angular: tuple[Vec, ...] = ()
    given_linear: Vec = ZERO_VECTOR
    given_angular: Vec = ZERO_VECTOR
    turning: Vec = ZERO_VECTOR
    linear_bias: Vec = ZERO_VECTOR
    angular_bias: Vec = ZERO_VECTOR


def translated(before: JointMotion, axis: Vec, q: S, u: S) -> JointMotion:
    """Return the motion when M has moved on by q along a unit axis: the velocity of M gains u a + omega x q a."""
    return _moved_on(before, scale(q, axis), axis, scale(u, axis))


def _moved_on(before: JointMotion, arm: Vec, way: Vec, along: Vec) -> JointMotion:
    """Return the motion when M has moved on by an arm that changes by `way` a unit speed, and now at the rate `along`.

    What the arm's rate changes by itself is left out.
    """
    w = before.turning
    bias = add(cross(before.angular_bias, arm), cross(w, add(cross(w, arm), add(along, along))))
    return replace(
        before,
        position=add(before.position, apply(before.rotation, arm)),
        linear=(*(add(v, cross(w_k, arm)) for v, w_k in zip(before.linear, before.angular, strict=True)), way),
        angular=(*before.angular, ZERO_VECTOR),
        given_linear=add(before.given_linear, cross(before.given_angular, arm)),
        linear_bias=add(before.linear_bias, bias),
    )


@dataclass(frozen=True)
class CurveDerivatives:
    """How a vector (or, in its last component, an angle) follows a parameter s and t: derivatives along s and in t."""

    s: Vec
    t: Vec
    ss: Vec
    st: Vec
    tt: Vec

    def rate(self, u: S) -> Vec:
        """Return its rate where s' = u."""
        return add(scale(u, self.s), self.t)

    def bias(self, u: S) -> Vec:
        """Return the rate of that, without s''."""
        return add(scale(u, add(scale(u, self.ss), scale(2, self.st))), self.tt)


def rotated(before: JointMotion, rotation: Mat, axes: Sequence[Vec], u: Sequence[S]) -> JointMotion:
    """Return the motion when M has turned: angular velocity sum u_k a_k, with the axes a_k constant in the new M."""
    carried = apply_transposed(rotation, before.turning)
    own: Vec = ZERO_VECTOR
    for axis, rate in zip(axes, u, strict=True):
        own = add(own, scale(rate, axis))
    return JointMotion(
        rotation=product(before.rotation, rotation),
        position=before.position,
        linear=(*(apply_transposed(rotation, v) for v in before.linear), *(ZERO_VECTOR for _ in axes)),
        angular=(*(apply_transposed(rotation, w) for w in before.angular), *axes),
        given_linear=apply_transposed(rotation, before.given_linear),
        given_angular=apply_transposed(rotation, before.given_angular),
        turning=add(carried, own),
        linear_bias=apply_transposed(rotation, before.linear_bias),
        angular_bias=add(apply_transposed(rotation, before.angular_bias), cross(carried, own)),
    )


def prescribed(after: JointMotion, rate: S, acceleration: S) -> JointMotion:
    """Return the motion where the last step, which has moved at `rate`, is not free but moves so by itself."""
    (*linear, v), (*angular, w) = after.linear, after.angular
    return replace(
        after,
        linear=tuple(linear),
        angular=tuple(angular),
        given_linear=add(after.given_linear, scale(rate, v)),
        given_angular=add(after.given_angular, scale(rate, w)),
        linear_bias=add(after.linear_bias, scale(acceleration, v)),
        angular_bias=add(after.angular_bias, scale(acceleration, w)),
    )


def seen_from(joint: JointMotion, R_BM: Mat, p_BM: Vec) -> JointMotion:
    """Return the velocities and accelerations of another point of the moving body instead of M, in its axes.

    M stands at p_BM from that point, turned by R_BM.
    """
    if R_BM is UNIT_MATRIX and p_BM is ZERO_VECTOR:
        return joint
    angular = tuple(apply(R_BM, w) for w in joint.angular)
    linear = tuple(subtract(apply(R_BM, v), cross(w, p_BM)) for v, w in zip(joint.linear, angular, strict=True))
    turning, angular_bias = apply(R_BM, joint.turning), apply(R_BM, joint.angular_bias)
    given_angular = apply(R_BM, joint.given_angular)
    offset = add(cross(angular_bias, p_BM), cross(turning, cross(turning, p_BM)))
    return replace(
        joint,
        linear=linear,
        angular=angular,
        given_linear=subtract(apply(R_BM, joint.given_linear), cross(given_angular, p_BM)),
        given_angular=given_angular,
        turning=turning,
        linear_bias=subtract(apply(R_BM, joint.linear_bias), offset),
        angular_bias=angular_bias,
    )


# ----------------------------------------------------------------------------------------------------------------------
# How each kind of step moves a body, over floats, Nodes and sympy: pose, velocity, rates, and what it leaves alone.
#
# The kinds stand in `model/steps.py`; a new one registers here how it moves. Steps of one coordinate whose rate is
# their speed have the rest in common.

_UP: Final[Vec] = (0, 0, 1)


@singledispatch
def after_step(step: Step, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    """Return the motion of M when a step has followed those `before`, at its coordinates q and speeds u."""
    raise TypeError(f"nothing says how {type(step).__name__} moves a body")


@after_step.register
def _(step: Translate, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    return translated(before, state.vector(step.axis), q[0], u[0])


@after_step.register
def _(step: Rotate, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    axis = state.vector(step.axis)
    return rotated(before, rotation_about(axis, q[0]), (axis,), u)


@after_step.register
def _(step: ScrewStep, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    """M turns by q about a unit axis and advances by lead q along it."""
    axis, lead = state.vector(step.axis), state.values([step.lead])[0]
    moved = translated(before, axis, lead * q[0], lead * u[0])
    turned_too = rotated(moved, rotation_about(axis, q[0]), (axis,), (u[0],))
    return replace(
        turned_too,
        linear=(*turned_too.linear[:-2], scale(lead, axis)),
        angular=(*turned_too.angular[:-2], axis),
    )


@after_step.register
def _(step: Ball, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    return rotated(before, quaternion_rotation(q), UNIT_MATRIX, u)


@after_step.register
def _(step: Follow, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    """Derivatives are taken of the expressions, so that all scalars have the same exact ones."""
    at = {step.leaf: q[0]}
    axes = [state.vector(axis) for axis in step.axes]
    place, way = combination(axes, state.values(step.place, at)), _curve_derivatives(step.rates, axes, state, at)
    moved = _moved_on(before, place, way.s, way.rate(u[0]))
    moved = replace(
        moved, given_linear=add(moved.given_linear, way.t), linear_bias=add(moved.linear_bias, way.bias(u[0]))
    )
    if not step.turns_along:
        return moved
    cosine, sine = state.values(step.tangent, at)
    axis, angle = axes[2], _curve_derivatives(step.turning, (_UP,), state, at)
    turned_too = rotated(moved, turned_by(axis, cosine, sine), (axis,), (angle.rate(u[0])[2],))
    given, bias = scale(angle.t[2], axis), scale(angle.bias(u[0])[2], axis)
    return replace(
        turned_too,
        linear=turned_too.linear[:-1],
        angular=(*turned_too.angular[:-2], scale(angle.s[2], axis)),
        given_angular=add(turned_too.given_angular, given),
        angular_bias=add(turned_too.angular_bias, bias),
    )


def _curve_derivatives(rates: CurveRates, axes: Sequence[Vec], state: State, at: Mapping[Node, S]) -> CurveDerivatives:
    """Return derivatives with their components along axes."""
    return CurveDerivatives(*(combination(axes, state.values(nodes, at)) for nodes in rates))


@singledispatch
def step_rates(step: Step, q: Sequence[S], u: Sequence[S]) -> Sequence[S]:
    """Return the rates of a step's coordinates, qdot = N(q) u."""
    raise TypeError(f"nothing says how the coordinates of {type(step).__name__} follow its speeds")


@step_rates.register
def _(step: OneCoordinate, q: Sequence[S], u: Sequence[S]) -> Sequence[S]:
    return u


@step_rates.register
def _(step: Ball, q: Sequence[S], u: Sequence[S]) -> Sequence[S]:
    return quaternion_rates(q, u)


@singledispatch
def invariant_directions(step: Step) -> tuple[Point, ...]:
    """Return the directions along which both frames may be moved together, and the step moves the body just so."""
    raise TypeError(f"nothing says which directions {type(step).__name__} leaves alone")


@invariant_directions.register
def _(step: Translate) -> tuple[Point, ...]:
    return IDENTITY


@invariant_directions.register(Rotate)
@invariant_directions.register(ScrewStep)
def _(step: Rotate | ScrewStep) -> tuple[Point, ...]:
    return (step.axis,)


@invariant_directions.register
def _(step: Follow) -> tuple[Point, ...]:
    return (step.axis,) if step.turns_along else IDENTITY


@invariant_directions.register
def _(step: Ball) -> tuple[Point, ...]:
    return ()


@singledispatch
def displaced(step: Step, q: Floats, sigma: Floats) -> Floats:
    """Return a step's coordinates displaced by deviations, one for each speed: small ones move as its speeds do."""
    raise TypeError(f"nothing says how {type(step).__name__} is displaced")


@displaced.register
def _(step: OneCoordinate, q: Floats, sigma: Floats) -> Floats:
    return q + sigma


@displaced.register
def _(step: Ball, q: Floats, sigma: Floats) -> Floats:
    """Turn on by the rotation vector sigma."""
    angle = float(np.linalg.norm(sigma))
    part = 0.5 * np.sinc(angle / (2.0 * np.pi))
    found = np.array(quaternion_product(q.tolist(), [np.cos(angle / 2.0), *(part * sigma)]), dtype=float)
    unit: Floats = found / np.linalg.norm(found)
    return unit


@singledispatch
def deviation_suffixes(step: Step) -> tuple[str | None, ...]:
    """Return the endings of the names of deviations, after the joint's; None where one is that of a coordinate."""
    raise TypeError(f"nothing says what the deviations of {type(step).__name__} are called")


@deviation_suffixes.register
def _(step: OneCoordinate) -> tuple[str | None, ...]:
    return (None,)


@deviation_suffixes.register
def _(step: Ball) -> tuple[str | None, ...]:
    return (".rx", ".ry", ".rz")


@singledispatch
def carried_deviations(step: Step, u: Sequence[float]) -> Floats:
    """Return the matrix D of sigma' = D sigma + ..., the change of deviations by the motion itself."""
    raise TypeError(f"nothing says what motion makes of the deviations of {type(step).__name__}")


@carried_deviations.register
def _(step: OneCoordinate, u: Sequence[float]) -> Floats:
    return np.zeros((1, 1))


@carried_deviations.register
def _(step: Ball, u: Sequence[float]) -> Floats:
    """theta' = - omega x theta."""
    x, y, z = u
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


@singledispatch
def turning_momenta(step: Step, u: Sequence[Any], momenta: Sequence[Any]) -> Sequence[Any]:
    """Return N^T (d/dt dT/dqdot - dT/dq) less d/dt dT/du - N^T dT/dq: zero where u = qdot."""
    raise TypeError(f"nothing says how Lagrange's equations hold in the speeds of {type(step).__name__}")


@turning_momenta.register
def _(step: OneCoordinate, u: Sequence[Any], momenta: Sequence[Any]) -> Sequence[Any]:
    return (0,)


@turning_momenta.register
def _(step: Ball, u: Sequence[Any], momenta: Sequence[Any]) -> Sequence[Any]:
    """Return omega x p.

    Of an angular velocity omega = 2 E(q) qdot, N = E^T / 2: with p = dT/domega, dT/dqdot = 2 E^T p, and the projection
    leaves N^T (d/dt (2 E^T) - (d(2 E qdot)/dq)^T) p = omega x p; the multiplier of |q| = 1 drops out because N^T q = 0.
    """
    x, y, z = u
    a, b, c = momenta
    return cross((x, y, z), (a, b, c))


# ----------------------------------------------------------------------------------------------------------------------
# The motion of all bodies of a mechanism, by a forward recursion from the world.


@dataclass(frozen=True)
class BodyMotion:
    """One body's motion; B is the body, P its parent, W the world. `v_WB` is the velocity of the body's origin,
    `gravity` the acceleration of free fall.

    `linear[k]`, `angular[k]`: partial velocities of the joint's speeds relative to the parent; `given_linear`,
    `given_angular`: velocities of its prescribed motion. `linear_bias`, `angular_bias`: accelerations by the joint
    besides udot (Coriolis terms, relative accelerations). All in body axes, except `p_PB` (in the
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
        return self.state.vector(marker.pose.position)

    @cached_property
    def places(self) -> dict[tuple[int, Point], Vec]:
        """Positions in world axes (m) of points on bodies, by body and position there, once computed."""
        return {}

    @cached_property
    def directions(self) -> dict[tuple[int, tuple[Point, Point, Point], Point], Vec]:
        """Vectors in world axes fixed on bodies, by body, the axes there and components along these, once computed."""
        return {}


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
    world = moving_parent(ZERO_VECTOR, ZERO_VECTOR, state.vector(mechanism.gravity))
    for body in mechanism.bodies:
        parent = moved[body.parent] if body.parent >= 0 else world
        moved.append(body_motion(body, parent, state))
        masses.append(body_mass(body, state))
    return Motion(mechanism, state, tuple(moved), tuple(masses), world.gravity)


def moving_parent(w_WB: Vec, v_WB: Vec, gravity: Vec) -> BodyMotion:
    """Return a parent for a child's motion: its velocities and gravity, in its own axes."""
    return replace(_WORLD, w_WB=w_WB, v_WB=v_WB, gravity=gravity)


def body_motion(body: TreeBody, parent: BodyMotion, state: State) -> BodyMotion:
    u = [state.u[k] for k in body.u]
    R_PF, p_PF = pose(state, body.frame_on_parent)
    R_BM, p_BM = pose(state, body.frame_on_body)
    joint, free_steps = JointMotion(), iter(body.free_steps)
    for step, given in zip(body.steps, body.given, strict=True):
        if given is None:
            free = next(free_steps)
            joint = after_step(step, joint, [state.q[k] for k in free.q], [state.u[k] for k in free.u], state)
        else:
            q, rate, acceleration = state.values(given)
            joint = prescribed(after_step(step, joint, [q], [rate], state), rate, acceleration)
    R_PB = product(product(R_PF, joint.rotation), transpose(R_BM))
    p_PB = subtract(add(p_PF, apply(R_PF, joint.position)), apply(R_PB, p_BM))
    joint = seen_from(joint, R_BM, p_BM)  # the motion of B's origin, in B's axes, as the joint's own is in M's
    w_rel, v_rel = joint.turning, add(combination(joint.linear, u), joint.given_linear)
    w_parent = apply_transposed(R_PB, parent.w_WB)
    v_point = add(parent.v_WB, cross(parent.w_WB, p_PB))
    coriolis = cross(w_parent, v_rel)
    return BodyMotion(
        R_PB=R_PB,
        p_PB=p_PB,
        w_WB=add(w_parent, w_rel),
        v_WB=add(apply_transposed(R_PB, v_point), v_rel),
        linear=joint.linear,
        angular=joint.angular,
        given_linear=joint.given_linear,
        given_angular=joint.given_angular,
        linear_bias=add(add(coriolis, coriolis), joint.linear_bias),
        angular_bias=add(cross(w_parent, w_rel), joint.angular_bias),
        gravity=apply_transposed(R_PB, parent.gravity),
    )


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
    """Return N(q) u of the whole mechanism: how coordinates change with the speeds, which declared states do not."""
    qdot: list[S] = []
    for body in mechanism.bodies:
        qdot.extend(joint_rates(body, q, u))
    return [*qdot, *(0 * q[k] for k in range(len(qdot), len(mechanism.coordinates)))]


def qdot_of(state: State, mechanism: Mechanism, u: Sequence[S] | None = None) -> list[S]:
    """Return qdot in the motion: N(q) u, and the rates of declared states; `u` in place of the speeds of the joints."""
    qdot = coordinate_rates(mechanism, state.q, state.u if u is None else u)
    rates = mechanism.rates
    return [*qdot[: len(qdot) - len(rates)], *state.values(rates)] if rates else qdot


def joint_rates(body: TreeBody, q: Sequence[S], u: Sequence[S]) -> list[S]:
    """Return the part of qdot = N(q) u that belongs to the joint of `body`; q and u are those of the mechanism."""
    return [
        rate
        for free in body.free_steps
        for rate in step_rates(free.step, [q[k] for k in free.q], [u[k] for k in free.u])
    ]


def rates_of_state(mechanism: Mechanism) -> dict[Node, Node]:
    """Return the rate of each slot that changes: qdot, udot as slots, 1 of the time."""
    state = slot_state(mechanism)
    qdot = [as_node(rate) for rate in qdot_of(state, mechanism)]
    udot = [slot("udot", k) for k in range(len(mechanism.speeds))]
    return dict(zip([*state.q, *state.u, TIME], [*qdot, *udot, ONE], strict=True))


def pose(state: State, declared: Pose) -> tuple[Mat, Vec]:
    """Return a declared pose (rotation, position) over the state's scalar."""
    position = state.vector(declared.position) if declared.position is not ORIGIN else ZERO_VECTOR
    if declared.rotation is IDENTITY:
        return UNIT_MATRIX, position
    rows = [state.vector(row) for row in declared.rotation]
    return (rows[0], rows[1], rows[2]), position


def body_pose(moved: BodyMotion, parent: tuple[Mat, Vec]) -> tuple[Mat, Vec]:
    """Return R_WB and p_WB of one body, given those of its parent."""
    R_WP, p_WP = parent
    return product(R_WP, moved.R_PB), add(p_WP, apply(R_WP, moved.p_PB))


def body_mass(body: TreeBody, state: State) -> BodyMass:
    xx, yy, zz, xy, xz, yz = state.values(body.mass.inertia)
    inertia: Mat = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return BodyMass(state.values([body.mass.mass])[0], state.vector(body.mass.com), inertia)


_WORLD = BodyMotion(UNIT_MATRIX, ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR, (), (), *(ZERO_VECTOR,) * 5)


# ----------------------------------------------------------------------------------------------------------------------
# Partial velocities: how each body moves at unit speed of one freedom and, just so, accelerates at unit udot.

PartialVelocities = Mapping[int, tuple[Vec, Vec]]
"""For each speed that moves a body: velocity of its origin and angular velocity at unit speed, in its axes."""
_TURNS: Final = 3
_LOCKED: Final = 1e-3
"""The volume that the axes of three turns span, below which they do not span space."""


def partial_velocities(motion: Motion) -> list[PartialVelocities]:
    """Return each body's partial velocities with respect to the speeds that move it."""
    found: list[PartialVelocities] = []
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        parent = found[body.parent] if body.parent >= 0 else {}
        carried = {k: from_parent(moved, partial) for k, partial in parent.items()}
        own = dict(zip(body.u, zip(moved.linear, moved.angular, strict=True), strict=True))
        found.append({**carried, **own})
    return found


def why_locked(motion: Motion, place: int) -> str | None:
    """Return the text that a body's first and third of three successive turns have one axis, over floats; else None."""
    body, moved = motion.mechanism.bodies[place], motion.bodies[place]
    turns = [free for free in body.free_steps if free.step.is_hinge]
    axes = [moved.angular[body.u.index(free.u[0])] for free in turns]
    if len(turns) != _TURNS or abs(np.linalg.det(np.array(axes, dtype=float))) > _LOCKED:
        return None
    first, _, third = (motion.mechanism.coordinates[free.q[0]].name for free in turns)
    return (
        f"{first} and {third} turn {body.name} about one axis there, and their rates have no bound: leave out "
        f"angles: of joint {body.joint_name}, which then has a quaternion, or choose others"
    )
