"""Whether linear conditions can hold together, and which few of them contradict each other where they cannot.

    E x = r        G x >= 0

By linear programming: the least v with |E x - r| <= v and G x >= -v, all rows scaled to like size. Where v > 0 its dual
gives a *contradiction* (Farkas): weights y of equalities and w >= 0 of inequalities with y E + w G = 0 and y r > 0. At
a vertex these are the fewest rows possible: one more than they have independent columns, so that the rows alone give
the weights.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from functools import cached_property
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import least_combination, least_squares

# ----------------------------------------------------------------------------------------------------------------------
# The one door to solvers of scipy that do not take matrices without rows or columns, some of which end the process.
#
# scipy is imported inside, since it takes longer than most answers.


INFEASIBLE: Final = 2
"""The status of a linear program without a solution, as scipy numbers it."""
Bounds = Sequence[tuple[float | None, float | None]]


class LinearProgram(NamedTuple):
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
) -> LinearProgram:
    """Return the x of least cost c . x within bounds, with A x <= b for `below` = (A, b) and E x = r for `equal`.

    Marginals are those of `below`. Rows of no variables are what their right sides say: true or a contradiction.
    """
    upper = below if below is not None and len(below[1]) else None
    exact = equal if equal is not None and len(equal[1]) else None
    if not len(cost):
        holds = (upper is None or (upper[1] >= 0.0).all()) and (exact is None or not exact[1].any())
        marginals = np.zeros(0 if upper is None else len(upper[1]))
        return LinearProgram(0 if holds else INFEASIBLE, np.zeros(0), 0.0, marginals, "no variables")
    from scipy.optimize import linprog

    found = linprog(
        cost,
        A_ub=upper and upper[0], b_ub=upper and upper[1], A_eq=exact and exact[0], b_eq=exact and exact[1],
        bounds=list(bounds), method=method, options=options,
    )  # fmt: skip
    if found.x is None:
        return LinearProgram(int(found.status), np.full(len(cost), np.nan), np.nan, np.zeros(0), str(found.message))
    marginals = np.asarray(found.ineqlin.marginals, dtype=float)
    x = np.asarray(found.x, dtype=float)
    return LinearProgram(int(found.status), x, float(found.fun), marginals, str(found.message))


# ----------------------------------------------------------------------------------------------------------------------

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

    def rows(self, of: InfeasibleRows) -> Floats:
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
class InfeasibleRows:
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


def contradiction(conditions: Conditions) -> InfeasibleRows | None:
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
    return InfeasibleRows(equal, cone, tuple((rows * dual)[weighty].tolist()))


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


# ----------------------------------------------------------------------------------------------------------------------
# For which values of a parameter linear conditions that depend on it can hold together: all intervals, exact ends.
#
# Where conditions contradict each other at one value, the same few rows do so around it, up to where their weights
# change sign or their contradiction vanishes: a root of one function. So a contradiction excludes an interval, the
# next value is looked at where it ends, and an end of what is possible is such a root, found to the last bits, with
# the rows that give way there. An interval of possible values within one step of the search is found too, single
# values included; a gap within one step is not, nor a single value where a contradiction vanishes and comes back as it
# was.


_MOST: Final = 60
"""How many contradictions may follow each other in one step of the search."""
_LOOKS: Final = 2
_ASIDE: Final = 1e-3
"""The part of a step by which a value is left at which more rows depend on each other than around it."""
_HALVED: Final = 1e-17
"""The part of a step to which it is halved, where no rounding ends this before."""
_SURE: Final = 1e-6
"""The least excess by which a contradiction found elsewhere is one here."""
_ONE: Final = 1e-12
"""The part of their size up to which two ends are one value."""

ConditionsAt = Callable[[float], Conditions | None]
"""The conditions at a value of the parameter; None where they are not defined."""


@dataclass(frozen=True)
class IntervalEnd:
    """An end of an interval: its value, and what contradicts beyond it; None at the end of the search."""

    value: float
    gives_way: InfeasibleRows | None = None


@dataclass(frozen=True)
class Interval:
    """Values from one end to the other, both included; a single value has two equal ends."""

    low: IntervalEnd
    high: IntervalEnd


def feasible_set(conditions: ConditionsAt, grid: Sequence[float]) -> list[Interval]:
    """Return the intervals within a grid (ascending) at whose values the conditions hold together, in their order."""
    return list(_Search(conditions).intervals(sorted(set(map(float, grid)))))


@dataclass(frozen=True)
class _Looked:
    """A value, whether its conditions hold together there, and what contradicts, if it is known."""

    value: float
    possible: bool
    against: InfeasibleRows | None = None


@dataclass(frozen=True)
class _Search:
    """A search; `_latest` is the contradiction found last, which often holds at the next value too: no linear program.
    """

    conditions: ConditionsAt
    _latest: list[InfeasibleRows] = field(default_factory=list)

    def look(self, value: float) -> _Looked:
        found = self.conditions(value)
        if found is None:
            return _Looked(value, False)
        if self._latest and self._latest[0].excess(found) > _SURE:
            return _Looked(value, False, self._latest[0])
        against = contradiction(found)
        if against is not None:
            self._latest[:] = [against]
        return _Looked(value, against is None, against)

    def intervals(self, grid: Sequence[float]) -> Iterator[Interval]:
        looks = [self.look(value) for value in grid]
        low = IntervalEnd(grid[0]) if looks[0].possible else None
        for a, b in pairwise(looks):
            if a.possible and not b.possible:
                assert low is not None
                yield Interval(low, self.edge(b, a.value))
                low = None
            elif b.possible and not a.possible:
                low = self.edge(a, b.value)
            elif not (a.possible or b.possible):
                yield from self.between(a, b)
        if low is not None:
            yield Interval(low, IntervalEnd(grid[-1]))

    def between(self, a: _Looked, b: _Looked) -> Iterator[Interval]:
        """Yield the interval of possible values between two that are not, if one is met."""
        if a.against is None or b.against is None:
            return
        low = self.reached(a, b.value)
        if low is not None:
            high = self.reached(b, low.value)
            single = high is None or _is_one(low.value, high.value)
            yield Interval(low, IntervalEnd(low.value, b.against) if single or high is None else high)

    def edge(self, look: _Looked, goal: float) -> IntervalEnd:
        """Return the end between a value that is not possible and a goal that is, if only just."""
        end, last = self.walked(look, goal)
        if end is not None:
            return end
        there = self.conditions(goal)
        if last.against is not None and there is not None and last.against.excess(there) >= 0.0:
            return IntervalEnd(goal, last.against)
        return self.halved(look, goal)

    def reached(self, look: _Looked, goal: float) -> IntervalEnd | None:
        """Return the first possible value on the way from one that is not to the goal; None if none is met."""
        return self.walked(look, goal)[0]

    def walked(self, look: _Looked, goal: float) -> tuple[IntervalEnd | None, _Looked]:
        """Return the same, and the last value on the way that is not possible."""
        for _ in range(_MOST):
            value = None if look.against is None else self.lapses(look, goal)
            if value is None:
                break
            there = self.look(value)
            if there.possible:
                return IntervalEnd(value, look.against), look
            look = self.look(value + _ASIDE * (goal - value)) if value == look.value else there
            if look.possible:  # what contradicts at one value only
                return self.halved(there, look.value), there
        return None, look

    def lapses(self, look: _Looked, goal: float) -> float | None:
        """Return the value at which what contradicts at one value ceases to do so; None if it does up to the goal."""
        from scipy.optimize import brentq

        against = look.against
        assert against is not None

        def excess(value: float) -> float:
            found = self.conditions(value)
            return float("nan") if found is None else against.excess(found)

        last = look.value
        for value in np.linspace(look.value, goal, _LOOKS + 1)[1:].tolist():
            there = excess(value)
            if not there > 0.0:
                if there != there or not excess(last) > 0.0:
                    return last
                return float(brentq(excess, last, value, xtol=1e-300, rtol=8.9e-16, maxiter=200))
            last = value
        return None

    def halved(self, look: _Looked, goal: float) -> IntervalEnd:
        """Return the end between a value that is not possible and one that is, by halving; the first where all are."""
        first, low, high = look, look.value, goal
        step = abs(goal - low)
        while abs(high - low) > _HALVED * step and min(low, high) < (middle := 0.5 * (low + high)) < max(low, high):
            there = self.look(middle)
            low, high = (low, middle) if there.possible else (middle, high)
            look = look if there.possible else there
        if abs(high - first.value) <= _ONE * step:
            return IntervalEnd(first.value, first.against)
        return IntervalEnd(high, look.against)


def _is_one(a: float, b: float) -> bool:
    return abs(a - b) <= _ONE * max(abs(a), abs(b))


# ----------------------------------------------------------------------------------------------------------------------
# A point well inside cones, among those that linear equations allow: the analytic centre.
#
# Of forces that are not unique it is the choice that keeps away from all bounds, changes smoothly with the load, and
# comes to its bounds no sooner than any choice does. Newton's method on the sum of -log of what is left to each bound;
# a first point inside is found by cones that are made wider by a number, which is made as small as can be.


_STEPS: Final = 60
"""Newton's steps to a centre: a few, and some more from far away."""
_CENTRED: Final = 1e-16
"""What a further step would gain, where one is enough."""
_INNER_POINT_ROUNDED: Final = 1e-3
"""Gains below this fall from step to step, to their square, until only rounding is left of them."""
_SHARPER: Final = 10.0
_SHARPEST: Final = 1e14
"""How much width counts at last: what can be narrower by more than 1e-13 has been."""


@dataclass(frozen=True)
class Cone:
    """|z_rows| <= the sum of factors times z_axes; without rows that sum is not negative."""

    rows: tuple[int, ...]
    axes: tuple[int, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Cones (c) as arrays: bounds b = `factors` z of the lengths of z_`rows`, (c, m) both; `weights` (c) of -log.

    Their barrier is -w log(b^2 - |z_rows|^2), with w = 1/2 where there are no rows: -log b.
    """

    factors: Floats
    rows: Floats
    weights: Floats

    def left(self, z: Floats) -> tuple[Floats, Floats]:
        """Return what is left to the bounds, and the bounds."""
        most = self.factors @ z
        return most - np.sqrt(self.rows @ (z * z)), most

    def room(self, z: Floats) -> float:
        """Return what is left to the nearest bound, negative beyond it."""
        return float(self.left(z)[0].min(initial=np.inf))

    def barrier(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the first (m) and second (m, m) derivatives of the sum of all barriers."""
        left, most = self.left(z)
        inside = left * (2.0 * most - left)
        slopes = 2.0 * (most[:, None] * self.factors - self.rows * z) / inside[:, None]
        curved = 2.0 * self.weights / inside
        hessian = slopes.T @ (self.weights[:, None] * slopes) - self.factors.T @ (curved[:, None] * self.factors)
        return -self.weights @ slopes, hessian + np.diag(curved @ self.rows)


def _bounds(cones: Sequence[Cone], size: int) -> _Bounds:
    """Return cones in z of some size as arrays."""
    factors, rows = np.zeros((2, len(cones), size))
    for k, cone in enumerate(cones):
        factors[k, list(cone.axes)] = cone.factors
        rows[k, list(cone.rows)] = 1.0
    return _Bounds(factors, rows, np.where(rows.any(axis=1), 1.0, 0.5))


@dataclass(frozen=True, eq=False)
class Inside:
    """A point z (m) = start + ways (m, j) `taken` (j), what is left to the nearest bound, and the `hessian` (m, m)."""

    z: Floats
    taken: Floats
    room: float
    hessian: Floats


def inner_point(start: Floats, ways: Floats, cones: Sequence[Cone], loose: Sequence[int] = ()) -> Inside:
    """Return the point z (m) = start + ways (m, j) y that is most inside the cones.

    Numbers are of order one. What is `loose` has no bounds, and is near zero. Where the cones have no room, the point
    is one that is least beyond them.
    """
    count, free = ways.shape
    bounds, free_of_bounds = _bounds(cones, count), np.array(loose, dtype=int)
    width = max(1.0, -2.0 * bounds.room(start))
    wider = np.column_stack([bounds.factors, np.ones(len(cones))])
    wide = _Bounds(wider, np.column_stack([bounds.rows, np.zeros(len(cones))]), bounds.weights)
    further = np.block([[ways, np.zeros((count, 1))], [np.zeros((1, free)), np.ones((1, 1))]])
    first = _InnerPointSearch(np.append(start, width), further, wide, free_of_bounds)
    y, sharp = np.zeros(free + 1), 1.0
    while sharp <= _SHARPEST and y[-1] + width > 0.0:
        y = first.centred(y, sharp, least=-width)
        if y[-1] + width > 10.0 * (2.0 * len(cones) + 1.0) / sharp:  # there is no room at all
            break
        sharp *= _SHARPER
    left = max(y[-1] + width, 0.0)
    if left > 0.0:
        z = first.at(y)
        return Inside(z[:-1], y[:-1], bounds.room(z[:-1]), first.slopes(z)[1][:-1, :-1])
    second = _InnerPointSearch(start, ways, bounds, free_of_bounds)
    y = second.centred(y[:-1])
    z = second.at(y)
    return Inside(z, y, bounds.room(z), second.slopes(z)[1])


@dataclass(frozen=True, eq=False)
class _InnerPointSearch:
    """The points start + ways y, their bounds, and what is `loose`."""

    start: Floats
    ways: Floats
    bounds: _Bounds
    loose: NDArray[Any]

    def at(self, y: Floats) -> Floats:
        found: Floats = self.start + self.ways @ y
        return found

    def centred(self, y: Floats, sharp: float = 0.0, least: float = -np.inf) -> Floats:
        """Return the centre from a point inside; where the last of z counts `sharp` as well, until it is `least`."""
        before = np.inf
        for _ in range(_STEPS):
            step, gain = self._step(y, sharp)
            if gain < _CENTRED or y[-1:].sum() <= least or before <= gain < _INNER_POINT_ROUNDED:
                break
            before = gain
            far = 1.0 if gain < 0.06 else 1.0 / (1.0 + float(np.sqrt(gain)))
            while far > 1e-9 and not self.bounds.room(self.at(y + far * step)) > 0.0:
                far *= 0.5
            if far <= 1e-9:
                break
            y = y + far * step
        return y

    def _step(self, y: Floats, sharp: float) -> tuple[Floats, float]:
        gradient, hessian = self.slopes(self.at(y))
        gradient[-1] += sharp
        slope, curve = self.ways.T @ gradient, self.ways.T @ hessian @ self.ways
        size = np.sqrt(np.maximum(np.diag(curve), 1e-300))
        step: Floats = -least_squares(curve / np.outer(size, size), slope / size, 1e-15) / size
        return step, float(-slope @ step)

    def slopes(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the first and second derivatives of what is made least."""
        gradient, hessian = self.bounds.barrier(z)
        gradient[self.loose] += z[self.loose]
        hessian[self.loose, self.loose] += 1.0
        return gradient, hessian


# ----------------------------------------------------------------------------------------------------------------------
# The outline of points in a plane: the corners of the smallest convex polygon around them.


_FLAT: Final = 1e-9
"""The part of the points' extent by which one is beside the line of its neighbours."""


def outline(points: Floats, normal: Floats) -> list[int]:
    """Return which of points (n, 3) are corners of their outline, seen along a normal (3,), counter-clockwise about it.

    Two where all are on a line, one where all are in one place.
    """
    across = np.eye(3)[int(np.argmin(np.abs(normal)))]
    x = np.cross(across, normal)
    seen = points @ np.array([x / np.linalg.norm(x), np.cross(normal, x) / np.linalg.norm(np.cross(normal, x))]).T
    size = float(np.ptp(seen, axis=0).max(initial=0.0))
    order = [int(k) for k in np.lexsort((seen[:, 1], seen[:, 0]))]
    if size == 0.0:
        return order[:1]
    halves = [_half(seen, way, _FLAT * size * size) for way in (order, order[::-1])]
    around = [*halves[0][:-1], *halves[1][:-1]]
    first = around.index(min(around))
    return [*around[first:], *around[:first]]


def _half(seen: Floats, order: list[int], least: float) -> list[int]:
    """Return the lower half of an outline, in an order from end to end."""
    found: list[int] = []
    for k in order:
        while len(found) > 1 and _turn(seen[found[-2]], seen[found[-1]], seen[k]) <= least:
            found.pop()
        found.append(k)
    return found


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
