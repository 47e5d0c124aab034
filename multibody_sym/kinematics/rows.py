"""Rows: every scalar constraint's phi, phidot, the wrenches of a unit multiplier, and gamma, over any scalar.

    phi(q, t) = 0,   phidot = H u + phi_t,   H udot = gamma

H_j^T is found as the generalised force of the wrenches that a unit multiplier exerts, so that a row is written once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

from multibody_sym.kinematics.motion import Motion, accelerations, coordinate_rates
from multibody_sym.kinematics.points import acceleration, position, velocity
from multibody_sym.kinematics.ropes import Segment, segments
from multibody_sym.kinematics.vectors import S, Vec, dot, scale, subtract
from multibody_sym.kinematics.wrenches import Wrench, Wrenches, add_pair, generalized_forces
from multibody_sym.model.mechanism import TIME, DistanceRow, ExpressionRow, Mechanism, RopeRow, Row
from multibody_sym.model.slots import at
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ONE, Node, slot


@dataclass(frozen=True)
class RowMotion:
    """One row at a state: phi, phidot, the row H_j (nu), gamma, and the wrenches of a unit multiplier on the bodies."""

    phi: S
    phidot: S
    jacobian: list[S]
    gamma: S
    of_body: list[Wrench]


def row_motions(motion: Motion) -> list[RowMotion]:
    """Return all rows of a mechanism at a state."""
    if not motion.mechanism.rows:
        return []
    bias = accelerations(motion, [0] * len(motion.state.u))
    found = []
    for row in motion.mechanism.rows:
        with at("constraints", row.name):
            found.append(row_motion(row, motion, bias))
    return found


@singledispatch
def row_motion(row: Row, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return one row at a state; `bias` holds the bodies' accelerations for udot = 0."""
    raise TypeError(f"no kinematics for {type(row).__name__}")


@row_motion.register
def _(row: DistanceRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    difference = subtract(position(motion, row.ends[1]), position(motion, row.ends[0]))
    length = sqrt(dot(difference, difference))
    direction = scale(1 / length, difference)
    return _tension(motion, [Segment(row.ends, length, direction)], row.value, length, bias)


@row_motion.register
def _(row: RopeRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    parts, length = segments(motion, row.path)
    return _tension(motion, parts, row.length, length, bias)


def _tension(
    motion: Motion, parts: Sequence[Segment], wanted: Node, length: S, bias: Sequence[tuple[Vec, Vec]]
) -> RowMotion:
    """Return the row phi = wanted - length of straight segments under one tension.

    d(length)/dt = sum n . dv;  d^2(length)/dt^2 = sum n . da + (dv^2 - (n . dv)^2) / segment.
    """
    wrenches = Wrenches(len(motion.bodies))
    stretching: S = 0
    stretching_rate: S = 0
    for part in parts:
        dv = subtract(velocity(motion, part.ends[1]), velocity(motion, part.ends[0]))
        da = subtract(acceleration(motion, part.ends[1], bias), acceleration(motion, part.ends[0], bias))
        along = dot(part.direction, dv)
        stretching = stretching + along
        stretching_rate = stretching_rate + dot(part.direction, da) + (dot(dv, dv) - along * along) / part.length
        add_pair(wrenches, motion, part.ends, part.direction)
    given = _along_motion(motion, wanted)
    jacobian = [a + b for a, b in zip(given.jacobian, generalized_forces(motion, wrenches.of_body), strict=True)]
    return RowMotion(
        given.phi - length, given.phidot - stretching, jacobian, given.gamma + stretching_rate, wrenches.of_body
    )


@row_motion.register
def _(row: ExpressionRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    return _along_motion(motion, row.zero)


def _along_motion(motion: Motion, phi: Node) -> RowMotion:
    """Return the row of an expression of q and t; it exerts no wrench on bodies, only forces on speeds."""
    mechanism = motion.mechanism
    q = [slot("q", i) for i in range(len(mechanism.coordinates))]
    u = [slot("u", i) for i in range(len(mechanism.speeds))]
    along_motion = _rates_of(mechanism, q, u)
    phidot = tangents([phi], along_motion)[0]
    jacobian = [tangents([phidot], {speed: ONE})[0] for speed in u]
    gamma = -tangents([phidot], along_motion)[0]
    values = motion.state.values([phi, phidot, gamma, *jacobian])
    untouched = Wrenches(len(motion.bodies)).of_body
    return RowMotion(values[0], values[1], values[3:], values[2], untouched)


def _rates_of(mechanism: Mechanism, q: list[Node], u: list[Node]) -> dict[Node, Node]:
    qdot = coordinate_rates(mechanism, q, u)
    return {TIME: ONE, **dict(zip(q, qdot, strict=True))}
