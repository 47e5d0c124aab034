"""Rows: every scalar constraint's phi, phidot, the wrenches of a unit multiplier, and gamma, over any scalar.

    phi(q, t) = 0,   phidot = H u + phi_t = 0,   H udot = gamma

H_j^T is found as the generalised force of the wrenches that a unit multiplier exerts, so that a row is written once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import singledispatch

import numpy as np

from multibody_sym.errors import InputError, at
from multibody_sym.kinematics.contacts import contact_direction, touch
from multibody_sym.kinematics.joint_forces import part_of_reaction
from multibody_sym.kinematics.motion import Motion, accelerations, coordinate_rates
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.relative import angular_acceleration, angular_velocity, direction, seen, slip_velocity
from multibody_sym.kinematics.ropes import Segment, pull, segments, wheel_at, wrap_angle
from multibody_sym.kinematics.wrenches import (
    NO_WRENCH,
    Wrench,
    Wrenches,
    add_force,
    add_force_at,
    add_moment,
    generalized_forces,
)
from multibody_sym.model.mechanism.contact_rows import ContactRow, TurningRow
from multibody_sym.model.mechanism.force_rows import ReactionRow
from multibody_sym.model.mechanism.impacts import GivenRow
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.model.mechanism.rope_rows import MeanTensionRow, RopeSlipRow
from multibody_sym.model.mechanism.rows import (
    AngleRow,
    DistanceRow,
    ExpressionRow,
    GearRow,
    PositionRow,
    RopeRow,
    Row,
    VelocityRow,
)
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import without_rounding
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import is_exactly, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot
from multibody_sym.scalars.vectors import S, Vec, add, cross, dot, negate, scale, subtract


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
        """Whether the row restricts motion; others define forces."""
        return not self.coupling

    @property
    def forces(self) -> list[S]:
        """The generalised force (nu) of a unit multiplier."""
        return self.jacobian if self.exerts is None else self.exerts

    @property
    def holonomic(self) -> bool:
        """Whether the row restricts positions too."""
        return self.phi is not None


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


def with_reactions(motion: Motion, rows: Sequence[RowMotion]) -> list[RowMotion]:
    """Return the rows with those that define parts of reactions filled in, which depend on all others."""
    found, wrenches = list(rows), [row.of_body for row in rows]
    names = [row.name for row in motion.mechanism.rows]
    for k, row in enumerate(motion.mechanism.rows):
        sliding = row.frictions if isinstance(row, SlidingRow) else ()
        defining = row.normal if isinstance(row, SlidingRow) else row
        if isinstance(defining, MeanTensionRow):
            found[k] = replace(
                found[k], coupling={**_mean_tension(defining, motion), k: -motion.state.values([ONE])[0]}
            )
        if isinstance(row, GivenRow):
            found[k] = replace(found[k], coupling={k: motion.state.values([ONE])[0]})
        if not isinstance(defining, ReactionRow):
            continue
        part = part_of_reaction(defining, motion, wrenches)
        share, rubbing = motion.state.values([defining.share, defining.rubbing])
        coupling = {j: x for j, x in enumerate(part.of_rows) if x is not ZERO and not is_exactly(x, 0)}
        for friction in sliding if defining.rubbing is not ZERO else ():
            along = [row_motion(direction, motion, ()) for direction in friction.rows]
            share = share + rubbing * friction_factors(friction, along, motion)[0]
        if defining.rubs in names:
            coupling[names.index(defining.rubs)] = -rubbing
        beside = next((tuple(map(names.index, each.beside)) for each in sliding if each.beside), ())
        coupling[k] = -share
        found[k] = replace(found[k], jacobian=part.columns, gamma=-part.rest, coupling=coupling, beside=beside)
    return found


def _mean_tension(row: MeanTensionRow, motion: Motion) -> dict[int, S]:
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
        for sliding in row.frictions if isinstance(row, SlidingRow) else ():
            if sliding.rows[0].name == slip:
                bias = accelerations(motion, [0] * len(motion.state.u)) if sliding.regularised is not None else []
                along = [row_motion(direction, motion, bias) for direction in sliding.rows if bias]
                yield k, friction_factors(sliding, along, motion)[0]


def exerted(rows: Sequence[RowMotion]) -> Floats:
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
def _(row: DistanceRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    difference = subtract(position(motion, row.ends[1]), position(motion, row.ends[0]))
    if row.straight is not None:
        x, y, z = motion.state.values(row.straight)
        length: S = dot((x, y, z), difference)
        return _tension(motion, [Segment(row.ends, length, (x, y, z), steady=True)], row.value, length, bias)
    length = sqrt(dot(difference, difference))
    direction = scale(1 / length, difference)
    return _tension(motion, [Segment(row.ends, length, direction)], row.value, length, bias)


@row_motion.register
def _(row: RopeRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    parts, length = segments(motion, row.path, row.straight)
    return _tension(motion, parts, row.length, length, bias)


@row_motion.register
def _(row: RopeSlipRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
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
def _(row: PositionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    frame, point = row.frames
    axis, found = direction(motion, frame, row.axis), seen(motion, frame, point, bias)
    wrenches = Wrenches(len(motion.bodies))
    add_force(wrenches, motion, point, axis)
    add_force_at(wrenches, motion, frame.body, position(motion, point), negate(axis))
    return _of_wrenches(
        motion, wrenches, dot(axis, found.distance), dot(axis, found.velocity), -dot(axis, found.acceleration)
    )


@row_motion.register
def _(row: AngleRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
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
    return _of_wrenches(motion, wrenches, dot(e, d) - value, dot(w, axis), -(dot(alpha, axis) + dot(w, axis_rate)))


@row_motion.register
def _(row: ContactRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    found = touch(row.skins, motion, bias)
    along = contact_direction(row, motion, found)
    wrenches = Wrenches(len(motion.bodies))
    first, second = (skin.place.body for skin in row.skins)
    add_force_at(wrenches, motion, first, found.place, along.vector)
    add_force_at(wrenches, motion, second, found.place, negate(along.vector))
    gamma = -(dot(along.rate, found.slip) + dot(along.vector, found.slip_rate))
    phi = found.gap if row.is_holonomic else None
    return _of_wrenches(motion, wrenches, phi, dot(along.vector, found.slip), gamma)


@row_motion.register
def _(row: TurningRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    found = touch(row.skins, motion, bias)
    axis = contact_direction(row, motion, found)
    wrenches = Wrenches(len(motion.bodies))
    first, second = (skin.place.body for skin in row.skins)
    add_moment(wrenches, motion, first, axis.vector)
    add_moment(wrenches, motion, second, negate(axis.vector))
    gamma = -(dot(axis.rate, found.turning) + dot(axis.vector, found.turning_rate))
    return _of_wrenches(motion, wrenches, None, dot(axis.vector, found.turning), gamma)


@row_motion.register
def _(row: SlidingRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    normal = row_motion(row.normal, motion, bias)
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
    slipping = rows[0]
    if not isinstance(slipping, RopeSlipRow):
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


def _of_wrenches(motion: Motion, wrenches: Wrenches, phi: S, phidot: S, gamma: S) -> RowMotion:
    return RowMotion(phi, phidot, generalized_forces(motion, wrenches.of_body), gamma, wrenches.of_body)


@row_motion.register
def _(row: ExpressionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    return _along_motion(motion, row.zero)


@row_motion.register
def _(row: GearRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    of_body = tooth_wrenches(motion, row, row.on)
    return replace(_along_motion(motion, row.zero), of_body=of_body, all_told=row.in_tree)


def tooth_wrenches(motion: Motion, row: Row, on: Sequence[tuple[int, int]]) -> list[Wrench]:
    """Return the wrenches of the force at a gear's teeth, for a unit multiplier, on bodies (number, factor)."""
    assert isinstance(row, GearRow)
    place, force = position(motion, row.pitch), direction(motion, row.pitch, row.force)
    wrenches = Wrenches(len(motion.bodies))
    for body, factor in on:
        add_force_at(wrenches, motion, body, place, scale(factor, force))
    return wrenches.of_body


@row_motion.register
def _(row: MeanTensionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return a row that exerts nothing; what it defines follows from all rows together (`with_reactions`)."""
    nothing: list[S] = [0] * len(motion.state.u)
    return RowMotion(None, 0, nothing, 0, Wrenches(len(motion.bodies)).of_body, exerts=nothing)


@row_motion.register
def _(row: ReactionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return a row that exerts nothing; what it defines follows from all rows together (`with_reactions`)."""
    nothing: list[S] = [0] * len(motion.state.u)
    return RowMotion(None, 0, nothing, 0, Wrenches(len(motion.bodies)).of_body, exerts=nothing)


@row_motion.register
def _(row: VelocityRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    return _of_speeds(motion, None, row.zero)


def _along_motion(motion: Motion, phi: Node) -> RowMotion:
    """Return the row of an expression of q and t."""
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
    q = [slot("q", i) for i in range(len(mechanism.coordinates))]
    qdot = coordinate_rates(mechanism, q, [slot("u", k) for k in range(len(mechanism.speeds))])
    return {TIME: ONE, **dict(zip(q, qdot, strict=True))}


def constraint_jacobian(rows: Sequence[RowMotion]) -> Floats:
    """Return H (s x n) of rows over floats, zero where a row moves nothing but by rounding of the forces it exerts."""
    size = len(rows[0].jacobian) if rows else 0
    jacobian = np.array([row.jacobian for row in rows], dtype=float).reshape(len(rows), size)
    return without_rounding(jacobian, exerted(rows))
