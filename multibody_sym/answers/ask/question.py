"""What a question is, and the motion that questions are about.

In: a solved start, and a question of one kind. Out: its answer: a number of runs with its error, and a closed form
where one has this value. The kinds stand in files of their own; `ask` has the list of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property, partial
from typing import ClassVar, Final, Self

import numpy as np

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient, why_none
from multibody_sym.analysis.modes.forced import ForcedMotion
from multibody_sym.answers.ask.energy_integral import courses_by_place, courses_by_speed
from multibody_sym.answers.ask.from_runs import Simulated, state_at
from multibody_sym.answers.ask.later_formulas import Bounces, MotionFormulas
from multibody_sym.answers.ask.linear_systems import AskedModes, Courses
from multibody_sym.answers.ask.named_answers import anywhere
from multibody_sym.answers.ask.uniform_motion import UniformMotion, uniform_motion
from multibody_sym.answers.ask.working import AT_START, BY_RUN, Working
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.mechanics.vocabulary import named_by
from multibody_sym.model.settings import Ask
from multibody_sym.model.state_words import STRIKES, Moment, StateCondition, moment_text
from multibody_sym.model.system import System
from multibody_sym.motion.methods.table import SUMMARIES
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import text
from multibody_sym.text.values import Quantity, Value


class NeverError(Exception):
    """The event that a question names does not happen; the text says which."""


class Question(ABC):
    """A question of one kind.

    `keys`: those of `Ask` that have its fields. `si_unit`: that of its answer, whatever is asked. `is_of_start`: it is
    about the start, though no expression has its answer.
    """

    keys: ClassVar[tuple[str, ...]] = ()
    si_unit: ClassVar[str] = ""
    is_of_start: ClassVar[bool] = False

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        """Return the question as it is written under `ask`; None if that is one of another kind."""
        given = [getattr(ask, key) for key in cls.keys]
        return None if any(x is None for x in given) else cls(*given)

    @abstractmethod
    def words(self) -> str:
        """Return the question for people."""

    def unit(self, _motion: AskedMotion) -> str:
        """Return the SI unit of the answer."""
        return self.si_unit

    def at_start(self) -> Node | None:
        """Return the expression whose value at the start is the answer, None where it is about later."""
        return None

    def is_later(self) -> bool:
        """Return whether it is about what happens after the start."""
        return self.at_start() is None and not self.is_of_start

    @property
    def is_of_small_motion(self) -> bool:
        """Whether it is about motions near a position of rest, wherever the start is."""
        return False

    @abstractmethod
    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        """Return the answers by the ends of their names: "" for one, ".x" and so on for components of a vector.

        `working` collects their conditions, or why they have no value, and how they are found. Raises FailedRunError.
        """


class SingleQuestion(Question):
    """A question with one answer."""

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        return {"": self.answer(motion, working)}

    @abstractmethod
    def answer(self, motion: AskedMotion, working: Working) -> Value:
        """Return the answer, as `answers` does."""


class NumberQuestion(SingleQuestion):
    """A question whose answer is a number, which runs have too."""

    @abstractmethod
    def number(self, numbers: RunNumbers) -> Value:
        """Return the answer by runs, without unit and error. Raises NeverError."""

    def rounding(self, _numbers: RunNumbers) -> float:
        """Return the error that rounding makes of the number."""
        return 0.0


class LaterQuestion(NumberQuestion):
    """A question about the motion after the start: closed forms are accepted where runs have the same number."""

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        unit = self.unit(motion)
        return replace(motion.later(self, working), unit=unit)

    @abstractmethod
    def time(self, numbers: RunNumbers, number: Value) -> float:
        """Return the time of the answer, which runs have as a number."""

    @abstractmethod
    def formula(self, course: MotionFormulas, time: float) -> Quotient:
        """Return the answer, which runs have at a time, in closed form along a course. Raises NoClosedFormError."""

    def shorter(self, found: Node, _course: MotionFormulas) -> Node:
        """Return a shorter way to write a closed form that was found, if there is one."""
        return found

    def start_value(self) -> Node | None:
        """Return the expression whose value at the start is the answer if its time is 0; None if there is none."""
        return None

    def is_start(self, start: float, number: Value) -> bool:
        """Return whether the value before an impact at the start is an answer as runs have it, which begin behind."""
        return abs(start - (number.value or 0.0)) <= number.error + CONFIRMED * abs(start)

    def is_of_run(self) -> bool:
        """Return whether an expression asked for has values along runs alone, such as an integral."""
        return False


class UniformQuestion(LaterQuestion):
    """A question whose answer has a closed form by the time alone where no acceleration changes."""

    @property
    def moment(self) -> Moment | None:
        """The moment that the question names, None where it names a time."""
        return None

    @abstractmethod
    def uniform_time(self, uniform: UniformMotion) -> Quotient | None:
        """Return the time named, None where the coordinate never has the value."""

    @abstractmethod
    def uniform_answer(self, uniform: UniformMotion, time: Quotient) -> Quotient | None:
        """Return the answer by the time, None where it is none that is known."""

    def uniform_lines(self, uniform: UniformMotion, time: Quotient, _answer: Quotient) -> Iterator[Line]:
        """Yield the lines that lead to the answer: here those that lead to the time of a moment."""
        if isinstance(self.moment, Mapping):
            yield from uniform.moment_lines(self.moment, time)

    @abstractmethod
    def confirms(self, uniform: UniformMotion, time: float, answer: float) -> bool:
        """Return whether the same answer follows from the accelerations in floats."""

    def is_uniform(self) -> bool:
        """Return whether a uniform motion answers the question: its moment is that of a coordinate's value."""
        return self.moment is None or isinstance(self.moment, Mapping)

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        found = None
        if motion.uniform is not None and self.is_uniform():
            try:
                found = self._in_closed_form(motion, motion.uniform, working)
            except (NoClosedFormError, ExpressionError) as reason:
                motion.solved.reasons[str(reason)] = None
        return replace(self.by_runs(motion, working) if found is None else found, unit=self.unit(motion))

    def by_runs(self, motion: AskedMotion, working: Working) -> Value:
        """Return the answer where the motion is not uniform, or this does not tell."""
        return motion.later(self, working)

    def _in_closed_form(self, motion: AskedMotion, uniform: UniformMotion, working: Working) -> Value | None:
        one_way, simulated = motion.solved.mechanism.one_way, motion.simulated
        time = self.uniform_time(uniform)
        if time is None:
            if uniform.granted or (one_way and simulated.whole.changes):
                return None
            assert isinstance(self.moment, Mapping)
            ((coordinate, value),) = self.moment.items()
            starts_there = uniform.way(coordinate, value).is_zero
            never = "has this value at the start, and never again" if starts_there else "never has this value"
            working.notes.append(f"{coordinate} {never}")
            return Value(None)
        closed = self.uniform_answer(uniform, time)
        if closed is None or not self.confirms(uniform, float(time.sample), float(closed.sample)):
            return None
        if one_way and simulated.changes_before(float(time.sample)) is not None:
            return None
        if uniform.ends_before(float(time.sample)) and not self._is_shown(simulated, float(closed.sample)):
            return None
        working.steps.append(lambda: self.uniform_lines(uniform, time, closed))
        return motion.solved.value_of(closed) or Value(float(closed.sample))

    def _is_shown(self, simulated: Simulated, closed: float) -> bool:
        """Return whether runs have the same answer. Raises FailedRunError where they have none."""
        try:
            number = self.number(RunNumbers(simulated)).value
        except NeverError:
            return False
        return number is not None and abs(closed - number) <= CONFIRMED * abs(number)


# ----------------------------------------------------------------------------------------------------------------------
# Answers by runs, with their errors.

_HALF_OF_THE_DIGITS: Final = 1e-6
"""Relative, of numbers of runs: the root of their tolerance."""
ROUNDING: Final = 1e-14
"""The part of the largest value until then that is rounding."""
MOMENT: Final = 1e-12
"""The part of a time to which runs find a moment: there a sum vanishes to rounding of its terms."""
_EQUAL: Final = 1e-6
"""The part of a value by which equal extremes of a run and of a coarser one differ at most."""
_TIME: Final = 1e-4
"""The error of the time of an extreme, as a part of it, where the coarser run has an equal one at another time."""


@dataclass(frozen=True)
class RunNumbers:
    """Numbers from runs of one motion: `notes` on answers, and in `accuracy` how well these are known."""

    motion: Simulated
    notes: list[str] = field(default_factory=list)
    accuracy: list[str] = field(default_factory=list)

    def with_error(self, question: NumberQuestion) -> Value:
        """Return the answer to a question with its error: what coarser runs change, as far as finer ones have less.

        Where coarser runs have no answer, half of the digits are known, as of what a motion hardly reaches; where they
        come to another of equal extremes, four digits of the time. Raises NeverError.
        """
        found = question.number(self)
        if found.error:
            return found
        assert found.value is not None
        try:
            coarse = question.number(RunNumbers(self.motion.coarser))
        except (FailedRunError, NeverError):
            half = _HALF_OF_THE_DIGITS
            return replace(found, error=half * abs(found.value), t_error=half * abs(found.t or 0.0))
        pairs = (found.value, coarse.value), (found.t, coarse.t)
        error, t_error = (self._error(a or 0.0, b or 0.0) for a, b in pairs)
        if error <= _EQUAL * abs(found.value):
            t_error = min(t_error, _TIME * (found.t or 0.0))
        return replace(found, error=max(error, question.rounding(self)), t_error=t_error)

    def _error(self, number: float, coarse: float) -> float:
        """Return the error of a number that coarser runs change; what they change wholly is rounding about zero."""
        change = abs(number - coarse)
        return change if abs(number) <= change else self.motion.part_of_coarser * change

    def lines(self, found: Value, time: float) -> Iterator[Line]:
        """Yield how an answer was found, to which a run until a time leads: method, tolerance, checks."""
        run = self.motion.until(time)
        method = run.problem.method.name
        yield BY_RUN
        how = f"by {method} ({SUMMARIES[method]}), relative tolerance {self.motion.rtol:g}, until t = "
        yield Sentence((how, Quantity(time, "s")))
        energy = run.energy
        largest = float(np.abs(energy).max(initial=0.0))
        change = float(np.abs(energy - energy[0]).max(initial=0.0))
        if largest > 0.0 and change <= _KEPT * largest and not run.changes:
            kept = Quantity(float(energy[0]), "J")
            yield Sentence(("check: the total energy of ", kept, f" changes by {change:.0e} J"))
        if found.error:
            known = f"by runs with other tolerances the answer is known to {found.error:.0e} {found.unit}"
            yield Sentence((known.strip(),))

    def time(self, moment: Moment, asked: Node | None = None) -> float:
        """Return the time of a moment, at which a value may be `asked`. Raises NeverError where it does not come."""
        time = self.motion.moment(moment, asked)
        if time is None:
            raise self.never(moment)
        if time == 0.0:
            again = ", and does not begin to later, before t_end of the simulation"
            note = f"{moment_text(moment)} from the start on{again if isinstance(moment, StateCondition) else ''}"
            self.notes.extend([note] if note not in self.notes else [])
        return time

    def never(self, moment: Moment) -> NeverError:
        """Return the error that a moment does not come."""
        at_start = False
        if isinstance(moment, Mapping):
            ((coordinate, value),) = moment.items()
            at_start = self.motion.starts_at(coordinate, self.motion.number(value))
        elif isinstance(moment, StateCondition) and moment.strikes:
            at_start = self.motion.strikes_at_start(moment.element)
        when = "at the start, and not again" if at_start else "at no time"
        message = f"{moment_text(moment)} {when} before t_end of the simulation"
        if isinstance(moment, StateCondition) and moment.closes:
            struck = self.motion.strikes(moment.element)
            if struck is not None:
                strikes = f"{moment.element} strikes at t = {struck:.6g} s and bounces"
                message += f"; {strikes}: ask {moment.element} {STRIKES}"
        return NeverError(message)

    def direction(self, along: tuple[Node, ...]) -> list[float]:
        """Return the unit vector along a direction of any length."""
        vector = np.array([self.motion.number(x) for x in along])
        return list((vector / np.linalg.norm(vector)).tolist())


# ----------------------------------------------------------------------------------------------------------------------
# The motion, and closed forms that have the numbers of its runs.

_BESIDE: Final = 0.9
"""The part of the time to a moment at which a state is regular in which the motion may turn there."""
_PUT_IN: Final = Sentence(("put in, in numbers, since the formula is too long to be read",))
_KEPT: Final = 1e-7
"""The part of its largest size by which an energy that is kept changes in a run."""
_STANDS: Final = 1e-7
"""The part of its largest value below which a speed is zero."""
CONFIRMED: Final = 1e-8
"""How near, relative to it, a closed form must come to a number of runs."""
_DIGITS_LOST: Final = 1e-12
"""The part of its value by which a formula may miss in floats that is taken in place of a longer one."""
_LONGEST: Final = 400
"""Letters of a formula that tells more than its number does."""
SHORT: Final = 60
"""Letters of a formula for which no shorter one is looked for."""


@dataclass(frozen=True)
class AskedMotion:
    """The motion from a solved start, as far as questions need it.

    `answers`: those so far, by name. `solve`: solves another system and returns its answers, and remarks on them.
    """

    solved: SolvedInstant
    answers: Mapping[str, Value]
    solve: Callable[[System], tuple[SolvedInstant, Mapping[str, Value], list[str]]]
    _forced: dict[str, ForcedMotion] = field(default_factory=dict)

    def answers_named(self, question: Ask) -> dict[str, Value]:
        """Return the answers that a question names."""
        return {name: self.answers[name] for name in named_by(question, self.answers, self.solved.mechanism.symbols)}

    @cached_property
    def uniform(self) -> UniformMotion | None:
        """The motion in closed form, if its accelerations are constant."""
        return uniform_motion(self.solved)

    @cached_property
    def simulated(self) -> Simulated:
        return Simulated(self.solved.system)

    @cached_property
    def courses(self) -> Courses:
        """Coordinates and speeds as formulas of time that the motion in numbers confirms."""
        return Courses(self.solved, self.simulated)

    @cached_property
    def modes(self) -> AskedModes:
        """The small oscillations."""
        return AskedModes(self.solved.system, self.solved.symbolic.letters)

    def forced(self, name: str) -> ForcedMotion:
        """Return the steady motion under a harmonic input. Raises NoSolutionError where there is none."""
        if name not in self._forced:
            self._forced[name] = ForcedMotion.of(self.solved.system, name)
        return self._forced[name]

    def unit_of(self, asked: Node) -> str:
        """Return the SI unit of an expression, which may name answers."""
        if asked == TIME:
            return "s"
        if asked.op == "quantity" and asked.data[0] == "'" and asked.data[1][0] in self.solved.mechanism.rate_units:
            return self.solved.mechanism.rate_units[asked.data[1][0]]  # Pa/s: no unit that units of a rate are made of
        units = {name: answer.unit for name, answer in self.answers.items() if answer.unit}
        (unit,) = MechanismUnits(self.solved.mechanism, units).of([asked])
        return unit

    def later(self, question: LaterQuestion, working: Working) -> Value:
        """Return the answer by runs, with the closed form that has its value, if one is found."""
        numbers = RunNumbers(self.simulated)
        try:
            found = numbers.with_error(question)
            time = question.time(numbers, found)
        except NeverError as reason:
            working.notes.append(str(reason))
            return Value(None)
        working.notes.extend(numbers.notes)
        formula = self._formula(question, found, time, working)
        if formula is None and not (working.steps and _PUT_IN in working.lines()):
            working.steps.append(lambda: numbers.lines(replace(found, unit=question.unit(self)), time))
        return self.with_formula(found, formula)

    def with_formula(self, number: Value, formula: Node | None) -> Value:
        """Return a number of runs; where it has a formula, the formula's own value."""
        if formula is None:
            return number
        value = evaluate_float([formula], self.solved.sample)[0]
        return replace(number, value=value, expression=formula, error=0.0)

    def _formula(self, question: LaterQuestion, number: Value, time: float, working: Working) -> Node | None:
        """Return the closed form of an answer, of what happens at a time, None where none has the number's value."""
        if number.value is None or question.is_of_run():
            return None
        if time == 0.0 and (asked := question.start_value()) is not None:
            start = self.solved.values(self.solved.asked(asked), {})[""]
            if not question.is_start(start.value or 0.0, number):
                self.solved.reasons.setdefault("it is behind an impact at the start")
                return None
            end = Quantity(self.simulated.whole.t_final, "s")
            shown = Sentence(("as a run shows, until t = ", end, " it is nowhere beyond that"))
            working.steps.append(lambda: [AT_START, shown])
            return start.expression
        shortest: tuple[Node, list[str], MotionFormulas] | None = None
        unsolved: list[MotionFormulas] = []
        for course in self._courses(time):
            try:
                closed = question.formula(course, time)
                found = self._confirmed(closed, number.value)
                if found is not None and len(text(found)) > SHORT:
                    found = question.shorter(found, course)
            except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
                self.solved.reasons.setdefault(why_none(reason))
                unsolved += [course] if course.variable is not TIME else []
                continue
            if found is None or (shortest is not None and self._loses_digits(found, float(closed.sample))):
                continue
            if shortest is None or len(text(found)) < len(text(shortest[0])):
                shortest = found, list(course.granted()), course
            if shortest is not None and len(text(shortest[0])) <= SHORT:
                break
        if shortest is None:
            working.steps.extend(partial(course.law, (TIME,)) for course in unsolved[:1])
            return None
        if len(text(shortest[0])) > _LONGEST:
            self.solved.reasons.setdefault("the closed form is too long")
            working.steps.extend((shortest[2].lines, lambda: [_PUT_IN]))
            return None
        formula, granted, course = shortest
        working.notes.extend(granted)
        working.steps.append(course.lines)
        return formula

    def _loses_digits(self, found: Node, value: float) -> bool:
        """Return whether terms of a formula cancel, as its value in floats shows beside the exact one."""
        return abs(evaluate_float([found], self.solved.sample)[0] - value) > _DIGITS_LOST * abs(value)

    def _courses(self, time: float) -> Iterator[MotionFormulas]:
        if self.simulated.changes_before(time * (1.0 - CONFIRMED)) is not None:
            there, run = self.courses.shown.there, self.simulated.until(time)
            with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
                bounces = None if there is None else Bounces.of(there, self.courses, run)
                if bounces is not None:
                    yield bounces.course(time)
            return
        mechanism, run = self.solved.mechanism, self.simulated.until(time)
        q, u = state_at(run, mechanism, -1)
        there = anywhere(self.solved, q, u)
        if there is None:
            return
        if self.courses.alone or len(q) > 1:
            yield MotionFormulas(there, TIME, self.courses.of, time, law=self.courses.equations)
        fastest = [float(np.abs(run[x.name]).max()) for x in mechanism.speeds]
        u = [0.0 if abs(x) <= _STANDS * most else x for x, most in zip(u, fastest, strict=True)]
        place = int(_BESIDE * (len(run.t) - 1))
        yield from courses_by_place(there, (q, u), state_at(run, mechanism, place))
        yield from courses_by_speed(there, u)

    def _confirmed(self, closed: Quotient, number: float) -> Node | None:
        """Return a closed form as an expression where it is the number that was found, else None."""
        if abs(float(closed.sample) - number) > CONFIRMED * abs(number):
            return None
        value = self.solved.value_of(closed)
        return None if value is None else value.expression
