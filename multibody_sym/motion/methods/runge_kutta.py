"""Explicit Runge-Kutta methods as data that checks itself.

Every method is kept with its end point as last stage: the last row of `A` is b, so the last slope is f(t + h, x_new).
It costs nothing, because it is the first slope of the next step, and it lets one loop serve all methods: error
estimates and continuous extensions are weights over the same stages, with or without "first same as last". An
extension may need stages beyond the end point; they are evaluated only in steps that are interpolated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache, cached_property
from math import prod
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Order conditions of Runge-Kutta methods over all rooted trees, exactly for coefficients that are Fractions.
#
# A rooted tree is the sorted tuple of its branches, each a tree; `()` is the single node. A method with coefficients
# A, weights b and nodes c = A 1 has order p when every tree t of at most p nodes satisfies
#
#     sum_i b_i Phi_i(t) = 1 / gamma(t)
#     Phi_i((t1, .., tm)) = prod_k sum_j a_ij Phi_j(tk),   gamma((t1, .., tm)) = |t| prod_k gamma(tk)
#
# Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.2.


Tree = tuple["Tree", ...]
Number = TypeVar("Number", Fraction, float)


@cache
def rooted_trees(size: int) -> tuple[Tree, ...]:
    """Return every rooted tree of `size` nodes once (1, 1, 2, 4, 9, 20, 48, ... of them), in a fixed order."""
    if size == 1:
        return ((),)
    return tuple(sorted({larger for tree in rooted_trees(size - 1) for larger in _with_one_more_leaf(tree)}))


def _with_one_more_leaf(tree: Tree) -> Iterator[Tree]:
    yield tuple(sorted((*tree, ())))
    for index, branch in enumerate(tree):
        for larger in _with_one_more_leaf(branch):
            yield tuple(sorted((*tree[:index], larger, *tree[index + 1 :])))


@cache
def node_count(tree: Tree) -> int:
    """Return |t|, the number of nodes of `tree`."""
    return 1 + sum(map(node_count, tree))


@cache
def density(tree: Tree) -> int:
    """Return gamma(t), the product over all nodes of the number of nodes above and including it."""
    return node_count(tree) * prod(map(density, tree))


def stage_weights(A: Sequence[Sequence[Number]], size: int) -> dict[Tree, list[Number]]:
    """Return Phi_i(t) by stage for every tree of at most `size` nodes of the method with coefficients `A`."""
    weights: dict[Tree, list[Number]] = {}
    branches: dict[Tree, list[Number]] = {}
    scalar: Any = next((type(a) for row in A for a in row), Fraction)
    zero, one = scalar(0), scalar(1)
    for nodes in range(1, size + 1):
        for tree in rooted_trees(nodes):
            phi = [prod((branches[t][i] for t in tree), start=one) for i in range(len(A))]
            weights[tree] = phi
            branches[tree] = [sum((a * p for a, p in zip(row, phi, strict=False) if a and p), zero) for row in A]
    return weights


def reached_order(weights: dict[Tree, list[Number]], b: Sequence[Number], tolerance: float = 0.0) -> int:
    """Return the order of the method with weights `b`, as far as the trees in `weights` can tell.

    Conditions count as satisfied to within `tolerance`.
    """
    wrong = (node_count(t) - 1 for t, phi in weights.items() if not _equal(_dot(b, phi), t, tolerance))
    return min(wrong, default=max(map(node_count, weights)))


def reached_dense_order(
    weights: dict[Tree, list[Number]], dense: Sequence[Sequence[Number]], tolerance: float = 0.0
) -> int:
    """Return the order of the extension b_i(theta) = sum_k dense[i][k] theta^(k+1), as far as `weights` can tell.

    It is p when sum_i b_i(theta) Phi_i(t) = theta^|t| / gamma(t) as polynomials for every tree of at most p nodes,
    to within `tolerance` for each coefficient.
    """
    columns = list(enumerate(zip(*dense, strict=True), 1))
    wrong = (
        node_count(t) - 1
        for t, phi in weights.items()
        if node_count(t) > len(columns)
        or any(not _equal(_dot(c, phi), t if k == node_count(t) else None, tolerance) for k, c in columns)
    )
    return min(wrong, default=max(map(node_count, weights)))


def _equal(value: Number, tree: Tree | None, tolerance: float) -> bool:
    """Tell whether `value` is 1 / gamma of the tree, or 0 without one."""
    wanted = Fraction(1, density(tree)) if tree is not None else Fraction(0)
    return bool(abs(value - wanted) <= tolerance)


def _dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    zero: Any = 0
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), zero)


# ----------------------------------------------------------------------------------------------------------------------

Weights = tuple[Fraction, ...]


_ROUNDING: Final = 1e-11  # of order conditions in floating point


@dataclass(frozen=True)
class Tableau:
    """A method in floating point, as the stepping loops in C and Python read it.

    `stages`, the last of them at the end point, make the step; those after it, up to s, serve the extension only.
    `A` (s, s), `c` (s,), `error` (stages,) or None, `coarse_error` (stages,) or None, `dense` (s, degree); `order` of
    the step, `error_order` of the estimated error; `end_in_error` tells that the estimate needs the last slope.
    """

    stages: int
    A: Floats
    c: Floats
    error: Floats | None
    coarse_error: Floats | None
    dense: Floats
    order: int
    error_order: int

    @property
    def end_in_error(self) -> bool:
        return any(e is not None and bool(e[-1] != 0.0) for e in (self.error, self.coarse_error))


@dataclass(frozen=True)
class RungeKutta:
    """An explicit Runge-Kutta method; construction raises ValueError unless every claim it makes is true.

        k_i = f(t + c_i h, x + h sum_j a_ij k_j),   x_new = x + h sum_j a_sj k_j,   k_s = f(t + h, x_new)
        x(t + theta h) = x + h sum_i b_i(theta) k_i,   b_i(theta) = sum_k dense[i][k] theta^(k+1)

    `A`: row i has i entries; the last row is b. `extra`: rows of the stages after the end point. `c`: nodes. `order`:
    of x_new. `error`: weights b - b_hat of the error estimate; None without one. `error_order`: that of b_hat, 0
    without an estimate. `coarse`: weights of a second estimate e3, of `coarse_order`; the first, e5, then counts as
    e5^2 / sqrt(e5^2 + 0.01 e3^2), which makes `error_order` twice that of b_hat less the coarse one. `dense_order`:
    the local error of the continuous extension is O(h^(dense_order + 1)). `decimals`: the coefficients are decimals,
    whose orders hold to rounding; else exactly.
    """

    name: str
    A: tuple[Weights, ...]
    c: Weights
    order: int
    dense: tuple[Weights, ...]
    dense_order: int
    error: Weights | None = None
    error_order: int = 0
    coarse: Weights | None = None
    coarse_order: int = 0
    extra: tuple[Weights, ...] = ()
    decimals: bool = False

    def __post_init__(self) -> None:
        rows = (*self.A, *self.extra)
        sums = [self._number(sum(row, Fraction(0))) - self._number(c) for row, c in zip(rows, self.c, strict=False)]
        for true, claim in (
            ([len(row) for row in rows] == list(range(len(rows))), "row i of A has i entries"),
            (len(self.c) == len(self.dense) == len(rows), "c and dense have one entry a stage"),
            (max(map(abs, sums)) <= self._tolerance, "c_i is the sum of row i of A"),
            (self.c[self.stages - 1] == 1, "the last stage is the end point"),
            ((self.error is None) == (self.error_order == 0), "an error estimate has an order"),
            (self.error is None or len(self.error) == self.stages, "error has one entry a stage"),
        ):
            self._require(true, claim)
        self._check_orders()

    def _check_orders(self) -> None:
        A, dense = (tuple(map(self._numbers, rows)) for rows in ((*self.A, *self.extra), self.dense))
        b = (*A[self.stages - 1], *[self._number(Fraction(0))] * (1 + len(self.extra)))
        weights, tolerance = stage_weights(A, self.order + 1), self._tolerance
        self._require(reached_order(weights, b, tolerance) == self.order, f"the order is {self.order}")
        for error, order in ((self.error, self.fine_order), (self.coarse, self.coarse_order)):
            if error is not None:
                b_hat = [x - e for x, e in zip(b, (*self._numbers(error), *b[self.stages :]), strict=True)]
                embedded = reached_order(weights, b_hat, tolerance)
                self._require(embedded == order < self.order, f"the embedded order is {order}")
        ends = [sum(row) - x for row, x in zip(dense, b, strict=True)]
        self._require(max(map(abs, ends)) <= tolerance, "the continuous extension ends at x_new")
        dense_order = reached_dense_order(weights, dense, tolerance)
        self._require(dense_order == self.dense_order, f"the continuous extension has order {self.dense_order}")

    def _require(self, true: bool, claim: str) -> None:
        if not true:
            raise ValueError(f"{self.name}: not true that {claim}")

    @property
    def _tolerance(self) -> float:
        return _ROUNDING if self.decimals else 0.0

    def _number(self, value: Fraction) -> Any:
        """Return a coefficient as it is checked: rational arithmetic on thirty decimals takes half a second."""
        return float(value) if self.decimals else value

    def _numbers(self, row: Weights) -> tuple[Any, ...]:
        return tuple(map(self._number, row))

    @property
    def stages(self) -> int:
        """The number of stages of a step, the end point included."""
        return len(self.A)

    @property
    def fine_order(self) -> int:
        """The order of b_hat."""
        return (self.error_order + self.coarse_order) // 2 if self.coarse else self.error_order

    @cached_property
    def tableau(self) -> Tableau:
        """The method in floating point."""
        rows = (*self.A, *self.extra)
        square = [[*row, *[0] * (len(rows) - len(row))] for row in rows]
        error, coarse = (None if e is None else np.array(e, dtype=float) for e in (self.error, self.coarse))
        return Tableau(
            stages=self.stages,
            A=np.array(square, dtype=float),
            c=np.array(self.c, dtype=float),
            error=error,
            coarse_error=coarse,
            dense=np.array(self.dense, dtype=float),
            order=self.order,
            error_order=self.error_order,
        )
