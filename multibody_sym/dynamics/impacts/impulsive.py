"""An impact of a mechanism in numbers: the problem that its rows pose, and the mechanism at rest that has its impulses.

In: a mechanism, its state before, and which elements touch. `pose` makes the problem of `strike`; `struck_rows` tells
from what became of it which rows act, and by how much each jumps. With these `kinematics.impacts.at_rest` is a
mechanism like any other, whose accelerations, multipliers and reactions are jumps and impulses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.impacts.problem import ImpactLaw, ImpactProblem, Struck
from multibody_sym.dynamics.impacts.problem import Sequence as Order
from multibody_sym.dynamics.laws.assemble import tree_dynamics_of, weighted_rows
from multibody_sym.dynamics.laws.problem import Equality, Friction, FrictionLaw, Law, LawProblem, Unilateral
from multibody_sym.kinematics.impacts import at_rest, jumping_motions, resting, with_meetings
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion, coefficients, row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.impacts import StruckImpacts
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import ZERO, Node

_NOTHING: Final = 1e-13
"""The part of the largest impulse below which one is rounding."""


def rubbing(element: OneWay) -> tuple[FrictionPart, ...]:
    """Return the friction parts of an element that rub at all."""
    return tuple(p for p in element.frictions if p.enough or p.static is not ZERO or p.kinetic is not ZERO)


@dataclass(frozen=True, eq=False)
class Blow:
    """What strikes: a mechanism (its own rows, in no mode), its `state` before, and the `elements` that touch.

    `loads`, `begins` and `jumps` are those of `impact`.
    """

    mechanism: Mechanism
    state: State
    impact: StruckImpacts
    elements: tuple[OneWay, ...]

    @property
    def jumping(self) -> tuple[str, ...]:
        """The mechanism's own rows that jump."""
        begun = (name for names in self.impact.begins.values() for name in names)
        return (*begun, *(jump.row for jump in self.impact.jumps if jump.row))

    @property
    def drives(self) -> dict[str, Node]:
        """The joints whose prescribed rates jump, and by how much."""
        return {jump.joint: jump.by for jump in self.impact.jumps if jump.joint}

    @property
    def striking(self) -> tuple[Row, ...]:
        """All rows of the elements: of each its normal, then those along which it rubs."""
        return tuple(r for x in self.elements for r in (x.normals[0], *(r for p in rubbing(x) for r in p.rows)))

    def before(self, state: State) -> Motion:
        """Return the motion before over the scalar of a state, with all rows that may act."""
        every = replace(self.mechanism, rows=(*self.mechanism.rows, *self.striking))
        motion = motion_of(jumping_motions(every, self.drives), state)
        return replace(motion, state=with_meetings(motion, self.elements))

    def resting(self, striking: Sequence[Row]) -> Mechanism:
        """Return the mechanism of the impact in which some rows strike."""
        return at_rest(
            self.mechanism,
            striking,
            self.impact.loads,
            jumping=self.jumping,
            drives=self.drives,
            elements=self.impact.meetings,
        )

    def bare(self, row: Row) -> Mechanism:
        """Return the mechanism at rest in which one row alone strikes."""
        return at_rest(self.mechanism, [row], elements=self.impact.meetings)

    @cached_property
    def motion(self) -> Motion:
        """The motion before, in floats."""
        return self.before(self.state)

    @cached_property
    def rows(self) -> list[RowMotion]:
        """All rows before, in floats."""
        return row_motions(self.motion)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of all rows."""
        return tuple(row.name for row in self.motion.mechanism.rows)

    @cached_property
    def dynamics(self) -> TreeDynamics:
        """The dynamics of the mechanism at rest with all rows, none of which jumps."""
        none = dict.fromkeys(range(len(self.names)), 0.0)
        return tree_dynamics_of(self.resting(self.striking), resting(self.motion.state, none))

    @cached_property
    def wanted(self) -> Floats:
        """By how much (m) the speed of each own row is to jump; of those that strike nothing is known yet."""
        found = np.zeros(len(self.names))
        begun = {name for names in self.impact.begins.values() for name in names}
        by = {jump.row: jump.by for jump in self.impact.jumps if jump.row}
        for k, name in enumerate(self.names[: len(self.mechanism.rows)]):
            if name in begun:
                found[k] = -float(self.rows[k].phidot)
            elif name in by:
                found[k] = float(self.state.values([by[name]])[0])
        return found


def pose(blow: Blow, law: ImpactLaw, order: Order, coefficients_of: Mapping[str, tuple[float, float]]) -> ImpactProblem:
    """Return the problem of an impact; `coefficients_of` gives each element's restitution, normal and tangential."""
    dynamics = blow.dynamics
    A, C, D, right = weighted_rows(dynamics, dynamics.rows, range(len(dynamics.rows)))
    own = len(blow.mechanism.rows)
    before = np.array([0.0 if k < own else float(row.phidot) for k, row in enumerate(blow.rows)])
    before[:own] -= blow.wanted[:own]
    right = right - before
    laws: list[Law] = [Equality() for _ in blow.names]
    e, tangential, frictions = np.zeros(len(laws)), list[float](), list[FrictionLaw]()
    places = {name: k for k, name in enumerate(blow.names)}
    for element in blow.elements:
        normal = places[element.normals[0].name]
        laws[normal], (e[normal], given_back) = Unilateral(), coefficients_of[element.name]
        for part in rubbing(element):
            rows = tuple(places[row.name] for row in part.rows)
            for component, row in enumerate(rows):
                laws[row] = Friction(len(frictions), component)
            static, kinetic = (float(x) for x in coefficients(blow.motion, part.rows, [part.static, part.kinetic]))
            frictions.append(FrictionLaw(rows, (normal,), static, kinetic, (0.0,) * len(rows), enough=part.enough))
            tangential.append(given_back if part is rubbing(element)[0] else 0.0)
    rows_ = LawProblem(A, C, D, right, tuple(laws), tuple(frictions))
    return ImpactProblem(rows_, e, tuple(tangential), law, order, names=blow.names)


@dataclass(frozen=True, eq=False)
class StruckRows:
    """Which rows act in an impact, of the mechanism at rest, and by how much each jumps (by number).

    `acting` are the elements that strike, `slips` how each friction part slides all the while (0: not so); those
    `along` their rows have impulses of their own there.
    """

    mechanism: Mechanism
    jumps: Mapping[int, float]
    acting: tuple[OneWay, ...]
    slips: Mapping[str, int]


def struck_rows(blow: Blow, struck: Struck) -> StruckRows:
    """Return the mechanism of an impact in the mode in which it was found."""
    places = {name: k for k, name in enumerate(blow.names)}
    acting = tuple(x for x in blow.elements if places[x.normals[0].name] in struck.closed)
    numbers = {part.name: k for k, part in enumerate(p for x in blow.elements for p in rubbing(x))}
    largest = float(np.abs(struck.impulses).max(initial=0.0))
    rows: list[Row] = []
    slips: dict[str, int] = {}
    for element in acting:
        frictions: list[Sliding] = []
        along: list[Row] = []
        for part in rubbing(element):
            course = set(struck.course(numbers[part.name]))
            slips[part.name] = _constant(course)
            if len(part.rows) == 1 and slips[part.name]:
                frictions.append(Sliding(part.rows, part.kinetic, slips[part.name]))
            elif any(abs(struck.impulses[places[row.name]]) > _NOTHING * largest for row in part.rows):
                along += part.rows
        normal = element.normals[0]
        rows += [SlidingRow(normal.name, normal, tuple(frictions)) if frictions else normal, *along]
    mechanism = blow.resting(rows)
    jumps = {k: _jump(blow, struck, places[row.name]) for k, row in enumerate(mechanism.rows)}
    return StruckRows(mechanism, jumps, acting, slips)


def _constant(course: set[int]) -> int:
    """Return the one way in which something slides all the while, 0 where there is none."""
    return next(iter(course)) if course in ({1}, {-1}) else 0


def _jump(blow: Blow, struck: Struck, row: int) -> float:
    """Return by how much the speed of a row changed."""
    if row < len(blow.mechanism.rows):
        return float(blow.wanted[row])
    return float(struck.after[row] - float(blow.rows[row].phidot))
