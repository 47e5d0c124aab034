"""Coordinates of coupled linear equations as formulas of time, by normal modes.

    x'' = A x + B x' + f(t)        A, B constant

Where A and B commute (no damping, or Rayleigh's), what x has of each mode, P x with P a product of A - alpha_j and
B - beta_j, is a linear equation of its own, y'' = alpha y + beta y' + P f. Else z = (x, x') with z' = N z + F has such
parts by the factors s^2 - b s - a of its characteristic polynomial, as far as this has factors of that degree:

    y = (P z)_k,    y'' = a y + b y' + (N P F)_k + (P F')_k - b (P F)_k
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Final

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.algebra.solving.roots import rate
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted
from multibody_sym.answers.questions.courses import InTime, Shown, formulas_of_time
from multibody_sym.answers.questions.decoupled import Coupled
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.answers.small_motions.matrices import WORK
from multibody_sym.expressions.printer import text
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import Node, as_node, symbol

_MOST: Final = 4
"""Coordinates whose equations hang together, and for which this is tried."""
_LONGEST: Final = 1000
"""Letters of a formula that tells more than its numbers do."""


@dataclass(frozen=True, eq=False)
class Courses:
    """Coordinates and speeds of a solved system as formulas of time, by their symbols, where `motion` confirms them.

    They hold until a state changes first, or until a speed turns back on which accelerations depend by its sign.
    """

    solved: Solved
    motion: Simulated
    _found: dict[Node, InTime | None] = field(default_factory=dict)
    _why: dict[Node, str] = field(default_factory=dict)

    @cached_property
    def shown(self) -> Shown:
        """What the motion shows."""
        return Shown.of(self.solved, self.motion)

    @cached_property
    def alone(self) -> Mapping[Node, InTime]:
        """Those whose equations name no other coordinate."""
        return {} if self.shown.there is None else self.shown.confirmed(formulas_of_time(self.shown.there))

    def of(self, node: Node) -> InTime | None:
        """Return a coordinate or speed as a formula of time; None where none is known, and `why` tells the reason."""
        if node in self.alone:
            return self.alone[node]
        if node not in self._found:
            self._found[node] = None
            try:
                self._found[node] = self._coupled(str(node.data))
            except NoClosedFormError as reason:
                self._why[node] = str(reason)
        return self._found[node]

    def why(self, node: Node) -> str:
        """Return why a coordinate or speed has no formula, empty where it is not what the motion shows."""
        return self._why.get(node, "")

    def _coupled(self, name: str) -> InTime | None:
        there = self.shown.there
        if there is None:
            raise NoClosedFormError("the equations have no closed form")
        pairs = zip(self.solved.mechanism.coordinates, self.solved.mechanism.speeds, strict=False)
        coordinate = next(q.name for q, u in pairs if name in (q.name, u.name))
        signs, granted = there.forms.field.positive, Granted()
        there.forms.field.positive = granted.positive
        try:
            formula = coupled_course(there, granted, coordinate)[0 if name == coordinate else 1]
        finally:
            there.forms.field.positive = signs
        if len(text(formula)) > _LONGEST:
            raise NoClosedFormError("the formula is too long")
        return self.shown.confirmed({symbol(name): InTime(formula, granted)}).get(symbol(name))


def coupled_course(there: Anywhere, granted: Granted, coordinate: str) -> tuple[Node, Node]:
    """Return a coordinate and its speed as formulas of time. Raises NoClosedFormError, which says why it has none."""
    mechanism = there.solved.mechanism
    names = [c.name for c in mechanism.coordinates]
    if len(names) != len(mechanism.speeds):
        raise NoClosedFormError("coordinates have no speeds of their own")
    q, u = (list(map(symbol, each)) for each in (names, [s.name for s in mechanism.speeds]))
    group = _together(there, q, u, names.index(coordinate))
    if len(group) > _MOST:
        raise NoClosedFormError(f"{len(group)} equations hang together")
    given = _linear(there, granted, [q[k] for k in group], [u[k] for k in group], group)
    course = given.course(group.index(names.index(coordinate)))
    return course, derivative(course, TIME)


def _together(there: Anywhere, q: Sequence[Node], u: Sequence[Node], first: int) -> list[int]:
    """Return the places of the coordinates whose equations name each other's, in their order."""
    found = [first]
    for k in found:
        named = there.forms.udot[k].symbols
        found += [j for j in range(len(q)) if named & {q[j], u[j]} and j not in found]
    return sorted(found)


def _linear(there: Anywhere, granted: Granted, q: Sequence[Node], u: Sequence[Node], group: Sequence[int]) -> Coupled:
    """Return the equations of a group. Raises NoClosedFormError where they are not linear, or change with time."""
    there.forms.field.work = max(there.forms.field.work, WORK)
    stiffness, losses, forces = [], [], []
    for k in group:
        acceleration = there.forms.udot[k]
        along, by_speed = ([rate(acceleration, x) for x in each] for each in (q, u))
        left = acceleration
        for x, slope in zip((*q, *u), (*along, *by_speed), strict=True):
            left = left - slope * there.letter(x)
        if not all(map(there.constant, (*along, *by_speed))) or left.symbols & (there.variables - {TIME}):
            raise NoClosedFormError("the equations are no x'' = A x + B x' + f(t) with constant A and B")
        stiffness.append(along)
        losses.append(by_speed)
        forces.append(left)
    state = there.solved.nodes.motion.state
    starts = [there.forms.of([as_node(values[k]) for k in group]) for values in (state.q, state.u)]
    return Coupled(there, granted, stiffness, losses, forces, *starts)
