"""The mechanism of an impact, solved as any instant is, in floats and in closed form; its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import sympy

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import Condition, within
from multibody_sym.algebra.quotients import Letter, NoClosedFormError
from multibody_sym.answers.instant.instant import SolvedInstant, forms_of, idle_multipliers, rows_missed
from multibody_sym.answers.records import Formula, ImpactFound, ImpactStep, Line, Sentence, Worked, WorkedStep
from multibody_sym.answers.worked.bodies import IMPULSES, BodyLines, forces_spelt, mass_lines
from multibody_sym.answers.worked.equations import Equations, in_sympy
from multibody_sym.contact_laws.impact_problem import ImpactLaw, ImpactResult
from multibody_sym.derivation.notation import Label, Notation, latex_name, upright
from multibody_sym.derivation.routes import FORMALISMS, formalism_name
from multibody_sym.derivation.symbolic_start import ClosedForms, SymbolicState, closed_forms, linear_equations, unknowns
from multibody_sym.dynamics.contact.impact_problem import (
    Deciding,
    Following,
    friction_parts,
    plane_contact,
    plane_course,
    plane_element,
)
from multibody_sym.dynamics.contact.impact_programs import StruckMode
from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.declared_impact import PosedImpact
from multibody_sym.dynamics.start.number_checks import blame_numbers
from multibody_sym.errors import ExpressionError, NoSolutionError, Where
from multibody_sym.mechanics.impacts import after_impact, state_in_impact
from multibody_sym.mechanics.law_elements import FrictionPart, JumpRow, LawElement, jump_leaf
from multibody_sym.mechanics.mechanism import Mechanism, Speed
from multibody_sym.mechanics.motion import Motion, State, motion_of
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.row_kinematics import RowMotion, friction_factors, row_motions
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, Node, as_node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.scalars.vectors import S
from multibody_sym.text.printer import COMPONENTS
from multibody_sym.text.values import Quantity, Value

_CONTRADICTION: Final = 1e-8
"""The part of the largest jump by which a row may be missed, as for accelerations."""


@dataclass(frozen=True)
class ImpactInstant(StateQuantities):
    """The mechanism of an impact: `motion` at rest, udot the jumps, multipliers the impulses; and what was `before`."""

    before: Motion

    @property
    def after(self) -> list[S]:
        return [u + du for u, du in zip(self.before.state.u, self.udot, strict=True)]

    @cached_property
    def later(self) -> Motion:
        """The motion after the impact, with all rows that may have acted."""
        return motion_of(self.before.mechanism, after_impact(self.before.state, self.after))

    @cached_property
    def rows_before(self) -> Mapping[str, RowMotion]:
        return _by_name(self.before)

    @cached_property
    def rows_after(self) -> Mapping[str, RowMotion]:
        return _by_name(self.later)


def _by_name(motion: Motion) -> dict[str, RowMotion]:
    return dict(zip((row.name for row in motion.mechanism.rows), row_motions(motion), strict=True))


@dataclass(frozen=True, eq=False)
class Befores:
    """The motion before an impact over floats, over Nodes in the names of the model (`nodes`) and over slots."""

    numbers: Motion
    nodes: Motion
    slots: Motion
    symbolic: SymbolicState


Jumps = Callable[[Motion], Mapping[int, Node] | None]
"""From the motion before, over Nodes, to the jumps of rows by number; None where no formula is known."""


def solve_at_rest(
    posed: PosedImpact,
    given: Befores,
    mechanism: Mechanism,
    jumps: Mapping[int, float],
    formula: Jumps,
    formalism: str | None,
    reasons: dict[str, None],
) -> SolvedInstant:
    """Return the mechanism of an impact solved, for jumps of its rows in numbers and by a formula.

    Raises InputError, and NoSolutionError where there is no inertia or rows contradict each other.
    """
    state = state_in_impact(given.numbers.state, jumps)
    dynamics = FORMALISMS[formalism_name(formalism, mechanism)](mechanism, state)
    found = forward_dynamics(dynamics, minimum_norm=mechanism.minimum_norm)
    if not (np.isfinite(found.udot).all() and np.isfinite(found.report).all()):
        blame_numbers(posed.system)
        raise NoSolutionError(
            "the jumps are no finite numbers: values of the model are too large or too small", number="N105"
        )
    _verify_jumps(mechanism, dynamics, found.udot)
    motion, before = motion_of(mechanism, state), given.numbers
    numbers = ImpactInstant(motion, found.udot.tolist(), found.multipliers.tolist(), before)
    others = tuple(
        ImpactInstant(motion, numbers.udot, (found.multipliers + change).tolist(), before)
        for change in idle_multipliers(dynamics, found)
    )
    told = formula(given.nodes)
    known = {k: told[k] for k in jumps} if told is not None else {k: jump_leaf(k) for k in jumps}
    symbolic = SymbolicState(state_in_impact(given.nodes.state, known), given.symbolic.letters)
    leaves = {k: jump_leaf(k) for k in jumps}
    nodes = ImpactInstant(motion_of(mechanism, symbolic.state), *unknowns(mechanism), given.nodes)
    at_slots = motion_of(mechanism, state_in_impact(given.slots.state, leaves))
    slots = ImpactInstant(at_slots, *unknowns(mechanism), given.slots)
    forms = None if told is None else forms_of(mechanism, symbolic, posed.sides, reasons)
    return SolvedInstant(posed.system, mechanism, posed.begin, numbers, others, symbolic, nodes, slots, forms, reasons)


def _verify_jumps(mechanism: Mechanism, dynamics: TreeDynamics, jumps: Floats) -> None:
    """Raise NoSolutionError where rows that depend on each other are to jump by different amounts."""
    missed, wanted = rows_missed(dynamics, jumps)
    if missed.max(initial=0.0) > _CONTRADICTION * max(np.abs(wanted).max(initial=0.0), np.abs(jumps).max(initial=0.0)):
        name = mechanism.rows[int(np.argmax(missed))].name
        raise NoSolutionError(
            f"the impulses contradict each other: no jump of speeds fulfils {name} with the others; of motions that "
            "jump and of what begins, leave out what asks for the same speed twice",
            where=Where(path=("impact",)),
            number="N108",
        )


def by_name(mechanism: Mechanism) -> dict[str, int]:
    """Return the numbers of a mechanism's rows by their names."""
    return {row.name: k for k, row in enumerate(mechanism.rows)}


def friction_along(told: ImpactInstant, row: str) -> S:
    """Return the impulse along a row in which something slides all the while, 0 where nothing rubs there."""
    total: S = 0
    places = by_name(told.motion.mechanism)
    for k, jumping in enumerate(told.motion.mechanism.rows):
        acting = jumping.of if isinstance(jumping, JumpRow) else jumping
        for friction in acting.sliding:
            along = [told.rows_before[x.name] for x in friction.rows]
            names = [x.name for x in friction.rows]
            factors = dict(zip(names, friction_factors(friction, along, told.motion), strict=True))
            if row in factors and friction.beside:
                pressing = (k, *(places[other] for other in friction.beside))
                return factors[row] * length([told.multipliers[j] for j in pressing])
            if row in factors:
                total = total + factors[row] * told.multipliers[k]
    return total


def length(components: Sequence[S]) -> S:
    """Return the length of a vector, without a root where it has one component."""
    return limits.length([x for x in components if as_node(x) is not ZERO] or [0])


def pressing_impulse(told: ImpactInstant, element: LawElement, part: FrictionPart, sides: Mapping[str, int]) -> S:
    """Return the impulse that presses where a part rubs; `sides` are those of reactions in joints."""
    names = [row.name for row in element.normals_of(part)]
    return limits.pressing(row_impulses(told, names), [sides.get(name, 1) for name in names], norm=part.norm)


def row_impulses(told: ImpactInstant, rows: Sequence[str]) -> list[S]:
    """Return the impulses along rows by name, also along those that slide with another's."""
    places = by_name(told.motion.mechanism)
    return [told.multipliers[places[row]] if row in places else friction_along(told, row) for row in rows]


# ----------------------------------------------------------------------------------------------------------------------
# Under which conditions contacts strike in the order in which they do, and none strikes or closes besides.


@dataclass(frozen=True)
class Needed:
    """That a term is positive (`strict`) or not negative, or with a `limit` not larger than that; else `broken`."""

    term: Node
    broken: str
    strict: bool = False
    limit: Node | None = None

    def over(self, forms: ClosedForms) -> list[Condition]:
        """Return it as conditions over quotients; raises NoClosedFormError."""
        if self.limit is not None:
            term, limit = forms.of([self.term, self.limit])
            return within(term, limit, self.broken)
        return [Condition(forms.of([self.term])[0], self.strict, self.broken)]


@dataclass(frozen=True)
class Blows:
    """One of several impacts: the elements that are `struck`, by name their `impulses`, and all speeds of opening.

    `posed`: the mechanism of this impact, and its state in it, where formulas are led through several.
    """

    struck: tuple[str, ...]
    impulses: Mapping[str, Node]
    before: Mapping[str, Node]
    after: Mapping[str, Node]
    posed: tuple[Mechanism, State] | None = None


@dataclass(frozen=True)
class Order:
    """The elements that touch, by name their restitution and the number of their cluster, and whose turn it is.

    `sample` gives the value of a speed at the start.
    """

    elements: Sequence[LawElement]
    restitution: Mapping[str, Node]
    cluster: Mapping[str, int]
    one_by_one: bool
    sample: Callable[[Node], float]

    def needed(self, blows: Blows) -> Iterator[Needed]:
        """Yield under which conditions these are struck, and so, and no others."""
        if not blows.struck:
            return
        if len(blows.struck) > 1:
            yield from (Needed(blows.impulses[name], f"{name} is not struck") for name in blows.struck)
        lead = min(blows.struck, key=lambda name: self.sample(blows.before[name]))
        if len(blows.struck) == 1 or self.one_by_one:
            yield Needed(-blows.before[lead], f"{lead} separates and nothing strikes", strict=True)
        near = [x.name for x in self.elements if self.cluster[x.name] == self.cluster[lead]]
        for name in near:
            if name not in blows.struck:
                yield from self._beside(blows, name, lead)
            elif name != lead and self.one_by_one:
                yield from self._together(blows, name, lead)
            elif len(blows.struck) > 1 and self.restitution[name] is not ZERO:
                yield Needed(-blows.before[name], f"{name} separates before")

    def finally_open(self, after: Mapping[str, Node], struck: Sequence[str]) -> Iterator[Needed]:
        """Yield that nothing closes in the end."""
        for name, speed in after.items():
            yield Needed(speed, f"{name} closes again" if name in struck else f"{name} is struck too")

    def _together(self, blows: Blows, name: str, lead: str) -> Iterator[Needed]:
        """Yield that what is struck with the fastest closes as fast, or is held as it does not bounce."""
        held = self.restitution[name] is ZERO and self.sample(blows.before[name]) == 0.0
        apart = blows.before[name] if held else blows.before[name] - blows.before[lead]
        for each in (apart, -apart):
            yield Needed(each, f"{name} and {lead} do not strike at once")

    def _beside(self, blows: Blows, name: str, lead: str) -> Iterator[Needed]:
        before, after, e = blows.before[name], blows.after[name], self.restitution[name]
        if self.one_by_one:
            yield Needed(before - blows.before[lead], f"{name} strikes before {lead}", strict=True)
            if e is ZERO and not self.sample(before):
                yield Needed(after, f"{name} is struck too")
        elif self.sample(before) > 0.0:
            yield Needed(before, f"{name} does not separate before", strict=True)
        else:
            yield Needed(after + e * before, f"{name} is struck too")
            yield Needed(-before, f"{name} separates before")


# ----------------------------------------------------------------------------------------------------------------------
# Formulas for the jumps of rows: in one impact, or through several that follow each other.


_MOST: Final = 12
"""Through how many impacts formulas are led, which grow with each."""


def impact_steps(elements: Sequence[LawElement], names: Sequence[str], struck: ImpactResult) -> list[ImpactStep]:
    owners = {names.index(element.normals[0].name): element.name for element in elements}
    found = []
    for number in range(1, struck.impacts + 1):
        phases = [phase for phase in struck.phases if phase.number == number]
        rows = sorted({row for phase in phases for row in phase.rows})
        total = {owners[row]: float(sum(phase.impulses[row] for phase in phases)) for row in rows}
        found.append(ImpactStep(tuple(total), total))
    return found


@dataclass(frozen=True, eq=False)
class ImpactFormulas:
    """The way of an impact over Nodes: its mode and impacts, and the letters of the start.

    On the way it notes `conditions`: what is positive where slip changes as it does, and what happens else; of several
    impacts the `steps`; and where something pushes first, the speeds of rows with which they are `striking`.
    """

    mode: StruckMode
    struck: ImpactResult
    letters: Mapping[Node, Letter]
    reasons: dict[str, None]
    law: ImpactLaw = "newton"
    conditions: list[tuple[Node, str]] = field(default_factory=list)
    steps: list[Blows] = field(default_factory=list)
    striking: dict[str, Node] = field(default_factory=dict)

    def jumps(self, before: Motion) -> Mapping[int, Node] | None:
        """Return the jumps of the rows of the whole impact by number; None, with the reason noted, without formula."""
        given = self.mode.rows.given
        element = plane_element(self.mode.blow)
        if given and (element is None or element.normals[0].name not in given):
            self.reasons[f"{', '.join(sorted(given))} slides in space, or now this way and now that"] = None
            return None
        try:
            pushed = self._pushed(before) if self.mode.pushes else before
            striking = {row.name for element in self.mode.blow.elements for row in element.rows}
            speeds = _speeds(pushed) if self.mode.pushes else {}
            self.striking.update({name: speed for name, speed in speeds.items() if name in striking})
            if given and element is not None:
                return self._along_plane(element, before, pushed)
            if self.struck.impacts <= 1:
                return {k: as_node(x) for k, x in self.mode.wanted(before, pushed).items()}
            return self._through(before, pushed)
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
        except ExpressionError as reason:
            self.reasons[reason.message] = None
        return None

    def _pushed(self, before: Motion) -> Motion:
        """Return the motion that given impulses, and what begins or jumps, leave: then contacts strike."""
        joined = {k: as_node(x) for k, x in self.mode.joined(before).items()}
        return self._after(self.mode.alone, before, joined)

    def _after(self, mechanism: Mechanism, before: Motion, jumps: Mapping[int, Node]) -> Motion:
        return self._solved(mechanism, before, jumps)[0]

    def _solved(self, mechanism: Mechanism, before: Motion, jumps: Mapping[int, Node]) -> tuple[Motion, list[Node]]:
        forms = closed_forms(mechanism, SymbolicState(state_in_impact(before.state, jumps), self.letters))
        return self.mode.pushed(before, [book_form(x) for x in forms.udot]), [book_form(x) for x in forms.multipliers]

    def _note(
        self,
        struck: tuple[str, ...],
        impulses: Sequence[Node],
        before: Mapping[str, Node],
        after: Mapping[str, Node],
        posed: tuple[Mechanism, State],
    ) -> None:
        normals = {x.name: x.normals[0].name for x in self.mode.blow.elements}
        speeds = [{name: each[row] for name, row in normals.items()} for each in (before, after)]
        self.steps.append(Blows(struck, dict(zip(struck, impulses, strict=True)), speeds[0], speeds[1], posed))

    def _along_plane(self, element: LawElement, before: Motion, pushed: Motion) -> dict[int, Node]:
        """Return the jumps of the mechanism's own rows, and the impulses of a contact whose slip changes on the way."""
        blow, decided = self.mode.blow, Deciding()

        def in_floats(mechanism: Mechanism, state: State) -> list[float]:
            return [float(x) for x in forward_dynamics(tree_dynamics_of(mechanism, state)).udot]

        def in_symbols(mechanism: Mechanism, state: State) -> list[Node]:
            return [book_form(x) for x in closed_forms(mechanism, SymbolicState(state, self.letters)).udot]

        numbers = blow.motion
        if self.mode.pushes:
            own = {k: float(x) for k, x in self.mode.joined(numbers).items()}
            numbers = self.mode.pushed(numbers, in_floats(self.mode.alone, state_in_impact(numbers.state, own)))
        plane_course(plane_contact(blow, element, self.law, (blow.motion, numbers), in_floats), decided)
        follows = Following(decided.taken)
        contact = plane_contact(blow, element, self.law, (before, pushed), in_symbols, in_numbers=False)
        impulses = plane_course(contact, follows)
        self.conditions.extend((as_node(x), broken) for x, broken in follows.conditions)
        found = {k: as_node(x) for k, x in self.mode.own(before).items()}
        return found | {k: as_node(x) for k, x in enumerate(impulses, len(blow.mechanism.rows))}

    def _through(self, before: Motion, first: Motion) -> dict[int, Node]:
        """Return the jumps of rows from before to the end of impacts one after the other."""
        blow, now = self.mode.blow, first
        by_name = {element.name: element for element in blow.elements}
        steps = impact_steps(blow.elements, blow.names, self.struck)
        if len(steps) > _MOST:
            raise NoClosedFormError(f"{len(steps)} impacts follow each other")
        own = len(blow.mechanism.rows)
        for step in steps:
            striking = [by_name[name] for name in step.struck]
            if self.mode.rows.joints or any(map(friction_parts, striking)):
                raise NoClosedFormError("several impacts with friction follow each other")
            speeds = _speeds(now)
            rows = [element.normals[0] for element in striking]
            bounce = [now.state.values([element.restitution])[0] for element in striking]
            wanted = {k: as_node(0) for k in range(own)}
            for k, (row, e) in enumerate(zip(rows, bounce, strict=True), own):
                wanted[k] = as_node(-(1 + e) * speeds[row.name])
            resting = blow.resting(rows)
            later, impulses = self._solved(resting, now, wanted)
            posed = resting, state_in_impact(now.state, wanted)
            self._note(step.struck, impulses[own:], speeds, _speeds(later), posed)
            now = later
        start, end = _speeds(before), _speeds(now)
        found = {k: as_node(x) for k, x in self.mode.own(before).items()}
        return found | {k: as_node(end[name] - start[name]) for k, name in enumerate(self.mode.acting) if k >= own}


def _speeds(motion: Motion) -> dict[str, Node]:
    names = (row.name for row in motion.mechanism.rows)
    return {name: as_node(row.phidot) for name, row in zip(names, row_motions(motion), strict=True)}


# ----------------------------------------------------------------------------------------------------------------------
# An impact step by step: impulse and momentum along each speed, restitution, elimination, result, joints.


_ROUNDING: Final = 1e-12
_MOMENTUM: Final = "Impulse and momentum of what each speed moves, cut free: impulses in joints across it do not enter"
_RELATIONS: Final = "Restitution, and what holds: jumps along each row"


@dataclass(frozen=True, eq=False)
class _Balance:
    """Impulse and momentum of the bodies cut free in one impact of a `mechanism`, at its state in impact."""

    solved: SolvedInstant
    mechanism: Mechanism
    state: State
    is_alone: bool

    @cached_property
    def equations(self) -> Equations:
        """The equations, in which accelerations are jumps and forces impulses. Raises NoClosedFormError."""
        given = replace(self.solved.symbolic, state=self.state)
        return Equations(self.mechanism, given, plane=in_plane(self.solved.system))

    @cached_property
    def told(self) -> BodyLines:
        return BodyLines(self.equations, forces_spelt(self.equations, letters_of(self.solved.system)), IMPULSES)

    @cached_property
    def _letters(self) -> dict[Any, tuple[Any, Label]]:
        """The symbols of jumps and impulses, D(u) and p, in the place of those of accelerations and forces."""
        mechanism, symbols, found = self.mechanism, self.equations.symbols, dict[Any, Label]()
        rows = [row.name.removesuffix(".normal") for row in mechanism.rows]
        for s, name in zip(symbols.multipliers, rows, strict=True):
            found[s] = Label("p", "p") if len(rows) == 1 and self.is_alone else _impulse_label(name)
        for k, body in enumerate(mechanism.bodies):
            own = zip(self.equations.actions.reaction_symbols(k), COMPONENTS, strict=True)
            found.update((s, _impulse_label(f"{body.joint_name}.{component}")) for s, component in own)
        for each in self.equations.actions.further:
            found[each.symbol] = _impulse_label(each.element)
        letters = {s: (sympy.Symbol(f"impulse {label.text}"), label) for s, label in found.items()}
        jumps = zip(jump_symbols(mechanism), map(_jump_label, mechanism.speeds), strict=True)
        return {**letters, **dict(zip(symbols.accelerations, jumps, strict=True))}

    @property
    def notation(self) -> Notation:
        plain = self.told.notation
        spelling = {**plain.spelling, **dict(self._letters.values())}
        places = {own: plain.places[s] for s, (own, _) in self._letters.items() if s in plain.places}
        return replace(plain, spelling=spelling, places={**plain.places, **places})

    def steps(self, number: str = "") -> Iterator[WorkedStep]:
        """Yield the bodies cut free, restitution, and the elimination. Raises NoClosedFormError."""
        equations, told = self.equations, self.told
        if equations.reason:
            raise NoClosedFormError(equations.reason)
        eliminated = [line for step in equations.elimination.steps for line in told.found(step, in_sympy)]
        jumps = [s for s in equations.symbols.accelerations if s in equations.elimination.results]
        known = {line.sides for line in eliminated}
        results = ((s, in_sympy(equations.exactly, equations.elimination.results[s])) for s in jumps)
        eliminated += [Formula(sides, before=("so",)) for sides in results if sides not in known]
        yield WorkedStep(f"Masses{number}", tuple(mass_lines(equations)))
        for body in equations.cut.bodies:
            yield self._step(f"{body.name}, cut free{number}: impulse and momentum", told.body(body))
        signed = ((e, -1 if e.right.rest.sample < 0 else 1) for e in equations.relations)
        relations = (e if sign > 0 else e.changed(lambda form: form.times(-1)) for e, sign in signed)
        ruled = [*relations, *equations.laws, *equations.cut.free]
        yield self._step(f"{_RELATIONS}{number}", map(told.formula, ruled))
        yield self._step(f"Elimination{number}", eliminated)

    def _step(self, title: str, lines: Iterable[Line]) -> WorkedStep:
        letters = {s: own for s, (own, _) in self._letters.items()}

        def spelt(x: Any) -> Any:
            return x.xreplace(letters) if isinstance(x, sympy.Basic) else x

        told = (
            replace(line, sides=tuple(map(spelt, line.sides)))
            if isinstance(line, Formula)
            else Sentence(tuple(map(spelt, line.words)))
            for line in lines
        )
        return WorkedStep(title, tuple(told))


def jump_symbols(mechanism: Mechanism) -> list[Any]:
    """Return the symbols of the jumps of speeds."""
    return [sympy.Symbol(f"D_{speed.name}") for speed in mechanism.speeds]


def _jump_label(speed: Speed) -> Label:
    return Label(f"D({speed.name})", rf"\Delta {latex_name(speed.name)}")


def _impulse_label(name: str) -> Label:
    return Label(f"p({name})", f"p_{{{upright(name.replace('_', ' '))}}}")


def worked_impact(solved: SolvedInstant, found: ImpactFound, blows: Sequence[Blows]) -> Worked:
    """Return the steps, of impacts in turn those of each; without formulas what is known in numbers."""
    work = _Work(solved, found, [each.posed for each in blows if each.posed is not None])
    try:
        steps = work.steps()
    except (NoClosedFormError, ExpressionError) as reason:
        why = Sentence((f"the equations are not written out: {reason}",))
        steps = (work.given(), WorkedStep("Equations", (why,)), *work.results())
    return Worked(solved.mechanism.name, steps, work.notation())


@dataclass(frozen=True, eq=False)
class _Work:
    """`posed`: the mechanism and state of each of several impacts."""

    solved: SolvedInstant
    found: ImpactFound
    posed: Sequence[tuple[Mechanism, State]]
    told: list[Notation] = field(default_factory=list)

    @cached_property
    def jumps(self) -> list[Any]:
        return jump_symbols(self.solved.mechanism)

    @cached_property
    def impulses(self) -> list[Any]:
        return [sympy.Symbol(f"p_{k}") for k, _ in enumerate(self.solved.mechanism.rows)]

    @cached_property
    def _called(self) -> dict[Any, Label]:
        found = dict(zip(self.jumps, map(_jump_label, self.solved.mechanism.speeds), strict=True))
        alone = len(self.impulses) == 1
        for s, row in zip(self.impulses, self.solved.mechanism.rows, strict=True):
            found[s] = Label("p", "p") if alone else _impulse_label(row.name.removesuffix(".normal"))
        return found

    def notation(self) -> Notation:
        named = [*self.solved.symbolic.letters, *(symbol(speed.name) for speed in self.solved.mechanism.speeds)]
        book = letters_of(self.solved.system)
        names = [n.data for n in named if isinstance(n.data, str)]
        plain = {sympy.Symbol(name): Label(name, latex_name(book.get(name, name))) for name in names}
        spelling = {**plain, **self._called}
        places = {s: (0, k) for k, s in enumerate(spelling)}
        for each in self.told:
            spelling, places = {**each.spelling, **spelling}, {**each.places, **places}
        return Notation(spelling, places)

    def shown(self, nodes: Sequence[Node]) -> list[Any]:
        forms = self.solved.forms
        if forms is None:
            raise NoClosedFormError("the numbers have no formula")
        return [self._sympy(book_form(x)) for x in forms.of(nodes)]

    def _sympy(self, node: Node) -> Any:
        names = {leaf: sympy.Symbol(leaf.data) for leaf in leaves([node], "symbol")}
        return to_sympy(node, names)

    # --- steps ----------------------------------------------------------------------------------------------------

    def steps(self) -> tuple[WorkedStep, ...]:
        try:
            every = [self.given(), *(step for part in self._balances for step in part), *self.results()]
            return tuple(step for step in every if step.lines)
        except NoClosedFormError:
            return (self.given(), *self._by_speeds(), *self.results())

    @cached_property
    def _balances(self) -> list[list[WorkedStep]]:
        """The equations of each impact, one after the other. Raises NoClosedFormError."""
        every = self.posed or [(self.solved.mechanism, self.solved.nodes.motion.state)]
        one = len(every) == 1
        balances = [_Balance(self.solved, *posed, one) for posed in every]
        found = [[*each.steps("" if one else f", impact {k}")] for k, each in enumerate(balances, 1)]
        self.told.extend(each.notation for each in balances)
        return found

    def _by_speeds(self) -> Iterator[WorkedStep]:
        """Yield what each speed moves cut free, where the equations of all bodies are not written out."""
        matrix, right = linear_equations(self.solved.nodes.motion)
        count = len(self.jumps)
        momentum = [self._equation(k, matrix[k], right[k], ()) for k in range(count)]
        names = [row.name for row in self.solved.mechanism.rows]
        yield WorkedStep(_MOMENTUM, tuple(momentum))
        if len(matrix) > count:
            ruled = (self._equation(k, matrix[k], right[k], (names[k - count],)) for k in range(count, len(matrix)))
            yield WorkedStep(_RELATIONS, tuple(ruled))

    def _equation(self, tag: int, row: Sequence[Node], right: Node, before: tuple[str, ...]) -> Formula:
        count = len(self.jumps)
        *factors, given = self.shown([as_node(x) for x in (*row, right)])
        left = sum((a * s for a, s in zip(factors[:count], self.jumps, strict=True)), sympy.S.Zero)
        pushed = sum((-a * s for a, s in zip(factors[count:], self.impulses, strict=True)), sympy.S.Zero)
        return Formula((left, given + pushed), tag=tag + 1, before=before)

    def given(self) -> WorkedStep:
        instant = self.solved.nodes
        assert isinstance(instant, ImpactInstant)
        how = f"{self.found.law.capitalize()}'s law, {self.found.sequence.replace('_', ' ')}"
        lines: list[Line] = [Sentence((how,))]
        pairs = zip(self.solved.mechanism.speeds, instant.before.state.u, self.solved.begin.u, strict=True)
        for speed, node, number in pairs:
            if number:
                sides = sympy.Symbol(speed.name), self._sympy(as_node(node))
                alone = sides[0] == sides[1] or sides[1].is_number
                lines.append(Formula(sides[: 1 if alone else 2], value=Quantity(number, speed.unit)))
        return WorkedStep("Given", tuple(lines))

    def results(self) -> tuple[WorkedStep, ...]:
        names = {speed.name: s for speed, s in zip(self.solved.mechanism.speeds, self.jumps, strict=True)}
        impulses = [
            self._told(*self._named(name, part), value)
            for name, parts in self.found.impulses.items()
            for part, value in parts.items()
        ]
        jumps = [self._told((), (names[name],), value) for name, value in self.found.jumps.items()]
        after = [self._told(("after",), (sympy.Symbol(name),), value) for name, value in self.found.after.items()]
        lost = [self._told(("energy lost",), (), self.found.energy_lost)]
        steps = [("Elimination: impulses", impulses), ("Result", [*jumps, *after, *lost])]
        steps.append(("Impulses in joints", list(self._joints())))
        if self.told:  # the elimination has the jumps
            steps = [("Result", [*impulses, *after, *lost]), steps[-1]]
        found = [WorkedStep(title, tuple(lines)) for title, lines in steps if lines]
        limits = self.found.limits
        conditions = [Sentence((f"{x}, else {limits[x]}" if limits.get(x) else x,)) for x in self.found.conditions]
        return (*found, *([WorkedStep("Conditions", tuple(conditions))] if conditions else []))

    def _joints(self) -> Iterator[Line]:
        every = (*self.found.joint_impulses.values(), *self.found.impulses.values())
        largest = max((abs(x.value or 0.0) for parts in every for x in parts.values()), default=0.0)
        for name, parts in self.found.joint_impulses.items():
            for component, value in parts.items():
                if abs(value.value or 0.0) > _ROUNDING * largest:
                    yield self._told((f"{name} {component}",), (), value)

    def _named(self, element: str, part: str) -> tuple[tuple[str, ...], tuple[Any, ...]]:
        """Return the words before an impulse, and its symbol where a row has it."""
        rows = [row.name for row in self.solved.mechanism.rows]
        for name in (f"{element}.{part}", element):
            if name in rows:
                return (), (self.impulses[rows.index(name)],)
        return (f"{element} {part}",), ()

    def _told(self, before: tuple[str, ...], sides: tuple[Any, ...], value: Value) -> Line:
        """Return a result with its formula and number; what is not unique has neither."""
        if value.value is None:
            return Sentence((*before, " is not unique"))
        known = () if value.expression is None else (self._sympy(value.expression),)
        known = () if sides and known and known[0].is_number else known
        told = Quantity(value.value, value.unit)
        if not (sides or known):
            return Sentence((*before, " = ", told))
        return Formula((*sides, *known), before=before, value=told)
