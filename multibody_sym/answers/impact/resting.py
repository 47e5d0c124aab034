"""The mechanism of an impact, solved as any instant is: in floats, and in closed form as far as there is one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.analysis.struck import PosedImpact
from multibody_sym.answers.closed_form import unknowns
from multibody_sym.answers.instant import Solved, forms_of, undetermined
from multibody_sym.answers.symbolic_start import declared_state
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.dynamics.routes import FORMALISMS
from multibody_sym.dynamics.start.examined import blame_numbers
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.kinematics.impacts import after_impact, before_leaf, resting
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion, friction_factors, row_motions
from multibody_sym.kinematics.state import State, slot_state
from multibody_sym.model.mechanism.impacts import JumpRow, jump_leaf
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.node import ZERO, Node, as_node
from multibody_sym.scalars.vectors import S
from multibody_sym.simulation.recall import formalism_name

_CONTRADICTION: Final = 1e-8
"""The part of the largest jump by which a row may be missed, as for accelerations."""


@dataclass(frozen=True)
class ImpactInstant(Instant):
    """The mechanism of an impact: `motion` at rest, udot the jumps, multipliers the impulses; and what was `before`."""

    before: Motion

    @property
    def after(self) -> list[S]:
        """The speeds after the impact."""
        return [u + du for u, du in zip(self.before.state.u, self.udot, strict=True)]

    @cached_property
    def later(self) -> Motion:
        """The motion after the impact, with all rows that may have acted."""
        return motion_of(self.before.mechanism, after_impact(self.before.state, self.after))

    @cached_property
    def rows_before(self) -> Mapping[str, RowMotion]:
        """All rows before, by name."""
        return _by_name(self.before)

    @cached_property
    def rows_after(self) -> Mapping[str, RowMotion]:
        """All rows after, by name."""
        return _by_name(self.later)


def _by_name(motion: Motion) -> dict[str, RowMotion]:
    return dict(zip((row.name for row in motion.mechanism.rows), row_motions(motion), strict=True))


@dataclass(frozen=True, eq=False)
class Befores:
    """The motion before an impact over floats, over Nodes in the names of the model (`nodes`) and over slots."""

    numbers: Motion
    nodes: Motion
    slots: Motion
    symbolic: SymbolicState


def befores(posed: PosedImpact) -> Befores:
    """Return the motion before an impact over all scalars."""
    blow, begin = posed.blow, posed.begin
    symbolic = declared_state(posed.mechanism, begin)
    return Befores(blow.motion, blow.before(symbolic.state), blow.before(_slots_before(blow.mechanism)), symbolic)


def _slots_before(mechanism: Mechanism) -> State:
    """Return the state in slots with the speeds before the impact."""
    own = slot_state(mechanism)
    u = tuple(before_leaf(k) for k in range(len(own.u)))
    slots = dict(own.slots)
    slots |= {leaf: u[leaf.data[1]] for leaf in own.slots if leaf.data[0] == "u"}
    return State(own.scalar, own.q, u, slots)


Jumps = Callable[[Motion], Mapping[int, Node] | None]
"""From the motion before, over Nodes, to the jumps of rows by number; None where no formula is known."""


def solved_at_rest(
    posed: PosedImpact,
    given: Befores,
    mechanism: Mechanism,
    jumps: Mapping[int, float],
    formula: Jumps,
    formalism: str | None,
    reasons: dict[str, None],
) -> Solved:
    """Return the mechanism of an impact solved, for jumps of its rows in numbers and by a formula.

    Raises InputError, and NoSolutionError where there is no inertia or rows contradict each other.
    """
    state = resting(given.numbers.state, jumps)
    dynamics = FORMALISMS[formalism_name(formalism, mechanism)](mechanism, state)
    found = forward_dynamics(dynamics, minimum_norm=mechanism.minimum_norm)
    if not (np.isfinite(found.udot).all() and np.isfinite(found.report).all()):
        blame_numbers(posed.system)
        raise NoSolutionError(
            "the jumps are no finite numbers: values of the model are too large or too small", number="N105"
        )
    _verify_jumps(mechanism, dynamics, found.udot)
    motion, before = motion_of(mechanism, state), given.numbers
    numbers = ImpactInstant(motion, found.udot.tolist(), found.multipliers.tolist(), before)
    others = tuple(
        ImpactInstant(motion, numbers.udot, (found.multipliers + change).tolist(), before)
        for change in undetermined(dynamics, found)
    )
    told = formula(given.nodes)
    known = {k: told[k] for k in jumps} if told is not None else {k: jump_leaf(k) for k in jumps}
    symbolic = SymbolicState(resting(given.nodes.state, known), given.symbolic.letters)
    leaves = {k: jump_leaf(k) for k in jumps}
    nodes = ImpactInstant(motion_of(mechanism, symbolic.state), *unknowns(mechanism), given.nodes)
    at_slots = motion_of(mechanism, resting(given.slots.state, leaves))
    slots = ImpactInstant(at_slots, *unknowns(mechanism), given.slots)
    forms = None if told is None else forms_of(mechanism, symbolic, posed.sides, reasons)
    return Solved(posed.system, mechanism, posed.begin, numbers, others, symbolic, nodes, slots, forms, reasons)


def _verify_jumps(mechanism: Mechanism, dynamics: TreeDynamics, jumps: Floats) -> None:
    """Raise NoSolutionError where rows that depend on each other are to jump by different amounts."""
    wanted = np.array(dynamics.constraint_forcing, dtype=float)
    jacobian = np.array(dynamics.constraint_jacobian, dtype=float).reshape(len(wanted), len(jumps))
    kinematic = np.array([row.kinematic for row in dynamics.rows], dtype=bool)
    missed = np.abs(jacobian @ jumps - wanted) * kinematic
    if missed.max(initial=0.0) > _CONTRADICTION * max(np.abs(wanted).max(initial=0.0), np.abs(jumps).max(initial=0.0)):
        name = mechanism.rows[int(np.argmax(missed))].name
        raise NoSolutionError(
            f"the impulses contradict each other: no jump of speeds fulfils {name} with the others; of motions that "
            "jump and of what begins, leave out what asks for the same speed twice",
            where=Where(path=("impact",)),
            number="N108",
        )


def by_name(mechanism: Mechanism) -> dict[str, int]:
    """Return the numbers of a mechanism's rows by their names."""
    return {row.name: k for k, row in enumerate(mechanism.rows)}


def friction_along(told: ImpactInstant, row: str) -> S:
    """Return the impulse along a row in which something slides all the while, 0 where nothing rubs there."""
    total: S = 0
    places = by_name(told.motion.mechanism)
    for k, jumping in enumerate(told.motion.mechanism.rows):
        acting = jumping.row if isinstance(jumping, JumpRow) else jumping
        for friction in acting.frictions if isinstance(acting, SlidingRow) else ():
            along = [told.rows_before[x.name] for x in friction.rows]
            names = [x.name for x in friction.rows]
            factors = dict(zip(names, friction_factors(friction, along, told.motion), strict=True))
            if row in factors and friction.beside:
                pressing = (k, *(places[other] for other in friction.beside))
                return factors[row] * length([told.multipliers[j] for j in pressing])
            if row in factors:
                total = total + factors[row] * told.multipliers[k]
    return total


def length(components: Sequence[S]) -> S:
    """Return the length of a vector, without a root where it has one component."""
    return limits.length([x for x in components if as_node(x) is not ZERO] or [0])


def pressing(told: ImpactInstant, element: OneWay, part: FrictionPart, sides: Mapping[str, int]) -> S:
    """Return the impulse that presses where a part rubs; `sides` are those of reactions in joints."""
    names = [row.name for row in element.normals_of(part)]
    return limits.pressing(row_impulses(told, names), [sides.get(name, 1) for name in names], norm=part.norm)


def row_impulses(told: ImpactInstant, rows: Sequence[str]) -> list[S]:
    """Return the impulses along rows by name, also along those that slide with another's."""
    places = by_name(told.motion.mechanism)
    return [told.multipliers[places[row]] if row in places else friction_along(told, row) for row in rows]
