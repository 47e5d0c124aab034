"""Answers to `ask`, each question by its kind, those first whose answers others name.

Where all accelerations are constant along the motion these are closed forms, otherwise numbers from a simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.ask.courses import formula_of_period, held_until
from multibody_sym.answers.ask.find import Search, extremes_of
from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.answers.ask.in_numbers import InNumbers, NeverError
from multibody_sym.answers.ask.later_formulas import FOUND, LaterForms
from multibody_sym.answers.ask.linear_systems import AskedModes, Courses, modes_named, shortest_course
from multibody_sym.answers.ask.named_answers import TIME, with_answers
from multibody_sym.answers.ask.uniform_motion import UniformMotion, uniform_motion
from multibody_sym.answers.instant.instant import Solved, solved_start, with_outputs_put_in
from multibody_sym.answers.instant.reactions import is_lettered, told
from multibody_sym.dynamics.start.number_checks import verify_asked
from multibody_sym.errors import ExpressionError, ModelError, NoSolutionError, at
from multibody_sym.mechanics.gears import is_undetermined
from multibody_sym.mechanics.questions import in_order, named_by
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import Moment
from multibody_sym.model.system import System
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.values import Value


def answered(solved: Solved) -> tuple[dict[str, Value], list[str]]:
    """Return the answers to all questions of a system, and remarks on them.

    A question whose simulation fails has no answer, and a remark tells why. Raises ModelError for unknown names.
    """
    solved = with_outputs_put_in(solved)
    _verify_time(solved)
    answers: dict[str, Value] = {}
    given: dict[str, Value] = {}
    lettered: dict[str, Node] = {}
    remarks: list[str] = []
    motion, reasons = _Motion(solved, remarks), _Reasons(solved)
    for name in in_order(solved.system.ask, solved.mechanism.symbols):
        with at("ask", name):
            named = with_answers(solved.system.ask[name], answers, solved.mechanism.symbols, lettered)
            if named is None:
                answers[name] = Value(None)
                remarks.append(f"{name}: it hangs on an answer that has no value")
                continue
            question, closed = named
            verify_asked(question, solved.sample)
            reasons.begin()
            try:
                found = motion.asked(name, question, answers)
            except FailedRunError as failed:
                found = Value(None)
                remarks.append(f"{name}: it has no answer, since the simulation fails: {failed.message}")
            given[name] = answers[name] = found if closed else replace(found, expression=None)
            if is_lettered(solved, given[name]) and question.value is not None:
                answers[name], lettered[name] = replace(found, expression=None), question.value
            reasons.end(name, needed=found.expression is None)
    reasons.told()
    return {name: given.get(name, answers[name]) for name in solved.system.ask}, remarks


def _verify_time(solved: Solved) -> None:
    """Raise ModelError where runs that answer questions would last no time."""
    end = solved.number(solved.system.simulation.t_end) if solved.system.ask else 1.0
    if not end > 0.0:
        with at("simulation", "t_end"):
            raise ModelError(f"expected a positive number, got {end:g}: questions are about the motion until then")


class _Reasons:
    """Why answers have no formulas: what is added to a system's reasons meanwhile, with the answers' names."""

    def __init__(self, solved: Solved) -> None:
        self.shared, self.before = solved.reasons, dict(solved.reasons)
        self.names: dict[str, list[str]] = {}

    def begin(self) -> None:
        """Set the reasons of others aside."""
        self.before.update(self.shared)
        self.shared.clear()

    def end(self, name: str, *, needed: bool) -> None:
        """Keep what was added if an answer `needed` it, having no formula."""
        for reason in self.shared if needed else ():
            self.names.setdefault(reason, []).append(name)
        self.shared.clear()

    def told(self) -> None:
        """Put all reasons back."""
        self.shared.update(self.before)
        self.shared.update({f"{', '.join(names)}: {reason}": None for reason, names in self.names.items()})


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

    def asked(self, name: str, question: Ask, answers: Mapping[str, Value]) -> Value:
        """Return the answer to a question of any kind; raises FailedRunError where a run that it needs fails."""
        if question.so is not None:
            return self.found(name, question, answers)
        return self.of_modes(name, question) if modes_named(question) else self.answer(name, question)

    def answer(self, name: str, question: Ask) -> Value:
        """Return the answer to a question of the motion, which names no modes."""
        if question.value is not None:
            return self._value(name, question, question.value)
        if question.max is not None or question.min is not None:
            return self._extreme(name, question)
        if question.formula is not None:
            return self._formula(name, question.formula)
        if question.period_of is not None:
            return replace(self._later(name, question), unit="s")
        return replace(self._course(name, question), unit=_unit(question))

    # --- expressions ----------------------------------------------------------------------------------------------

    def _value(self, name: str, question: Ask, asked: Node) -> Value:
        if is_undetermined(self.solved.mechanism.withheld, asked):
            self.remarks.append(f"{name}: it hangs on a reaction that is withheld")
            return Value(None)
        unit = self._unit_of(asked)
        if question.when is None and question.after is None:
            return told(self.solved, self.solved.asked(asked), {"": unit})[""]
        return replace(self._later(name, question), unit=unit)

    def of_modes(self, name: str, question: Ask) -> Value:
        """Return the answer to a question that names frequencies or periods of small oscillations."""
        asked = self.modes
        try:
            if question.value is not None and modes_named(question) == [question.value]:
                found = asked.value(question.value)
            else:
                changed, closed = asked.put_in(question)
                found = replace(self.answer(name, changed), unit=self._unit_asked(question))
                found = found if closed else replace(found, expression=None)
        except NoSolutionError as reason:
            self.remarks.append(f"{name}: {reason.message}")
            return Value(None)
        self.remarks.extend(each for each in asked.remarks() if each not in self.remarks)
        return found

    def _unit_asked(self, question: Ask) -> str:
        asked = next((x for x in (question.value, question.max, question.min) if x is not None), None)
        return _unit(question) if asked is None else self._unit_of(asked)

    @cached_property
    def modes(self) -> AskedModes:
        """The small oscillations, as far as they are asked for."""
        return AskedModes(self.solved.system, self.solved.symbolic.letters)

    def _unit_of(self, asked: Node) -> str:
        if asked == TIME:
            return "s"
        (unit,) = MechanismUnits(self.solved.mechanism).of([asked])
        return unit

    def _extreme(self, name: str, question: Ask) -> Value:
        asked = question.max if question.max is not None else question.min
        assert asked is not None
        return replace(self._later(name, question), unit=self._unit_of(asked))

    def found(self, name: str, question: Ask, answers: Mapping[str, Value]) -> Value:
        """Return the value for which an equation between answers holds."""
        assert question.so is not None
        asked = named_by(question, self.solved.system.ask, self.solved.mechanism.symbols)
        if any(self.solved.system.ask[x].formula is not None for x in asked):
            self.remarks.append(f"{name}: it hangs on an answer that has no value")
            return Value(None)
        extremes = {key: self._extreme(name, each) for key, each in extremes_of(question.so).items()}
        known = {**{x: answers[x] for x in asked}, **extremes}
        value, remarks = Search(self.solved, question, known, _answers_of).found()
        self.remarks.extend(f"{name}: {remark}" for remark in remarks)
        return value

    # --- formulas of time -----------------------------------------------------------------------------------------

    @cached_property
    def courses(self) -> Courses:
        """Coordinates and speeds as formulas of time, those that the motion in numbers confirms."""
        return Courses(self.solved, self.simulated)

    def _formula(self, name: str, coordinate: str) -> Value:
        mechanism = self.solved.mechanism
        unit = self._unit_of(symbol(coordinate))
        found = self.courses.of(symbol(coordinate))
        if self.simulated.failure is not None:
            raise self.simulated.failure
        if found is None:
            rates = zip(mechanism.coordinates, mechanism.speeds, strict=False)
            speed = next((u.name for q, u in rates if q.name == coordinate), "")
            reason = self.courses.why(symbol(coordinate))
            what = f"no solution of the equation of {coordinate} is known{reason and f' ({reason})'}"
            if speed and symbol(speed) in self.courses.alone:
                what = f"no integral of {speed} is known, which has a formula of its own"
            self.remarks.append(f"{name}: {what}; simulate tells numbers")
            return Value(None, unit=unit)
        self.remarks.extend(f"{name}: {condition}" for condition in found.conditions())
        if mechanism.one_way:
            self.remarks.append(f"{name}: {held_until(self.simulated)}")
        formula = shortest_course(found.formula, self.solved.symbolic.letters, TIME)
        return Value(None, formula, unit=unit)

    # --- paths, times and speeds ----------------------------------------------------------------------------------

    def _course(self, name: str, question: Ask) -> Value:
        moment = question.when if question.when is not None else question.at
        if self.uniform is not None and question.along is None and (moment is None or isinstance(moment, Mapping)):
            try:
                found = self._in_closed_form(self.uniform, name, question)
            except (NoClosedFormError, ExpressionError) as reason:
                self.solved.reasons[str(reason)] = None
                found = None
            if found is not None:
                return found
        return self._later(name, question)

    def _in_closed_form(self, uniform: UniformMotion, name: str, question: Ask) -> Value | None:
        time = self._closed_time(uniform, question)
        if time is None:
            if uniform.granted or (self.solved.mechanism.one_way and self.simulated.whole.changes):
                return None
            return self._never(name, uniform, question.when or question.at)
        closed: Quotient | None = time
        if question.of is not None:
            ask = uniform.path if question.after is not None else uniform.speed
            closed = ask(question.of, time)
        if closed is None or not uniform.confirms(question, float(time.sample), float(closed.sample)):
            return None
        if self.solved.mechanism.one_way and self.simulated.changes_before(float(time.sample)) is not None:
            return None
        if uniform.ends_before(float(time.sample)) and not self._is_shown(question, float(closed.sample)):
            return None
        return self.solved.value_of(closed) or Value(float(closed.sample))

    def _is_shown(self, question: Ask, closed: float) -> bool:
        """Return whether runs have the same answer. Raises FailedRunError where they have none."""
        try:
            number = InNumbers(self.simulated).answer(question).value
        except NeverError:
            return False
        return number is not None and abs(closed - number) <= FOUND * abs(number)

    def _closed_time(self, uniform: UniformMotion, question: Ask) -> Quotient | None:
        """Return the time that a question names or implies, None where its coordinate never has the value."""
        if question.after is not None:
            return uniform.given(question.after)
        moment = question.when or question.at
        assert isinstance(moment, Mapping)
        ((coordinate, value),) = moment.items()
        return uniform.time(coordinate, value)

    def _never(self, name: str, uniform: UniformMotion, moment: Moment | None) -> Value:
        assert isinstance(moment, Mapping)
        ((coordinate, value),) = moment.items()
        starts_there = uniform.way(coordinate, value).is_zero
        never = "has this value at the start, and never again" if starts_there else "never has this value"
        self.remarks.append(f"{name}: {coordinate} {never}")
        return Value(None)

    def _later(self, name: str, question: Ask) -> Value:
        if question.after is not None and question.of is not None and self.solved.rests:
            return Value(0.0)
        numbers = InNumbers(self.simulated)
        try:
            found = numbers.with_error(question)
            if question.period_of is not None:
                return self._with_formula(name, question.period_of, found, numbers.accuracy)
            time = found.t if found.t is not None else numbers.time(question)
        except NeverError as reason:
            self.remarks.append(f"{name}: {reason}")
            return Value(None)
        self.remarks.extend(f"{name}: {told}" for told in numbers.told)
        forms = LaterForms(self.solved, self.simulated, self.courses)
        expression = forms.of(question, found, time)
        self.remarks.extend(f"{name}: {told}" for told in forms.told)
        return self._of_formula(found, expression)

    def _of_formula(self, found: Value, expression: Node | None) -> Value:
        """Return a value that has a formula as the formula's own."""
        if expression is None:
            return found
        value = evaluate_float([expression], self.solved.sample)[0]
        return replace(found, value=value, expression=expression, error=0.0)

    def _with_formula(self, name: str, coordinate: str, found: Value, told: list[str]) -> Value:
        """Return a period with its formula, which has one where the equation of the coordinate is linear."""
        formula = formula_of_period(self.solved, coordinate, found.value or 0.0)
        self.remarks.extend(f"{name}: {each}" for each in told if formula is None)
        return self._of_formula(found, formula)


def _answers_of(system: System) -> tuple[Solved, Mapping[str, Value], list[str]]:
    solved = solved_start(system)
    return solved, *answered(solved)


def _unit(question: Ask) -> str:
    if question.of is None:
        return "s"
    return "m" if question.after is not None else "m/s"
