"""Reactions of joints and pulleys, tensions of ropes, forces of one-way elements, and switching functions of a mode.

In: a mechanism's motion and the multipliers of its rows, over any scalar.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, reduce
from typing import Final, Literal

from multibody_sym.dynamics.formalisms.composite_body import joint_wrenches
from multibody_sym.mechanics.contact_geometry import gap, reach, rim_flatness, touch
from multibody_sym.mechanics.forces import add_drive, applied_forces, force_across
from multibody_sym.mechanics.law_elements import (
    ACTIVE,
    FRICTION,
    PRESSING,
    FrictionPart,
    LawElement,
    Limit,
    Mode,
    component_names,
    components_of,
    exerted_by,
    limits_in,
)
from multibody_sym.mechanics.mechanism import NORMAL, Mechanism
from multibody_sym.mechanics.modes import ModeNodes, has_end, has_rim
from multibody_sym.mechanics.motion import Motion, accelerations, pose
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, position, separation, slip_velocity
from multibody_sym.mechanics.ropes import segments, wheel_at
from multibody_sym.mechanics.row_kinematics import (
    RowMotion,
    along_reactions,
    coefficients,
    friction_factors,
    friction_on,
    row_motion,
    tooth_wrenches,
)
from multibody_sym.mechanics.row_records import CutJoint, RopeRow, Row, Sliding, is_point
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.functions import maximum, minimum, where
from multibody_sym.scalars.limits import OF_FORCES, Kind, along, length
from multibody_sym.scalars.node import ONE, ZERO, less, nodes_among
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    product,
    scale,
    subtract,
)
from multibody_sym.text.printer import AT, COMPONENTS


def reactions(
    motion: Motion, udot: Sequence[S], rows: Sequence[RowMotion], multipliers: Sequence[S]
) -> Mapping[str, dict[str, S]]:
    """Return for each joint the components fx .. mz of its wrench on the child, about the joint's point on the child.

    Components along free directions are the drives (motors, springs) of the joint. Axes: those of the joint's frame on
    the parent. A joint that guides along a curve has the force across it, `normal`, as well.
    """
    found = {}
    wrenches = joint_wrenches(motion, udot, wrenches_on_bodies(motion, rows, multipliers))
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
    """Return a cut joint's force and moment on its child, about the joint's point, in the parent's joint frame."""
    frame, point = cut.frames
    force, moment = _along_freedoms(motion, cut, rows, multipliers)
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


def _along_freedoms(motion: Motion, cut: CutJoint, rows: Sequence[RowMotion], multipliers: Sequence[S]) -> Wrench:
    """Return the wrench of loads and rows on the child along a cut joint's freedoms (body axes, about its origin).

    The child is carried freely from ground, so that its generalised forces are a force and a moment.
    """
    mechanism = motion.mechanism
    loads = [load for load in mechanism.loads if getattr(load, "joint", None) == cut.name]
    names = {row.name for element in mechanism.one_way if element.joint == cut.name for row in element.rows}
    one_way = [k for k, row in enumerate(mechanism.rows) if row.name in names]  # stops and friction of the joint
    if not loads and not cut.drives and not one_way:
        return NO_WRENCH
    of_speed = applied_forces(motion, loads, weight=False).of_speed
    beside = {k: others for k in one_way if (others := rows[k].beside)}
    exerted = along_reactions([row.forces for row in rows], beside, multipliers) if one_way else []
    for k in one_way:
        of_speed = [q + multipliers[k] * x for q, x in zip(of_speed, exerted[k], strict=True)]
    for drive, factor in zip(cut.drives, motion.state.values([drive.factor for drive in cut.drives]), strict=True):
        add_drive(motion, drive.rate, multipliers[drive.row] * factor, of_speed)
    index = cut.frames[1].body
    child = mechanism.bodies[index]
    Q = [of_speed[k] for k in child.u]
    along, about = (Q[:3], Q[3:]) if child.quaternions else ((*Q[:2], 0), (0, 0, Q[2]))
    force = apply_transposed(motion.bodies[index].R_PB, along)
    return force, add(about, cross(pose(motion.state, child.frame_on_body)[1], force))


def wrenches_on_bodies(motion: Motion, rows: Sequence[RowMotion], multipliers: Sequence[S]) -> list[Wrench]:
    """Return all wrenches on the bodies except the joints': applied ones, weight, and those of the rows."""
    total = list(applied_forces(motion).of_body)
    for row, multiplier in zip(rows, multipliers, strict=True):
        for index, (force, moment) in enumerate(row.of_body):
            known = total[index]
            total[index] = (add(known[0], scale(multiplier, force)), add(known[1], scale(multiplier, moment)))
    return total


# ----------------------------------------------------------------------------------------------------------------------
# Tensions of ropes: one for each run, one more for each wheel between its ends on which a run rubs.


def ropes(mechanism: Mechanism) -> Iterator[RopeRow]:
    """Yield the rows of all runs of ropes, also of those that are slack in the mechanism's mode."""
    plain = [row.plain for row in mechanism.rows]
    slack = [row for element in mechanism.one_way for row in element.normals]
    named = {row.name: row.rope_run for row in (*plain, *slack) if row.rope_run is not None}
    yield from named.values()


def tensions(motion: Motion, multipliers: Sequence[S], row: RopeRow) -> list[S]:
    """Return the tensions of a run of rope along its path; a rough wheel lies between two of them."""
    places = {row.name: k for k, row in enumerate(motion.mechanism.rows)}
    if row.name not in places:
        return [0 for _ in row.components]
    mean = multipliers[places[row.name]]
    if not row.rubs:
        return [mean]
    (half,) = motion.state.values([ONE / 2])
    halves: list[S] = []
    for slip in row.rubs:
        parts = [half * (factor * multipliers[k]) for k, factor in friction_on(slip, motion)]
        halves.append(parts[0] if parts else 0)
    return [sum(halves[k:], sum((-x for x in halves[:k]), mean)) for k in range(len(halves) + 1)]


# ----------------------------------------------------------------------------------------------------------------------
# Reactions of massless pulleys: the force on each, by the body that it stands on, against the ropes over it.


def pulley_reactions(motion: Motion, multipliers: Sequence[S]) -> Mapping[str, dict[str, S]]:
    """Return for each massless pulley with a rope fx .. mz on it, about its centre, in the axes of its carrier.

    The moment is the rope's friction on a drum that stands still.
    """
    wrenches: dict[str, tuple[Vec, Vec]] = {}
    bodies: dict[str, int] = {}
    for row in ropes(motion.mechanism):
        own = [k for k, bend in enumerate(row.path[1:-1], 1) if bend.pulley and bend.massless]
        if not own:
            continue
        values = tensions(motion, multipliers, row)
        rough = [k for k, bend in enumerate(row.path[:-1]) if k and bend.rough] if len(values) > 1 else []
        pulls = [values[sum(k <= piece for k in rough)] for piece in range(len(row.path) - 1)]
        pieces = segments(motion, row.path, row.straight)[0]
        for k in own:
            name, before, after = row.path[k].pulley, pulls[k - 1], pulls[k]
            force = subtract(scale(before, pieces[k - 1].direction), scale(after, pieces[k].direction))
            wheel = wheel_at(motion, row.path, k) if before is not after else None
            moment = ZERO_VECTOR if wheel is None else scale((before - after) * wheel.radius, wheel.axis)
            known = wrenches.get(name, (ZERO_VECTOR, ZERO_VECTOR))
            wrenches[name] = add(known[0], force), add(known[1], moment)
            bodies[name] = row.path[k].at.body
    found = {}
    for name, wrench in wrenches.items():
        F, M = (apply_transposed(motion.rotation(bodies[name]), v) for v in wrench)
        found[name] = dict(zip(COMPONENTS, (*F, *M), strict=True))
    return found


def held_pulleys(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the massless pulleys that ropes run over."""
    bends = (bend for row in ropes(mechanism) for bend in row.path[1:-1])
    return tuple(dict.fromkeys(bend.pulley for bend in bends if bend.pulley and bend.massless))


# ----------------------------------------------------------------------------------------------------------------------
# The forces of one-way elements in the mode of a mechanism, over any scalar.


def mode_of(mechanism: Mechanism) -> Mode:
    return mechanism.mode or Mode({})


def is_active(mechanism: Mechanism, element: LawElement) -> bool:
    """Return whether an element acts: friction in joints always does, and any may `in_every_mode`."""
    if mechanism.mode_numbers or not element.unilateral:
        return True
    return mode_of(mechanism).acts(element)


@dataclass(frozen=True, eq=False)
class LawForces:
    """The elements of a mechanism in its mode, in motion, with the multipliers (ns) of its rows."""

    motion: Motion
    multipliers: Sequence[S]

    @property
    def mechanism(self) -> Mechanism:
        return self.motion.mechanism

    @property
    def mode(self) -> Mode:
        return mode_of(self.mechanism)

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {row.name: k for k, row in enumerate(self.mechanism.rows)}

    def multiplier(self, row: str) -> S:
        """Return the multiplier of a row by name, 0 where it does not act."""
        place = self._places.get(row)
        return 0 if place is None else self.multipliers[place]

    def normal(self, element: LawElement) -> S:
        """Return the force with which an element presses, pulls or stops."""
        return self.multiplier(element.normals[0].name)

    def pressing(self, element: LawElement, part: FrictionPart) -> S:
        """Return N of a part's friction law, for normal forces with the signs that they have in the mode."""
        normals = element.normals_of(part)
        forces = [self.multiplier(row.name) for row in normals]
        in_programs = self.mechanism.mode_numbers and bool(nodes_among(forces))  # numbers have a mode
        side = ModeNodes(self.mechanism).side if in_programs and not part.norm else self.side
        return limits.pressing(forces, [side(element, row) for row in normals], norm=part.norm)

    def side(self, element: LawElement, normal: Row) -> int:
        """Return the sign with which the force of a normal row counts."""
        return ACTIVE if element.unilateral else self.mode.side(element, normal) or ACTIVE

    def friction(self, part: FrictionPart) -> list[S]:
        """Return the friction of a part along its rows (1, or 2 in space).

        A part that neither slides nor exerts its limit has rows of its own.
        """
        found = list(self.slidings(part))
        if not found:
            return [self.multiplier(row.name) for row in part.rows]
        total: list[S] = [0 for _ in part.rows]
        for name, sliding in found:
            factors = friction_factors(sliding, [self.row(x) for x in part.rows], self.motion)
            if part.norm:
                return [factor * self.pressing(self._element_of(part), part) for factor in factors]
            force = self.multiplier(name)
            total = [x + factor * force for x, factor in zip(total, factors, strict=True)]
        return total

    def most(self, element: LawElement, part: FrictionPart) -> S:
        """Return how large the friction of a part can be while it sticks."""
        return limits.most(self._static(part), self.pressing(element, part))

    def room(self, element: LawElement, part: FrictionPart) -> S:
        """Return by how much the friction of a part is below its limit, negative beyond."""
        return limits.room(self._static(part), self.pressing(element, part), self.friction(part))

    @property
    def mode_limits(self) -> Iterator[Limit]:
        """The limits of all elements in the mode."""
        for element in self.mechanism.one_way:
            yield from limits_in(self.mode, element)

    def value(self, limit: Limit, rate: Callable[[Row], S]) -> S:
        """Return the value of a limit, which must not be negative, where rows move at a `rate`."""
        element, part = limit.element, limit.part
        if part is not None:
            return self.room(element, part) if limit.kind == "cone" else self.forward(part, rate)
        normal = element.normals[limit.normal]
        if limit.kind == "gap":
            return rate(normal)
        force = self.multiplier(normal.name)
        return force if limit.kind == "force" else limits.towards(self.mode.side(element, normal), force)

    def forward(self, part: FrictionPart, rate: Callable[[Row], S]) -> S:
        """Return the speed of a part along its slip, or along that which begins in space, with rows at a `rate`."""
        return limits.along(self.begins(part) or [self.mode.slip(part)], [rate(row) for row in part.rows])

    def begins(self, part: FrictionPart) -> list[S]:
        """Return the direction along a part's rows in which it begins to slide in space; empty for others."""
        starts = next((sliding.starts for _, sliding in self.slidings(part)), None)
        return [] if starts is None else self.motion.state.values(starts)

    def tension_ratio(self, part: FrictionPart) -> S:
        """Return how many times one tension of a rope on a rough wheel the other one can be."""
        return limits.tension_ratio(self._static(part))

    def _static(self, part: FrictionPart) -> S:
        return coefficients(self.motion, part.rows, [part.static])[0]

    def slidings(self, part: FrictionPart) -> Iterator[tuple[str, Sliding]]:
        """Yield how a part slides, with the name of each row whose multiplier it follows."""
        for row in self.mechanism.rows:
            for sliding in row.sliding:
                if sliding.rows == part.rows:
                    yield row.name, sliding

    def _element_of(self, part: FrictionPart) -> LawElement:
        return next(element for element in self.mechanism.one_way if part in element.frictions)

    def row(self, row: Row) -> RowMotion:
        """Return the motion of a row of an element, whether it acts or not; rows that define forces have none."""
        if row.name not in self._moved:
            self._moved[row.name] = row_motion(row, self.motion, self._bias)
        return self._moved[row.name]

    @cached_property
    def _moved(self) -> dict[str, RowMotion]:
        return {}

    @cached_property
    def _bias(self) -> Sequence[tuple[Vec, Vec]]:
        return accelerations(self.motion, [0] * len(self.motion.state.u))

    def of(self, element: LawElement) -> dict[str, S]:
        """Return the forces of an element by component: the pressing one, then friction, in space of two parts."""
        parts = [part for part in element.frictions if part.rubs]
        found: dict[str, S] = {}
        if element.unilateral:
            found[PRESSING[element.kind]] = self.normal(element)
        elif parts and not parts[0].norm:
            found["normal"] = self.pressing(element, parts[0])
        acts = is_active(self.mechanism, element)
        for part in parts:
            forces = self.friction(part) if acts else [0 for _ in part.rows]
            found |= dict(zip(component_names(element, part), forces, strict=True))
        return found

    def presses_at(self, elements: Iterable[LawElement]) -> list[tuple[S, Vec]]:
        """Return the normal force of each element that acts, and where; nothing if one of them acts at no point."""
        acts = [element for element in elements if is_active(self.mechanism, element)]
        found = [(self.normal(x), at) for x in acts if (at := self.place(x)) is not None]
        return found if len(found) == len(acts) else []

    def place(self, element: LawElement) -> Vec | None:
        """Return where a contact's force acts (m, world axes): at its point, or nearest on a round surface."""
        skins = element.normals[0].surfaces
        if skins is None:
            return None
        point = next((skin.place for skin in skins if is_point(skin)), None)
        return touch(skins, self.motion, self._bias).place if point is None else position(self.motion, point)

    def middle(self, elements: Sequence[LawElement]) -> dict[str, S]:
        """Return where the sum of normal forces acts, the middle of elements that do not press; nothing without points.

        A sum of normal forces that vanishes only as an expression has no place, but a division by zero.
        """
        pairs = self.presses_at(elements)
        if self.mechanism.mode_numbers:  # ones where none of the elements acts
            acts = [ModeNodes(self.mechanism).acts(x.normals[0]) for x in elements if self.place(x) is not None]
            some = reduce(maximum, acts, ZERO)
            pairs = [(where(less(ZERO, some), force, ONE), at) for force, at in pairs]
        elif all(isinstance(force, (int, float)) and force == 0 for force, _ in pairs):
            pairs = [(1, at) for at in map(self.place, elements) if at is not None]
        total: S = reduce(operator.add, (force for force, _ in pairs), 0)
        sums = (reduce(operator.add, (force * at[k] for force, at in pairs)) for k in range(len(AT)) if pairs)
        return {name: x / total for name, x in zip(AT, sums, strict=False)}

    def component(self, name: str, component: str) -> S:
        """Return a component by the names of `exerted_by`, of a contact's corners together; 0 where there is none."""
        if component in AT:
            return self.middle([x for x in self.mechanism.one_way if name in exerted_by(x)])[component]
        rows = max((len(exerted_by(x).get(name, {}).get(component, ())) for x in self.mechanism.one_way), default=0)
        if rows > 1:
            return limits.length([self.component(name, f"{component}_{k}") for k in range(1, rows + 1)])
        own = (self._component_of(element, name, component) for element in self.mechanism.one_way)
        return reduce(operator.add, own, 0)

    def _component_of(self, element: LawElement, name: str, component: str) -> S:
        if name not in exerted_by(element):
            return 0
        part = next((x for x in element.frictions if x.name == name and not element.unilateral), None)
        if part is None:
            return self.of(element).get(component, 0)
        if component == PRESSING[element.kind]:
            return self.pressing(element, part)
        return dict(zip(components_of(part, FRICTION), self.friction(part), strict=True))[component]


# ----------------------------------------------------------------------------------------------------------------------
# Switching functions of a mode: each becomes positive where the mode ends.
#
#     event                                        function
#     an open contact or slack rope, or one that
#     touches without a force, closes              -gap, over a face that ends; of a row of speeds -phidot
#     two points are nearest, and perhaps meet     r . v, of one from the other, at corners less a small rate
#     a closed contact, a taut rope opens          -(normal force, tension)
#     a reaction that presses changes its side     -side * reaction, from no side |reaction|
#     a closed contact gets past an edge           -(way to the edge)
#     a rim that touches has come nearly flat      s . s', s across it and its plane, near s = 0
#     a sticking part slips                        |l_t| - static * N
#     a sliding part stops, in a line              -sense * v_t
#     a sliding part stops, in space               -|v_t|, from rest where its friction has no direction
#     slip from rest in space goes on              v_t along the direction in which it started, beyond a margin
#     slip from rest in space turns back           the same, negative
#
# Functions of forces and of slip in space come first and keep steps short: forces may change where nothing moves, and
# slip in space stops where its friction has no direction.


Ends = Literal[
    "closes", "opens", "leaves", "lies flat", "turns", "slips", "stops", "stops in space", "moves on", "turns back"
]  # fmt: skip

ENDS: Final[Mapping[Kind, Ends]] = {
    "force": "opens", "gap": "closes", "side": "turns", "cone": "slips", "slip": "stops"
}  # fmt: skip
_STILL: Final = 1e-6
"""The rate (1/s) of r . v / r^2 below which a corner that lies on another body does not move but for rounding."""
_TOLD: Final = {"leaves": "gets past an edge", "turns": "presses on the other side", "stops in space": "stops"}


@dataclass(frozen=True)
class Switching(Limit):
    """A switching function: the event where a limit is passed, or near it."""

    ends: Ends = "opens"

    @property
    def limits(self) -> bool:
        """Whether it is a function of forces."""
        return self.kind in OF_FORCES

    @property
    def shortens(self) -> bool:
        """Whether it keeps adaptive steps short: beyond the end of slip in space friction would reverse."""
        return self.limits or self.ends == "stops in space"

    @property
    def told(self) -> str:
        """What the element does there, for people."""
        return _TOLD.get(self.ends, self.ends)


def switchings(mechanism: Mechanism) -> tuple[Switching, ...]:
    """Return the switching functions of a mechanism in a mode, those that keep steps short first; none without one."""
    if mechanism.mode is None:
        return ()
    every = [one for element in mechanism.one_way for one in switchings_of(mechanism.mode, element)]
    return tuple(sorted(every, key=lambda one: not one.shortens))


def switchings_of(mode: Mode, element: LawElement) -> Iterator[Switching]:
    """Yield the switching functions of an element in a mode."""
    if element.unilateral and element.name in mode.idle and not mode.acts(element):  # it takes no part
        return
    for limit in limits_in(mode, element):
        part = limit.part
        in_space = part is not None and limit.kind == "slip" and len(part.rows) > 1
        yield Switching(**vars(limit), ends="stops in space" if in_space else ENDS[limit.kind])
        if limit.kind == "force" and has_end(element):
            yield Switching("gap", element, ends="leaves")
        if limit.kind == "force" and has_rim(element):
            yield Switching("gap", element, ends="lies flat")
        if in_space and part is not None and part.name in mode.directions:
            yield from (Switching("slip", element, part, ends=ends) for ends in ("moves on", "turns back"))


@dataclass(frozen=True, eq=False)
class SwitchingValues(LawForces):
    """Switching functions over a scalar, from the motion and the multipliers of a mechanism in a mode."""

    def values(self, functions: Sequence[Switching]) -> list[S]:
        return [self._value(one) for one in functions]

    def _value(self, one: Switching) -> S:
        of_normal = {"closes": self.closes, "leaves": self.leaves, "lies flat": self.lies_flat}
        if one.ends in of_normal:
            return of_normal[one.ends](one.element.normals[one.normal])
        if one.ends in ("moves on", "turns back", "stops in space"):
            assert one.part is not None
            return self._in_space(one.ends, one.part)
        return -self.value(one, lambda row: self.row(row).phidot)

    def side(self, element: LawElement, normal: Row) -> int:
        """Return the sign of the force of a normal row, 0 where it has none yet: it may press either way."""
        return ACTIVE if element.unilateral else self.mode.side(element, normal)

    def closes(self, row: Row) -> S:
        """Return the function that becomes positive where a row touches that does not act."""
        skins = row.surfaces
        if skins is not None and row.tip is not None:
            away, rate = separation(self.motion, skins[0].place, skins[1].place)
            parting = dot(away, rate)
            return parting - _STILL * dot(away, away) if row.tip.corner else parting
        apart = self.row(row).zero if skins is None else gap(skins, self.motion)
        return reduce(minimum, reach(row, self.motion), -apart)

    def leaves(self, row: Row) -> S:
        """Return the function that becomes positive where a contact gets past an edge."""
        return -reduce(minimum, reach(row, self.motion))

    def lies_flat(self, row: Row) -> S:
        """Return the function that becomes positive where a rim that touches is nearest to lying flat."""
        return rim_flatness(row, self.motion)

    def _in_space(self, ends: Ends, part: FrictionPart) -> S:
        speeds = [self.row(row).phidot for row in part.rows]
        if ends == "stops in space":
            sliding = next((sliding for _, sliding in self.slidings(part)), None)
            return -length(speeds if sliding is None else slip_velocity(sliding, speeds, self.motion))
        return (1 if ends == "moves on" else -1) * along(self.begins(part), speeds)
