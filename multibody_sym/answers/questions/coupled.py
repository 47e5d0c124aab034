"""Coordinates of coupled linear equations as formulas of time, by normal modes.

    x'' = A x + c,      A = - sum of omega_i^2 P_i       (P_i: what A has of mode i, a product of A + omega_j^2)

    x(t) = sum of P_i x0 cos(omega_i t) + P_i u0 sin(omega_i t)/omega_i + P_i c (1 - cos(omega_i t))/omega_i^2

cosh and sinh stand for modes that grow, x0 + u0 t + c t^2/2 for those that move off.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import doubled, sqrt
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import rate
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted
from multibody_sym.answers.questions.courses import InTime, Shown
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.answers.small_motions.matrices import WORK, Matrices
from multibody_sym.answers.small_motions.spectrum import spectrum
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import TWO, ZERO, Node, add, as_node, divide, multiply, power, symbol

_MOST: Final = 4
"""Coordinates whose equations hang together, and for which this is tried."""


def coupled_formula(solved: Solved, motion: Simulated, name: str) -> InTime | None:
    """Return a coordinate or speed as a formula of time, None where it is not what a run shows.

    Raises NoClosedFormError, which says why there is none.
    """
    shown = Shown.of(solved, motion)
    if shown.there is None:
        raise NoClosedFormError("the equations have no closed form")
    pairs = zip(solved.mechanism.coordinates, solved.mechanism.speeds, strict=False)
    coordinate = next(q.name for q, u in pairs if name in (q.name, u.name))
    signs, granted = shown.there.forms.field.positive, Granted()
    shown.there.forms.field.positive = granted.positive
    formula = coupled_course(shown.there, coordinate)[0 if name == coordinate else 1]
    shown.there.forms.field.positive = signs
    return shown.confirmed({symbol(name): InTime(formula, granted)}).get(symbol(name))


def coupled_course(there: Anywhere, coordinate: str) -> tuple[Node, Node]:
    """Return a coordinate and its speed as formulas of time. Raises NoClosedFormError, which says why it has none."""
    names = [c.name for c in there.solved.mechanism.coordinates]
    if len(names) != len(there.solved.mechanism.speeds):
        raise NoClosedFormError("coordinates have no speeds of their own")
    group = _together(there, names, names.index(coordinate))
    if len(group) > _MOST:
        raise NoClosedFormError(f"{len(group)} equations hang together")
    A, c = _linear(there, names, group)
    course = _course(there, group, A, c, group.index(names.index(coordinate)))
    return course, derivative(course, TIME)


def _together(there: Anywhere, names: Sequence[str], first: int) -> list[int]:
    """Return the places of the coordinates whose equations name each other's, in their order."""
    found = [first]
    for k in found:
        named = there.forms.udot[k].symbols
        found += [j for j, name in enumerate(names) if symbol(name) in named and j not in found]
    return sorted(found)


def _linear(there: Anywhere, names: Sequence[str], group: Sequence[int]) -> tuple[list[list[Quotient]], list[Quotient]]:
    """Return A and c of the accelerations. Raises NoClosedFormError where these are others."""
    there.forms.field.work = max(there.forms.field.work, WORK)
    matrix, constants = [], []
    for k in group:
        acceleration = there.forms.udot[k]
        row = [rate(acceleration, symbol(names[j])) for j in group]
        left = acceleration
        for j, slope in zip(group, row, strict=True):
            left = left - slope * there.forms.known[symbol(names[j])]
        if any(x.symbols & there.variables for x in (*row, left)):
            raise NoClosedFormError("the equations are no x'' = A x + c with constant A and c")
        matrix.append(row)
        constants.append(left)
    return matrix, constants


def _course(
    there: Anywhere, group: Sequence[int], A: list[list[Quotient]], c: list[Quotient], place: int
) -> Node:
    field, state = there.forms.field, there.solved.nodes.motion.state
    one, zero = field.constant(1), field.constant(0)
    size = range(len(group))
    unit = [[one if i == j else zero for j in size] for i in size]
    stiffness = [[-x for x in row] for row in A]
    given = Matrices(field, tuple(size), unit, [[zero] * len(group) for _ in size], stiffness, {}, balanced=True)
    squares = list({root.quotient: None for root in spectrum(given).roots})
    known = [square for square in squares if square is not None]
    if len(known) < len(squares):
        raise NoClosedFormError("the frequencies are no formulas of square roots")
    starts = [there.forms.of([as_node(values[k]) for k in group]) for values in (state.q, state.u)]
    total = ZERO
    for square in known:
        parts = [_part(A, square, known, vector)[place] for vector in (*starts, c)]
        total = add(total, _mode(square, *parts))
    return total


def _part(A: list[list[Quotient]], square: Quotient, squares: list[Quotient], vector: list[Quotient]) -> list[Quotient]:
    """Return what a vector has of the mode with this omega^2."""
    found = vector
    for other in squares:
        if other is not square:
            moved = [sum((a * x for a, x in zip(row, found, strict=True)), other * 0) for row in A]
            found = [(y + other * x) / (other - square) for x, y in zip(found, moved, strict=True)]
    return found


def _mode(square: Quotient, x: Quotient, u: Quotient, c: Quotient) -> Node:
    """Return the motion of one mode from its part of the start."""
    if square.is_zero:
        fallen = multiply(divide(_node(c), TWO), power(TIME, TWO))
        return add(add(_node(x), multiply(_node(u), TIME)), fallen)
    turns = square.sample > 0
    even, odd = (BUILD["cos"], BUILD["sin"]) if turns else (BUILD["cosh"], BUILD["sinh"])
    pace = _root(square if turns else -square)
    middle, phase = c / square, multiply(pace, TIME)
    swing = add(multiply(_node(x - middle), even(phase)), multiply(divide(_node(u), pace), odd(phase)))
    return add(_node(middle), swing) if not middle.is_zero else swing


def _root(square: Quotient) -> Node:
    try:
        return _node(sqrt(square))
    except NoClosedFormError:
        return BUILD["sqrt"](_node(square))


def _node(a: Quotient) -> Node:
    return book_form(doubled(a))


