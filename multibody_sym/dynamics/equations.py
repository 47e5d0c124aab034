"""EquationsOfMotion: what every formalism that forms a mass matrix returns, over any scalar.

    M udot = Q - c + H^T lambda        H udot = gamma        qdot = N u
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from multibody_sym.kinematics.motion import Motion, coordinate_rates
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.kinematics.vectors import S


@dataclass(frozen=True)
class EquationsOfMotion:
    """The equations of motion at a state; n speeds, s rows.

    `mass_matrix` M (n x n), `applied` Q (n), `velocity_terms` c (n), `rows` (s) with H_j and gamma_j, `rates` qdot.
    `coordinates`, `speeds` and `row_names` name what the numbers belong to.
    """

    mass_matrix: list[list[S]]
    applied: list[S]
    velocity_terms: list[S]
    rows: list[RowMotion]
    rates: list[S]
    coordinates: tuple[str, ...]
    speeds: tuple[str, ...]
    row_names: tuple[str, ...]

    @property
    def forcing(self) -> list[S]:
        """f = Q - c (n)."""
        return [q - c for q, c in zip(self.applied, self.velocity_terms, strict=True)]

    @property
    def constraint_jacobian(self) -> list[list[S]]:
        """H (s x n)."""
        return [row.jacobian for row in self.rows]

    @property
    def constraint_forcing(self) -> list[S]:
        """gamma (s)."""
        return [row.gamma for row in self.rows]


def equations(
    motion: Motion, mass_matrix: list[list[S]], applied: Sequence[S], velocity_terms: Sequence[S], rows: list[RowMotion]
) -> EquationsOfMotion:
    """Return the equations of motion of a mechanism at a state, with the names it declares."""
    mechanism, state = motion.mechanism, motion.state
    return EquationsOfMotion(
        mass_matrix,
        list(applied),
        list(velocity_terms),
        rows,
        coordinate_rates(mechanism, state.q, state.u),
        tuple(c.name for c in mechanism.coordinates),
        tuple(s.name for s in mechanism.speeds),
        tuple(row.name for row in mechanism.rows),
    )
