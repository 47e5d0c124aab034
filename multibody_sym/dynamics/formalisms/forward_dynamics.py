"""Forward dynamics in floats: accelerations and multipliers, the reference for every program.

Rows are equalities here. What holds one way only has become such rows in a mode, which `dynamics.laws` finds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.block_ldl import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal, mass_matrix
from multibody_sym.dynamics.formalisms.constrained import Constrained, constrained
from multibody_sym.dynamics.formalisms.equations import Friction, TreeDynamics
from multibody_sym.dynamics.formalisms.massless import completed_matrix, massless_speeds
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.kinematics.joint_forces import along_reactions
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.partial_velocities import locked
from multibody_sym.kinematics.rows import constraint_jacobian, row_motions
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.least_norm import Solution, solve
from multibody_sym.numerics.rank import PIVOT, vanishes
from multibody_sym.records import dataclass

_SETTLED: Final = 1e-6
"""The part of friction's largest force by which one with the direction of the reactions found may differ."""


@dataclass(frozen=True)
class Accelerations:
    """What forward dynamics finds: udot (nu), multipliers (ns), and the solve's report (3).

    `settled`: friction of joints goes along the reactions that were found. It does not where no reactions satisfy its
    law, as where it jams.
    """

    udot: Floats
    multipliers: Floats
    report: Floats
    settled: bool = True


def forward_dynamics(dynamics: TreeDynamics, *, minimum_norm: bool = False) -> Accelerations:
    """Return udot and the multipliers at a state over floats.

    M udot = Q - c + H^T lambda, H udot = gamma. Multipliers of dependent rows are zero, unless those of `minimum_norm`
    are asked for (`shared`).
    """
    if not dynamics.rows:
        return Accelerations(np.array(dynamics.bias_acceleration, dtype=float), np.zeros(0), np.zeros(3))
    rows, gamma = constraint_jacobian(dynamics.rows).tolist(), dynamics.constraint_forcing
    found = constrained(
        dynamics.factors,
        dynamics.forcing,
        rows,
        gamma,
        in_floats,
        minimum_norm=minimum_norm,
        friction=dynamics.friction,
    )
    udot, multipliers, report = (np.array(list(x), dtype=float) for x in (found.udot, found.multipliers, found.report))
    return Accelerations(udot, multipliers, report, _settled(dynamics.friction, found))


def _settled(friction: Friction | None, found: Constrained) -> bool:
    """Return whether friction goes along the reactions that were found with it."""
    if friction is None or found.along is None:
        return True
    along = along_reactions(friction.exerts, friction.beside, found.multipliers)
    multipliers = np.array(found.multipliers, dtype=float)[:, None]
    before, after = (np.array(exerts, dtype=float) * multipliers for exerts in (found.along, along))
    return bool(np.abs(after - before).max() <= _SETTLED * np.abs(before).max())


# --- is there inertia in every direction? ---------------------------------------------------------------------------


def verify_inertia(motion: Motion) -> None:
    """Raise NoSolutionError naming the first speed that neither inertia nor rows resist."""
    massless = massless_speeds(motion.mechanism)
    if not massless and _has_inertia(motion):
        return
    rows = row_motions(motion) if massless else []
    index = speed_without_inertia(completed_matrix(motion, mass_matrix(motion), rows))
    if index is not None:
        speed = motion.mechanism.speeds[index]
        place, body = next((k, body.name) for k, body in enumerate(motion.mechanism.bodies) if index in body.u)
        if mass_diagonal(motion)[index] > 0:
            told = locked(motion, place) if speed.unit == "rad/s" else None
            if told:
                raise NoSolutionError(
                    f"no inertia resists the speed {speed.name} in this position: {told}",
                    where=Where(path=("joints", speed.joint)),
                    number="N102",
                )
            why = f"freedoms beyond joint {speed.joint!r} move what it moves in the same way, at least in this position"
        else:
            why = f"body {body} and what joint {speed.joint!r} moves with it have neither mass nor inertia that way"
        lacking = "a mass" if speed.unit == "m/s" else "an inertia"
        raise NoSolutionError(
            f"no inertia resists the speed {speed.name}: {why}; give body {body} {lacking}, hold the direction by "
            "a constraint, or start from another position",
            where=Where(path=("joints", speed.joint)),
            number="N102",
        )


def _has_inertia(motion: Motion) -> bool:
    """Return whether M has positive pivots beside its diagonal, in time linear in the number of bodies."""
    try:
        factors = tree_factors(motion)
    except ZeroDivisionError:
        return False
    pivots = [freedom.pivot for of_body in factors.freedoms for freedom in of_body]
    tolerance = PIVOT * len(pivots)
    return not any(vanishes(p, d, tolerance) for p, d in zip(pivots, mass_diagonal(motion), strict=True))


def speed_without_inertia(matrix: Sequence[Sequence[float]]) -> int | None:
    """Return the speed at which M = L^T D L meets a pivot that is not positive beside its own diagonal element."""
    m = np.array(matrix, dtype=float).reshape(len(matrix), len(matrix))
    diagonal = m.diagonal().copy()
    for k in range(len(m) - 1, -1, -1):
        if vanishes(m[k, k], diagonal[k], PIVOT * len(m)):
            return k
        m[:k, :k] -= np.outer(m[:k, k], m[k, :k] / m[k, k])
    return None


def in_floats(matrix: Sequence[Sequence[float]], right: Sequence[float], size: int, /, beside: int = 0) -> Solution:
    """Return the solve of equalities in floats: A (s x n), r (s), n."""
    A, r = np.array(matrix, dtype=float).reshape(len(right), size), np.array(right, dtype=float)
    return solve(A, r)
