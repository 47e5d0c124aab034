"""An impact step by step: impulse and momentum along each speed, restitution, elimination, result, joints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.impact.solve import ImpactInstant
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.records import Formula, ImpactFound, Line, Quantity, Sentence, Worked, WorkedStep
from multibody_sym.derivation.notation import Label, Notation, latex_name, upright
from multibody_sym.derivation.symbolic_start import linear_equations
from multibody_sym.errors import ExpressionError
from multibody_sym.model.parameters import letters_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, as_node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.values import Value

_ROUNDING: Final = 1e-12
_MOMENTUM: Final = "Impulse and momentum of what each speed moves, cut free: impulses in joints across it do not enter"


def worked_impact(solved: SolvedInstant, found: ImpactFound) -> Worked:
    """Return the steps; without formulas what is known in numbers."""
    work = _Work(solved, found)
    try:
        steps = work.steps()
    except (NoClosedFormError, ExpressionError) as reason:
        why = Sentence((f"the equations are not written out: {reason}",))
        steps = (work.given(), WorkedStep("Equations", (why,)), *work.results())
    return Worked(solved.mechanism.name, steps, work.notation())


@dataclass(frozen=True, eq=False)
class _Work:
    solved: SolvedInstant
    found: ImpactFound

    @cached_property
    def jumps(self) -> list[Any]:
        """The symbols of the jumps."""
        return [sympy.Symbol(f"D_{speed.name}") for speed in self.solved.mechanism.speeds]

    @cached_property
    def impulses(self) -> list[Any]:
        """The symbols of the impulses of rows."""
        return [sympy.Symbol(f"p_{k}") for k, _ in enumerate(self.solved.mechanism.rows)]

    @cached_property
    def _called(self) -> dict[Any, Label]:
        found = {}
        for s, speed in zip(self.jumps, self.solved.mechanism.speeds, strict=True):
            found[s] = Label(f"D({speed.name})", rf"\Delta {latex_name(speed.name)}")
        alone = len(self.impulses) == 1
        for s, row in zip(self.impulses, self.solved.mechanism.rows, strict=True):
            told = row.name.removesuffix(".normal")
            found[s] = Label("p", "p") if alone else Label(f"p({told})", f"p_{{{upright(told.replace('_', ' '))}}}")
        return found

    def notation(self) -> Notation:
        """Return how all symbols are spelt."""
        named = [*self.solved.symbolic.letters, *(symbol(speed.name) for speed in self.solved.mechanism.speeds)]
        book = letters_of(self.solved.system.parameters)
        names = [n.data for n in named if isinstance(n.data, str)]
        plain = {sympy.Symbol(name): Label(name, latex_name(book.get(name, name))) for name in names}
        spelling = {**plain, **self._called}
        return Notation(spelling, {s: (0, k) for k, s in enumerate(spelling)})

    def shown(self, nodes: Sequence[Node]) -> list[Any]:
        """Return expressions in book form."""
        forms = self.solved.forms
        if forms is None:
            raise NoClosedFormError("the numbers have no formula")
        return [self._sympy(book_form(x)) for x in forms.of(nodes)]

    def _sympy(self, node: Node) -> Any:
        names = {leaf: sympy.Symbol(leaf.data) for leaf in leaves([node], "symbol")}
        return to_sympy(node, names)

    # --- steps ----------------------------------------------------------------------------------------------------

    def steps(self) -> tuple[WorkedStep, ...]:
        """Return all steps."""
        matrix, right = linear_equations(self.solved.nodes.motion)
        count = len(self.jumps)
        momentum = [self._equation(k, matrix[k], right[k], ()) for k in range(count)]
        names = [row.name for row in self.solved.mechanism.rows]
        ruled: list[Line] = [
            self._equation(k, matrix[k], right[k], (names[k - count],)) for k in range(count, len(matrix))
        ]
        told: list[WorkedStep] = [self.given(), WorkedStep(_MOMENTUM, tuple(momentum))]
        if ruled:
            told.append(WorkedStep("Restitution, and what holds: jumps along each row", tuple(ruled)))
        return (*told, *self.results())

    def _equation(self, tag: int, row: Sequence[Node], right: Node, before: tuple[str, ...]) -> Formula:
        """Return one equation, jumps on its left, impulses on its right."""
        count = len(self.jumps)
        *factors, given = self.shown([as_node(x) for x in (*row, right)])
        left = sum((a * s for a, s in zip(factors[:count], self.jumps, strict=True)), sympy.S.Zero)
        pushed = sum((-a * s for a, s in zip(factors[count:], self.impulses, strict=True)), sympy.S.Zero)
        return Formula((left, given + pushed), tag=tag + 1, before=before)

    def given(self) -> WorkedStep:
        """Return the speeds before, and what strikes."""
        instant = self.solved.nodes
        assert isinstance(instant, ImpactInstant)
        how = f"{self.found.law.capitalize()}'s law, {self.found.sequence.replace('_', ' ')}"
        lines: list[Line] = [Sentence((how,))]
        pairs = zip(self.solved.mechanism.speeds, instant.before.state.u, self.solved.begin.u, strict=True)
        for speed, node, number in pairs:
            if number:
                sides = sympy.Symbol(speed.name), self._sympy(as_node(node))
                alone = sides[0] == sides[1] or sides[1].is_number
                lines.append(Formula(sides[: 1 if alone else 2], value=Quantity(number, speed.unit)))
        return WorkedStep("Given", tuple(lines))

    def results(self) -> tuple[WorkedStep, ...]:
        """Return what follows by elimination."""
        names = {speed.name: s for speed, s in zip(self.solved.mechanism.speeds, self.jumps, strict=True)}
        impulses = [
            self._told(*self._named(name, part), value)
            for name, parts in self.found.impulses.items()
            for part, value in parts.items()
        ]
        jumps = [self._told((), (names[name],), value) for name, value in self.found.jumps.items()]
        after = [self._told(("after",), (sympy.Symbol(name),), value) for name, value in self.found.after.items()]
        lost = [self._told(("energy lost",), (), self.found.energy_lost)]
        steps = [("Elimination: impulses", impulses), ("Result", [*jumps, *after, *lost])]
        steps.append(("Impulses in joints", list(self._joints())))
        found = [WorkedStep(title, tuple(lines)) for title, lines in steps if lines]
        limits = self.found.limits
        conditions = [Sentence((f"{x}, else {limits[x]}" if limits.get(x) else x,)) for x in self.found.conditions]
        return (*found, *([WorkedStep("Conditions", tuple(conditions))] if conditions else []))

    def _joints(self) -> Iterator[Line]:
        every = (*self.found.joint_impulses.values(), *self.found.impulses.values())
        largest = max((abs(x.value or 0.0) for parts in every for x in parts.values()), default=0.0)
        for name, parts in self.found.joint_impulses.items():
            for component, value in parts.items():
                if abs(value.value or 0.0) > _ROUNDING * largest:
                    yield self._told((f"{name} {component}",), (), value)

    def _named(self, element: str, part: str) -> tuple[tuple[str, ...], tuple[Any, ...]]:
        """Return the words before an impulse, and its symbol where a row has it."""
        rows = [row.name for row in self.solved.mechanism.rows]
        for name in (f"{element}.{part}", element):
            if name in rows:
                return (), (self.impulses[rows.index(name)],)
        return (f"{element} {part}",), ()

    def _told(self, before: tuple[str, ...], sides: tuple[Any, ...], value: Value) -> Line:
        """Return a result with its formula and number; what is not unique has neither."""
        if value.value is None:
            return Sentence((*before, " is not unique"))
        known = () if value.expression is None else (self._sympy(value.expression),)
        told = Quantity(value.value, value.unit)
        if not (sides or known):
            return Sentence((*before, " = ", told))
        return Formula((*sides, *known), before=before, value=told)
