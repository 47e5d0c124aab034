"""Forward dynamics in floats: accelerations and multipliers, the reference for every program.

With M = G^T G: x = G udot, A = H G^-1 turns M udot = f + H^T lambda, H udot = gamma into x = G^-T f + A^T lambda,
A x = gamma, which the rank-revealing solve answers whatever the rank of A. A second solve brings back what huge
accelerations without rows have rounded away.

What a row's force is follows from the law of the row. With x = A^T lambda the rows' part of G udot and r what is asked,
row j leaves a_j = (A x - r)_j:

    equality    a = 0
    unilateral  0 <= a, 0 <= lambda, a lambda = 0
    friction    sticks with a = 0, |lambda| <= static lambda_n, or slides with lambda = -kinetic sign(v) lambda_n

Equalities alone are solved as yet. W = A A^T, of which textbooks write a = W lambda - r, is never formed: it squares
the condition of A.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.block_ldl import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal, mass_matrix
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.formalisms.massless import completed_matrix, massless_speeds
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import constraint_jacobian, row_motions
from multibody_sym.numerics.arrays import EPSILON, Floats
from multibody_sym.numerics.least_norm import Solution, solve

_SAFETY: Final = 10
SHORTEST: Final = 1e-6
"""Part of the longest row's length that scales shorter rows: what rounding has left of a row takes no force."""


@dataclass(frozen=True)
class Accelerations:
    """What forward dynamics finds: udot (nu), multipliers (ns), and the solve's report (3)."""

    udot: Floats
    multipliers: Floats
    report: Floats


def forward_dynamics(dynamics: TreeDynamics, *, minimum_norm: bool = False) -> Accelerations:
    """Return udot and the multipliers at a state over floats.

    M udot = Q - c + H^T lambda, H udot = gamma. Multipliers of dependent rows are zero, unless those of `minimum_norm`
    are asked for (`shared`).
    """
    if not dynamics.rows:
        return Accelerations(np.array(dynamics.bias_acceleration, dtype=float), np.zeros(0), np.zeros(3))
    factors, gamma = dynamics.factors, np.array(dynamics.constraint_forcing, dtype=float)
    free = np.array(factors.weighted(dynamics.forcing), dtype=float)
    jacobian = constraint_jacobian(dynamics.rows)
    matrix = np.array([factors.weighted(row) for row in jacobian.tolist()], dtype=float)
    laws = [Equality()] * len(matrix)
    first = solved(matrix, gamma - matrix @ free, laws)
    near = np.array(factors.unweighted((free + first.solution).tolist()), dtype=float)
    second = solved(matrix, gamma - jacobian @ near, laws)
    udot = near + np.array(factors.unweighted(second.solution.tolist()), dtype=float)
    multipliers = first.multipliers + second.multipliers
    if minimum_norm:
        multipliers = shared(matrix, first.solution + second.solution)
    return Accelerations(udot, multipliers, first.report)


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
        body = next(body.name for body in motion.mechanism.bodies if index in body.u)
        if mass_diagonal(motion)[index] > 0:
            why = f"freedoms beyond joint {speed.joint!r} move what it moves in the same way, at least in this position"
        else:
            why = f"body {body} and what joint {speed.joint!r} moves with it have neither mass nor inertia that way"
        raise NoSolutionError(
            f"no inertia resists the speed {speed.name}: {why}; give body {body} an inertia, hold the direction by a "
            "constraint, or start from another position",
            where=Where(path=("joints", speed.joint)),
        )


def _has_inertia(motion: Motion) -> bool:
    """Return whether M has positive pivots beside its diagonal, in time linear in the number of bodies."""
    try:
        factors = tree_factors(motion)
    except ZeroDivisionError:
        return False
    pivots = np.array([freedom.pivot for of_body in factors.freedoms for freedom in of_body], dtype=float)
    diagonal = np.array(mass_diagonal(motion), dtype=float)
    return bool((pivots > _SAFETY * EPSILON * len(pivots) * diagonal).all())


def speed_without_inertia(matrix: Sequence[Sequence[float]]) -> int | None:
    """Return the speed at which M = L^T D L meets a pivot that is not positive beside its own diagonal element."""
    m = np.array(matrix, dtype=float).reshape(len(matrix), len(matrix))
    diagonal = m.diagonal().copy()
    for k in range(len(m) - 1, -1, -1):
        if not m[k, k] > _SAFETY * EPSILON * len(m) * diagonal[k]:
            return k
        m[:k, :k] -= np.outer(m[:k, k], m[k, :k] / m[k, k])
    return None


# --- laws of rows ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Equality:
    """The law of a constraint that holds both ways: a cut joint, a rod, rolling, a gear, a prescribed motion."""


@dataclass(frozen=True)
class Unilateral:
    """The law of what holds one way only: a contact's normal, a rope that may slacken."""


@dataclass(frozen=True)
class Friction:
    """Coulomb's law in the tangent of a contact whose normal is row number `normal`."""

    normal: int
    static: float
    kinetic: float


Law = Equality | Unilateral | Friction


def solved(matrix: Floats, right: Floats, laws: Sequence[Law]) -> Solution:
    """Return x (n) and lambda (s) with which each row does what its law asks, and the solve's report.

    Arguments: A (s, n), r (s,), and a law for each row. Multipliers of dependent rows are zero.
    Raises NoSolutionError for a law that is not Equality: no others are solved.
    """
    others = {type(law).__name__.lower() for law in laws if not isinstance(law, Equality)}
    if others:
        raise NoSolutionError(f"rows under the law of {' and '.join(sorted(others))} cannot be solved, only equalities")
    return solve(matrix, right)


def shared(matrix: Floats, x: Floats) -> Floats:
    """Return among the lambda (s) with A^T lambda = x those of least norm, each times its row's length.

    Rows that are alike share what they carry in equal parts.
    """
    lengths = np.linalg.norm(matrix, axis=1)
    lengths = np.maximum(lengths, SHORTEST * lengths.max(initial=0.0))
    lengths[lengths == 0.0] = 1.0
    multipliers: Floats = solve((matrix / lengths[:, None]).T, x).solution / lengths
    return multipliers
