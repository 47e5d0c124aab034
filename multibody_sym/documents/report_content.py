"""What does a report say, in which order: the question, a figure, answers, their solution, then details?

In: Findings. Out: Sections of blocks for the writers of `report_pages`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from multibody_sym.answers.records import Formula, Line, Sentence, Solution, Words, Worked
from multibody_sym.derivation.notation import Label, Notation
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import Block, Document, EquationRows, Section, Told
from multibody_sym.documents.letters import SystemLetters
from multibody_sym.documents.report_findings import Description, Findings, Missing, ReportedParameter, answer, instants
from multibody_sym.documents.runs import end_values, run_parts
from multibody_sym.documents.solution import check_text
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.settings import Settings
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.pictures.draw import Figure
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.text.printer import latex_width
from multibody_sym.text.values import Quantity, Units

# ----------------------------------------------------------------------------------------------------------------------
# The sections of a report, and the blocks that only reports have.


@dataclass(frozen=True)
class Statement:
    """The paragraphs of the description, each as facts and questions."""

    paragraphs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Pictures:
    """A figure, or below a title one of each name, side by side; `printed` on paper alone."""

    figures: Mapping[str, Figure]
    title: str = ""
    printed: bool = False


@dataclass(frozen=True)
class Givens:
    """Names with their values as they are declared, each in words."""

    rows: tuple[tuple[Label, Words], ...]


@dataclass(frozen=True)
class Boxed:
    """The answers, in a box with a title."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Folded:
    """Details below a title: closed on a page until a reader opens them, open on paper."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class WordTable:
    """Rows of words below a head."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Words, ...], ...]


@dataclass(frozen=True)
class Film:
    """The motion of a run: moving on a page, as figures of some instants and a plot on paper."""

    run: Trajectory
    stills: Mapping[str, Figure]


@dataclass(frozen=True)
class Command:
    """What is typed to make the report once more."""

    text: str


def sections(found: Findings, units: Units, letters: SystemLetters) -> list[Section]:
    """Return the sections of a report in the order of reading."""
    content = _Content(found, units, letters)
    parts = {
        "Answer": content.answers,
        "Given": content.givens,
        "Solution": content.solution,
        "Motion": content.motion,
        "Details": content.details,
    }
    told = {title: _told(part) for title, part in parts.items()}
    top = Section("", (*content.question(), *_blocks(told.pop("Answer"))))
    return [top, *(Section(title, _blocks(blocks)) for title, blocks in told.items() if blocks != ())]


def exercise_sections(found: Findings, units: Units, letters: SystemLetters) -> list[Section]:
    """Return the figure, the givens and the question, without an answer."""
    content = _Content(found, units, letters)
    facts = tuple((told, "") for told, _ in content.asked.paragraphs if told)
    asked = tuple(("", question) for _, question in content.asked.paragraphs if question)
    figure = found.figure if isinstance(found.figure, Missing) else Pictures({"": found.figure})
    return [
        Section("", (Statement(facts), figure)),
        Section("Given", tuple(content.givens())),
        *([Section("Asked", (Statement(asked),))] if asked else []),
    ]


def answer_sections(found: Findings, units: Units, letters: SystemLetters) -> list[Section]:
    """Return the givens and the answers alone: a sheet for whoever corrects."""
    content = _Content(found, units, letters)
    statement = Statement(tuple(content.asked.paragraphs))
    answers = _blocks(answer(lambda: tuple(content.answers())))
    return [Section("", (statement, *answers)), Section("Given", tuple(content.givens()))]


def _told(part: Callable[[], Iterator[Block]]) -> tuple[Block, ...] | Missing:
    return answer(lambda: tuple(part()))


def _blocks(found: tuple[Block, ...] | Missing) -> tuple[Block, ...]:
    return (found,) if isinstance(found, Missing) else found


_TYPED: Final = re.compile(r"([-+]?[\d.]+(?:[eE][-+]?\d+)?) ?([A-Za-z1][\w/*^()-]*)?")
_MOST_ANSWERS: Final = 8
_FORMULA: Final = 430.0
"""Points that the formula of an answer may take; longer ones stand in the solution alone."""
_LONG: Final = 60
"""Lines of a solution past which its steps are folded."""
_ROUNDING: Final = 1e-12
_MOST_EVENTS: Final = 20
_MOST_OPEN: Final = 12
"""Rows of a table that are not folded."""


class _Content:
    def __init__(self, found: Findings, units: Units, letters: SystemLetters) -> None:
        self.found, self.units, self.letters = found, units, letters
        self.asked = Description(found.system)

    @property
    def solved(self) -> Solution | None:
        return None if isinstance(self.found.solution, Missing) else self.found.solution

    @property
    def worked(self) -> Worked | None:
        return None if self.solved is None else self.solved.steps

    def lines(self, lines: Iterator[str] | list[str] | tuple[str, ...]) -> list[Block]:
        """Return lines of text as sentences."""
        return [Sentence(self.letters.words(line.strip())) for line in lines]

    # --- the question and its answers ------------------------------------------------------------------------------

    def question(self) -> Iterator[Block]:
        yield Statement(tuple(self.asked.paragraphs))
        yield self.found.figure if isinstance(self.found.figure, Missing) else Pictures({"": self.found.figure})

    def answers(self) -> Iterator[Block]:
        """Yield the box: answers to `ask`, or results that the question names; what it asks of a motion."""
        blocks: list[Block] = []
        if self.solved is not None:
            blocks += self.lines(self.solved.found)
            blocks += self._declared_answers() if self.solved.answers else self._results()
        blocks += self._rest()
        blocks += self._modes()
        blocks += self._course()
        if blocks:
            asked = bool(self.found.system.ask) or any(question for _, question in self.asked.paragraphs)
            yield Boxed("Answers" if asked else "At the start", tuple(blocks))
        elif isinstance(self.found.solution, Missing):
            yield self.found.solution

    def _declared_answers(self) -> list[Block]:
        assert self.solved is not None
        told: list[Block] = []
        for name, value in self.solved.answers.items():
            line = self.letters.value(name, value)
            if value.unique:
                told.append(line if value.t is None else replace(line, after=self._when(value.t, value.t_error)))
            else:
                told.append(Sentence((self.letters.label(name), ": not unique")))
        return told

    def _results(self) -> list[Block]:
        """Return the results of the worked solution in the order of the question, without those that are zero."""
        worked = self.worked
        if worked is None:
            return []
        results = [line for step in worked.steps if step.title in _RESULTS for line in step.lines]
        told = [line for line in results if isinstance(line, Formula)]
        sizes = [abs(line.value.number) for line in told if line.value is not None]
        least = _ROUNDING * max(sizes, default=0.0)
        lines = [line for line in told if line.value is not None and abs(line.value.number) > least]
        moves = any(self._moves(line, worked) for line in lines)
        assert self.solved is not None
        still: list[Block] = []
        if self.solved.impact is None and not moves and len(lines) < len(told):
            words = "Nothing is accelerated." if any(self.solved.speeds.values()) else "It stays at rest."
            still.append(Sentence((words,)))
        shown = sorted(lines, key=lambda line: self._rank(line, worked))[:_MOST_ANSWERS]
        return [*still, BlocksInLetters(worked.notation, tuple(self._short(line, worked) for line in shown))]

    def _moves(self, line: Formula, worked: Worked) -> bool:
        return bool(line.sides) and worked.notation.text(line.sides[0]).endswith("'")

    def _rank(self, line: Formula, worked: Worked) -> int:
        """Return the place of a result among the answers: accelerations or speeds, tensions, contacts, joints."""
        name = worked.notation.text(line.sides[0]) if line.sides else ""
        if not name or name.endswith("'") or line.before:
            return 0
        letter = name[0]
        if letter in "Tp":
            return 1
        return 2 if letter in "NF" and not name.endswith(("_x", "_y", "_z")) else _JOINTS

    def _short(self, line: Formula, worked: Worked) -> Formula:
        """Return a result without a formula that is wider than the box."""
        width = sum(latex_width(worked.notation.latex(side)) for side in line.sides)
        return line if width <= _FORMULA else replace(line, sides=line.sides[:1])

    def _rest(self) -> list[Block]:
        found = self.found.rest
        if isinstance(found, Missing):
            return []
        name = self.letters.label(found.parameter)
        if not found.ends:
            return [Sentence(("It rests at no value of ", name, "."))]
        told: list[Block] = []
        for low, high in found.ends:
            if low.value is None and high.value is None:
                told.append(Sentence(("It rests at every value of ", name, ".")))
            for end, sign in ((low, ">="), (high, "<=")):
                if end.value is None or (end is low and end.value == 0.0 and high.value is not None):
                    continue
                form = end.expression if end.expression is not None else end.exact
                sides: tuple[Any, ...] = (name,)
                if form is not None and leaves([form], "symbol"):
                    sides = (name, self.letters.expression(form))
                number, sign = Quantity(end.value, found.unit, end.error), sign[: 1 if end.open else 2]
                told.append(Formula(sides, relation=sign, value=number, before=("it rests for",)))
        return told

    def _modes(self) -> list[Block]:
        found = self.found.modes
        if isinstance(found, Missing):
            return []
        swinging = [mode for mode in found.modes if mode.motion == "oscillates"]
        told: list[Block] = []
        for k, mode in enumerate(swinging[:_MOST_ANSWERS], 1):
            place = f"_{k}" if len(swinging) > 1 else ""
            for letter, value in (("omega", mode.frequency), ("T", mode.period)):
                if value is not None and (letter == "omega" or not place):
                    told.append(self.letters.value(f"{letter}{place}", value))
        if found.stable is not None:
            told.append(Sentence(("small motions are stable" if found.stable else "small motions are not stable",)))
        return told

    def _course(self) -> list[Block]:
        """Return the events of the motion, and its end where nothing else answers."""
        run = self.found.run
        if isinstance(run, Missing) or not len(run) or (self.solved is not None and self.solved.answers):
            return []
        told = self.lines(run_parts(run, self.units)["events"][1:4])
        if run.stop is not None:
            told.append(Sentence((str(run.stop["element"]), *self._when(run.t_final))))
        ends = self.found.system.simulation.t_end is not Settings().t_end
        if self.solved is None or run.stop is not None or ends:
            told += self._end_of(run)[:_MOST_ANSWERS]
        return told

    def _when(self, t: float, error: float = 0.0) -> Words:
        return " at ", self.letters.label("t"), " = ", Quantity(t, "s", error)

    def _end_of(self, run: Trajectory) -> list[Block]:
        """Return the speeds at the end of a run and where it came to."""
        when = self._when(run.t_final)
        known = run.ready.told.state_units
        values = {**run.final["speeds"], **run.final["coordinates"]}
        return [Formula((self.letters.label(n),), value=Quantity(x, known[n]), after=when) for n, x in values.items()]

    # --- what is given, and the solution ---------------------------------------------------------------------------

    def givens(self) -> Iterator[Block]:
        if self.found.parameters:
            yield Givens(tuple((self.letters.label(x.name), self._declared(x)) for x in self.found.parameters))
        worked = self.worked
        if worked is not None:
            given = [line for step in worked.steps if step.title == "Given" for line in step.lines]
            starts = tuple(line for line in given if isinstance(line, Sentence))
            if starts:
                yield BlocksInLetters(worked.notation, self._lines(starts))

    def _declared(self, parameter: ReportedParameter) -> Words:
        """Return the value of a parameter as it was typed, in a chosen unit where there is one."""
        given, node = parameter.declared.given("value"), parameter.declared.value
        typed = _TYPED.fullmatch(given) if isinstance(given, str) else None
        if typed is not None and self.units.of(parameter.unit) == parameter.unit:
            return (Told(typed[1], typed[2] or ""),)
        number = () if parameter.number is None else (Quantity(parameter.number, parameter.unit),)
        if leaves([node], "symbol"):
            return (self.letters.expression(node), *((" = ", *number) if number else ()))
        return number if node.shadow is not None and not leaves([node], "pi") else (self.letters.expression(node),)

    def solution(self) -> Iterator[Block]:
        """Yield bodies cut free and the steps, folded where they are many; then what the formulas hold for."""
        if isinstance(self.found.solution, Missing):
            yield self.found.solution
            return
        solved, worked = self.found.solution, self.worked
        if not isinstance(self.found.bodies, Missing) and self.found.bodies:
            yield Pictures(self.found.bodies, "Bodies cut free")
        if not isinstance(self.found.diagrams, Missing):
            yield Pictures({"": self.found.diagrams}, "Sections of beams")
        if worked is not None:
            steps = [
                Section(step.title, self._conditions(solved) if step.title == "Conditions" else self._lines(step.lines))
                for step in worked.steps
                if step.title not in ("Given", "State")
            ]
            count = sum(len(step.blocks) for step in steps)
            folded = tuple(step for step in steps if step.title not in _RESULTS and count > _LONG)
            if folded:
                yield Folded("Step by step", (Document(worked.name, "", folded, worked.notation),))
            shown = tuple(step for step in steps if step not in folded)
            yield Document(worked.name, "", shown, worked.notation)
        yield from self.lines(solved.notes)

    def _lines(self, lines: tuple[Line, ...]) -> tuple[Block, ...]:
        return tuple(map(self.letters.line, lines))

    def _conditions(self, solved: Solution) -> tuple[Block, ...]:
        told: list[Block] = []
        for condition in solved.conditions:
            broken = solved.limits.get(condition)
            told.append(Sentence((*self.letters.condition(condition), *([f", else {broken}"] if broken else []))))
        return (BlocksInLetters(self.letters, tuple(told)),)

    # --- the motion, and details -----------------------------------------------------------------------------------

    def motion(self) -> Iterator[Block]:
        run = self.found.run
        if isinstance(run, Missing):
            yield run
            return
        if not np.any(run.u):
            yield Sentence(("Nothing moves.",))
        elif len(run):
            stills = answer(lambda: instants(run, self.units))
            yield Film(run, {} if isinstance(stills, Missing) else stills)
        ends = self._end_grid(run)
        if np.any(run.u):
            yield Folded(ends.title, (ends,)) if len(ends.rows) > _MOST_OPEN else ends
        greatest = self._greatest(run) if len(run) else None
        if greatest is not None:
            yield Folded(greatest.title, (greatest,)) if len(greatest.rows) > _MOST_OPEN else greatest
        parts = run_parts(run, self.units)
        if parts["events"]:
            yield from self.lines(parts["events"][: _MOST_EVENTS + 1])

    def _end_grid(self, run: Trajectory) -> WordTable:
        outputs, state = end_values(run)
        values = {name: x for name, x in {**outputs, **state}.items() if math.isfinite(x.number)}
        rows = tuple(((self.letters.label(name),), (x,)) for name, x in values.items())
        return WordTable(f"At the end, t = {self.units.said(run.t_final, 's')}", (), rows)

    def _greatest(self, run: Trajectory) -> WordTable | None:
        """Return the greatest force and moment of each joint and the greatest of each multiplier, with their times."""
        units = MechanismUnits(run.ready.mechanism)
        sizes: list[tuple[Words, str, Any]] = []
        for name, parts in run.reactions.items():
            for letter, unit, what in (("f", "N", "force in joint"), ("m", "N*m", "moment in joint")):
                square = sum(np.nan_to_num(parts[f"{letter}{axis}"]) ** 2 for axis in "xyz")
                sizes.append(((f"{what} {name}",), unit, np.sqrt(square)))
        for name, values in run.multipliers.items():
            if "." not in name:  # rows of joints and contacts are parts of the forces above
                sizes.append(((f"force of {name}",), units.multipliers.get(name, ""), np.abs(values)))
        largest = max((float(np.nanmax(values, initial=0.0)) for _, _, values in sizes), default=0.0)
        rows = []
        for words, unit, values in sizes:
            known = np.nan_to_num(values)
            k = int(np.argmax(known >= (1.0 - _SMALL) * known.max()))  # of equal ones the first
            if values[k] > _SMALL * largest and math.isfinite(values[k]):
                rows.append((words, (Quantity(float(values[k]), unit),), (Quantity(float(run.t[k]), "s"),)))
        return WordTable("Greatest reactions", ("", "greatest", "at time"), tuple(rows)) if rows else None

    def details(self) -> Iterator[Block]:
        found = self.found
        equations = found.equations
        if isinstance(equations, Missing):
            yield Folded("Equations of motion", (equations,))
        else:
            document = derivation_document(equations)
            written = [replace(x, blocks=tuple(self._derived(x))) for x in document.sections]
            named = [section for section in written if section.title == "Names"]
            others = tuple(section for section in written if section.title != "Names")
            yield Folded(f"Equations of motion: {document.subject}", (replace(document, sections=others),))
            if named:
                yield Folded("Names in the equations", (replace(document, sections=tuple(named)),))
        if self.solved is not None and self.solved.where:
            yield Folded("Letters of the solution", (self._where(self.solved),))
        if isinstance(found.check, Missing):
            yield Folded("Checks", (found.check,))
        else:
            yield Folded("Checks", tuple(self.lines(check_text(found.check, self.units).splitlines())))
        if not isinstance(found.run, Missing):
            parts = run_parts(found.run, self.units)
            told = [line for part in ("method", "start", "energy", "constraints") for line in parts[part]]
            yield Folded("Method of the run", tuple(self.lines(told)))
        if found.command:
            yield Folded("Command", (Command(found.command),))

    def _derived(self, section: Section) -> Iterator[Block]:
        """Yield the blocks of a derivation without rows that are 0 = 0, its notes typeset."""
        for block in section.blocks:
            if isinstance(block, EquationRows):
                rows = tuple(row for row in block.rows if row.right != 0 or not isinstance(row.left, Label))
                yield from [EquationRows(rows)] if rows else []
            else:
                yield BlocksInLetters(self.letters, tuple(self.lines(block.lines)))

    def _where(self, solved: Solution) -> Block:
        """Return what the letters of the solution's formulas stand for."""
        told: list[Block] = []
        for name, one in solved.where.items():
            number = Quantity(one.value, one.unit)
            sides: tuple[Any, ...] = (self.letters.label(name),)
            if one.expression is not None and leaves([one.expression], "symbol"):
                sides = (*sides, self.letters.expression(one.expression))
            told.append(Formula(sides, value=number, after=self.letters.words(f" ({one.says})") if one.says else ()))
            if one.equation is not None and one.expression is None:
                left, right = map(self.letters.expression, one.equation)
                told.append(Formula((left, right), before=("from",)))
        return BlocksInLetters(self.letters, tuple(told))


@dataclass(frozen=True, eq=False)
class BlocksInLetters:
    """Blocks in the letters of a notation, or of all Letters once everything has come."""

    letters: Notation | SystemLetters
    blocks: tuple[Block, ...]

    @property
    def notation(self) -> Notation:
        """The notation of the blocks."""
        return self.letters.notation if isinstance(self.letters, SystemLetters) else self.letters


_RESULTS: Final = ("Result", "Elimination: impulses", "Impulses in joints")
_JOINTS: Final = 3
_SMALL: Final = 1e-9
