"""What presses in a joint: parts of its reaction as affine functions of udot and of what acts on the bodies.

The reaction of a tree joint on its child balances what its child and all that this carries need and are given. Its part
f . F + m . M, about the joint's point, is therefore the power of their inertia less that of all that acts on them, in a
virtual motion in which they move as one rigid body: the joint's point along f, turning with m.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import BodyMass, Motion, accelerations, from_parent, spread
from multibody_sym.kinematics.relative import direction
from multibody_sym.kinematics.wrenches import NO_WRENCH, Wrench, generalized_forces
from multibody_sym.model.mechanism.force_rows import ReactionRow
from multibody_sym.model.mechanism.rows import CutJoint
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.vectors import (
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    subtract,
)

Twist = tuple[Vec, Vec]
_NEARLY_ZERO: Final = 1e-300
"""The square of a force that has no direction."""


@dataclass(frozen=True)
class PartOfReaction:
    """A part of a joint's reaction: `columns` (nu) . udot + `rest` + sum over rows of `of_rows` lambda."""

    columns: list[S]
    rest: S
    of_rows: list[S]


def part_of_reaction(row: ReactionRow, motion: Motion, wrenches: Sequence[Sequence[Wrench]]) -> PartOfReaction:
    """Return the part of a reaction that a row names; `wrenches` are those of each row's unit multiplier on bodies."""
    index = row.frames[1].body
    if motion.mechanism.bodies[index].joint_name == row.joint:
        return _of_tree_joint(row, motion, index, wrenches)
    cut = next(cut for cut in motion.mechanism.cuts if cut.name == row.joint)
    return _of_cut_joint(row, motion, cut, wrenches)


def _of_tree_joint(
    row: ReactionRow, motion: Motion, index: int, wrenches: Sequence[Sequence[Wrench]]
) -> PartOfReaction:
    twists = _carried_along(motion, index, _twist(row, motion))
    momenta = [NO_WRENCH] * len(motion.bodies)
    rest: S = 0
    acting, at_rest = applied(motion).of_body, accelerations(motion, [0] * len(motion.state.u))
    for k, twist in twists.items():
        momenta[k] = _momentum(motion.masses[k], *twist)
        rest = rest + _power(twist, _inertia(motion, k, *at_rest[k])) - _power(twist, acting[k])
    of_rows = [-sum((_power(twist, of_body[k]) for k, twist in twists.items()), 0) for of_body in wrenches]
    return PartOfReaction(generalized_forces(motion, momenta), rest, of_rows)


def _of_cut_joint(
    row: ReactionRow, motion: Motion, cut: CutJoint, wrenches: Sequence[Sequence[Wrench]]
) -> PartOfReaction:
    """Return a part of what the rows that stand for a joint exert on its child."""
    child, twist = row.frames[1], _twist(row, motion)
    of_rows: list[S] = [0] * len(wrenches)
    for k in cut.rows:
        of_rows[k] = _power(twist, wrenches[k][child.body])
    return PartOfReaction([0] * len(motion.state.u), 0, of_rows)


def _twist(row: ReactionRow, motion: Motion) -> Twist:
    """Return the velocity of the child's origin, and its turning, at which the joint has the power f . F + m . M."""
    child = row.frames[1]
    turning, moving = (
        apply_transposed(motion.rotation(child.body), direction(motion, row.frames[0], part))
        for part in (row.moment, row.force)
    )
    return subtract(moving, cross(turning, motion.point(child))), turning


def _carried_along(motion: Motion, index: int, twist: Twist) -> dict[int, Twist]:
    """Return the velocities of a body and of all that it carries, which move with it as one."""
    found = {index: twist}
    for k, body in enumerate(motion.mechanism.bodies):
        if body.parent in found and k != index:
            found[k] = from_parent(motion.bodies[k], found[body.parent])
    return found


def _momentum(mass: BodyMass, v: Vec, w: Vec) -> Wrench:
    """Return momentum and angular momentum about the body's origin."""
    x, y, z = add(v, cross(w, mass.com))
    linear = mass.mass * x, mass.mass * y, mass.mass * z
    return linear, add(apply(mass.inertia, w), cross(mass.com, linear))


def _inertia(motion: Motion, index: int, a: Vec, alpha: Vec) -> Wrench:
    """Return the rate of a body's momentum about its origin."""
    mass, w = motion.masses[index], motion.bodies[index].w_WB
    x, y, z = add(a, apply(spread(alpha, w), mass.com))
    force = mass.mass * x, mass.mass * y, mass.mass * z
    turning = add(apply(mass.inertia, alpha), cross(w, apply(mass.inertia, w)))
    return force, add(turning, cross(mass.com, force))


def _power(twist: Twist, wrench: Wrench) -> S:
    return dot(twist[0], wrench[0]) + dot(twist[1], wrench[1])


def along_reactions(
    forces: Sequence[Sequence[S]], beside: Mapping[int, Sequence[int]], multipliers: Sequence[S]
) -> list[list[S]]:
    """Return what rows exert (s x nu), those that go `beside` others times their part of the vectors' direction."""
    found = [list(row) for row in forces]
    for k, others in beside.items():
        x = multipliers[k]
        square = sum((multipliers[other] * multipliers[other] for other in others), x * x)
        part = x / sqrt(square + _NEARLY_ZERO)
        found[k] = [part * f for f in found[k]]
    return found
