"""`ask: fx(A)`, `{value: x, after: 2 s}`, `{value: x, when: y < 0}`: an expression at the start, a time or a moment."""

from __future__ import annotations

from typing import Self

from multibody_sym.algebra.quotients import Quotient
from multibody_sym.answers.ask.later_formulas import MotionFormulas
from multibody_sym.answers.ask.linear_systems import shortest_course
from multibody_sym.answers.ask.question import MOMENT, ROUNDING, AskedMotion, LaterQuestion, NumberQuestion, RunNumbers
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.answers.instant.letters import TIME, put_in
from multibody_sym.answers.instant.reactions import with_letters
from multibody_sym.mechanics.gears import undetermined_reactions
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import Moment
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.text.parser import of_run
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

_WITHHELD = "it hangs on a reaction that is withheld"


@dataclass(frozen=True)
class StartValueQuestion(NumberQuestion):
    """The value of an expression at the start."""

    value: Node

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.value is None or ask.when is not None or ask.after is not None else cls(ask.value)

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(self.value)

    def number(self, numbers: RunNumbers) -> Value:
        return Value(numbers.motion.value(self.value, 0.0))

    def answer(self, motion: AskedMotion, notes: list[str]) -> Value:
        if undetermined_reactions(motion.solved.mechanism.withheld, self.value):
            notes.append(_WITHHELD)
            return Value(None)
        return with_letters(motion.solved, motion.solved.asked(self.value), {"": self.unit(motion)})[""]


class _LaterValueQuestion(LaterQuestion):
    """The value of an expression later."""

    value: Node

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(self.value)

    def answer(self, motion: AskedMotion, notes: list[str]) -> Value:
        if undetermined_reactions(motion.solved.mechanism.withheld, self.value):
            notes.append(_WITHHELD)
            return Value(None)
        return super().answer(motion, notes)

    def is_of_run(self) -> bool:
        return of_run(self.value)


@dataclass(frozen=True)
class ValueAfterQuestion(_LaterValueQuestion):
    """The value of an expression `after` a time."""

    value: Node
    after: Node

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.value is None or ask.after is None else cls(ask.value, ask.after)

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.motion.number(self.after)

    def number(self, numbers: RunNumbers) -> Value:
        return Value(numbers.motion.value(self.value, numbers.motion.number(self.after)))

    def rounding(self, numbers: RunNumbers) -> float:
        time = numbers.motion.number(self.after)
        return ROUNDING * numbers.motion.largest_and_rate(self.value, None, time)[0]

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_after(self.after)
        return course.value(course.along(self.value), place)

    def shorter(self, found: Node, course: MotionFormulas) -> Node:
        """Return the formula of time, as a book writes it, with the time put in where that is shorter."""
        if course.variable is not TIME or self.after.shadow is not None:
            return found
        solved = course.there.solved
        number = evaluate_float([found], solved.sample)[0]
        written = put_in(shortest_course(course.along(self.value), solved.symbolic.letters, TIME), {TIME: self.after})
        near = abs(evaluate_float([written], solved.sample)[0] - number) <= AGREEMENT * abs(number)
        return written if near and len(text(written)) < len(text(found)) else found


@dataclass(frozen=True)
class ValueWhenQuestion(_LaterValueQuestion):
    """The value of an expression at a moment."""

    value: Node
    when: Moment

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.value is None or ask.when is None else cls(ask.value, ask.when)

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.time(self.when, self.value)

    def number(self, numbers: RunNumbers) -> Value:
        found = numbers.motion.value_at(self.when, self.value)
        if found is None:
            raise numbers.never(self.when)
        return Value(found)

    def rounding(self, numbers: RunNumbers) -> float:
        time = numbers.time(self.when, self.value)
        largest, rate = numbers.motion.largest_and_rate(self.value, self.when, time)
        return ROUNDING * largest + MOMENT * time * rate

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_when(self.when)
        return course.value(course.along(self.value), place)
