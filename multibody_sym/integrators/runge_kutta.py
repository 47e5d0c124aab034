"""Explicit Runge-Kutta methods as exact data that checks itself; `EXPLICIT` lists them.

Every method is kept with its end point as last stage: the last row of `A` is b, so the last slope is f(t + h, x_new).
It costs nothing, because it is the first slope of the next step, and it lets one loop serve all methods: error
estimates and continuous extensions are weights over the same stages, with or without "first same as last".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.integrators.order_conditions import reached_dense_order, reached_order, stage_weights

Weights = tuple[Fraction, ...]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Tableau:
    """A method in floating point, as the stepping loops in C and Python read it; s stages, the last at the end point.

    `A` (s, s), `c` (s,), `error` (s,) or None, `dense` (s, degree); `order` of the step, `error_order` of the
    embedded solution; `end_in_error` tells that the error estimate needs the last slope.
    """

    A: Floats
    c: Floats
    error: Floats | None
    dense: Floats
    order: int
    error_order: int

    @property
    def end_in_error(self) -> bool:
        return self.error is not None and bool(self.error[-1] != 0.0)


@dataclass(frozen=True)
class RungeKutta:
    """An explicit Runge-Kutta method; construction raises ValueError unless every claim it makes is exactly true.

        k_i = f(t + c_i h, x + h sum_j a_ij k_j),   x_new = x + h sum_j a_sj k_j,   k_s = f(t + h, x_new)
        x(t + theta h) = x + h sum_i b_i(theta) k_i,   b_i(theta) = sum_k dense[i][k] theta^(k+1)

    `A`: row i has i entries; the last row is b. `c`: nodes. `order`: of x_new. `error`: weights b - b_hat of the
    error estimate, whose b_hat has order `error_order`; None and 0 without one. `dense_order`: the local error of
    the continuous extension is O(h^(dense_order + 1)).
    """

    name: str
    A: tuple[Weights, ...]
    c: Weights
    order: int
    dense: tuple[Weights, ...]
    dense_order: int
    error: Weights | None = None
    error_order: int = 0

    def __post_init__(self) -> None:
        for true, claim in (
            ([len(row) for row in self.A] == list(range(self.stages)), "row i of A has i entries"),
            (len(self.c) == len(self.dense) == self.stages, "c and dense have one entry a stage"),
            (list(self.c) == [sum(row, Fraction(0)) for row in self.A], "c_i is the sum of row i of A"),
            (self.c[-1:] == (Fraction(1),), "the last stage is the end point"),
            ((self.error is None) == (self.error_order == 0), "an error estimate has an order"),
            (self.error is None or len(self.error) == self.stages, "error has one entry a stage"),
        ):
            self._require(true, claim)
        self._check_orders()

    def _check_orders(self) -> None:
        weights = stage_weights(self.A, self.order + 1)
        b = (*self.A[-1], Fraction(0))
        self._require(reached_order(weights, b) == self.order, f"the order is {self.order}")
        if self.error is not None:
            b_hat = [x - e for x, e in zip(b, self.error, strict=True)]
            embedded = reached_order(weights, b_hat)
            self._require(embedded == self.error_order < self.order, f"the embedded order is {self.error_order}")
        self._require(tuple(map(sum, self.dense)) == b, "the continuous extension ends at x_new")
        dense_order = reached_dense_order(weights, self.dense)
        self._require(dense_order == self.dense_order, f"the continuous extension has order {self.dense_order}")

    def _require(self, true: bool, claim: str) -> None:
        if not true:
            raise ValueError(f"{self.name}: not true that {claim}")

    @property
    def stages(self) -> int:
        """The number of stages, the end point included."""
        return len(self.A)

    @cached_property
    def tableau(self) -> Tableau:
        """The method in floating point."""
        square = [[*row, *[0] * (self.stages - len(row))] for row in self.A]
        error = None if self.error is None else np.array(self.error, dtype=float)
        return Tableau(
            A=np.array(square, dtype=float),
            c=np.array(self.c, dtype=float),
            error=error,
            dense=np.array(self.dense, dtype=float),
            order=self.order,
            error_order=self.error_order,
        )


def hermite(b: Sequence[Fraction]) -> tuple[Weights, ...]:
    """Return the cubic Hermite interpolant of x and f at both ends as an extension of weights `b` (end included).

    b_i(theta) = theta^2 (3 - 2 theta) b_i, plus theta (1 - theta)^2 for the first and theta^2 (theta - 1) for the
    last stage: order 3, or that of b if lower.
    """
    zero, one = Fraction(0), Fraction(1)
    rows = [[zero, 3 * x, -2 * x] for x in b]
    rows[0] = [r + e for r, e in zip(rows[0], (one, -2 * one, one), strict=True)]
    rows[-1] = [r + e for r, e in zip(rows[-1], (zero, -one, one), strict=True)]
    return tuple(map(tuple, rows))


def _quartic(b: Sequence[Fraction], d: Sequence[Fraction]) -> tuple[Weights, ...]:
    """Return the Hermite extension of `b` plus theta^2 (1 - theta)^2 d_i."""
    return tuple((linear, square + x, cube - 2 * x, x) for (linear, square, cube), x in zip(hermite(b), d, strict=True))


def _row(text: str) -> Weights:
    return tuple(map(Fraction, text.split()))


def _method(name: str, order: int, A: str, b_hat: str = "", error_order: int = 0) -> RungeKutta:
    """Return a method from the rows of `A` after the first (empty) one, separated by `;`, with Hermite extension."""
    rows = ((), *map(_row, A.split(";")))
    b = (*rows[-1], Fraction(0))
    return RungeKutta(
        name=name,
        A=rows,
        c=tuple(sum(row, Fraction(0)) for row in rows),
        order=order,
        dense=hermite(b),
        dense_order=min(order, 3),
        error=tuple(x - y for x, y in zip(b, _row(b_hat), strict=True)) if b_hat else None,
        error_order=error_order,
    )


def _dormand_prince() -> RungeKutta:
    """Return the 5(4) pair of J. R. Dormand and P. J. Prince (J. Comput. Appl. Math. 6, 1980), extended with order 4.

    The extensions of order 4 that share x and f with the step at both ends form one family, in the last number of
    d; taken is the member whose fifth-order error coefficients have the least mean square over the step. It is the
    one L. F. Shampine chose (Math. Comp. 46, 1986).
    """
    rows = (
        (),
        _row("1/5"),
        _row("3/40 9/40"),
        _row("44/45 -56/15 32/9"),
        _row("19372/6561 -25360/2187 64448/6561 -212/729"),
        _row("9017/3168 -355/33 46732/5247 49/176 -5103/18656"),
        _row("35/384 0 500/1113 125/192 -2187/6784 11/84"),
    )
    b = (*rows[-1], Fraction(0))
    b_hat = _row("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40")
    d = _row(
        "-12715105075/11282082432 0 87487479700/32700410799 -10690763975/1880347072"
        " 701980252875/199316789632 -1453857185/822651844 69997945/29380423"
    )
    return RungeKutta(
        name="dormand_prince",
        A=rows,
        c=_row("0 1/5 3/10 4/5 8/9 1 1"),
        order=5,
        dense=_quartic(b, d),
        dense_order=4,
        error=tuple(x - y for x, y in zip(b, b_hat, strict=True)),
        error_order=4,
    )


EXPLICIT: Final = (
    _method("explicit_euler", 1, "1"),
    _method("midpoint", 2, "1/2; 0 1"),
    _method("heun", 2, "1; 1/2 1/2"),
    _method("rk4", 4, "1/2; 0 1/2; 0 0 1; 1/6 1/3 1/3 1/6"),
    _method("bogacki_shampine", 3, "1/2; 0 3/4; 2/9 1/3 4/9", "7/24 1/4 1/3 1/8", 2),
    _dormand_prince(),
)
