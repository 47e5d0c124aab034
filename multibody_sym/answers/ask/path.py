"""`ask: {of: block, after: 4 s}`: the path of a body in a time, or its displacement `along` a direction."""

from __future__ import annotations

from typing import Final, Self

import numpy as np

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.ask.later_formulas import MotionFormulas, component_along
from multibody_sym.answers.ask.question import AskedMotion, RunNumbers, UniformQuestion
from multibody_sym.answers.ask.uniform_motion import UniformMotion
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.answers.instant.letters import put_in
from multibody_sym.model.fields import Point
from multibody_sym.model.settings import Ask
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, subtract
from multibody_sym.text.values import Value

_TINY: Final = 1e-300


@dataclass(frozen=True)
class PathQuestion(UniformQuestion):
    """The length of the path of a point `after` a time; with `along`, its displacement that way, which has a sign."""

    of: str
    after: Node
    along: Point | None

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.of is None or ask.after is None else cls(ask.of, ask.after, ask.along)

    def unit(self, _motion: AskedMotion) -> str:
        return "m"

    def by_runs(self, motion: AskedMotion, notes: list[str]) -> Value:
        return Value(0.0) if motion.solved.rests else super().by_runs(motion, notes)

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.motion.number(self.after)

    def number(self, numbers: RunNumbers) -> Value:
        time = numbers.motion.number(self.after)
        if self.along is None:
            return Value(numbers.motion.path(self.of, time))
        return Value(numbers.motion.displacement(self.of, time, numbers.direction(self.along)))

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        if self.along is None:
            raise NoClosedFormError("a path has no formula")
        place = course.along(component_along("position", self.of, self.along))
        moved = subtract(place, put_in(place, {course.variable: ZERO}))
        return course.value(moved, course.place_after(self.after))

    def is_uniform(self) -> bool:
        return self.along is None

    def uniform_time(self, uniform: UniformMotion) -> Quotient:
        return uniform.given(self.after)

    def uniform_answer(self, uniform: UniformMotion, time: Quotient) -> Quotient | None:
        return uniform.path(self.of, time)

    def confirms(self, uniform: UniformMotion, time: float, answer: float) -> bool:
        v, a = uniform.rates(self.of)
        turn = min(max(-float(v @ a) / max(float(a @ a), _TINY), 0.0), time)
        there, end = (v * t + a * t * t / 2 for t in (turn, time))
        return abs(float(np.linalg.norm(there) + np.linalg.norm(end - there)) - answer) <= AGREEMENT * answer
