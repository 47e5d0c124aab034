"""A mechanism in an impact: at rest without loads, its rows to jump; and how rows of impacts move.

    M Du = I + C^T p        H Du = wanted jumps

with I the given impulses. All that finds udot, multipliers and reactions of a mechanism finds of this one the jumps of
speeds Du, the impulses p and the impulses and impulse couples in the joints.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import acceleration, position, velocity
from multibody_sym.kinematics.relative import angular_velocity, direction
from multibody_sym.kinematics.rows import RowMotion, row_motion
from multibody_sym.kinematics.state import State
from multibody_sym.kinematics.wrenches import Wrenches, add_force, generalized_forces
from multibody_sym.model.declaration.steps import Step
from multibody_sym.model.declaration.system import with_expressions
from multibody_sym.model.mechanism.impacts import (
    INSTANT,
    JUMPED,
    MEETING,
    GivenRow,
    JumpRow,
    MeetingRow,
    jump_leaf,
)
from multibody_sym.model.mechanism.loads import Load
from multibody_sym.model.mechanism.mass import ORIGIN
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism, TreeBody
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, as_node, slot
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import S, Vec, apply_transposed, cross, dot, negate, subtract

_BEFORE: Final = "before"


def before_leaf(speed: int) -> Node:
    """Return the leaf for a speed before the impact, where u are the speeds of the mechanism at rest."""
    return slot(_BEFORE, speed)


# --- the mechanism -------------------------------------------------------------------------------------------------


def at_rest(
    mechanism: Mechanism,
    striking: Sequence[Row],
    loads: Sequence[Load] = (),
    *,
    jumping: Sequence[str] = (),
    drives: Mapping[str, Node] | None = None,
    elements: Sequence[OneWay] = (),
    given: Collection[str] = (),
) -> Mechanism:
    """Return the mechanism of an impact: rows that `strike` after its own, given impulses as its only `loads`.

    Each striking row, and each of its own that is named `jumping`, is to jump by its `jump_leaf`; those that define
    what presses in a joint do not jump, and the impulses of those named `given` are their leaves. `drives`: by how much
    the rates of prescribed motions of joints jump. `elements` are those of the impact beside its own.
    """
    rows = [_stopped(row) for row in (*mechanism.rows, *striking)]
    first = len(mechanism.rows)
    made = [
        JumpRow(row.name, row, jump_leaf(k)) if row.restricts and (k >= first or row.name in jumping) else row
        for k, row in enumerate(rows)
    ]
    made = [GivenRow(row.name, rows[k], jump_leaf(k)) if row.name in given else row for k, row in enumerate(made)]
    return replace(
        mechanism,
        gravity=ORIGIN,
        bodies=tuple(_stopped_body(body, (drives or {}).get(body.joint_name)) for body in mechanism.bodies),
        loads=tuple(loads),
        rows=tuple(made),
        one_way=(*mechanism.one_way, *elements),
        mode=None,
        held=(),
        relative=None,
    )


def _stopped(part: Row) -> Row:
    """Return a row in which time stands still."""
    return with_expressions(part, _at_instant)  # type: ignore[no-any-return]


def _at_instant(node: Node) -> Node:
    if TIME not in leaves([node], "slot"):
        return node
    return as_node(evaluate([node], lambda leaf: INSTANT if leaf is TIME else leaf)[0])


def _stopped_body(body: TreeBody, jump: Node | None) -> TreeBody:
    """Return a body whose prescribed motion stands still, or starts with the jump of its rate as acceleration."""
    standing = (with_expressions(step, _at_instant) for step in body.steps)
    steps = tuple(
        step if step.motion is None else step.with_motion(step.motion + _jumping(jump)) for step in standing
    )
    return body if steps == body.steps else replace(body, steps=steps)


def _jumping(jump: Node | None) -> Node:
    """Return what has the value 0, the rate 0 and the acceleration `jump` at the time 0."""
    return as_node(0) if jump is None else as_node(jump * TIME * TIME / 2)


def jumping_motions(mechanism: Mechanism, drives: Mapping[str, Node]) -> Mechanism:
    """Return a mechanism in which the rates of prescribed motions have jumped where `JUMPED` is 1."""
    bodies = tuple(
        replace(body, steps=tuple(_jumped(step, drives[body.joint_name]) for step in body.steps))
        if body.joint_name in drives
        else body
        for body in mechanism.bodies
    )
    return replace(mechanism, bodies=bodies)


def _jumped(step: Step, jump: Node) -> Step:
    """Return a prescribed step with the jump of its rate."""
    if step.motion is None:
        return step
    return step.with_motion(as_node(step.motion + jump * JUMPED * (TIME - INSTANT)))


def after_impact(before: State, u: Sequence[S]) -> State:
    """Return the state after an impact with the speeds u."""
    speeds = {slot("u", k): x for k, x in enumerate(u)}
    return replace(before, u=tuple(u), slots={**before.slots, **speeds, JUMPED: 1})


def resting(before: State, jumps: Mapping[int, S]) -> State:
    """Return the state of the mechanism of an impact: that `before` it, with u = 0 and the jumps of rows by number."""
    zeros = (as_node(0),) * len(before.u) if before.scalar is Node else (0.0,) * len(before.u)
    slots = dict(before.slots)
    slots |= {slot("u", k): zero for k, zero in enumerate(zeros)}
    slots |= {before_leaf(k): u for k, u in enumerate(before.u)}
    slots |= {TIME: as_node(0) if before.scalar is Node else 0.0}
    slots |= {jump_leaf(k): jump for k, jump in jumps.items()}
    return State(before.scalar, before.q, zeros, slots)


def with_meetings(motion: Motion, elements: Sequence[OneWay]) -> State:
    """Return a motion's state with the relative velocities of the points that meet without a normal."""
    found: dict[Node, S] = {}
    for element in elements:
        row = element.normals[0]
        if isinstance(row, MeetingRow):
            wanted = [leaf for leaf in leaves(row.axis, "slot") if leaf.data[0] == MEETING]
            if wanted:
                first, second = row.ends  # the normal leads from the second to the first, which comes against it
                coming = subtract(velocity(motion, second), velocity(motion, first))
                moving = apply_transposed(motion.rotation(row.frame.body), coming)
                found |= {leaf: moving[leaf.data[1] % 3] for leaf in wanted}
    state = motion.state
    return replace(state, slots={**state.slots, **found}) if found else state


# --- rows ----------------------------------------------------------------------------------------------------------


@row_motion.register
def _(row: MeetingRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    first, second = row.ends
    n = direction(motion, row.frame, row.axis)
    turning = cross(angular_velocity(motion, row.frame.body), n)
    apart, moving = (subtract(of(motion, first), of(motion, second)) for of in (position, velocity))
    reached = subtract(acceleration(motion, first, bias), acceleration(motion, second, bias))
    wrenches = Wrenches(len(motion.bodies))
    add_force(wrenches, motion, first, n)
    add_force(wrenches, motion, second, negate(n))
    return RowMotion(
        dot(n, apart) if row.closes else None,
        dot(n, moving),
        generalized_forces(motion, wrenches.of_body),
        -(dot(n, reached) + dot(turning, moving)),
        wrenches.of_body,
    )


@row_motion.register
def _(row: GivenRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return a row that tells its multiplier (`with_reactions` does) and exerts what its own row does."""
    found = row_motion(row.row, motion, bias)
    nothing: list[S] = [0] * len(motion.state.u)
    impulse = motion.state.values([row.wanted])[0]
    return replace(found, phi=None, phidot=0, jacobian=nothing, gamma=impulse, exerts=list(found.forces))


@row_motion.register
def _(row: JumpRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return the row with the wanted jump beside what prescribed motions that jump contribute."""
    found = row_motion(row.row, motion, bias)
    return replace(found, gamma=found.gamma + motion.state.values([row.wanted])[0])
