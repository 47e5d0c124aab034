"""`ask: {x: 2 m}`, `y < 0`, `c sticks`: the time at which a moment comes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.ask.later_formulas import NO_TIME, MotionFormulas
from multibody_sym.answers.ask.question import MOMENT, AskedMotion, RunNumbers, UniformQuestion
from multibody_sym.answers.ask.uniform_motion import UniformMotion
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.answers.instant.letters import TIME
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import Moment
from multibody_sym.records import dataclass
from multibody_sym.text.values import Value


@dataclass(frozen=True)
class TimeQuestion(UniformQuestion):
    """The time at which a moment comes."""

    when: Moment

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.when is None or ask.value is not None else cls(ask.when)

    def unit(self, _motion: AskedMotion) -> str:
        return "s"

    @property
    def moment(self) -> Moment:
        return self.when

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.time(self.when)

    def number(self, numbers: RunNumbers) -> Value:
        return Value(numbers.time(self.when))

    def rounding(self, numbers: RunNumbers) -> float:
        return MOMENT * numbers.time(self.when)

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_when(self.when)
        if course.variable is not TIME:
            raise NoClosedFormError(NO_TIME)
        return course.value(TIME, place)

    def uniform_time(self, uniform: UniformMotion) -> Quotient | None:
        return uniform.time_of(self.when)

    def uniform_answer(self, _uniform: UniformMotion, time: Quotient) -> Quotient:
        return time

    def confirms(self, uniform: UniformMotion, time: float, _answer: float) -> bool:
        assert isinstance(self.when, Mapping)
        ((coordinate, value),) = self.when.items()
        solved = uniform.solved
        k = uniform.place(coordinate)
        way = solved.number(value) - solved.begin.q[k]
        gone = [solved.begin.u[k] * time, solved.numbers.udot[k] * time * time / 2]
        return bool(abs(sum(gone) - way) <= AGREEMENT * max(map(abs, gone)))
