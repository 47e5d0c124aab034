"""`ask: {action: theta}`: the action J of a coordinate, and the frequency dE/dJ of its angle variable.

    J = 1/(2 pi) closed integral of p dq        frequency = dE/dJ = 2 pi/T

J is an adiabatic invariant: it stays while parameters change slowly. In: a solved start. Out: J and the frequency of
the motion from there; in steps both as functions of the energy.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Final, Self

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.analysis.modes.modes import NoPeriodError
from multibody_sym.answers.ask.energy_integral import ToAndFro
from multibody_sym.answers.ask.later_formulas import in_book_form
from multibody_sym.answers.ask.number_questions import AdvanceQuestion, PeriodQuestion
from multibody_sym.answers.ask.question import AskedMotion, NeverError, NumberQuestion, RunNumbers
from multibody_sym.answers.ask.working import OMEGA, OMEGA_0, Working, equation
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME
from multibody_sym.answers.instant.reactions import with_letters
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.derivation.canonical import cyclic_speeds
from multibody_sym.errors import at
from multibody_sym.model.settings import Ask
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, TWO, Node, divide, multiply, quantity, symbol
from multibody_sym.text.values import Value

FREQUENCY: Final = ".frequency"
"""The end of the name of the second answer."""
_ACTION: Final = symbol("J")
_MODULI: Final = ("k", "kappa", "k_0")
"""Letters of the modulus of elliptic integrals, in the order of preference: the first that the model does not have."""


@dataclass(frozen=True)
class ActionQuestion(NumberQuestion):
    """The action of a coordinate, and the frequency of its angle."""

    coordinate: str

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.action is None else cls(ask.action)

    def words(self) -> str:
        return f"the action of {self.coordinate}"

    @property
    def momentum(self) -> Node:
        """The momentum of the coordinate."""
        return quantity("generalized_momentum", (self.coordinate,))

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(multiply(symbol(self.coordinate), self.momentum))

    def number(self, numbers: RunNumbers) -> Value:
        try:
            with at("action"):
                found = numbers.motion.swing(self.coordinate).action
        except NoPeriodError as reason:
            raise NeverError(str(reason)) from None
        numbers.accuracy.append(f"its number is known {found.how}")
        return found.value("")

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        return self.answers(motion, working)[""]

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        unit, cyclic = self.unit(motion), _cyclic(motion.solved)
        if self.coordinate in cyclic:
            return self._of_cyclic(motion, unit, cyclic, working)
        numbers = RunNumbers(motion.simulated)
        try:
            found, period = (numbers.with_error(x) for x in (self, PeriodQuestion(self.coordinate)))
        except NeverError as reason:
            working.notes.append(str(reason))
            return {"": Value(None, unit=unit)}
        assert period.value is not None
        swing = ToAndFro.of(motion.solved, self.coordinate)
        formula = None if swing is None else swing.confirmed(swing.action, found.value or 0.0)
        seconds = None if swing is None else swing.confirmed(partial(swing.whole, TIME), period.value)
        frequency = Value(2 * math.pi / period.value, error=2 * math.pi * period.error / period.value**2)
        form = None
        if swing is not None and seconds is not None:
            form = in_book_form(swing.freedom.there, divide(multiply(TWO, PI), seconds), {})
        if formula is None:
            working.notes.append(numbers.accuracy[0])
        if swing is None:
            working.steps.append(lambda: [Sentence(("the integral of p dq over a period, by 2 pi",))])
            working.steps.append(lambda: numbers.lines(replace(found, unit=unit), period.value or 0.0))
        else:
            working.steps.append(lambda: self._lines(swing, closed=formula is not None))
        return {
            "": replace(motion.with_formula(found, formula), unit=unit),
            FREQUENCY: replace(motion.with_formula(frequency, form), unit="rad/s"),
        }

    def _lines(self, swing: ToAndFro, *, closed: bool) -> Iterator[Line]:
        """Yield the energy, J by the energy, and the derivative that is the frequency."""
        with suppress(NoClosedFormError):
            swing = swing.by_energy()
        freedom = swing.freedom
        yield from freedom.lines([])
        momentum = multiply(freedom.inertia, freedom.speed)
        yield Sentence((_ACTION, " is the integral of ", momentum, " by ", freedom.variable, " over a period, by 2 pi"))
        if not closed:
            yield Sentence(("it is no elementary function that is known: numbers integrate it",))
            parts = swing.elliptic()
            if parts is not None:
                mass, square, modulus = parts
                yield equation(multiply(OMEGA_0, OMEGA_0), square, "a pendulum with")
                k = next(x for x in _MODULI if symbol(x) not in freedom.there.solved.mechanism.symbols)
                yield equation(multiply(symbol(k), symbol(k)), modulus)
                yield Sentence((f"J = 8/pi*M*omega_0*(E({k}) - (1 - {k}^2)*K({k})), T = 4*K({k})/omega_0, M = ", mass))
                yield Sentence((f"K and E are the complete elliptic integrals of the modulus {k}",))
            return
        action = swing.action()
        if freedom.energy is None:
            yield equation(_ACTION, action)
            return
        yield equation(_ACTION, action, "by the energy")
        yield Sentence((action, " stays constant while parameters change slowly: an adiabatic invariant"))
        ratio = divide(symbol("dE"), symbol("dJ"))
        yield Formula((OMEGA, ratio, swing.rate_by_energy(action)), before=("the angle variable grows with",))

    def _of_cyclic(self, motion: AskedMotion, unit: str, cyclic: list[str], working: Working) -> Mapping[str, Value]:
        """Return the momentum, which is conserved, and the mean rate of the coordinate."""
        solved = motion.solved
        found = with_letters(solved, solved.asked(self.momentum), {"": unit})[""]
        working.steps.append(lambda: [Sentence((f"nothing depends on {self.coordinate}: J is its momentum",))])
        others = [x.name for x in solved.mechanism.coordinates if x.name not in cyclic]
        if not others:
            rate = with_letters(solved, solved.asked(quantity("'", (self.coordinate,))), {"": "rad/s"})[""]
            return {"": found, FREQUENCY: rate}
        if len(others) > 1:
            working.notes.append(f"{self.coordinate} advances beside {', '.join(others)}, which have no one period")
            return {"": found}
        advance = AdvanceQuestion(self.coordinate, others[0])
        moved, period = (x.answer(motion, Working()) for x in (advance, PeriodQuestion(others[0])))
        if moved.value is None or period.value is None:
            working.notes.append(f"{others[0]} has no period, by which the mean rate of {self.coordinate} is known")
            return {"": found}
        error = moved.error / period.value + abs(moved.value) * period.error / period.value**2
        rate = Value(moved.value / period.value, unit="rad/s", error=error)
        there = motion.courses.shown.there
        if there is not None and moved.expression is not None and period.expression is not None:
            form = in_book_form(there, divide(moved.expression, period.expression), {})
            rate = replace(motion.with_formula(rate, form), unit="rad/s")
        words = f"its mean rate: the advance of {self.coordinate} in a period of {others[0]}, by that period"
        working.steps.append(lambda: [Sentence((words,))])
        return {"": found, FREQUENCY: rate}


def _cyclic(solved: SolvedInstant) -> list[str]:
    """Return the coordinates on which nothing depends."""
    mechanism = solved.mechanism
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    return [mechanism.coordinates[pairs[u]].name for u in cyclic_speeds(mechanism) if u in pairs]
