"""Answers to `ask`: expressions at the start; paths, times and speeds later on.

Where all accelerations are constant along the motion these are closed forms, otherwise numbers from a simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.answers.questions.uniform_motion import UniformMotion, uniform_motion
from multibody_sym.errors import ExpressionError, ModelError, at, suggestion
from multibody_sym.expressions.values import Value
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.states import StateCondition
from multibody_sym.model.mechanism.mass import OWN_POINTS
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.model.resolution.force_places import is_undetermined
from multibody_sym.scalars.node import Node


def answered(solved: Solved) -> tuple[dict[str, Value], list[str]]:
    """Return the answers to all questions of a system, and remarks on them.

    Raises ModelError for unknown names, RunError where a simulation that is needed fails.
    """
    answers: dict[str, Value] = {}
    remarks: list[str] = []
    motion = _Motion(solved, remarks)
    for name, question in solved.system.ask.items():
        with at("ask", name):
            if question.value is not None and is_undetermined(solved.mechanism.withheld, question.value):
                answers[name] = Value(None)
                remarks.append(f"{name}: it hangs on a reaction that is withheld")
            elif question.value is not None:
                (unit,) = MechanismUnits(solved.mechanism).of([question.value])
                answers[name] = solved.values(solved.asked(question.value), {"": unit})[""]
            else:
                _verify(solved, question)
                answers[name] = replace(motion.answer(name, question), unit=_unit(question))
    return answers, remarks


def _named(mechanism: Mechanism) -> list[str]:
    """Return the names of all that has a state."""
    return [name for x in mechanism.one_way for name in dict.fromkeys((x.name, *(part.name for part in x.frictions)))]


def _unit(question: Ask) -> str:
    if question.of is None:
        return "s"
    return "m" if question.after is not None else "m/s"


def _verify(solved: Solved, question: Ask) -> None:
    for coordinate in (*(question.when or ()), *(question.at or ())):
        quaternions = {k for body in solved.mechanism.bodies for places in body.quaternions for k in places}
        names = [c.name for k, c in enumerate(solved.mechanism.coordinates) if k not in quaternions]
        if coordinate not in names:
            raise ModelError(f"no coordinate is called {coordinate!r}{suggestion(coordinate, names)}")
    if question.begins is not None:
        question.begins.verify(_named(solved.mechanism))
    own = [f"{name}.{point}" for name in solved.system.bodies for point in OWN_POINTS]
    if question.of is not None and question.of not in (*solved.mechanism.markers, *own):
        with at("of"):
            raise ModelError(f"no body is called {question.of!r}{suggestion(question.of, solved.mechanism.markers)}")
    if question.after is not None and not solved.number(question.after) >= 0.0:
        with at("after"):
            raise ModelError("the time is negative")


@dataclass(frozen=True)
class _Motion:
    """The motion after the start, as far as it is asked for; `remarks` collects what the answers rest on."""

    solved: Solved
    remarks: list[str]

    @cached_property
    def uniform(self) -> UniformMotion | None:
        """The motion in closed form, if its accelerations are constant."""
        return uniform_motion(self.solved)

    @cached_property
    def simulated(self) -> Simulated:
        """The motion in numbers."""
        return Simulated(self.solved.system)

    def answer(self, name: str, question: Ask) -> Value:
        """Return the answer to a question about the motion."""
        if question.begins is not None:
            return self._at_state(name, question, question.begins)
        if self.uniform is not None:
            try:
                found = self._in_closed_form(self.uniform, name, question)
            except (NoClosedFormError, ExpressionError) as reason:
                self.solved.reasons[str(reason)] = None
                found = None
            if found is not None:
                return found
        return self._in_numbers(name, question)

    # --- closed forms ---------------------------------------------------------------------------------------------

    def _in_closed_form(self, uniform: UniformMotion, name: str, question: Ask) -> Value | None:
        time = self._time(uniform, question)
        if time is None:
            return self._never(name, question.when or question.at or {})
        closed: Quotient | None = time
        if question.of is not None:
            ask = uniform.path if question.after is not None else uniform.speed
            closed = ask(question.of, time)
        if closed is None or not uniform.confirms(question, float(time.sample), float(closed.sample)):
            return None
        if self.solved.mechanism.one_way and self.simulated.changes_before(float(time.sample)) is not None:
            return None
        for condition, until in uniform.broken(float(time.sample)):
            remark = f"{condition} holds until t = {until:.4g} s, and the answer takes it to hold longer"
            self.remarks.append(f"{name}: {remark}")
        return self.solved.value_of(closed) or Value(float(closed.sample))

    def _time(self, uniform: UniformMotion, question: Ask) -> Quotient | None:
        """Return the time that a question names or implies, None where its coordinate never has the value."""
        if question.after is not None:
            return uniform.given(question.after)
        ((coordinate, value),) = (question.when or question.at or {}).items()
        return uniform.time(coordinate, value)

    def _never(self, name: str, condition: Mapping[str, Node]) -> Value:
        self.remarks.append(f"{name}: {', '.join(condition)} never has this value")
        return Value(None)

    # --- numbers --------------------------------------------------------------------------------------------------

    def _at_state(self, name: str, question: Ask, begins: StateCondition) -> Value:
        time = self.simulated.begins(begins)
        if time is None:
            self.remarks.append(f"{name}: {begins} at no time before t_end of the simulation")
            return Value(None)
        return Value(time if question.of is None else self.simulated.speed(question.of, time))

    def _in_numbers(self, name: str, question: Ask) -> Value:
        if question.after is not None:
            assert question.of is not None
            if self.solved.rests:
                return Value(0.0)
            return Value(self.simulated.path(question.of, self.solved.number(question.after)))
        condition = question.when or question.at or {}
        ((coordinate, value),) = condition.items()
        time = self.simulated.time(coordinate, self.solved.number(value))
        if time is None:
            self.remarks.append(f"{name}: {coordinate} does not have this value before t_end of the simulation")
            return Value(None)
        return Value(time if question.of is None else self.simulated.speed(question.of, time))
