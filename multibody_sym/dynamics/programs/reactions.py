"""Reactions: the force and moment of every joint on its child, about the joint's point, in the parent's joint frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from multibody_sym.dynamics.formalisms.inverse_dynamics import joint_wrenches
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.kinematics.guides.across import force_across
from multibody_sym.kinematics.joint_forces import along_reactions
from multibody_sym.kinematics.loads import add_drive, applied
from multibody_sym.kinematics.motion import Motion, pose
from multibody_sym.kinematics.rows import RowMotion, tooth_wrenches
from multibody_sym.kinematics.wrenches import NO_WRENCH, Wrench
from multibody_sym.model.mechanism.mechanism import NORMAL, Mechanism
from multibody_sym.model.mechanism.rows import CutJoint
from multibody_sym.scalars.vectors import (
    S,
    add,
    apply,
    apply_transposed,
    cross,
    product,
    scale,
    subtract,
)


def reactions(
    motion: Motion, udot: Sequence[S], rows: Sequence[RowMotion], multipliers: Sequence[S]
) -> Mapping[str, dict[str, S]]:
    """Return for each joint its components fx .. mz on the child, about the joint's point on the child.

    Components along free directions are the drives (motors, springs) of the joint. Axes: those of the joint's frame on
    the parent. A joint that guides along a curve has the force across it, `normal`, as well.
    """
    given = acting(motion, rows, multipliers)
    found = {}
    wrenches = joint_wrenches(motion, udot, given)
    for body, moved, (force, moment) in zip(motion.mechanism.bodies, motion.bodies, wrenches, strict=True):
        R_PF, _ = pose(motion.state, body.frame_on_parent)
        _, p_BM = pose(motion.state, body.frame_on_body)
        about_joint = subtract(moment, cross(p_BM, force))
        in_frame = [apply_transposed(R_PF, apply(moved.R_PB, v)) for v in (force, about_joint)]
        found[body.joint_name] = dict(zip(COMPONENTS, (*in_frame[0], *in_frame[1]), strict=True))
        if (across := force_across(body, motion.state, in_frame[0])) is not None:
            found[body.joint_name][NORMAL] = across
    for cut in motion.mechanism.cuts:
        found[cut.name] = dict(zip(COMPONENTS, _cut_reaction(motion, cut, rows, multipliers), strict=True))
    return found


def _cut_reaction(motion: Motion, cut: CutJoint, rows: Sequence[RowMotion], multipliers: Sequence[S]) -> tuple[S, ...]:
    """Return what a cut joint exerts on its child, about the joint's point, in the parent's joint frame."""
    frame, point = cut.frames
    force, moment = _driven(motion, cut, rows, multipliers)
    for k in cut.rows:
        on_child = rows[k].of_body[point.body]
        force = add(force, scale(multipliers[k], on_child[0]))
        moment = add(moment, scale(multipliers[k], on_child[1]))
    for k, factor in cut.teeth:
        beside = tooth_wrenches(motion, motion.mechanism.rows[k], [(point.body, -factor)])[point.body]
        force = add(force, scale(multipliers[k], beside[0]))
        moment = add(moment, scale(multipliers[k], beside[1]))
    about_joint = subtract(moment, cross(motion.point(point), force))
    R_WF = product(motion.rotation(frame.body), pose(motion.state, frame.pose)[0])
    in_frame = [apply_transposed(R_WF, apply(motion.rotation(point.body), v)) for v in (force, about_joint)]
    return (*in_frame[0], *in_frame[1])


def _driven(motion: Motion, cut: CutJoint, rows: Sequence[RowMotion], multipliers: Sequence[S]) -> Wrench:
    """Return what loads and rows exert on the child along a cut joint's freedoms (body axes, about its origin).

    The child is carried freely from ground, so that its generalised forces are a force and a moment.
    """
    loads = [load for load in motion.mechanism.loads if getattr(load, "joint", None) == cut.name]
    one_way = _one_way_in(motion.mechanism, cut.name)
    if not loads and not cut.drives and not one_way:
        return NO_WRENCH
    of_speed = applied(motion, loads, weight=False).of_speed
    beside = {k: others for k in one_way if (others := rows[k].beside)}
    exerted = along_reactions([row.forces for row in rows], beside, multipliers) if one_way else []
    for k in one_way:
        of_speed = [q + multipliers[k] * x for q, x in zip(of_speed, exerted[k], strict=True)]
    for drive, factor in zip(cut.drives, motion.state.values([drive.factor for drive in cut.drives]), strict=True):
        add_drive(motion, drive.rate, multipliers[drive.row] * factor, of_speed)
    index = cut.frames[1].body
    child = motion.mechanism.bodies[index]
    Q = [of_speed[k] for k in child.u]
    along, about = (Q[:3], Q[3:]) if child.quaternions else ((*Q[:2], 0), (0, 0, Q[2]))
    force = apply_transposed(motion.bodies[index].R_PB, along)
    return force, add(about, cross(pose(motion.state, child.frame_on_body)[1], force))


def _one_way_in(mechanism: Mechanism, joint: str) -> list[int]:
    """Return the rows by which stops and friction act along and about the freedoms of a joint, in the present mode."""
    names = {row.name for element in mechanism.one_way if element.joint == joint for row in element.rows}
    return [k for k, row in enumerate(mechanism.rows) if row.name in names]


def acting(motion: Motion, rows: Sequence[RowMotion], multipliers: Sequence[S]) -> list[Wrench]:
    """Return all wrenches on the bodies except the joints': applied ones, weight, and those of the rows."""
    total = list(applied(motion).of_body)
    for row, multiplier in zip(rows, multipliers, strict=True):
        for index, (force, moment) in enumerate(row.of_body):
            known = total[index]
            total[index] = (add(known[0], scale(multiplier, force)), add(known[1], scale(multiplier, moment)))
    return total
