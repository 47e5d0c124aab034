"""`ask: {of: block, at: {x: 2 m}}`: the speed of a body at a moment, or its velocity `along` a direction."""

from __future__ import annotations

from functools import reduce
from typing import Self

import numpy as np

from multibody_sym.algebra.quotients import Quotient
from multibody_sym.answers.ask.later_formulas import MotionFormulas, component_along
from multibody_sym.answers.ask.question import AskedMotion, RunNumbers, UniformQuestion
from multibody_sym.answers.ask.uniform_motion import UniformMotion
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.model.fields import AXES, Point
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import Moment
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node, add, multiply, quantity
from multibody_sym.text.values import Value


@dataclass(frozen=True)
class SpeedQuestion(UniformQuestion):
    """The speed of a point at a moment; with `along`, its velocity that way, which has a sign."""

    of: str
    at: Moment
    along: Point | None

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.of is None or ask.at is None else cls(ask.of, ask.at, ask.along)

    def unit(self, _motion: AskedMotion) -> str:
        return "m/s"

    @property
    def moment(self) -> Moment:
        return self.at

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.time(self.at)

    def number(self, numbers: RunNumbers) -> Value:
        time = numbers.time(self.at)
        if self.along is None:
            return Value(numbers.motion.speed(self.of, time))
        return Value(numbers.motion.velocity(self.of, time, numbers.direction(self.along)))

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_when(self.at)
        return course.value(course.along(self._expression()), place)

    def _expression(self) -> Node:
        if self.along is not None:
            return component_along("velocity", self.of, self.along)
        parts = [quantity("velocity", (self.of, axis)) for axis in AXES]
        return BUILD["sqrt"](reduce(add, (multiply(x, x) for x in parts)))

    def is_uniform(self) -> bool:
        return self.along is None and super().is_uniform()

    def uniform_time(self, uniform: UniformMotion) -> Quotient | None:
        return uniform.time_of(self.at)

    def uniform_answer(self, uniform: UniformMotion, time: Quotient) -> Quotient | None:
        return uniform.speed(self.of, time)

    def confirms(self, uniform: UniformMotion, time: float, answer: float) -> bool:
        v, a = uniform.rates(self.of)
        return bool(abs(float(np.linalg.norm(v + a * time)) - answer) <= AGREEMENT * answer)
