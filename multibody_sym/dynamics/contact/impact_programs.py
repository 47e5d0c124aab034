"""The Program of an impact: (t, q, u, parameters) -> u after, impulses of its rows, impulses in joints.

What strikes is decided beforehand. Of one contact that rubs in a plane the Program goes all ways itself, by each law of
restitution (`plane_course`). Elsewhere it is in one mode, in which Newton's coefficient, by which all laws are the same
there, reverses the normal speeds, and tells whether that mode `holds`. Trees of like bodies are scanned (`scanned`),
all others are written out.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from multibody_sym.contact_laws.impact_problem import ImpactLaw, ImpactResult
from multibody_sym.dynamics.contact.contact_problem import accelerations_of
from multibody_sym.dynamics.contact.impact_problem import (
    Blow,
    StruckRows,
    both_ways,
    friction_parts,
    plane_contact,
    plane_course,
    plane_element,
    struck_rows,
)
from multibody_sym.dynamics.formalisms.articulated_body import eliminate_joint
from multibody_sym.dynamics.formalisms.composite_body import composite_body, wrench_difference, wrench_sum
from multibody_sym.dynamics.formalisms.constrained import solve_constrained
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.formalisms.inertia import about_origin, articulated_inertia
from multibody_sym.dynamics.programs.quantities import column
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.programs.repeated_bodies import (
    BodyKind,
    pack_inertia,
    unpack_inertia,
    vectors,
)
from multibody_sym.dynamics.programs.system import friction_of, worth_scanning
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.impacts import after_impact, impact_mechanism, state_in_impact
from multibody_sym.mechanics.law_elements import JumpRow, LawElement, MeetingRow
from multibody_sym.mechanics.load_records import BodyTorque, PointForce
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    arrays,
    body_mass,
    body_motion,
    body_pose,
    from_parent,
    motion_of,
    moving_parent,
    pose,
    slot_state,
)
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, to_parent
from multibody_sym.mechanics.row_kinematics import acting_rows, coefficients, row_motions
from multibody_sym.mechanics.row_records import Row
from multibody_sym.model.fields import Point
from multibody_sym.model.system import with_expressions
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Solve
from multibody_sym.program.trace import Trace
from multibody_sym.program.tree_passes import Bodies, Pass, Result, Values, scan_tree
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves, where
from multibody_sym.scalars.functions import absolute, maximum, sqrt, substitute
from multibody_sym.scalars.limits import room
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, less, slot
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    apply,
    apply_transposed,
    cross,
    dot,
    product,
    scale,
    subtract,
    transpose,
)
from multibody_sym.text.printer import COMPONENTS

# ----------------------------------------------------------------------------------------------------------------------
# The Program of an impact on a tree of like bodies, by scans: linear in the bodies, with one kernel for each kind.
#
# Given impulses, and a unit impulse of each row that strikes, are columns of right sides of one recursion: inward
# articulated inertias and the remaining impulses, outward the jumps, and with them the impulses in joints. The impulses
# that strike are solved for at the end, from the power of each row's impulse in all columns; then columns are added up.


@dataclass(frozen=True)
class _Push:
    """A wrench of a column on one body: a force at a `point` (body axes) or a moment, along ground's axes.

    Without a column it does not act, and gives a power alone.
    """

    column: int | None
    row: int | None
    vector: Point
    point: Point | None
    factor: Node = ONE


Speeds = Mapping[str, S]
Judge = Callable[[Speeds, Speeds, Speeds], Sequence[Node]]
"""From the impulses of rows and their speeds as they strike and afterwards, by name, to values positive in a mode."""


def scanned_impact(blow: Blow, struck: StruckRows, judge: Judge) -> Program | None:
    """Return the Program of a tree of like bodies that strikes, or is pushed, at points; None for others.

    Its output `holds` are the values of `judge`, for the rows that strike and those that are watched.
    """
    if blow.mechanism.rows or blow.impact.jumps or struck.joints or struck.given:
        return None
    like = worth_scanning(replace(impact_mechanism(blow.mechanism, ()), bodies=blow.mechanism.bodies))
    rows = [row.of for row in struck.mechanism.rows if isinstance(row, JumpRow)]
    # rows without an impulse of their own whose speeds decide whether a mode holds
    seen = {x.normals[0].name: x.normals[0] for x in blow.elements if x not in struck.acting}
    own = {row.name for row in struck.mechanism.rows}
    along = (row for x in struck.acting for part in friction_parts(x) for row in part.rows)
    seen |= {row.name: row for row in along if row.name not in own}
    pushes = _pushes(blow, rows, seen) if like is not None else None
    if like is None or pushes is None:
        return None
    return _Scan(blow, struck, like.kinds, like.bodies, pushes, len(rows), tuple(seen), judge).program()


def _pushes(blow: Blow, rows: Sequence[Row], seen: Mapping[str, Row]) -> dict[int, list[_Push]] | None:
    """Return the pushes on each body: given impulses in column 0, then the rows; None where one has another form.

    Rows that are only `seen` have no column.
    """
    found: dict[int, list[_Push]] = {}
    for load in blow.impact.loads:
        if isinstance(load, PointForce) and load.axes < 0:
            found.setdefault(load.at.body, []).append(_Push(0, None, load.value, load.at.pose.position))
        elif isinstance(load, BodyTorque) and load.axes < 0:
            found.setdefault(load.body, []).append(_Push(0, None, load.value, None))
        else:
            return None
    for k, row in enumerate((*rows, *seen.values())):
        parts: list[tuple[Row, Node, int | None]] = [(row.plain, ONE, k)]
        for friction in row.sliding:
            parts += [(along, as_node(-friction.sense * friction.coefficient), None) for along in friction.rows]
        for part, factor, measured in parts:
            if not isinstance(part, MeetingRow) or part.frame.body >= 0:
                return None
            if any(leaf.data[0] != "parameters" for leaf in leaves([*part.axis, factor], "slot")):
                return None
            for end, sense in zip(part.ends, (ONE, as_node(-1)), strict=True):
                if end.body >= 0:
                    column, point = k + 1 if k < len(rows) else None, end.pose.position
                    push = _Push(column, measured, part.axis, point, as_node(sense * factor))
                    found.setdefault(end.body, []).append(push)
    return found


@dataclass(frozen=True, eq=False)
class _Scan:
    blow: Blow
    struck: StruckRows
    kinds: Sequence[BodyKind]
    bodies: Bodies
    pushes: Mapping[int, list[_Push]]
    rows: int
    seen: tuple[str, ...]
    judge: Judge

    @property
    def measured(self) -> int:
        """The number of rows with an output speed."""
        return self.rows + len(self.seen)

    @property
    def columns(self) -> int:
        return self.rows + 1

    def program(self) -> Program:
        base = self.blow.mechanism
        trace = Trace("impact", arrays(base))
        given = [trace[array.name] for array in trace.inputs]
        kinds, pushed, bodies = self._struck_kinds()
        parents, c = tuple(body.parent for body in base.bodies), self.columns
        flat = tuple(as_node(x) for row in UNIT_MATRIX for x in row)
        passes = [
            Pass("motion", parents, 18, (*(ZERO,) * 6, *flat, *(ZERO,) * 3)),
            Pass("carried", parents, 6 * c + 21),
            Pass("reached", parents, 6 * c, (ZERO,) * (6 * c)),
        ]
        count = len(base.bodies)
        first = tuple(min(body.u, default=0) for body in base.bodies)
        once = (0,) * count
        results = [Result(_array_name("jump", j), len(base.speeds), first) for j in range(c)]
        results += [Result(_array_name("told", j), 6 * count, tuple(range(0, 6 * count, 6))) for j in range(c)]
        results += [Result(_array_name("power", k), c + 1, once, adds=True) for k in range(self.measured)]
        found = scan_tree(trace, given, bodies, passes, results, partial(self._step, kinds, pushed))
        powers = [found[_array_name("power", k)] for k in range(self.measured)]
        impulses = self._impulses(trace, powers[: self.rows])
        after, joints = self._added(trace, found, impulses, first)
        holds = self._holds(impulses, powers)
        return trace.finish(
            {
                "after": column(after),
                "impulses": column(impulses),
                "joints": ((count, len(COMPONENTS)), joints),
                "holds": column(holds),
            }
        )

    def _holds(self, impulses: Sequence[Node], powers: Sequence[Sequence[Node]]) -> list[Node]:
        names = [row.name for row in self.struck.mechanism.rows]
        first: list[S] = [power[self.columns] + power[0] for power in powers]
        after: list[S] = [
            sum((p * x for p, x in zip(impulses, power[1 : self.columns], strict=True)), v)
            for v, power in zip(first, powers, strict=True)
        ]
        speeds = [dict(zip((*names, *self.seen), each, strict=True)) for each in (first, after)]
        return list(self.judge(dict(zip(names, impulses, strict=True)), *speeds))

    def _struck_kinds(self) -> tuple[list[BodyKind], dict[int, list[_Push]], Bodies]:
        """Return the kinds with one more for each body that is struck, the pushes of these, and the bodies."""
        kinds, pushed = list(self.kinds), dict[int, list[_Push]]()
        chosen, all_leaves, atoms = list(self.bodies.kinds), list(self.bodies.leaves), list(self.bodies.atoms)
        for body, pushes in self.pushes.items():
            known = dict(zip(atoms[body], all_leaves[chosen[body]], strict=True))
            nodes = [x for push in pushes for x in (*push.vector, *(push.point or ()), push.factor)]
            for leaf in leaves(nodes, "slot"):
                if leaf not in known:
                    there = [x.data[1] for x in known.values() if x.data[0] == leaf.data[0]]
                    known[leaf] = slot(leaf.data[0], 1 + max(there, default=-1))
            pushed[len(kinds)] = [with_expressions(push, partial(substitute, meant=known)) for push in pushes]
            kind = kinds[chosen[body]]
            state = State(Node, kind.state.q, kind.state.u, {leaf: leaf for leaf in known.values()})
            chosen[body], atoms[body] = len(kinds), tuple(known)
            all_leaves.append(tuple(known.values()))
            kinds.append(BodyKind(kind.mechanism, state))
        return kinds, pushed, Bodies(tuple(chosen), tuple(all_leaves), tuple(atoms))

    def _step(self, kinds: Sequence[BodyKind], pushed: Mapping[int, list[_Push]], number: int, read: Values) -> Values:
        """Return the values that a body hands on, and its jumps, impulses and powers in all columns."""
        kind, c = kinds[number], self.columns
        body, state = kind.body, kind.state
        w, v, x, y, z, p = vectors(read["motion"])
        moved = body_motion(body, moving_parent(w, v, ZERO_VECTOR), state)
        R_WB, p_WB = body_pose(moved, ((x, y, z), p))
        own, measured = _wrenches(pushed.get(number, []), R_WB, c, self.measured)
        carried = unpack_inertia(read["carried"][6 * c :])
        inertia = articulated_inertia(about_origin(body_mass(body, state))).plus(carried)
        joint, left = eliminate_joint(body.u, moved, inertia)
        turn = product(transpose(pose(state, body.frame_on_parent)[0]), moved.R_PB)
        point = pose(state, body.frame_on_body)[1]  # of the joint
        handed, jumps, in_joint, here = list[Node](), {}, {}, list[Wrench]()
        for j in range(c):
            force, moment = vectors(read["carried"][6 * j : 6 * j + 6])
            wrench = wrench_sum(own[j], (force, moment))
            remaining, on = joint.inward([0] * len(body.u), wrench)
            up = to_parent(moved, on)
            handed += [*map(as_node, (*up[0], *up[1]))]
            a, alpha = vectors(read["reached"][6 * j : 6 * j + 6])
            rates = joint.pivot.solve(remaining)
            jumps[_array_name("jump", j)], reached = joint.outward(rates, from_parent(moved, (a, alpha)))
            here.append(reached)
            force, moment = wrench_difference(inertia.wrench(*reached), wrench)
            in_joint[_array_name("told", j)] = [
                *apply(turn, force), *apply(turn, subtract(moment, cross(point, force)))
            ]  # fmt: skip
        twists: list[Wrench] = [*here, (moved.v_WB, moved.w_WB)]
        return {
            "motion": (*moved.w_WB, *moved.v_WB, *(x for row in R_WB for x in row), *p_WB),
            "carried": (*handed, *pack_inertia(left.moved(moved.R_PB, moved.p_PB))),
            "reached": [x for a, alpha in here for x in (*a, *alpha)],
            **jumps,
            **in_joint,
            **{
                _array_name("power", k): [dot(force, v) + dot(moment, w) for v, w in twists]
                for k, (force, moment) in enumerate(measured)
            },
        }

    def _impulses(self, trace: Trace, powers: Sequence[Sequence[Node]]) -> list[Node]:
        """Return the impulses p of the rows: they reverse the speeds that given impulses have left."""
        c = self.columns
        bounce = {x.normals[0].name: x.restitution for x in self.struck.acting}
        right, matrix = [], []
        for row, power in zip(self.struck.mechanism.rows, powers, strict=True):
            right.append(as_node(-(1 + bounce.get(row.name, ZERO)) * (power[c] + power[0])))
            matrix.append(list(power[1:c]))
        if len(right) == 1:
            return [right[0] / matrix[0][0]]
        return list(trace.solve(matrix, right, len(right)).solution) if right else []

    def _added(
        self, trace: Trace, found: Mapping[str, Sequence[Node]], impulses: Sequence[Node], first: Sequence[int]
    ) -> tuple[list[Node], list[Node]]:
        """Return the speeds after, and the impulses in joints, by another scan."""
        base, c = self.blow.mechanism, self.columns
        names = [_array_name("jump", j) for j in range(c)] + [_array_name("told", j) for j in range(c)]
        given = [trace["u"], *(found[name] for name in names), tuple(impulses)]
        sizes = sorted({len(body.u) for body in base.bodies})
        kinds = tuple(sizes.index(len(body.u)) for body in base.bodies)
        of_impulses = [slot("impulse", j) for j in range(c - 1)]
        all_leaves = []
        for size in sizes:
            speeds = [slot("u", i) for i in range(size)]
            jumps = [slot(_array_name("jump", j), i) for j in range(c) for i in range(size)]
            wrenches = [slot(_array_name("told", j), i) for j in range(c) for i in range(6)]
            all_leaves.append((*speeds, *jumps, *wrenches, *of_impulses))
        atoms = []
        for k, body in enumerate(base.bodies):
            places = range(first[k], first[k] + len(body.u))
            own = [given[0][i] for i in places]
            own += [given[1 + j][i] for j in range(c) for i in places]
            own += [given[1 + c + j][6 * k + i] for j in range(c) for i in range(6)]
            atoms.append((*own, *impulses))
        results = [
            Result("after", len(base.speeds), tuple(first)),
            Result("joints", 6 * len(atoms), tuple(range(0, 6 * len(atoms), 6))),
        ]

        def step(number: int, read: Values) -> Values:
            def total(name: str, i: int) -> Node:
                return sum((w * slot(_array_name(name, j), i) for j, w in enumerate([ONE, *of_impulses])), ZERO)

            after = [slot("u", i) + total("jump", i) for i in range(sizes[number])]
            return {"after": after, "joints": [total("told", i) for i in range(6)]}

        summed = scan_tree(trace, given, Bodies(kinds, tuple(all_leaves), tuple(atoms)), [], results, step)
        return list(summed["after"]), list(summed["joints"])


def _array_name(word: str, number: int) -> str:
    return f"{word}_{''.join(chr(ord('a') + int(digit)) for digit in str(number))}"


def _wrenches(pushes: Sequence[_Push], R_WB: Mat, columns: int, rows: int) -> tuple[list[Wrench], list[Wrench]]:
    """Return the wrench of each column on a body, and the wrench whose power is the speed of each row (body axes)."""
    own, measured = [NO_WRENCH] * columns, [NO_WRENCH] * rows
    for push in pushes:
        vector = scale(push.factor, apply_transposed(R_WB, push.vector))
        wrench = (ZERO_VECTOR, vector) if push.point is None else (vector, cross(push.point, vector))
        if push.column is not None:
            own[push.column] = wrench_sum(own[push.column], wrench)
        if push.row is not None:
            measured[push.row] = wrench_sum(measured[push.row], wrench)
    return own, measured


# ----------------------------------------------------------------------------------------------------------------------

AGREE: Final = 1e-9
"""How near a Program comes to what the laws find, relative to the largest jump of a speed."""


@dataclass(frozen=True)
class StruckMode:
    """An impact in a mode: its setup, the rows that act, and the jump of each, over any scalar (`wanted`)."""

    blow: Blow
    rows: StruckRows
    law: ImpactLaw = "newton"

    @property
    def told(self) -> tuple[str, ...]:
        """The names of the rows whose impulses are outputs: those of the mechanism at rest."""
        return self.blow.names if self.goes_all_ways else self.acting

    @property
    def acting(self) -> tuple[str, ...]:
        return tuple(row.name for row in self.rows.mechanism.rows)

    @cached_property
    def goes_all_ways(self) -> bool:
        """Whether the Program decides how it slips."""
        return plane_element(self.blow) is not None and self.scanned is None

    @cached_property
    def scanned(self) -> Program | None:
        """The Program for a tree of like bodies, None for others."""
        return scanned_impact(self.blow, self.rows, self._judged)

    @property
    def key(self) -> Hashable:
        """By what modes of one impact differ."""
        return tuple(x.name for x in self.rows.acting), tuple(sorted(self.rows.mode.slips.items())), self.acting

    @property
    def is_only_one(self) -> bool:
        """Whether no other state has another mode: one element without friction strikes, or its slip is followed."""
        free = not self.blow.rough and not any(map(friction_parts, self.blow.elements))
        return self.goes_all_ways or (free and len(self.blow.elements) <= 1)

    @property
    def words(self) -> dict[str, str]:
        """The states of elements by name, `open` where one is not struck; none where the Program decides them."""
        if self.goes_all_ways:
            return {}
        sides = {x.name: int(x in self.rows.acting) for x in self.blow.elements} | dict(self.rows.mode.sides)
        return mode_words((*self.blow.elements, *self.blow.rough), replace(self.rows.mode, sides=sides))

    @cached_property
    def needed(self) -> tuple[tuple[str, str], ...]:
        """The kind and the words of each value that is positive where the mode holds, in the order of `holds`."""
        first = None if self.scanned is None else dict[str, S]()
        return tuple((kind, words) for kind, words, _ in self._needed({}, {}, None, first))

    def _judged(self, impulses: Mapping[str, S], first: Mapping[str, S], after: Mapping[str, S]) -> list[Node]:
        """Return values positive where the mode of a scanned tree holds; `first` are the speeds as it strikes."""
        return [as_node(x) for _, _, x in self._needed(impulses, after, None, first)]

    def _needed(
        self,
        impulses: Mapping[str, S],
        after: Mapping[str, S],
        motion: Motion | None,
        first: Mapping[str, S] | None = None,
    ) -> Iterator[tuple[str, str, S]]:
        for element in self.blow.elements:
            normal = element.normals[0].name
            if first is None and self.goes_all_ways:
                if element.tangential_restitution is not ZERO:
                    yield "speed", f"{element.name} is struck once", after.get(normal, ZERO)
                continue
            if element not in self.rows.acting:
                yield "speed", f"{element.name} is not struck", after.get(normal, ZERO)
                continue
            yield "impulse", f"{element.name} is struck", impulses.get(normal, ZERO)
            yield from self._slipping(element, impulses, after, motion, first)
        for element in self.rows.rough:
            yield from self._slipping(element, impulses, after, motion)

    def _slipping(
        self,
        element: LawElement,
        impulses: Mapping[str, S],
        after: Mapping[str, S],
        motion: Motion | None,
        first: Mapping[str, S] | None = None,
    ) -> Iterator[tuple[str, str, S]]:
        normal = element.normals[0].name
        for part in friction_parts(element):
            slip, names = self.rows.mode.slip(part), [row.name for row in part.rows]
            if slip:
                yield "speed", f"{part.name} slips as at the start", slip * after.get(names[0], ZERO)
                if first is not None:
                    yield "speed", f"{part.name} slips so at first", slip * first.get(names[0], ZERO)
            elif element.unilateral and not set(names) & set(self.acting):  # it does not slip, though no row holds it
                after_all = [after.get(name, ZERO) for name in names]
                yield "speed", f"{part.name} rests", -sum((absolute(x) for x in after_all), ZERO)
            elif not part.enough and element.unilateral and part.normals == (0,):
                static: S = coefficients(motion, part.rows, [part.static])[0] if motion else part.static
                along = [impulses.get(name, ZERO) for name in names]
                if len(along) > 1:  # its slope is 0 where it is, as that of |x|: the square has a kink there
                    along = [sqrt(maximum(sum((x * x for x in along), ZERO), ZERO))]
                yield "impulse", f"{part.name} sticks", room(static, impulses.get(normal, ZERO), along)

    def wanted(self, before: Motion, pushed: Motion) -> dict[int, S]:
        """Return the jumps of rows: normal speeds are reversed, rows that stick or begin stop, motions jump as given.

        `pushed` is the motion after given impulses and rows that begin or jump: then contacts strike.
        """
        first, then = (_speeds(motion) for motion in (before, pushed))
        bounce = {x.normals[0].name: x.restitution for x in self.rows.acting}
        found = self.own(before)
        for k, name in list(enumerate(self.acting))[self.first :]:
            (e,) = before.state.values([bounce.get(name, ZERO)])
            found[k] = -(1 + e) * first[name] if pushed is before else -first[name] - e * then[name]
        return found

    @property
    def first(self) -> int:
        """The number of the first row that strikes."""
        return len(self.blow.mechanism.rows)

    @property
    def alone(self) -> Mechanism:
        """The mechanism at rest in which no contact strikes."""
        return self.blow.resting(self.rows.joints)

    def joined(self, before: Motion) -> dict[int, S]:
        """Return the jumps of the rows where no contact strikes: joints that stick stop."""
        first, found = _speeds(before), self.own(before)
        return found | {k: -first[row.name] for k, row in enumerate(self.rows.joints, self.first)}

    def own(self, before: Motion) -> dict[int, S]:
        """Return the jumps of the mechanism's own rows."""
        by = {jump.row: jump.by for jump in self.blow.impact.jumps if jump.row}
        first, found = _speeds(before), dict[int, S]()
        for k, row in enumerate(self.blow.mechanism.rows):
            if row.name in by:
                found[k] = before.state.values([by[row.name]])[0]
            else:
                found[k] = -first[row.name] if row.name in self.blow.jumping else ZERO
        return found

    def holding(
        self, impulses: Mapping[str, S], before: Motion, jumps: Sequence[S]
    ) -> Iterator[tuple[str, str, S]]:
        """Yield the kind, the words and the value of each condition, positive where the mode holds."""
        return self._needed(impulses, _speeds(self.pushed(before, jumps)), before)

    @property
    def pushes(self) -> bool:
        """Whether impulses are given, or rows begin or jump, before contacts strike."""
        impact = self.blow.impact
        return bool(self.rows.acting) and bool(impact.loads or impact.begins or impact.jumps)

    def pushed(self, before: Motion, jumps: Sequence[S]) -> Motion:
        """Return the motion after jumps of the speeds."""
        u = [a + b for a, b in zip(before.state.u, jumps, strict=True)]
        return motion_of(before.mechanism, after_impact(before.state, u))


def _speeds(motion: Motion) -> dict[str, S]:
    names = (row.name for row in motion.mechanism.rows)
    return {name: row.phidot for name, row in zip(names, row_motions(motion), strict=True)}


def mode_found(blow: Blow, struck: ImpactResult, law: ImpactLaw) -> StruckMode:
    """Return the mode in which an impact was found. Raises NoSolutionError where several follow each other."""
    if struck.impacts > 1:
        raise NoSolutionError(
            f"{struck.impacts} impacts follow each other here, and a function has one mode; write sequence: "
            "simultaneous, or let solve tell each",
            where=Where(path=("impact", "sequence")),
            number="N108",
        )
    return StruckMode(blow, struck_rows(blow, struck), law)


def verify_mode(mode: StruckMode, after: Floats, struck: ImpactResult) -> None:
    """Raise NoSolutionError where the Program of a mode finds other speeds after the impact (nu,) than its laws."""
    blow = mode.blow
    jumps, before = accelerations_of(blow.dynamics, struck.x), np.array(blow.state.u, dtype=float)
    if np.abs(after - before - jumps).max(initial=0.0) > AGREE * max(np.abs(jumps).max(initial=0.0), 1e-300):
        raise NoSolutionError(
            "slip stops or turns round during this impact of several contacts, in joints or in space, which a function "
            "of one mode does not follow; solve tells it, and law: newton has one mode where it sticks in the end",
            where=Where(path=("impact",)),
            number="N108",
        )


def impact_program(mode: StruckMode) -> Program:
    """Return (t, q, u, ...) -> after (nu,), impulses (rows,), joints (joints, 6), perhaps holds (`needed`).

    Impulses are in the order of `told`, those in joints in that of the mechanism's `joint_names`, as fx .. mz.
    """
    if mode.scanned is not None:
        return mode.scanned
    element = plane_element(mode.blow)
    trace = Trace("impact", arrays(mode.blow.mechanism))
    before = pushed = mode.blow.before(slot_state(mode.blow.mechanism))
    if element is not None:
        mechanism, state = _in_a_plane(trace, mode, element, before)
    else:
        mechanism = mode.rows.mechanism
        if mode.pushes:
            alone = composite_body(mode.alone, state_in_impact(before.state, mode.joined(before)))
            pushed = mode.pushed(before, _solve_impact(trace, alone)[0])
        state = state_in_impact(before.state, mode.wanted(before, pushed))
    dynamics = composite_body(mechanism, state)
    jumps, impulses = _solve_impact(trace, dynamics)
    motion = motion_of(mechanism, state)
    joints = reactions(motion, jumps, dynamics.rows, impulses)
    after = [u + du for u, du in zip(trace["u"], jumps, strict=True)]
    named = dict(zip(mode.told, impulses, strict=True))
    holds = [x for _, _, x in mode.holding(named, before, jumps)]
    names = mode.blow.mechanism.joint_names
    in_joints = [as_node(joints[name][component]) for name in names for component in COMPONENTS]
    return trace.finish(
        {
            "after": column(after),
            "impulses": column(impulses),
            "joints": ((len(names), len(COMPONENTS)), in_joints),
            "holds": column(holds),
        }
    )


def _in_a_plane(trace: Trace, mode: StruckMode, element: LawElement, before: Motion) -> tuple[Mechanism, State]:
    """Return the mechanism at rest, and its state, of one contact with friction in a plane, however it slips."""
    blow, pushed = mode.blow, before
    if mode.pushes:
        alone = composite_body(blow.resting(()), state_in_impact(before.state, mode.own(before)))
        pushed = mode.pushed(before, _solve_impact(trace, alone)[0])

    def jumps_of(mechanism: Mechanism, state: State) -> list[Node]:
        return _solve_impact(trace, composite_body(mechanism, state))[0]

    contact = plane_contact(blow, element, mode.law, (before, pushed), jumps_of)
    closes = less(as_node(contact.v[0]), ZERO)
    pair = [where(closes, as_node(p), ZERO) for p in plane_course(contact, both_ways)]
    mechanism = blow.resting(blow.striking, blow.names[mode.first :])
    return mechanism, state_in_impact(before.state, mode.own(before) | dict(enumerate(pair, mode.first)))


def _solve_impact(trace: Trace, dynamics: TreeDynamics) -> tuple[list[Node], list[Node]]:
    """Return jumps and multipliers; rows that vanish identically take no part."""
    acting = acting_rows(dynamics.rows)
    if not acting:
        return [as_node(x) for x in dynamics.bias_acceleration], [ZERO] * len(dynamics.rows)

    def solve(matrix: Sequence[Sequence[S]], right: Sequence[S], size: int, /, beside: int = 0) -> Solve:
        return trace.solve([list(map(as_node, row)) for row in matrix], [as_node(x) for x in right], size)

    rows = [dynamics.rows[k] for k in acting]
    found = solve_constrained(
        dynamics.factors,
        dynamics.forcing,
        [[as_node(x) for x in row.jacobian] for row in rows],
        [as_node(row.gamma) for row in rows],
        solve,
        friction=friction_of(dynamics, acting),
    )
    multipliers = [ZERO] * len(dynamics.rows)
    for k, value in zip(acting, found.multipliers, strict=True):
        multipliers[k] = as_node(value)
    return [as_node(x) for x in found.udot], multipliers
