"""Answers to `ask`: the kinds of questions, and their answers in the order in which they name each other.

In: a solved start. Out: the answers by name, with formulas where they have some, and remarks on them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final, NamedTuple

from multibody_sym.algebra.roots import ShortForms
from multibody_sym.answers.ask.find import BestQuestion, FindQuestion
from multibody_sym.answers.ask.formula_questions import FORMULA_QUESTIONS
from multibody_sym.answers.ask.kinematics import KINEMATIC_QUESTIONS
from multibody_sym.answers.ask.linear_systems import modes_named
from multibody_sym.answers.ask.named_answers import with_answers
from multibody_sym.answers.ask.phase_space import PHASE_SPACE_QUESTIONS
from multibody_sym.answers.ask.principal_axes import PrincipalAxesQuestion
from multibody_sym.answers.ask.question import AskedMotion, Question, SingleQuestion
from multibody_sym.answers.ask.sections import GreatestSectionQuestion, SectionQuestion
from multibody_sym.answers.ask.varied import NAMED_QUESTIONS
from multibody_sym.answers.ask.working import WorkedAnswer, Working
from multibody_sym.answers.instant.instant import SolvedInstant, is_lettered, solved_start, with_outputs_put_in
from multibody_sym.dynamics.start.number_checks import verify_asked
from multibody_sym.errors import ModelError, NoSolutionError, at
from multibody_sym.mechanics.vocabulary import in_order, named_by
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.scalars.node import Node
from multibody_sym.stages import doing, stage
from multibody_sym.text.values import Value

QUESTIONS: Final[tuple[type[Question], ...]] = (
    *NAMED_QUESTIONS,
    *FORMULA_QUESTIONS,
    FindQuestion,
    BestQuestion,
    SectionQuestion,
    GreatestSectionQuestion,
    *KINEMATIC_QUESTIONS,
    *PHASE_SPACE_QUESTIONS,
    PrincipalAxesQuestion,
)


class Answers(NamedTuple):
    """Answers by the names of their questions, `remarks` on them, and how each is found."""

    values: Mapping[str, Value]
    remarks: list[str]
    worked: Mapping[str, WorkedAnswer]


@stage("answers")
def answers_of(solved: SolvedInstant) -> Answers:
    """Return the answers to all questions of a system, remarks on them, and how each is found.

    A question whose simulation fails has no answer, and a remark tells why. Raises ModelError for unknown names.
    """
    solved = with_outputs_put_in(solved)
    end = solved.number(solved.system.simulation.t_end) if solved.system.ask else 1.0
    if not end > 0.0:
        with at("simulation", "t_end"):
            raise ModelError(f"expected a positive number, got {end:g}: questions are about the motion until then")
    answers: dict[str, Value] = {}
    given: dict[str, dict[str, Value]] = {}
    lettered: dict[str, Node] = {}
    remarks: list[str] = []
    worked: dict[str, WorkedAnswer] = {}
    motion, reasons = AskedMotion(solved, answers, _answers_of_system), _Reasons(solved)
    short = ShortForms(solved.symbolic.letters)
    for name in in_order(solved.system.ask, solved.mechanism.symbols):
        doing(f"answer {name}")
        with at("ask", name):
            named = with_answers(solved.system.ask[name], answers, solved.mechanism.symbols, lettered)
            worked[name] = WorkedAnswer(question_of(solved.system.ask[name]).words(), Working())
            if named is None:
                answers[name] = Value(None)
                worked[name].working.notes.append("it hangs on an answer that has no value")
                remarks.append(f"{name}: it hangs on an answer that has no value")
                continue
            ask, closed = named
            verify_asked(ask, solved.sample)
            reasons.set_aside()
            question = question_of(ask)
            parts = dict(_answers(motion, name, ask, worked[name].working, remarks))
            for part, x in parts.items():
                if x.expression is not None:
                    parts[part] = replace(x, expression=short.shortest(x.expression))
            written = question_of(solved.system.ask[name])
            if ask is not solved.system.ask[name] and isinstance(written, SingleQuestion):
                unit = written.unit(motion)  # of the answers that it names
                parts = {end: replace(x, unit=unit or x.unit) for end, x in parts.items()}
            on = named_by(solved.system.ask[name], solved.system.ask, solved.mechanism.symbols)
            rests_on_them = bool(on) and all(worked[other].is_of_small_motion for other in on)
            worked[name] = worked[name]._replace(
                at_start=question.at_start(),
                is_later=question.is_later(),
                is_of_small_motion=question.is_of_small_motion or bool(modes_named(ask)) or rests_on_them,
                parts=tuple(parts),
            )
            given[name] = {f"{name}{end}": x if closed else replace(x, expression=None) for end, x in parts.items()}
            answers |= {f"{name}{end}": x for end, x in parts.items()}
            answers[name] = found = given[name].get(name, Value(None))
            if is_lettered(solved, found) and ask.value is not None:
                answers[name], lettered[name] = replace(found, expression=None), ask.value
            reasons.keep(name, needed=any(x.expression is None for x in parts.values()))
    reasons.put_back()
    every = (given.get(name, {name: answers[name]}) for name in solved.system.ask)
    return Answers({name: value for parts in every for name, value in parts.items()}, remarks, worked)


def _answers_of_system(system: System) -> tuple[SolvedInstant, Mapping[str, Value], list[str]]:
    solved = solved_start(system)
    found = answers_of(solved)
    return solved, found.values, found.remarks


def _answers(
    motion: AskedMotion, name: str, ask: Ask, working: Working, remarks: list[str]
) -> Mapping[str, Value]:
    """Return the answers to a question, and add what they rest on, or why they have no value, to the remarks."""
    about_modes: list[str] = []
    found: Mapping[str, Value]
    try:
        if ask.varied is None and modes_named(ask):
            found, about_modes = _answer_with_modes(motion, ask, working)
        else:
            found = question_of(ask).answers(motion, working)
    except FailedRunError as failed:
        found = {"": Value(None)}
        working.notes.append(f"it has no answer, since the simulation fails: {failed.message}")
    remarks.extend(f"{name}: {note}" for note in working.notes)
    remarks.extend(each for each in about_modes if each not in remarks)
    return found


def question_of(ask: Ask) -> Question:
    """Return what is written under `ask` as a question of its kind."""
    return next(found for kind in QUESTIONS if (found := kind.parse(ask)) is not None)


def _answer_with_modes(motion: AskedMotion, ask: Ask, working: Working) -> tuple[Mapping[str, Value], list[str]]:
    """Return the answer to a question that names frequencies or periods, and remarks on the small oscillations."""
    try:
        if ask.value is not None and modes_named(ask) == [ask.value]:
            found = motion.modes.value(ask.value)
            leaf = ask.value
            working.steps.append(lambda: motion.modes.lines(leaf))
        else:
            numbered, closed = motion.modes.put_in(ask)
            (found,) = question_of(numbered).answers(motion, working).values()
            found = replace(found, unit=question_of(ask).unit(motion))
            found = found if closed else replace(found, expression=None)
    except NoSolutionError as reason:
        working.notes.append(reason.message)
        return {"": Value(None)}, []
    return {"": found}, motion.modes.remarks()


class _Reasons:
    """Why answers have no formulas: what is added to a system's reasons meanwhile, with the answers' names."""

    def __init__(self, solved: SolvedInstant) -> None:
        self._shared, self._before = solved.reasons, dict(solved.reasons)
        self._names: dict[str, list[str]] = {}

    def set_aside(self) -> None:
        self._before.update(self._shared)
        self._shared.clear()

    def keep(self, name: str, *, needed: bool) -> None:
        """Keep the reasons added since if an answer `needed` them, having no formula."""
        for reason in self._shared if needed else ():
            self._names.setdefault(reason, []).append(name)
        self._shared.clear()

    def put_back(self) -> None:
        self._shared.update(self._before)
        self._shared.update({f"{', '.join(names)}: {reason}": None for reason, names in self._names.items()})
