"""What closes loops, over letters: equations between positions or speeds, and the forces that hold them.

A joint that was cut closes by the components in space of what its points are apart, whichever axes its rows have.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.quotient_functions import exact_solve
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.instant.letters import (
    TIME,
    Absolute,
    Coordinates,
    Letters,
    acceleration_names,
    letters_of_start,
    put_in,
)
from multibody_sym.answers.records import Definition
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics, mass_matrix
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, accelerations
from multibody_sym.mechanics.points import direction, position
from multibody_sym.mechanics.row_kinematics import row_motion
from multibody_sym.mechanics.row_records import DistanceRow, PositionRow, Row
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import gradient, tangents
from multibody_sym.scalars.elementary import flatten, leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, symbol
from multibody_sym.scalars.rank import CLOSED, rank
from multibody_sym.scalars.vectors import Vec, dot, subtract
from multibody_sym.text.printer import text

_AXES: Final = "xyz"
MOST_DEPENDENT: Final = 5
"""How many places at most loops decide in formulas that are read."""
_LARGEST_BLOCK: Final = 3
"""How many equations at most are looked for that have as many unknowns."""


@dataclass(frozen=True)
class Closing:
    """An equation: `zero`, of positions (`holonomic`) or of speeds; times `factor` its rates are those of a row.

    `force` is the letter of what holds it, a force or moment as that of the row, and `says` what that is.
    """

    zero: Node
    force: Node
    says: str
    unit: str
    holonomic: bool = True
    factor: Node = ONE


def closings(motion: Motion, name: Callable[[str], Node]) -> tuple[list[Closing], list[Node]]:
    """Return the equations of a mechanism's rows, and the multiplier of each row over their forces.

    `name` gives free letters. Raises NoClosedFormError for rows that define forces or rub.
    """
    found: list[Closing] = []
    multipliers: list[Node] = []
    rows = motion.mechanism.rows
    bias = accelerations(motion, [0] * len(motion.state.u))
    spread: dict[object, list[Closing]] = {}
    for row in rows:
        if not row.restricts or row.sliding:
            raise NoClosedFormError("forces that rub or press in loops are numbers")
        together = [x for x in rows if isinstance(x, PositionRow) and x.frames == row.points]
        if isinstance(row, PositionRow) and len(together) == len(_AXES):  # they hold a point in all directions
            own = spread.get(row.frames)
            if own is None:
                element = row.name.rpartition(".")[0] or row.name
                apart = subtract(position(motion, row.frames[1]), position(motion, row.frames[0]))
                own = spread[row.frames] = [
                    Closing(as_node(x), name(f"{element}_{axis}"), f"force of {element} along {axis} of ground", "N")
                    for axis, x in zip(_AXES, apart, strict=True)
                ]
                found += own
            along = direction(motion, row.frames[0], row.axis)
            multipliers.append(as_node(sum((x * e for x, e in zip([c.force for c in own], along, strict=False)), ZERO)))
            continue
        closing = _closing_of(motion, row, name(f"force_{row.name}"), bias)
        found.append(closing)
        multipliers.append(closing.force)
    return found, multipliers


def _closing_of(motion: Motion, row: Row, force: Node, bias: Sequence[tuple[Vec, Vec]]) -> Closing:
    if isinstance(row, DistanceRow) and row.straight is None:
        apart = subtract(position(motion, row.ends[1]), position(motion, row.ends[0]))
        (length,) = motion.state.values([row.value])
        zero = (dot(apart, apart) - length * length) / 2
        return Closing(as_node(zero), force, f"tension of {row.name}", "N", factor=-1 / as_node(length))
    moved = row_motion(row, motion, bias)
    return Closing(as_node(moved.zero), force, f"force of {row.name}", row.unit or "", moved.holonomic)


class Loops:
    """The closings that are independent at the start, solved one after the other: each block for its own places.

    `free` and `dependent` places are those of `Coordinates.all`; a block of closings has as many places that no block
    before it has. Raises NoClosedFormError where formulas grow too long.
    """

    def __init__(
        self, coordinates: Coordinates, letters: Letters, assembled: Sequence[str], name: Callable[[str], Node]
    ) -> None:
        self.letters = letters
        found, self.multipliers = closings(coordinates.motion, name)
        self._rates = coordinates.rates
        self._places = [x.letters[0] for x in coordinates.all]
        self._turning = [x.letters[1] for x in coordinates.all]
        found = [replace(x, zero=letters.simplified(x.zero)) for x in found]
        rows = [self._row(x) for x in found]
        sizes = np.array([[float(a.sample) for a in row] for row in rows]).reshape(len(rows), len(self._places))
        kept = _independent_rows(sizes)
        self.closings = [found[k] for k in kept]
        self.jacobian = [rows[k] for k in kept]
        names = [coordinates.mechanism.speeds[x.u].name for x in coordinates.all]
        order = sorted(range(len(names)), key=lambda k: (names[k] not in assembled, -k))
        self.dependent = sorted(order[k] for k in _independent_rows(sizes[kept].T[order]))
        if len(self.dependent) > MOST_DEPENDENT:
            raise NoClosedFormError("loops have more parts than anyone reads formulas of")
        self.free = [k for k in range(len(names)) if k not in self.dependent]
        self.blocks = self._blocks()

    def _row(self, closing: Closing) -> list[Quotient]:
        along = self._places if closing.holonomic else self._turning
        return self.letters.of(gradient(closing.zero, along))

    def _blocks(self) -> list[tuple[list[int], list[int]]]:
        """Return the closings and the places of each block, the smallest that can be solved first."""
        found: list[tuple[list[int], list[int]]] = []
        rows, known = list(range(len(self.jacobian))), set(self.free)
        while rows:
            sizes = range(1, min(len(rows), _LARGEST_BLOCK) + 1)
            tried = (list(x) for size in sizes for x in combinations(rows, size))
            block = next((x for x in tried if len(self._unknown(x, known)) == len(x)), rows)
            places = self._unknown(block, known)
            found.append((block, places))
            rows = [row for row in rows if row not in block]
            known.update(places)
        return found

    def _unknown(self, rows: Sequence[int], known: Collection[int]) -> list[int]:
        return [k for k in self.dependent if k not in known and any(not self.jacobian[row][k].is_zero for row in rows)]

    def solved(
        self, free: Mapping[int, Quotient], right: Sequence[Quotient], told: Callable[[int, Quotient], Quotient]
    ) -> None:
        """Find what the dependent places must be for the closings to come to the right sides.

        Each is `told` as soon as it is found, and stands in the others as what that returns.
        """
        known = dict(free)
        for rows, places in self.blocks:
            matrix = [[self.jacobian[row][k] for k in places] for row in rows]
            found = exact_solve(matrix, [self._less(right[row], self.jacobian[row], known) for row in rows])
            known.update((k, told(k, x)) for k, x in zip(places, found, strict=True))

    @staticmethod
    def _less(right: Quotient, row: Sequence[Quotient], known: Mapping[int, Quotient]) -> Quotient:
        for k, x in known.items():
            right = right - row[k] * x
        return right

    @cached_property
    def drift(self) -> list[Quotient]:
        """The right sides for speeds."""
        rates = tangents([x.zero for x in self.closings], {TIME: ONE})
        at_rest = dict.fromkeys(self._turning, ZERO)
        still = [
            rate if x.holonomic else put_in(x.zero, at_rest) for x, rate in zip(self.closings, rates, strict=True)
        ]
        return [-x for x in self.letters.of(still)]

    @cached_property
    def bias(self) -> list[Quotient]:
        """The right sides for accelerations."""
        rates = tangents([x.zero for x in self.closings], self._rates)
        moving = [rate if x.holonomic else x.zero for x, rate in zip(self.closings, rates, strict=True)]
        return [-x for x in self.letters.of(tangents(moving, self._rates))]

    @property
    def nothing(self) -> list[Quotient]:
        """Right sides that are zero."""
        return [self.letters.field.constant(0)] * len(self.closings)

    def forces(self, wanted: Mapping[int, Quotient], told: Callable[[Closing, Quotient], Quotient]) -> None:
        """Find the forces of the closings that give generalised forces at the dependent places, the last ones first.

        Each is `told` as soon as it is found, and stands in the others as what that returns.
        """
        factors = self.letters.of([x.factor for x in self.closings])
        known: dict[int, Quotient] = {}
        for rows, places in reversed(self.blocks):
            matrix = [[self.jacobian[row][k] * factors[row] for row in rows] for k in places]
            right = []
            for k in places:
                column = {row: self.jacobian[row][k] * factors[row] for row in known}
                right.append(self._less(wanted[k], [column.get(row, wanted[k]) for row in range(len(factors))], known))
            found = exact_solve(matrix, right)
            known.update((row, told(self.closings[row], x)) for row, x in zip(rows, found, strict=True))


def _independent_rows(rows: Floats) -> list[int]:
    found: list[int] = []
    for k in range(len(rows)):
        if rank(rows[[*found, k]], CLOSED) == len(found) + 1:
            found.append(k)
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Coordinates that loops decide: by a formula where one equation alone gives one, else by the equations of closure.


Found = tuple[Node | None, tuple[Node, Node] | None]
"""An expression, or the two sides of an equation."""
_NEAR: Final = 1e-10


def _alone(
    letters: Letters, waiting: Sequence[Absolute], left: Sequence[Quotient]
) -> Iterator[tuple[Absolute, Quotient, Node]]:
    """Yield what one equation alone gives, as an expression of what is known by then."""
    unknown = {x.letters[0] for x in waiting}
    for equation in left:
        there = [x for x in waiting if x.letters[0] in equation.symbols & unknown]
        if len(there) != 1:
            continue
        (x,) = there
        try:
            for root in roots(equation, x.letters[0]):
                if abs(evaluate_float([root], letters.values)[0] - letters.values[x.letters[0]]) <= _NEAR:
                    yield x, equation, root
        except (NoClosedFormError, ExpressionError, KeyError, *UNDEFINED):
            continue


# ----------------------------------------------------------------------------------------------------------------------
# The equations of motion over letters, reduced to the freedoms: J a = Q, with what each body turns or moves for them.
#
# J_ij = sum K_ai M_ab K_bj,  Q_i = sum K_ai (f_a - M_ab c_b),  where a = K a_free + c is what the loops leave.


_SHORT: Final = 12
"""Up to how many letters of text a ratio stands itself in what is reduced."""
_SHORT_ANSWER: Final = 80
"""Up to how many letters of text an answer has speeds put in."""


@dataclass
class ReducedEquations:
    """The equations at the places of `coordinates.all`; `name` gives free letters, `define` keeps what they are."""

    coordinates: Coordinates
    letters: Letters
    loops: Loops
    name: Callable[[str], Node]
    define: Callable[[Node, Definition], None]

    @cached_property
    def matrix(self) -> list[list[Quotient]]:
        """M between the letters of accelerations."""
        letters, rows = self.letters, mass_matrix(self.coordinates.motion)
        turned, _ = self._changes
        given, zero = [letters.of(row) for row in rows], letters.field.constant(0)
        return [
            [sum((given[k][j] * (m * n) for k, m in a.items() for j, n in b.items()), zero) for b in turned]
            for a in turned
        ]

    @cached_property
    def forcing(self) -> list[Quotient]:
        """F less what inertia takes without the accelerations of letters."""
        motion, letters = self.coordinates.motion, self.letters
        turned, rest = self._changes
        needed = inverse_dynamics(motion, rest)
        forces = applied_generalized_forces(motion, applied_forces(motion))
        left = letters.of(as_node(q) - as_node(c) for q, c in zip(forces, needed, strict=True))
        zero = letters.field.constant(0)
        return [sum((left[k] * n for k, n in column.items()), zero) for column in turned]

    @cached_property
    def _changes(self) -> tuple[list[dict[int, int]], list[Node]]:
        """How much of each letter's acceleration is in which speed's rate, and what is in those without letters."""
        along = [x.letters[2] for x in self.coordinates.all]
        parts = [gradient(node, along) for node in self.coordinates.udot]
        columns = [
            {k: int(row[j].shadow or 0) for k, row in enumerate(parts) if row[j] is not ZERO} for j in range(len(along))
        ]
        at_rest = dict.fromkeys(along, ZERO)
        rest = [as_node(evaluate([x], lambda n: at_rest.get(n, n))[0]) for x in self.coordinates.udot]
        return columns, rest

    def of_freedoms(self) -> dict[int, Quotient]:
        """Return the accelerations at the free places; letters that are needed for them are defined."""
        free, ratios, bias = self.loops.free, self._ratios(), self._bias()
        places, zero = range(len(self.coordinates.all)), self.letters.field.constant(0)
        lacking = [self.forcing[a] - sum((self.matrix[a][b] * x for b, x in bias.items()), zero) for a in places]
        left, right = [], []
        for i in free:
            name = self._free_name(i)
            of = {a: sum((x[i] * self.matrix[a][b] for b, x in enumerate(ratios) if i in x), zero) for a in places}
            sums = {j: sum((x[j] * of[a] for a, x in enumerate(ratios) if j in x), zero) for j in free}
            left.append([self._named(x, self._inertia(i, j), f"inertia that {name} meets") for j, x in sums.items()])
            force = sum((x[i] * lacking[a] for a, x in enumerate(ratios) if i in x), zero)
            right.append(self._named(force, f"Q_{name}", f"what drives {name}: loads, less inertia at steady {name}"))
        return dict(zip(free, exact_solve(left, right), strict=True))

    def _free_name(self, place: int) -> str:
        return self.coordinates.mechanism.coordinates[self.coordinates.all[place].q].name

    def _inertia(self, i: int, j: int) -> str:
        return "_".join(("J", *dict.fromkeys((self._free_name(i), self._free_name(j)))))

    def _ratios(self) -> list[dict[int, Quotient]]:
        """Return how each place moves with each free one, in letters where that is long."""
        one, zero = self.letters.field.constant(1), self.letters.field.constant(0)
        found: list[dict[int, Quotient]] = [{} for _ in self.coordinates.all]
        for i in self.loops.free:
            found[i][i] = one
            of = self._free_name(i)

            def told(k: int, x: Quotient, i: int = i, of: str = of) -> Quotient:
                body = self.coordinates.all[k].body
                wanted = f"k_{body}" if len(self.loops.free) == 1 else f"k_{body}_{of}"
                kept = self._named(x, wanted, f"how fast {body} moves for a unit speed of {of}")
                if not x.is_zero:
                    found[k][i] = kept
                return kept

            self.loops.solved({j: one if j == i else zero for j in self.loops.free}, self.loops.nothing, told)
        return found

    def _bias(self) -> dict[int, Quotient]:
        """Return the accelerations for none at the free places."""
        zero, found = self.letters.field.constant(0), dict[int, Quotient]()

        def told(k: int, x: Quotient) -> Quotient:
            body = self.coordinates.all[k].body
            kept = self._named(x, f"c_{body}", f"acceleration of {body} where what is free moves steadily")
            if not x.is_zero:
                found[k] = kept
            return kept

        self.loops.solved(dict.fromkeys(self.loops.free, zero), self.loops.bias, told)
        return found

    def _named(self, x: Quotient, wanted: str, says: str) -> Quotient:
        form = self.letters.written(x)
        if len(text(form)) <= _SHORT:
            return x
        node = self.name(wanted)
        self.letters.add(node, float(x.sample))
        self.define(node, Definition(float(x.sample), form, says=says))
        return self.letters.known[node]


# ----------------------------------------------------------------------------------------------------------------------
# Formulas of a start whose loops leave none in what is given alone: in letters, each with what it stands for.
#
# What is asked for is written in coordinates, speeds, accelerations and forces, as far as it names them. Coordinates
# that follow are given by the loops' closure, their speeds and accelerations by its rates, those of the freedoms by
# the equation of motion reduced to them, and forces by what then moves.


class InLetters:
    """What is asked for at a start, in letters; `definitions` say what they stand for, by symbol.

    Raises NoClosedFormError where no loop is closed, speeds are no rates of coordinates, or formulas grow too long.
    """

    def __init__(self, mechanism: Mechanism, symbolic: SymbolicState, begin: Start, numbers: StateQuantities) -> None:
        if not mechanism.rows or mechanism.one_way or mechanism.impact is not None:
            raise NoClosedFormError("no loop is closed, or what holds one way only may close it")
        self._taken = {str(name.data) for name in (*mechanism.symbols, *symbolic.letters)}
        names = [free_name(f"a_{name}", self._taken) for name in acceleration_names(mechanism)]
        self._taken.update(names)
        self.coordinates = Coordinates(mechanism, symbolic, names)
        if not self.coordinates.plain:
            raise NoClosedFormError("speeds are no rates of coordinates")
        self.letters, self.definitions = letters_of_start(self.coordinates, begin, numbers.udot)
        self._units = MechanismUnits(mechanism)
        self._turning: dict[tuple[str, str], Node] = {}
        self.loops = Loops(self.coordinates, self.letters, begin.assembled, self._name)
        self.reduced = ReducedEquations(self.coordinates, self.letters, self.loops, self._name, self._keep)
        self._of_positions()
        self._of_speeds()

    def _name(self, wanted: str) -> Node:
        found = free_name(wanted, self._taken)
        self._taken.add(found)
        return symbol(found)

    def _keep(self, node: Node, found: Definition) -> None:
        self.definitions[node] = found

    # --- what letters stand for -----------------------------------------------------------------------------------

    def _of_positions(self) -> None:
        wanted = [self.coordinates.all[k] for k in self.loops.dependent]
        wanted = [x for x in wanted if x.own[0] in self.definitions]
        zeros = [x.zero for x in self.loops.closings if x.holonomic]
        places: dict[Node, Found] = {}
        waiting, left = list(wanted), list(self.letters.of(zeros))
        while (next_one := next(_alone(self.letters, waiting, left), None)) is not None:
            x, equation, root = next_one
            (value,) = self.letters.of([x.sense * (root - x.before[0])])
            places[x.own[0]] = self.letters.written(value), None
            waiting.remove(x)
            left.remove(equation)
        for x in waiting:
            its_own = next((e for e in left if x.letters[0] in e.symbols), None)
            if its_own is not None:
                left.remove(its_own)
                zero = self.letters.written(its_own)
                terms = flatten("add", zero.args[0] if zero.op == "neg" else zero)
                plus, minus = [t for t in terms if t.op != "neg"], [t.args[0] for t in terms if t.op == "neg"]
                sides = (plus, minus) if plus else (minus, plus)
                places[x.own[0]] = None, (sum(sides[0], ZERO), sum(sides[1], ZERO))
        for node, (expression, sides_of_closure) in places.items():
            known = self.definitions[node]
            self._keep(node, Definition(known.value, expression, sides_of_closure, known.unit))

    def _of_speeds(self) -> None:
        known, every = self.letters.known, self.coordinates.all

        def told(k: int, found: Quotient) -> Quotient:
            x = every[k]
            unit = self.coordinates.mechanism.speeds[x.u].unit
            own = (found - self.letters.of([x.before[1]])[0]) * x.sense
            self._keep_turning("angular_velocity", x, found)
            if found.is_zero:
                known[x.letters[1]] = found
            self._keep(x.own[1], Definition(self.letters.values[x.own[1]], self.letters.written(own), unit=unit))
            return known[x.letters[1]]

        self.loops.solved({i: known[every[i].letters[1]] for i in self.loops.free}, self.loops.drift, told)

    def _of_accelerations(self) -> None:
        """Define the accelerations: those of the freedoms by the reduced equations, the others by theirs."""
        known, every = self.letters.known, self.coordinates.all

        def told(k: int, found: Quotient) -> Quotient:
            x = every[k]
            unit = self._units.accelerations[self.coordinates.mechanism.speeds[x.u].name]
            form = self._form((found - self.letters.of([x.before[2]])[0]) * x.sense)
            self._keep_turning("angular_acceleration", x, found)
            if found.is_zero:
                known[x.letters[2]] = found
            self._keep(x.own[2], Definition(self.letters.values[x.own[2]], form, unit=unit))
            return known[x.letters[2]]

        with suppress(NoClosedFormError, ExpressionError):
            self.loops.solved({i: known[every[i].letters[2]] for i in self.loops.free}, self.loops.bias, told)
        self.letters.renew()
        with suppress(NoClosedFormError, ExpressionError):
            for k, x in self.reduced.of_freedoms().items():
                told(k, x)

    def _keep_turning(self, quantity: str, x: Absolute, found: Quotient) -> None:
        """Keep how a body turns in the plane, where that is what a letter stands for."""
        is_angle = self.coordinates.mechanism.coordinates[x.q].unit == "rad"
        form = self._form(found) if is_angle and found.symbols else None
        if form is not None:
            self._turning[quantity, x.body] = form

    def turning(self, quantity: str, body: str) -> Node | None:
        """Return the angular velocity or acceleration of a body; None where loops do not decide it."""
        self.instant  # noqa: B018 - defines the accelerations
        return self._turning.get((quantity, body))

    def _of_forces(self) -> None:
        """Define the forces of the closings; those that follow from others do not count."""
        letters = self.letters
        letters.renew()
        kept = {x.force for x in self.loops.closings}
        for leaf in leaves(self.loops.multipliers, "symbol"):
            if leaf not in kept and leaf not in letters.known:
                letters.known[leaf] = letters.field.constant(0)

        def told(closing: Closing, found: Quotient) -> Quotient:
            value = float(found.sample)
            form = self.letters.written(found)
            if found.is_zero:
                letters.known[closing.force] = found
            else:
                letters.add(closing.force, value)
                self._keep(closing.force, Definition(value, form, unit=closing.unit, says=closing.says))
            return letters.known[closing.force]

        with suppress(NoClosedFormError, ExpressionError):
            moved = [letters.known[x.letters[2]] for x in self.coordinates.all]
            matrix, forcing = self.reduced.matrix, self.reduced.forcing
            wanted = {
                k: sum((m * a for m, a in zip(matrix[k], moved, strict=True)), -forcing[k])
                for k in self.loops.dependent
            }
            self.loops.forces(wanted, told)

    def _form(self, found: Quotient) -> Node | None:
        try:
            return self.letters.written(found)
        except NoClosedFormError:
            return None

    # --- what is asked for ----------------------------------------------------------------------------------------

    @cached_property
    def instant(self) -> StateQuantities:
        """The start over letters, all of which have their definitions by then."""
        self._of_accelerations()
        self._of_forces()
        return StateQuantities(self.coordinates.motion, self.coordinates.udot, self.loops.multipliers)

    def of(self, asked: Callable[[StateQuantities], Mapping[str, Any]], name: str) -> Node | None:
        """Return what is asked for, in letters all of which are defined; None where it is too long."""
        instant = self.instant
        self.letters.renew()
        try:
            found = self.letters.written(self.letters.of([asked(instant)[name]])[0])
        except (NoClosedFormError, ExpressionError, KeyError):
            return None
        if found in self.definitions:
            alone = self.definitions[found].expression
            if alone is None:
                return None
            found = alone
        return found if self.defined(found) else None

    def without(self, form: Node, speeds: Collection[Node]) -> Node:
        """Return a form with the formulas of speeds put in, where that leaves it short; else the form."""
        known = {x: self.definitions[x].expression for x in leaves([form], "symbol") if x in speeds}
        if not known or any(value is None for value in known.values()):
            return form
        node, letters = put_in(form, {x: as_node(value) for x, value in known.items()}), Letters({})
        for x in leaves([node], "symbol"):
            letters.add(x, self.letters.values[x], self.coordinates.symbolic.letters.get(x))
        try:
            found = letters.written(letters.of([node])[0])
        except (NoClosedFormError, ExpressionError):
            return form
        return found if len(text(found)) <= _SHORT_ANSWER else form

    def defined(self, form: Node) -> bool:
        """Return whether all letters of a form, and of their definitions, are given by something."""
        return all(self.definitions[x].formula or x in self._given for x in self.needed([form]))

    @cached_property
    def _given(self) -> set[Node]:
        """What is told as a number: coordinates, speeds and accelerations of the freedoms."""
        return {node for i in self.loops.free for node in self.coordinates.all[i].own}

    def needed(self, forms: Any) -> dict[Node, Definition]:
        """Return the definitions of all letters that forms name, and of those that these name."""
        found: dict[Node, None] = {}
        waiting = list(leaves(forms, "symbol"))
        while waiting:
            node = waiting.pop()
            if node in found or node not in self.definitions:
                continue
            found[node] = None
            one = self.definitions[node]
            parts = [one.expression] if one.expression is not None else list(one.equation or ())
            waiting += leaves(parts, "symbol")
        return {node: one for node, one in self.definitions.items() if node in found}


class LetteredStart:
    """The formulas in letters of a start, made when they are first asked for; without a start there are none."""

    def __init__(self, *made_of: Any) -> None:
        self._made_of = made_of

    @cached_property
    def found(self) -> InLetters | None:
        """The formulas; None where no loops are closed, what holds one way only is among them, or all grow too long."""
        try:
            return InLetters(*self._made_of) if self._made_of else None
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None
