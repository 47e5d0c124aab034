"""Closed forms at one state: accelerations, multipliers and whatever depends on them, in the names of the model.

The equations of motion are formed over Nodes with what is known of the state put in, and solved over exact quotients:

    M udot - C^T lambda = f        H udot + D lambda = gamma

C is H where nothing slides, and D is zero but for rows that define forces.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from multibody_sym.algebra.exact_solve import exact_solve
from multibody_sym.algebra.quotient_functions import absolute, exact, register_angles, sqrt
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.inverse_dynamics import inverse_dynamics
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, as_node, slot

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
        """Return how much multiplier a row's a = H udot - gamma takes by itself, all other rows satisfied.

        That is 1 over the apparent mass that it meets, the other way round: a pivot of the equations.
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
        return _solved(mechanism, given, Field(WORK), *equations, vectors)
    except NoClosedFormError:
        return _solved(mechanism, given, Field(WORK, expands=True), *equations, vectors)


def _solved(
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

    All have the column of w in the first equations, those of the speeds; all else is linear in w, and they themselves
    are a + b w: w = |a + b w| with its positive root, where |b| < 1.
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
    """Return the w > 0 with w = |a + b w|. Raises NoClosedFormError where nothing presses, or it grows with itself."""
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
    applied_forces = applied_generalized_forces(motion, applied(motion))
    velocity_terms = inverse_dynamics(motion, [0] * len(applied_forces))
    forcing = [q - c for q, c in zip(applied_forces, velocity_terms, strict=True)]
    return [*upper, *lower], [*forcing, *(h.gamma for h in rows)]
