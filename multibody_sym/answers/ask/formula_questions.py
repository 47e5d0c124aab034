"""Questions whose answer is a formula: of the time, of a coordinate or of a speed; limits and series of formulas."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from itertools import islice
from typing import Any, Final, NamedTuple, Self

import numpy as np
import sympy

from multibody_sym.algebra.quotients import NoClosedFormError, why_none
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.courses import FITS, least_conditions
from multibody_sym.answers.ask.energy_integral import ToAndFro, courses_by_place, courses_by_speed, freedom_of
from multibody_sym.answers.ask.extremes import zeros
from multibody_sym.answers.ask.from_runs import ASKED, Simulated, state_at
from multibody_sym.answers.ask.later_formulas import MotionFormulas, in_letters
from multibody_sym.answers.ask.linear_systems import shortest_course
from multibody_sym.answers.ask.named_answers import Anywhere, anywhere
from multibody_sym.answers.ask.question import AskedMotion, SingleQuestion
from multibody_sym.answers.ask.varied import VariedAnswer, value_of
from multibody_sym.answers.ask.working import Lines, Working, equation, written
from multibody_sym.answers.instant.letters import TIME, quotient_of, state_names
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.errors import ExpressionError
from multibody_sym.model.settings import Ask, Tendency
from multibody_sym.model.state_words import VERBS, WAYS
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, number, symbol
from multibody_sym.scalars.sympy_bridge import from_sympy, to_sympy
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# `ask: {formula: x}`: a coordinate or speed as a formula of time.


@dataclass(frozen=True)
class FormulaQuestion(SingleQuestion):
    """A coordinate or speed as a formula of time, which has no number."""

    coordinate: str

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.formula is None or ask.of is not None else cls(text(ask.formula))

    def words(self) -> str:
        return f"{self.coordinate} as a formula of time"

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.coordinate))

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        mechanism, unit = motion.solved.mechanism, self.unit(motion)
        found = motion.courses.of(symbol(self.coordinate))
        if motion.simulated.failure is not None:
            raise motion.simulated.failure
        if found is None:
            working.notes.append(f"{self._why_none(motion)}; simulate tells numbers")
            return Value(None, unit=unit)
        working.notes.extend(found.conditions())
        working.steps.append(lambda: islice(motion.courses.equations([symbol(self.coordinate)]), 1))
        if mechanism.one_way:
            working.notes.append(_held_until(motion.simulated))
        return Value(None, shortest_course(found.formula, motion.solved.symbolic.letters), unit=unit)

    def _why_none(self, motion: AskedMotion) -> str:
        mechanism, courses = motion.solved.mechanism, motion.courses
        if self.coordinate in motion.solved.system.states:
            return f"{self.coordinate} is a state, of which no formula of time is sought"
        rates = zip(mechanism.coordinates, mechanism.speeds, strict=False)
        speed = next((u.name for q, u in rates if q.name == self.coordinate), "")
        if speed and symbol(speed) in courses.alone:
            return f"no integral of {speed} is known, which has a formula of its own"
        reason = courses.why(symbol(self.coordinate))
        return f"no solution of the equation of {self.coordinate} is known{reason and f' ({reason})'}"


def _held_until(motion: Simulated) -> str:
    """Return until when formulas of time are those of a motion in which states may change, as a run shows it."""
    run = motion.whole
    if not run.changes:
        return f"of the motion without a change of state, of which there is none until t = {run.t_final:.6g} s"
    first = float(run.changes[0]["t"])
    begun: dict[str, None] = {}
    for element, kind in ((each["element"], each["kind"]) for each in run.changes if float(each["t"]) == first):
        verbs = (verb for verb, words in VERBS.items() if kind in words)
        verb = min(verbs, key=lambda x: len(VERBS[x]), default=kind)
        begun[f"{element} {verb} {WAYS.get(kind[-1], '')}".rstrip()] = None
    return f"of the motion until the first change of state: {', '.join(begun)} at t = {first:.6g} s"


# ----------------------------------------------------------------------------------------------------------------------
# `ask: {formula: N, of: theta}`: an expression along the motion, by a coordinate or speed in place of the time.


_LOOKS: Final = 41
_TURNS: Final = 1e-9
"""The part of its largest value below which a speed is zero."""


class _Candidate(NamedTuple):
    """A formula that may be the one asked for, the lines that lead to it, and what it takes for granted."""

    formula: Node
    lines: Lines
    conditions: list[str]


@dataclass(frozen=True)
class FormulaOfQuestion(SingleQuestion):
    """An expression along the motion from the start as a formula of a coordinate or speed, until that turns back."""

    keys = ("formula", "of")

    expression: Node
    of: str

    def words(self) -> str:
        return f"{text(self.expression)} as a formula of {self.of}"

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(self.expression)

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        unit, shown = self.unit(motion), _Shown(motion, self.expression, symbol(self.of))
        for found in self._candidates(shown):
            if shown.has(found.formula):
                working.notes.extend(found.conditions)
                if shown.until is not None:
                    working.notes.append(f"until {shown.until}")
                working.steps.append(found.lines)
                return Value(None, found.formula, unit=unit)
        working.notes.append(f"no formula of {text(self.expression)} by {self.of} is known; simulate tells numbers")
        return Value(None, unit=unit)

    def _candidates(self, shown: _Shown) -> Iterator[_Candidate]:
        there = shown.there
        if there is None:
            return
        ways = (self._along, self._inverted, self._orbit)
        courses = [*courses_by_place(there, shown.state, shown.state), *courses_by_speed(there, shown.state[1])]
        for way in ways:
            try:
                yield from way(there, shown, courses)
            except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
                shown.motion.solved.reasons.setdefault(why_none(reason))

    def _along(self, there: Anywhere, shown: _Shown, courses: Sequence[MotionFormulas]) -> Iterator[_Candidate]:
        """Yield the expression along a motion that is known by the variable. Raises NoClosedFormError."""
        for course in (x for x in courses if x.variable is shown.variable):
            yield _Candidate(_short(there, course.along(self.expression)), course.lines, list(course.granted()))

    def _inverted(self, there: Anywhere, shown: _Shown, courses: Sequence[MotionFormulas]) -> Iterator[_Candidate]:
        """Yield the expression where it is the variable of a motion that has `of`. Raises NoClosedFormError."""
        for course in (x for x in courses if x.variable is self.expression):
            along = course.along(shown.variable)
            near = {self.expression: shown.values[self.expression]}
            near[shown.variable] = evaluate_float([along], {**there.solved.sample, **near})[0]
            for root in roots(in_letters(there, along - shown.variable, near), self.expression):
                formula = _short(there, root)
                yield _Candidate(formula, partial(self._solved_lines, course.lines), list(course.granted()))

    def _solved_lines(self, lines: Lines) -> Iterator[Line]:
        yield from lines()
        yield Sentence(("solved for ", self.expression))

    def _orbit(self, there: Anywhere, shown: _Shown, _courses: Sequence[MotionFormulas]) -> Iterator[_Candidate]:
        """Yield a coordinate by another one, on which nothing depends: the inverse of an integral.

        Raises NoClosedFormError.
        """
        freedom = freedom_of(there, self.expression, shown.state)
        if freedom is None or shown.variable not in freedom.momenta:
            return
        advanced = shown.variable - freedom.at_start(shown.variable)
        with there.assuming(freedom.granted):
            integral = freedom.root_integral(freedom.rates[freedom.momenta[shown.variable]])
            start = there.forms.of([freedom.start])[0]
            formula = _short(there, integral.inverse(start, advanced if freedom.sign > 0 else -advanced))
        conditions = [*map(str, least_conditions(freedom.granted.positive))]
        lines = partial(freedom.lines, [shown.variable])
        yield _Candidate(formula, partial(self._solved_lines, lines), conditions)


def _short(there: Anywhere, found: Node) -> Node:
    """Return a formula of the state in its book form, or as it is where the sample has none."""
    with suppress(NoClosedFormError, *UNDEFINED):
        short = written(there.forms.of([found])[0])
        return short if len(text(short)) <= len(text(found)) else found
    return found


class _Shown:
    """A run of an `expression` until `variable` turns back or a state changes (`until`, None: its end)."""

    def __init__(self, motion: AskedMotion, expression: Node, variable: Node) -> None:
        """`values`: coordinates and speeds in the middle of it, at which equations `there` are made."""
        self.motion, self.variable = motion, variable
        run = motion.simulated.along(expression, None, motion.solved.system.stop)
        mechanism = motion.solved.mechanism
        names = {x.name: u.name for x, u in zip(mechanism.coordinates, mechanism.speeds, strict=False)}
        name = str(variable.data)
        rate = run[names[name]] if name in names else np.gradient(run[name], run.t)
        moving = np.flatnonzero(np.abs(rate) > _TURNS * float(np.abs(rate).max(initial=0.0)))
        first = int(moving[0]) if len(moving) else 0
        turned = np.flatnonzero(rate[first:] * rate[first] < 0.0)
        last = first + int(turned[0]) - 1 if len(turned) else len(run.t) - 1
        self.until = f"{name} turns back at t = {float(run.t[last]):.6g} s" if len(turned) else None
        changed = min((float(change["t"]) for change in run.changes if change["t"] > 0.0), default=np.inf)
        if changed <= run.t[last]:
            last = int(np.searchsorted(run.t, changed)) - 1
            self.until = f"a state changes at t = {changed:.6g} s"
        way = np.abs(run[name][first : last + 1] - run[name][first])
        steps = np.linspace(0.0, float(way.max(initial=0.0)), _LOOKS)[:-1]  # not where it may hardly change any more
        self._run, self._looked = run, np.unique(first + np.searchsorted(np.maximum.accumulate(way), steps))
        middle = self._looked[len(self._looked) // 2]
        self.state = q, u = state_at(run, mechanism, middle)
        self.values = dict(zip(map(symbol, state_names(mechanism)), (*q, *u), strict=True))
        self.there = anywhere(motion.solved, q, u)

    def has(self, formula: Node) -> bool:
        """Return whether a formula is what the run shows."""
        run, known = self._run, self.motion.solved.sample
        if not set(leaves([formula], "symbol")) <= {*known, self.variable} or leaves([formula], "quantity"):
            return False
        name = str(self.variable.data)
        try:
            told = [evaluate_float([formula], {**known, self.variable: float(run[name][k])})[0] for k in self._looked]
        except (ExpressionError, *UNDEFINED):
            return False
        shown: Floats = run[ASKED][self._looked]
        return bool(np.abs(np.array(told) - shown).max() <= FITS * max(1e-300, float(np.abs(shown).max())))




# ----------------------------------------------------------------------------------------------------------------------
# `ask: {a0: {limit: a, let: {M: oo}}}`: limits and series of formulas that other questions give.
#
# Sympy finds them, and the formula's own numbers with many digits, close by, confirm them.


_MOST: Final = 400
"""Operations of a formula whose limits and derivatives are looked for."""
_DIGITS: Final = 60
_BESIDE: Final = 1e-3
"""How far from the place of an expansion, relative to the declared value, the model must have the formula."""
_HOLDS: Final = 1e-6
"""How near the model must come to it there."""
_FAR: Final = sympy.Integer(10) ** 16
"""How many times the declared value stands for infinity, or its reciprocal beside a finite place, in a test."""
_REACHED: Final = 1e-5
"""How near a formula must come to its limit there."""
_STEP: Final = sympy.Rational(1, 10**4)
"""The larger step at which a series is tested, relative to the declared value; half of it is the smaller one."""
_SWING: Final = 0.5
"""The larger amplitude at which the series of a period is tested, relative to the declared one."""
_ROUNDED: Final = 1e-9
_HOW_PERIODS: Final = "the period is the integral of 2 dq/q' between the turning points, expanded in their distance"
_X: Final = sympy.Symbol("what varies", real=True)
_STEPPED: Final = sympy.Symbol("from the place", real=True)
_NO_VALUES: Final = (sympy.nan, sympy.zoo, sympy.oo, -sympy.oo)
_INFINITIES: Final = {"oo": sympy.oo, "-oo": -sympy.oo}


class NoExpansionError(Exception):
    """A limit or series is not known; the text says why."""


@dataclass(frozen=True)
class _FormulaQuestion(SingleQuestion):
    """What a formula becomes as `name`, a parameter or start value, comes to a place; `written` as it is."""

    name: str
    expression: Node
    written: Ask

    def unit(self, motion: AskedMotion) -> str:
        return self.varied(motion).unit

    def varied(self, motion: AskedMotion) -> VariedAnswer:
        """Return the expression as a function of what varies."""
        return VariedAnswer(motion, self.name, self.expression, motion.answers_named(self.written), {})

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        varied = self.varied(motion)
        node = varied.closed
        if node is None:
            working.notes.append(f"{text(self.expression)} has no formula")
            return Value(None, unit=varied.unit)

        def find() -> Value:
            near = _Formula(varied, node).at_place(self.beside(varied))
            working.notes.extend(near.notes)
            found = self.expanded(near, working)
            working.steps.insert(0, lambda: [equation(self.expression, near.node, "with the formulas put in")])
            return found

        return self.unless_unknown(find, working, varied.unit, "expansion")

    def unless_unknown(self, find: Callable[[], Value], working: Working, unit: str, what: str) -> Value:
        """Return what is found; no value, and a note why, where there is none of `what` is asked."""
        try:
            return find()
        except (NoExpansionError, NoClosedFormError, ExpressionError, NotImplementedError, *UNDEFINED) as reason:
            working.notes.append(str(reason) or f"no {what} of {text(self.expression)} is known")
            return Value(None, unit=unit)

    @abstractmethod
    def beside(self, varied: VariedAnswer) -> float:
        """Return a value of what varies near its place."""

    @abstractmethod
    def expanded(self, formula: _Formula, working: Working) -> Value:
        """Return the limit or series of a formula. Raises NoExpansionError."""


class _Formula:
    """A formula (`node`) of what varies, which the model has near the place where it is expanded."""

    def __init__(self, varied: VariedAnswer, node: Node, notes: tuple[str, ...] = ()) -> None:
        self.varied, self.node, self.notes = varied, node, notes
        letters = varied.solved.symbolic.letters
        signs = {x: {"positive": True} if letter.positive else {"real": True} for x, letter in letters.items()}
        self._leaves = {x: sympy.Symbol(str(x.data), **sign) for x, sign in signs.items()}
        self._leaves[symbol(varied.name)] = _X
        self.sympy: Any = to_sympy(node, self._leaves)
        if sympy.count_ops(self.sympy) > _MOST:
            raise NoExpansionError(f"the formula of {text(varied.expression)} is too long")

    def at_place(self, beside: float) -> _Formula:
        """Return the formula that the model has near the place: another one where it is in another state there."""
        varied = self.varied
        here, there = varied.of_formula(self.node, beside), varied.value(beside)
        if not abs(there - here) > _HOLDS * max(abs(there), abs(here)):
            unsure = "" if there == there else f"at {varied.name} = {beside:.6g} no run confirms the formula"
            return _Formula(varied, self.node, (unsure,) if unsure else ())
        again = varied.solved_at(beside).expression
        if again is None:
            raise NoExpansionError(f"{text(varied.expression)} has another value at {varied.name} = {beside:.6g}")
        return _Formula(varied, again, (f"the formula is that of the state at {varied.name} = {beside:.6g}",))

    @cached_property
    def sample(self) -> dict[Any, Any]:
        known = self.varied.solved.sample
        return {s: sympy.Rational(known[x]) for x, s in self._leaves.items() if x in known}

    @property
    def scale(self) -> Any:
        """The size of the declared value of what varies, 1 where it is zero."""
        return abs(sympy.Rational(self.varied.sample)) or sympy.S.One

    def name_place(self, node: Node) -> Any:
        return self._leaves.setdefault(node, sympy.Symbol(f"place {node.data}", real=True))

    def in_sympy(self, node: Node) -> Any:
        return to_sympy(node, self._leaves)

    def evaluated(self, expression: Any, at: Any) -> Any:
        """Return an expression at a value of what varies, with many digits."""
        return expression.subs(_X, at).subs(self.sample).evalf(_DIGITS)

    def in_book_form(self, expression: Any) -> Node:
        node = from_sympy(expression, {s: x for x, s in self._leaves.items()})
        return written(quotient_of(node, self.varied.solved.symbolic.letters))

    def signs(self, expression: Any) -> Iterator[str]:
        """Yield the conditions under which roots of squares are what a book form writes, as at the declared letters."""
        roots = [x.base for x in expression.atoms(sympy.Pow) if x.exp.is_Rational and x.exp.q == 2]
        squares = [x.args[0] ** 2 for x in expression.atoms(sympy.Abs)]
        for root in sorted((*roots, *squares), key=str):
            for factor, power in (x.as_base_exp() for x in sympy.Mul.make_args(sympy.factor(root))):
                if power.is_even and not factor.is_positive:
                    way = 1 if self.evaluated(factor, self.scale) > 0 else -1
                    yield f"while {text(self.in_book_form(way * factor))} > 0"

    def value(self, node: Node) -> Value:
        return Value(self.varied.of_formula(node, self.varied.sample), node, self.varied.unit)


# ----------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LimitQuestion(_FormulaQuestion):
    """The value to which a formula tends."""

    to: Tendency

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.limit is None or ask.let is None else cls(ask.let.name, ask.limit, ask, ask.let)

    def words(self) -> str:
        return f"the limit of {text(self.expression)} as {self.to}"

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        if self.name != TIME.data:
            return super().answer(motion, working)
        unit = motion.unit_of(self.expression)
        found = self.unless_unknown(lambda: self._at_last(motion, working), working, unit, "limit")
        return replace(found, unit=unit)

    def _at_last(self, motion: AskedMotion, working: Working) -> Value:
        """Return the value to which a speed tends whose rate u' = f(u) depends on itself alone: a root of f.

        Raises NoExpansionError.
        """
        if self.to.bound != "oo":
            raise NoExpansionError("the time tends to oo; a value at a time is {value: .., after: 2 s}")
        solved, there = motion.solved, motion.courses.shown.there
        speeds = [symbol(x.name) for x in solved.mechanism.speeds]
        if there is None:
            raise NoExpansionError("the equations of motion have no closed form")
        if self.expression not in speeds:
            raise NoExpansionError(f"limits in time are those of speeds, and {text(self.expression)} is none")
        k, variables = speeds.index(self.expression), there.variables - {self.expression}
        rate = there.forms.udot[k]
        if rate.symbols & variables:
            raise NoExpansionError(f"the rate of {text(self.expression)} depends on more than itself")
        node, run = written(rate), motion.simulated.whole
        first, last = (float(run[str(self.expression.data)][j]) for j in (0, -1))

        def value(u: float) -> float:
            return value_of({**solved.sample, self.expression: u}, node)

        ahead = zeros(value, last, None, cheap=True)
        sides = [x.at for x in ahead if (x.at - last) * (last - first) >= 0.0 or abs(x.at - last) <= _HOLDS * abs(last)]
        if run.changes or not sides:
            raise NoExpansionError(f"{text(self.expression)} tends to no value that the run shows")
        final = min(sides, key=lambda x: abs(x - last))
        for root in roots(in_letters(there, node, {self.expression: final}), self.expression):
            found = value_of(solved.sample, root)
            if abs(found - final) <= _HOLDS * abs(final):
                working.steps.append(lambda: [equation(node, ZERO, "at last the speed is constant")])
                return Value(found, root)
        raise NoExpansionError(f"the root of the rate of {text(self.expression)} has no formula")

    def beside(self, varied: VariedAnswer) -> float:
        scale = abs(varied.sample) or 1.0
        if self.to.to is None:
            return scale / _BESIDE * (1.0 if self.to.bound == "oo" else -1.0)
        end = varied.solved.number(self.to.to)
        return end + _BESIDE * scale * (-1.0 if end > varied.sample else 1.0)

    def expanded(self, formula: _Formula, working: Working) -> Value:
        places = list(self._sides(formula))
        found = [self._at(formula.sympy, end, side) for end, side, _ in places]
        name = text(self.expression)
        if len({*found}) > 1:
            raise NoExpansionError(f"{name} tends to {found[0]} from above and to {found[1]} from below")
        limit = found[0]
        if limit.has(sympy.oo, -sympy.oo, sympy.zoo):
            raise NoExpansionError(f"{name} grows beyond all bounds as {self.to}")
        if limit.has(sympy.AccumBounds, sympy.Limit, sympy.nan):
            raise NoExpansionError(f"{name} has no limit as {self.to}")
        for _, _, near in places:
            left = formula.evaluated(formula.sympy - limit, near)
            size = max(abs(formula.evaluated(limit, near)), abs(formula.evaluated(formula.sympy, formula.scale)))
            if not abs(left) <= _REACHED * size:
                raise NoExpansionError(f"numbers do not confirm the limit of {name} as {self.to}")
        working.notes.extend(formula.signs(limit))
        return formula.value(formula.in_book_form(limit))

    def _at(self, expression: Any, end: Any, side: str) -> Any:
        """Return the value at the place where there is one, which the numbers beside it confirm, else the limit."""
        value = expression.subs(_X, end)
        try:
            return sympy.limit(expression, _X, end, side) if value.has(*_NO_VALUES) else value
        except sympy.PolynomialError:
            raise NoExpansionError(f"no limit of {text(self.expression)} is known as {self.to}") from None

    def _sides(self, formula: _Formula) -> Iterator[tuple[Any, str, Any]]:
        """Yield the place, a side of it, and a value close by on that side."""
        if self.to.to is None:
            yield _INFINITIES[self.to.bound or "oo"], "-", formula.scale * _FAR * (1 if self.to.bound == "oo" else -1)
            return
        end, little = formula.in_sympy(self.to.to), formula.scale / _FAR
        at, (least, most) = formula.varied.solved.number(self.to.to), formula.varied.limits
        for side, way in (("+", 1), ("-", -1)):
            if (at < most) if way > 0 else (at > least):
                yield end, side, end + way * little


# ----------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SeriesQuestion(_FormulaQuestion):
    """The expansion of a formula about a place, through a power."""

    about: Node
    through: int

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        if ask.series is None or ask.in_ is None or ask.through is None:
            return None
        return cls(ask.in_, ask.series, ask, number(0) if ask.about is None else ask.about, ask.through)

    def words(self) -> str:
        return f"{text(self.expression)} in powers of {text(self._step)} through {self.through}"

    @property
    def _step(self) -> Node:
        return symbol(self.name) - self.about

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        varied = self.varied(motion)
        asked = motion.solved.system.ask.get(str(self.expression.data)) if self.expression.op == "symbol" else None
        of = None if asked is None else asked.period_of
        if varied.closed is not None or of is None:
            return super().answer(motion, working)
        return self.unless_unknown(lambda: self._of_period(varied, of, working), working, varied.unit, "series")

    def _of_period(self, varied: VariedAnswer, coordinate: str, working: Working) -> Value:
        """Return the series of a period whose formula is no elementary function, by the energy of its one freedom."""
        swing = ToAndFro.of(varied.solved, coordinate)
        if swing is None:
            raise NoExpansionError(f"{coordinate} is no one freedom with known equations")
        freedom, letters = swing.freedom, _Formula(varied, symbol(self.name))
        place = letters.name_place(freedom.variable)
        state = {x: freedom.at_start(x) for x in (freedom.variable, freedom.speed)}
        start = [letters.in_sympy(symbol(self.name) if x.data == self.name else y) for x, y in state.items()]
        mass, potential = (letters.in_sympy(x) for x in (freedom.mass, freedom.whole_potential))
        about = letters.in_sympy(self.about)
        terms = period_terms(_Well(mass, potential, place), (start[0], start[1]), about, self.through)
        powers = {sympy.Integer(n): sympy.simplify(x) for n, x in enumerate(terms)}
        found = letters.value(self._form(letters, powers))
        assert found.expression is not None
        self._verify_period(varied, found.expression)
        exact = varied.value(varied.sample)
        off = Value(abs((found.value or 0.0) - exact), unit=varied.unit, error=0.0)
        working.notes.append(f"at {self.name} = {varied.sample:.6g} it differs from {text(self.expression)} by {off}")
        working.steps.extend((lambda: freedom.lines([]), lambda: [Sentence((_HOW_PERIODS,))]))
        return found

    def _verify_period(self, varied: VariedAnswer, formula: Node) -> None:
        """Raise NoExpansionError where the remainder does not fade as the power after the last one."""
        about, step = varied.solved.number(self.about), _SWING * (abs(varied.sample) or 1.0)
        places = about + step, about + step / 2
        left = [abs(varied.of_formula(formula, x) - varied.value(x)) for x in places]
        exact = varied.value(places[0])
        if not (left[1] <= left[0] * 0.75 / 2**self.through or left[0] <= _ROUNDED * exact):
            raise NoExpansionError(f"numbers do not confirm the series of {text(self.expression)}")

    def beside(self, varied: VariedAnswer) -> float:
        return varied.solved.number(self.about) + _BESIDE * (abs(varied.sample) or 1.0)

    def expanded(self, formula: _Formula, working: Working) -> Value:
        powers = self._powers(formula)
        whole = sum((factor * _STEPPED**power for power, factor in powers.items()), sympy.S.Zero)
        about = formula.in_sympy(self.about)
        self._verify(formula, whole.subs(_STEPPED, _X - about), about)
        found = formula.value(self._form(formula, powers))
        exact = formula.varied.value(formula.varied.sample)
        if found.value is not None and exact == exact:
            at = f"{self.name} = {formula.varied.sample:.6g}"
            off = Value(abs(found.value - exact), unit=formula.varied.unit, error=0.0)
            working.notes.append(f"at {at} it differs from {text(self.expression)} by {off}")
        working.steps.append(lambda: [Sentence((f"derivatives by {self.name} at the place give the coefficients",))])
        return found

    def _powers(self, formula: _Formula) -> dict[Any, Any]:
        rest = formula.sympy.subs(_X, formula.in_sympy(self.about) + _STEPPED)
        found, derived = {}, rest
        for k in range(self.through + 1):
            factor = derived.subs(_STEPPED, 0) / sympy.factorial(k)
            if factor.has(*_NO_VALUES):
                return self._by_series(rest)
            found[sympy.Integer(k)] = factor
            derived = derived.diff(_STEPPED)
        return found

    def _by_series(self, rest: Any) -> dict[Any, Any]:
        """Return the same where derivatives have no value: of reciprocals, roots and quotients of zeros."""
        expanded = sympy.expand(sympy.series(rest, _STEPPED, 0, self.through + 1).removeO())
        found: dict[Any, Any] = {}
        for term in sympy.Add.make_args(expanded):
            factor, power = term.as_coeff_exponent(_STEPPED)
            if factor.has(_STEPPED):
                raise NoExpansionError(f"{text(self.expression)} has no series of powers of {text(self._step)}")
            found[power] = found.get(power, sympy.S.Zero) + factor
        return {power: found[power] for power in sorted(found) if power <= self.through}

    def _verify(self, formula: _Formula, series: Any, about: Any) -> None:
        """Raise NoExpansionError where the remainder does not fade as the power after the last one."""
        step = formula.scale * _STEP
        left = [abs(formula.evaluated(formula.sympy - series, about + x)) for x in (step, step / 2)]
        size = abs(formula.evaluated(formula.sympy, about + step))
        if left[1] > left[0] * sympy.Rational(3, 4) / 2**self.through and left[0] > size * sympy.Float(10) ** -40:
            raise NoExpansionError(f"numbers do not confirm the series of {text(self.expression)}")

    def _form(self, formula: _Formula, powers: dict[Any, Any]) -> Node:
        """Return the series, its first coefficient in front of all where that is shorter."""
        step = self._step
        forms = {power: formula.in_book_form(factor) for power, factor in powers.items()}
        forms = {power: form for power, form in forms.items() if form != number(0)}
        if not forms:
            return number(0)
        apart = _sum((form, step, power) for power, form in forms.items())
        first = next(iter(forms))
        ratios = [(formula.in_book_form(powers[p] / powers[first]), step, p - first) for p in forms]
        together = _sum([(forms[first], step, first)]) * _sum(ratios)
        return min(apart, together, key=lambda node: len(text(node)))


class _Well(NamedTuple):
    """M and V of T = M(q) q'^2/2, V(q) of one freedom, over sympy, by its coordinate q."""

    mass: Any
    potential: Any
    q: Any


def period_terms(well: _Well, start: tuple[Any, Any], about: Any, through: int) -> list[Any]:
    """Return the factors of powers of X - about in the period of a motion from the state `start`, of X.

    With x = q - c from the equilibrium c, V - V(c) = v x^2 W(x) and h = E - V(c), the period is the sum over k of

        2 pi sqrt(m/(2 v)) binom(2 k, k)/4^k [x^(2 k)] (sqrt(M(x)/m) W(x)^(-k - 1/2)) (h/v)^k

    (the series of q in s, v s^2 = V - V(c), by Lagrange's inversion). Raises NoExpansionError.
    """
    q0, u0 = start
    c = q0.subs(_X, about)

    def expanded(function: Any, by: Any, place: Any, count: int) -> list[Any]:
        return [sympy.simplify(function.diff(by, n).subs(by, place) / sympy.factorial(n)) for n in range(count)]

    v = expanded(well.potential, well.q, c, through + 3)
    m = expanded(well.mass, well.q, c, through + 1)
    if v[1] != 0 or sympy.simplify(u0.subs(_X, about)) != 0 or v[2] == 0:
        raise NoExpansionError("the place of the series is no equilibrium that oscillates")
    energy = well.mass.subs(well.q, q0) * u0**2 / 2 + well.potential.subs(well.q, q0) - v[0]
    height = [x / v[2] for x in expanded(energy, _X, about, through + 1)]
    valley, inertia = [x / v[2] for x in v[2:]], [x / m[0] for x in m]
    terms, heights = [sympy.S.Zero] * (through + 1), [sympy.S.One] + [sympy.S.Zero] * through
    for k in range(through // 2 + 1):
        shape = _product(_power(inertia, sympy.Rational(1, 2)), _power(valley, -sympy.Rational(2 * k + 1, 2)))
        factor = sympy.binomial(2 * k, k) * shape[2 * k] / sympy.Integer(4) ** k
        terms = [x + factor * y for x, y in zip(terms, heights, strict=True)]
        heights = _product(heights, height)
    first = 2 * sympy.pi * sympy.sqrt(m[0] / (2 * v[2]))
    return [first * x for x in terms]


def _product(a: list[Any], b: list[Any]) -> list[Any]:
    """Return the product of two power series, as far as the shorter is known."""
    return [sum((a[j] * b[n - j] for j in range(n + 1)), sympy.S.Zero) for n in range(min(len(a), len(b)))]


def _power(a: list[Any], exponent: Any) -> list[Any]:
    """Return the power of a series that begins with 1."""
    found = [sympy.S.One]
    for n in range(1, len(a)):
        found.append(sum((exponent * j - n + j) * a[j] * found[n - j] for j in range(1, n + 1)) / n)
    return found


def _sum(terms: Any) -> Node:
    found: Node | None = None
    for factor, step, power in terms:
        exponent = from_sympy(power)
        powers = number(1) if power == 0 else step if power == 1 else step**exponent
        term = powers if factor == number(1) and power != 0 else factor if power == 0 else factor * powers
        found = term if found is None else found + term
    assert found is not None
    return found


FORMULA_QUESTIONS: Final[tuple[type[SingleQuestion], ...]] = (
    FormulaQuestion,
    FormulaOfQuestion,
    LimitQuestion,
    SeriesQuestion,
)
