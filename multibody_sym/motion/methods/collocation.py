"""Collocation methods, which are implicit Runge-Kutta methods, as exact data that checks itself; `IMPLICIT` lists them.

The nodes alone define a method: the polynomial u of degree s with u(t) = x and u' = f(t, u) at the nodes t + c_i h. In
coefficients, with Lagrange's polynomials l_j of the nodes,

    a_ij = integral of l_j from 0 to c_i,   b_j = integral of l_j from 0 to 1

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 (simplifying conditions,
theorem 5.1 of Butcher) and IV.8 (the transformed Newton equations, the error estimate).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from math import isqrt
from types import MappingProxyType
from typing import Final

import numpy as np

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Exact numbers a + b sqrt(d) of one quadratic field: what the nodes of Gauss and Radau methods are made of.


_SCALE: Final = 10**40


@dataclass(frozen=True)
class Surd:
    """The number a + b sqrt(d), for a whole d that is no square; numbers of different d do not mix."""

    a: Fraction
    b: Fraction
    d: int

    def __add__(self, other: Surd | Fraction | int) -> Surd:
        y = self._alike(other)
        return Surd(self.a + y.a, self.b + y.b, self.d)

    def __neg__(self) -> Surd:
        return Surd(-self.a, -self.b, self.d)

    def __sub__(self, other: Surd | Fraction | int) -> Surd:
        return self + -self._alike(other)

    def __mul__(self, other: Surd | Fraction | int) -> Surd:
        y = self._alike(other)
        return Surd(self.a * y.a + self.d * self.b * y.b, self.a * y.b + self.b * y.a, self.d)

    def __truediv__(self, other: Surd | Fraction | int) -> Surd:
        y = self._alike(other)
        norm = y.a**2 - self.d * y.b**2
        return self * Surd(y.a / norm, -y.b / norm, self.d)

    def __pow__(self, n: int) -> Surd:
        result = self._alike(1)
        for _ in range(n):
            result = result * self
        return result

    def __float__(self) -> float:
        root = Fraction(isqrt(self.d * _SCALE**2), _SCALE)
        return float(self.a + self.b * root)

    def _alike(self, other: Surd | Fraction | int) -> Surd:
        if isinstance(other, Surd):
            assert other.d == self.d
            return other
        return Surd(Fraction(other), Fraction(0), self.d)


def surd(a: str, b: str = "0", d: int = 2) -> Surd:
    """Return a + b sqrt(d) from fractions in words, such as `1/2`; d does not matter where b is zero."""
    return Surd(Fraction(a), Fraction(b), d)


# ----------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Scheme:
    """A collocation method in floating point, as the steppers in C and Python read it; s stages that are not explicit.

    With z_i = u(t + c_i h) - x they solve  W z = h start f(t, x) + h f(t + c h, x + z),  x_new = x + end z.
    `W` (s, s) = `T` diag(gamma, [[alpha, -beta], [beta, alpha]]) `T`^-1, where what does not occur is left out and 0;
    `error` (s,) or None, and `filter`: (filter - h J) e = h f(t, x) + error z; `dense` (s, s): u(t + theta h) =
    x + sum_i z_i sum_k dense[i][k] theta^(k+1); `hermite`: between its ends a step is the cubic through them instead.
    """

    c: Floats
    W: Floats
    start: Floats
    end: Floats
    T: Floats
    T_inverse: Floats
    gamma: float
    alpha: float
    beta: float
    filter: float
    error: Floats | None
    dense: Floats
    hermite: bool


@dataclass(frozen=True)
class Collocation:
    """The collocation method with nodes `c`; construction raises ValueError unless its claims are exactly true.

    `order`: B(order) holds and B(order + 1) does not, C(s) and D(order - s - 1) hold, all in exact arithmetic. With
    `error_order` s there is an error estimate: the difference to a formula of order s with the same stages and f(t, x),
    through (filter - h J)^-1.
    """

    name: str
    c: tuple[Surd, ...]
    order: int
    error_order: int = 0

    def __post_init__(self) -> None:
        for true, claim in (
            (all(float(x) < float(y) for x, y in zip(self.c, self.c[1:], strict=False)), "the nodes increase"),
            (float(self.c[0]) >= 0.0 and float(self.c[-1]) <= 1.0, "the nodes lie in the step"),
            (all(self._b_holds(k) for k in range(1, self.order + 1)), f"B({self.order}) holds"),
            (not self._b_holds(self.order + 1), f"the order is {self.order}"),
            (all(self._c_holds(k) for k in range(1, self.stages + 1)), f"C({self.stages}) holds"),
            (all(self._d_holds(k) for k in range(1, self.order - self.stages)), "D holds as far as the order needs it"),
            (self.error_order in (0, self.stages), "an error estimate has the order of the stages"),
        ):
            if not true:
                raise ValueError(f"{self.name}: not true that {claim}")

    def _b_holds(self, k: int) -> bool:
        """Tell whether sum_i b_i c_i^(k-1) = 1/k."""
        return _dot(self.b, _powers(self.c, k - 1)) == _one(self.c) / k

    def _c_holds(self, k: int) -> bool:
        """Tell whether sum_j a_ij c_j^(k-1) = c_i^k / k."""
        powers = _powers(self.c, k - 1)
        return all(_dot(row, powers) == x**k / k for row, x in zip(self.A, self.c, strict=True))

    def _d_holds(self, k: int) -> bool:
        """Tell whether sum_i b_i c_i^(k-1) a_ij = b_j (1 - c_j^k) / k."""
        weights = [b * x for b, x in zip(self.b, _powers(self.c, k - 1), strict=True)]
        wanted = [b * (_one(self.c) - x**k) / k for b, x in zip(self.b, self.c, strict=True)]
        return [_dot(weights, column) for column in zip(*self.A, strict=True)] == wanted

    @property
    def stages(self) -> int:
        """The number of nodes."""
        return len(self.c)

    @cached_property
    def A(self) -> tuple[tuple[Surd, ...], ...]:
        """The coefficients (s, s), row by row."""
        return tuple(tuple(_integral(p, x) for p in _lagrange(self.c)) for x in self.c)

    @cached_property
    def b(self) -> tuple[Surd, ...]:
        """The weights (s,)."""
        return tuple(_integral(p, _one(self.c)) for p in _lagrange(self.c))

    @property
    def stiffly_accurate(self) -> bool:
        """Whether the last node is the end of the step."""
        return self.c[-1] == _one(self.c)

    @property
    def dense_order(self) -> int:
        """The order between the ends: that of the collocation polynomial, or of the cubic through both ends."""
        return min(self.order, 3) if self.scheme.hermite else self.stages

    @cached_property
    def scheme(self) -> Scheme:
        """The method in floating point."""
        explicit = int(float(self.c[0]) == 0.0)
        A, b, c = (np.array(x, dtype=float) for x in (self.A, self.b, self.c))
        A, first, c = A[explicit:, explicit:], A[explicit:, :explicit].sum(axis=1), c[explicit:]
        W = np.linalg.inv(A)
        end = np.array([*np.zeros(len(c) - 1), 1.0]) if self.stiffly_accurate else b @ W
        T, gamma, alpha, beta = _real_blocks(W)
        filter_ = gamma or float(np.hypot(alpha, beta))
        nodes = (self.c[0] * 0, *self.c[explicit:])
        dense = np.array([p[1:] for p in _lagrange(nodes)[1:]], dtype=float)
        return Scheme(
            c=c,
            W=W,
            start=W @ first,
            end=end,
            T=T,
            T_inverse=np.array(np.linalg.inv(T), dtype=float),
            gamma=gamma,
            alpha=alpha,
            beta=beta,
            filter=filter_,
            error=filter_ * self._error(W, 1.0 / filter_) if self.error_order else None,
            dense=dense,
            hermite=bool(explicit) or not self.stiffly_accurate,
        )

    def _error(self, W: Floats, at_start: float) -> Floats:
        """Return e with x_hat - x_new = h at_start f(t, x) + e z for the formula x_hat of order s."""
        powers = np.array([[float(x) ** k for x in self.c] for k in range(self.stages)])
        wanted = np.array([1.0 / (k + 1) for k in range(self.stages)])
        wanted[0] -= at_start
        weights: Floats = (np.linalg.solve(powers, wanted) - np.array(self.b, dtype=float)) @ W
        return weights


def _real_blocks(W: Floats) -> tuple[Floats, float, float, float]:
    """Return T, gamma, alpha, beta of W = T diag(gamma, [[alpha, -beta], [beta, alpha]]) T^-1."""
    values, vectors = np.linalg.eig(W)
    columns: list[Floats] = []
    gamma = alpha = beta = 0.0
    for value, vector in zip(values, vectors.T, strict=True):
        if abs(value.imag) < 1e-12:
            gamma = float(value.real)
            columns.insert(0, vector.real)
        elif value.imag > 0.0:
            alpha, beta = float(value.real), float(value.imag)
            columns += [vector.real, -vector.imag]
    return np.ascontiguousarray(np.array(columns).T), gamma, alpha, beta


def _lagrange(nodes: Sequence[Surd]) -> list[list[Surd]]:
    """Return the coefficients of Lagrange's polynomials of the nodes, lowest power first."""
    found = []
    for j, own in enumerate(nodes):
        polynomial = [_one(nodes)]
        for other in (*nodes[:j], *nodes[j + 1 :]):
            shifted = [_one(nodes) * 0, *polynomial]
            polynomial = [(x - y * other) / (own - other) for x, y in zip(shifted, [*polynomial, own * 0], strict=True)]
        found.append(polynomial)
    return found


def _integral(polynomial: Sequence[Surd], x: Surd) -> Surd:
    return _dot(polynomial, [x ** (k + 1) / (k + 1) for k in range(len(polynomial))])


def _powers(c: Sequence[Surd], k: int) -> list[Surd]:
    return [x**k for x in c]


def _dot(x: Sequence[Surd], y: Sequence[Surd]) -> Surd:
    total = x[0] * 0
    for a, b in zip(x, y, strict=True):
        total = total + a * b
    return total


def _one(c: Sequence[Surd]) -> Surd:
    return c[0] ** 0


IMPLICIT: Final[Mapping[str, Callable[[], Collocation]]] = MappingProxyType(
    {
        "implicit_euler": lambda: Collocation("implicit_euler", (surd("1"),), 1, error_order=1),
        "implicit_midpoint": lambda: Collocation("implicit_midpoint", (surd("1/2"),), 2),
        "trapezoid": lambda: Collocation("trapezoid", (surd("0"), surd("1")), 2),
        "gauss_4": lambda: Collocation("gauss_4", (surd("1/2", "-1/6", 3), surd("1/2", "1/6", 3)), 4),
        "gauss_6": lambda: Collocation(
            "gauss_6", (surd("1/2", "-1/10", 15), surd("1/2", "0", 15), surd("1/2", "1/10", 15)), 6
        ),
        "radau_3": lambda: Collocation("radau_3", (surd("1/3"), surd("1")), 3, error_order=2),
        "radau_5": lambda: Collocation(
            "radau_5", (surd("2/5", "-1/10", 6), surd("2/5", "1/10", 6), surd("1", "0", 6)), 5, error_order=3
        ),
    }
)
"""Each method by name, made when it is asked for."""

INDEX_2: Final = ("implicit_euler", "trapezoid", "radau_3", "radau_5")
"""Those whose last stage is the end of the step, so that rows that hold at the stages hold there too."""
