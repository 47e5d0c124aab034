"""States over Nodes in the names of the model, and closed forms at one: accelerations, multipliers, forces.

In: a Mechanism and its start in floats. Out: a SymbolicState, its ClosedForms over exact quotients.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from fractions import Fraction
from itertools import combinations
from math import inf, tau
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import (
    absolute,
    exact,
    exact_solve,
    register_angles,
    sine_and_cosine,
    sqrt,
)
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import linear_parts, roots
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics, mass_matrix
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.programs.reactions import LawForces
from multibody_sym.dynamics.redundancy import held_coordinates
from multibody_sym.dynamics.start.initial_geometry import measured_rows, seen_axis
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, RopeSide, Speed, TangentAngle, WrapAngle
from multibody_sym.mechanics.modes import with_coefficients
from multibody_sym.mechanics.motion import Motion, State, motion_of, state_of
from multibody_sym.mechanics.points import tangent_angle
from multibody_sym.mechanics.ropes import wrap_angle
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.row_records import RopeSlipRow, Row, Sliding
from multibody_sym.records import dataclass
from multibody_sym.scalars import functions
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float, substitute
from multibody_sym.scalars.node import PI, ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.vectors import S
from multibody_sym.text.units import ENERGY, FORCE

_WORK: Final = 10_000
_ASIDE: Final = Fraction(1, 1009)


@dataclass(frozen=True)
class SymbolicState:
    """A state over Nodes, and the letter of each of its symbols in closed forms.

    `closings`: formulas of coordinates that keep their letters all the same, as other formulas are shorter with these.
    """

    state: State
    letters: Mapping[Node, Letter]
    closings: Mapping[Node, Node] = field(default_factory=dict)

    @property
    def sample(self) -> dict[Node, float]:
        """The sample of each letter."""
        return {node: float(letter.sample) for node, letter in self.letters.items()}

    def translated(self, mechanism: Mechanism, node: Node) -> Node:
        """Return an expression in the names of the model as one in this state's symbols; quantities stay."""
        return substitute(substitute(node, mechanism.symbols), self.state.slots)


def any_state(mechanism: Mechanism, begin: Start, start: State | None = None) -> SymbolicState:
    """Return the state in which time, coordinates and speeds keep their names; the sample is near the start.

    Coordinates that constraints hold stay what they are at a `start` over Nodes, at rest, and have no names.
    """
    parameters, letters = parameter_letters(mechanism)
    q = [symbol(c.name) for c in mechanism.coordinates]
    u = [symbol(s.name) for s in mechanism.speeds]
    time = symbol("t")
    immobile: dict[int, Node] = {}
    if start is not None:
        immobile = {k: as_node(start.q[k]) for k in held_coordinates(mechanism, begin.q, begin.parameters)}
    for k, (node, value) in enumerate(zip((time, *q, *u), (0.0, *begin.q, *begin.u), strict=True)):
        # a little aside, where nothing vanishes by chance
        aside = PRECISE.mpf(_ASIDE.numerator) / (_ASIDE.denominator + 97 * k)
        letters[node] = Letter(node, PRECISE.mpf(value) + aside)
    for k, place in immobile.items():
        del letters[q[k]], letters[u[k]]
        q[k], u[k] = place, ZERO
    return SymbolicState(state_of(mechanism, Node, time, q, u, parameters), letters)


def parameter_letters(mechanism: Mechanism) -> tuple[list[Node], dict[Node, Letter]]:
    """Return the parameter vector over Nodes (those given by others written out), and the letters of the free ones.

    Parameters that a run measures or chooses are zero, as no acceleration depends on them: lengths of ropes, angles of
    tangents, Baumgarte's coefficients. No mass, and no coefficient of friction or restitution, is negative.
    """
    entries = mechanism.parameters
    known: dict[Node, Node] = {}
    letters: dict[Node, Letter] = {}
    coefficients = [leaves([x], "slot") for x in (*_friction_coefficients(mechanism), *_restitutions(mechanism))]
    never_negative = {slots[0] for slots in coefficients if len(slots) == 1}
    never_negative |= {body.mass.mass for body in mechanism.bodies}
    either_sign = _load_factors(mechanism)
    waiting = list(range(len(entries)))
    while waiting:
        index = waiting.pop(0)
        place, value = slot("parameters", index), entries[index].value
        needed = leaves([value], "slot") if value is not None else []
        if value is None:
            known[place] = ZERO
        elif not needed:
            known[place] = symbol(entries[index].name)
            sample = exact(Field(_WORK), [value], {})[0].sample
            positive = entries[index].positive or (place in never_negative and sample > 0)
            turns = place in either_sign and not positive
            letters[known[place]] = Letter(known[place], sample, positive, turns=turns)
        elif all(leaf in known for leaf in needed):
            known[place] = as_node(evaluate([value], known)[0])
        else:
            waiting.append(index)
    return [known[slot("parameters", i)] for i in range(len(entries))], letters


def _friction_coefficients(mechanism: Mechanism) -> list[Node]:
    parts = [part for element in _one_way(mechanism) for part in element.frictions]
    return [as_node(x) for part in parts for x in (part.static, part.kinetic)]


def _restitutions(mechanism: Mechanism) -> list[Node]:
    struck = mechanism.impact
    given = [*struck.restitutions.values(), *struck.tangential.values()] if struck is not None else []
    own = [x for element in _one_way(mechanism) for x in (element.restitution, element.tangential_restitution)]
    return [as_node(x) for x in (*own, *given)]


def _one_way(mechanism: Mechanism) -> list[LawElement]:
    return [*mechanism.one_way, *(mechanism.impact.meetings if mechanism.impact is not None else ())]


def limits_of(mechanism: Mechanism, name: str) -> tuple[float, float]:
    """Return the least and the greatest value that a parameter may have."""
    place = mechanism.symbols[symbol(name)]
    if place in _restitutions(mechanism):
        return 0.0, 1.0
    positive = any(entry.positive for entry in mechanism.parameters if entry.name == name)
    return (0.0 if positive or place in _friction_coefficients(mechanism) else -inf), inf


def _load_factors(mechanism: Mechanism) -> set[Node]:
    """Return the slots of parameters that are factors of loads, which may as well pull as push.

    Weights, and factors of another dimension than a force or a torque, keep their sign.
    """
    waiting: list[Node] = []
    for load in mechanism.loads:
        value = getattr(load, "value", ())
        waiting.extend(value if isinstance(value, tuple) else (value,))
    slots = set()
    while waiting:
        node = waiting.pop()
        if node.op == "slot":
            slots.add(node)
        elif node.op in ("neg", "add", "mul"):
            waiting.extend(node.args)
        elif node.op == "div":
            waiting.append(node.args[0])
    weights = {body.mass.mass for body in mechanism.bodies} | set(leaves(map(as_node, mechanism.gravity), "slot"))
    entries = {slot("parameters", k): entry for k, entry in enumerate(mechanism.parameters)}
    return {x for x in slots - weights if x in entries and entries[x].dimension in (None, FORCE, ENERGY)}


# --- closed forms at one state ---------------------------------------------------------------------------------------
#
# The equations of motion are formed over Nodes at the state, and solved over exact quotients:
#
#     M udot - C^T lambda = f        H udot + D lambda = gamma
#
# C is H where nothing slides, and D is zero but for rows that define forces.

WORK: Final = 50_000
"""How much is done for the closed forms of one state, in products of terms: a second or so."""


@dataclass(frozen=True)
class ClosedForms:
    """A solved state: accelerations `udot` (nu) and `multipliers` (ns), and through `of` what follows from them."""

    field: Field
    udot: list[Quotient]
    multipliers: list[Quotient]
    known: dict[Node, Quotient]
    matrix: list[list[Quotient]]

    def of(self, nodes: Iterable[Node]) -> list[Quotient]:
        """Return Nodes in the state's symbols and in `unknowns` as quotients; raises NoClosedFormError."""
        return exact(self.field, nodes, self.known)

    def give(self, row: int) -> Quotient:
        """Return the multiplier by a row's a = H udot - gamma, all other rows satisfied: a pivot of the equations.

        Raises NoClosedFormError.
        """
        place = len(self.udot) + row
        unit = [self.field.constant(int(k == place)) for k in range(len(self.matrix))]
        return exact_solve(self.matrix, unit)[place]


def unknowns(mechanism: Mechanism) -> tuple[list[Node], list[Node]]:
    """Return the slots that stand for the accelerations and for the multipliers in expressions over Nodes."""
    udot = [slot("udot", k) for k in range(len(mechanism.speeds))]
    return udot, [slot("multipliers", k) for k in range(len(mechanism.rows))]


def closed_forms(mechanism: Mechanism, given: SymbolicState) -> ClosedForms:
    """Return the accelerations and multipliers at a state; multipliers of dependent rows may be zero.

    Raises NoClosedFormError where they are too long, or a sign is undecided at the sample.
    """
    motion = motion_of(mechanism, given.state)
    equations = linear_equations(motion)
    rows = enumerate(row_motions(motion))
    vectors = [(k, *row.beside) for k, row in rows if row.beside and min(row.beside) > k]
    try:
        return _solve_forms(mechanism, given, Field(WORK), *equations, vectors)
    except NoClosedFormError:
        return _solve_forms(mechanism, given, Field(WORK, expands=True), *equations, vectors)


def _solve_forms(
    mechanism: Mechanism,
    given: SymbolicState,
    field: Field,
    matrix: list[list[Node]],
    right: list[Node],
    vectors: list[tuple[int, ...]],
) -> ClosedForms:
    known = {node: field.letter(node, letter) for node, letter in given.letters.items()}
    register_angles(field, [as_node(x) for x in (*(x for row in matrix for x in row), *right)], known)
    rows = [exact(field, [as_node(x) for x in (*row, r)], known) for row, r in zip(matrix, right, strict=True)]
    left, wanted = [row[:-1] for row in rows], [row[-1] for row in rows]
    udot, multipliers = unknowns(mechanism)
    if len(vectors) > 1:
        raise NoClosedFormError("several joints press with the lengths of their reactions, which depend on each other")
    if vectors:
        places = tuple(len(udot) + k for k in vectors[0])
        solved, left = _by_length(left, wanted, len(udot), places)
    else:
        solved = exact_solve(left, wanted)
    known.update(zip((*udot, *multipliers), solved, strict=True))
    return ClosedForms(field, solved[: len(udot)], solved[len(udot) :], known, left)


def _by_length(
    left: list[list[Quotient]], right: list[Quotient], speeds: int, vector: tuple[int, ...]
) -> tuple[list[Quotient], list[list[Quotient]]]:
    """Return the solution where unknowns make a vector whose length w presses, and the matrix along that vector.

    In the equations of the speeds these unknowns have the column of w. All else is linear in w, and the unknowns are
    a + b w: w = |a + b w| with its positive root, where |b| < 1.
    """
    zero = right[0].field.constant(0)
    column = [row[vector[0]] if k < speeds else zero for k, row in enumerate(left)]
    without = [[zero if k < speeds and j in vector else x for j, x in enumerate(row)] for k, row in enumerate(left)]
    free, of_length = exact_solve(without, right), exact_solve(without, [-x for x in column])
    a, b = ([x[k] for k in vector] for x in (free, of_length))
    w = _length(a, b)
    solved = [x + y * w for x, y in zip(free, of_length, strict=True)]
    parts = {k: solved[k] / w for k in vector}
    along = [
        [row[j] * parts[j] if k < speeds and j in parts else row[j] for j in range(len(row))]
        for k, row in enumerate(left)
    ]
    return solved, along


def _length(a: Sequence[Quotient], b: Sequence[Quotient]) -> Quotient:
    """Return the w > 0 with w = |a + b w|. Raises NoClosedFormError where there is none."""
    there = [(x, y) for x, y in zip(a, b, strict=True) if not (x.is_zero and y.is_zero)]
    alone = len(there) < 2
    if alone:
        x, y = there[0] if there else (a[0], b[0])
        one = x.field.constant(1)
        found = next((w for w in (x / (one - y), -x / (one + y)) if w.sample > 0), None)
    else:
        one = a[0].field.constant(1)
        zero = a[0].field.constant(0)
        across, square = sum((x * y for x, y in there), zero), sum((x * x for x, _ in there), zero)
        left = one - sum((y * y for _, y in there), zero)
        found = (across + sqrt(across * across + absolute(left) * square)) / left if left.sample > 0 else None
    if found is None or not found.sample > 0:
        raise NoClosedFormError("what presses in a joint has no one length")
    return absolute(found) if alone else found


def linear_equations(motion: Motion) -> tuple[list[list[Node]], list[Node]]:
    """Return the matrix [[M, -C^T], [H, D]] and the right side (f, gamma) over Nodes; M itself may be singular.

    Of multipliers that make a vector each has the column of its length.
    """
    rows = row_motions(motion)
    upper = [[*row, *(-h.forces[k] for h in rows)] for k, row in enumerate(mass_matrix(motion))]
    lower = [[*h.jacobian, *(h.coupling.get(k, 0) for k in range(len(rows)))] for h in rows]
    generalized = applied_generalized_forces(motion, applied_forces(motion))
    velocity_terms = inverse_dynamics(motion, [0] * len(generalized))
    forcing = [q - c for q, c in zip(generalized, velocity_terms, strict=True)]
    return [*upper, *lower], [*forcing, *(h.gamma for h in rows)]


# --- one-way elements at a solved start: forces and accelerations, over any scalar -----------------------------------

_ROUNDING: Final = 1e-10
"""Part of the largest force by which a force may be beyond its limit."""


@dataclass(frozen=True, eq=False)
class ActingForces(LawForces):
    """The elements of a mechanism in its mode at an instant, with their forces and accelerations."""

    udot: Sequence[S]

    @classmethod
    def at(cls, instant: StateQuantities) -> ActingForces:
        return cls(instant.motion, instant.multipliers, instant.udot)

    @property
    def tensions(self) -> Mapping[str, S]:
        """All tensions of ropes, by the names by which they are asked."""
        return StateQuantities(self.motion, self.udot, self.multipliers).tensions

    @property
    def beyond(self) -> str:
        """The first violation of the mode's limits by the forces (floats), in words; empty without."""
        least = _ROUNDING * max((abs(float(x)) for x in self.multipliers), default=0.0)
        for limit in self.mode_limits:
            if limit.kind in ("force", "cone") and float(self.value(limit, self.acceleration)) < -least:
                if limit.part is not None:
                    return f"{limit.part.name} would need more friction than there is"
                return f"{limit.element.name} would {'push' if limit.element.kind == 'rope' else 'pull'}"
        return ""

    def acceleration(self, row: Row) -> S:
        """Return H udot - gamma of a row: how fast it opens or slips faster."""
        moved = self.row(row)
        return sum((h * a for h, a in zip(moved.jacobian, self.udot, strict=True)), -moved.gamma)


# --- the start over Nodes --------------------------------------------------------------------------------------------
#
# A number that came from closing constraints holds for one choice of parameters only, and so does a guess that happens
# to be right. An assembled coordinate therefore keeps its declared expression only where all rows are satisfied by it
# whatever the parameters are; else it takes the closed form that the rows give, or keeps its name.

_AS_DECLARED: Final = 1e-12
_SYMBOLIC_START_ASIDE: Final = 1e-12
"""The component of a direction (of length one) beside a tangent up to which it is rounding."""
_SAME_DIRECTION: Final = 1e-9
_MOST_GUESSES: Final = 4


def declared_state(mechanism: Mechanism, begin: Start) -> SymbolicState:
    """Return the start with coordinates and speeds as declared, in parameters; assembled ones as said above."""
    found = _SymbolicStart.of(mechanism, begin)
    found.find_positions()
    found.measure()
    found.find_speeds()
    return found.given()


def _agrees(x: float, value: float) -> bool:
    return abs(x - value) <= _AS_DECLARED * max(1.0, abs(value))


@dataclass
class _SymbolicStart:
    """The start as it becomes known: q (nq) and u (nu) over Nodes, letters by node.

    `guesses` are the declared expressions of assembled variables, by place, where they have the assembled value.
    """

    mechanism: Mechanism
    begin: Start
    parameters: list[Node]
    letters: dict[Node, Letter]
    q: list[Node]
    u: list[Node]
    q_guesses: dict[int, Node]
    u_guesses: dict[int, Node]
    closings: dict[Node, Node] = field(default_factory=dict)

    @classmethod
    def of(cls, mechanism: Mechanism, begin: Start) -> _SymbolicStart:
        """Return the start with a letter for everything that was assembled."""
        parameters, letters = parameter_letters(mechanism)
        values = {slot("parameters", i): node for i, node in enumerate(parameters)}
        sample = {node: float(letter.sample) for node, letter in letters.items()}
        assembled = set(begin.assembled)

        def declared(
            named: Sequence[Coordinate | Speed], nodes: Sequence[Node], found: Sequence[float]
        ) -> tuple[list[Node], dict[int, Node]]:
            kept, guesses = list(nodes), {}
            for k, each in enumerate(named):
                agrees = _agrees(evaluate_float([nodes[k]], sample)[0], found[k])
                if agrees and each.name in assembled:
                    guesses[k] = nodes[k]
                if not agrees or each.name in assembled:
                    kept[k] = symbol(each.name)
                    letters[kept[k]] = Letter(kept[k], PRECISE.mpf(found[k]))
            return kept, guesses

        initial = [as_node(x) for x in evaluate([c.initial for c in mechanism.coordinates], values)]
        for places in (places for body in mechanism.bodies for places in body.quaternions):
            length = functions.sqrt(sum((initial[k] ** 2 for k in places), ZERO))
            for k in places:
                initial[k] = initial[k] / length
        q, q_guesses = declared(mechanism.coordinates, initial, begin.q)
        speeds = [as_node(x) for x in evaluate([s.initial for s in mechanism.speeds], values)]
        u, u_guesses = declared(mechanism.speeds, speeds, begin.u)
        return cls(mechanism, begin, parameters, letters, q, u, q_guesses, u_guesses)

    def given(self) -> SymbolicState:
        """Return the state as far as it is known."""
        return SymbolicState(self._motion(self.q, self.u).state, self.letters, self.closings)

    def _motion(self, q: Sequence[Node], u: Sequence[Node]) -> Motion:
        return motion_of(self.mechanism, state_of(self.mechanism, Node, ZERO, list(q), list(u), self.parameters))

    @property
    def _sample(self) -> dict[Node, float]:
        return {node: float(letter.sample) for node, letter in self.letters.items()}

    def _field(self, *, expands: bool = False) -> tuple[Field, dict[Node, Quotient]]:
        field = Field(_WORK, expands)
        return field, {node: field.letter(node, letter) for node, letter in self.letters.items()}

    # --- positions ------------------------------------------------------------------------------------------------

    def find_positions(self) -> None:
        """Put declared expressions or closed forms in place of assembled coordinates, where rows confirm all of them.

        Guesses are kept all, or all but one: a guess may be right for one choice of the parameters only.
        """
        unknown = [k for k, c in enumerate(self.mechanism.coordinates) if self.q[k] is symbol(c.name)]
        guessed = list(self.q_guesses)
        dropped: list[tuple[int, ...]] = [(), *((k,) for k in guessed if len(guessed) <= _MOST_GUESSES)]
        for leave in dropped if unknown else ():
            kept = {k: node for k, node in self.q_guesses.items() if k not in leave}
            try:
                confirmed = self._confirmed(kept, [k for k in unknown if k not in kept])
            except (NoClosedFormError, ExpressionError):
                continue
            if confirmed is not None:
                self.q = confirmed
                return
        with suppress(NoClosedFormError, ExpressionError):
            self.closings = self._turned_slide(unknown)

    def _confirmed(self, kept: dict[int, Node], unknown: Sequence[int]) -> list[Node] | None:
        """Return coordinates with which all rows vanish whatever the parameters are, the unknown ones from the rows."""
        q = [kept.get(k, node) for k, node in enumerate(self.q)]
        if unknown:
            from_zero = [ZERO if k in unknown else node for k, node in enumerate(q)]
            closed = self._linear(from_zero, unknown) or self._one_by_one(q, unknown)
            if closed is None:
                return None
            q = [closed.get(k, node) for k, node in enumerate(q)]
        zeros = [as_node(row.phi) for row in self._closing(self._motion(q, self.u))]
        for expands in (False, True):
            field, known = self._field(expands=expands)
            if all(x.is_zero for x in exact(field, zeros, known)):
                return q
        return None

    def _linear(self, q: Sequence[Node], unknown: Sequence[int]) -> dict[int, Node] | None:
        """Return the unknown coordinates by one step from where they are zero, which is right for linear rows."""
        places = {i: k for body in self.mechanism.bodies for i, k in body.rate_pairs}
        if not all(k in places for k in unknown):
            return None
        rows = self._closing(self._motion(q, self.u))
        return self._solved(rows, [as_node(row.phi) for row in rows], {k: places[k] for k in unknown}, self.begin.q)

    def _one_by_one(self, q: Sequence[Node], unknown: Sequence[int]) -> dict[int, Node] | None:
        """Return the unknown coordinates each from a row in which no other one is left: a rod, then its slider.

        Where all rows have several, one that a row gives linearly is put into the others first.
        """
        found, places = list(q), list(unknown)
        while places:
            rows = self._residuals(found)
            root = next((x for row in rows for x in self._alone(row, found, places)), None)
            for aside in self._linear_ones(rows, found, places) if root is None else ():
                left = [k for k in places if k != aside[0]]
                held = [aside[1] if k == aside[0] else node for k, node in enumerate(found)]
                root = next((x for row in self._residuals(held) for x in self._alone(row, held, left)), None)
                if root is not None:
                    break
            if root is None:
                return None
            found[root[0]] = root[1]
            places.remove(root[0])
        return {k: found[k] for k in unknown}

    def _residuals(self, q: Sequence[Node]) -> list[Quotient]:
        field, known = self._field(expands=True)
        return exact(field, [as_node(row.phi) for row in self._closing(self._motion(q, self.u))], known)

    def _alone(self, row: Quotient, q: Sequence[Node], places: Sequence[int]) -> Iterator[tuple[int, Node]]:
        """Yield an unknown coordinate with its closed form, where a row has no other one."""
        there = [k for k in places if q[k] in row.symbols]
        if len(there) != 1:
            return
        for root in roots(row, q[there[0]]):
            if _agrees(evaluate_float([root], self._sample)[0], self.begin.q[there[0]]):
                yield there[0], root

    def _turned_slide(self, places: Sequence[int]) -> dict[Node, Node]:
        """Return the two unknowns where an arm turns by one and the other slides along it, as in a quick-return.

        The rows are linear in the sine and cosine of the angle, whose squares add up to 1. Formulas are shorter in
        these coordinates, which therefore keep their letters.
        """
        q = self.q
        units = [self.mechanism.coordinates[k].unit for k in places]
        if sorted(units) != ["m", "rad"] or len(places) != len(self.mechanism.coordinates):
            return {}
        turn, slide = places if units[0] == "rad" else reversed(places)
        field, known = self._field(expands=True)
        rows = exact(field, [as_node(row.phi) for row in self._closing(self._motion(q, self.u))], known)
        sine, cosine = sine_and_cosine(known[q[turn]])
        linear = [parts for row in rows if (parts := _parts_by(row, sine, cosine)) is not None]
        if len(linear) != 2 or len(linear) < sum(not row.is_zero for row in rows):
            return {}
        (a, b, c), (d, e, f) = linear
        across, x, y = a * e - b * d, b * f - c * e, c * d - a * f  # a cos + b sin + c = 0, d cos + e sin + f = 0
        for root in roots(x * x + y * y - across * across, q[slide]):
            if not _agrees(evaluate_float([root], self._sample)[0], self.begin.q[slide]):
                continue
            ratio = y / x
            side = 1 if (x / across).sample * field.whole(ratio.below).sample > 0 else -1
            sides = [book_form(field.whole(part) * side) for part in (ratio.above, ratio.below)]
            angle = BUILD["atan2"](*(substitute(side, {q[slide]: root}) for side in sides))
            turns = round((self.begin.q[turn] - evaluate_float([angle], self._sample)[0]) / tau)
            return {q[slide]: root, q[turn]: angle + 2 * turns * PI if turns else angle}
        return {}

    @staticmethod
    def _linear_ones(rows: Sequence[Quotient], q: Sequence[Node], places: Sequence[int]) -> Iterator[tuple[int, Node]]:
        """Yield unknown coordinates that stand linearly in a row, with what it says that they are by the others."""
        for row in rows:
            for k in places:
                for slope, constant in linear_parts(row, q[k]) if q[k] in row.symbols else ():
                    yield k, book_form(-constant / slope)

    def _closing(self, motion: Motion) -> list[RowMotion]:
        """Return the rows that restrict positions: all but nonholonomic ones, and ropes that take their length here."""
        measured = measured_rows(self.mechanism)
        return [row for k, row in enumerate(row_motions(motion)) if row.holonomic and k not in measured]

    def measure(self) -> None:
        """Put the expressions of measured angles in place of their parameters: tangents, sides of ropes, wraps."""
        begin, rest = self.begin, [ZERO] * len(self.u)
        there = ConstraintRows(self.mechanism, begin.parameters, []).motion(np.array(begin.q), np.zeros(len(begin.u)))
        here = self._motion(self.q, rest)
        for place, entry in enumerate(self.mechanism.parameters):
            if isinstance(entry.measure, TangentAngle):
                angle = tangent_angle(here, entry.measure, seen_axis(there, entry.measure))
                self.parameters[place] = as_node(angle)
            elif isinstance(entry.measure, RopeSide):
                self.parameters[place] = as_node(round(begin.parameters[place]))
            elif isinstance(entry.measure, WrapAngle):
                rows = (row for element in self.mechanism.one_way for row in element.rows)
                slip = next(row for row in rows if row.name == entry.measure.row)
                assert isinstance(slip, RopeSlipRow)
                self.parameters[place] = as_node(wrap_angle(here, slip.rope, slip.bend))

    # --- speeds ---------------------------------------------------------------------------------------------------

    def find_speeds(self) -> None:
        """Put declared expressions or closed forms in place of assembled speeds, as H u = -phi_t gives them."""
        unknown = [k for k, speed in enumerate(self.mechanism.speeds) if self.u[k] is symbol(speed.name)]
        if not unknown:
            return
        try:
            kept = [self.u_guesses.get(k, node) for k, node in enumerate(self.u)]
            field, known = self._field()
            moving = [as_node(row.phidot) for row in row_motions(self._motion(self.q, kept))]
            if len(self.u_guesses) == len(unknown) and all(x.is_zero for x in exact(field, moving, known)):
                self.u = kept
                return
            rows = row_motions(self._motion(self.q, [ZERO if k in unknown else node for k, node in enumerate(self.u)]))
            right = [as_node(row.phidot) for row in rows]
            closed = self._solved(rows, right, {k: k for k in unknown}, self.begin.u)
        except (NoClosedFormError, ExpressionError):
            return
        self.u = [(closed or {}).get(k, node) for k, node in enumerate(self.u)]

    def _solved(
        self, rows: Sequence[RowMotion], missed: Sequence[Node], unknown: dict[int, int], values: Collection[float]
    ) -> dict[int, Node] | None:
        """Return the unknown (place: speed) with J unknown = -missed; None where these are not the values found."""
        if not rows:
            return None
        field, known = self._field()
        matrix = [exact(field, [as_node(row.jacobian[k]) for k in unknown.values()], known) for row in rows]
        found = exact_solve(matrix, [-x for x in exact(field, missed, known)])
        wanted = [list(values)[k] for k in unknown]
        near = (_agrees(float(x.sample), value) for x, value in zip(found, wanted, strict=True))
        return dict(zip(unknown, map(book_form, found), strict=True)) if all(near) else None


def _parts_by(row: Quotient, sine: Quotient, cosine: Quotient) -> tuple[Quotient, Quotient, Quotient] | None:
    """Return (a, b, c) of the numerator a cos + b sin + c; None where it is no such sum, or vanishes."""
    field = row.field
    places = [next(k for k, n in enumerate(next(iter(field.in_ring(part.above)))) if n) for part in (cosine, sine)]
    parts: list[dict[Any, Any]] = [{}, {}, {}]
    for m, x in field.in_ring(row.above).items():
        powers = [m[k] for k in places]
        if sum(powers) > 1:
            return None
        rest = tuple(0 if k in places else n for k, n in enumerate(m))
        parts[powers.index(1) if sum(powers) else 2][rest] = x
    a, b, c = (field.whole(field.ring.from_dict(part)) for part in parts)
    return None if a.is_zero and b.is_zero else (a, b, c)


# --- directions in which slip in space begins ------------------------------------------------------------------------


def with_directions(mechanism: Mechanism, given: SymbolicState) -> SymbolicState:
    """Return a state with formulas in place of the directions in which something begins to slide in space.

    A direction is a tangent where nothing leads aside, else that of sliding without friction, where this is the
    direction that was found; `begins_along` checks it with friction. Without such formulas the state is unchanged.
    """
    found: dict[Node, Node] = {}
    sample = given.sample
    for sliding in _starting_slides(mechanism):
        assert sliding.starts is not None
        numbers = evaluate_float(given.state.values(sliding.starts), sample)
        if sorted(map(abs, numbers))[-2] <= _SYMBOLIC_START_ASIDE:
            formulas = [as_node(round(x)) for x in numbers]
        else:
            formulas = _smooth_direction(mechanism, given, sliding)
        values = evaluate_float(formulas, sample)
        if formulas and max(abs(a - b) for a, b in zip(values, numbers, strict=True)) <= _SAME_DIRECTION:
            found |= dict(zip(sliding.starts, formulas, strict=True))
    if not found:
        return given
    unused = {given.state.slots[leaf] for leaf in found}
    letters = {node: letter for node, letter in given.letters.items() if node not in unused}
    return SymbolicState(replace(given.state, slots={**given.state.slots, **found}), letters)


def begins_along(mechanism: Mechanism, given: SymbolicState, forms: ClosedForms) -> bool:
    """Return whether every slide that begins in space stays along its direction, whatever the parameters are."""
    acting = ActingForces.at(StateQuantities(motion_of(mechanism, given.state), *unknowns(mechanism)))
    for sliding in _starting_slides(mechanism):
        assert sliding.starts is not None
        rates = [as_node(acting.acceleration(row)) for row in sliding.rows]
        pairs = combinations(zip(rates, given.state.values(sliding.starts), strict=True), 2)
        try:
            if not all(x.is_zero for x in forms.of([a * beside - b * along for (a, along), (b, beside) in pairs])):
                return False
        except NoClosedFormError:
            return False
    return True


def _smooth_direction(mechanism: Mechanism, given: SymbolicState, sliding: Sliding) -> list[Node]:
    """Return the direction in which a slide would begin without friction; empty without a closed form."""
    variant = with_coefficients(mechanism, lambda _: ZERO)
    acting = ActingForces.at(StateQuantities(motion_of(variant, given.state), *unknowns(variant)))
    try:
        forms = closed_forms(variant, given)
        rates = [book_form(x) for x in forms.of(as_node(acting.acceleration(row)) for row in sliding.rows)]
    except (NoClosedFormError, ExpressionError):
        return []
    length = functions.sqrt(sum((a * a for a in rates), ZERO))
    return [a / length for a in rates]


def _starting_slides(mechanism: Mechanism) -> Iterator[Sliding]:
    for row in mechanism.rows:
        for sliding in row.sliding:
            if sliding.starts is not None:
                yield sliding
