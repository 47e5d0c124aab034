"""`ask: {find: mu, so: N == 1}`: a value of a parameter, coordinate or speed for which an equation holds.

A formula where there is one: the root of the formulas of the answers that the equation names. Else runs find it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Final, Self

from multibody_sym import errors
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, why_none
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.extremes import (
    ANYWHERE,
    TOLERATED,
    UNKNOWN,
    ExtremeQuestion,
    Zero,
    reach,
    vanishes_about,
    zeros,
)
from multibody_sym.answers.ask.forced_questions import FORCED_QUESTIONS
from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.answers.ask.linear_systems import AskedModes
from multibody_sym.answers.ask.named_answers import with_answers
from multibody_sym.answers.ask.number_questions import NUMBER_QUESTIONS
from multibody_sym.answers.ask.question import AskedMotion, NeverError, NumberQuestion, Question, RunNumbers
from multibody_sym.answers.ask.working import Working, equation
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant
from multibody_sym.answers.instant.letters import put_in
from multibody_sym.answers.instant.states import conditions_of_mode
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.derivation.symbolic_start import WORK, limits_of
from multibody_sym.errors import ExpressionError, InputError, MultibodyError, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.mechanics.vocabulary import Dimensions, in_order, named_by
from multibody_sym.model.fields import Names, dimension_of_unit
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.settings import Ask, Equation
from multibody_sym.model.system import System
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, real, subtract, symbol
from multibody_sym.scalars.sign_changes import Bounded, bound_rounding
from multibody_sym.text.units import given_in
from multibody_sym.text.values import Value

_LEFT: Final = "left - right"
_FOUND_VALUES_NOTHING: Final = 1e-9
"""The part of the answers that an equation names below which its sides are the same."""
_ASIDE: Final = 0.01
"""How far from a value that runs found, relative to it, the formulas are made of which it is a root."""
_HOLDS: Final = 1e-6
"""The part of its size at the sample that a formula's equation may miss in numbers where that formula holds."""


NAMED_QUESTIONS: Final[tuple[type[NumberQuestion], ...]] = (*NUMBER_QUESTIONS, ExtremeQuestion, *FORCED_QUESTIONS)
"""The kinds whose answers an equation may name."""


def number_question(ask: Ask) -> NumberQuestion | None:
    """Return a question whose answer is a number; None for those of other kinds."""
    return next((found for kind in NAMED_QUESTIONS if (found := kind.parse(ask)) is not None), None)


@dataclass(frozen=True)
class FindQuestion(Question):
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

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.name))

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        ask = motion.solved.system.ask
        named = named_by(self.written, ask, motion.solved.mechanism.symbols)
        if any(ask[name].formula is not None for name in named):
            working.notes.append("it hangs on an answer that has no value")
            return Value(None)
        known = {name: motion.answers[name] for name in named}
        for name, each in self.extremes.items():
            extreme = number_question(each)
            assert extreme is not None
            known[name] = extreme.answer(motion, working)
        search = ValueSearch(motion, self, known)
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
    """The search for a value of which a motion starts; `known`: the answers that the equation names, by their names."""

    motion: AskedMotion
    question: FindQuestion
    known: Mapping[str, Value]

    def found(self) -> tuple[Value, list[str]]:
        self._verify_units()
        little = _FOUND_VALUES_NOTHING * max((abs(x.value or 0.0) for x in self.known.values()), default=0.0)
        if vanishes_about(self.residual, self.sample, self.bounds, little):
            return Value(None), [f"any value of {self.name} will do: {self.equation} holds for all that were tried"]
        formula = self._by_formula()
        if formula is not None:
            return formula
        found = zeros(self.residual, self.sample, self.bounds, size=self._size, limits=self.limits)
        if not found:
            told = f"no value of {self.name} was found for which {self.equation} {self._where}{self._failing}"
            return Value(None), [told]
        value, *others = (self._by_runs(zero) for zero in found)
        how = self._first(value, found, others, *([self._missed(found, "by runs")] if value.expression is None else []))
        return value, [*how, *self._told(found[0].at)]

    def _by_runs(self, zero: Zero) -> Value:
        """Return a value that runs found; where it has a formula, the formula's own value."""
        expression = self._by_formula_beside(zero)
        return self._number(zero, self.residual, self._noise(zero.at)) if expression is None else self._of(expression)

    def _of(self, expression: Node) -> Value:
        return Value(evaluate_float([expression], self.solved.sample)[0], expression, self._unit)

    def _number(self, zero: Zero, function: Callable[[float], float], noise: float) -> Value:
        return Value(zero.at, unit=self._unit, error=zero.error(function, noise))

    def _noise(self, value: float) -> float:
        """Return by how much left - right may be off at a value, as coarser runs show it; unknown where these fail."""
        try:
            coarse, _ = self._difference(self._changed(value), is_coarse=True)
        except (MultibodyError, NeverError, *UNDEFINED):
            return UNKNOWN
        return Simulated(self._posed).part_of_coarser * abs(coarse - self.residual(value))

    @cached_property
    def _unit(self) -> str:
        return self.question.unit(self.motion)

    @cached_property
    def _size(self) -> float:
        """How large the quantities are whose extremes the equation names, along the motion of the sample."""
        quantities = [x.of for x in self.equation.extremes.values()]
        asked = [Ask(max=of) for of in quantities] + [Ask(min=of) for of in quantities]
        if not asked:
            return 0.0
        names = {f"extreme_{k}": each for k, each in enumerate(asked)}
        try:
            _, answers, _ = self.motion.solve(self._posed.with_fields({"ask": Names(names)}))
        except (MultibodyError, *UNDEFINED):
            return 0.0
        return max((abs(answers[name].value or 0.0) for name in names), default=0.0)

    def lines(self, value: Value) -> Iterator[Line]:
        """Yield the equation with the formulas of answers put in, and how it was solved."""
        formulas = {symbol(name): x.expression for name, x in self.known.items() if x.expression is not None}
        sides = [put_in(side, formulas) for side in (self.equation.left, self.equation.right)]
        if len(formulas) == len(self.known) and not leaves(sides, "quantity"):
            yield equation(sides[0], sides[1], "with the formulas put in")
        how = "solved for" if value.expression is not None else "solved in numbers for"
        yield Sentence((f"{how} {self.name}",))

    # --- what is looked for ---------------------------------------------------------------------------------------

    @property
    def solved(self) -> SolvedInstant:
        """The start from which the value that the model has is known."""
        return self.motion.solved

    @property
    def name(self) -> str:
        """The parameter, coordinate or speed whose value is looked for."""
        return self.question.name

    @property
    def equation(self) -> Equation:
        """The equation that holds there."""
        return self.question.equation

    @cached_property
    def sample(self) -> float:
        starts = dict(zip(self._start_names, (*self.solved.begin.q, *self.solved.begin.u), strict=True))
        if self.name in starts:
            return float(starts[self.name])
        return self.solved.number(symbol(self.name))

    @property
    def bounds(self) -> tuple[float, float] | None:
        """The bounds between which it is looked for."""
        if self.question.between is None:
            return None
        low, high = map(self.solved.number, self.question.between)
        return min(low, high), max(low, high)

    @cached_property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest value that it may have."""
        return ANYWHERE if self.name in self._start_names else limits_of(self.solved.mechanism, self.name)

    @property
    def _start_names(self) -> list[str]:
        mechanism = self.solved.mechanism
        return [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]

    @property
    def _where(self) -> str:
        if self.bounds is None:
            low, high = reach(self.sample, self.limits)
            return f"from {low:.6g} to {high:.6g}, on the way out from {self.sample:.6g}; say where: between: [.., ..]"
        return "between {:.6g} and {:.6g}".format(*self.bounds)

    @property
    def _failing(self) -> str:
        """Return that runs failed where it was looked for, and how the first of them did; else nothing."""
        if not self._failed:
            return ""
        value, reason = next(iter(self._failed.items()))
        tried = f"{len(self._failed)} of the {len(self._known)} values tried"
        return f"; {tried} have no answer, as {value:.6g}, since runs fail: {reason}"

    def _missed(self, found: list[Zero], how: str) -> str:
        return f"{how}; the sides of {self.equation} differ by {abs(found[0].residual):.1e} there"

    def _first(self, value: Value, found: list[Zero], others: list[Value], *told: str) -> list[str]:
        """Return that other values were not looked for, or which they are, after what is `told`."""
        if self.bounds is not None:
            return [*told, *self._others(value, found, others)]
        first = f"the first on the way out from {self.sample:.6g}, others were not looked for (between: ..)"
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
        of_answers = {symbol(name): given_in(dimension_of_unit(x.unit)) for name, x in self.known.items() if x.unit}
        with at("so"):
            Dimensions(self.solved.system).verify_sides(self.equation, of_answers)

    # --- in numbers -----------------------------------------------------------------------------------------------

    def residual(self, value: float) -> float:
        """Return left - right at a value of what is looked for, nan where there is no such motion, or answer."""
        if value not in self._known:
            self._known[value] = self._residual(value)
        return self._known[value]

    @cached_property
    def _known(self) -> dict[float, float]:
        return {}

    def _residual(self, value: float) -> float:
        try:
            left, self._told_at[value] = self._difference(self._changed(value), is_coarse=False)
            return left
        except FailedRunError as failed:
            self._failed[value] = failed.message
            return UNKNOWN
        except (MultibodyError, NeverError, *UNDEFINED):
            return UNKNOWN

    def _changed(self, value: float) -> System:
        """Return the system that is asked what the equation needs, at a value of what is looked for."""
        change = {self.name: value}
        is_parameter = self.name in self.solved.system.parameters
        return (Overrides(parameters=change) if is_parameter else Overrides(initial=change)).of(self._posed)

    @cached_property
    def _failed(self) -> dict[float, str]:
        """Why runs fail, by the values at which they do."""
        return {}

    def _difference(self, system: System, *, is_coarse: bool) -> tuple[float, list[str]]:
        """Return left - right of a system, and what is to be said of the answers there."""
        numbers, modes = RunNumbers(Simulated(system, is_coarse)), AskedModes(system)
        answers: dict[str, Value] = {}
        there: list[str] = []
        for name in in_order(system.ask, self.solved.mechanism.symbols):
            named = with_answers(system.ask[name], answers, self.solved.mechanism.symbols)
            question = None if named is None else number_question(modes.put_in(named[0])[0])
            if question is None:
                return UNKNOWN, []
            before = len(numbers.notes)
            answers[name] = question.number(numbers)
            there += [f"there {name}: {note}" for note in numbers.notes[before:]]
        value = answers[_LEFT].value
        return (UNKNOWN if value is None else value), there

    @cached_property
    def _told_at(self) -> dict[float, list[str]]:
        return {}

    def _told(self, value: float) -> list[str]:
        """Return what is to be said of the answers at a value that was found."""
        if value not in self._told_at:
            self.residual(value)
        failed = self._failed.get(value)
        unconfirmed = [] if failed is None else [f"by formulas, since the run that would confirm it fails: {failed}"]
        return [*unconfirmed, *dict.fromkeys(self._told_at.get(value, ()))]

    @property
    def _asked(self) -> Ask:
        """What is to vanish, as a question."""
        return Ask(value=subtract(self.equation.left, self.equation.right))

    @cached_property
    def _posed(self) -> System:
        """The system that is asked only what the equation needs."""
        asked = {**self.solved.system.ask, **self.question.extremes}
        asked[_LEFT] = self._asked
        needed = [_LEFT]
        for name in needed:
            needed += sorted(named_by(asked[name], asked, self.solved.mechanism.symbols).difference(needed))
        return self.solved.system.with_fields({"ask": Names({name: asked[name] for name in needed})})

    # --- in closed form -------------------------------------------------------------------------------------------

    def _by_formula(self) -> tuple[Value, list[str]] | None:
        """Return the value where the answers have formulas that hold there too."""
        node = self._formula()
        if node is None:
            return None
        sample = self.solved.sample

        def value(x: float) -> float:
            return _value(node, {**sample, symbol(self.name): x})

        found = zeros(value, self.sample, self.bounds, cheap=True, limits=self.limits)
        scale = abs(value(self.sample))
        found = [x for x in found if abs(self._confirmed(x.at)) <= _HOLDS * scale]
        if not found:
            return None
        expression = self._root(node, symbol(self.name), found[0].at, self.solved)
        how = [] if expression is not None else [self._missed(found, "by its formula, in numbers")]
        first, *others = (self._number(x, value, self._rounding(node, x.at)) for x in found)
        first = first if expression is None else self._of(expression)
        return first, [*how, *self._others(first, found, others), *self._told(found[0].at)]

    def _rounding(self, node: Node, value: float) -> float:
        """Return what rounding makes of a formula at a value."""
        sample = {**self.solved.sample, symbol(self.name): value}
        return bound_rounding([node], {x: Bounded(y, EPSILON * abs(y)) for x, y in sample.items()})[0].bound

    def _confirmed(self, value: float) -> float:
        """Return left - right at a value by runs; where these fail, of answers there that hold without reservation."""
        left = self.residual(value)
        if value not in self._failed:
            return left
        try:
            _, answers, remarks = self.motion.solve(self._changed(value))
        except (MultibodyError, *UNDEFINED):
            return UNKNOWN
        again = answers[_LEFT].value
        return UNKNOWN if again is None or remarks else again

    def _formula(self) -> Node | None:
        """Return left - right in the model's symbols, None where an answer has no formula."""
        if any(x.expression is None for x in self.known.values()):
            return None
        try:
            asked, closed = AskedModes(self.solved.system, self.solved.symbolic.letters).put_in(self._asked)
        except errors.NoSolutionError:
            return None  # the value that the model has need not oscillate where others do
        if not closed:
            return None
        difference = asked.value
        assert difference is not None
        formulas = {symbol(name): x.expression for name, x in self.known.items() if x.expression is not None}
        node = put_in(difference, formulas)
        letters = self.solved.symbolic.letters
        if leaves([node], "quantity") or any(x not in letters for x in leaves([node], "symbol")):
            return None
        return node if symbol(self.name) in leaves([node], "symbol") else None

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
        node = answers[_LEFT].expression
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
            return _value(node, {**solved.sample, unknown: x})

        reach = 2 * abs(beside - value)
        near = zeros(left, beside, (value - reach, value + reach), cheap=True)
        at = min((x.at for x in near), key=lambda x: abs(x - value), default=UNKNOWN)
        return self._root(node, unknown, at, solved) if abs(at - value) <= part * abs(value) else None

    def _with_letter(self, value: float) -> tuple[System, Node]:
        """Return the system that is asked what the equation needs, at a value that a parameter has, and its symbol."""
        if self.name in self._posed.parameters:
            return Overrides(parameters={self.name: value}).of(self._posed), symbol(self.name)
        name = free_name(f"{self.name}_0", {str(x.data) for x in self.solved.mechanism.symbols} | {*self._posed.ask})
        more = Names({**self._posed.parameters, name: Parameter(value=real(value))})
        return Overrides(initial={self.name: symbol(name)}).of(replace(self._posed, parameters=more)), symbol(name)

    def _root(self, node: Node, unknown: Node, value: float, solved: SolvedInstant) -> Node | None:
        """Return the root as an expression, None where there is none whose value it is."""
        letters = dict(solved.symbolic.letters)
        letters[unknown] = Letter(unknown, PRECISE.mpf(value), letters[unknown].positive)
        field = Field(WORK)
        try:
            known = {x: field.letter(x, letter) for x, letter in letters.items()}
            (equation,) = exact(field, [node], known)
            for root in roots(equation, unknown):
                if abs(evaluate_float([root], self.solved.sample)[0] - value) <= AGREEMENT * abs(value):
                    return root
        except (NoClosedFormError, InputError, *UNDEFINED) as reason:
            self.solved.reasons[why_none(reason)] = None
        return None


def _value(node: Node, sample: Mapping[Node, float]) -> float:
    """Return the value of a formula, nan where it has none."""
    try:
        return evaluate_float([node], sample)[0]
    except (ExpressionError, *UNDEFINED):
        return UNKNOWN
