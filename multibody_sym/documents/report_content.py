"""What does a report know, and what does it say in which order: the question, a figure, answers, solution, details?

In: a System with settings of a run. Out: Findings, each answer or the reason why there is none; Sections of blocks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.analysis.check import CheckReport, check
from multibody_sym.analysis.modes.modes import modes
from multibody_sym.analysis.modes.record import Modes
from multibody_sym.analysis.rest.range_of_rest import RangeOfRest, range_of_rest
from multibody_sym.answers.free_bodies import CutFree, all_arrows, at_start, open_of, shown_components
from multibody_sym.answers.records import Formula, Line, Sentence, Solution, Words, Worked, formulas_in
from multibody_sym.answers.solve import solve
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.free_bodies import component_label
from multibody_sym.derivation.notation import Label, Notation
from multibody_sym.documents.derivation import ClosedForm, derivation_document
from multibody_sym.documents.diagrams import section_diagrams
from multibody_sym.documents.document import Block, Document, EquationRows, Section, Told
from multibody_sym.documents.draw import draw
from multibody_sym.documents.letters import SystemLetters
from multibody_sym.documents.runs import end_values, run_parts
from multibody_sym.documents.solution import check_text
from multibody_sym.dynamics.start.parameters import known_values
from multibody_sym.errors import MultibodyError, NoSolutionError
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.parameters import DimensionField, Parameter
from multibody_sym.model.settings import Settings
from multibody_sym.model.system import System
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.simulate import simulate
from multibody_sym.pictures.diagrams import below_figure
from multibody_sym.pictures.draw import Figure, FigureContent
from multibody_sym.pictures.draw import draw as draw_scene
from multibody_sym.pictures.scene.scene import scene_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import nodes_among, symbol
from multibody_sym.text.printer import COMPONENTS, latex_width
from multibody_sym.text.values import Quantity, Units

# ----------------------------------------------------------------------------------------------------------------------
# Bodies cut free: a figure of each with all forces on it at the start, as numbers and geometry have them.


_ROLES: Final = ("body", "mass centre", "pulley", "gear")
_MOST_FREE_BODIES: Final = 12
"""Systems of more bodies have no figure of each."""


def free_bodies(system: System) -> Mapping[str, Figure]:
    """Return a figure of each body with the forces on it: weight, loads, joints, ropes, contacts.

    None for an impact and for many bodies. Raises what `solve` raises.
    """
    if len(system.bodies) > _MOST_FREE_BODIES or system.impact is not None:
        return {}
    scene = scene_of(system)
    solution = solve(system)
    cut = CutFree(system, scene, scene.motion(), *at_start(solution))
    arrows = all_arrows(cut)
    rests = not any(x.value for x in solution.accelerations.values()) and not any(solution.speeds.values())
    cones = tuple(cut.cones()) if rests else ()
    # the letters of joints' reactions, and the names of ropes and rods, that are not unique
    seen, letters = shown_components(scene), dict[int, list[str]]()
    bodies = {item.name: set(item.bodies) for item in scene.items if item.path[0] == "joints" and item.bodies}
    bodies |= {strand.name: {anchor.body for anchor in strand.anchors} for strand in scene.strands}
    for name, part in open_of(solution):
        of_joint = part in COMPONENTS
        if of_joint and not seen(part[0] == "m", np.eye(3)["xyz".index(part[1])]):
            continue
        for number in bodies.get(name, ()):
            letters.setdefault(number, []).append(component_label(name, part).text if of_joint else name)
    figures = {}
    for k, body in enumerate(scene.mechanism.bodies):
        on_body = tuple(arrow for arrow in arrows if arrow.at.body == k)
        if on_body and not (body.is_double or body.is_foot):
            items = tuple(item for item in scene.items if item.body == k and item.role in _ROLES)
            others: dict[str, Any] = dict.fromkeys(("strands", "dimensions", "angles", "arrows", "ropes"), ())
            alone = replace(scene, name=body.name, items=items, **others)
            own = tuple(cone for cone in cones if cone.at.body == k)
            undrawn = tuple(sorted(letters.get(k, ())))
            shown = FigureContent(names="none", reactions=on_body, undrawn=undrawn, cones=own)
            placed = replace(scene.at(), strands=(), vectors=np.zeros((0, 3)))
            figures[body.name] = Figure(draw_scene(alone, placed, shown=shown))
    return figures


_MOST_INSTANTS: Final = 3


def instants(run: Trajectory, units: Units) -> Mapping[str, Figure]:
    """Return figures of a system in the course of a run, by their times: what paper shows in place of a film."""
    scene, shown = scene_of(run.ready.system), FigureContent(names="none")
    last = len(run) - 1
    places = dict.fromkeys(round(last * (k + 1) / _MOST_INSTANTS) for k in range(_MOST_INSTANTS)) if last > 0 else {}
    figures = {}
    for k in places:
        placed = scene.placed(scene.motion(run.q[k], run.u[k], float(run.t[k])))
        figures[f"t = {units.said(float(run.t[k]), 's')}"] = Figure(draw_scene(scene, placed, shown=shown))
    return figures


# ----------------------------------------------------------------------------------------------------------------------
# The answers.


_T = TypeVar("_T")
_MOST_BODIES: Final = 24


@dataclass(frozen=True)
class Missing:
    """A part that cannot be had, and why."""

    reason: str


@dataclass(frozen=True)
class ReportedParameter:
    """A parameter: its name, its declaration, its number and SI unit."""

    name: str
    declared: Parameter
    number: float | None
    unit: str


@dataclass(frozen=True, eq=False)
class Findings:
    """All answers that a report holds of a `system`; `command` makes it once more.

    A system without questions has its small motions as `modes` if nothing is accelerated at the start, and as `rest`
    the values of its only coefficient of friction at which it rests if it starts without a speed.
    """

    system: System
    command: str
    parameters: tuple[ReportedParameter, ...]
    figure: Figure | Missing
    bodies: Mapping[str, Figure] | Missing
    diagrams: Figure | Missing
    equations: ClosedForm | Missing
    solution: Solution | Missing
    check: CheckReport | Missing
    run: Trajectory | Missing
    modes: Modes | Missing
    rest: RangeOfRest | Missing


_NOT_ASKED: Final = Missing("not asked for")


def findings(system: System, command: str, settings: Mapping[str, Any], *, exercise: bool = False) -> Findings:
    """Return the answers on a system; `settings` are those of the run. An exercise has no details."""
    solution = answer(lambda: _in_symbols(system, lambda: solve(system, steps=True)))
    unasked = None if isinstance(solution, Missing) or system.ask or solution.impact is not None else solution
    rough = None if unasked is None or any(unasked.speeds.values()) else only_coefficient(system)
    cut = not exercise and any(ask.section is not None for ask in system.ask.values())
    steady = unasked is not None and not (unasked.states or any(x.value for x in unasked.accelerations.values()))
    return Findings(
        system=system,
        command=command,
        parameters=reported_parameters(system),
        figure=answer(lambda: draw(system)),
        bodies=_NOT_ASKED if exercise else answer(lambda: free_bodies(system)),
        diagrams=answer(lambda: Figure(below_figure(None, section_diagrams(system)))) if cut else _NOT_ASKED,
        equations=_NOT_ASKED if exercise else answer(lambda: _in_symbols(system, lambda: derive(system))),
        solution=solution,
        check=_NOT_ASKED if exercise else answer(lambda: check(system)),
        run=answer(lambda: simulate(system, **settings)),
        modes=answer(lambda: modes(system)) if steady else _NOT_ASKED,
        rest=_NOT_ASKED if rough is None else answer(lambda: range_of_rest(system, rough)),
    )


def only_coefficient(system: System) -> str | None:
    """Return the one parameter that is a coefficient of friction; None for none or several."""
    rough = (*system.contacts.values(), *system.forces.values())
    given = [getattr(each, key, None) for each in rough for key in ("static", "kinetic")]
    names = {leaf.data for leaf in leaves(nodes_among(given), "symbol")}
    return names.pop() if len(names) == 1 and names <= set(system.parameters) else None


def reported_parameters(system: System) -> tuple[ReportedParameter, ...]:
    """Return the parameters in the order of the model, with numbers of those that follow from others."""
    known = known_values(system)
    inferred = answer(lambda: MechanismUnits(mechanism(system)).parameters)
    units = {} if isinstance(inferred, Missing) else inferred
    stated = {name: x.dimension for name, x in system.parameters.items() if x.dimension is not None}
    units = {**units, **{name: DimensionField().tree(dimension) for name, dimension in stated.items()}}
    return tuple(
        ReportedParameter(name, parameter, known.get(symbol(name)), units.get(name, ""))
        for name, parameter in system.parameters.items()
    )


def _in_symbols(system: System, question: Callable[[], _T]) -> _T:
    """Return an answer in symbols. Raises NoSolutionError for systems whose equations nobody would read."""
    if len(system.bodies) > _MOST_BODIES:
        raise NoSolutionError(f"{len(system.bodies)} bodies: formulas of so many are longer than a report")
    return question()


def answer(question: Callable[[], _T]) -> _T | Missing:
    """Return an answer, or the first line of the reason why there is none."""
    try:
        return question()
    except MultibodyError as error:
        return Missing(str(error).splitlines()[0])


# ----------------------------------------------------------------------------------------------------------------------
# What the description says and asks.


_LONGEST_TITLE: Final = 90
_CLAUSE: Final = re.compile(r"(.+?)(?:[:;?]|,(?= )|\.(?=\s|$))", re.DOTALL)
_SENTENCE: Final = re.compile(r".+?(?:[.?!](?=\s|$)|$)", re.DOTALL)


class Description:
    """The description of a system: its title, its facts, and the questions in it."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._paragraphs = [" ".join(part.split()) for part in (system.description or "").split("\n\n")]

    @property
    def title(self) -> str:
        """The first clause of the description, the model's name where that is long or there is none."""
        match = _CLAUSE.match(re.sub(r" ?\([^)]*\)", "", self._paragraphs[0]))
        clause = "" if match is None else match[1].strip()
        return clause if 0 < len(clause) <= _LONGEST_TITLE else self._system.name

    @cached_property
    def paragraphs(self) -> list[tuple[str, str]]:
        """The paragraphs, each as its facts and the questions that end it."""
        found = []
        for paragraph in self._paragraphs:
            sentences = [part.strip() for part in _SENTENCE.findall(paragraph) if part.strip()]
            asked = [part for part in sentences if part.endswith("?")]
            found.append((" ".join(part for part in sentences if part not in asked), " ".join(asked)))
        return [pair for pair in found if any(pair)]


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
    told = {title: _blocks(part) for title, part in parts.items()}
    top = Section("", (Statement(tuple(content.asked.paragraphs)), content.figure, *told.pop("Answer")))
    return [top, *(Section(title, blocks) for title, blocks in told.items() if blocks)]


def exercise_sections(found: Findings, units: Units, letters: SystemLetters) -> list[Section]:
    """Return the figure, the givens and the question, without an answer."""
    content = _Content(found, units, letters)
    facts = tuple((told, "") for told, _ in content.asked.paragraphs if told)
    asked = tuple(("", question) for _, question in content.asked.paragraphs if question)
    return [
        Section("", (Statement(facts), content.figure)),
        Section("Given", tuple(content.givens())),
        *([Section("Asked", (Statement(asked),))] if asked else []),
    ]


def answer_sections(found: Findings, units: Units, letters: SystemLetters) -> list[Section]:
    """Return the givens and the answers alone: a sheet for whoever corrects."""
    content = _Content(found, units, letters)
    statement = Statement(tuple(content.asked.paragraphs))
    return [Section("", (statement, *_blocks(content.answers))), Section("Given", tuple(content.givens()))]


def _blocks(part: Callable[[], Iterator[Block]]) -> tuple[Block, ...]:
    """Return the blocks of a part of a report, or the reason why there are none."""
    found = answer(lambda: tuple(part()))
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

    @property
    def figure(self) -> Block:
        return self.found.figure if isinstance(self.found.figure, Missing) else Pictures({"": self.found.figure})

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
        told = [line for step in worked.steps if step.title in _RESULTS for line in formulas_in(step.lines)]
        sizes = [abs(line.value.number) for line in told if line.value is not None]
        least = _ROUNDING * max(sizes, default=0.0)
        lines = [line for line in told if line.value is not None and abs(line.value.number) > least]
        moves = any(line.sides and worked.notation.text(line.sides[0]).endswith("'") for line in lines)
        assert self.solved is not None
        still: list[Block] = []
        if self.solved.impact is None and not moves and len(lines) < len(told):
            words = "Nothing is accelerated." if any(self.solved.speeds.values()) else "It stays at rest."
            still.append(Sentence((words,)))
        shown = sorted(lines, key=lambda line: self._rank(line, worked))[:_MOST_ANSWERS]
        return [*still, BlocksInLetters(worked.notation, tuple(self._short(line, worked) for line in shown))]

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
            known = run.ready.told.state_units
            values = [*{**run.final["speeds"], **run.final["coordinates"]}.items()][:_MOST_ANSWERS]
            for name, x in values:
                number, when = Quantity(x, known[name]), self._when(run.t_final)
                told.append(Formula((self.letters.label(name),), value=number, after=when))
        return told

    def _when(self, t: float, error: float = 0.0) -> Words:
        return " at ", self.letters.label("t"), " = ", Quantity(t, "s", error)

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
