"""Solutions of several stages: each begins with the coordinates and speeds with which the one before ends.

In: a system with `then`, and how the system of one stage is solved. Out: the solution of the first stage with those
that follow, and the answers of all. Formulas of one stage are the start values of the next; a start value without a
formula gets a letter.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import field, replace
from functools import partial
from typing import Final

from multibody_sym.answers.ask.ask import question_of
from multibody_sym.answers.ask.named_answers import in_parameters, questions_beside
from multibody_sym.answers.instant.letters import put_in
from multibody_sym.answers.records import Definition, Sentence, Solution, StageFound, Worked, WorkedStep
from multibody_sym.derivation.notation import Label, latex_name
from multibody_sym.dynamics.start.parameters import known_values
from multibody_sym.errors import ExpressionError, ModelError, at
from multibody_sym.mechanics.changes import (
    at_end,
    end_questions,
    going_on,
    in_own_time,
    in_stage,
    integrals_later,
    stage_systems,
)
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.mechanics.vocabulary import Dimensions
from multibody_sym.model.fields import Names
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System, expressions, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, real, symbol
from multibody_sym.text.printer import text
from multibody_sym.text.units import DIMENSIONLESS, infer_dimension, parse_unit
from multibody_sym.text.values import Value

_AT_START: Final = Value(0.0, ZERO, "s")
_OWN_TIME: Final = Sentence(("t counts from here on in the steps of this stage",))


def solution_in_stages(system: System, solve: Callable[[System], Solution]) -> Solution:
    """Return the solution of a system with stages; `solve` is how that of one stage is found.

    Answers of a stage that is never reached have no value. Raises InputError with places in the declared system.
    """
    first = mechanism(system)
    moving = (first.relative or first).coordinates, (first.relative or first).speeds
    names = [each.name for group in moving for each in group]
    chain, last = _Chain(system), len(system.then) + 1
    for number, part in enumerate(stage_systems(system), 1):
        with in_stage(system, number):
            begun = chain.begun(part, number)
            summed = integrals_later(system, number, part)
            asked = {} if number == last else end_questions(system, number, names, summed)
            ends = in_own_time(asked, chain.begins.t.expression or ZERO)
            found = solve(replace(begun, ask=Names({**begun.ask, **ends})))
        chain.add(found, ends)
        if number < last and not chain.goes_on(found, number, names, summed):
            break
    return chain.solution()


@dataclass(frozen=True)
class _Beginning:
    """The time and the coordinates and speeds with which a stage begins, and the letters of those without formulas.

    `before`: work and impulses until then, that questions name.
    """

    t: Value = _AT_START
    start: Mapping[str, Value] = field(default_factory=dict)
    letters: Mapping[str, Definition] = field(default_factory=dict)
    before: Mapping[Node, Value] = field(default_factory=dict)

    def lettered(self, number: int, system: System) -> _Beginning:
        """Return the same with a letter for each value without a formula, as stage `number` begins."""
        taken = {*system.parameters, *self.start, *system.inputs, *system.outputs, *self.letters}
        letters, values = dict(self.letters), dict[str, Value]()
        for name, value in {"t": self.t, **self.start}.items():
            formula = in_parameters(system, value)
            if value.value and (formula is None or not _has_unit(system, formula, value.unit)):
                letter = free_name(f"{name}_{number}", taken)
                letters[letter] = Definition(value.value, unit=value.unit, says=f"{name} as stage {number} begins")
                formula = symbol(letter)
            values[name] = replace(value, expression=formula)
        before = dict[Node, Value]()
        for integral, value in self.before.items():
            letter = free_name(f"{integral.data[0]}_{number}", {*taken, *letters})
            letters[letter] = Definition(
                value.value or 0.0, unit=value.unit, says=f"{text(integral)} before stage {number}"
            )
            before[integral] = replace(value, expression=symbol(letter))
        return _Beginning(values.pop("t"), values, letters, before)


class _Chain:
    """The stages that are solved so far, with which the next one `begins`, and the answers of all."""

    def __init__(self, system: System) -> None:
        self.system, self.begins = system, _Beginning()
        self._mechanism = mechanism(replace(system, ask=Names()))
        self._answers: dict[str, Value] = {}
        self._found: list[tuple[_Beginning, Solution]] = []
        self._ends: list[set[str]] = []
        self._missed = ""

    def begun(self, part: System, number: int) -> System:
        own = replace(part, ask=questions_beside(part, self._answers, mechanism(replace(part, ask=Names())).symbols))
        if number == 1:
            return own
        begins = self.begins
        letters = {
            name: Parameter(real(x.value), dimension=parse_unit(x.unit)[1] if x.unit else None)
            for name, x in begins.letters.items()
        }
        own = replace(own, parameters=Names({**own.parameters, **letters}))
        start = {name: x.expression if x.expression is not None else ZERO for name, x in begins.start.items()}
        sums = {integral: integral + (x.expression or ZERO) for integral, x in begins.before.items()}
        summed = {name: with_expressions(x, partial(put_in, shown=sums)) for name, x in own.ask.items()}
        found = going_on(replace(own, ask=Names(summed)), begins.t.expression or ZERO, start)
        _verify_varied(found, begins.letters, number)
        return found

    def add(self, found: Solution, ends: Mapping[str, Ask]) -> None:
        """Add the solution of a stage, of whose answers some are about its end."""
        asked = self.system.ask
        for name, value in found.answers.items():
            if name not in ends:
                is_time = name in asked and asked[name].when is not None and asked[name].value is None
                unit = "s" if is_time and asked[name].of is None else self._unit(asked.get(name)) or value.unit
                t = None if value.t is None else value.t + (self.begins.t.value or 0.0)
                self._answers[name] = replace(value, unit=unit, t=t)
        self._found.append((self.begins, found))
        self._ends.append({*ends})

    def _unit(self, question: Ask | None) -> str:
        """Return the unit of an expression that names answers, by theirs; empty for another question."""
        units = {name: x.unit for name, x in self._answers.items() if x.unit}
        asked = None if question is None else question.value
        if asked is None or not any(str(x.data) in units for x in leaves([asked], "symbol")):
            return ""
        return MechanismUnits(self._mechanism, units).of([asked])[0]

    def goes_on(self, found: Solution, number: int, names: list[str], integrals: Iterable[Node]) -> bool:
        """Return whether the stage after `number` begins before the end of the run, and find with what."""
        stage, values = self.system.then[number - 1], known_values(self.system)
        if stage.after is None:
            ended = replace(found.answers[at_end("t", number)], unit="s")
        else:
            ended = Value(evaluate_float([stage.after], values)[0], stage.after, "s")
        end = evaluate_float([self.system.simulation.t_end], values)[0]
        places = {name: Value(evaluate_float([x], values)[0], x) for name, x in (stage.at or {}).items()}
        ends = {name: found.answers[key] for name in names if (key := at_end(name, number)) in found.answers}
        known = {**places, **{name: _rounded(value) for name, value in ends.items()}}
        start = {name: replace(known[name], unit=found.units.get(name, "")) for name in names}
        if ended.value is None or ended.value >= end or any(x.value is None for x in start.values()):
            whys = (x.partition(": ") for x in found.conditions)
            why = next((reason for name, _, reason in whys if name == at_end("t", number)), "")
            why = why or f"it would begin at t = {ended.value or 0.0:.6g} s, and t_end of the simulation is {end:g} s"
            self._missed = f"stage {number + 1} is not reached: {why}"
            return False
        before = dict(self.begins.before)
        for integral in integrals:
            more, earlier = found.answers[at_end(text(integral), number)], before.get(integral, _AT_START)
            before[integral] = replace(more, value=(more.value or 0.0) + (earlier.value or 0.0))
        self.begins = _Beginning(ended, start, self.begins.letters, before).lettered(number + 1, self.system)
        return True

    def solution(self) -> Solution:
        """Return the solution of the first stage with the others, and all answers in the order of the questions."""
        shown = [_shown(found, ends) for (_, found), ends in zip(self._found, self._ends, strict=True)]
        answers = self._answers | {name: Value(None) for name in self.system.ask if not self._answered(name)}
        order = {name: k for k, name in enumerate(self.system.ask)}
        stages = [StageFound(number, stage.words()) for number, stage in enumerate(self.system.then, 2)]
        for k, (begins, _) in enumerate(self._found[1:]):
            stages[k] = replace(stages[k], t=begins.t, start=begins.start, solution=replace(shown[k + 1], steps=None))
        first, known = shown[0], self._found[-1][0].letters
        every = [*answers.values(), *(x for each in shown[1:] for x in _values(each))]
        used = leaves([x.expression for x in every if x.expression is not None], "symbol")
        letters = {name: x for name, x in known.items() if symbol(name) in used}
        return replace(
            first,
            answers=dict(sorted(answers.items(), key=lambda each: order[self._question(each[0])])),
            conditions=(*(x for x in first.conditions if not self._missed.endswith(x)), *filter(None, [self._missed])),
            stages=tuple(_without_letters(each, known.keys() - letters.keys()) for each in stages),
            where={**first.where, **letters},
            steps=self._steps(shown),
        )

    def _question(self, answer: str) -> str:
        """Return the name of the question that has an answer of this name, perhaps one of several components."""
        return answer if answer in self.system.ask else answer.rpartition(".")[0]

    def _answered(self, name: str) -> bool:
        return any(self._question(answer) == name for answer in self._answers)

    def _steps(self, shown: list[Solution]) -> Worked | None:
        """Return the steps of all stages one after the other, each below a heading that says how it is reached."""
        found = shown[0].steps
        if found is None:
            return None
        known = {line for step in found.steps for line in step.lines if step.title == "Given"}
        steps, notation = list[WorkedStep](), replace(found.notation, spelling={}, places={})
        for number, solution in enumerate(shown, 1):
            assert solution.steps is not None
            own = solution.steps
            ends = {x: f"{x.partition(' ')[0]}_{number + 1}" for x in self._ends[number - 1]}
            spelling = {
                leaf: Label(ends[label.text], latex_name(ends[label.text])) if label.text in ends else label
                for leaf, label in own.notation.spelling.items()
            }
            notation = replace(
                notation,
                spelling={**spelling, **notation.spelling},
                places={**own.notation.places, **notation.places},
            )
            for step in own.steps:
                name = step.title.partition(": ")[0]
                if number > 1:
                    lines = tuple(x for x in step.lines if step.title != "Given" or x not in known)
                    asked = self.system.ask.get(name)
                    title = step.title if asked is None else f"{name}: {question_of(asked).words()}"
                    step = replace(step, title=title, lines=lines, is_later=True)
                if name not in ends and step.lines:
                    steps.append(step)
            if number <= len(self.system.then):
                moved = [name for name in ends if _rounded(self._found[number - 1][1].answers[name]).value]
                reached = [step for step in own.steps if step.title.partition(": ")[0] in moved]
                lines = (*dict.fromkeys(line for step in reached for line in step.lines), _OWN_TIME)
                title = f"Stage {number + 1}: {self.system.then[number - 1].words()}"
                steps.append(WorkedStep(title, lines, is_later=True))
        return replace(found, steps=tuple(steps), notation=notation)


def _verify_varied(system: System, letters: Collection[str], number: int) -> None:
    """Raise ModelError for questions that vary what letters of start values hang on in ways that no formula says."""
    named = leaves([x.node for x in expressions(system) if x.path[0] != "parameters"], "symbol")
    unknown = [name for name in letters if symbol(name) in named]
    for name, question in system.ask.items():
        if unknown and question.varied is not None:
            with at("ask", name):
                raise ModelError(
                    f"stage {number} begins with {', '.join(unknown)}, of which only a number is known, and that would "
                    f"change; ask for the value itself and vary the parameter: --set {question.varied}=..",
                    number="M121",
                )


def _has_unit(system: System, formula: Node, unit: str) -> bool:
    """Return whether a formula may be in a unit: a number written in one, such as `8 m`, has none in formulas."""
    try:
        found = infer_dimension(formula, Dimensions(system).of_leaf)
    except ExpressionError:
        return False
    wanted = parse_unit(unit)[1] if unit else DIMENSIONLESS
    return found is None or not found.certain or found.dimension in (DIMENSIONLESS, wanted)


def _rounded(value: Value) -> Value:
    """Return a value of runs, 0 where it is within its error of that."""
    return Value(0.0, ZERO) if value.value is not None and abs(value.value) <= value.error else value


def _values(solution: Solution) -> Iterator[Value]:
    yield from solution.accelerations.values()
    yield from (x for parts in solution.reactions.values() for x in parts.values())
    yield from () if solution.impact is None else solution.impact.values


def _without_letters(found: StageFound, names: Collection[str]) -> StageFound:
    """Return a stage without the letters of start values that no formula names."""
    unused = {symbol(name) for name in names}
    start = {name: replace(x, expression=None) if x.expression in unused else x for name, x in found.start.items()}
    return replace(found, start=start, t=replace(found.t, expression=None) if found.t.expression in unused else found.t)


_OF_ENDS: Final = re.compile(r"(,|(?<=:))[^:,]+ at the end of stage \d+")


def _shown(found: Solution, ends: Collection[str]) -> Solution:
    """Return the solution of a stage without answers, and without remarks that only its end needs."""
    named = [(remark, *remark.partition(": ")[::2]) for remark in found.conditions]
    remarks = dict.fromkeys(said if name in ends else remark for remark, name, said in named)
    notes = [_OF_ENDS.sub("", note) for note in found.notes]
    return replace(found, answers={}, conditions=tuple(remarks), notes=tuple(x for x in notes if ":: " not in x))
