"""What every formalism returns, over any scalar: the equations of motion, with or without the mass matrix itself.

M udot = Q - c + H^T lambda        H udot = gamma        qdot = N u
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Protocol

from multibody_sym.dynamics.formalisms.massless import completed_forces, completed_matrix
from multibody_sym.kinematics.motion import Motion, coordinate_rates
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.ldl import factorized
from multibody_sym.scalars.vectors import S


class MassFactors(Protocol):
    """A factorised mass matrix M = G^T G: what dynamics asks of it, formed or not."""

    def solve(self, right: Sequence[S]) -> list[S]:
        """Return M^-1 right (n)."""

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return G^-T right (n): forces in the coordinates in which the mass matrix is the unit matrix."""

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return G^-1 x (n): accelerations from those coordinates."""


@dataclass(frozen=True)
class Friction:
    """Equations M udot = f + C^T lambda, H udot + D lambda = gamma with other forces than H^T lambda.

    `exerts` C (s x n) and `coupling` D (s x s). Rows that go `beside` others exert theirs times their part of the
    direction of the vector that all their multipliers make.
    """

    exerts: list[list[S]]
    coupling: list[list[S]]
    beside: Mapping[int, tuple[int, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class TreeDynamics:
    """The dynamics at a state; n speeds, s rows.

    `factors` apply M^-1; `forcing` f = Q - c (n), `rows` (s) with H_j and gamma_j, `rates` qdot. `coordinates`,
    `speeds` and `row_names` name what the numbers belong to.
    """

    factors: MassFactors
    forcing: list[S]
    rows: list[RowMotion]
    rates: list[S]
    coordinates: tuple[str, ...]
    speeds: tuple[str, ...]
    row_names: tuple[str, ...]

    @property
    def bias_acceleration(self) -> list[S]:
        """M^-1 f (n): the accelerations without rows."""
        return self.factors.solve(self.forcing)

    @property
    def constraint_jacobian(self) -> list[list[S]]:
        """H (s x n)."""
        return [row.jacobian for row in self.rows]

    @property
    def friction(self) -> Friction | None:
        """What the rows exert, and the forces they define, where not all is H^T lambda; None where it is."""
        if all(row.exerts is None and not row.coupling for row in self.rows):
            return None
        count = range(len(self.rows))
        coupling = [[row.coupling.get(k, 0) for k in count] for row in self.rows]
        beside = {k: row.beside for k, row in enumerate(self.rows) if row.beside}
        return Friction([row.forces for row in self.rows], coupling, beside)

    @property
    def constraint_forcing(self) -> list[S]:
        """gamma (s)."""
        return [row.gamma for row in self.rows]


@dataclass(frozen=True)
class EquationsOfMotion(TreeDynamics):
    """The dynamics with `mass_matrix` M (n x n) formed, and f in parts: `applied` Q (n), `velocity_terms` c (n)."""

    mass_matrix: list[list[S]]
    applied: list[S]
    velocity_terms: list[S]


Formalism = Callable[[Mechanism, State], TreeDynamics]
"""A route from a mechanism to its dynamics at a state, over the state's scalar."""


def equations(
    motion: Motion,
    mass_matrix: list[list[S]],
    applied: Sequence[S],
    velocity_terms: Sequence[S],
    rows: list[RowMotion],
    forcing: Sequence[S] | None = None,
) -> EquationsOfMotion:
    """Return the equations of motion of a mechanism at a state, with the names it declares.

    `forcing` is Q - c where that was found as a whole. Where rows hold freedoms without mass, the equivalent equations
    of `massless`, whose matrix is regular.
    """
    matrix = completed_matrix(motion, mass_matrix, rows)
    forces = list(completed_forces(motion, applied, rows))
    if forcing is None:
        forcing = [q - c for q, c in zip(applied, velocity_terms, strict=True)]
    tree = tree_dynamics(motion, factorized(matrix), list(completed_forces(motion, forcing, rows)), rows)
    return EquationsOfMotion(**vars(tree), mass_matrix=matrix, applied=forces, velocity_terms=list(velocity_terms))


def tree_dynamics(motion: Motion, factors: MassFactors, forcing: list[S], rows: list[RowMotion]) -> TreeDynamics:
    """Return the dynamics of a mechanism at a state, with the names it declares."""
    mechanism, state = motion.mechanism, motion.state
    return TreeDynamics(
        factors,
        forcing,
        rows,
        coordinate_rates(mechanism, state.q, state.u),
        tuple(c.name for c in mechanism.coordinates),
        tuple(s.name for s in mechanism.speeds),
        tuple(row.name for row in mechanism.rows),
    )
