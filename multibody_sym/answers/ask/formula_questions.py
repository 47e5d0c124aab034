"""`ask: {formula: x}`, `{formula: N, of: theta}`: a formula of the time, of a coordinate or of a speed; no number."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import islice
from typing import Final, NamedTuple, Self

import numpy as np

from multibody_sym.algebra.quotients import NoClosedFormError, why_none
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.courses import FITS, least_conditions
from multibody_sym.answers.ask.energy_integral import courses_by_place, courses_by_speed, freedom_of
from multibody_sym.answers.ask.from_runs import ASKED, Simulated
from multibody_sym.answers.ask.later_formulas import MotionFormulas, in_letters
from multibody_sym.answers.ask.linear_systems import shortest_course
from multibody_sym.answers.ask.named_answers import Anywhere, anywhere
from multibody_sym.answers.ask.question import AskedMotion, SingleQuestion
from multibody_sym.answers.ask.working import Lines, Working, written
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.errors import ExpressionError
from multibody_sym.model.settings import Ask
from multibody_sym.model.state_words import VERBS, WAYS
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, negate, subtract, symbol
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

    expression: Node
    of: str

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.formula is None or ask.of is None else cls(ask.formula, ask.of)

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
        """Yield formulas that the run may confirm."""
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
            for root in roots(in_letters(there, subtract(along, shown.variable), near), self.expression):
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
        advanced = subtract(shown.variable, freedom.at_start(shown.variable))
        with there.assuming(freedom.granted):
            integral = freedom.root_integral(freedom.rates[freedom.momenta[shown.variable]])
            start = there.forms.of([freedom.start])[0]
            formula = _short(there, integral.inverse(start, advanced if freedom.sign > 0 else negate(advanced)))
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
        q, u = ([float(run[x.name][middle]) for x in group] for group in (mechanism.coordinates, mechanism.speeds))
        self.state = q, u
        names_of_all = [*(x.name for x in mechanism.coordinates), *(x.name for x in mechanism.speeds)]
        self.values = dict(zip(map(symbol, names_of_all), (*q, *u), strict=True))
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


FORMULA_QUESTIONS: Final[tuple[type[SingleQuestion], ...]] = (FormulaQuestion, FormulaOfQuestion)
