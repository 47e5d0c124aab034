"""Whether linear conditions can hold together, and which few of them contradict each other where they cannot.

    E x = r        G x >= 0

By linear programming: the least v with |E x - r| <= v and G x >= -v, all rows scaled to like size. Where v > 0 its dual
gives a *contradiction* (Farkas): weights y of equalities and w >= 0 of inequalities with y E + w G = 0 and y r > 0. At
a vertex these are the fewest rows possible: one more than they have independent columns, so that the rows alone give
the weights.
"""

from __future__ import annotations

from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.native import INFEASIBLE, linear_program, nonnegative_least_squares
from multibody_sym.numerics.rank import least_combination
from multibody_sym.records import dataclass

POSSIBLE: Final = 1e-9
"""The least v, where rows are scaled to like size and r to 1, up to which conditions are taken to hold together."""
_WEIGHTY: Final = 1e-12
"""The part of the largest weight of a dual that is none."""
_SCALINGS: Final = 8
_MANY: Final = 20_000
"""Entries of rows from which on least squares take as long as a linear program."""
_ROUNDED: Final = 1e-12
"""The largest entry of a column, among rows of length one, that is what rounding left of nothing."""
_EXACT: Final = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
_DEPENDENT: Final = 1e-10
"""The part of the largest singular value up to which another one is none."""


@dataclass(frozen=True, eq=False)
class Conditions:
    """E x = r (`equal`, e x n; `right`, e), G x >= 0 (`cone`, g x n); r no larger than `nothing` is rounding alone."""

    equal: Floats
    right: Floats
    cone: Floats
    nothing: float = 0.0

    def rows(self, of: Contradiction) -> Floats:
        """Return the rows of a contradiction, equalities first (k x n)."""
        return np.vstack([self.equal[list(of.equal)], self.cone[list(of.cone)]])

    @cached_property
    def scales(self) -> tuple[Floats, Floats, float]:
        """Factors of rows (equalities first, then inequalities) and columns that make entries alike; size of r then."""
        matrix = np.abs(np.vstack([self.equal, self.cone]))
        rows, columns = np.ones(matrix.shape[0]), np.ones(matrix.shape[1])
        for _ in range(_SCALINGS):
            scaled = rows[:, None] * matrix * columns
            rows /= np.sqrt(_largest(scaled, 1))
            columns /= np.sqrt(_largest(rows[:, None] * matrix * columns, 0))
        size = float(np.abs(rows[: len(self.right)] * self.right).max(initial=0.0))
        return rows, columns, size or 1.0


def _largest(matrix: Floats, axis: int) -> Floats:
    largest = matrix.max(axis=axis, initial=0.0)
    return np.where(largest > 0.0, largest, 1.0)


@dataclass(frozen=True)
class Contradiction:
    """Rows that contradict each other: places of equalities and inequalities, and the weight of each (k)."""

    equal: tuple[int, ...]
    cone: tuple[int, ...]
    weights: tuple[float, ...]

    def weights_in(self, conditions: Conditions) -> Floats:
        """Return the weights (k) of the same rows in other conditions, with those here as their guide for the sign.

        Not a number where the rows are independent there.
        """
        rows = conditions.rows(self)
        lengths = np.linalg.norm(rows, axis=1)
        lengths = np.where(lengths > 0.0, lengths, 1.0)
        unit = rows / lengths[:, None]
        largest = np.abs(unit).max(axis=0, initial=0.0)
        columns = np.where(largest > _ROUNDED, largest, 1.0)
        combination = least_combination(unit / columns, _DEPENDENT)
        if combination is None:
            return np.full(len(lengths), np.nan)
        found = combination / lengths
        return np.asarray(found if found @ np.array(self.weights) >= 0.0 else -found)

    def excess(self, conditions: Conditions) -> float:
        """Return the least of y r and the weights of inequalities, each divided by what it is here: > 0 contradicts."""
        weights = self.weights_in(conditions)
        size = np.abs(weights).max()
        count = len(self.equal)
        value = weights[:count] @ conditions.right[list(self.equal)] / size
        return float(min(value, *(weights[count:] / size / np.array(self.shares)), np.inf))

    @property
    def shares(self) -> tuple[float, ...]:
        """The weights of inequalities, as parts of the largest weight."""
        size = max(map(abs, self.weights))
        return tuple(weight / size for weight in self.weights[len(self.equal) :])


def contradiction(conditions: Conditions) -> Contradiction | None:
    """Return the rows that contradict each other, None where all conditions hold together for some x."""
    if not np.abs(conditions.right).max(initial=0.0) > conditions.nothing or _hold(conditions):
        return None
    least, dual, _ = _least_violation(conditions)
    if least <= POSSIBLE:
        return None
    rows = conditions.scales[0]
    weighty = np.flatnonzero(np.abs(dual) > _WEIGHTY * np.abs(dual).max(initial=0.0))
    count = len(conditions.right)
    equal, cone = (tuple(int(k) for k in weighty if k < count), tuple(int(k) - count for k in weighty if k >= count))
    return Contradiction(equal, cone, tuple((rows * dual)[weighty].tolist()))


def nearest(conditions: Conditions) -> Floats:
    """Return an x (n) that violates the conditions least: not at all where they hold together."""
    if not np.abs(conditions.right).max(initial=0.0) > 0.0:
        return np.zeros(conditions.equal.shape[1])
    return _least_violation(conditions)[2]


def _scaled(conditions: Conditions) -> tuple[Floats, Floats]:
    """Return the scaled rows ((e + g) x n), equalities first, and right sides (e + g)."""
    rows, columns, size = conditions.scales
    scaled = rows[:, None] * np.vstack([conditions.equal, conditions.cone]) * columns
    right = rows[: len(conditions.right)] * conditions.right / size
    return scaled, np.concatenate([right, np.zeros(len(conditions.cone))])


def _hold(conditions: Conditions) -> bool:
    """Return whether least squares find an x that fulfils all conditions, at a tenth of what a linear program takes.

    Of x = y - z with y, z and what is left to inequalities not negative.
    """
    scaled, right = _scaled(conditions)
    count, n = len(conditions.right), scaled.shape[1]
    if scaled.size > _MANY:
        return False
    left = np.vstack([np.zeros((count, len(scaled) - count)), -np.eye(len(scaled) - count)])
    try:
        found, _ = nonnegative_least_squares(np.hstack([scaled, -scaled, left]), right)
    except RuntimeError:  # too many steps
        return False
    missed = scaled @ (found[:n] - found[n : 2 * n]) - right
    return float(np.maximum(np.abs(missed[:count]).max(initial=0.0), -missed[count:].min(initial=0.0))) <= POSSIBLE


def _least_violation(conditions: Conditions) -> tuple[float, Floats, Floats]:
    """Return v, scaled, the dual of the scaled rows, equalities first, and x."""
    _, columns, size = conditions.scales
    count, n = len(conditions.right), len(columns)
    scaled, right = _scaled(conditions)
    upper = np.vstack([scaled[:count], -scaled])
    bounds = np.concatenate([right[:count], -right])
    least, below = np.r_[np.zeros(n), 1.0], (np.hstack([upper, -np.ones((len(upper), 1))]), bounds)
    # the simplex method ends without an answer once in thousands of programs; what has the bound 0 is called unbounded
    for method, options in (("highs-ds", _EXACT), ("highs-ipm", _EXACT), ("highs-ds", None)):
        found = linear_program(
            least, [(None, None)] * n + [(0.0, None)], below=below, method=method, options=options
        )
        if found.status == 0:
            break
    else:
        raise ArithmeticError(f"linear programming failed: {found.message}")
    dual = -found.marginals[count:]
    dual[:count] += found.marginals[:count]
    return found.value, dual, np.asarray(found.x[:n] * columns * size)


def extremes(conditions: Conditions, along: Floats, low: float, scale: float) -> tuple[float, float] | None:
    """Return the least and the largest p >= low with E x = r + p `along`, G x >= 0 for some x, None if there is none.

    As good as linear programming is; infinite where p has no bound. `scale` is the size of p.
    """
    with_p = Conditions(
        np.hstack([conditions.equal, -scale * along[:, None]]),
        conditions.right,
        np.hstack([conditions.cone, np.zeros((len(conditions.cone), 1))]),
    )
    rows, columns, size = with_p.scales
    count, n = len(conditions.right), len(columns)
    scaled = rows[:, None] * np.vstack([with_p.equal, with_p.cone]) * columns
    factor = scale * columns[-1] * size
    found = []
    for sense in (1.0, -1.0):
        one = linear_program(
            np.r_[np.zeros(n - 1), sense],
            [(None, None)] * (n - 1) + [(low / factor, None)],
            below=(-scaled[count:], np.zeros(len(conditions.cone))),
            equal=(scaled[:count], rows[:count] * conditions.right / size),
            method="highs-ds",
        )
        if one.status == INFEASIBLE:
            return None
        found.append(-sense * np.inf if one.status != 0 else float(one.x[-1]) * factor)
    return found[0], found[1]
