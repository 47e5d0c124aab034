"""`ask: {find: mu, so: N == 1}`: a value of a parameter, coordinate or speed for which an equation holds.

A formula where there is one: the root of the formulas of the answers that the equation names. Else runs find it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from typing import Final, Self

from multibody_sym.answers.ask.extremes import (
    TOLERATED,
    UNKNOWN,
    Zero,
    reach,
    vanishes_about,
    zeros,
)
from multibody_sym.answers.ask.question import AskedMotion, SingleQuestion
from multibody_sym.answers.ask.solving import solving_lines
from multibody_sym.answers.ask.varied import (
    VARIED,
    OutOfTimeError,
    Patience,
    VariedAnswer,
    number_question,
    root_near,
    value_of,
)
from multibody_sym.answers.ask.working import Working, equation
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant
from multibody_sym.answers.instant.letters import put_in
from multibody_sym.answers.instant.states import conditions_of_mode
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.errors import MultibodyError, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.mechanics.vocabulary import Dimensions
from multibody_sym.model.fields import Names, dimension_of_unit
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.settings import Ask, Equation
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, real, subtract, symbol
from multibody_sym.text.units import given_in
from multibody_sym.text.values import Value

_FOUND_VALUES_NOTHING: Final = 1e-9
"""The part of the answers that an equation names below which its sides are the same."""
_ASIDE: Final = 0.01
"""How far from a value that runs found, relative to it, the formulas are made of which it is a root."""
_HOLDS: Final = 1e-6
"""The part of its size at the sample that a formula's equation may miss in numbers where that formula holds."""
_SHORT_OF: Final = 1e-3
"""How far from the end of a formula's range, as a part of the way to the sample, it is confirmed."""


@dataclass(frozen=True)
class FindQuestion(SingleQuestion):
    """The value of a parameter, coordinate or speed at the start for which an equation holds; `written` as it is."""

    name: str
    equation: Equation
    between: tuple[Node, ...] | None
    written: Ask

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.find is None or ask.so is None else cls(ask.find, ask.so, ask.between, ask)

    def words(self) -> str:
        return f"{self.name} for which {self.equation}"

    def is_later(self) -> bool:
        return not leaves([self.equation.left, self.equation.right], "quantity")

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.name))

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        ask, known = motion.solved.system.ask, motion.answers_named(self.written)
        if any(name in ask and ask[name].formula is not None for name in known):
            working.notes.append("it hangs on an answer that has no value")
            return Value(None)
        for name, each in self.extremes.items():
            extreme = number_question(each)
            assert extreme is not None
            known[name] = extreme.answer(motion, working)
        asked = subtract(self.equation.left, self.equation.right)
        search = ValueSearch(self, VariedAnswer(motion, self.name, asked, known, self.extremes))
        value, more = search.found()
        working.notes.extend(more)
        working.steps.append(lambda: search.lines(value))
        return value

    @property
    def extremes(self) -> dict[str, Ask]:
        found = self.equation.extremes.items()
        return {name: Ask(max=x.of) if x.kind == "max" else Ask(min=x.of) for name, x in found}


@dataclass(frozen=True)
class ValueSearch:
    """The search for a value at which `varied`, left - right of the equation, vanishes."""

    question: FindQuestion
    varied: VariedAnswer

    @property
    def motion(self) -> AskedMotion:
        """The motion from the declared value."""
        return self.varied.motion

    @property
    def solved(self) -> SolvedInstant:
        """The start with the declared value."""
        return self.varied.solved

    @property
    def name(self) -> str:
        """The parameter, coordinate or speed whose value is looked for."""
        return self.question.name

    @property
    def equation(self) -> Equation:
        """The equation that holds there."""
        return self.question.equation

    @cached_property
    def bounds(self) -> tuple[float, float] | None:
        """The bounds between which the value is looked for."""
        return self.varied.bounds(self.question.between)

    def found(self) -> tuple[Value, list[str]]:
        self._verify_units()
        little = _FOUND_VALUES_NOTHING * max((abs(x.value or 0.0) for x in self.varied.known.values()), default=0.0)
        looked = self.varied.value if self.bounds is not None else Patience(self.varied.value)
        with suppress(OutOfTimeError):
            if vanishes_about(looked, self.varied.sample, self.bounds, little):
                return Value(None), [f"any value of {self.name} will do: {self.equation} holds for all that were tried"]
        formula = self._by_formula()
        if formula is not None:
            return formula
        try:
            found = self._zeros(looked)
        except OutOfTimeError as late:
            return Value(None), [f"no value of {self.name} was found for which {self.equation} {late}"]
        if not found:
            told = f"no value of {self.name} was found for which {self.equation} {self._where}{self.varied.failing}"
            return Value(None), [told]
        value, *others = (self._by_runs(zero) for zero in found)
        how = self._first(value, found, others, *([self._missed(found, "by runs")] if value.expression is None else []))
        return value, [*how, *self.varied.notes(found[0].at)]

    def _zeros(self, looked: Callable[[float], float]) -> list[Zero]:
        """Return where left - right vanishes by runs. Raises OutOfTimeError."""
        varied = self.varied
        return zeros(varied.value, varied.sample, self.bounds, size=self._size, limits=varied.limits, looked=looked)

    def _by_runs(self, zero: Zero) -> Value:
        """Return a value that runs found; where it has a formula, the formula's own value."""
        expression = self._by_formula_beside(zero)
        if expression is not None:
            return self._of(expression)
        return self._number(zero, self.varied.value, self.varied.noise(zero.at))

    def _of(self, expression: Node) -> Value:
        return Value(evaluate_float([expression], self.solved.sample)[0], expression, self.question.unit(self.motion))

    def _number(self, zero: Zero, function: Callable[[float], float], noise: float) -> Value:
        return Value(zero.at, unit=self.question.unit(self.motion), error=zero.error(function, noise))

    @cached_property
    def _size(self) -> float:
        """How large the quantities are whose extremes the equation names, along the motion of the sample."""
        quantities = [x.of for x in self.equation.extremes.values()]
        asked = [Ask(max=of) for of in quantities] + [Ask(min=of) for of in quantities]
        if not asked:
            return 0.0
        names = {f"extreme_{k}": each for k, each in enumerate(asked)}
        try:
            _, answers, _ = self.motion.solve(self.varied.needed_system.with_fields({"ask": Names(names)}))
        except (MultibodyError, *UNDEFINED):
            return 0.0
        return max((abs(answers[name].value or 0.0) for name in names), default=0.0)

    def lines(self, value: Value) -> Iterator[Line]:
        """Yield the equation with the formulas of answers put in, and how it was solved."""
        formulas = {symbol(name): x.expression for name, x in self.varied.known.items() if x.expression is not None}
        sides = [put_in(side, formulas) for side in (self.equation.left, self.equation.right)]
        difference = subtract(*sides)
        if leaves(sides, "quantity"):
            found = self.solved.values(self.solved.asked(self.varied.expression), {})[""].expression
            sides = [found or ZERO, ZERO]
            difference = sides[0]
        if len(formulas) == len(self.varied.known) and difference is not ZERO:
            yield equation(sides[0], sides[1], "with the formulas put in")
            if value.expression is not None:
                known = self.solved.symbolic.letters, self.solved.sample
                yield from solving_lines(difference, symbol(self.name), value.expression, *known)
        how = "solved for" if value.expression is not None else "solved in numbers for"
        yield Sentence((f"{how} {self.name}",))

    # --- what is looked for ---------------------------------------------------------------------------------------

    @property
    def _where(self) -> str:
        if self.bounds is None:
            sample = self.varied.sample
            low, high = reach(sample, self.varied.limits)
            return f"from {low:.6g} to {high:.6g}, on the way out from {sample:.6g}; say where: between: [.., ..]"
        return "between {:.6g} and {:.6g}".format(*self.bounds)

    def _missed(self, found: list[Zero], how: str) -> str:
        return f"{how}; the sides of {self.equation} differ by {abs(found[0].residual):.1e} there"

    def _first(self, value: Value, found: list[Zero], others: list[Value], *told: str) -> list[str]:
        """Return that other values were not looked for, or which they are, after what is `told`."""
        if self.bounds is not None:
            return [*told, *self._others(value, found, others)]
        first = f"the first on the way out from {self.varied.sample:.6g}, others were not looked for (between: ..)"
        return ["; ".join((*told, first)), *self._range(value, found[0])]

    def _others(self, value: Value, found: list[Zero], others: list[Value]) -> list[str]:
        told = [
            f"{value}" if zero.through is None else f"{value} to {zero.through:.6g}"
            for value, zero in zip(others, found[1:], strict=True)
        ]
        return [*self._range(value, found[0]), *([f"others are {', '.join(told)}"] if told else [])]

    def _range(self, value: Value, zero: Zero) -> list[str]:
        """Return that the equation holds in a whole range, or where its sides cease to have a value: an end of it."""
        if zero.is_last:
            return [f"{self.equation} holds at the end of the range of {self.name} in which both sides have a value"]
        if zero.through is None:
            return []
        if zero.other is not None:
            low = self._by_runs(zero.other)
            return [f"{self.equation} holds for every {self.name} from {low} to {value}"]
        side = "above" if zero.through > zero.at else "below"
        what = f"{self.equation} holds there and for every {self.name} {side}"
        return [f"{what}, as far as was looked: {'to' if side == 'above' else 'down to'} {zero.through:.6g}"]

    def _verify_units(self) -> None:
        """Raise ModelError where the sides of the equation are in different units, with those of answers."""
        known = self.varied.known.items()
        of_answers = {symbol(name): given_in(dimension_of_unit(x.unit)) for name, x in known if x.unit}
        with at("so"):
            Dimensions(self.solved.system).verify_sides(self.equation, of_answers)

    # --- in closed form -------------------------------------------------------------------------------------------

    def _by_formula(self) -> tuple[Value, list[str]] | None:
        """Return the value where the answers have formulas that hold there too."""
        varied, node = self.varied, self.varied.formula
        if node is None:
            return None
        value, signed = partial(varied.of_formula, node), _with_sign(node)
        crossing = partial(varied.of_formula, signed)
        found = zeros(crossing, varied.sample, self.bounds, cheap=True, limits=varied.limits)
        scale = abs(value(varied.sample))
        found = [x for x in found if self._is_confirmed(x, value, _HOLDS * scale)]
        if not found:
            return None
        expression = root_near(signed, symbol(self.name), found[0].at, self.solved)
        how = [] if expression is not None else [self._missed(found, "by its formula, in numbers")]
        first, *others = (self._number(x, crossing, varied.rounding(node, x.at)) for x in found)
        first = first if expression is None else self._of(expression)
        return first, [*how, *self._others(first, found, others), *varied.notes(found[0].at)]

    def _is_confirmed(self, zero: Zero, formula: Callable[[float], float], tolerance: float) -> bool:
        """Return whether the model has the formula's value at its zero: short of it where the formula ends there.

        A frequency that vanishes is no longer the first one.
        """
        at = zero.at + (_SHORT_OF * (self.varied.sample - zero.at) if zero.is_last else 0.0)
        return abs(self.varied.confirmed(at) - formula(at)) <= tolerance

    def _by_formula_beside(self, zero: Zero) -> Node | None:
        """Return a value that runs found as the root of the formula which the equation has beside it.

        Outside of a range in which it holds throughout.
        """
        aside = _ASIDE * (abs(zero.at) or 1.0)
        sides = (1.0, -1.0) if zero.through is None else (1.0,) if zero.through <= zero.at else (-1.0,)
        for side in sides:
            try:
                expression = self._root_beside(zero, zero.at + side * aside)
            except (MultibodyError, *UNDEFINED):
                continue
            if expression is not None:
                return expression
        return None

    def _root_beside(self, zero: Zero, beside: float) -> Node | None:
        """Return a zero as the root of the formula that left - right has where what is looked for is `beside` it.

        The end of a range in which that vanishes may be where a condition comes to hold under which it has the formula.
        """
        system, unknown = self._with_letter(beside)
        solved, answers, _ = self.motion.solve(system)
        node = answers[VARIED].expression
        found = None if node is None else self._root_near(node, unknown, zero.at, beside, solved, AGREEMENT)
        if found is not None or zero.through is None:
            return found
        forms = (solved.value_of(condition.value) for condition in conditions_of_mode(solved))
        nodes = (form.expression for form in forms if form is not None and form.expression is not None)
        roots = (self._root_near(x, unknown, zero.at, beside, solved, TOLERATED) for x in nodes)
        return next((root for root in roots if root is not None), None)

    def _root_near(
        self, node: Node, unknown: Node, value: float, beside: float, solved: SolvedInstant, part: float
    ) -> Node | None:
        """Return the root of a formula that is a value, to a `part` of it, as an expression."""

        def left(x: float) -> float:
            return value_of({**solved.sample, unknown: x}, node)

        reach = 2 * abs(beside - value)
        near = zeros(left, beside, (value - reach, value + reach), cheap=True)
        at = min((x.at for x in near), key=lambda x: abs(x - value), default=UNKNOWN)
        return root_near(node, unknown, at, solved) if abs(at - value) <= part * abs(value) else None

    def _with_letter(self, value: float) -> tuple[System, Node]:
        """Return the system that is asked what the equation needs, at a value that a parameter has, and its symbol."""
        system = self.varied.needed_system
        if self.name in system.parameters:
            return Overrides(parameters={self.name: value}).of(system), symbol(self.name)
        name = free_name(f"{self.name}_0", {str(x.data) for x in self.solved.mechanism.symbols} | {*system.ask})
        more = Names({**system.parameters, name: Parameter(value=real(value))})
        return Overrides(initial={self.name: symbol(name)}).of(replace(system, parameters=more)), symbol(name)


def _with_sign(node: Node) -> Node:
    """Return a product without the size of its factors: it changes its sign where a size only touches zero."""
    if node.op in ("neg", "abs"):
        return _with_sign(node.args[0])
    if node.op in ("mul", "div"):
        left, right = node.args
        return BUILD[node.op](_with_sign(left), _with_sign(right) if node.op == "mul" else right)
    return node
