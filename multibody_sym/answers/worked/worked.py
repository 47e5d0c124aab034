"""A solved instant step by step, as a book writes it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.ask.working import AT_START, BY_RUN, WorkedAnswer
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import acceleration_names
from multibody_sym.answers.instant.loops import MOST_DEPENDENT, InLetters
from multibody_sym.answers.records import Formula, Line, Sentence, Solution, Worked, WorkedStep, formulas_in
from multibody_sym.answers.worked.actions import gripping_ratio
from multibody_sym.answers.worked.alternatives import rejected_alternatives
from multibody_sym.answers.worked.bodies import FORCES, BodyLines, forces_spelt, mass_lines, members, safely, wording
from multibody_sym.answers.worked.equations import (
    EliminationStep,
    Equations,
    HandElimination,
    LinearForm,
    NumberedEquation,
    in_sympy,
    model_letters,
)
from multibody_sym.answers.worked.questions import with_questions
from multibody_sym.derivation.free_bodies import MOMENT
from multibody_sym.derivation.notation import NAME, Label, Notation, Symbols, latex_name, notation_of, symbols_of
from multibody_sym.derivation.symbolic_start import SymbolicState, any_state
from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.mechanism import Mechanism, Source, TreeBody
from multibody_sym.mechanics.modes import is_direction
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.mechanics.units import REACTION_UNITS, MechanismUnits
from multibody_sym.model.fields import Point
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, Node, as_node, nodes_among, slot, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.printer import COMPONENTS, text
from multibody_sym.text.units import DIMENSIONLESS
from multibody_sym.text.values import Quantity, Value

# ----------------------------------------------------------------------------------------------------------------------
# What is given: the values of parameters, the coordinates with their directions, and how it all starts.


_AT_REST: Final = 1e-12


def given_lines(solved: SolvedInstant, symbols: Symbols) -> Iterator[Line]:
    """Yield the lines: parameters with values, coordinates with what they count and where they start."""
    mechanism, told = solved.mechanism, MechanismUnits(solved.mechanism)
    values = zip(mechanism.parameters, symbols.parameters, solved.begin.parameters, strict=True)
    for entry, s, value in values:
        if entry.source is Source.DECLARED:
            turned = entry.value is not None and entry.dimension == DIMENSIONLESS and leaves([entry.value], "pi")
            yield Formula((s,), value=Quantity(float(value), "rad" if turned else told.parameters[entry.name]))
        elif is_direction(entry.name):
            yield Formula((s,), value=Quantity(float(value), ""), before=("in the direction of slip",))
    for body in mechanism.bodies:
        if not (body.is_double or body.is_foot):
            yield from _coordinate_lines(solved, symbols, body)


def _coordinate_lines(solved: SolvedInstant, symbols: Symbols, body: TreeBody) -> Iterator[Line]:
    """Yield what each coordinate of a body counts, that of a screw its angle, and how it starts."""
    mechanism, begin = solved.mechanism, solved.begin
    counted: dict[int, str] = {}
    for free in body.free_steps:
        if free.step.curve is not None:
            counted |= dict.fromkeys(free.q, "place on the curve of")
            continue
        turns = bool(free.q) and mechanism.coordinates[free.q[0]].unit == "rad"
        axes, what = (free.step.turns, "angle about") if turns else (free.step.slides, "way along")
        counted |= dict(zip(free.q, (f"{what} {_axis(axis)} of" for axis in axes), strict=False))
    least = _AT_REST * max(map(abs, (1.0, *begin.u)))
    for q, u in body.rate_pairs:
        rate = Quantity(float(begin.u[u]), mechanism.speeds[u].unit)
        how = ("at rest",) if abs(rate.number) <= least else ("moving with ", rate)
        place = Quantity(float(begin.q[q]), mechanism.coordinates[q].unit)
        yield Sentence(
            (symbols.coordinates[q], f": {counted.get(q, 'coordinate of')} {body.name}, at ", place, ", ", *how)
        )


_ALONG: Final = {"1, 0, 0": "x", "0, 1, 0": "y", "0, 0, 1": "z", "-1, 0, 0": "-x", "0, -1, 0": "-y", "0, 0, -1": "-z"}


def _axis(axis: Point) -> str:
    components = ", ".join(map(text, axis))
    return _ALONG.get(components, f"({components})")


# ----------------------------------------------------------------------------------------------------------------------
# Accelerations of loops that grow too long to be eliminated, step by step in letters, each with what it stands for.


_OF_DEPENDENT = "from how loops close", "from the rate of that", "from the second rate of that"


class ByLetters:
    """What gives the accelerations of a start: where loops lead, ratios, inertias and loads by their letters.

    `spelling`, `places` and `values` are those of the letters that steps do not have otherwise.
    """

    def __init__(self, found: InLetters, mechanism: Mechanism, symbols: Symbols) -> None:
        every = found.coordinates.all
        found.instant  # noqa: B018 - defines the accelerations
        accelerations = {x.own[2]: symbols.accelerations[x.u] for x in every}
        self._needed = found.needed([node for node in accelerations if found.defined(node)])
        self._leaves = {**model_letters(mechanism, symbols), **accelerations}
        own = [node for node in self._needed if node not in self._leaves]
        self._leaves.update((node, sympy.Symbol(str(node.data), real=True)) for node in own)
        labels = {node: Label(str(node.data), latex_name(str(node.data))) for node in own}
        self.spelling = {self._leaves[node]: label for node, label in labels.items()}
        self.places = {self._leaves[node]: (NAME, k) for k, node in enumerate(own)}
        self.values = {self._leaves[node]: self._needed[node].value for node in own}
        dependent = [every[k].own for k in found.loops.dependent]
        self._says = {x[k]: _OF_DEPENDENT[k] for k in (0, 1) for x in dependent}
        self._says.update((node, self._needed[node].says) for node in own)
        self._says.update((every[k].own[2], "so") for k in found.loops.free)
        self._says.update((x[2], _OF_DEPENDENT[2]) for x in dependent)

    def lines(self) -> Iterator[Line]:
        """Yield what gives each letter, after what it is found from."""
        for node in self._says:
            one = self._needed.get(node)
            if one is None or not one.formula:  # it has a number alone
                continue
            sides = one.equation if one.expression is None else (node, one.expression)
            yield Formula(tuple(to_sympy(side, self._leaves) for side in sides or ()), before=(self._says[node],))


# ----------------------------------------------------------------------------------------------------------------------

_NOT_UNIQUE: Final = 1e-8
_LONGEST_SIDE: Final = 240
"""Letters of a side of an equation in motion that is still read."""
_OF_FORCES: Final = frozenset(("reaction", "tension", "multiplier", "power", "acceleration", "angular_acceleration"))
"""Functions whose values follow from forces and accelerations."""


def _names_forces(nodes: Iterable[Node]) -> bool:
    """Return whether expressions name a force or an acceleration."""
    named = leaves(list(nodes), "quantity"), leaves(list(nodes), "symbol")
    return any(x.data[0] in _OF_FORCES or "'" in x.data[0] for x in named[0]) or any(
        str(x.data).endswith("''") for x in named[1]
    )


def _is_of_start(asked: WorkedAnswer, lines: Sequence[Line]) -> bool:
    """Return whether a question is about forces or accelerations at the start."""
    if AT_START in lines:
        return True
    if asked.at_start is None:
        return not asked.is_later and not asked.is_of_small_motion
    return _names_forces([asked.at_start])


def worked_steps(solved: SolvedInstant, solution: Solution, asked: Mapping[str, WorkedAnswer]) -> Worked:
    """Return the steps of a solution, and those by which questions that are `asked` are answered.

    The forces at the start are found where nothing is asked, or something about them; the equations of motion where
    lines of questions use them. Where coefficients grow too long in symbols, numbers stand in their place. Where
    expressions have no value at the exact start, such as a quotient 0/0, the steps end with the given values.
    """
    lines = {name: each.working.lines() for name, each in asked.items()}
    every = [line for each in lines.values() for line in each]
    named = nodes_among(x for line in every for x in (line.sides if isinstance(line, Formula) else line.words))
    of_motion = not solution.at_rest and (BY_RUN in every or _names_forces(named))  # those of a theorem do not
    forces = any(x.data[0] in ("reaction", "tension", "multiplier") for x in leaves(named, "quantity"))
    needs_start = solution.at_rest or solved.needs_no_forces or not asked
    of_start = [each.at_start for name, each in asked.items() if _is_of_start(each, lines[name])]
    found = None
    if not needs_start and not of_start:
        state = WorkedStep("State", tuple(Sentence((line,)) for line in solution.found))
        found, symbols = _given_alone(solved, *(x for x in (state, _conditions(solution)) if x.lines))
        if of_motion:
            found, symbols = _steps_of_motion(solved, solution, forces=forces)
    if found is None:
        known = [x for x in of_start if x is not None]  # else all is to be found
        wanted = leaves(known, "quantity") if len(known) == len(of_start) else []
        found, symbols, hides = _steps_at_start(solved, solution, wanted)
        still = solution.at_rest or solved.needs_no_forces
        if not still and (hides or of_motion):
            found = _with_motion(solved, solution, found, forces=forces) or found
    if not asked:
        return found
    assembled = {coordinate.name for coordinate in solved.mechanism.coordinates}
    undefined = set(solution.where) - assembled if solved.needs_no_forces else ()
    return with_questions(found, solved.mechanism, symbols, solution.answers, asked, undefined, lines)


_ON_ITS_WAY: Final = 0.02
"""m, rad, and their rates: how far a moment after the start is from it, more than samples of letters are aside."""


def _steps_of_motion(solved: SolvedInstant, solution: Solution, *, forces: bool) -> tuple[Worked | None, Symbols]:
    """Return what is given, the state, and the equations of motion; None where these have no formulas."""
    given, symbols = _given_alone(solved)
    moving = _in_motion(solved, solution)
    if moving is None:
        return None, symbols
    try:
        in_motion = moving.steps_in_motion(forces=forces)
    except (NoClosedFormError, ExpressionError):
        return None, symbols
    steps = [
        *(replace(step, lines=(*mass_lines(moving.equations), *step.lines)) for step in given.steps),
        WorkedStep("State", tuple(Sentence((line,)) for line in solution.found)),
        *in_motion,
        _conditions(solution),
    ]
    notation = moving.notation
    with suppress(NoClosedFormError, ExpressionError):
        if solved.mechanism.one_way and solved.mechanism.mode is not None:
            start = _Work(solved, solution)
            steps += rejected_alternatives(start.equations, start.notation, start.units)
            notation = start.notation.joined(notation)
    return replace(given, steps=tuple(step for step in steps if step.lines), notation=notation), moving.symbols


def _conditions(solution: Solution) -> WorkedStep:
    """Return the conditions, with what happens where they fail."""
    said = (f"{x} (else {solution.limits[x]})" if solution.limits.get(x) else x for x in solution.conditions)
    return WorkedStep("Conditions", tuple(Sentence((words,)) for words in said))


def _in_motion(solved: SolvedInstant, solution: Solution) -> _Work | None:
    """Return what the equations of motion are made from, soon after the start; None where these have no formulas."""
    mechanism, begin = solved.mechanism, solved.begin
    if mechanism.rates or depends_on_quaternions(solved):
        return None
    u = [x or math.copysign(_ON_ITS_WAY, a) * bool(a) for x, a in zip(begin.u, solved.numbers.udot, strict=True)]
    q = list(begin.q)
    for k, rate in (pair for body in mechanism.bodies for pair in body.rate_pairs):
        q[k] = q[k] or math.copysign(_ON_ITS_WAY, u[rate]) * bool(u[rate])
    given = any_state(mechanism, replace(begin, q=tuple(q), u=tuple(u)), solved.nodes.motion.state)
    try:
        return _Work(solved, solution, given=given)
    except (NoClosedFormError, ExpressionError):
        return None


_TURNED: Final = ((1.0, 0.0, 0.0, 0.0), (0.5, 0.5, -0.5, 0.5))
"""Two orientations, as quaternions."""


def depends_on_quaternions(solved: SolvedInstant) -> bool:
    """Return whether accelerations depend on orientations by quaternions, whose letters a book does not use."""
    mechanism, begin = solved.mechanism, solved.begin
    places = [place for body in mechanism.bodies for place in body.quaternions]
    if not places or mechanism.rows:
        return bool(places)
    speeds, found = [0.3 * (k + 1) for k in range(len(begin.u))], list[list[float]]()
    for turned in _TURNED:
        q = list(begin.q)
        for place in places:
            for k, x in zip(place, turned, strict=True):
                q[k] = x
        state = state_of(mechanism, float, 0.0, q, speeds, list(begin.parameters))
        found.append([float(x) for x in forward_dynamics(tree_dynamics_of(mechanism, state)).udot])
    size = max(map(abs, found[0]), default=0.0)
    return any(abs(a - b) > _AT_REST * size for a, b in zip(*found, strict=True))


def _with_motion(solved: SolvedInstant, solution: Solution, found: Worked, *, forces: bool = False) -> Worked | None:
    """Return steps with the equations of motion, where these differ from those at the start.

    None where these have no formulas.
    """
    moving = _in_motion(solved, solution)
    if moving is None:
        return None
    equations = [line for step in found.steps for line in formulas_in(step.lines)]
    number = max((line.tag for line in equations if line.tag is not None), default=0)
    try:
        in_motion = moving.steps_in_motion(" in motion", number, forces=forces)
    except (NoClosedFormError, ExpressionError):
        return None
    known = replace(found, notation=found.notation.joined(moving.notation))
    before = {wording(step.lines, known.notation) for step in found.steps}
    bodies = (step for step in in_motion if step.title.endswith(", cut free in motion"))
    if all(wording(step.lines, known.notation) in before for step in bodies):
        return None
    return replace(known, steps=(*found.steps, *in_motion))


def _steps_at_start(
    solved: SolvedInstant, solution: Solution, asked: Sequence[Node]
) -> tuple[Worked, Symbols, bool]:
    """Return the steps, their symbols, and whether declared forces are missing, since they vanish at the start.

    Of the unknowns those that are `asked`, all where none are.
    """
    if solved.needs_no_forces:
        return *_given_alone(solved), False
    try:
        try:
            work = _Work(solved, solution)
            return *work.written(asked), work.hides_forces
        except NoClosedFormError:
            return *_Work(solved, solution, numbers=True).written([]), False
    except ExpressionError as reason:
        why = Sentence((f"the equations are not written out: {reason.message}",))
        return *_given_alone(solved, WorkedStep("Equations", (why,))), False


def _given_alone(solved: SolvedInstant, *more: WorkedStep) -> tuple[Worked, Symbols]:
    symbols = symbols_of(solved.mechanism)
    steps = WorkedStep("Given", tuple(given_lines(solved, symbols))), *more
    notation = notation_of(solved.mechanism, symbols, labels=letters_of(solved.system))
    begin = solved.begin
    groups = (symbols.parameters, begin.parameters), (symbols.coordinates, begin.q), (symbols.speeds, begin.u)
    values = {s: float(x) for made, given in groups for s, x in zip(made, given, strict=True)}
    return Worked(solved.mechanism.name, steps, notation, values), symbols


class _Work:
    """What the steps are made from."""

    def __init__(
        self, solved: SolvedInstant, solution: Solution, *, given: SymbolicState | None = None, numbers: bool = False
    ) -> None:
        self.solved, self.solution = solved, solution
        self.mechanism = solved.mechanism
        plane = in_plane(solved.system)
        state, rests = given or _with_speeds(solved), given is None and solved.is_structure
        self.equations = Equations(self.mechanism, state, plane=plane, numbers=numbers, rests=rests)
        self.symbols, self.exactly = self.equations.symbols, self.equations.exactly
        self.actions, self.words, self.cut = self.equations.actions, self.equations.words, self.equations.cut
        self.elimination, self.reason = self.equations.elimination, self.equations.reason
        self.unknowns = self.equations.unknowns

    @cached_property
    def _by_letters(self) -> ByLetters | None:
        """What gives the accelerations in letters; None where they are eliminated, or letters too long as well."""
        found = self.solved.lettered.found if self.reason else None
        return None if found is None else ByLetters(found, self.mechanism, self.symbols)

    @cached_property
    def notation(self) -> Notation:
        plain = forces_spelt(self.equations, letters_of(self.solved.system))
        spelling, places = {**plain.spelling, **self._directions}, plain.places
        if self._by_letters is not None:
            spelling, places = {**self._by_letters.spelling, **spelling}, {**places, **self._by_letters.places}
        return replace(plain, spelling=spelling, places=places)

    @cached_property
    def told(self) -> BodyLines:
        return BodyLines(self.equations, self.notation, FORCES)

    @cached_property
    def _directions(self) -> dict[Any, Label]:
        """How the components of directions are spelt in which something starts to slide in space."""
        entries = zip(self.mechanism.parameters, self.symbols.parameters, strict=True)
        chosen = [s for entry, s in entries if is_direction(entry.name)]
        return {s: Label(f"d{k}", f"d_{{{k}}}") for k, s in enumerate(chosen, 1)}

    @cached_property
    def values(self) -> dict[Any, float]:
        given = self.solved.begin
        found = self._numbers_of(self.solved.numbers)
        found.update(self._by_letters.values if self._by_letters is not None else {})
        found.update(zip(self.symbols.parameters, given.parameters, strict=True))
        found.update(self.equations.masses)
        found.update(zip(self.symbols.coordinates, given.q, strict=True))
        found.update(zip(self.symbols.speeds, given.u, strict=True))
        for e in self.equations.laws:
            s = next(iter(e.left.terms))
            found[s] = _value(e.right.plus(e.left.without(s), -1), found) / float(e.left.terms[s].sample)
        for length in self.equations.lengths:
            sizes = [_value(form, found) for form in self.equations.pressing(length)]
            found[length.symbol] = float(self.exactly.quotients([length.factor])[0].sample) * math.hypot(*sizes)
        return found

    def _numbers_of(self, instant: StateQuantities) -> dict[Any, float]:
        found = dict(zip(self.symbols.accelerations, map(float, instant.udot), strict=True))
        found.update(zip(self.symbols.multipliers, map(float, instant.multipliers), strict=True))
        found.update((s, float(instant.tensions[asked])) for s, asked in self.actions.tensions.items())
        for index, body in enumerate(self.mechanism.bodies):
            reaction = instant.reactions[body.joint_name]
            named = zip(self.actions.reaction_symbols(index), COMPONENTS, strict=True)
            found.update((s, float(reaction[c])) for s, c in named)
        return found

    def _unsolved(self) -> set[Any]:
        if not self.reason:
            return set(self.elimination.unsolved(self.unknowns))
        others = [self._numbers_of(other) for other in self.solved.others]
        least = _NOT_UNIQUE * max((abs(self.values[x]) for x in self.unknowns), default=0.0)
        return {
            x for x in self.unknowns for other in others if abs(other.get(x, self.values[x]) - self.values[x]) > least
        }

    @cached_property
    def units(self) -> dict[Any, str]:
        told = MechanismUnits(self.mechanism)
        named = zip(self.symbols.accelerations, self.mechanism.speeds, strict=True)
        found = {s: told.accelerations[speed.name] for s, speed in named}
        rows = zip(self.symbols.multipliers, self.mechanism.rows, strict=True)
        found.update((s, told.multipliers[row.name]) for s, row in rows)
        for index in range(len(self.mechanism.bodies)):
            of_joint = zip(self.actions.reaction_symbols(index), COMPONENTS, strict=True)
            found.update((s, REACTION_UNITS[c]) for s, c in of_joint)
        found.update((each.symbol, "N*m" if each.letter == MOMENT else "N") for each in self.actions.further)
        return found

    # --- steps -----------------------------------------------------------------------------------------------------

    def written(self, asked: Sequence[Node]) -> tuple[Worked, Symbols]:
        """Return all steps of the start, with the unknowns that quantities name (all where none are `asked`)."""
        self.exactly.renew()
        wanted = self._wanted(asked)
        elimination = self._needed_elimination(wanted) if wanted else []
        used = self._numbered(elimination, 0)
        steps = [
            WorkedStep("Given", (*mass_lines(self.equations), *given_lines(self.solved, self.symbols))),
            WorkedStep("State", tuple(Sentence((line,)) for line in (*self._resting(), *self.solution.found))),
            *self._balances("", used),
            WorkedStep("Laws of forces", tuple(self._laws(used))),
            WorkedStep("Elimination", tuple(self._elimination(elimination or self.elimination.steps))),
            WorkedStep("Result", tuple(self._result(wanted or self.unknowns))),
            WorkedStep("Members", (*self._members(), *self._bodies_at_rest())),
            _conditions(self.solution),
            *rejected_alternatives(self.equations, self.notation, self.units),
        ]
        found = Worked(self.mechanism.name, tuple(s for s in steps if s.lines), self.notation, self.values)
        return found, self.symbols

    def _wanted(self, asked: Sequence[Node]) -> list[Any]:
        """Return the accelerations and reactions of joints that quantities are; none where one is something else."""
        names = [body.joint_name for body in self.mechanism.bodies]
        accelerations = dict(zip(acceleration_names(self.mechanism), self.symbols.accelerations, strict=True))
        found = []
        for leaf in asked:
            function, (name, *rest) = leaf.data[0], leaf.data[1]
            if function == "''" and name in accelerations:
                found.append(accelerations[name])
            elif function == "reaction" and name in names and rest[0] in COMPONENTS:
                found.append(self.actions.reaction_symbols(names.index(name))[COMPONENTS.index(rest[0])])
            elif function in _OF_FORCES:
                return []
        solved = self.elimination.results
        return found if not self.reason and all(x in solved and not solved[x].terms for x in found) else []

    def _numbered(self, elimination: Sequence[EliminationStep], number: int) -> list[NumberedEquation]:
        """Return the equations that an elimination uses, all where there is none, numbered from behind a number."""
        every = self.equations.all
        used = [e for e in every if not elimination or any(step.equation is e for step in elimination)]
        for tag, e in enumerate(used, number + 1):
            e.tag = tag
        return used

    def _balances(self, beside: str, used: Sequence[NumberedEquation]) -> Iterator[WorkedStep]:
        """Yield the bodies cut free whose equations are used, and what joints and constraints demand."""
        for body in self.cut.bodies:
            if not body.equations or any(e in used for e in body.equations):
                yield WorkedStep(f"{body.name}, cut free{beside}", tuple(self.told.body(body, used)))
        for title, every in (
            ("Free directions of joints", self.cut.free),
            ("Relations between accelerations", self.equations.relations),
        ):
            yield WorkedStep(f"{title}{beside}", tuple(self.told.formula(e) for e in every if e in used))

    def _resting(self) -> Iterator[str]:
        if self.solution.at_rest:
            yield "at rest: constraints leave no freedom, all forces are in equilibrium"

    def _members(self) -> Iterator[Line]:
        """Yield whether each rod of a structure is pulled or pressed, with the size of its force."""
        rows = zip(self.symbols.multipliers, self.mechanism.rows, strict=True)
        of_rods = {row.name: s for s, row in rows if self.solution.kinds.get(row.name) == "rod"}
        unsolved = self._unsolved() if self.solution.at_rest and of_rods else set()
        for name, s in of_rods.items() if self.solution.at_rest else ():
            if s not in self.unknowns or s in unsolved:
                continue
            size = 0.0 if abs(self.values[s]) <= self._rounding else abs(self.values[s])
            if size == 0.0:
                yield Sentence((f"{name}: a zero-force member",))
                continue
            sign, word = (1, "tension") if self.values[s] > 0.0 else (-1, "compression")
            form = sympy.S.Zero if self.reason else sign * safely(self.exactly, self.elimination.results[s])
            if form.is_number:
                yield Sentence((f"{name}: {word} ", Quantity(size, "N")))
            else:
                yield Formula((form,), value=Quantity(size, "N"), before=(f"{word} in {name}",))

    def _bodies_at_rest(self) -> Iterator[Line]:
        """Yield on which bodies at rest nothing, two or three elements act, and along which lines."""
        if not (self.words.plane and self.solved.rests):
            return
        letters = model_letters(self.mechanism, self.symbols)
        for each in members(self.solved):
            if not each.elements:
                yield Sentence((f"{each.body}: a zero-force member",))
            elif each.size is not None:
                word = "tension" if (each.size.value or 0.0) > 0.0 else "compression"
                along = " and ".join(each.elements)
                yield Sentence((f"{each.body}: a two-force member, {word} along the line through {along}",))
            elif each.place is not None:
                *first, last = each.elements
                named = f"{', '.join(first)} and {last}"
                parallel = (" are parallel",)
                at = [_told(x, letters) for x in each.place.values()]
                where = (" meet at (", at[0], ", ", at[1], ")") if at else parallel
                yield Sentence((f"{each.body}: a three-force member, the lines of action of {named}", *where))

    @property
    def hides_forces(self) -> bool:
        """Whether a declared force acts on no body here."""
        shown = {force.action.element for body in self.cut.bodies for force in body.forces}
        acting = (action for actions in self.actions.of_body for action in actions)
        return any(action.kind in ("load", "spring") and action.element not in shown for action in acting)

    def steps_in_motion(self, beside: str = "", number: int = 0, *, forces: bool) -> list[WorkedStep]:
        """Return the bodies cut free, what gives their forces, and how the accelerations follow, and `forces`.

        `beside`: the words in titles that tell them from those at the start, whose equations end with a `number`.
        Raises NoClosedFormError.
        """
        wanted = [x for x in (self.unknowns if forces else self.symbols.accelerations) if x in self.elimination.results]
        moving = [x for x in wanted if x in self.symbols.accelerations]
        failed = self.reason or self.elimination.unsolved(moving)
        elimination = [] if failed else self._needed_elimination(wanted)
        used = self._numbered(elimination, number)
        laws = (e for e in self.equations.laws if e in used)
        steps = [
            *(step for step in self._balances(beside, used) if formulas_in(step.lines)),
            WorkedStep(f"Laws of forces{beside}", tuple(map(self.told.formula, laws))),
            WorkedStep("Equations of motion", tuple(self._motion_lines(elimination))),
        ]
        return [replace(step, is_later=True) for step in steps if step.lines]

    def _needed_elimination(self, wanted: Sequence[Any]) -> list[EliminationStep]:
        by = {step.unknown: step for step in self.elimination.steps}
        needed, waiting = set[Any](), list(wanted)
        while waiting:
            x = waiting.pop()
            if x not in needed and x in by:
                needed.add(x)
                waiting += by[x].equation.form.terms
        return [step for step in self.elimination.steps if step.unknown in needed]

    def _motion_lines(self, elimination: Sequence[EliminationStep]) -> Iterator[Line]:
        """Yield how accelerations follow, each in the end from coordinates and speeds alone; nothing that is long."""
        said = {e.sides(self.exactly) for e in self.equations.all}
        found = list[Formula]()
        try:
            for step in elimination:
                for line in self.told.found(step, in_sympy):
                    if line.sides not in said:
                        found.append(line)
                    said.add(line.sides)
        except NoClosedFormError:
            return
        if any(len(self.notation.text(side)) > _LONGEST_SIDE for line in found for side in line.sides):
            return
        yield from found
        for step in elimination:
            if step.unknown in self.symbols.accelerations and step.value.terms:
                result = in_sympy(self.exactly, self.elimination.results[step.unknown])
                if len(self.notation.text(result)) <= _LONGEST_SIDE:
                    yield Formula((step.unknown, result), before=("so",))

    def _laws(self, used: Sequence[NumberedEquation]) -> Iterator[Line]:
        yield from (self.told.formula(e) for e in self.equations.laws if e in used)
        yield from self._lengths()
        yield from self._grips()

    def _lengths(self) -> Iterator[Line]:
        """Yield the laws of friction that the length of a vector presses."""
        for length in self.equations.lengths:
            squares = [in_sympy(self.exactly, form) ** 2 for form in self.equations.pressing(length)]
            (factor,) = self.exactly.quotients([length.factor])
            sides = length.symbol, self.exactly.written(factor) * sympy.sqrt(sympy.Add(*squares))
            yield Formula(sides, before=(length.element,))

    def _grips(self) -> Iterator[Line]:
        """Yield how far one tension may exceed the other where a rope grips a rough wheel."""
        places = {each.slip: each for each in self.actions.grips if not each.slides}
        unsolved = self._unsolved()
        for part in (part for element in self.mechanism.one_way for part in element.frictions if not part.enough):
            grip = places.get(part.rows[0].name)
            if grip is None:
                continue
            (most,) = self.exactly.quotients([gripping_ratio(part, self.actions.motion)])
            less, greater = sorted((grip.before, grip.behind), key=lambda s: self.values[s])
            ratio, begin = self.exactly.written(most), f"{part.name} grips as long as"
            if unsolved & {less, greater}:
                words = f"{begin} neither of ", grip.before, " and ", grip.behind, " is more than ", ratio
                yield Sentence((*words, " times the other"))
            else:
                yield Formula((greater, less * ratio), relation="<=", before=(begin,))

    def _elimination(self, steps: Sequence[EliminationStep]) -> Iterator[Line]:
        if self.reason:
            count = len(self.equations.all) + len(self.equations.lengths)
            kind = "" if self.equations.lengths else "linear "
            yield Sentence((f"{count} {kind}equations for {len(self.unknowns)} unknowns, solved in numbers:",))
            yield Sentence((self.reason,))
            yield from self._by_each_other()
            return
        for found in steps:
            yield from self.told.found(found, safely)

    def _by_each_other(self) -> Iterator[Line]:
        """Yield what gives the accelerations in letters, else by those that are left, as relations alone give them."""
        if self._by_letters is not None:
            yield from self._by_letters.lines()
            return
        if len(self.equations.relations) > MOST_DEPENDENT:
            return
        accelerations = self.symbols.accelerations
        alone = HandElimination(self.exactly, accelerations, only=accelerations)
        self.exactly.renew()
        try:
            alone.run([e for e in self.equations.relations if set(e.form.terms) <= set(accelerations)])
            told = [(step.unknown, in_sympy(self.exactly, alone.results[step.unknown])) for step in alone.steps]
        except NoClosedFormError:
            return
        if not self.exactly.numbers:
            yield from (Formula(sides, before=("from relations alone",)) for sides in told)

    def _result(self, wanted: Sequence[Any]) -> Iterator[Line]:
        unsolved = self._unsolved()
        for x in wanted:
            if x in unsolved:
                continue
            sides = (x,) if self.reason else (x, safely(self.exactly, self.elimination.results[x]))
            vanishes = sides[-1] == 0 or abs(self.values[x]) <= self._rounding
            value = Quantity(0.0 if vanishes else self.values[x], self.units.get(x, ""))
            plain = len(sides) == 2 and sides[1].is_number
            yield Formula(sides[:1] if plain else sides, value=value)
        if open_ := [x for x in wanted if x in unsolved]:
            named = [part for x in open_ for part in (", ", x)][1:]
            verb = "are" if open_[1:] else "is"
            yield Sentence((*named, f" {verb} not unique: constraints depend on each other"))

    @cached_property
    def _rounding(self) -> float:
        return 1e-12 * max((abs(self.values[x]) for x in self.unknowns), default=0.0)


def _told(value: Value, letters: Mapping[Node, Any]) -> Any:
    """Return a value as its formula in sympy, or as its number."""
    form = value.expression
    if form is None or not set(leaves([form], "symbol")) <= letters.keys():
        return Quantity(value.value or 0.0, value.unit)
    return to_sympy(form, letters)


def _with_speeds(solved: SolvedInstant) -> SymbolicState:
    """Return the start with letters for speeds that follow from others: a book does not write them out."""
    given, mechanism = solved.symbolic, solved.mechanism
    assembled = {speed.name for speed in mechanism.speeds if speed.name in solved.begin.assembled}
    state, u = given.state, list(given.state.u)
    for k, speed in enumerate(mechanism.speeds):
        if speed.name in assembled and symbol(speed.name) in given.letters and leaves([as_node(u[k])], "symbol"):
            u[k] = symbol(speed.name)
    parameters = [state.slots[slot("parameters", k)] for k in range(len(mechanism.parameters))]
    return replace(given, state=state_of(mechanism, Node, ZERO, list(state.q), u, parameters))


def _value(form: LinearForm, values: Mapping[Any, float]) -> float:
    return float(form.rest.sample) + sum(float(a.sample) * values[x] for x, a in form.terms.items())
