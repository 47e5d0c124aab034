"""The ends of a range of rest step by step: bodies in balance, limits that are reached, elimination, the parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.analysis.rest.ends import ExactEnd
from multibody_sym.analysis.rest.range_of_rest import rest_bound, rest_position, unit_of, varied_parameter
from multibody_sym.analysis.rest.ranges import RestSearch
from multibody_sym.analysis.rest.statics import RestEnd, RestLimit
from multibody_sym.answers.ask.working import solving_lines, written
from multibody_sym.answers.records import Formula, Line, Sentence, Worked, WorkedStep
from multibody_sym.answers.worked.actions import gripping_ratio
from multibody_sym.answers.worked.bodies import FORCES, BodyLines, forces_spelt, mass_lines, wording
from multibody_sym.answers.worked.equations import (
    Equations,
    HandElimination,
    LinearForm,
    NumberedEquation,
    in_sympy,
    linear,
)
from multibody_sym.derivation.notation import Notation
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.row_records import RopeSlipRow
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, as_node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.values import Quantity


def worked_rest(system: System, vary: str, *, formalism: str | None = None, **changes: Any) -> Worked:
    """Return the steps to each end of the ranges of a parameter at which rest is possible.

    An end at which no limit of a force is reached has none. It has the arguments and the errors of `range_of_rest`.
    """
    system = Overrides(**changes).of(system)
    position = rest_position(system, formalism)
    entry = varied_parameter(position.mechanism, vary)
    found = RestSearch(position, entry.name, {}).found()
    unit = "rad" if found.kind == "angle" else unit_of(entry)
    steps, notation, said = list[WorkedStep](), Notation({}, {}), set[tuple[str, ...]]()
    for ends in found.ranges:
        for end, outward in zip(ends, (-1, 1), strict=True):
            bound = rest_bound(position, found, end, outward)
            if bound.value is None or not end.limits:
                continue
            why = ", ".join(bound.gives_way)
            try:
                balance = _Balance(system, ExactEnd(position.mechanism, entry.name, end), end)
                own = list(balance.steps(bound.expression, Quantity(bound.value, unit)))
                notation = notation.joined(balance.told.notation)
            except (NoClosedFormError, ExpressionError) as reason:
                own = [WorkedStep("Equations", (Sentence((f"the equations are not written out: {reason}",)),))]
            steps.append(WorkedStep(f"{entry.name} where rest ends: {why}", ()))
            steps += [step for step in own if step.lines and wording(step.lines, notation) not in said]
            said |= {wording(step.lines, notation) for step in own}
    return Worked(position.mechanism.name, tuple(steps), notation)


@dataclass
class _Balancing(HandElimination):
    """Elimination of forces that balance: equations that name none any more are `conditions` of the parameter."""

    conditions: list[Quotient] = field(default_factory=list)

    def _without_idle(self, waiting: Sequence[NumberedEquation]) -> list[NumberedEquation]:
        left = [e for e in waiting if e.form.terms]
        self.conditions += [e.form.rest for e in waiting if not e.form.terms and not e.form.rest.is_zero]
        return left

    @property
    def missed(self) -> float:
        """By how much balance is missed where the rest ends."""
        return max((abs(float(x.sample)) for x in self.conditions), default=0.0)


@dataclass(frozen=True, eq=False)
class _Balance:
    """The balance of the bodies at an end of a range of rest."""

    system: System
    exact: ExactEnd
    end: RestEnd
    equations: Equations = field(init=False)
    told: BodyLines = field(init=False)

    def __post_init__(self) -> None:
        given, mechanism = self.exact.in_balance
        equations = Equations(mechanism, given, plane=in_plane(self.system), rests=True)
        notation = forces_spelt(equations, letters_of(self.system))
        object.__setattr__(self, "equations", equations)
        object.__setattr__(self, "told", BodyLines(equations, notation, FORCES))

    def steps(self, expression: Node | None, value: Quantity) -> Iterator[WorkedStep]:
        """Yield the bodies cut free, the limits, the elimination, and the parameter's value there."""
        limits, elimination = min(map(self._eliminated, (1, -1)), key=lambda each: each[1].missed)
        yield WorkedStep("Given", tuple(mass_lines(self.equations)))
        for body in self.equations.cut.bodies:
            yield WorkedStep(f"{body.name}, cut free", tuple(self.told.body(body)))
        laws = [*self.equations.cut.free, *self.equations.laws]
        yield WorkedStep("Laws of forces", tuple(map(self.told.formula, laws)))
        yield WorkedStep("Limits that are reached", tuple(map(self.told.formula, limits)))
        lines: list[Line] = [line for step in elimination.steps for line in self.told.found(step, in_sympy)]
        yield WorkedStep("Elimination", (*lines, *self._solved(elimination.conditions, expression, value)))

    def _eliminated(self, way: int) -> tuple[list[NumberedEquation], _Balancing]:
        """Return the limits, ropes that slip one way or the other, and the elimination of all forces."""
        limits = [e for limit in self.end.limits for e in self._at_limit(limit, way)]
        every = [*self.equations.all, *limits]
        for tag, e in enumerate(every, 1):
            e.tag = tag
        elimination = _Balancing(self.equations.exactly, self.equations.symbols.accelerations)
        self.equations.exactly.renew()
        elimination.run(every)
        return limits, elimination

    def _on_wheel(self, name: str, way: int) -> NumberedEquation:
        """Return the limit of a rope on a rough wheel: one tension is exp(mu*angle) times the other."""
        (grip,) = (each for each in self.equations.actions.grips if each.slip == name)
        parts = (part for element in self.equations.mechanism.one_way for part in element.frictions)
        part = next(part for part in parts if part.rows[0].name == name)
        (ratio,) = self.equations.exactly.quotients([gripping_ratio(part, self.equations.actions.motion)])
        greater, less = (grip.before, grip.behind) if way > 0 else (grip.behind, grip.before)
        zero = ratio * 0
        return NumberedEquation(linear([(greater, zero + 1)], zero), linear([(less, ratio)], zero), "law", (part.name,))

    def _at_limit(self, limit: RestLimit, way: int) -> Iterator[NumberedEquation]:
        """Yield what holds of forces at a limit: friction is as large as it may be, or a normal force vanishes."""
        row = self.equations.mechanism.rows[limit.terms[-1][0]]
        if isinstance(row, RopeSlipRow):
            yield self._on_wheel(row.name, way)
            return
        exactly, symbols = self.equations.exactly, self.equations.symbols.multipliers
        given, _ = self.exact.in_balance
        factors = exactly.quotients([as_node(x) for x in given.state.values([node for _, node in limit.terms])])
        zero = factors[0] * 0
        terms = [(self.equations.normal(k), a) for (k, _), a in zip(limit.terms, factors, strict=True)]
        total = LinearForm({}, zero)
        for form, a in terms:
            total = total.plus(form.with_all(self.equations.cut.known), a)
        rubbing = {symbols[k] for k, _ in limit.terms[-1:]} if limit.kind == "cone" else set(total.terms)
        left = {s: a for s, a in total.terms.items() if s in rubbing}
        right = LinearForm({s: -a for s, a in total.terms.items() if s not in rubbing}, -total.rest)
        first = next(iter(left.values()), None)
        if first is not None:
            share = zero.field.constant(1) / first
            left, right = {s: a * share for s, a in left.items()}, right.times(share)
        yield NumberedEquation(LinearForm(left, zero), right, "law", (limit.group or limit.part,))
        for k in limit.idle:
            yield NumberedEquation(linear([(symbols[k], zero + 1)], zero), LinearForm({}, zero), "law", (limit.part,))

    def _solved(
        self, conditions: Sequence[Quotient], expression: Node | None, value: Quantity
    ) -> Iterator[Line]:
        """Yield what is left of the equations, and how it is solved for the parameter."""
        unknown = symbol(self.exact.name)
        left = next((x for x in conditions if unknown in x.symbols), None)
        leaves: Mapping[Node, Any] = self.equations.exactly.letters
        if left is not None:
            zero = written(left)
            yield Formula((to_sympy(zero, leaves), to_sympy(ZERO, leaves)), before=("what is left",))
            for line in solving_lines(zero, unknown, expression or ZERO, self.exact.letters, self.exact.sample):
                yield replace(line, sides=tuple(to_sympy(side, leaves) for side in line.sides))
        sides = (unknown,) if expression is None else (unknown, expression)
        yield Formula(tuple(to_sympy(side, leaves) for side in sides), before=("so",), value=value)
