"""`ask: {find: mu, so: N == 1}`, `{find: beta, least: T}`: for which value an equation holds, an answer is least.

A formula where there is one: the root of the formulas of the answers that are named, or of their derivative. Else runs
find it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from itertools import chain
from math import inf, isfinite, sqrt
from typing import Final, Self

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.algebra.roots import angles_of_one_wave
from multibody_sym.answers.ask.extremes import (
    FIRST,
    GROWTH,
    TOLERATED,
    UNKNOWN,
    WIDENED,
    Zero,
    reach,
    vanishes_about,
    zeros,
)
from multibody_sym.answers.ask.question import AskedMotion, SingleQuestion
from multibody_sym.answers.ask.varied import (
    VARIED,
    OutOfTimeError,
    Patience,
    VariedAnswer,
    number_question,
    root_near,
    roots_near,
    value_of,
)
from multibody_sym.answers.ask.working import Working, equation, solving_lines, written
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant
from multibody_sym.answers.instant.letters import put_in, quotient_of
from multibody_sym.answers.instant.states import conditions_of_mode
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.errors import ExpressionError, MultibodyError, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.mechanics.vocabulary import Dimensions
from multibody_sym.model.fields import Names, dimension_of_unit
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.settings import Ask, Equation
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, real, subtract, symbol
from multibody_sym.text.printer import text
from multibody_sym.text.units import given_in
from multibody_sym.text.values import Quantity, Value

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
        asked = self.equation.left - self.equation.right
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
        value = evaluate_float([expression], self.varied.solved.sample)[0]
        return Value(value, expression, self.question.unit(self.varied.motion))

    def _number(self, zero: Zero, function: Callable[[float], float], noise: float) -> Value:
        return Value(zero.at, unit=self.question.unit(self.varied.motion), error=zero.error(function, noise))

    @cached_property
    def _size(self) -> float:
        """How large the quantities are whose extremes the equation names, along the motion of the sample."""
        quantities = [x.of for x in self.equation.extremes.values()]
        asked = [Ask(max=of) for of in quantities] + [Ask(min=of) for of in quantities]
        if not asked:
            return 0.0
        names = {f"extreme_{k}": each for k, each in enumerate(asked)}
        try:
            _, answers, _ = self.varied.motion.solve(self.varied.needed_system.with_fields({"ask": Names(names)}))
        except (MultibodyError, *UNDEFINED):
            return 0.0
        return max((abs(answers[name].value or 0.0) for name in names), default=0.0)

    def lines(self, value: Value) -> Iterator[Line]:
        """Yield the equation with the formulas of answers put in, and how it was solved."""
        formulas = {symbol(name): x.expression for name, x in self.varied.known.items() if x.expression is not None}
        sides = [put_in(side, formulas) for side in (self.equation.left, self.equation.right)]
        difference = subtract(*sides)
        if leaves(sides, "quantity"):
            found = self.varied.solved.values(self.varied.solved.asked(self.varied.expression), {})[""].expression
            sides = [found or ZERO, ZERO]
            difference = sides[0]
        if len(formulas) == len(self.varied.known) and difference is not ZERO:
            yield equation(sides[0], sides[1], "with the formulas put in")
            if value.expression is not None:
                known = self.varied.solved.symbolic.letters, self.varied.solved.sample
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
        known = self.varied.known.items()
        of_answers = {symbol(name): given_in(dimension_of_unit(x.unit)) for name, x in known if x.unit}
        with at("so"):
            Dimensions(self.varied.solved.system).verify_sides(self.equation, of_answers)

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
        expression = root_near(signed, symbol(self.name), found[0].at, self.varied.solved)
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
        solved, answers, _ = self.varied.motion.solve(system)
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
        name = free_name(f"{self.name}_0", {str(x.data) for x in self.varied.solved.mechanism.symbols} | {*system.ask})
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


# ----------------------------------------------------------------------------------------------------------------------
# `ask: {find: beta, least: T, between: [0, 80 deg]}`: the value for which an expression of answers is least, greatest.


_PARTS: Final = 24
"""Parts of a range at whose ends runs are compared."""
_FINE_PARTS: Final = 240
"""The same of formulas."""
_LIKELY: Final = 3
"""So many of the best places of a scan are looked at closely."""
_ROUNDED: Final = 1e-14
"""The part of the largest value that is rounding about zero."""
_CLOSE: Final = 1e-9
"""The part of a bracket to which runs find a place."""
_END: Final = 1e-6
"""The part of a range beside its end in which the extreme is taken to be at the end."""
_FLAT: Final = 1e-9
"""The part of the largest value by which values differ that are all the same."""
_BESIDE: Final = 1e-3
"""How far, as a part of the range, the growth of runs is looked at."""


@dataclass(frozen=True)
class BestQuestion(SingleQuestion):
    """The value of a parameter or start value for which an expression is least, or greatest; `written` as it is."""

    name: str
    expression: Node
    is_greatest: bool
    between: tuple[Node, ...] | None
    written: Ask

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        expression = ask.least if ask.greatest is None else ask.greatest
        if ask.find is None or expression is None:
            return None
        return cls(ask.find, expression, ask.greatest is not None, ask.between, ask)

    @property
    def which(self) -> str:
        """The word for the extreme."""
        return "greatest" if self.is_greatest else "least"

    def words(self) -> str:
        return f"{self.name} for which {text(self.expression)} is {self.which}"

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.name))

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        known = motion.answers_named(self.written)
        if any(x.value is None for x in known.values()):
            working.notes.append("it hangs on an answer that has no value")
            return Value(None)
        search = _Search(self, VariedAnswer(motion, self.name, self.expression, known, {}))
        try:
            best = search.found()
        except OutOfTimeError as late:
            working.notes.append(f"no {self.which} {text(self.expression)} was found {late}")
            return Value(None)
        if isinstance(best, str):
            working.notes.append(best)
            return Value(None)
        working.notes.extend(search.notes(best))
        working.steps.append(lambda: search.lines(best))
        return best.place


@dataclass(frozen=True)
class _Best:
    """A `place` of the extreme, its `value` there, and `others`: the values at ends of the range, by these.

    `node`: the formula of the value at any place, None where runs were compared; `slope`: its derivative.
    """

    place: Value
    value: Value
    others: Mapping[float, float]
    is_end: bool
    node: Node | None = None
    slope: Node | None = None


@dataclass(frozen=True)
class _Search:
    """The search for the extreme of what varies."""

    question: BestQuestion
    varied: VariedAnswer

    @cached_property
    def bounds(self) -> tuple[float, float] | None:
        return self.varied.bounds(self.question.between)

    def found(self) -> _Best | str:
        """Return the extreme, or why there is none. Raises OutOfTimeError."""
        node = self.varied.formula
        best = None if node is None else self._by_formula(node)
        return best or self._by_runs()

    # --- places -----------------------------------------------------------------------------------------------------

    def _cost(self, function: Callable[[float], float]) -> Callable[[float], float]:
        """Return a function that is least where the expression is as asked; infinite where that has no value."""
        sign = -1.0 if self.question.is_greatest else 1.0

        def cost(x: float) -> float:
            value = sign * function(x)
            return value if isfinite(value) else inf

        return cost

    def _place(self, function: Callable[[float], float], parts: int) -> tuple[float, float, float] | None:
        """Return the place of the extreme, and the ends of the bracket about it; None where there is none."""
        if self.bounds is None:
            bracket = self._downhill(self._cost(Patience(function)))
            return None if bracket is None else (_lowest(self._cost(function), *bracket), *bracket)
        low, high = self.bounds
        cost = self._cost(function)
        points = [low + (high - low) * k / parts for k in range(parts + 1)]
        costs = [inf, *map(cost, points), inf]
        near = [k for k in range(parts + 1) if costs[k + 1] <= min(costs[k], costs[k + 2]) and costs[k + 1] < inf]
        found: list[tuple[float, float, float]] = []
        for k in sorted(near, key=lambda k: costs[k + 1])[:_LIKELY]:
            sides = points[max(k - 1, 0)], points[min(k + 1, parts)]
            found += [(x, *sides) for x in (points[k], _lowest(cost, *sides))]
        return min(found, key=lambda each: cost(each[0]), default=None)

    def _downhill(self, cost: Callable[[float], float]) -> tuple[float, float] | None:
        """Return a bracket of the least cost on the way from the declared value to where costs are less."""
        middle, (least, most) = self.varied.sample, self.varied.limits
        step = FIRST * (abs(middle) or 1.0)
        low, high = max(middle - step, least), min(middle + step, most)
        if cost(middle) <= min(cost(low), cost(high)):
            return (low, high) if cost(middle) < inf else None
        side = 1.0 if cost(high) < cost(low) else -1.0
        before, at = middle, high if side > 0.0 else low
        for _ in range(WIDENED):
            step *= GROWTH
            ahead = min(max(at + side * step, least), most)
            if cost(ahead) >= cost(at):
                return min(before, ahead), max(before, ahead)
            before, at = at, ahead
        return None

    def _ends(self, at: float, function: Callable[[float], float]) -> tuple[dict[float, float], bool]:
        if self.bounds is None:
            return {}, False
        width = self.bounds[1] - self.bounds[0]
        is_end = any(abs(at - end) <= _END * width for end in self.bounds)
        return {end: function(end) for end in self.bounds}, is_end

    # --- by formulas ------------------------------------------------------------------------------------------------

    def _by_formula(self, node: Node) -> _Best | None:
        """Return the extreme of a formula, None where it has none that runs confirm."""
        varied, unknown = self.varied, symbol(self.question.name)
        function = partial(varied.of_formula, node)
        found = self._place(function, _FINE_PARTS)
        if found is None:
            return None
        others, is_end = self._ends(found[0], function)
        scale = max(abs(x) for x in map(function, (found[0], *others)) if isfinite(x))
        missed = {x: abs(varied.confirmed(x) - function(x)) for x in (found[0], *others)}
        if not missed[found[0]] <= _HOLDS * scale or any(x > _HOLDS * scale for x in missed.values()):
            return None
        if is_end:
            end = min(others, key=lambda x: abs(x - found[0]))
            given = next(x for x in self.question.between or () if varied.solved.number(x) == end)
            place = Value(end, given, self.question.unit(varied.motion))
            return _Best(place, self._value(node, [given], end)[1], others, is_end, node)
        try:
            slope = derivative(node, unknown)
        except (ExpressionError, *UNDEFINED):
            return None
        at = polished(partial(varied.of_formula, slope), *found)
        expression, value = self._value(node, self._roots(slope, at), at)
        number = evaluate_float([expression], varied.solved.sample)[0] if expression is not None else at
        error = 0.0 if expression is not None else sqrt(EPSILON) * abs(at)
        place = Value(number, expression, self.question.unit(varied.motion), error=error)
        return _Best(place, value, others, is_end, node, slope)

    def _roots(self, slope: Node, at: float) -> list[Node]:
        solved, unknown = self.varied.solved, symbol(self.question.name)
        waves: list[Node] = []
        try:
            waves = [x for x in angles_of_one_wave(slope, unknown) if abs(self._number(x) - at) <= _END * abs(at)]
        except (ExpressionError, *UNDEFINED) as reason:
            solved.reasons.setdefault(str(reason))
        return waves or list(roots_near(slope, unknown, at, solved))

    def _number(self, expression: Node) -> float:
        return evaluate_float([expression], self.varied.solved.sample)[0]

    def _value(self, node: Node, places: list[Node], at: float) -> tuple[Node | None, Value]:
        """Return the place with which a formula is shortest, and its value there; numbers where there is none."""
        solved = self.varied.solved
        number = self.varied.of_formula(node, at)
        forms: list[tuple[Node, Node]] = []
        for place in places:
            try:
                there = put_in(node, {symbol(self.question.name): place})
                form = written(quotient_of(there, solved.symbolic.letters))
                if abs(self._number(form) - number) <= _FLAT * abs(number):
                    forms.append((place, form))
            except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
                solved.reasons.setdefault(str(reason))
        if not forms:
            return (places[0] if places else None), Value(number, unit=self.varied.unit)
        place, form = min(forms, key=lambda pair: len(text(pair[0])) + len(text(pair[1])))
        return place, Value(number, form, self.varied.unit)

    # --- by runs ----------------------------------------------------------------------------------------------------

    def _by_runs(self) -> _Best | str:
        varied, asked = self.varied, text(self.question.expression)
        found = self._place(varied.value, _PARTS)
        if found is None:
            where = f"on the way from {varied.sample:.6g}; say where: between: [.., ..]"
            if self.bounds is not None:
                where = "between {:.6g} and {:.6g}".format(*self.bounds)
            return f"no {self.question.which} {asked} was found {where}{varied.failing}"
        at, low, high = found
        sizes = [abs(varied.value(x)) for x in (at, low, high)]
        others, is_end = self._ends(at, varied.value)
        if all(abs(varied.value(x) - varied.value(at)) <= _FLAT * max(sizes) for x in (low, high, *others)):
            return f"{asked} is the same for all {self.question.name} that were tried"
        noise = varied.noise(at)
        noise = noise if isfinite(noise) else _HOLDS * abs(varied.value(at))
        error = 0.0 if is_end else self._error(at, high - low, noise)
        place = Value(at, unit=self.question.unit(varied.motion), error=error)
        return _Best(place, Value(varied.value(at), unit=self.varied.unit, error=noise), others, is_end)

    def _error(self, at: float, width: float, noise: float) -> float:
        """Return how far the place may be off where values are by `noise`: they grow as a parabola beside it."""
        way = max(_BESIDE * width, _CLOSE * abs(at))
        grown = max(abs(self.varied.value(at + side * way) - self.varied.value(at)) for side in (1.0, -1.0))
        unsure = max(noise, EPSILON * abs(self.varied.value(at)))
        return way * sqrt(unsure / grown) if grown > unsure else way

    # --- notes and steps --------------------------------------------------------------------------------------------

    def notes(self, best: _Best) -> list[str]:
        """Return the value at the extreme, and what is to be said of the place."""
        found = [f"{text(self.question.expression)} = {best.value} there"]
        if best.is_end:
            found.append(f"it is an end of the range, beyond which {text(self.question.expression)} was not looked at")
        found += [f"by comparing runs, since {why}" for why in [self._why_runs()] if best.node is None]
        if best.node is not None and best.place.expression is None:
            found.append(f"by numbers, since no root of its derivative by {self.question.name} is known in letters")
        if self.bounds is None:
            way = f"the first on the way from {self.varied.sample:.6g}"
            found.append(f"{way}, others were not looked for (between: ..)")
        return found

    def _why_runs(self) -> str:
        without = [name for name, x in self.varied.known.items() if x.expression is None]
        asked = text(self.question.expression)
        if without:
            return f"{' and '.join(without)} {'has' if len(without) == 1 else 'have'} no formula"
        if self.varied.formula is None:
            return f"the formula of {asked} does not name {self.question.name}"
        return f"the formula of {asked} holds at {self.varied.sample:.6g}, and not at all places that were compared"

    def lines(self, best: _Best) -> Iterator[Line]:
        asked, name = self.question.expression, self.question.name
        if best.node is not None and best.node != asked:
            yield equation(asked, best.node, "with the formulas put in")
        if best.node is None:
            yield Sentence((f"found by comparing runs, since {self._why_runs()}",))
        if best.slope is not None:
            slope = min(best.slope, *self._forms(best.slope), key=lambda node: len(text(node)))
            yield equation(slope, ZERO, f"the derivative by {name} vanishes")
            if best.place.expression is not None:
                solved = self.varied.solved
                known = solved.symbolic.letters, solved.sample
                yield from solving_lines(slope, symbol(name), best.place.expression, *known)
                yield equation(symbol(name), best.place.expression, "so")
            yield from self._curvature(best.slope, best.place)
        sizes = [abs(x) for x in (*best.others.values(), best.value.value or 0.0) if isfinite(x)]
        for end, value in best.others.items():
            compared = "" if best.is_end else f", which is {'less' if self.question.is_greatest else 'greater'}"
            at_end = Quantity(end, best.place.unit)
            if isfinite(value):
                found = Quantity(value if abs(value) > _ROUNDED * max(sizes) else 0.0, self.varied.unit)
                yield Sentence((f"at {name} = ", at_end, ": ", asked, " = ", found, compared))
        number = None if best.value.value is None else Quantity(best.value.value, best.value.unit)
        sides = (asked,) if best.value.expression is None else (asked, best.value.expression)
        yield Formula(sides, before=("the value there",), value=number)

    def _curvature(self, slope: Node, place: Value) -> Iterator[Line]:
        assert place.value is not None
        unknown = symbol(self.question.name)
        value = self.varied.of_formula(derivative(slope, unknown), place.value)
        if value != 0.0 and isfinite(value):
            kind, sign = ("a greatest", "< 0") if value < 0.0 else ("a least", "> 0")
            yield Sentence((f"the second derivative there is {value:.6g} {sign}: {kind} value",))

    def _forms(self, slope: Node) -> Iterator[Node]:
        with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
            yield written(quotient_of(slope, self.varied.solved.symbolic.letters))


def _lowest(cost: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import minimize_scalar  # scipy takes longer to import than most answers take

    width = high - low
    if not width > 0.0:
        return low
    found = float(minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": _CLOSE * width}).x)
    return min(chain((found,), (low, high)), key=cost)


def polished(slope: Callable[[float], float], at: float, low: float, high: float) -> float:
    """Return the root of a derivative beside the place that was found, to rounding."""
    from scipy.optimize import brentq  # scipy takes longer to import than most answers take

    a, b = slope(low), slope(high)
    if not a * b < 0.0:
        return at
    return float(brentq(slope, low, high, xtol=EPSILON * max(abs(low), abs(high)), rtol=4.0 * EPSILON))
