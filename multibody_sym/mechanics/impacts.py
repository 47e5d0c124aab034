"""What do the names in an `impact:` section stand for, and how does a mechanism move in an impact?

Points that meet, elements that close, impulses, constraints that begin; then the mechanism of the jumps of speeds.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.contacts import verify_bodies
from multibody_sym.mechanics.law_elements import (
    INSTANT,
    JUMPED,
    MEETING,
    FrictionPart,
    GivenRow,
    JumpRow,
    LawElement,
    MeetingRow,
    SpeedJump,
    StruckImpacts,
    coulomb_coefficients,
    jump_leaf,
)
from multibody_sym.mechanics.load_records import BodyTorque, Load, PointForce
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import Motion, State
from multibody_sym.mechanics.points import (
    Wrenches,
    acceleration,
    add_force,
    angular_velocity,
    direction,
    position,
    velocity,
)
from multibody_sym.mechanics.references import References, surface_tangents
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motion, row_of_wrenches
from multibody_sym.mechanics.row_records import CutJoint, Marker, Row
from multibody_sym.model.bodies import GROUND, ORIGIN, Pose, unit_vector
from multibody_sym.model.contacts_and_impacts import Impact, Impacts
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_upright
from multibody_sym.model.system import with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import substitute
from multibody_sym.scalars.node import ZERO, Node, as_node, slot
from multibody_sym.scalars.vectors import S, Vec, apply_transposed, cross, dot, negate, subtract


def struck_impacts(
    references: References, one_way: Sequence[LawElement], rows: Sequence[Row], cuts: Sequence[CutJoint]
) -> StruckImpacts | None:
    """Return the resolved section of a system. Raises ModelError, with the path, for a name that nothing fits."""
    declared = references.system.impact
    if declared is None:
        return None
    found = _Resolved(references, declared, one_way, rows, cuts)
    for name, impact in declared.strikes.items():
        with at(*declared.path(name)):
            found.add(name, impact)
    return StruckImpacts(
        tuple(found.meetings),
        tuple(found.contacts) if declared.strikes else None,  # without any, everything that is declared and closes
        tuple(found.loads),
        found.begins,
        tuple(found.jumps),
        found.restitutions,
        found.tangential,
        declared.law,
        declared.sequence,
        found.paths,
    )


@dataclass
class _Resolved:
    """The section as it is resolved, one impact after the other."""

    references: References
    declared: Impacts
    one_way: Sequence[LawElement]
    rows: Sequence[Row]
    cuts: Sequence[CutJoint]
    meetings: list[LawElement] = field(default_factory=list)
    contacts: list[str] = field(default_factory=list)
    loads: list[Load] = field(default_factory=list)
    begins: dict[str, tuple[str, ...]] = field(default_factory=dict)
    jumps: list[SpeedJump] = field(default_factory=list)
    restitutions: dict[str, Node] = field(default_factory=dict)
    tangential: dict[str, Node] = field(default_factory=dict)
    paths: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def add(self, name: str, impact: Impact) -> None:
        self.paths[name] = self.declared.path(name)
        if impact.between is not None:
            self.meetings.append(self._meeting(name, impact, impact.between))
        elif impact.contacts is not None:
            self._add_contacts(impact, impact.contacts)
        elif impact.begins is not None:
            self._add_begun(impact.begins)
        elif impact.motion is not None:
            self.jumps.append(self._jump(impact.motion, impact.speed or ZERO))
        else:
            self.loads.append(self._load(name, impact))

    def _along(self, impact: Impact, components: Point) -> tuple[int, Point]:
        """Return the body whose axes carry those of the frame, and a vector along them."""
        return self.references.along(impact.frame or GROUND, components)

    def _meeting(self, name: str, impact: Impact, between: tuple[str, ...]) -> LawElement:
        with at("between"):
            verify_bodies(between, self.references.system)
        if any(name in (x.name, x.group) for x in self.one_way):
            raise ModelError(f"{name!r} is a contact too, and results tell both by name; rename one", number="M108")
        ends = self.references.pair(between)
        axes, normal = self._along(impact, impact.normal or (ZERO, ZERO, ZERO))
        frame = Marker(impact.frame or GROUND, axes, Pose())
        normal, flat = self._normal(None if impact.normal is None else normal, len(self.meetings))

        def row(word: str, axis: Point, *, closes: bool = False) -> MeetingRow:
            return MeetingRow(f"{name}.{word}", ends, axis, frame, closes)

        coefficients = coulomb_coefficients(impact.static, impact.kinetic)
        frictions: tuple[FrictionPart, ...] = ()
        if coefficients is not None:
            t1, t2 = surface_tangents(normal, flat=flat)
            rows = (row("friction", t1),) if flat else (row("friction1", t1), row("friction2", t2))
            frictions = (FrictionPart(name, rows, *coefficients),)
        return LawElement(
            name,
            "contact",
            (self.paths[name][0], self.paths[name][-1]),
            (row("normal", normal, closes=True),),
            frictions=frictions,
            restitution=ZERO if impact.restitution is None else impact.restitution,
            tangential_restitution=impact.tangential_restitution or ZERO,
            group=name,
        )

    def _normal(self, given: Point | None, number: int) -> tuple[Point, bool]:
        """Return the unit normal, and whether it lies in the plane of a plane model."""
        if given is None:
            x, y, z = (slot(MEETING, 3 * number + k) for k in range(3))
            return unit_vector((x, y, ZERO if self.references.flat else z)), self.references.flat
        normal = unit_vector(given)
        if self.references.flat and is_upright(normal):
            with at("normal"):
                raise ModelError(
                    "the normal leads out of the plane in which everything here moves; nothing strikes so",
                    number="M121",
                )
        return normal, self.references.flat and normal[2] is ZERO

    def _add_contacts(self, impact: Impact, names: tuple[str, ...]) -> None:
        unilateral = [element for element in self.one_way if element.unilateral]
        known = list(dict.fromkeys(x for each in unilateral for x in (each.name, each.group) if x))
        for k, name in enumerate(names):
            if name not in known:
                with at("contacts", k):
                    raise ModelError(
                        f"{name!r} is no contact, rope that may slacken or stop", number="M106", word=name, known=known
                    )
            self.contacts.append(name)
            if impact.restitution is not None:
                self.restitutions[name] = impact.restitution
            if impact.tangential_restitution is not None:
                if not any(x.frictions for x in unilateral if name in (x.name, x.group)):
                    with at("tangential_restitution"):
                        raise ModelError(
                            f"{name} is smooth and stores nothing to give back; give it static or kinetic",
                            number="M121",
                        )
                self.tangential[name] = impact.tangential_restitution

    def _add_begun(self, names: tuple[str, ...]) -> None:
        rows: dict[str, list[str]] = {}
        for row in self.rows:
            rows.setdefault(row.name.partition(".")[0], []).append(row.name)
        cut: Mapping[str, CutJoint] = {x.name: x for x in self.cuts}
        for k, name in enumerate(names):
            if name in cut:
                self.begins[name] = tuple(self.rows[i].name for i in cut[name].rows)
            elif name in self.references.system.constraints and name in rows:
                self.begins[name] = tuple(rows[name])
            else:
                with at("begins", k):
                    if name in self.references.system.joints:
                        message = f"joint {name!r} carries its child, which has no coordinates without it"
                        raise ModelError(f"{message}; mark it cut: true", number="M121")
                    if any(name in (x.name, x.group) for x in self.one_way):
                        raise ModelError(f"{name!r} holds one way only; write contacts: [{name}]", number="M121")
                    message = f"{name!r} is no joint that is cut and no constraint"
                    raise ModelError(message, number="M121", word=name, known=[*cut, *rows])

    def _jump(self, name: str, by: Node) -> SpeedJump:
        with at("motion"):
            joint = self.references.system.joints.get(name)
            if joint is not None and getattr(joint, "motion", None) is not None:
                return SpeedJump(name, name, "", by)
            if joint is None and any(row.name == name for row in self.rows):
                return SpeedJump(name, "", name, by)
            known = [x for x, j in self.references.system.joints.items() if getattr(j, "motion", None) is not None]
            known += [row.name for row in self.rows]
            raise ModelError(f"{name!r} is no prescribed motion", number="M106", word=name, known=known)

    def _load(self, name: str, impact: Impact) -> Load:
        if impact.impulse is not None:
            with at("at"):
                marker = self.references.marker(impact.at or "")
                self._verify_moves(marker.body)
            axes, impulse = self._along(impact, impact.impulse)
            return PointForce(name, marker, impulse, axes)
        with at("on"):
            body = self.references.marker(impact.on or "").body
            self._verify_moves(body)
            self.references.verify_turns(body)
        axes, couple = self._along(impact, impact.couple or (ZERO, ZERO, ZERO))
        return BodyTorque(name, body, couple, axes)

    def _verify_moves(self, body: int) -> None:
        if body < 0:
            raise ModelError("ground does not move, whatever strikes it; name a body", number="M121")


# ----------------------------------------------------------------------------------------------------------------------
# A mechanism in an impact: at rest without loads, its rows to jump; and how rows of impacts move.
#
#     M Du = I + C^T p        H Du = wanted jumps
#
# with I the given impulses. All that finds udot, multipliers and reactions of a mechanism finds of this one the jumps
# of speeds Du, the impulses p and the impulses and impulse couples in the joints.


_BEFORE: Final = "before"


def before_leaf(speed: int) -> Node:
    """Return the leaf for a speed before the impact, where u are the speeds of the mechanism at rest."""
    return slot(_BEFORE, speed)


def impact_mechanism(
    mechanism: Mechanism,
    striking: Sequence[Row],
    loads: Sequence[Load] = (),
    *,
    jumping: Sequence[str] = (),
    drives: Mapping[str, Node] | None = None,
    elements: Sequence[LawElement] = (),
    given: Collection[str] = (),
) -> Mechanism:
    """Return the mechanism of an impact: rows that `strike` after its own, given impulses as its only `loads`.

    Each striking row, and each own row named `jumping`, jumps by its `jump_leaf`; rows that define forces do not jump,
    and the impulses of rows named `given` are their leaves. `drives` are the jumps of the rates of prescribed motions,
    by joint, `elements` those of the impact beside its own.
    """
    rows = [with_expressions(row, _at_instant) for row in (*mechanism.rows, *striking)]
    first = len(mechanism.rows)
    made = [
        JumpRow(row.name, row, jump_leaf(k)) if row.restricts and (k >= first or row.name in jumping) else row
        for k, row in enumerate(rows)
    ]
    made = [GivenRow(row.name, rows[k], jump_leaf(k)) if row.name in given else row for k, row in enumerate(made)]
    bodies = []
    for body in mechanism.bodies:
        jump = (drives or {}).get(body.joint_name)
        # of the value 0, the rate 0 and the acceleration `jump` at the time 0
        added = as_node(0) if jump is None else as_node(jump * TIME * TIME / 2)
        standing = [with_expressions(step, _at_instant) for step in body.steps]
        steps = tuple(x if x.motion is None else x.with_motion(x.motion + added) for x in standing)
        bodies.append(body if steps == body.steps else replace(body, steps=steps))
    return replace(
        mechanism,
        gravity=ORIGIN,
        bodies=tuple(bodies),
        loads=tuple(loads),
        rows=tuple(made),
        one_way=(*mechanism.one_way, *elements),
        mode=None,
        held=(),
        relative=None,
    )


def _at_instant(node: Node) -> Node:
    return substitute(node, {TIME: INSTANT}) if TIME in leaves([node], "slot") else node


def jumping_motions(mechanism: Mechanism, drives: Mapping[str, Node]) -> Mechanism:
    """Return a mechanism in which the rates of prescribed motions have jumped where `JUMPED` is 1."""
    bodies = list(mechanism.bodies)
    for k, body in enumerate(bodies):
        if body.joint_name in drives:
            jump = drives[body.joint_name] * JUMPED * (TIME - INSTANT)
            steps = (x if x.motion is None else x.with_motion(as_node(x.motion + jump)) for x in body.steps)
            bodies[k] = replace(body, steps=tuple(steps))
    return replace(mechanism, bodies=tuple(bodies))


def after_impact(before: State, u: Sequence[S]) -> State:
    speeds = {slot("u", k): x for k, x in enumerate(u)}
    return replace(before, u=tuple(u), slots={**before.slots, **speeds, JUMPED: 1})


def state_in_impact(before: State, jumps: Mapping[int, S]) -> State:
    """Return the state of the mechanism of an impact: that `before` it, with u = 0 and the jumps of rows by number."""
    zeros = (as_node(0),) * len(before.u) if before.scalar is Node else (0.0,) * len(before.u)
    slots = dict(before.slots)
    slots |= {slot("u", k): zero for k, zero in enumerate(zeros)}
    slots |= {before_leaf(k): u for k, u in enumerate(before.u)}
    slots |= {TIME: as_node(0) if before.scalar is Node else 0.0}
    slots |= {jump_leaf(k): jump for k, jump in jumps.items()}
    return State(before.scalar, before.q, zeros, slots)


def with_meetings(motion: Motion, elements: Sequence[LawElement]) -> State:
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
    phi, gamma = dot(n, apart) if row.closes else None, -(dot(n, reached) + dot(turning, moving))
    return row_of_wrenches(motion, wrenches, phi, dot(n, moving), gamma)


@row_motion.register
def _(row: GivenRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return a row whose multiplier is given (`with_reactions`) and that exerts the forces of its own row."""
    found = row_motion(row.of, motion, bias)
    nothing: list[S] = [0] * len(motion.state.u)
    impulse = motion.state.values([row.wanted])[0]
    return replace(found, phi=None, phidot=0, jacobian=nothing, gamma=impulse, exerts=list(found.forces))


@row_motion.register
def _(row: JumpRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RowMotion:
    """Return the row with its wanted jump, beside those of prescribed motions."""
    found = row_motion(row.of, motion, bias)
    return replace(found, gamma=found.gamma + motion.state.values([row.wanted])[0])
