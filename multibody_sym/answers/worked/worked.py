"""A solved instant step by step, as a book writes it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.ask.working import WorkedAnswer
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.loops import MOST_DEPENDENT, InLetters
from multibody_sym.answers.records import (
    Definition,
    Formula,
    Line,
    Sentence,
    Solution,
    Words,
    Worked,
    WorkedStep,
)
from multibody_sym.answers.worked.actions import Action, gripping_ratio, is_grip
from multibody_sym.answers.worked.equations import (
    BodyForce,
    EliminationStep,
    Equations,
    FreeBody,
    HandElimination,
    LinearForm,
    NumberedEquation,
    accelerations_left,
    in_number,
    in_sympy,
    linear,
    short,
)
from multibody_sym.answers.worked.members import members
from multibody_sym.answers.worked.questions import with_questions
from multibody_sym.derivation.free_bodies import FRICTION, MOMENT, NORMAL, force_letters, guide_normal, row_letter
from multibody_sym.derivation.notation import (
    MULTIPLIER,
    NAME,
    Label,
    Notation,
    Symbols,
    latex_name,
    notation_of,
    symbols_of,
)
from multibody_sym.derivation.symbolic_start import SymbolicState, any_state
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.law_elements import STICKS, FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import Mechanism, Source, TreeBody
from multibody_sym.mechanics.modes import in_mode, is_direction
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.row_kinematics import coefficients, row_motion
from multibody_sym.mechanics.row_records import TurningRow
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.mechanics.units import REACTION_UNITS, MechanismUnits
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.scalars.vectors import apply, negate
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


def _axis(axis: Point) -> str:
    texts = [text(x) for x in axis]
    plain = {("1", "0", "0"): "x", ("0", "1", "0"): "y", ("0", "0", "1"): "z"}
    back = {("-1", "0", "0"): "-x", ("0", "-1", "0"): "-y", ("0", "0", "-1"): "-z"}
    key = (texts[0], texts[1], texts[2])
    return plain.get(key) or back.get(key) or f"({', '.join(texts)})"


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
        declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
        made = (*symbols.coordinates, *symbols.speeds, *symbols.parameters)
        self._leaves: dict[Node, Any] = {symbol(each.name): s for each, s in zip(declared, made, strict=True)}
        self._leaves.update(accelerations)
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
            sides = self._sides(node, one) if one is not None else ()
            if sides:
                told = tuple(to_sympy(side, self._leaves) for side in sides)
                yield Formula(told, before=(self._says[node],))

    @staticmethod
    def _sides(node: Node, one: Definition) -> tuple[Node, ...]:
        """Return what is equal; nothing for what is told as a number."""
        return (node, one.expression) if one.expression is not None else one.equation or ()


# ----------------------------------------------------------------------------------------------------------------------

_NOT_UNIQUE: Final = 1e-8
_WORDS: Final = {
    "weight": "weight",
    "load": "force",
    "flow": "reactive force of what leaves or joins",
    "spring": "pull of",
    "reaction": "reaction of joint",
    "counter": "reaction of joint",
    "row": "force of",
    "friction": "friction at",
    "T": "tension of",
    "S": "force of rod",
    "N": "normal force at",
    "F": "friction at",
    "M": "friction at",
}


def worked_steps(solved: SolvedInstant, solution: Solution, asked: Mapping[str, WorkedAnswer]) -> Worked:
    """Return the steps of a solution, and those by which questions that are `asked` are answered.

    Where coefficients grow too long in symbols, numbers stand in their place. Where expressions have no value at the
    exact start, such as a quotient 0/0, the steps end with the given values.
    """
    found, symbols, hides = None, symbols_of(solved.mechanism), False
    if asked and not solved.mechanism.one_way and all(each.is_of_small_motion for each in asked.values()):
        found = _steps_of_small_motion(solved, solution)
    if found is None:
        found, symbols, hides = _steps_at_start(solved, solution)
        if not solution.at_rest and (hides or any(each.is_later for each in asked.values())):
            found = _with_motion(solved, solution, found) or found
    if not asked:
        return found
    assembled = {coordinate.name for coordinate in solved.mechanism.coordinates}
    undefined = set(solution.where) - assembled if solved.needs_no_forces else ()
    return with_questions(found, solved.mechanism, symbols, solution.answers, asked, undefined)


_ON_ITS_WAY: Final = 0.02
"""m, rad, and their rates: how far a moment after the start is from it, more than samples of letters are aside."""


def _steps_of_small_motion(solved: SolvedInstant, solution: Solution) -> Worked | None:
    """Return what is given, and the bodies cut free in motion; None where these have no formulas."""
    found = _with_motion(solved, solution, _given_alone(solved)[0])
    if found is None or not solution.conditions:
        return found
    return replace(found, steps=(*found.steps, WorkedStep("Conditions", tuple(_condition_lines(solution)))))


def _condition_lines(solution: Solution) -> Iterator[Line]:
    """Yield the conditions, with what happens where they fail."""
    for condition in solution.conditions:
        broken = solution.limits.get(condition)
        yield Sentence((f"{condition} (else {broken})" if broken else condition,))


def _with_motion(solved: SolvedInstant, solution: Solution, found: Worked) -> Worked | None:
    """Return steps with the bodies cut free soon after the start, where they differ from those at the start.

    None where these have no formulas.
    """
    mechanism, begin = solved.mechanism, solved.begin
    if mechanism.rates or any(body.quaternions for body in mechanism.bodies):
        return None
    u = [x or math.copysign(_ON_ITS_WAY, a) * bool(a) for x, a in zip(begin.u, solved.numbers.udot, strict=True)]
    q = list(begin.q)
    for k, rate in (pair for body in mechanism.bodies for pair in body.rate_pairs):
        q[k] = q[k] or math.copysign(_ON_ITS_WAY, u[rate]) * bool(u[rate])
    given = any_state(mechanism, replace(begin, q=tuple(q), u=tuple(u)), solved.nodes.motion.state)
    try:
        moving = _Work(solved, solution, given=given)
        in_motion = moving.steps_in_motion()
    except (NoClosedFormError, ExpressionError):
        return None
    spelling, places = moving.notation.spelling, moving.notation.places
    notation = replace(
        found.notation,
        spelling={**spelling, **found.notation.spelling},
        places={**places, **found.notation.places},
    )
    known = replace(found, notation=notation)
    return replace(known, steps=(*found.steps, *_other_steps(in_motion, known)))


def _other_steps(steps: Sequence[WorkedStep], before: Worked) -> Iterator[WorkedStep]:
    """Yield steps that say what those before do not, with the numbers of equations going on."""
    equations = [line for step in before.steps for line in step.lines if isinstance(line, Formula)]
    number = max((line.tag for line in equations if line.tag is not None), default=0)
    known = {_wording(step.lines, before.notation) for step in before.steps}
    for step in steps:
        if _wording(step.lines, before.notation) in known:
            continue
        lines: list[Line] = []
        for line in step.lines:
            if isinstance(line, Formula) and line.tag is not None:
                number += 1
                line = replace(line, tag=number)
            lines.append(line)
        yield replace(step, lines=tuple(lines))


def _wording(lines: Sequence[Line], notation: Notation) -> tuple[str, ...]:
    """Return the words and letters of lines, without the numbers of equations."""
    parts = ((*line.before, *line.sides) if isinstance(line, Formula) else line.words for line in lines)
    return tuple(" ".join(notation.text(x) if isinstance(x, sympy.Basic) else str(x) for x in each) for each in parts)


def _steps_at_start(solved: SolvedInstant, solution: Solution) -> tuple[Worked, Symbols, bool]:
    """Return the steps, their symbols, and whether declared forces are missing, since they vanish at the start."""
    if solved.needs_no_forces:
        return *_given_alone(solved), False
    try:
        try:
            work = _Work(solved, solution)
            return *work.written(), work.hides_forces
        except NoClosedFormError:
            return *_Work(solved, solution, numbers=True).written(), False
    except ExpressionError as reason:
        why = Sentence((f"the equations are not written out: {reason.message}",))
        return *_given_alone(solved, WorkedStep("Equations", (why,))), False


def _given_alone(solved: SolvedInstant, *more: WorkedStep) -> tuple[Worked, Symbols]:
    """Return the given values as steps, with more of them."""
    symbols = symbols_of(solved.mechanism)
    steps = WorkedStep("Given", tuple(given_lines(solved, symbols))), *more
    notation = notation_of(solved.mechanism, symbols, labels=letters_of(solved.system))
    return Worked(solved.mechanism.name, steps, notation), symbols


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
    def _lettered(self) -> dict[Any, str]:
        """The forces whose letter tells what they are, with it."""
        rows = zip(self.symbols.multipliers, self.mechanism.rows, strict=True)
        guides = (body for body in enumerate(self.mechanism.bodies))
        normal = {self._own(k)[across] for k, body in guides if (across := guide_normal(body)) is not None}
        found = {s: letter for s, row in rows if (letter := row_letter(row, self.mechanism))}
        found |= dict.fromkeys(normal, NORMAL)
        return found | {each.symbol: each.letter for each in self.actions.further}

    @cached_property
    def _by_letters(self) -> ByLetters | None:
        """What gives the accelerations in letters; None where they are eliminated, or letters too long as well."""
        found = self.solved.lettered.found if self.reason else None
        return None if found is None else ByLetters(found, self.mechanism, self.symbols)

    @cached_property
    def notation(self) -> Notation:
        """How everything is spelt."""
        plain = notation_of(self.mechanism, self.symbols, labels=letters_of(self.solved.system))
        letters = force_letters(self.mechanism, self.symbols, self.unknowns, self.actions.further)
        places = {each.symbol: (MULTIPLIER, 10_000 + k) for k, each in enumerate(self.actions.further)}
        spelling = {**plain.spelling, **letters, **self._directions}
        if self._by_letters is not None:
            spelling, places = {**self._by_letters.spelling, **spelling}, {**places, **self._by_letters.places}
        return replace(plain, spelling=spelling, places={**plain.places, **places})

    @cached_property
    def _directions(self) -> dict[Any, Label]:
        """How the components of directions are spelt in which something starts to slide in space."""
        entries = zip(self.mechanism.parameters, self.symbols.parameters, strict=True)
        chosen = [s for entry, s in entries if is_direction(entry.name)]
        return {s: Label(f"d{k}", f"d_{{{k}}}") for k, s in enumerate(chosen, 1)}

    @cached_property
    def values(self) -> dict[Any, float]:
        """The numbers of all symbols."""
        given = self.solved.begin
        found = self._numbers_of(self.solved.numbers)
        found.update(self._by_letters.values if self._by_letters is not None else {})
        found.update(zip(self.symbols.parameters, given.parameters, strict=True))
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
        """Return the accelerations, multipliers and reactions of an instant in floats."""
        found = dict(zip(self.symbols.accelerations, map(float, instant.udot), strict=True))
        found.update(zip(self.symbols.multipliers, map(float, instant.multipliers), strict=True))
        found.update((s, float(instant.tensions[asked])) for s, asked in self.actions.tensions.items())
        for index, body in enumerate(self.mechanism.bodies):
            reaction = instant.reactions[body.joint_name]
            found.update((s, float(reaction[c])) for s, c in zip(self._own(index), COMPONENTS, strict=True))
        return found

    def _unsolved(self) -> set[Any]:
        """Return the unknowns that the equations leave open."""
        if not self.reason:
            return set(self.elimination.unsolved(self.unknowns))
        others = [self._numbers_of(other) for other in self.solved.others]
        least = _NOT_UNIQUE * max((abs(self.values[x]) for x in self.unknowns), default=0.0)
        return {
            x for x in self.unknowns for other in others if abs(other.get(x, self.values[x]) - self.values[x]) > least
        }

    def _own(self, index: int) -> tuple[Any, ...]:
        return self.actions.reaction_symbols(index)

    @cached_property
    def _units(self) -> dict[Any, str]:
        told = MechanismUnits(self.mechanism)
        named = zip(self.symbols.accelerations, self.mechanism.speeds, strict=True)
        found = {s: told.accelerations[speed.name] for s, speed in named}
        rows = zip(self.symbols.multipliers, self.mechanism.rows, strict=True)
        found.update((s, told.multipliers[row.name]) for s, row in rows)
        for index in range(len(self.mechanism.bodies)):
            found.update((s, REACTION_UNITS[c]) for s, c in zip(self._own(index), COMPONENTS, strict=True))
        found.update((each.symbol, "N*m" if each.letter == MOMENT else "N") for each in self.actions.further)
        return found

    # --- steps -----------------------------------------------------------------------------------------------------

    def written(self) -> tuple[Worked, Symbols]:
        self.exactly.renew()
        steps = [
            WorkedStep("Given", tuple(given_lines(self.solved, self.symbols))),
            WorkedStep("State", tuple(Sentence((line,)) for line in (*self._resting(), *self.solution.found))),
            *(WorkedStep(f"{body.name}, cut free", tuple(self._body(body))) for body in self.cut.bodies),
            WorkedStep("Free directions of joints", tuple(self._formula(e) for e in self.cut.free)),
            WorkedStep("Relations between accelerations", tuple(self._formula(e) for e in self.equations.relations)),
            WorkedStep("Laws of forces", (*map(self._formula, self.equations.laws), *self._lengths(), *self._grips())),
            WorkedStep("Elimination", tuple(self._elimination())),
            WorkedStep("Result", tuple(self._result())),
            WorkedStep("Members", (*self._members(), *self._bodies_at_rest())),
            WorkedStep("Conditions", tuple(_condition_lines(self.solution))),
            *rejected_alternatives(self.equations, self.notation, self._units),
        ]
        found = Worked(self.mechanism.name, tuple(s for s in steps if s.lines), self.notation, self.values)
        return found, self.symbols

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
            form = sympy.S.Zero if self.reason else sign * self._safely(self.elimination.results[s])
            if form.is_number:
                yield Sentence((f"{name}: {word} ", Quantity(size, "N")))
            else:
                yield Formula((form,), value=Quantity(size, "N"), before=(f"{word} in {name}",))

    def _bodies_at_rest(self) -> Iterator[Line]:
        """Yield on which bodies at rest nothing, two or three elements act, and along which lines."""
        if not (self.words.plane and self.solved.rests):
            return
        declared = (*self.mechanism.coordinates, *self.mechanism.speeds, *self.mechanism.parameters)
        made = (*self.symbols.coordinates, *self.symbols.speeds, *self.symbols.parameters)
        letters = {symbol(each.name): s for each, s in zip(declared, made, strict=True)}
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

    def steps_in_motion(self) -> list[WorkedStep]:
        """Return the bodies cut free, and what gives their forces."""
        equations = self.equations
        steps = [
            *(WorkedStep(f"{body.name}, cut free in motion", tuple(self._body(body))) for body in self.cut.bodies),
            WorkedStep("Relations between accelerations in motion", tuple(map(self._formula, equations.relations))),
            WorkedStep("Laws of forces in motion", tuple(map(self._formula, equations.laws))),
        ]
        return [replace(step, is_later=True) for step in steps if step.lines]

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

    def _formula(self, e: NumberedEquation) -> Formula:
        return Formula(e.sides(self.exactly), tag=e.tag, before=tuple(e.about))

    def _body(self, body: FreeBody) -> Iterator[Line]:
        told = {x for e in body.equations for x in (*e.left.terms, *e.right.terms)}
        for force in body.forces:
            s = force.action.symbol
            known = self.cut.known.get(s)
            if s is None or s in told or (known is not None and not known.vanishes):
                yield from self._force(force)
        if not body.equations:
            yield Sentence(("neither inertia nor forces: nothing to be written",))
        for e in body.equations:
            yield self._formula(e)

    def _force(self, force: BodyForce) -> Iterator[Line]:
        """Yield what acts: its size, what it is, and its direction."""
        s, action = force.action.symbol, force.action
        turns = all(x.is_zero for x in force.vector)
        size, direction = self.words.turning(force.moment) if turns else self.words.of(force.vector)
        if s is None and direction[0] == "along ":
            yield Sentence((*direction[1:], ": ", self._named(action)))
            return
        known = self.cut.known.get(s)
        if known is not None:
            yield Sentence(tuple(self._driven(force, known)))
            return
        shown_size = self.exactly.written(size)
        words = self._short(direction, action)
        yield Sentence((shown_size if s is None else s * shown_size, f": {self._named(action)}, ", *words))

    def _driven(self, force: BodyForce, known: LinearForm) -> Iterator[Any]:
        """Yield in words what acts along a free direction of a joint: friction by its letter, or what drives."""
        turns = all(x.is_zero for x in force.vector)
        (s, factor), *others = *known.terms.items(), (None, known.rest)
        rubs = s in self.actions.told and not others[1:] and others[0][1].is_zero
        sign = -1 if rubs and factor.sample < 0 else 1
        vector = [x * sign for x in (force.moment if turns else force.vector)]
        size, direction = self.words.turning(vector) if turns else self.words.of(vector)
        yield self._safely(known) * self.exactly.written(size) * sign
        named = f"{self._acting(s)} {self.actions.told[s]}" if rubs else f"drive of joint {force.action.element}"
        yield f": {named}, "
        yield from self._short(direction, force.action)

    def _acting(self, s: Any) -> str:
        letter = self._lettered.get(s, "")
        letter = self.notation.text(s)[:1] if s in self._lettered else ""
        return {FRICTION: "friction of", MOMENT: "friction of", NORMAL: "force of stop"}.get(letter, "force of")

    def _named(self, action: Action) -> str:
        """Return what acts in words."""
        of_symbol = action.kind in ("row", "reaction", "counter") and action.symbol in self._lettered
        letter = self._lettered[action.symbol] if of_symbol else ""
        word = _WORDS.get(letter, _WORDS[action.kind])
        return f"{word} {action.element}".strip()

    def _short(self, direction: Words, action: Action) -> Words:
        """Return a direction, that of a joint's axis by its name where its components are long."""
        if action.symbol not in self.symbols.reactions:
            return short(direction, ("along its line",))
        axis = "xyz"[self.symbols.reactions.index(action.symbol) % 3]
        way = "along" if action.kind == "reaction" else "against"
        return short(direction, (f"{way} {axis} of {action.element}",))

    def _elimination(self) -> Iterator[Line]:
        if self.reason:
            count, kind = (
                len(self.equations.all) + len(self.equations.lengths),
                "" if self.equations.lengths else "linear ",
            )
            yield Sentence((f"{count} {kind}equations for {len(self.unknowns)} unknowns, solved in numbers:",))
            yield Sentence((self.reason,))
            yield from self._by_each_other()
            return
        for found in self.elimination.steps:
            yield from self._found(found)

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

    def _found(self, found: EliminationStep) -> Iterator[Line]:
        value = self._safely(found.value)
        if found.equation.kind == "law" and found.becomes is None:
            return
        if found.becomes is not None:
            changed = accelerations_left(found.becomes, self.symbols.accelerations)
            if len(changed.form.terms) > 1 or any(x in self.symbols.accelerations for x in changed.form.terms):
                sides = self._safely(changed.left), self._safely(changed.right)
                yield Formula(sides, before=(f"({found.equation.tag}) becomes",))
        yield Formula((found.unknown, value), before=(f"from ({found.equation.tag})",))

    def _safely(self, form: LinearForm) -> Any:
        """Return a linear form in sympy, with numbers where its coefficients are too long to be read."""
        try:
            return in_sympy(self.exactly, form)
        except NoClosedFormError:
            parts = [in_number(a) * x for x, a in form.terms.items()]
            return sympy.Add(in_number(form.rest), *parts)

    def _result(self) -> Iterator[Line]:
        unsolved = self._unsolved()
        for x in self.unknowns:
            if x in unsolved:
                continue
            sides = (x,) if self.reason else (x, self._safely(self.elimination.results[x]))
            vanishes = sides[-1] == 0 or abs(self.values[x]) <= self._rounding
            value = Quantity(0.0 if vanishes else self.values[x], self._units.get(x, ""))
            plain = len(sides) == 2 and sides[1].is_number
            yield Formula(sides[:1] if plain else sides, value=value)
        if open_ := [x for x in self.unknowns if x in unsolved]:
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


# ----------------------------------------------------------------------------------------------------------------------
# The test of a state: other directions of sliding, and sticking, are assumed and lead to contradictions.


_MOST: Final = 4
_STILL: Final = 1e-12


@dataclass(frozen=True)
class RestingFriction:
    """Friction of an element that is active, along one row."""

    element: LawElement
    friction: FrictionPart


@dataclass(frozen=True)
class Refuted:
    """An assumption, the `slips` by part, its `equations`, and what contradicts it where one `part` rubs.

    What slides would have the tangential acceleration `left` (over accelerations) = `value`, against the assumption.
    What sticks would need the friction `value`, more than its `limit`; on a rope that grips it would be the greater
    tension `left`, more than the less one allows.
    """

    slips: Mapping[str, int]
    part: RestingFriction
    equations: Equations
    left: LinearForm
    value: Quotient
    limit: Quotient | None = None


def parts_at_rest(equations: Equations) -> list[RestingFriction]:
    """Return the friction parts in the plane that are pressed and do not slide yet."""
    mode, motion, found = equations.mechanism.mode, equations.actions.motion, []
    for element in equations.mechanism.one_way if mode is not None else ():
        if mode is None or (element.unilateral and not mode.acts(element)):
            continue
        for part in (part for part in element.frictions if len(part.rows) == 1 and not part.enough):
            speed = row_motion(part.rows[0], motion, equations.actions.bias).phidot
            if abs(float(equations.exactly.quotients([speed])[0].sample)) <= _STILL:
                found.append(RestingFriction(element, part))
    return found


def refuted_assumptions(equations: Equations) -> Iterator[Refuted]:
    """Yield other assumptions about friction that starts from rest, each with what contradicts it.

    All that slides slides back, or sticks; what sticks slides. Where all that sticks leaves forces open, one part does.
    """
    mode = equations.mechanism.mode
    if mode is None:
        return
    parts = parts_at_rest(equations)
    slips = {part.friction.name: mode.slip(part.friction) for part in parts}
    sliding = {name: slip for name, slip in slips.items() if slip != STICKS}
    if sliding:
        back = {name: -slip for name, slip in sliding.items()}
        stuck = [dict.fromkeys(sliding, STICKS), *({name: STICKS} for name in sliding)]
        assumptions = [[back], stuck]
    else:
        assumptions = [[{name: slip}] for name in slips for slip in (1, -1)][:_MOST]
    for tried in assumptions:
        found = (_contradiction(equations, parts, assumed) for assumed in tried)
        first = next((each for each in found if each is not None), None)
        if first is not None:
            yield first


def _contradiction(equations: Equations, parts: list[RestingFriction], slips: Mapping[str, int]) -> Refuted | None:
    """Return what contradicts an assumption; None where nothing does, or no closed form tells."""
    mechanism, state = equations.mechanism, equations.given.state
    assert mechanism.mode is not None
    added = {row.name for element in mechanism.one_way for row in element.rows}
    bare = replace(mechanism, rows=tuple(row for row in mechanism.rows if row.name not in added), mode=None, held=())
    assumed = in_mode(bare, replace(mechanism.mode, slips={**mechanism.mode.slips, **slips}))
    # parameters that this mode has besides are zero
    parameters = [state.slots.get(slot("parameters", k), ZERO) for k in range(len(assumed.parameters))]
    start = state_of(assumed, Node, ZERO, list(state.q), list(state.u), parameters)
    try:
        other = Equations(assumed, replace(equations.given, state=start), plane=equations.words.plane)
        if other.reason:
            return None
        for part in (part for part in parts if part.friction.name in slips):
            sticks = slips[part.friction.name] == STICKS
            found = _too_much(other, part, slips) if sticks else _wrong_way(other, part, slips)
            if found is not None:
                return found
    except NoClosedFormError:
        pass
    return None


def _wrong_way(other: Equations, part: RestingFriction, slips: Mapping[str, int]) -> Refuted | None:
    """Return how a part that was assumed to slide contradicts that: it begins to move the other way."""
    moved = row_motion(part.friction.rows[0], other.actions.motion, other.actions.bias)
    *factors, gamma = other.exactly.quotients([*moved.jacobian, moved.gamma])
    rate = linear(zip(other.symbols.accelerations, factors, strict=True), -gamma)
    left = rate.times(2 if is_grip(part.friction) else 1)
    value = other.result(left)
    return Refuted(slips, part, other, left, value) if float(value.sample) * slips[part.friction.name] < 0 else None


def _too_much(other: Equations, part: RestingFriction, slips: Mapping[str, int]) -> Refuted | None:
    """Return how a part that was assumed to stick contradicts that: it needs too much friction."""
    if is_grip(part.friction):
        (ratio,) = other.exactly.quotients([gripping_ratio(part.friction, other.actions.motion)])
        greater, less = other.grip(part.friction.rows[0].name)
        size, limit = other.result(greater), other.result(less) * ratio
        return Refuted(slips, part, other, greater, size, limit) if size.sample > limit.sample else None
    names = [row.name for row in other.mechanism.rows]
    friction = other.symbols.multipliers[names.index(part.friction.rows[0].name)]
    normals = [other.normal(names.index(row.name)) for row in part.element.normals_of(part.friction)]
    static = coefficients(other.actions.motion, part.friction.rows, [part.friction.static])
    (coefficient,) = other.exactly.quotients(static)
    left = LinearForm({friction: other.exactly.constant(1)}, coefficient * 0)
    value, forces = other.result(left), [other.result(normal) for normal in normals]
    limit = limits.most(coefficient, limits.pressing(forces, [1 if force.sample >= 0 else -1 for force in forces]))
    size = value if value.sample >= 0 else -value
    return Refuted(slips, part, other, left, size, limit) if size.sample > limit.sample else None


# ----------------------------------------------------------------------------------------------------------------------
# Assumptions that are rejected, as lines: what is assumed, what follows from it, and why that cannot be.


def rejected_alternatives(equations: Equations, notation: Notation, units: Mapping[Any, str]) -> Iterator[WorkedStep]:
    """Yield the steps that reject other assumptions about friction."""
    told = _Rejected(equations, notation, units)
    if equations.reason:
        return
    for number, found in enumerate(refuted_assumptions(equations), 1):
        yield WorkedStep(f"Other assumption {number}", tuple(told.lines(found)))


class _Rejected:
    """The letters in which rejected assumptions are printed: those of the state that holds."""

    def __init__(self, equations: Equations, notation: Notation, units: Mapping[Any, str]) -> None:
        self.equations, self.notation, self.units = equations, notation, units
        self.parts = {part.friction.name: part for part in parts_at_rest(equations)}

    def lines(self, found: Refuted) -> Iterator[Line]:
        """Yield what is assumed, what follows, and the contradiction."""
        if found.limit is None:
            ways = (f"{name} slides {self._way(self.parts[name], slip)}" for name, slip in found.slips.items())
            yield Sentence((f"Assume that {' and '.join(ways)}, and friction acts against that. Then",))
            unit = min((self.units.get(x, "") for x in found.left.terms), key=lambda unit: (unit != "m/s^2", unit))
            yield self._formula(found, in_sympy(found.equations.exactly, found.left), found.value, unit)
            sign = ">" if found.slips[found.part.friction.name] > 0 else "<"
            yield Sentence((f"and not {sign} 0, as was assumed: a contradiction.",))
            return
        needed, most, unit = self._needed(found)
        yield Sentence((f"Assume that {' and '.join(found.slips)} stick{'s' if len(found.slips) == 1 else ''}. Then",))
        yield self._formula(found, needed, found.value, unit)
        yield Sentence(("is needed, and no more is there than",))
        yield self._formula(found, most, found.limit, unit)
        yield Sentence(("a contradiction.",))

    def _formula(self, found: Refuted, left: Any, value: Quotient, unit: str) -> Formula:
        number = Quantity(float(value.sample), unit)
        try:
            written = found.equations.exactly.written(value)
        except NoClosedFormError:
            return Formula((left,), value=number, assumed=True)
        return Formula((left,) if written.is_number else (left, written), value=number, assumed=True)

    def _needed(self, found: Refuted) -> tuple[Any, Any, str]:
        """Return what would be needed to stick, the most that it can be, and their unit."""
        part = found.part.friction
        if not is_grip(part):
            friction, most = self._symbols(found.part)
            return sympy.Abs(friction), most, self.units.get(friction, "")
        (grip,) = (each for each in self.equations.actions.grips if each.slip == part.rows[0].name)
        (other,) = (each for each in found.equations.actions.grips if each.slip == part.rows[0].name)
        forward = other.before in found.left.terms
        greater, less = (grip.before, grip.behind) if forward else (grip.behind, grip.before)
        (ratio,) = self.equations.exactly.quotients([gripping_ratio(part, self.equations.actions.motion)])
        return greater, less * self.equations.exactly.written(ratio), self.units.get(greater, "")

    def _symbols(self, part: RestingFriction) -> tuple[Any, Any]:
        """Return the letter of a part's friction, and the most that it can be, in the letters of the state."""
        equations = self.equations
        names = [row.name for row in equations.mechanism.rows]
        row = part.friction.rows[0].name
        further = [each.symbol for each in equations.actions.further if each.element == part.friction.name]
        friction = equations.symbols.multipliers[names.index(row)] if row in names else further[0]
        static = coefficients(equations.actions.motion, part.friction.rows, [part.friction.static])
        (coefficient,) = equations.exactly.quotients(static)
        normals = [equations.normal(names.index(row.name)) for row in part.element.normals_of(part.friction)]
        forces = [in_sympy(equations.exactly, normal) for normal in normals]
        N = limits.pressing(forces, [int(part.element.unilateral)] * len(forces))
        return friction, limits.most(equations.exactly.written(coefficient), N)

    def _way(self, part: RestingFriction, slip: int) -> str:
        """Return where the first of two bodies slides to, or how a joint's coordinate changes."""
        row, equations = part.friction.rows[0], self.equations
        moved = row_motion(row, equations.actions.motion, equations.actions.bias)
        if row.surfaces is None:
            moving = [k for k, x in enumerate(moved.jacobian) if as_node(x) is not ZERO]
            if len(moving) > 1:
                return "forward" if slip > 0 else "backward"
            mechanism, (speed,) = equations.mechanism, moving
            pairs = (pair for body in mechanism.bodies for pair in body.rate_pairs)
            rates = (mechanism.coordinates[q].name for q, u in pairs if u == speed)
            return f"so that {next(rates, mechanism.speeds[speed].name)} {'grows' if slip > 0 else 'falls'}"
        if isinstance(row, TurningRow):
            return "forward" if slip > 0 else "backward"
        first, second = (skin.place.body for skin in row.surfaces)
        index, sign = (first, slip) if first >= 0 else (second, -slip)
        world = apply(equations.actions.motion.rotation(index), moved.of_body[index][0])
        vector = equations.exactly.quotients(world if sign > 0 else negate(world))
        words = equations.words.of(vector)[1]
        return "".join(word if isinstance(word, str) else self.notation.text(word) for word in words)
