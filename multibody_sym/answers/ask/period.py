"""`ask: {period_of: phi}`: the period of a coordinate in the motion from the start, whatever its amplitude."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

from multibody_sym.algebra.quotient_functions import sign
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.algebra.roots import rate
from multibody_sym.analysis.modes.amplitude import NoPeriodError, period_of
from multibody_sym.answers.ask.courses import FITS
from multibody_sym.answers.ask.named_answers import Granted, anywhere
from multibody_sym.answers.ask.question import AskedMotion, NeverError, NumberQuestion, RunNumbers
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.errors import ExpressionError, at
from multibody_sym.model.settings import Ask
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, TWO, Node, multiply, symbol
from multibody_sym.text.values import Value


@dataclass(frozen=True)
class PeriodQuestion(NumberQuestion):
    """The period of a coordinate."""

    coordinate: str

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.period_of is None else cls(ask.period_of)

    def unit(self, _motion: AskedMotion) -> str:
        return "s"

    def number(self, numbers: RunNumbers) -> Value:
        try:
            with at("period_of"):
                found = period_of(numbers.motion.system, self.coordinate)
        except NoPeriodError as reason:
            raise NeverError(str(reason)) from None
        numbers.accuracy.append(f"its number is known {found.how}")
        return found.value

    def answer(self, motion: AskedMotion, notes: list[str]) -> Value:
        numbers = RunNumbers(motion.simulated)
        try:
            found = numbers.with_error(self)
        except NeverError as reason:
            notes.append(str(reason))
            return Value(None, unit="s")
        formula = self._formula(motion.solved, found.value or 0.0)
        notes.extend(numbers.accuracy if formula is None else ())
        return replace(motion.with_formula(found, formula), unit="s")

    def _formula(self, solved: SolvedInstant, number: float) -> Node | None:
        """Return 2 pi/sqrt(-A) where the coordinate has q'' = A q + c and this is the number; else None."""
        names = [c.name for c in solved.mechanism.coordinates]
        there = anywhere(solved, solved.begin.q, solved.begin.u) if self.coordinate in names else None
        if there is None or len(names) != len(solved.mechanism.speeds):
            return None
        q, acceleration = symbol(self.coordinate), there.forms.udot[names.index(self.coordinate)]
        if acceleration.symbols & (there.variables - {q}):
            return None
        try:
            slope = rate(acceleration, q)
            if slope.symbols & there.variables or slope.is_zero or sign(slope) > 0:
                return None
            formula = multiply(multiply(TWO, PI), BUILD["sqrt"](Granted().written(-slope.power(-1))))
            near = abs(evaluate_float([formula], solved.sample)[0] - number) <= FITS * number
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None
        return formula if near else None
