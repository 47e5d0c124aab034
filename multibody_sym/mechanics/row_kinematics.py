"""How do rows move: phi, phidot, the wrenches of a unit multiplier, and gamma of every row, over any scalar?

    phi(q, t) = 0,   phidot = H u + phi_t = 0,   H udot = gamma

H_j^T is found as the generalised force of the wrenches that a unit multiplier exerts, so that a row is written once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import singledispatch
from itertools import pairwise
from math import hypot
from typing import Final

import numpy as np

from multibody_sym.errors import InputError, at
from multibody_sym.mechanics import row_records as records
from multibody_sym.mechanics.contact_geometry import contact_direction, rim_across, touch
from multibody_sym.mechanics.forces import applied_forces, span
from multibody_sym.mechanics.law_elements import GivenRow, JumpRow, MeetingRow
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import Motion, accelerations, from_parent, qdot_of, slot_state, spread
from multibody_sym.mechanics.points import (
    NO_WRENCH,
    Wrench,
    Wrenches,
    acceleration,
    add_force,
    add_force_at,
    add_moment,
    angular_acceleration,
    angular_velocity,
    direction,
    generalized_forces,
    position,
    power,
    slip_velocity,
    velocity,
)
from multibody_sym.mechanics.ropes import Segment, pull, segments, wheel_at, wrap_angle
from multibody_sym.mechanics.row_records import LOCAL, ContactSurface, Marker, Row, Sliding
from multibody_sym.model.bodies import IDENTITY
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.functions import absolute, is_exactly, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, nodes_among, slot
from multibody_sym.scalars.rank import CLOSED, rank, without_rounding
from multibody_sym.scalars.vectors import S, Vec, add, apply, apply_transposed, cross, dot, negate, scale, subtract


@dataclass(frozen=True)
class RowMotion:
    """One row at a state: phi, phidot, the row H_j (nu), gamma, and the wrenches of a unit multiplier on the bodies.

    A nonholonomic row has no phi (None); its phidot is psi = a(q, t) u + b(q, t). Where the wrenches of a row are
    `all_told` H_j^T is their generalised force, though perhaps written otherwise. What slides `exerts` another
    generalised force (nu) than H_j^T. A row that defines a force has a `coupling` D_jk with the multipliers of rows k:
    H_j udot + sum D_jk lambda_k = gamma_j; it restricts nothing. Where its multiplier makes a vector with those of the
    rows numbered `beside`, it exerts this times its part of that vector's direction (`along_reactions`).
    """

    phi: S
    phidot: S
    jacobian: list[S]
    gamma: S
    of_body: list[Wrench]
    all_told: bool = False
    exerts: list[S] | None = None
    coupling: Mapping[int, S] = field(default_factory=dict)
    beside: tuple[int, ...] = ()

    @property
    def kinematic(self) -> bool:
        return not self.coupling

    @property
    def forces(self) -> list[S]:
        """The generalised force (nu) of a unit multiplier."""
        return self.jacobian if self.exerts is None else self.exerts

    @property
    def holonomic(self) -> bool:
        return self.phi is not None

    @property
    def gap(self) -> S:
        """phi; 0 of a nonholonomic row, which holds in any position: of what holds one way, it touches."""
        return self.phi if self.holonomic else 0

    @property
    def zero(self) -> S:
        """The value that the row holds at zero, or keeps from becoming negative: phi, else phidot."""
        return self.phi if self.holonomic else self.phidot


def row_motions(motion: Motion) -> list[RowMotion]:
    """Return all rows of a mechanism at a state."""
    if not motion.mechanism.rows:
        return []
    bias = accelerations(motion, [0] * len(motion.state.u))
    found = []
    for k, row in enumerate(motion.mechanism.rows):
        try:
            found.append(row_motion(row, motion, bias))
        except InputError as error:
            with at(*motion.mechanism.row_path(k)):
                raise error from None
    return with_reactions(motion, found)


def acting_rows(rows: Sequence[RowMotion]) -> list[int]:
    """Return the rows that do not vanish identically, as some of a joint in space do that closes a loop in a plane."""
    return [
        k for k, row in enumerate(rows) if row.coupling or {*map(as_node, row.jacobian), as_node(row.gamma)} != {ZERO}
    ]


def leave_no_freedom(rows: Sequence[RowMotion], count: int) -> bool:
    """Return whether rows at a state (floats) decide all of `count` speeds."""
    known = [row.jacobian for row in rows if row.kinematic]
    return count == 0 or (len(known) >= count and rank(np.array(known, dtype=float), CLOSED) == count)


def with_reactions(motion: Motion, rows: Sequence[RowMotion]) -> list[RowMotion]:
    """Return the rows with those that define parts of reactions filled in, which depend on all others."""
    found, wrenches = list(rows), [row.of_body for row in rows]
    names = [row.name for row in motion.mechanism.rows]
    for k, row in enumerate(motion.mechanism.rows):
        defining = row.plain
        if isinstance(defining, records.MeanTensionRow):
            found[k] = replace(
                found[k], coupling={**_mean_tension(defining, motion), k: -motion.state.values([ONE])[0]}
            )
        if isinstance(row, GivenRow):
            found[k] = replace(found[k], coupling={k: motion.state.values([ONE])[0]})
        if not isinstance(defining, records.ReactionRow):
            continue
        part = part_of_reaction(defining, motion, wrenches)
        share, rubbing, constant = motion.state.values([defining.share, defining.rubbing, defining.constant])
        coupling = {j: x for j, x in enumerate(part.of_rows) if x is not ZERO and not is_exactly(x, 0)}
        for friction in row.sliding if defining.rubbing is not ZERO else ():
            along = [row_motion(direction, motion, ()) for direction in friction.rows]
            share = share + rubbing * friction_factors(friction, along, motion)[0]
        if defining.rubs in names:
            coupling[names.index(defining.rubs)] = -rubbing
        beside = next((tuple(map(names.index, each.beside)) for each in row.sliding if each.beside), ())
        coupling[k] = -share
        gamma = -part.rest - constant
        found[k] = replace(found[k], jacobian=part.columns, gamma=gamma, coupling=coupling, beside=beside)
    return found


def _mean_tension(row: records.MeanTensionRow, motion: Motion) -> dict[int, S]:
    """Return how the mean of the tensions at a rough wheel follows from other rows' multipliers, by their numbers."""
    names, found = [other.name for other in motion.mechanism.rows], dict[int, S]()
    (one, half) = motion.state.values([ONE, ONE / 2])
    if row.rope in names:
        found[names.index(row.rope)] = one
    for slips, factor in ((row.ahead, half), (row.passed, -half)):
        for slip in slips:
            for k, part in friction_on(slip, motion):
                found[k] = found.get(k, 0) + factor * part
    return found


def friction_on(slip: str, motion: Motion) -> Iterator[tuple[int, S]]:
    """Yield the rows, by number, with whose multipliers a rope's friction on a wheel grows, and by how much."""
    for k, row in enumerate(motion.mechanism.rows):
        if row.name == slip:
            yield k, motion.state.values([ONE])[0]
        for sliding in row.sliding:
            if sliding.rows[0].name == slip:
                bias = accelerations(motion, [0] * len(motion.state.u)) if sliding.regularised is not None else []
                along = [row_motion(direction, motion, bias) for direction in sliding.rows if bias]
                yield k, friction_factors(sliding, along, motion)[0]


def largest_wrenches(rows: Sequence[RowMotion]) -> Floats:
    """Return the largest component (s) of the wrenches of each row's unit multiplier, over floats."""
    largest = [
        max((abs(x) for wrench in row.of_body if wrench is not NO_WRENCH for part in wrench for x in part), default=0.0)
        for row in rows
    ]
    return np.array(largest, dtype=float)


@singledispatch
def row_motion(row: Row, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return one row at a state; `bias` holds the bodies' accelerations for udot = 0."""
    raise TypeError(f"no kinematics for {type(row).__name__}")


@row_motion.register
def _(row: records.DistanceRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    difference = subtract(position(motion, row.ends[1]), position(motion, row.ends[0]))
    if row.straight is not None:
        straight = motion.state.vector(row.straight)
        length: S = dot(straight, difference)
        return _tension(motion, [Segment(row.ends, length, straight, steady=True)], row.value, length, bias)
    length = sqrt(dot(difference, difference))
    direction = scale(1 / length, difference)
    return _tension(motion, [Segment(row.ends, length, direction)], row.value, length, bias)


@row_motion.register
def _(row: records.RopeRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    parts, length = segments(motion, row.path, row.straight)
    return _tension(motion, parts, row.length, length, bias)


@row_motion.register
def _(row: records.RopeSlipRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    parts, _ = segments(motion, row.rope.path, row.rope.straight)
    wheel, k = wheel_at(motion, row.rope.path, row.bend), row.bend
    parts[k - 1] = replace(parts[k - 1], grips=(parts[k - 1].grips[0], wheel))
    parts[k] = replace(parts[k], grips=(wheel, parts[k].grips[1]))
    (half,) = motion.state.values([ONE / 2])
    pulled = pull(motion, parts, [half if i < k else -half for i in range(len(parts))], bias)
    jacobian = generalized_forces(motion, pulled.of_body)
    return RowMotion(None, -pulled.stretching, jacobian, pulled.stretching_rate, pulled.of_body)


def _tension(
    motion: Motion, parts: Sequence[Segment], wanted: Node, length: S, bias: Sequence[tuple[Vec, Vec]]
) -> RowMotion:
    """Return the row phi = wanted - length of straight segments under one tension."""
    pulled, given = pull(motion, parts, [1] * len(parts), bias), _along_motion(motion, wanted)
    jacobian = [a + b for a, b in zip(given.jacobian, generalized_forces(motion, pulled.of_body), strict=True)]
    return RowMotion(
        given.phi - length,
        given.phidot - pulled.stretching,
        jacobian,
        given.gamma + pulled.stretching_rate,
        pulled.of_body,
    )


@row_motion.register
def _(row: records.PositionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    frame, point = row.frames
    axis, w = direction(motion, frame, row.axis), angular_velocity(motion, frame.body)
    # the motion relative to the body of the frame: v' = v - v_F - w x d, a' = a - a_F - ..
    d = subtract(position(motion, point), position(motion, frame))
    v = subtract(subtract(velocity(motion, point), velocity(motion, frame)), cross(w, d))
    alpha = angular_acceleration(motion, frame.body, bias)
    carried = add(cross(alpha, d), cross(w, add(cross(w, d), scale(2, v))))
    a = subtract(subtract(acceleration(motion, point, bias), acceleration(motion, frame, bias)), carried)
    wrenches = Wrenches(len(motion.bodies))
    add_force(wrenches, motion, point, axis)
    add_force_at(wrenches, motion, frame.body, position(motion, point), negate(axis))
    return row_of_wrenches(motion, wrenches, dot(axis, d), dot(axis, v), -dot(axis, a))


@row_motion.register
def _(row: records.AngleRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """d/dt e . d = (w_M - w_F) . (d x e)."""
    (frame, other), value = row.frames, motion.state.values([row.value])[0]
    e, d = direction(motion, frame, row.directions[0]), direction(motion, other, row.directions[1])
    w_F, w_M = (angular_velocity(motion, marker.body) for marker in row.frames)
    alpha = subtract(*(angular_acceleration(motion, marker.body, bias) for marker in (other, frame)))
    w, axis = subtract(w_M, w_F), cross(d, e)
    axis_rate = add(cross(cross(w_M, d), e), cross(d, cross(w_F, e)))
    wrenches = Wrenches(len(motion.bodies))
    add_moment(wrenches, motion, other.body, axis)
    add_moment(wrenches, motion, frame.body, negate(axis))
    return row_of_wrenches(motion, wrenches, dot(e, d) - value, dot(w, axis), -(dot(alpha, axis) + dot(w, axis_rate)))


@row_motion.register
def _(row: records.ContactRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    found = touch(row.skins, motion, bias)
    along = contact_direction(row, motion, found)
    wrenches = Wrenches(len(motion.bodies))
    first, second = (skin.place.body for skin in row.skins)
    add_force_at(wrenches, motion, first, found.place, along.vector)
    add_force_at(wrenches, motion, second, found.place, negate(along.vector))
    gamma = -(dot(along.rate, found.slip) + dot(along.vector, found.slip_rate))
    phi = found.gap if row.is_holonomic else None
    return row_of_wrenches(motion, wrenches, phi, dot(along.vector, found.slip), gamma)


@row_motion.register
def _(row: records.TurningRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    found = touch(row.skins, motion, bias)
    axis = contact_direction(row, motion, found)
    wrenches = Wrenches(len(motion.bodies))
    first, second = (skin.place.body for skin in row.skins)
    add_moment(wrenches, motion, first, axis.vector)
    add_moment(wrenches, motion, second, negate(axis.vector))
    gamma = -(dot(axis.rate, found.turning) + dot(axis.vector, found.turning_rate))
    return row_of_wrenches(motion, wrenches, None, dot(axis.vector, found.turning), gamma)


@row_motion.register
def _(row: records.SlidingRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    normal = row_motion(row.of, motion, bias)
    exerts, of_body = list(normal.forces), list(normal.of_body)
    for sliding in row.frictions:
        along = [row_motion(direction, motion, bias) for direction in sliding.rows]
        for factor, tangent in zip(friction_factors(sliding, along, motion), along, strict=True):
            exerts = [a + factor * b for a, b in zip(exerts, tangent.forces, strict=True)]
            pairs = zip(of_body, tangent.of_body, strict=True)
            of_body = [(add(f, scale(factor, df)), add(m, scale(factor, dm))) for (f, m), (df, dm) in pairs]
    return replace(normal, exerts=exerts, of_body=of_body)


def coefficients(motion: Motion, rows: Sequence[Row], declared: Sequence[Node]) -> list[S]:
    """Return coefficients of friction along rows; of a rope over a rough wheel those at its present wrap."""
    slipping = rows[0].rope_slip
    if slipping is None:
        return motion.state.values(declared)
    return motion.state.values(declared, {slipping.wrap: wrap_angle(motion, slipping.rope, slipping.bend)})


def friction_factors(sliding: Sliding, along: Sequence[RowMotion], motion: Motion) -> list[S]:
    """Return for a unit normal force the friction along each row: -mu sign(v_t), in space -mu v_t / |v_t|."""
    (coefficient,) = coefficients(motion, sliding.rows, [sliding.coefficient])
    velocity = [tangent.phidot for tangent in along]
    if sliding.regularised is not None:
        least = motion.state.values([sliding.regularised])
        return limits.sliding(coefficient, velocity, limits.length([*velocity, *least]))
    if len(sliding.rows) == 1:
        return limits.sliding(coefficient, [sliding.sense])
    velocity = slip_velocity(sliding, velocity, motion)
    speed = limits.length(velocity)
    if isinstance(speed, float) and speed == 0.0:  # at rest without a direction to slide in: nothing leads anywhere yet
        return [0.0] * len(velocity)
    return limits.sliding(coefficient, velocity, speed)


def row_of_wrenches(motion: Motion, wrenches: Wrenches, phi: S, phidot: S, gamma: S) -> RowMotion:
    """Return the row whose unit multiplier exerts these wrenches; phi is None of a nonholonomic one."""
    return RowMotion(phi, phidot, generalized_forces(motion, wrenches.of_body), gamma, wrenches.of_body)


@row_motion.register
def _(row: records.ExpressionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    return _along_motion(motion, row.zero)


@row_motion.register
def _(row: records.GearRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    of_body = tooth_wrenches(motion, row, row.on)
    return replace(_along_motion(motion, row.zero), of_body=of_body, all_told=row.in_tree)


def tooth_wrenches(motion: Motion, row: Row, on: Sequence[tuple[int, int]]) -> list[Wrench]:
    """Return the wrenches of the force at a gear's teeth, for a unit multiplier, on bodies (number, factor)."""
    assert isinstance(row, records.GearRow)
    place, force = position(motion, row.pitch), direction(motion, row.pitch, row.force)
    wrenches = Wrenches(len(motion.bodies))
    for body, factor in on:
        add_force_at(wrenches, motion, body, place, scale(factor, force))
    return wrenches.of_body


@row_motion.register(records.MeanTensionRow)
@row_motion.register(records.ReactionRow)
def _(row: records.MeanTensionRow | records.ReactionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return a row that exerts nothing; the force that it defines follows from all rows (`with_reactions`)."""
    nothing: list[S] = [0] * len(motion.state.u)
    return RowMotion(None, 0, nothing, 0, Wrenches(len(motion.bodies)).of_body, exerts=nothing)


@row_motion.register
def _(row: records.VelocityRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    return _of_speeds(motion, None, row.zero)


def _along_motion(motion: Motion, phi: Node) -> RowMotion:
    return _of_speeds(motion, phi, tangents([phi], _rates(motion.mechanism))[0])


def _of_speeds(motion: Motion, phi: Node | None, psi: Node) -> RowMotion:
    """Return the row of an expression psi = phidot of q, t and, linearly, u; it exerts forces on speeds only."""
    mechanism = motion.mechanism
    jacobian = [tangents([psi], {slot("u", k): ONE})[0] for k in range(len(mechanism.speeds))]
    gamma = -tangents([psi], _rates(mechanism))[0]
    values = motion.state.values([psi, gamma, *jacobian, *([] if phi is None else [phi])])
    untouched = Wrenches(len(motion.bodies)).of_body
    count = 2 + len(jacobian)
    return RowMotion(None if phi is None else values[count], values[0], values[2:count], values[1], untouched)


def _rates(mechanism: Mechanism) -> dict[Node, Node]:
    """Return the rates of t and q at constant u: the direction of d/dt without accelerations."""
    state = slot_state(mechanism)
    q, qdot = state.q, qdot_of(state, mechanism)
    return {TIME: ONE, **dict(zip(q, qdot, strict=True))}


def constraint_jacobian(rows: Sequence[RowMotion]) -> Floats:
    """Return H (s x n) of rows over floats, zero where a row moves nothing but by rounding of the forces it exerts."""
    size = len(rows[0].jacobian) if rows else 0
    jacobian = np.array([row.jacobian for row in rows], dtype=float).reshape(len(rows), size)
    return without_rounding(jacobian, largest_wrenches(rows))


# ----------------------------------------------------------------------------------------------------------------------
# What presses in a joint: parts of its reaction as affine functions of udot and of what acts on the bodies.
#
# The reaction of a tree joint on its child balances what its child and all that this carries need and are given. Its
# part f . F + m . M, about the joint's point, is therefore the power of their inertia less that of all that acts on
# them, in a virtual motion in which they move as one rigid body: the joint's point along f, turning with m.


Twist = tuple[Vec, Vec]
_NEARLY_ZERO: Final = 1e-300
"""The square of a force that has no direction."""


@dataclass(frozen=True)
class PartOfReaction:
    """A part of a joint's reaction: `columns` (nu) . udot + `rest` + sum over rows of `of_rows` lambda."""

    columns: list[S]
    rest: S
    of_rows: list[S]


def part_of_reaction(row: records.ReactionRow, motion: Motion, wrenches: Sequence[Sequence[Wrench]]) -> PartOfReaction:
    """Return the part of a reaction that a row names; `wrenches` are those of each row's unit multiplier on bodies."""
    child = row.frames[1]
    index = child.body
    turning, moving = (
        apply_transposed(motion.rotation(index), direction(motion, row.frames[0], part))
        for part in (row.moment, row.force)
    )
    # the velocity of the child's origin, and its turning, at which the joint has the power f . F + m . M
    twist: Twist = subtract(moving, cross(turning, motion.point(child))), turning
    if motion.mechanism.bodies[index].joint_name == row.joint:
        return _part_in_tree(motion, index, twist, wrenches)
    cut = next(cut for cut in motion.mechanism.cuts if cut.name == row.joint)
    of_rows: list[S] = [0] * len(wrenches)  # only the rows that stand for the joint exert its reaction
    for k in cut.rows:
        of_rows[k] = power(*twist, wrenches[k][index])
    return PartOfReaction([0] * len(motion.state.u), 0, of_rows)


def _part_in_tree(motion: Motion, index: int, twist: Twist, wrenches: Sequence[Sequence[Wrench]]) -> PartOfReaction:
    """Return the part of the reaction of the joint that carries a body, for a virtual motion of the body."""
    twists = {index: twist}  # all that the body carries moves with it as one
    for k, body in enumerate(motion.mechanism.bodies):
        if body.parent in twists and k != index:
            twists[k] = from_parent(motion.bodies[k], twists[body.parent])
    momenta = [NO_WRENCH] * len(motion.bodies)
    rest: S = 0
    acting, at_rest = applied_forces(motion).of_body, accelerations(motion, [0] * len(motion.state.u))
    for k, (v, w) in twists.items():
        mass = motion.masses[k]
        x, y, z = add(v, cross(w, mass.com))
        linear = mass.mass * x, mass.mass * y, mass.mass * z
        momenta[k] = linear, add(apply(mass.inertia, w), cross(mass.com, linear))
        (a, alpha), turning = at_rest[k], motion.bodies[k].w_WB
        x, y, z = add(a, apply(spread(alpha, turning), mass.com))
        force = mass.mass * x, mass.mass * y, mass.mass * z
        moment = add(apply(mass.inertia, alpha), cross(turning, apply(mass.inertia, turning)))
        needed = force, add(moment, cross(mass.com, force))  # the rate of the body's momentum
        rest = rest + power(v, w, needed) - power(v, w, acting[k])
    of_rows = [-sum((power(*x, of_body[k]) for k, x in twists.items()), 0) for of_body in wrenches]
    return PartOfReaction(generalized_forces(motion, momenta), rest, of_rows)


def along_reactions(
    forces: Sequence[Sequence[S]], beside: Mapping[int, Sequence[int]], multipliers: Sequence[S]
) -> list[list[S]]:
    """Return the forces of rows (s x nu); those `beside` others times their part of the vectors' direction."""
    found = [list(row) for row in forces]
    for k, others in beside.items():
        x = multipliers[k]
        square = sum((multipliers[other] * multipliers[other] for other in others), x * x)
        part = x / sqrt(square + _NEARLY_ZERO)
        found[k] = [part * f for f in found[k]]
    return found


# ----------------------------------------------------------------------------------------------------------------------
# How large the terms are whose sum is phidot or gamma of a row: the scale that tells it from rounding, in floats.
#
# Along a chain lengths of terms add up, whatever their directions, with sums in place of |v|, |w|, |a|, |alpha|:
#
#     V = sum |w| |p| + |v'|,   W = sum |w'|,   A = sum (L + W^2) |p| + |a'|,   L = sum |alpha'|
#
# p leads from the parent's origin to the body's; primes mark what a joint adds (for udot = 0).


_PARALLEL: Final = 1e-6
"""The sine of an angle below which lines that cross count as if it were this."""


@dataclass(frozen=True)
class Terms:
    """Sums of the lengths of all terms of a point's velocity `V` and acceleration `A`, of its body's `W` and `L`.

    Nodes stand in their places where they become part of a Program (`power_terms`).
    """

    V: float = 0.0
    W: float = 0.0
    A: float = 0.0
    L: float = 0.0

    @property
    def turning(self) -> float:
        """The acceleration of a point beside another, per distance."""
        return self.L + self.W * self.W

    def at(self, distance: S) -> Terms:
        """Return the terms of a point of the same body, some distance away."""
        return Terms(self.V + self.W * distance, self.W, self.A + self.turning * distance, self.L)


def row_terms(motion: Motion) -> list[float]:
    """Return for each row of a mechanism the sum of the lengths of all terms of gamma."""
    bodies = _bodies(motion)
    return [_terms(row, motion, bodies) for row in motion.mechanism.rows]


def power_terms(motion: Motion, rows: Sequence[RowMotion]) -> list[S]:
    """Return for each row of bodies sum |f| V + |m| W: phidot is the power of a unit multiplier's wrenches (f, m).

    Over floats, and over Nodes for Programs. It does not vanish with H where nothing can move a row: the common motion
    of bodies cancels to rounding.
    """
    bodies = _bodies(motion)
    return [
        sum(
            _length(wrench[0]) * body.V + _length(wrench[1]) * body.W
            for body, wrench in zip(bodies, row.of_body, strict=True)
            if wrench is not NO_WRENCH
        )
        for row in rows
    ]


def _bodies(motion: Motion) -> list[Terms]:
    bodies: list[Terms] = []
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        parent = bodies[body.parent] if body.parent >= 0 else Terms()
        parent = parent.at(_length(moved.p_PB))
        rates = [absolute(motion.state.u[k]) for k in body.u]
        linear = sum(_length(v) * x for v, x in zip(moved.linear, rates, strict=True)) + _length(moved.given_linear)
        angular = sum(_length(w) * x for w, x in zip(moved.angular, rates, strict=True)) + _length(moved.given_angular)
        bias = _length(moved.linear_bias), _length(moved.angular_bias)
        bodies.append(Terms(parent.V + linear, parent.W + angular, parent.A + bias[0], parent.L + bias[1]))
    return bodies


def _length(vector: Vec) -> S:
    if nodes_among(vector):
        return sqrt(dot(vector, vector))
    return hypot(*vector)


def _of(motion: Motion, bodies: Sequence[Terms], marker: Marker) -> Terms:
    return bodies[marker.body].at(hypot(*motion.point(marker))) if marker.body >= 0 else Terms()


@singledispatch
def _terms(row: Row, motion: Motion, bodies: Sequence[Terms]) -> float:
    raise TypeError(f"the terms of {type(row).__name__} are unknown")


@_terms.register
def _(row: records.PositionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    frame, point = (_of(motion, bodies, marker) for marker in row.frames)
    apart = sum(hypot(*position(motion, marker)) for marker in row.frames)
    relative = point.V + frame.V + frame.W * apart
    return point.A + frame.A + frame.turning * apart + 2.0 * frame.W * relative


@_terms.register
def _(row: MeetingRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    first, second = (_of(motion, bodies, marker) for marker in row.ends)
    turning = bodies[row.frame.body].W if row.frame.body >= 0 else 0.0
    return first.A + second.A + turning * (first.V + second.V)


@_terms.register
def _(row: JumpRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _terms(row.of, motion, bodies) + abs(float(motion.state.values([row.wanted])[0]))


@_terms.register
def _(row: records.AngleRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    frame, other = (_of(motion, bodies, marker) for marker in row.frames)
    return frame.L + other.L + (frame.W + other.W) ** 2


@_terms.register
def _(row: records.DistanceRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _of_expression(motion, row.value, holonomic=True) + _stretch_terms(motion, bodies, row.ends)


@_terms.register
def _(row: records.RopeRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    markers = [bend.at for bend in row.path]
    pieces = sum(_stretch_terms(motion, bodies, ends) for ends in pairwise(markers))
    gripped = [bend for bend in row.path if bend.grip is not None and bend.at.body >= 0]
    radii = map(abs, motion.state.values([bend.radius for bend in gripped]))
    rims = [bodies[bend.at.body].turning * float(radius) for bend, radius in zip(gripped, radii, strict=True)]
    return _of_expression(motion, row.length, holonomic=True) + pieces + sum(rims)


@_terms.register
def _(row: records.RopeSlipRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    bend = row.rope.path[row.bend]
    radius = abs(float(motion.state.values([bend.radius])[0]))
    rim = bodies[bend.at.body].turning * radius if bend.at.body >= 0 else 0.0
    return _terms(row.rope, motion, bodies) + rim


def _stretch_terms(motion: Motion, bodies: Sequence[Terms], ends: Sequence[Marker]) -> float:
    first, second = (_of(motion, bodies, marker) for marker in ends)
    length = float(span(motion, (ends[0], ends[1]))[0])
    return first.A + second.A + (first.V + second.V) ** 2 / length


@_terms.register
def _(row: records.ContactRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    first, second = (_of(motion, bodies, skin.place) for skin in row.skins)
    if all(isinstance(skin, records.Edge) for skin in row.skins):
        # the place of contact goes along both lines as fast as they are parallel
        apart = hypot(*subtract(*(position(motion, skin.place) for skin in row.skins)))
        courses = []
        for skin in row.skins:
            assert isinstance(skin, records.Edge)
            whole = subtract(position(motion, skin.tip), position(motion, skin.place))
            courses.append(scale(1.0 / hypot(*whole), whole))
        steep = max(hypot(*cross(*courses)), _PARALLEL)  # the sine of the angle between the lines
        turning, way = first.W + second.W, 2.0 * apart / steep**2
        passing = 8.0 * (first.V + second.V + turning * (apart + way)) / steep**4
        slip = first.V + second.V + turning * way
        carried = first.A + second.A + (first.turning + second.turning) * (way + apart)
        return carried + turning * passing + 4.0 * turning / steep * (slip + passing)
    radii = [skin.radius if isinstance(skin, (records.RoundSurface, records.Rim)) else ZERO for skin in row.skins]
    sizes = [abs(float(radius)) for radius in motion.state.values(radii)]
    place = sum(hypot(*position(motion, skin.place)) for skin in row.skins) + sum(sizes)
    pairs = zip(row.skins, sizes, strict=True)
    arms = [place if skin.plane is not None or isinstance(skin, records.Edge) else size for skin, size in pairs]
    tilting, turning = _normal_rates(row, motion, first, second)
    speeds = first.V + second.V
    slip = speeds + first.W * arms[0] + second.W * arms[1]
    carried = first.A + second.A + first.L * arms[0] + second.L * arms[1]
    return carried + (first.W + second.W) * sum(sizes) * turning + tilting * slip + (first.W + second.W) * speeds


def _normal_rates(row: records.ContactRow, motion: Motion, first: Terms, second: Terms) -> tuple[float, float]:
    """Return how fast the normal turns, and the way from a centre to the place of contact, at most."""
    flats = [terms for skin, terms in zip(row.skins, (first, second), strict=True) if skin.plane is not None]
    if flats:
        # twice the inverse sine of the angle between a rim and a plane
        steep = 0.0 if row.rim is None else 2.0 / max(hypot(*rim_across(row, motion).vector), _PARALLEL)
        return flats[0].W, (first.W + second.W) * max(steep, 1.0)
    length = float(span(motion, (row.skins[0].place, row.skins[1].place))[0])
    bending = max(1 / length, *(_level_curvature(skin, motion, row) for skin in row.skins))
    turning = first.W + second.W + (first.V + second.V + (first.W + second.W) * length) * bending
    return turning, turning


def _level_curvature(skin: ContactSurface, motion: Motion, row: records.ContactRow) -> float:
    """Return how much the normal of a smooth surface turns along a metre, at most, where a row's point is."""
    if not isinstance(skin, records.Level):
        return 0.0
    point = row.skins[0] if row.skins[1] is skin else row.skins[1]
    apart = subtract(position(motion, point.place), position(motion, skin.place))
    known = {leaf: dot(direction(motion, skin.place, axis), apart) for leaf, axis in zip(LOCAL, IDENTITY, strict=True)}
    gx, gy, gz, *second = motion.state.values([*skin.gradient, *skin.second], known)
    return 2.0 * hypot(*second) / hypot(gx, gy, gz)


@_terms.register
def _(row: records.SlidingRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _terms(row.of, motion, bodies)


@_terms.register(records.MeanTensionRow)
@_terms.register(records.ReactionRow)
def _(row: records.MeanTensionRow | records.ReactionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return 0.0


@_terms.register
def _(row: records.ExpressionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _of_expression(motion, row.zero, holonomic=True)


@_terms.register
def _(row: records.VelocityRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _of_expression(motion, row.zero, holonomic=False)


def _of_expression(motion: Motion, zero: Node, *, holonomic: bool) -> float:
    """Return sum |d(psi)/dq_i qdot_i| + |d(psi)/dt|, where psi is the rate of a holonomic row's expression."""
    mechanism = motion.mechanism
    state = slot_state(mechanism)
    q, qdot = state.q, qdot_of(state, mechanism)
    ways: list[tuple[Node, Node]] = [(TIME, ONE), *zip(q, qdot, strict=True)]
    rates = [tangents([zero], {x: rate})[0] for x, rate in ways] if holonomic else [zero]
    parts = [tangents([psi], {x: rate})[0] for psi in rates for x, rate in ways]
    return float(sum(map(abs, motion.state.values(parts))))
