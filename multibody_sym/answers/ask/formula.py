"""`ask: {formula: x}`: a coordinate or speed as a formula of time."""

from __future__ import annotations

from typing import Self

from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.answers.ask.linear_systems import shortest_course
from multibody_sym.answers.ask.question import AskedMotion, Question
from multibody_sym.answers.instant.letters import TIME
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import VERBS, WAYS
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import symbol
from multibody_sym.text.values import Value


@dataclass(frozen=True)
class FormulaQuestion(Question):
    """A coordinate or speed as a formula of time, which has no number."""

    coordinate: str

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.formula is None else cls(ask.formula)

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.coordinate))

    def answer(self, motion: AskedMotion, notes: list[str]) -> Value:
        mechanism, unit = motion.solved.mechanism, self.unit(motion)
        found = motion.courses.of(symbol(self.coordinate))
        if motion.simulated.failure is not None:
            raise motion.simulated.failure
        if found is None:
            notes.append(f"{self._why_none(motion)}; simulate tells numbers")
            return Value(None, unit=unit)
        notes.extend(found.conditions())
        if mechanism.one_way:
            notes.append(_held_until(motion.simulated))
        return Value(None, shortest_course(found.formula, motion.solved.symbolic.letters, TIME), unit=unit)

    def _why_none(self, motion: AskedMotion) -> str:
        mechanism, courses = motion.solved.mechanism, motion.courses
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
