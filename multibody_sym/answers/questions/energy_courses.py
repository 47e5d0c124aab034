"""Speeds of one freedom as formulas of a coordinate, by the energy that is conserved.

    u^2 = 2 (E - V(q)) / M(q)

M is the generalised mass. Other coordinates follow from the constraints, those at the place that a motion comes to.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property, reduce
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.factors import factored
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.algebra.solving.roots import roots
from multibody_sym.answers.questions.along_courses import Course, in_letters, simplified
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted
from multibody_sym.answers.questions.courses import InTime
from multibody_sym.answers.questions.naming import put_in
from multibody_sym.errors import ExpressionError
from multibody_sym.kinematics.energy import kinetic_energy, potential_energy
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
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
    subtract,
    symbol,
)
from multibody_sym.scalars.traversal import leaves

_SAME: Final = 1e-6
"""How near a root is to the coordinate that it is taken for."""

State = tuple[Sequence[float], Sequence[float]]


def course_of_energy(there: Anywhere, q: float, u: float) -> Course | None:
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
    return Course(there, coordinate, known.get, q, square if u == 0.0 else None, used=dict(known))


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
    factors = (lost.field.whole(lost.field.in_ring(p)) for p, _ in factored(lost.above)[1])
    zero = next((x for x in factors if there.constant(x) and granted.vanishes(x)), None)
    return None if zero is None else granted


def courses_on_curve(there: Anywhere, at: State, beside: State) -> Iterator[Course]:
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
        waiting = [as_node(row.phi) for row in row_motions(self.there.instant.motion) if row.phi is not None]
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

    def course(self, q: float, u: float) -> Course | None:
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
        square = simplified(there, divide(multiply(TWO, subtract(energy, put_in(stored, held))), mass), near)
        along = _root(square, u)
        formulas = {speed: along, **self.places, **{x: put_in(rate, {speed: along}) for x, rate in rates.items()}}
        known = {x: InTime(formula, Granted()) for x, formula in formulas.items()}
        turning = square if u == 0.0 else None
        return Course(there, self.variable, known.get, q, turning, near[self.variable], used=dict(known))

    def _keeps(self, energy: Node, held: Mapping[Node, Node], speed: Node) -> bool:
        """Return whether the energy never changes on the curve, for whatever parameters and at any time."""
        coordinates, speeds = self.names
        rates = (*speeds, *map(as_node, self.there.instant.udot))
        moves = zip((*coordinates, *speeds), rates, strict=True)
        rate = reduce(add, (multiply(derivative(energy, x), moved) for x, moved in moves))
        there = put_in(book_form(self.there.forms.of([rate])[0]), held)
        near = {x: self.values[x] for x in (self.variable, speed)}
        return TIME not in leaves([energy, there], "symbol") and in_letters(self.there, there, near).is_zero
