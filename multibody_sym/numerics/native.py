"""The one door to solvers of scipy that do not take matrices without rows or columns, some of which end the process.

scipy is imported inside, since it takes longer than most answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.numerics.arrays import Floats

INFEASIBLE: Final = 2
"""The status of a linear program without a solution, as scipy numbers it."""
Bounds = Sequence[tuple[float | None, float | None]]


class Program(NamedTuple):
    """What came of a linear program: 0 solved, 2 without a solution; x (n), the least value, marginals, a message."""

    status: int
    x: Floats
    value: float
    marginals: Floats
    message: str


def nonnegative_least_squares(matrix: Floats, right: Floats) -> tuple[Floats, float]:
    """Return y >= 0 (n) with the least |A y - b|, and that norm, of A (m x n) and b (m).

    Raises RuntimeError where the iteration does not end.
    Source: C. L. Lawson, R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.
    """
    if not matrix.size:
        return np.zeros(matrix.shape[1]), float(np.linalg.norm(right))
    from scipy.optimize import nnls

    y, left = nnls(matrix, right)
    return np.asarray(y, dtype=float), float(left)


def linear_program(
    cost: Floats,
    bounds: Bounds,
    *,
    below: tuple[Floats, Floats] | None = None,
    equal: tuple[Floats, Floats] | None = None,
    method: str = "highs",
    options: Any = None,
) -> Program:
    """Return the x of least cost c . x within bounds, with A x <= b for `below` = (A, b) and E x = r for `equal`.

    Marginals are those of `below`. Rows of no variables are what their right sides say: true or a contradiction.
    """
    upper = below if below is not None and len(below[1]) else None
    exact = equal if equal is not None and len(equal[1]) else None
    if not len(cost):
        holds = (upper is None or (upper[1] >= 0.0).all()) and (exact is None or not exact[1].any())
        marginals = np.zeros(0 if upper is None else len(upper[1]))
        return Program(0 if holds else INFEASIBLE, np.zeros(0), 0.0, marginals, "no variables")
    from scipy.optimize import linprog

    found = linprog(
        cost,
        A_ub=upper and upper[0], b_ub=upper and upper[1], A_eq=exact and exact[0], b_eq=exact and exact[1],
        bounds=list(bounds), method=method, options=options,
    )  # fmt: skip
    if found.x is None:
        return Program(int(found.status), np.full(len(cost), np.nan), np.nan, np.zeros(0), str(found.message))
    marginals = np.asarray(found.ineqlin.marginals, dtype=float)
    return Program(int(found.status), np.asarray(found.x, dtype=float), float(found.fun), marginals, str(found.message))
