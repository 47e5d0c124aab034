"""How the forces that a tree needs change with its coordinates and speeds: derivatives of inverse dynamics.

A subtree feels of the world only how its base moves. Where that changes by (da, dalpha, dw), with v_0 the velocity of
the origin and w the angular velocity, each point at r accelerates more by

    da + dalpha' x r + 2 dw x (v - v_0),      dalpha' = dalpha + w x dw

so that the wrench on all it carries changes by what few numbers of the composite say: m, h, J, the momentum
P = integral (v - v_0) dm and Q = integral r (v - v_0)^T dm:

    m da + dalpha' x h + 2 dw x P        J dalpha' + h x da + 2 (tr Q - Q^T) dw

A joint that moves on turns all that it carries by theta and shifts it by lambda: the motion changes as seen from the
body, and the wrench that it hands to its parent turns with it. So three wrenches for each speed (for unit udot, u and
q) go down the tree to the ground. What a joint on this path does to the force of the speed follows by reciprocity: the
wrench for unit udot is also what the force feels of da and dalpha', and one more vector what it feels of dw.

Sources: Carpentier and Mansard (2018), Analytical derivatives of rigid body dynamics algorithms; Singh, Russell and
Wensing (2022), Efficient analytical derivatives of rigid-body dynamics using spatial vector algebra; here with
accelerations of points, along axes of the bodies.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.formalisms.composite_body import needed_wrenches
from multibody_sym.dynamics.formalisms.equations import BodyAxes
from multibody_sym.dynamics.formalisms.inertia import RigidInertia, base_inertias
from multibody_sym.mechanics.motion import (
    BodyMotion,
    Motion,
    accelerations,
    body_motion,
    joint_rates,
    moving_parent,
    spread,
)
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, carried_wrenches, power, to_parent
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    combination,
    cross,
    dot,
    matrix_sum,
    negate,
    scale,
    subtract,
    turned_tensor,
)

Matrix = list[list[Node]]


@dataclass(frozen=True)
class ForceSlopes:
    """M (n x n), d forces/dq along the tangent and d forces/du (n x n), where forces = M udot + c with the weight.

    `shifts[k]`: of a free body whose acceleration is held while its own q_k moves on, by how much udot, along the
    body's axes, is less than where udot is held.
    """

    mass_matrix: Matrix
    by_q: Matrix
    by_u: Matrix
    shifts: dict[int, Vec] = field(default_factory=dict)


def force_slopes(motion: Motion, udot: Sequence[S], along: Sequence[BodyAxes], *, hold: bool) -> ForceSlopes:
    """Return the derivatives of inverse dynamics over Nodes, with q and u in slots; loads count as constant.

    `motion` and `along` as `along_body_axes` returns them: forces and udot are along the axes of free bodies. With
    `hold` the accelerations of their origins are held, not udot: what is carried then feels nothing where they turn.
    """
    return _Sweep(motion, udot, {axes.body for axes in along}, hold).slopes()


# ----------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class _Composite:
    """All that a body carries, in its axes about its origin: inertia, 2 P and 2 Q."""

    inertia: RigidInertia
    momentum: Vec
    moments: Mat

    @staticmethod
    def of(inertia: RigidInertia, w: Vec) -> _Composite:
        """Return that of one rigid body: P = w x h, and rows w x E_i of Q with E = tr(J)/2 - J."""
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.inertia
        half, twice = (xx + yy + zz) / 2, scale(2, w)
        rows: Mat = (half - xx, -xy, -xz), (-xy, half - yy, -yz), (-xz, -yz, half - zz)
        return _Composite(inertia, cross(twice, inertia.moment), _rows([cross(twice, row) for row in rows]))

    def plus(self, other: _Composite) -> _Composite:
        momentum, moments = add(self.momentum, other.momentum), matrix_sum(self.moments, other.moments)
        return _Composite(self.inertia.plus(other.inertia), momentum, moments)

    def moved(self, moved: BodyMotion, twice_v: Vec) -> _Composite:
        """Return the same in the parent's axes about its origin, from which this one moves away at v."""
        R, p = moved.R_PB, moved.p_PB
        momentum = add(apply(R, self.momentum), scale(self.inertia.mass, twice_v))
        h = apply(R, self.inertia.moment)
        shift = _rows([add(scale(x, momentum), scale(y, twice_v)) for x, y in zip(p, h, strict=True)])
        return _Composite(self.inertia.moved(R, p), momentum, matrix_sum(turned_tensor(R, self.moments), shift))

    def needed(self, change: _Change) -> Wrench:
        """Return the wrench that a change of the base's motion needs."""
        force, moment = self.inertia.wrench(change.a, change.alpha)
        turning = subtract(scale(self._trace, change.w), apply_transposed(self.moments, change.w))
        return add(force, cross(change.w, self.momentum)), add(moment, turning)

    def felt(self, linear: Vec, angular: Vec) -> Vec:
        """Return what the force along a partial velocity feels of dw."""
        turning = subtract(scale(self._trace, angular), apply(self.moments, angular))
        return add(turning, cross(self.momentum, linear))

    @property
    def _trace(self) -> S:
        return self.moments[0][0] + self.moments[1][1] + self.moments[2][2]


def _rows(rows: Sequence[Vec]) -> Mat:
    x, y, z = rows
    return x, y, z


@dataclass(frozen=True)
class _Change:
    """How the motion of a body changes, seen along its axes: da, dalpha + w x dw, dw."""

    a: Vec
    alpha: Vec
    w: Vec

    def felt_by(self, wrench: Wrench, turning: Vec) -> Node:
        return as_node(power(self.a, self.alpha, wrench) + dot(self.w, turning))


_STILL: Final = moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR)


@dataclass(frozen=True)
class _Freedom:
    """A speed k of a body: its partial velocities, how the body's motion changes with q_k and u_k, and how the partial
    velocities of all speeds of the body change with q_k."""

    speed: int
    linear: Vec
    angular: Vec
    of_q: _Change
    of_u: _Change
    partials: tuple[tuple[Vec, Vec], ...]

    def force(self, wrench: Wrench) -> Node:
        """Return the generalised force of a wrench."""
        return as_node(power(self.linear, self.angular, wrench))


class _Sweep:
    """The tree at a state: `reached` accelerations, the `total` wrenches that joints hand on, and composites."""

    def __init__(self, motion: Motion, udot: Sequence[S], free: Collection[int], hold: bool) -> None:
        self.motion, self.udot, self.free, self.hold = motion, udot, free, hold
        self.reached = accelerations(motion, udot, negate(motion.gravity))
        self.total = carried_wrenches(motion, needed_wrenches(motion, udot, [NO_WRENCH] * len(motion.bodies)))
        self.shifts: dict[int, Vec] = {}
        self.joints = [_Joint.of(motion, index, udot, index in free) for index in range(len(motion.bodies))]
        self.freedoms = [self._freedoms(index) for index in range(len(motion.bodies))]

    def slopes(self) -> ForceSlopes:
        """Return M and the derivatives."""
        count = len(self.udot)
        M, by_q, by_u = ([[ZERO] * count for _ in range(count)] for _ in range(3))
        found = ForceSlopes(M, by_q, by_u, self.shifts)
        for index, freedoms in enumerate(self.freedoms):
            for freedom in freedoms:
                self._towards_ground(found, index, freedom)
        return found

    def _towards_ground(self, found: ForceSlopes, index: int, k: _Freedom) -> None:
        """Enter what a freedom of a body has to do with those of the body and of all that carry it."""
        M, by_q, by_u, bodies = found.mass_matrix, found.by_q, found.by_u, self.motion.mechanism.bodies
        composite, total = self.composites[index], self.total[index]
        of_udot = composite.inertia.wrench(k.linear, k.angular)
        of_u, of_q = composite.needed(k.of_u), composite.needed(k.of_q)
        for j, partial in zip(self.freedoms[index], k.partials, strict=True):
            M[j.speed][k.speed] = j.force(of_udot)
            by_u[j.speed][k.speed] = j.force(of_u)
            by_q[j.speed][k.speed] = j.force(of_q) + as_node(power(*partial, total))
        turned = add(of_q[0], cross(k.angular, total[0]))
        turned_moment = add(of_q[1], add(cross(k.angular, total[1]), cross(k.linear, total[0])))
        wrenches, feels = (of_udot, of_u, (turned, turned_moment)), composite.felt(k.linear, k.angular)
        while (parent := bodies[index].parent) >= 0:
            moved = self.motion.bodies[index]
            feels = add(apply(moved.R_PB, feels), cross(self.departing[index], apply(moved.R_PB, wrenches[0][0])))
            of_udot, of_u, of_q = (to_parent(moved, wrench) for wrench in wrenches)
            for j in self.freedoms[parent]:
                M[j.speed][k.speed] = M[k.speed][j.speed] = j.force(of_udot)
                by_u[j.speed][k.speed], by_q[j.speed][k.speed] = j.force(of_u), j.force(of_q)
                by_u[k.speed][j.speed] = j.of_u.felt_by(of_udot, feels)
                by_q[k.speed][j.speed] = j.of_q.felt_by(of_udot, feels)
            wrenches, index = (of_udot, of_u, of_q), parent

    @cached_property
    def composites(self) -> list[_Composite]:
        """What each body carries."""
        motion = self.motion
        pairs = zip(base_inertias(motion), motion.bodies, strict=True)
        found = [_Composite.of(inertia, moved.w_WB) for inertia, moved in pairs]
        for index in range(len(found) - 1, -1, -1):
            if (parent := motion.mechanism.bodies[index].parent) >= 0:
                found[parent] = found[parent].plus(found[index].moved(motion.bodies[index], self.departing[index]))
        return found

    @cached_property
    def departing(self) -> list[Vec]:
        """Twice the velocity of each body's origin from that of its parent, in the parent's axes."""
        found = []
        for body, moved, joint in zip(self.motion.mechanism.bodies, self.motion.bodies, self.joints, strict=True):
            w = self.motion.bodies[body.parent].w_WB if body.parent >= 0 else ZERO_VECTOR
            found.append(add(cross(scale(2, w), moved.p_PB), apply(moved.R_PB, scale(2, joint.v))))
        return found

    def _freedoms(self, index: int) -> list[_Freedom]:
        """Return the freedoms of a body's joint.

        With D x = dx + theta x x, the change of a vector of the joint seen from its parent, which is zero where joints
        turn about and slide along fixed axes: dw = w x theta + D w_rel, and so on.
        """
        motion, (a, alpha) = self.motion, self.reached[index]
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        w, w_parent, alpha_parent = moved.w_WB, ZERO_VECTOR, ZERO_VECTOR
        if body.parent >= 0:
            w_parent = apply_transposed(moved.R_PB, motion.bodies[body.parent].w_WB)
            alpha_parent = apply_transposed(moved.R_PB, self.reached[body.parent][1])
        joint = self.joints[index]
        found = []
        for place, k in enumerate(body.u):
            linear, angular = moved.linear[place], moved.angular[place]
            here, partials = joint.along(place, angular)
            turned = add(scale(2, w_parent), joint.w)
            slid = add(cross(a, angular), apply(spread(alpha_parent, w_parent), linear))
            of_q = _Change(
                add(slid, add(here.a, cross(scale(2, w_parent), here.v))),
                add(apply(spread(alpha, w), angular), add(here.alpha, cross(turned, here.w))),
                add(cross(w, angular), here.w),
            )
            if self.hold and index in self.free:
                self.shifts[k], of_q = of_q.a, replace(of_q, a=ZERO_VECTOR)
            bias, angular_bias = joint.bias_rates(place)
            of_u = _Change(
                add(cross(scale(2, w_parent), linear), bias), add(cross(turned, angular), angular_bias), angular
            )
            found.append(_Freedom(k, linear, angular, of_q, of_u, partials))
        return found


@dataclass(frozen=True)
class _JointRates:
    """How a joint's own velocities v, w and accelerations a, alpha change with a coordinate, seen from the parent."""

    v: Vec
    w: Vec
    a: Vec
    alpha: Vec


@dataclass(frozen=True)
class _Joint:
    """A joint as it moves on a parent at rest, in the body's axes, and the slots of its coordinates and speeds.

    One that is `free` slides along fixed axes before it turns.
    """

    moved: BodyMotion
    ways: tuple[dict[Node, Node], ...]
    speeds: tuple[Node, ...]
    udot: tuple[S, ...]
    free: bool

    @staticmethod
    def of(motion: Motion, index: int, udot: Sequence[S], free: bool) -> _Joint:
        body, state = motion.mechanism.bodies[index], motion.state
        ways = []
        for k in body.u:
            rates = joint_rates(body, state.q, [int(j == k) for j in range(len(state.u))])
            ways.append({state.q[i]: as_node(rate) for i, rate in zip(body.q, rates, strict=True)})
        speeds = tuple(state.u[k] for k in body.u)
        return _Joint(body_motion(body, _STILL, state), tuple(ways), speeds, tuple(udot[k] for k in body.u), free)

    @property
    def w(self) -> Vec:
        """The angular velocity relative to the parent."""
        return add(combination(self.moved.angular, self.speeds), self.moved.given_angular)

    @property
    def v(self) -> Vec:
        """The velocity relative to the parent."""
        return add(combination(self.moved.linear, self.speeds), self.moved.given_linear)

    def along(self, place: int, theta: Vec) -> tuple[_JointRates, tuple[tuple[Vec, Vec], ...]]:
        """Return the changes as one speed alone is one, and those of all partial velocities, seen from the body."""
        moved, count = self.moved, len(self.speeds)
        slides = [*[ZERO_VECTOR] * 3, *moved.linear[3:]] if self.free else moved.linear
        vectors = [*slides, *moved.angular, moved.given_linear, moved.given_angular]
        vectors += [moved.linear_bias, moved.angular_bias]
        rates = _tangents(vectors, self.ways[place])
        seen = [add(x, cross(theta, y)) for x, y in zip(rates, vectors, strict=True)]
        linear, angular, (v, w, bias, angular_bias) = seen[:count], seen[count : 2 * count], seen[2 * count :]
        found = _JointRates(
            v=add(combination(linear, self.speeds), v),
            w=add(combination(angular, self.speeds), w),
            a=add(combination(linear, self.udot), bias),
            alpha=add(combination(angular, self.udot), angular_bias),
        )
        return found, tuple(zip(rates[:count], rates[count : 2 * count], strict=True))

    def bias_rates(self, place: int) -> tuple[Vec, Vec]:
        """Return how the joint's accelerations without udot change with a speed."""
        linear, angular = _tangents([self.moved.linear_bias, self.moved.angular_bias], {self.speeds[place]: ONE})
        return linear, angular


def _tangents(vectors: Sequence[Vec], seeds: dict[Node, Node]) -> list[Vec]:
    rates = iter(tangents([as_node(x) for vector in vectors for x in vector], seeds))
    return list(zip(rates, rates, rates, strict=True))
