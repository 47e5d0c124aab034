"""What is left when equalities are eliminated: motion and all forces as affine functions of the other rows' forces.

K = A X + D.. of these rows is formed, which squares the condition of A: it proposes modes, and judges none.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.mode_solve import restricted
from multibody_sym.dynamics.laws.scaled import Places, Scaled
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import ROUNDED, least_squares, null_space
from multibody_sym.records import dataclass

LEFT: Final = 1e-14
"""What equalities leave of rows of unit length that depend on them: rounding, which must not look like a row."""


@dataclass(frozen=True)
class Reduced:
    """z = z0 + Z f, x = x0 + X f, a = a0 + K f for the forces f (k) of the rows `own`, all other rows equalities.

    With `open_sides` equalities depend on each other so that forces which rub are not unique: these are some of them.
    """

    own: Places
    place: Places
    z0: Floats
    Z: Floats
    x0: Floats
    X: Floats
    a0: Floats
    K: Floats
    open_sides: bool


def reduced(problem: Scaled) -> Reduced:
    """Return the problem without its equalities."""
    equal = np.sort(np.concatenate([problem.kinematic, problem.defining]))
    own = np.setdiff1d(np.arange(problem.count), equal)
    A, C, D, r = problem.A, problem.C, problem.D, problem.r
    F = problem.defining
    rows = restricted(A[problem.kinematic])
    Q, y = rows.Q, rows.components(r[problem.kinematic])
    along = Q.T @ C.T
    beside = C.T - Q @ along
    still = Q @ y
    equations = np.vstack([along, A[F] @ beside + D[F]])
    right = np.concatenate([y, r[F] - A[F] @ still])
    z0, Z = np.zeros(problem.count), np.zeros((problem.count, len(own)))
    Z[own, np.arange(len(own))] = 1.0
    if len(equal):
        both = np.column_stack([right, -equations[:, own]])
        answer = least_squares(equations[:, equal], both, ROUNDED)
        z0[equal], Z[equal] = answer[:, 0], answer[:, 1:]
    open_sides = _presses(problem, equal, equations[:, equal])
    x0, X = still + beside @ z0, beside @ Z
    place = np.full(problem.count, -1)
    place[own] = np.arange(len(own))
    a0, K = A @ x0 + D @ z0 - r, A @ X + D @ Z
    terms = problem.terms(x0, z0)
    a0[np.abs(a0) <= LEFT * (terms + float(np.linalg.norm(x0)))] = 0.0
    K[np.abs(K) <= LEFT] = 0.0
    return Reduced(own, place, z0, Z, x0, X, a0, K, open_sides)


def _presses(problem: Scaled, equal: Places, equations: Floats) -> bool:
    """Return whether forces of equalities that nothing determines press what rubs."""
    if not np.isin(problem.both, equal).any() or not problem.parts:
        return False
    idle = null_space(equations, ROUNDED)
    return bool(np.abs(idle[np.isin(equal, problem.both)]).max(initial=0.0) > ROUNDED)
