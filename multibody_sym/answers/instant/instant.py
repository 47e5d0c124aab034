"""The start of a system, solved in floats, and in closed form as far as there is one; its forces by element."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial, reduce
from itertools import combinations, product
from operator import add
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.quotient_functions import sign, with_whole_angles
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.instant.letters import quotient_of
from multibody_sym.answers.instant.loops import LetteredStart
from multibody_sym.derivation.routes import FORMALISMS, formalism_name
from multibody_sym.derivation.symbolic_start import (
    ActingForces,
    ClosedForms,
    SymbolicState,
    begins_along,
    closed_forms,
    declared_state,
    linear_equations,
    unknowns,
    with_directions,
)
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import Accelerations, forward_dynamics
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities, quantities
from multibody_sym.dynamics.programs.reactions import held_pulleys
from multibody_sym.dynamics.redundancy import idle_combinations
from multibody_sym.dynamics.start.initial_geometry import SignedLength, fix_directions
from multibody_sym.dynamics.start.number_checks import blame_numbers
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import StartState, examined_state
from multibody_sym.errors import ExpressionError, NoSolutionError, Where
from multibody_sym.mechanics.declared_rows import with_named_outputs
from multibody_sym.mechanics.law_elements import PRESSING, LawElement, Mode, component_names
from multibody_sym.mechanics.mechanism import NORMAL, Coordinate, Mechanism, Speed
from multibody_sym.mechanics.motion import Motion, motion_of, slot_state, state_of
from multibody_sym.mechanics.row_kinematics import leave_no_freedom
from multibody_sym.mechanics.row_records import ExpressionRow, RopeRow, Row
from multibody_sym.mechanics.units import REACTION_UNITS, MechanismUnits
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node, symbol
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.sign_changes import Bounded, bound_rounding
from multibody_sym.stages import stage
from multibody_sym.text.parser import force_name, parse
from multibody_sym.text.printer import AT, text
from multibody_sym.text.values import Value

T = TypeVar("T")

AGREEMENT: Final = 1e-9
"""How near a closed form must come to the number found in floats, relative to it."""
_CONTRADICTION: Final = 1e-8
_NOT_UNIQUE: Final = 1e-8
_ASSEMBLED: Final = 16
"""To how many units in the last place, of 1 or more, start values are known that were found by closing constraints."""
_MOST_BOUNDED: Final = 40
_LONGEST_NUMBER: Final = 20
_FREE: Final = "; forces that are not unique change how it slides"
_ZERO: Final = 1e-14
"""The part of the largest number up to which one is rounding whose closed form is zero."""


@dataclass(frozen=True)
class Decided:
    """How the mode at the start was found.

    `touching`: the elements that might act; `moving`: the friction parts that slide already; `at_limit`: the rows for
    which two modes fit; `others`: the modes that fulfil all laws beside the one that is solved, with their udot;
    `verdict`: one or several; `searched`: what was looked at, in words. `closing`: the elements that strike at the
    start, of which `strikes` tells that it is left out. `motion`: accelerations (nu,) and multipliers by row, where
    the mode leaves them open.
    """

    touching: frozenset[str] = frozenset()
    moving: frozenset[str] = frozenset()
    at_limit: tuple[str, ...] = ()
    others: tuple[tuple[Mode, tuple[Value, ...]], ...] = ()
    verdict: str = "one"
    searched: str = ""
    closing: frozenset[str] = frozenset()
    strikes: str = ""
    motion: tuple[Floats, Mapping[str, float]] | None = None


@dataclass(frozen=True, eq=False)
class SolvedInstant:
    """A system at its start: `numbers` over floats, `nodes` over Nodes, and `forms`, the closed forms of those Nodes.

    `slots` is the same over slots, nothing folded, as floats are calculated. `others` are the same instant in floats
    with other multipliers that satisfy the equations as well, where constraints depend on each other. `reasons`
    collects why closed forms were left out. `decided` is how the mode was found that it is in. `lettered` has formulas
    with named letters, where loops leave no closed form.
    """

    system: System
    mechanism: Mechanism
    begin: Start
    numbers: StateQuantities
    others: tuple[StateQuantities, ...]
    symbolic: SymbolicState
    nodes: StateQuantities
    slots: StateQuantities
    forms: ClosedForms | None
    reasons: dict[str, None] = field(default_factory=dict)
    decided: Decided = field(default_factory=Decided)
    lettered: LetteredStart = field(default_factory=LetteredStart)

    def values(
        self, ask: Callable[[StateQuantities], Mapping[str, Any]], units: Mapping[str, str], least: float = 0.0
    ) -> dict[str, Value]:
        """Return what `ask` finds at the instant, as numbers with closed forms where they agree.

        What is not unique has no value, unless least norm is asked for and possible. Forces up to `least` (N) are none.
        """
        numbers, nodes, slots = ask(self.numbers), self._nodes(ask), ask(self.slots)
        others = [ask(other) for other in self.others]
        compared = (*numbers.values(), *self.numbers.udot, *self.numbers.multipliers)
        scale = max((abs(float(x)) for x in compared), default=0.0)
        found = {}
        for name, number in numbers.items():
            unique = all(abs(other[name] - number) <= _NOT_UNIQUE * scale for other in others)
            rounding = max(self._rounding(as_node(slots[name])), least if units.get(name) == "N" else 0.0)
            near = 0.0 if abs(number) <= rounding else float(number)
            closed = unique and name in nodes
            told = unique or (self.mechanism.minimum_norm and not self.beyond)
            known = self.value(as_node(nodes[name]), near, rounding) if closed else Value(near if told else None)
            error = 0.0 if known.value is None or known.expression is not None else rounding
            found[name] = replace(known, unique=unique, unit=units.get(name, ""), error=error)
        return found

    @cached_property
    def beyond(self) -> str:
        """Why forces of least norm that are asked for cannot be: what they would do against the laws. Else empty."""
        return ActingForces.at(self.numbers).beyond if self.mechanism.minimum_norm and self.others else ""

    def _nodes(self, ask: Callable[[StateQuantities], Mapping[str, Any]]) -> Mapping[str, Any]:
        """Return what `ask` finds over Nodes; nothing where an expression has no value at the exact start."""
        try:
            return ask(self.nodes)
        except ExpressionError as reason:
            self.reasons[reason.message] = None
            return {}

    def value(self, node: Node, number: float, rounding: float = 0.0) -> Value:
        """Return a number with the closed form of a Node, where they agree to within the number's rounding."""
        closed = self._of_state(node) if self.forms is None else self.closed(lambda forms: forms.of([node])[0])
        if closed is not None and closed.is_zero:
            rounding = max(rounding, _ZERO * self._largest)
        if closed is None or abs(float(closed.sample) - number) > AGREEMENT * abs(number) + rounding:
            return Value(number)
        return self.value_of(closed, rounding) or Value(number)

    def _of_state(self, node: Node) -> Quotient | None:
        """Return the closed form of what the state alone decides, without accelerations and multipliers."""
        if leaves([node], "slot"):
            return None
        try:
            return quotient_of(node, self.symbolic.letters)
        except NoClosedFormError:
            return None

    @cached_property
    def _largest(self) -> float:
        return max((abs(float(x)) for x in (*self.numbers.udot, *self.numbers.multipliers)), default=0.0)

    def _rounding(self, node: Node) -> float:
        """Return a bound of the rounding in a number that a Node in slots stands for, 0 where none is known."""
        bound = bound_rounding([node], self._leaves)[0].bound
        return bound if np.isfinite(bound) else 0.0

    @cached_property
    def rests(self) -> bool:
        """Whether nothing moves, now and later: no speeds, no accelerations, and nothing that depends on time."""
        names = [speed.name for speed in self.mechanism.speeds]
        found = self.values(lambda instant: dict(zip(names, instant.udot, strict=True)), {})
        matrix, right = linear_equations(self.slots.motion)
        timed = leaves([as_node(x) for x in (*(x for row in matrix for x in row), *right)], "slot")
        moved = any(leaf.data[0] in ("t", "inputs") for leaf in timed) or bool(self.mechanism.drives)
        return not (moved or any(self.begin.u) or any(value.value for value in found.values()))

    @cached_property
    def is_structure(self) -> bool:
        """Whether constraints leave no freedom, and nothing is driven: a structure, which rests under any load."""
        mechanism = self.mechanism
        if mechanism.drives or mechanism.one_way or any(self.begin.u) or not mechanism.bodies:
            return False
        return self._is_held

    @cached_property
    def needs_no_forces(self) -> bool:
        """Whether drives and constraints decide the motion, and questions are about nothing else.

        Where something has mass or is loaded, one at least is about points by its kind: expressions are asked beside
        forces too.
        """
        ask, mechanism = self.system.ask.values(), self.mechanism
        if not ask or mechanism.one_way or not all(x.is_kinematic for x in ask):
            return False
        return (any(x.is_of_points for x in ask) or mechanism.bears_nothing) and self._is_held

    @cached_property
    def speeds_of_loops(self) -> frozenset[Node]:
        """The speeds that loops decide, where motions alone are asked for; else none."""
        speeds = (x.name for x in self.mechanism.speeds if self.needs_no_forces)
        return frozenset(symbol(name) for name in speeds if name in self.begin.assembled)

    @cached_property
    def _is_held(self) -> bool:
        return leave_no_freedom(self.numbers.rows, len(self.mechanism.speeds))

    @cached_property
    def _leaves(self) -> dict[Node, Bounded]:
        """Parameters, start values, accelerations and multipliers, each with a bound of its rounding."""
        return _with_bounds(self.mechanism, self.begin, self.numbers, self.slots.motion)

    def closed(self, find: Callable[[ClosedForms], T]) -> T | None:
        """Return what is found among the closed forms, None (and the reason noted) where there is none."""
        try:
            return None if self.forms is None else find(self.forms)
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
            return None

    def value_of(self, closed: Quotient, rounding: float = 0.0) -> Value | None:
        """Return a quotient as a value with its expression, None where its text does not give that value again."""
        number = float(closed.sample)
        number = 0.0 if abs(number) <= rounding else number
        try:
            expression = book_form(with_whole_angles(closed))
            shown = with_doubles(expression)
            again = evaluate_float([parse(text(shown))], self.sample)[0]
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
            return None
        except (ExpressionError, *UNDEFINED):
            return None
        if not leaves([expression], "symbol") and len(text(expression)) > _LONGEST_NUMBER:
            return Value(number)  # a quotient of many digits tells less than its decimals
        return Value(number, shown) if abs(again - number) <= AGREEMENT * abs(number) + rounding else None

    @property
    def sample(self) -> dict[Node, float]:
        """The values of the symbols of closed forms."""
        return {node: float(letter.sample) for node, letter in self.symbolic.letters.items()}

    def number(self, node: Node) -> float:
        """Return the value of an expression in the names of the model at the instant."""
        return float(self.asked(node)(self.numbers)[""])

    def asked(self, node: Node) -> Callable[[StateQuantities], Mapping[str, Any]]:
        """Return the question for an expression in the names of the model."""
        in_slots = evaluate([node], lambda leaf: self.mechanism.symbols.get(leaf, leaf))
        wanted = leaves(in_slots, "quantity")

        def ask(instant: StateQuantities) -> Mapping[str, Any]:
            state = instant.motion.state
            found = quantities(instant.motion, instant.udot, instant.multipliers, wanted)
            return {"": evaluate(in_slots, {**state.slots, **found}, state.scalar)[0]}

        return ask


def with_outputs_put_in(solved: SolvedInstant) -> SolvedInstant:
    """Return what was solved of a system whose questions have expressions in the place of names of outputs."""
    taken = {str(name.data) for name in solved.mechanism.symbols}
    return replace(solved, system=with_named_outputs(solved.system, taken))


def solved_start(
    system: System, formalism: str | None = None, left: Mapping[str, float] | None = None
) -> SolvedInstant:
    """Return the system solved at its start, the numbers by a formalism, in coordinates of its joints.

    What holds one way only is in the first mode that fulfils all laws, those of exact numbers where these say what is
    `left` at limits, by rows. Raises InputError, and NoSolutionError where
    there is no start, no mode, no inertia, or constraints contradict each other.
    """
    state = examined_state(system, left=left)
    mechanism, begin = state.in_joints
    posed, found = state.posed, state.found
    decided = Decided()
    if posed is not None and found is not None:
        pairs = zip(posed.parts, posed.problem.parts, strict=True)
        decided = Decided(
            touching=frozenset(element.name for element in posed.elements),
            moving=frozenset(part.name for part, law in pairs if not law.rests),
            at_limit=tuple(posed.names[k] for k in found.states[0].at_limit),
            others=tuple((mode, _udot(state, number, mode)) for number, mode in enumerate(state.modes) if number),
            verdict=found.verdict,
            searched=found.searched + (_FREE if found.free else ""),
            closing=frozenset(state.closing),
            strikes=state.strikes,
            motion=state.motion(0),
        )
    return solved_in(system, mechanism, begin, formalism, decided)


def _udot(state: StartState, number: int, mode: Mode) -> tuple[Value, ...]:
    """Return the accelerations at the start in another mode, each with its rounding as far as that is known."""
    own = state.motion(number)
    if own is not None:
        size = AGREEMENT * float(np.abs(own[0]).max(initial=0.0))
        return tuple(Value(x if abs(x) > size else 0.0, error=size) for x in own[0].tolist())
    mechanism, begin = replace(state, modes=(mode,)).in_joints
    here = state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(composite_body(mechanism, here))
    numbers = StateQuantities(motion_of(mechanism, here), found.udot.tolist(), found.multipliers.tolist())
    formal, _ = fix_directions(mechanism, begin.q, begin.u, begin.parameters)
    known = _with_bounds(mechanism, begin, numbers, motion_of(formal, slot_state(formal)))
    udot = [(known[node].value, known[node].bound) for node in unknowns(mechanism)[0]]
    errors = [(x, bound if np.isfinite(bound) else 0.0) for x, bound in udot]
    return tuple(Value(x if abs(x) > error else 0.0, error=error) for x, error in errors)


def solved_in(
    system: System,
    resolved: Mechanism,
    begin: Start,
    formalism: str | None = None,
    decided: Decided | None = None,
) -> SolvedInstant:
    """Return a system solved at a start of its mechanism, which is in a mode where something holds one way only.

    Raises InputError, and NoSolutionError where there is no inertia, or constraints contradict each other.
    """
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    motion = motion_of(resolved, state)
    dynamics = FORMALISMS[formalism_name(formalism, resolved)](resolved, state)
    found = forward_dynamics(dynamics, minimum_norm=resolved.minimum_norm)
    if not (np.isfinite(found.udot).all() and np.isfinite(found.report).all()):
        blame_numbers(system)
    _verify(resolved, dynamics, found)
    facts = decided or Decided()
    if facts.motion is not None:
        udot, forces = facts.motion
        found = replace(found, udot=udot, multipliers=np.array([forces[row.name] for row in resolved.rows]))
    numbers = StateQuantities(motion, found.udot.tolist(), found.multipliers.tolist())
    others = tuple(
        StateQuantities(motion, numbers.udot, (found.multipliers + change).tolist())
        for change in idle_multipliers(dynamics, found)
    )
    formal, sides = fix_directions(resolved, begin.q, begin.u, begin.parameters)
    reasons: dict[str, None] = {}
    declared = declared_state(formal, begin)
    directed = with_directions(formal, declared)  # those of slip that hold whatever the values
    forms = forms_of(formal, directed, sides, {}) if directed is not declared else None
    symbolic = directed if forms is not None and begins_along(formal, directed, forms) else declared
    if symbolic is declared:
        forms = forms_of(formal, declared, sides, reasons)
    nodes = StateQuantities(motion_of(formal, symbolic.state), *unknowns(formal))
    slots = StateQuantities(motion_of(formal, slot_state(formal)), *unknowns(formal))
    lettered = LetteredStart(formal, symbolic, begin, numbers)
    return SolvedInstant(
        system, resolved, begin, numbers, others, symbolic, nodes, slots, forms, reasons, facts, lettered
    )


def _with_bounds(mechanism: Mechanism, begin: Start, numbers: StateQuantities, slots: Motion) -> dict[Node, Bounded]:
    """Return parameters, start values, accelerations and multipliers, each with a bound of its rounding.

    `slots` is the motion over slots, by which the accelerations in `numbers` are calculated.
    """
    declared: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    assembled = {mechanism.symbols[symbol(x.name)] for x in declared if x.name in begin.assembled}
    known = {
        node: Bounded(x, EPSILON * (_ASSEMBLED * max(1.0, abs(x)) if node in assembled else abs(x)))
        for node, x in numbers.motion.state.slots.items()
    }
    places = [x for group in unknowns(mechanism) for x in group]
    found = [float(x) for x in (*numbers.udot, *numbers.multipliers)]
    bounds = _solution_bounds(*linear_equations(slots), known, np.array(found))
    return {**known, **{node: Bounded(x, b) for node, x, b in zip(places, found, bounds, strict=True)}}


def _solution_bounds(matrix: list[list[Node]], right: list[Node], known: Mapping[Node, Bounded], x: Any) -> list[float]:
    """Return bounds of the rounding in x, matrix x = right: |K^-1| (bounds of right + bounds of K |x|), to first order.

    Infinite where the equations have too many terms to look at, or no values.
    """
    size = len(x)
    entries = [as_node(y) for row in matrix for y in row]
    if size > _MOST_BOUNDED or size == 0:
        return [np.inf] * size
    found = bound_rounding([*entries, *map(as_node, right)], known)
    values, bounds = (np.array(y, dtype=float) for y in zip(*found, strict=True))
    if not (np.isfinite(values).all() and np.isfinite(bounds).all()):
        return [np.inf] * size
    inverse = np.abs(least_squares(values[: size * size].reshape(size, size), np.eye(size)))
    terms = bounds[size * size :] + bounds[: size * size].reshape(size, size) @ np.abs(x)
    return [float(bound) for bound in inverse @ terms + EPSILON * np.abs(x)]


def forms_of(
    resolved: Mechanism, symbolic: SymbolicState, sides: Sequence[SignedLength], reasons: dict[str, None]
) -> ClosedForms | None:
    """Return the closed forms; that ropes and springs lie on their sides is among the signs that they rest on."""
    try:
        found = closed_forms(resolved, symbolic)
        for length in found.of(as_node(x) for x in symbolic.state.values([side.length for side in sides])):
            sign(length)
        return found
    except NoClosedFormError as reason:
        reasons[str(reason)] = None
    except ExpressionError as reason:
        reasons[reason.message] = None
    return None


def rows_missed(dynamics: TreeDynamics, udot: Floats) -> tuple[Floats, Floats]:
    """Return by how much accelerations, or jumps of speeds, miss what each row demands of them, and that (s)."""
    wanted = np.array(dynamics.constraint_forcing, dtype=float)
    jacobian = np.array(dynamics.constraint_jacobian, dtype=float).reshape(len(wanted), len(udot))
    kinematic = np.array([row.kinematic for row in dynamics.rows], dtype=bool)
    return np.abs(jacobian @ udot - wanted) * kinematic, wanted


def _verify(resolved: Mechanism, dynamics: TreeDynamics, found: Accelerations) -> None:
    """Raise NoSolutionError where rows that depend on each other only here ask for different accelerations."""
    misses, gamma = rows_missed(dynamics, found.udot)
    missed = float(misses.max(initial=0.0))
    if not (np.isfinite(found.udot).all() and np.isfinite(found.report).all()):
        raise NoSolutionError(
            "the accelerations are no finite numbers: values of the model are too large or too small", number="N105"
        )
    size = max(1.0, float(np.abs(gamma).max(initial=0.0)), float(np.abs(found.udot).max(initial=0.0)))
    if found.report[0] < len(resolved.rows) and missed > _CONTRADICTION * size:
        names = ", ".join(row.name for row in resolved.rows)
        raise NoSolutionError(
            f"the start is a singular position of {names}, and no acceleration satisfies them with these speeds; start "
            "from another position, or at rest",
            where=Where(path=resolved.row_path(int(np.argmax(misses)))),
            number="N103",
        )


def idle_multipliers(dynamics: TreeDynamics, found: Accelerations) -> list[Floats]:
    """Return changes (s) of the multipliers, as large as these, that change no motion."""
    size = max(1.0, float(np.abs(found.multipliers).max(initial=0.0)))
    return [size * combination for combination in idle_combinations(dynamics)]


# ----------------------------------------------------------------------------------------------------------------------
# Values of a solved start with formulas in letters where they have none in what is given alone.


def with_letters(
    solved: SolvedInstant,
    ask: Callable[[StateQuantities], Mapping[str, Any]],
    units: Mapping[str, str],
    numbers: Collection[str] = (),
    least: float = 0.0,
) -> dict[str, Value]:
    """Return what `ask` finds at the instant as `Solved.values` does, with formulas in letters where there are none.

    What is in `numbers` gets none. Forces up to `least` (N) are none. Where motions alone are asked for,
    speeds that loops decide are no answers: what names them has formulas in letters too.
    """
    values = solved.values(ask, units, least)
    speeds = solved.speeds_of_loops
    for name, value in values.items():
        known = value.expression is not None and not speeds.intersection(leaves([value.expression], "symbol"))
        if name in numbers or known or not value.value or not value.unique:
            continue
        letters = solved.lettered.found
        form = None if letters is None else letters.of(ask, name)
        if letters is not None and form is not None and speeds:
            form = letters.without(form, speeds)
        if letters is not None and form is not None:
            number = evaluate_float([form], letters.letters.values)[0]
            if abs(number - value.value) <= AGREEMENT * abs(value.value):
                values[name] = replace(value, expression=form)
    return values


def is_lettered(solved: SolvedInstant, value: Value) -> bool:
    """Return whether a formula names letters that the model and its start do not have."""
    named = leaves([value.expression], "symbol") if value.expression is not None else []
    return any(x not in solved.symbolic.letters for x in named)


# ----------------------------------------------------------------------------------------------------------------------
# Forces at a solved start: reactions of joints, tensions, normal forces and friction, by element and component.


Components = dict[str, Value]

_NOTHING: Final = 1e-12
"""The part of the largest force of corners up to which their sum is what rounding leaves of it."""


@stage("reactions")
def reactions_of(solved: SolvedInstant) -> dict[str, Components]:
    """Return the reactions of joints, cut ones too, the multipliers of constraints, and forces of one-way elements."""
    found: dict[str, Components] = {}
    for name in held_pulleys(solved.mechanism):  # massless ones that stand under no joint

        def of_pulley(instant: StateQuantities, name: str = name) -> Mapping[str, Any]:
            return instant.pulleys[name]

        found[name] = with_letters(solved, of_pulley, REACTION_UNITS)
    return {**found, **_of_joints(solved), **_of_constraints(solved), **_of_one_way(solved), **_of_groups(solved)}


def of_joint(name: str, instant: StateQuantities) -> Mapping[str, Any]:
    """Return the reaction of a joint by component."""
    return instant.reactions[name]


def of_row(k: int, instant: StateQuantities) -> Mapping[str, Any]:
    """Return the multiplier of a row by no name."""
    return {"": instant.multipliers[k]}


def _of_joints(solved: SolvedInstant) -> dict[str, Components]:
    found: dict[str, Components] = {}
    mechanism = solved.mechanism
    for name in mechanism.joint_names:
        # a joint's own freedoms leave components to what drives it, which needs no letters
        steps = [free.step for body in mechanism.bodies if body.joint_name == name for free in body.free_steps]
        axes = [(kind, axis) for x in steps for kind, every in (("m", x.turns), ("f", x.slides)) for axis in every]
        free = {f"{kind}{axis}" for kind, along in axes for axis, x in zip("xyz", along, strict=True) if x is not ZERO}
        values = with_letters(solved, partial(of_joint, name), REACTION_UNITS, numbers=free)
        undetermined = mechanism.withheld[name].components if name in mechanism.withheld else ()
        if undetermined:
            undetermined = (*undetermined, NORMAL)
        found[name] = {c: Value(None, unit=REACTION_UNITS[c]) if c in undetermined else x for c, x in values.items()}
    return found


def place_of(row: Row) -> tuple[str, str]:
    """Return under which element, and as which component, a row's multiplier stands among the reactions."""
    if row.rope_run is not None:
        return row.rope_run.told
    return row.name, "multiplier" if isinstance(row, ExpressionRow) else "tension"


def _of_constraints(solved: SolvedInstant) -> dict[str, Components]:
    found: dict[str, Components] = {}
    units = MechanismUnits(solved.mechanism).multipliers
    one_way = {row.name for element in solved.mechanism.one_way for row in element.rows}
    for k, row in enumerate(solved.mechanism.rows):
        if row.name.rpartition(".")[0] in solved.mechanism.joint_names or row.name in one_way:
            continue
        name, component = place_of(row)
        value = with_letters(solved, partial(of_row, k), {"": units[row.name]})[""]
        found.setdefault(name, {})[component] = value
    return found


def _of_one_way(solved: SolvedInstant) -> dict[str, Components]:
    """Return for each element its normal force, tension or force, and its friction; of friction in space two parts.

    A run of rope that may slacken has two tensions where it rubs on a wheel.
    """
    found: dict[str, Components] = {}
    for element in solved.mechanism.one_way:
        rope = element.normals[0].rope_run if element.kind == "rope" else None
        if rope is not None:

            def of_rope(instant: StateQuantities, rope: RopeRow = rope) -> Mapping[str, Any]:
                return dict(zip(rope.components, (instant.tensions[name] for name in rope.asked), strict=True))

            tensions = with_letters(solved, of_rope, dict.fromkeys(rope.components, "N"))
            found.setdefault(rope.told[0], {}).update(tensions)
        else:
            of_element = partial(_forces_of, element)
            found[element.name] = with_letters(solved, of_element, _units(solved.mechanism, element))
    return found


def _forces_of(element: LawElement, instant: StateQuantities) -> Mapping[str, Any]:
    return ActingForces.at(instant).of(element)


def _units(mechanism: Mechanism, element: LawElement) -> dict[str, str]:
    units = dict.fromkeys(PRESSING.values(), "N")
    if element.normals:
        units[PRESSING[element.kind]] = unit_of(mechanism, element.normals[0])
    for part in element.frictions:
        named = zip(component_names(element, part), part.rows, strict=True)
        units |= {name: unit_of(mechanism, row) for name, row in named}
    return units


def unit_of(mechanism: Mechanism, row: Row) -> str:
    """Return the unit of a row's force: what the row says, or what its speed tells."""
    return row.unit or MechanismUnits(replace(mechanism, rows=(row,))).multipliers[row.name]


def corner_groups(elements: Iterable[LawElement]) -> dict[str, list[LawElement]]:
    """Return the declared contacts that have several corners, with those among some elements."""
    groups: dict[str, list[LawElement]] = {}
    for element in elements:
        if element.kind == "contact" and element.group not in ("", element.name):
            groups.setdefault(element.group, []).append(element)
    return groups


def _of_groups(solved: SolvedInstant) -> dict[str, Components]:
    """Return for each contact of several corners the sum of their forces, and where the normal force acts.

    One of nothing acts nowhere.
    """
    found: dict[str, Components] = {}
    for name, elements in corner_groups(solved.mechanism.one_way).items():

        def of_group(instant: StateQuantities, elements: list[LawElement] = elements) -> Mapping[str, Any]:
            every = [_forces_of(element, instant) for element in elements]
            return {name: reduce(add, (forces[name] for forces in every if name in forces)) for name in every[0]}

        def places(instant: StateQuantities, elements: list[LawElement] = elements) -> Mapping[str, Any]:
            return ActingForces.at(instant).middle(elements)

        acting = ActingForces.at(solved.numbers)
        largest = max(abs(float(force)) for element in elements for force in acting.of(element).values())
        found[name] = with_letters(solved, of_group, _units(solved.mechanism, elements[0]), least=_NOTHING * largest)
        normal = found[name]["normal"]
        if not normal.unique and acting.presses_at(elements):  # it may be zero
            found[name] |= dict.fromkeys(AT, Value(None, unit="m", unique=False))
        elif normal.value:
            found[name] |= with_letters(solved, places, dict.fromkeys(AT, "m"))
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Sums of forces that are unique where the single ones of separate contacts are not: two feet share what they bear.


_MOST: Final = 4
"""How many forces are added at most: with either sign, and fewer of them where all together are not unique."""

Signed = tuple[tuple[LawElement, int], ...]


def unique_sums(solved: SolvedInstant, reactions: Mapping[str, Mapping[str, Value]]) -> dict[str, Value]:
    """Return the sums of one kind of force over separate contacts that are unique, though none of them is alone.

    By their words, such as `friction(c) + friction(d)`; the forces of one contact's corners stand together anyway.
    """
    found: dict[str, Value] = {}
    for word in ("normal", "friction", "tension"):
        separate = []
        for element in solved.mechanism.one_way:
            value = reactions.get(element.name, {}).get(word)
            together = element.group != element.name and word in reactions.get(element.group, {})
            if value is not None and not value.unique and not together:
                separate.append(element)
        if not 2 <= len(separate) <= _MOST:
            continue
        summed: set[str] = set()
        for chosen in (x for size in range(len(separate), 1, -1) for x in combinations(separate, size)):
            names = {element.name for element in chosen}
            unit = reactions[chosen[0].name][word].unit
            first = None if summed & names else next(_unique_sums_of(solved, chosen, word, unit), None)
            if first is not None:
                found[first[0]] = first[1]
                summed |= names
    return found


def _unique_sums_of(
    solved: SolvedInstant, chosen: tuple[LawElement, ...], word: str, unit: str
) -> Iterator[tuple[str, Value]]:
    for signs in product((1, -1), repeat=len(chosen) - 1):
        signed: Signed = tuple(zip(chosen, (1, *signs), strict=True))
        name = "".join(f" {'+' if sign > 0 else '-'} {force_name(each.name, word)}" for each, sign in signed)[3:]

        def of_sum(instant: StateQuantities, signed: Signed = signed, name: str = name) -> Mapping[str, Any]:
            return {name: sum(sign * ActingForces.at(instant).of(element)[word] for element, sign in signed)}

        value = solved.values(of_sum, {name: unit})[name]
        if value.unique and value.value is not None:
            yield name, value
