"""Closed forms at one state: accelerations, multipliers and whatever depends on them, in the names of the model.

The equations of motion are formed over Nodes with what is known of the state put in, and solved over exact quotients:

    M udot - C^T lambda = f        H udot + D lambda = gamma

C is H where nothing slides, and D is zero but for rows that define forces.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from multibody_sym.algebra.exact_solve import exact_solve
from multibody_sym.algebra.quotient_functions import exact, register_angles
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.inverse_dynamics import inverse_dynamics
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.model.mechanism.mechanism import Mechanism
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
    matrix, right = linear_equations(motion_of(mechanism, given.state))
    try:
        return _solved(mechanism, given, Field(WORK), matrix, right)
    except NoClosedFormError:
        return _solved(mechanism, given, Field(WORK, expands=True), matrix, right)


def _solved(
    mechanism: Mechanism, given: SymbolicState, field: Field, matrix: list[list[Node]], right: list[Node]
) -> ClosedForms:
    known = {node: field.letter(node, letter) for node, letter in given.letters.items()}
    register_angles(field, [as_node(x) for x in (*(x for row in matrix for x in row), *right)], known)
    rows = [exact(field, [as_node(x) for x in (*row, r)], known) for row, r in zip(matrix, right, strict=True)]
    left = [row[:-1] for row in rows]
    solved = exact_solve(left, [row[-1] for row in rows]) if rows else []
    udot, multipliers = unknowns(mechanism)
    known.update(zip((*udot, *multipliers), solved, strict=True))
    return ClosedForms(field, solved[: len(udot)], solved[len(udot) :], known, left)


def linear_equations(motion: Motion) -> tuple[list[list[Node]], list[Node]]:
    """Return the matrix [[M, -C^T], [H, D]] and the right side (f, gamma) over Nodes; M itself may be singular."""
    rows = row_motions(motion)
    upper = [[*row, *(-h.forces[k] for h in rows)] for k, row in enumerate(mass_matrix(motion))]
    lower = [[*h.jacobian, *(h.coupling.get(k, 0) for k in range(len(rows)))] for h in rows]
    applied_forces = applied_generalized_forces(motion, applied(motion))
    velocity_terms = inverse_dynamics(motion, [0] * len(applied_forces))
    forcing = [q - c for q, c in zip(applied_forces, velocity_terms, strict=True)]
    return [*upper, *lower], [*forcing, *(h.gamma for h in rows)]
