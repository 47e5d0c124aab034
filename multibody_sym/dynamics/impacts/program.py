"""The Program of an impact: (t, q, u, parameters) -> u after, impulses of its rows, impulses in joints.

What strikes is decided beforehand. Of one contact that rubs in a plane the Program goes all ways itself, by each law of
restitution (`plane_course`). Elsewhere it is in one mode, in which Newton's coefficient, by which all laws are the same
there, reverses the normal speeds, and tells whether that mode `holds`. Trees of like bodies are scanned (`scanned`),
all others are written out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import constrained
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.impacts.impulsive import Blow, StruckRows, plane_element, rubbing
from multibody_sym.dynamics.impacts.plane_course import both_ways, plane_contact, plane_course
from multibody_sym.dynamics.impacts.problem import ImpactLaw
from multibody_sym.dynamics.impacts.scanned import scanned_impact
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.programs.system import friction_of
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.kinematics.impacts import after_impact, resting
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import acting_rows, coefficients, row_motions
from multibody_sym.kinematics.state import State, arrays, slot_state
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Solve
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import where
from multibody_sym.scalars.functions import absolute
from multibody_sym.scalars.limits import room
from multibody_sym.scalars.node import ZERO, Node, as_node, less
from multibody_sym.scalars.vectors import S


@dataclass(frozen=True)
class StruckMode:
    """An impact in a mode: what strikes, the rows that act, and by how much each jumps, over any scalar (`wanted`)."""

    blow: Blow
    rows: StruckRows
    law: ImpactLaw = "newton"

    @property
    def told(self) -> tuple[str, ...]:
        """The names of the rows whose impulses the Program tells: those of the mechanism at rest."""
        return self.blow.names if self.goes_all_ways else self.acting

    @property
    def acting(self) -> tuple[str, ...]:
        """The names of the rows of the mechanism at rest in the mode."""
        return tuple(row.name for row in self.rows.mechanism.rows)

    @cached_property
    def goes_all_ways(self) -> bool:
        """Whether the Program decides how it slips."""
        return plane_element(self.blow) is not None and self.scanned is None

    @cached_property
    def scanned(self) -> Program | None:
        """The Program for a tree of like bodies, None for others."""
        return scanned_impact(self.blow, self.rows, self._judged)

    @cached_property
    def needed(self) -> tuple[tuple[str, str], ...]:
        """What is positive where the mode holds, in the order of the output `holds`: of what kind, and in words."""
        first = None if self.scanned is None else dict[str, S]()
        return tuple((kind, words) for kind, words, _ in self._needed({}, {}, None, first))

    def _judged(self, impulses: Mapping[str, S], first: Mapping[str, S], after: Mapping[str, S]) -> list[Node]:
        """Return what is positive where the mode holds, of a tree that is scanned; `first` are speeds as it strikes."""
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
        element: OneWay,
        impulses: Mapping[str, S],
        after: Mapping[str, S],
        motion: Motion | None,
        first: Mapping[str, S] | None = None,
    ) -> Iterator[tuple[str, str, S]]:
        normal = element.normals[0].name
        for part in rubbing(element):
            slip, names = self.rows.mode.slip(part), [row.name for row in part.rows]
            if slip:
                yield "speed", f"{part.name} slips as at the start", slip * after.get(names[0], ZERO)
                if first is not None:
                    yield "speed", f"{part.name} slips so at first", slip * first.get(names[0], ZERO)
            elif element.unilateral and not set(names) & set(self.acting):  # it does not slip, though nothing holds it
                after_all = [after.get(name, ZERO) for name in names]
                yield "speed", f"{part.name} rests", -sum((absolute(x) for x in after_all), ZERO)
            elif not part.enough and element.unilateral and part.normals == (0,):
                static: S = coefficients(motion, part.rows, [part.static])[0] if motion else part.static
                along, N = [impulses.get(name, ZERO) for name in names], impulses.get(normal, ZERO)
                yield "impulse", f"{part.name} sticks", room(static, N, along)

    def wanted(self, before: Motion, pushed: Motion) -> dict[int, S]:
        """Return the jumps of rows: normal speeds are reversed, what sticks or begins stops, motions jump as given.

        `pushed` is the motion that given impulses, and what begins or jumps, leave of that: then contacts strike.
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
        """Return the jumps of the rows where no contact strikes: what sticks in a joint stops."""
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
        """Yield what is to be positive for the mode to hold: of what kind, in words, and its value."""
        return self._needed(impulses, _speeds(self.pushed(before, jumps)), before)

    @property
    def pushes(self) -> bool:
        """Whether something happens before contacts strike."""
        impact = self.blow.impact
        return bool(self.rows.acting) and bool(impact.loads or impact.begins or impact.jumps)

    def pushed(self, before: Motion, jumps: Sequence[S]) -> Motion:
        """Return the motion after jumps of the speeds."""
        u = [a + b for a, b in zip(before.state.u, jumps, strict=True)]
        return motion_of(before.mechanism, after_impact(before.state, u))


def _speeds(motion: Motion) -> dict[str, S]:
    names = (row.name for row in motion.mechanism.rows)
    return {name: row.phidot for name, row in zip(names, row_motions(motion), strict=True)}


def impact_program(mode: StruckMode) -> Program:
    """Return (t, q, u, ...) -> after (nu,), impulses (rows,), joints (joints, 6), perhaps holds (`needed`).

    Impulses are in the order of `told`, those in joints in that of the mechanism's `joint_names`, as fx .. mz.
    """
    element = plane_element(mode.blow)
    if mode.scanned is not None:
        return mode.scanned
    return _in_mode(mode) if element is None else _all_ways(mode, element)


def _all_ways(mode: StruckMode, element: OneWay) -> Program:
    """Return the Program of one contact that rubs in a plane."""
    blow, base = mode.blow, mode.blow.mechanism
    trace = Trace("impact", arrays(base))
    before = pushed = blow.before(slot_state(base))
    if mode.pushes:
        alone = composite_body(blow.resting(()), resting(before.state, mode.own(before)))
        pushed = mode.pushed(before, _solved(trace, alone)[0])

    def jumps_of(mechanism: Mechanism, state: State) -> list[Node]:
        return _solved(trace, composite_body(mechanism, state))[0]

    contact = plane_contact(blow, element, mode.law, (before, pushed), jumps_of)
    closes = less(as_node(contact.v[0]), ZERO)
    pair = [where(closes, as_node(p), ZERO) for p in plane_course(contact, both_ways)]
    mechanism = blow.resting(blow.striking, blow.names[mode.first :])
    state = resting(before.state, mode.own(before) | dict(enumerate(pair, mode.first)))
    return _told(trace, mode, before, mechanism, state)


def _in_mode(mode: StruckMode) -> Program:
    """Return the Program of an impact in its mode."""
    mechanism, base = mode.rows.mechanism, mode.blow.mechanism
    trace = Trace("impact", arrays(base))
    before = pushed = mode.blow.before(slot_state(base))
    if mode.pushes:
        alone = composite_body(mode.alone, resting(before.state, mode.joined(before)))
        pushed = mode.pushed(before, _solved(trace, alone)[0])
    return _told(trace, mode, before, mechanism, resting(before.state, mode.wanted(before, pushed)))


def _told(trace: Trace, mode: StruckMode, before: Motion, mechanism: Mechanism, state: State) -> Program:
    """Return the Program with what a mechanism at rest does at a state."""
    dynamics = composite_body(mechanism, state)
    jumps, impulses = _solved(trace, dynamics)
    motion = motion_of(mechanism, state)
    joints = reactions(motion, jumps, dynamics.rows, impulses)
    after = [u + du for u, du in zip(trace["u"], jumps, strict=True)]
    named = dict(zip(mode.told, impulses, strict=True))
    holds = [as_node(x) for _, _, x in mode.holding(named, before, jumps)]
    return finished(trace, after, impulses, joints, mode.blow.mechanism.joint_names, holds)


def finished(
    trace: Trace,
    after: Sequence[Node],
    impulses: Sequence[Node],
    joints: Mapping[str, Mapping[str, S]],
    names: Sequence[str],
    holds: Sequence[Node] | None = None,
) -> Program:
    """Return the Program with its outputs."""
    values = [as_node(joints[name][component]) for name in names for component in COMPONENTS]
    outputs = {
        "after": ((len(after),), list(after)),
        "impulses": ((len(impulses),), list(impulses)),
        "joints": ((len(names), len(COMPONENTS)), values),
    }
    return trace.finish(outputs if holds is None else outputs | {"holds": ((len(holds),), list(holds))})


def _solved(trace: Trace, dynamics: TreeDynamics) -> tuple[list[Node], list[Node]]:
    """Return jumps and multipliers; rows that vanish identically take no part."""
    acting = acting_rows(dynamics.rows)
    if not acting:
        return [as_node(x) for x in dynamics.bias_acceleration], [ZERO] * len(dynamics.rows)

    def solve(matrix: Sequence[Sequence[S]], right: Sequence[S], size: int, /, beside: int = 0) -> Solve:
        return trace.solve([list(map(as_node, row)) for row in matrix], [as_node(x) for x in right], size)

    rows = [dynamics.rows[k] for k in acting]
    found = constrained(
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
