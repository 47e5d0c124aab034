"""The law solver: forces of rows from what the law of each row asks, for accelerations, speeds and corrections alike.

With M = G^T G, A = H G^-1 and x = A^T lambda the rows' part of G udot, row j leaves a_j = (A x - r)_j:

    equality    a = 0
    unilateral  0 <= a, 0 <= lambda, a lambda = 0
    friction    sticks with a = 0, |lambda| <= static lambda_n, or slides with lambda = -kinetic sign(v) lambda_n

W = A A^T, of which textbooks write a = W lambda - r, is never formed: it squares the condition of A.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.least_norm import Solution, solve

SHORTEST: Final = 1e-6
"""Part of the longest row's length that scales shorter rows: what rounding has left of a row takes no force."""


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
