"""The Program of an impact in one mode: (t, q, u, parameters) -> u after, impulses of its rows, impulses in joints.

What strikes, and how it slides, is decided beforehand; Newton's coefficient, by which all laws are the same there,
reverses the normal speeds. Trees of like bodies are scanned (`scanned`), all others are written out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import constrained
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.impacts.impulsive import Blow, StruckRows
from multibody_sym.dynamics.impacts.scanned import scanned_impact
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.programs.system import acting_rows, friction_of
from multibody_sym.kinematics.impacts import after_impact, resting
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.mechanism import COMPONENTS, Mechanism
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Solve
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import ZERO, Node, as_node
from multibody_sym.scalars.vectors import S


@dataclass(frozen=True)
class StruckMode:
    """An impact in a mode: what strikes, the rows that act, and by how much each jumps, over any scalar (`wanted`)."""

    blow: Blow
    rows: StruckRows

    @property
    def told(self) -> tuple[str, ...]:
        """The names of the rows whose impulses the Program tells: those of the mechanism at rest."""
        return tuple(row.name for row in self.rows.mechanism.rows)

    def wanted(self, before: Motion, pushed: Motion) -> dict[int, S]:
        """Return the jumps of rows: normal speeds are reversed, what sticks or begins stops, motions jump as given.

        `pushed` is the motion that given impulses, and what begins or jumps, leave of that: then contacts strike.
        """
        first, then = (_speeds(motion) for motion in (before, pushed))
        bounce = {x.normals[0].name: x.restitution for x in self.rows.acting}
        found = self.own(before)
        for k, name in list(enumerate(self.told))[self.first :]:
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
    """Return (t, q, u, ...) -> after (nu,), impulses (rows,), joints (joints, 6).

    Impulses are in the order of `told`, those in joints in that of the mechanism's `joint_names`, as fx .. mz.
    """
    scanned = scanned_impact(mode.blow, mode.rows)
    if scanned is not None:
        return scanned
    mechanism, base = mode.rows.mechanism, mode.blow.mechanism
    trace = Trace("impact", arrays(base))
    before = pushed = mode.blow.before(slot_state(base))
    if mode.pushes:
        alone = composite_body(mode.alone, resting(before.state, mode.joined(before)))
        pushed = mode.pushed(before, _solved(trace, alone)[0])
    state = resting(before.state, mode.wanted(before, pushed))
    dynamics = composite_body(mechanism, state)
    jumps, impulses = _solved(trace, dynamics)
    motion = motion_of(mechanism, state)
    joints = reactions(motion, jumps, dynamics.rows, impulses)
    after = [u + du for u, du in zip(trace["u"], jumps, strict=True)]
    return finished(trace, after, impulses, joints, base.joint_names)


def finished(
    trace: Trace,
    after: Sequence[Node],
    impulses: Sequence[Node],
    joints: Mapping[str, Mapping[str, S]],
    names: Sequence[str],
) -> Program:
    """Return the Program with its outputs."""
    values = [as_node(joints[name][component]) for name in names for component in COMPONENTS]
    return trace.finish(
        {
            "after": ((len(after),), list(after)),
            "impulses": ((len(impulses),), list(impulses)),
            "joints": ((len(names), len(COMPONENTS)), values),
        }
    )


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
