"""Answers in numbers: what runs of a system tell of a question of any kind but `find` and `formula`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Final

import numpy as np

from multibody_sym.analysis.modes.amplitude import NoPeriodError, period_of
from multibody_sym.answers.ask.extremes import extreme, size
from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.errors import at
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import STRIKES, Moment, StateCondition
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

HALF_OF_THE_DIGITS: Final = 1e-6
"""Relative, of numbers of runs: the root of their tolerance."""
_ROUNDING: Final = 1e-14
_MOMENT: Final = 1e-12
"""The part of a time to which runs find a moment: there a sum vanishes to rounding of its terms."""


_EQUAL: Final = 1e-6
"""The part of a value by which equal extremes of a run and of a coarser one differ at most."""
_TIME: Final = 1e-4
"""The error of the time of an extreme, as a part of it, where the coarser run has an equal one at another time."""


class NeverError(Exception):
    """What was asked for does not happen; its text says what that is."""


@dataclass(frozen=True)
class InNumbers:
    """Answers from runs of one motion; `told` collects what is to be said of them, `accuracy` how numbers are known."""

    motion: Simulated
    told: list[str] = field(default_factory=list)
    accuracy: list[str] = field(default_factory=list)

    def with_error(self, question: Ask) -> Value:
        """Return the answer to a question with its error: what coarser runs change, as far as finer ones have less.

        Where coarser runs have no answer, half of the digits are known, as of what a motion hardly reaches; where they
        come to another of equal extremes, four digits of the time. Raises NeverError.
        """
        found = self.answer(question)
        if found.error:
            return found
        assert found.value is not None
        try:
            coarse = InNumbers(self.motion.coarser).answer(question)
        except (FailedRunError, NeverError):
            half = HALF_OF_THE_DIGITS
            return replace(found, error=half * abs(found.value), t_error=half * abs(found.t or 0.0))
        pairs = (found.value, coarse.value), (found.t, coarse.t)
        error, t_error = (self._error(a or 0.0, b or 0.0) for a, b in pairs)
        if error <= _EQUAL * abs(found.value):
            t_error = min(t_error, _TIME * (found.t or 0.0))
        return replace(found, error=max(error, self._rounding(question)), t_error=t_error)

    def _error(self, number: float, coarse: float) -> float:
        """Return the error of a number that coarser runs change; what they change wholly is rounding about zero."""
        change = abs(number - coarse)
        return change if abs(number) <= change else self.motion.part_of_coarser * change

    def _rounding(self, question: Ask) -> float:
        """Return the rounding of an extreme, or an expression, beside the largest value until then, and of moments."""
        if question.max is not None or question.min is not None:
            return _ROUNDING * size(self.motion, question)
        if question.when is None and (question.value is None or question.after is None):
            return 0.0
        time = self.time(question)
        if question.value is None:
            return 0.0 if question.of is not None else _MOMENT * time
        largest, rate = self.motion.largest_and_rate(question.value, question.when, time)
        return _ROUNDING * largest + (0.0 if question.when is None else _MOMENT * time * rate)

    def answer(self, question: Ask) -> Value:
        """Return the answer to a question, without unit and error. Raises NeverError."""
        if question.value is not None:
            return Value(self._value(question, question.value))
        if question.max is not None or question.min is not None:
            found = extreme(self.motion, question)
            if found is None:
                raise NeverError("the motion ends before the time after which it is asked, or there is no value")
            self.told.extend(found.told)
            return Value(found.value, t=found.t)
        if question.period_of is not None:
            return self._period(question.period_of)
        return Value(self._course(question))

    def _value(self, question: Ask, asked: Node) -> float:
        if question.when is None:
            return self.motion.value(asked, 0.0 if question.after is None else self.time(question))
        found = self.motion.value_at(question.when, asked)
        if found is None:
            raise self._never(question.when)
        return found

    def _period(self, coordinate: str) -> Value:
        try:
            with at("period_of"):
                found = period_of(self.motion.system, coordinate)
        except NoPeriodError as reason:
            raise NeverError(str(reason)) from None
        self.accuracy.append(f"its number is known {found.how}")
        return found.value

    def time(self, question: Ask) -> float:
        """Return the time that a question names. Raises NeverError where its moment does not come."""
        if question.after is not None:
            return self.motion.number(question.after)
        moment = question.when if question.when is not None else question.at
        assert moment is not None
        time = self.motion.moment(moment, question.value)
        if time is None:
            raise self._never(moment)
        if time == 0.0:
            again = ", and does not begin to later, before t_end of the simulation"
            told = f"{_told(moment)} from the start on{again if isinstance(moment, StateCondition) else ''}"
            self.told.extend([told] if told not in self.told else [])
        return time

    def _never(self, moment: Moment) -> NeverError:
        at_start = False
        if isinstance(moment, Mapping):
            ((coordinate, value),) = moment.items()
            at_start = self.motion.starts_at(coordinate, self.motion.number(value))
        elif isinstance(moment, StateCondition) and moment.strikes:
            at_start = self.motion.strikes_at_start(moment.element)
        when = "at the start, and not again" if at_start else "at no time"
        told = f"{_told(moment)} {when} before t_end of the simulation"
        if isinstance(moment, StateCondition) and moment.closes:
            struck = self.motion.strikes(moment.element)
            if struck is not None:
                told += f"; {moment.element} strikes at t = {struck:.6g} s and bounces: ask {moment.element} {STRIKES}"
        return NeverError(told)

    def _course(self, question: Ask) -> float:
        """Return a time, a path or a displacement, a speed or a velocity."""
        time = self.time(question)
        if question.of is None:
            return time
        point, later = question.of, question.at is not None
        if question.along is not None:
            ask = self.motion.velocity if later else self.motion.displacement
            return ask(point, time, self._direction(question.along))
        return (self.motion.speed if later else self.motion.path)(point, time)

    def _direction(self, along: tuple[Node, ...]) -> list[float]:
        vector = np.array([self.motion.number(x) for x in along])
        return list((vector / np.linalg.norm(vector)).tolist())


def _told(moment: Moment) -> str:
    """Return a moment for people."""
    if isinstance(moment, Mapping):
        ((coordinate, value),) = moment.items()
        return f"{coordinate} = {text(value)}"
    return text(moment) if isinstance(moment, Node) else str(moment)
