"""Closed forms of what happens later: moments, values at them and extremes, where numbers have found them already.

Along a course all coordinates and speeds are formulas of one variable: of the time, where equations of motion have
known solutions; else, with one freedom and energy conserved, of the coordinate itself,

    u^2 = 2 (E - V(q)) / M(q),

M being the generalised mass. The value of the variable at the moment is a root near the number that is known.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property, reduce
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import surely_positive
from multibody_sym.algebra.quotient_functions import exact, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient, factors_of
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.courses import InTime, least_conditions
from multibody_sym.answers.ask.named_answers import Anywhere, Granted
from multibody_sym.answers.ask.working import equation, other_times, written
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.answers.instant.letters import TIME, put_in
from multibody_sym.answers.records import Formula, Line
from multibody_sym.derivation.symbolic_start import WORK, ActingForces
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.fields import AXES
from multibody_sym.model.state_words import VERBS, Moment, StateCondition
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import (
    ONE,
    TWO,
    ZERO,
    Node,
    add,
    as_node,
    divide,
    multiply,
    negate,
    quantity,
    subtract,
    symbol,
)
from multibody_sym.scalars.sign_changes import is_condition, switching_function
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Coordinates and speeds as formulas of one variable, and where on such a course something happens.


NO_TIME: Final = "the time has no formula"
_POLISHED: Final = 4
_ZERO: Final = 1e-14
_NEAR: Final = 1e-6
"""How near, relative to its size or 1, a number must be to a root that it is taken for."""


def no_lines(_nodes: Collection[Node]) -> Iterable[Line]:
    """Return no lines: of a course whose law is not written out."""
    return ()


@dataclass(frozen=True, eq=False)
class MotionFormulas:
    """Coordinates and speeds as formulas of one variable, which has the value `at` at the moment.

    `known` gives the formula of each, None where it has none. `turning` vanishes where the speed does, if that is so at
    the moment. `beside`: a value of the variable near by, at which formulas are simplified where they are no fractions
    of zeros; None leaves them as they are. `used` are the formulas put in so far. Values rest on `signs` of moving
    quantities, which say of parameters what `moving` holds.
    """

    there: Anywhere
    variable: Node
    known: Callable[[Node], InTime | None]
    at: float
    turning: Node | None = None
    beside: float | None = None
    used: dict[Node, InTime] = field(default_factory=dict)
    signs: list[Quotient] = field(default_factory=list)
    moving: list[str] = field(default_factory=list)
    law: Callable[[Collection[Node]], Iterable[Line]] = no_lines
    places: list[Line] = field(default_factory=list)
    asked: list[Line] = field(default_factory=list)

    def lines(self) -> Iterator[Line]:
        """Yield the laws that give the formulas used, the place of the moment, and what was asked along the course."""
        yield from self.law(self.used)
        yield from self.asked
        yield from self.places

    def along(self, asked: Node, words: str = "") -> Node:
        """Return an expression of the model, asked for in `words` or by itself, as a formula of the variable.

        Raises NoClosedFormError.
        """
        found = self._along(asked)
        if asked.op != "symbol":
            self.asked[:] = [Formula((found,) if words else (asked, found), before=(words or "along the motion",))]
        return found

    def _along(self, asked: Node) -> Node:
        known = len(self.there.forms.field.positive)
        found = self.there.of(asked)
        self.signs.extend(x for x in self.there.forms.field.positive[known:] if not self.there.constant(x))
        return self.put_in(found)

    def put_in(self, asked: Quotient) -> Node:
        """Return what there is at any state as a formula of the variable. Raises NoClosedFormError."""
        found = book_form(with_whole_angles(asked))
        for node in (x for x in leaves([found], "symbol") if x in self.there.variables - {self.variable}):
            formula = self.known(node)
            if formula is None:
                raise NoClosedFormError("what is asked for depends on a coordinate whose course has no formula")
            self.used[node] = formula
        known = put_in(found, {node: each.formula for node, each in self.used.items()})
        return known if self.beside is None else in_book_form(self.there, known, {self.variable: self.beside})

    def granted(self) -> Iterator[str]:
        """Yield what the formulas of time that were used take for granted of parameters, each once."""
        used = [replace(each, until=None) for each in self.used.values()]
        yield from dict.fromkeys((*(condition for each in used for condition in each.conditions()), *self.moving))

    def place(self, zero: Node, where: str = "at the moment", sides: tuple[Node, Node] | None = None) -> Node:
        """Return the variable's value, near `at`, at which a formula of it vanishes. Raises NoClosedFormError.

        `where` and the `sides` of its equation are how a book writes that.
        """
        solved = self.there.solved
        at = self._polished(zero)
        letters = {**solved.symbolic.letters, self.variable: Letter(self.variable, PRECISE.mpf(at))}
        field = Field(WORK)
        known = {node: field.letter(node, letter) for node, letter in letters.items()}
        (vanishing,) = exact(field, [zero], known)
        every = {root: evaluate_float([root], solved.sample)[0] for root in roots(vanishing, self.variable)}
        for root, value in every.items():
            if abs(value - at) <= AGREEMENT * max(1.0, abs(at)):
                others = {x: y for x, y in every.items() if x is not root and self.variable is TIME}
                so = equation(self.variable, root, "so")
                self.places[:] = equation(*(sides or (zero, ZERO)), where), so, *other_times(at, others)
                return root
        raise NoClosedFormError(f"the moment is a root of no known kind in {self.variable.data}")

    def place_after(self, time: Node) -> Node:
        """Return the variable's value after a time. Raises NoClosedFormError."""
        if self.variable is not TIME:
            raise NoClosedFormError(NO_TIME)
        return time

    def place_when(self, moment: Moment) -> Node:
        """Return the variable's value at a moment. Raises NoClosedFormError."""
        if isinstance(moment, Mapping):
            ((coordinate, value),) = moment.items()
            if self.variable is symbol(coordinate):
                return value
            place = self._along(symbol(coordinate))
            return self.place(subtract(place, value), f"{coordinate} = {text(value)} when", (place, value))
        for vanishing in self._boundaries(moment):
            try:
                return self.place(self.put_in(vanishing))
            except NoClosedFormError:
                continue
        raise NoClosedFormError("the moment has no formula")

    def _boundaries(self, moment: Node | StateCondition) -> Iterator[Quotient]:
        """Yield what vanishes when a condition becomes true, or a state begins. Raises NoClosedFormError."""
        if isinstance(moment, StateCondition):
            yield from self.there.forms.of(begins_where(ActingForces.at(self.there.instant), moment))
            return
        waiting = [moment]
        while waiting:
            node = waiting.pop()
            if node.op in ("min", "max") and is_condition(node):
                waiting.extend(node.args)
            else:
                yield self.there.of(switching_function(node))

    def _polished(self, zero: Node) -> float:
        """Return the root near `at`, to rounding."""
        slope, x = derivative(zero, self.variable), self.at
        sample = self.there.solved.sample
        for _ in range(_POLISHED):
            value, rate = evaluate_float([zero, slope], {**sample, self.variable: x})
            x -= value / rate if rate else 0.0
        if abs(x) <= _ZERO:
            x = 0.0
        if abs(x - self.at) > _NEAR * max(1.0, abs(self.at)):
            raise NoClosedFormError("the formula vanishes elsewhere than the motion shows")
        return x

    def value(self, formula: Node, place: Node) -> Quotient:
        """Return a formula of the variable at a place. Raises NoClosedFormError."""
        field = Field(WORK)
        known = {node: field.letter(node, letter) for node, letter in self.there.solved.symbolic.letters.items()}
        signs = [put_in(self.put_in(sign), {self.variable: place}) for sign in self.signs]
        found, *positive = exact(field, [put_in(formula, {self.variable: place}), *signs], known)
        unsure = [x for x in positive if not surely_positive(field.whole(x.above * x.below))]
        self.moving.extend(map(str, least_conditions(unsure)))
        return found


def in_book_form(there: Anywhere, node: Node, values: Mapping[Node, float]) -> Node:
    """Return an expression of parameters and of what has values near by in its book form. Raises NoClosedFormError."""
    return book_form(with_whole_angles(in_letters(there, node, values)))


def in_letters(there: Anywhere, node: Node, values: Mapping[Node, float]) -> Quotient:
    letters = {**there.solved.symbolic.letters, **{x: Letter(x, PRECISE.mpf(y)) for x, y in values.items()}}
    field = Field(WORK)
    return exact(field, [node], {x: field.letter(x, letter) for x, letter in letters.items()})[0]


# ----------------------------------------------------------------------------------------------------------------------
# Speeds of one freedom as formulas of a coordinate, by the energy that is conserved.
#
#     u^2 = 2 (E - V(q)) / M(q)
#
# M is the generalised mass. Other coordinates follow from the constraints, those at the place that a motion comes to.


_SAME: Final = 1e-6
"""How near a root is to the coordinate that it is taken for."""

State = tuple[Sequence[float], Sequence[float]]


def course_of_energy(there: Anywhere, q: float, u: float) -> MotionFormulas | None:
    """Return the speed of the one freedom by its coordinate, with the sign of u; None where energy does not tell it."""
    mechanism = there.solved.mechanism
    if len(mechanism.coordinates) != 1 or len(mechanism.speeds) != 1 or mechanism.drives:
        return None
    coordinate, speed = symbol(mechanism.coordinates[0].name), symbol(mechanism.speeds[0].name)
    motion, start = there.instant.motion, there.solved.nodes.motion
    energy = as_node(kinetic_energy(start)), as_node(potential_energy(start))
    moving, stored = as_node(kinetic_energy(motion)), as_node(potential_energy(motion))
    mass = multiply(TWO, put_in(moving, {speed: ONE}))
    if mass is ZERO or put_in(moving, {speed: ZERO}) is not ZERO or leaves([mass, stored], "symbol").count(TIME):
        return None
    granted = _energy_kept(there, mass, stored)
    if granted is None:
        return None
    square = divide(multiply(TWO, subtract(add(*energy), stored)), mass)
    along = _root(square, u)
    known = {speed: InTime(along, granted)}
    law = energy_law(there, add(moving, stored), add(*energy), speed, square)
    return MotionFormulas(there, coordinate, known.get, q, square if u == 0.0 else None, used=dict(known), law=law)


def energy_law(
    there: Anywhere, energy: Node, at_start: Node, speed: Node, square: Node, held: Mapping[Node, Node] | None = None
) -> Callable[[Collection[Node]], Iterable[Line]]:
    """Return what yields the conservation of energy, and the square of the speed that follows from it.

    `held`: coordinates that constraints give.
    """

    def lines(_used: Collection[Node]) -> Iterator[Line]:
        for node, place in (held or {}).items():
            yield equation(node, place, "the constraint gives")
        sides = [written(x) for x in there.forms.of([energy, at_start])]
        yield equation(sides[0], sides[1], "energy is conserved")
        root = square if held else written(there.forms.of([square])[0])
        yield equation(multiply(speed, speed), root, "so")

    return lines


def _root(square: Node, u: float) -> Node:
    """Return the speed by its square, with the sign of u."""
    root = BUILD["sqrt"](square)
    return ZERO if u == 0.0 else (root if u > 0.0 else negate(root))


def _energy_kept(there: Anywhere, mass: Node, stored: Node) -> Granted | None:
    """Return what M q'' + M' u^2/2 + V' = 0 takes for granted of parameters, None where it is not so."""
    mechanism, granted = there.solved.mechanism, Granted()
    coordinate, speed = symbol(mechanism.coordinates[0].name), symbol(mechanism.speeds[0].name)
    try:
        slopes = (derivative(mass, coordinate), derivative(stored, coordinate))
        M, growth, slope = there.forms.of([mass, *slopes])
        lost = M * there.forms.udot[0] + growth * there.letter(speed).power(2) / 2 + slope
    except NoClosedFormError:
        return granted
    if lost.is_zero:
        return granted
    factors = (lost.field.whole(lost.field.in_ring(p)) for p, _ in factors_of(lost.above)[1])
    zero = next((x for x in factors if there.constant(x) and granted.vanishes(x)), None)
    return None if zero is None else granted


def courses_on_curve(there: Anywhere, at: State, beside: State) -> Iterator[MotionFormulas]:
    """Yield the courses by each coordinate where constraints leave one freedom to several.

    `at`: coordinates and speeds (n each) at the moment, `beside` those a little before, where all are regular.
    """
    mechanism = there.solved.mechanism
    for k, coordinate in enumerate(mechanism.coordinates):
        with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
            course = _Curve(there, symbol(coordinate.name), beside).course(at[0][k], at[1][k])
            if course is not None:
                yield course


@dataclass(frozen=True)
class _Curve:
    """The curve of positions that constraints allow, by one coordinate, the `variable`, near a state `beside`."""

    there: Anywhere
    variable: Node
    beside: State

    @cached_property
    def names(self) -> tuple[list[Node], list[Node]]:
        """The coordinates and their rates."""
        mechanism = self.there.solved.mechanism
        return [symbol(x.name) for x in mechanism.coordinates], [symbol(x.name) for x in mechanism.speeds]

    @cached_property
    def values(self) -> dict[Node, float]:
        """The values beside the moment."""
        nodes, numbers = (*self.names[0], *self.names[1]), (*self.beside[0], *self.beside[1])
        return dict(zip(nodes, numbers, strict=True))

    @cached_property
    def places(self) -> dict[Node, Node]:
        """The other coordinates as formulas of the variable, as far as one row alone gives each: of those with phi."""
        found: dict[Node, Node] = {}
        waiting = [as_node(row.phi) for row in row_motions(self.there.instant.motion) if row.holonomic]
        while waiting:
            count = len(waiting)
            for zero in list(waiting):
                zero_here = put_in(zero, found)
                unknown = [x for x in leaves([zero_here], "symbol") if x in self.names[0] and x is not self.variable]
                if len(unknown) == 1:
                    found[unknown[0]] = self._place(zero_here, unknown[0])
                    waiting.remove(zero)
            if len(waiting) == count:
                break
        return found

    def _place(self, zero: Node, unknown: Node) -> Node:
        """Return the root of an equation of the variable and one unknown that is near its value."""
        near = {x: self.values[x] for x in (self.variable, unknown)}
        sample = {**self.there.solved.sample, **near}
        for root in roots(in_letters(self.there, zero, near), unknown):
            if abs(evaluate_float([root], sample)[0] - near[unknown]) <= _SAME * max(1.0, abs(near[unknown])):
                return root
        raise NoClosedFormError("a coordinate that constraints hold has no formula of another")

    def course(self, q: float, u: float) -> MotionFormulas | None:
        """Return the course of all by the variable, which has the value q and the rate u at the moment."""
        there, (coordinates, speeds) = self.there, self.names
        speed = speeds[coordinates.index(self.variable)]
        if set(self.places) != set(coordinates) - {self.variable} or there.solved.mechanism.drives:
            return None
        rates = {
            speeds[coordinates.index(x)]: multiply(derivative(place, self.variable), speed)
            for x, place in self.places.items()
        }
        held = {**self.places, **rates}
        motion, start = there.instant.motion, there.solved.nodes.motion
        moving, stored = as_node(kinetic_energy(motion)), as_node(potential_energy(motion))
        if not self._keeps(add(moving, stored), held, speed):
            return None
        mass = multiply(TWO, put_in(put_in(moving, held), {speed: ONE}))
        energy = add(as_node(kinetic_energy(start)), as_node(potential_energy(start)))
        near = {self.variable: self.values[self.variable]}
        square = in_book_form(there, divide(multiply(TWO, subtract(energy, put_in(stored, held))), mass), near)
        along = _root(square, u)
        formulas = {speed: along, **self.places, **{x: put_in(rate, {speed: along}) for x, rate in rates.items()}}
        known = {x: InTime(formula, Granted()) for x, formula in formulas.items()}
        turning = square if u == 0.0 else None
        law = energy_law(there, add(moving, stored), energy, speed, square, self.places)
        beside = near[self.variable]
        return MotionFormulas(there, self.variable, known.get, q, turning, beside, used=dict(known), law=law)

    def _keeps(self, energy: Node, held: Mapping[Node, Node], speed: Node) -> bool:
        """Return whether the energy never changes on the curve, for whatever parameters and at any time."""
        coordinates, speeds = self.names
        rates = (*speeds, *map(as_node, self.there.instant.udot))
        moves = zip((*coordinates, *speeds), rates, strict=True)
        rate = reduce(add, (multiply(derivative(energy, x), moved) for x, moved in moves))
        there = put_in(book_form(self.there.forms.of([rate])[0]), held)
        near = {x: self.values[x] for x in (self.variable, speed)}
        return TIME not in leaves([energy, there], "symbol") and in_letters(self.there, there, near).is_zero


# ----------------------------------------------------------------------------------------------------------------------
# What is asked for, and what vanishes at a moment.


def component_along(function: str, point: str, direction: tuple[Node, ...]) -> Node:
    """Return the component of a quantity of a point along a direction of any length."""
    parts = [multiply(x, quantity(function, (point, axis))) for x, axis in zip(direction, AXES, strict=True)]
    return divide(reduce(add, parts), BUILD["sqrt"](reduce(add, (multiply(x, x) for x in direction))))


_WITHOUT_SLIP: Final = frozenset(word for verb in ("sticks", "rolls", "grips") for word in VERBS[verb])
_WITH_SLIP: Final = frozenset(word for verb in ("slides", "slips") for word in VERBS[verb])
_WITHOUT_FORCE: Final = frozenset(word for verb in ("opens", "slackens", "frees") for word in VERBS[verb])


def begins_where(acting: ActingForces, condition: StateCondition) -> Iterator[Node]:
    """Yield what vanishes where a state begins: a speed of slip, a force of its limit, pressing force, or distance."""
    for element in acting.mechanism.one_way:
        parts = [part for part in element.frictions if condition.element in (element.name, part.name)]
        if _WITHOUT_SLIP.issuperset(condition.words):
            yield from (as_node(acting.row(part.rows[0]).phidot) for part in parts if len(part.rows) == 1)
        elif _WITH_SLIP.issuperset(condition.words):
            for part in (part for part in parts if len(part.rows) == 1):
                force, most = as_node(acting.friction(part)[0]), as_node(acting.most(element, part))
                yield from (subtract(force, most), add(force, most))
        elif condition.element == element.name and element.unilateral:
            opens = _WITHOUT_FORCE.issuperset(condition.words)
            yield as_node(acting.normal(element) if opens else acting.row(element.normals[0]).zero)
