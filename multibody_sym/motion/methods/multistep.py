"""Implicit Runge-Kutta and multistep methods as exact data that checks itself; `IMPLICIT`, `MULTISTEP` make them.

`MULTISTEP` makes each of them by name. What they need of the past is made by steps of order 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import count
from math import comb, isqrt
from types import MappingProxyType
from typing import Final

import numpy as np

from multibody_sym.motion.methods.explicit import Tableau, dormand_prince_8
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Collocation methods, which are implicit Runge-Kutta methods, as exact data that checks itself; `IMPLICIT` lists them.
#
# The nodes alone define a method: the polynomial u of degree s with u(t) = x and u' = f(t, u) at the nodes t + c_i h.
# In coefficients, with Lagrange's polynomials l_j of the nodes,
#
#     a_ij = integral of l_j from 0 to c_i,   b_j = integral of l_j from 0 to 1
#
# Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 (simplifying conditions,
# theorem 5.1 of Butcher) and IV.8 (the transformed Newton equations, the error estimate).


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


# ----------------------------------------------------------------------------------------------------------------------
# Methods of constant step as exact data that checks itself: Adams-Bashforth-Moulton, Stoermer's, Stoermer-Verlet.


Weights = tuple[Fraction, ...]


@dataclass(frozen=True)
class Multistep:
    """A method that looks back over `past` steps of one length; `starter` makes them."""

    name: str
    order: int

    @property
    def error_order(self) -> int:
        """0: no error is estimated."""
        return 0

    @property
    def past(self) -> int:
        """The number of steps before the present one that a step needs."""
        return 0

    @cached_property
    def starter(self) -> Tableau:
        """The method of order 8 that takes the steps for which there is no past."""
        return dormand_prince_8().tableau

    @cached_property
    def tables(self) -> Mapping[str, Floats]:
        """The weights in floating point (past + 1,) by name, filled up with zeros."""
        given = {name: getattr(self, name, ()) for name in ("position", "predictor", "corrector")}
        zeros = (Fraction(0),) * (self.past + 1)
        return {
            name: np.array((weights + zeros)[: self.past + 1], dtype=float)
            for name, weights in given.items()
            if weights
        }

    def _require(self, reached: int, wanted: int, what: str) -> None:
        if reached != wanted:
            raise ValueError(f"{self.name}: not true that {what} has order {wanted}; it has {reached}")


@dataclass(frozen=True)
class AdamsBashforthMoulton(Multistep):
    """Predict, evaluate, correct, evaluate, with f_j the slope j steps back.

        x* = x_n + h sum_j predictor[j] f_j
        x_{n+1} = x_n + h (corrector[0] f(t_{n+1}, x*) + sum_j corrector[j + 1] f_j)

    Construction raises ValueError unless both have the order.
    """

    predictor: Weights
    corrector: Weights

    def __post_init__(self) -> None:
        self._require(_adams_order(self.predictor, 0), self.order, "the predictor")
        self._require(_adams_order(self.corrector, 1), self.order, "the corrector")

    @property
    def past(self) -> int:
        return len(self.predictor) - 1


@dataclass(frozen=True)
class Stoermer(Multistep):
    """Stoermer's method for q'' = f, here with f that depends on q' too; f_j is f j steps back.

        q_{n+1} = 2 q_n - q_{n-1} + h^2 sum_j position[j] f_j
        h q'* = q_{n+1} - q_n + h^2 sum_j predictor[j] f_j
        h q'_{n+1} = q_{n+1} - q_n + h^2 (corrector[0] f(q_{n+1}, q'*) + sum_j corrector[j + 1] f_j)

    Construction raises ValueError unless all have the order.
    """

    position: Weights
    predictor: Weights
    corrector: Weights

    def __post_init__(self) -> None:
        self._require(_stoermer_order(self.position), self.order, "the position")
        self._require(_speed_order(self.predictor, 0), self.order, "the predictor of speeds")
        self._require(_speed_order(self.corrector, 1), self.order, "the corrector of speeds")

    @property
    def past(self) -> int:
        return len(self.position) - 1


@dataclass(frozen=True)
class StoermerVerlet(Multistep):
    """Velocity Verlet for q'' = f, with the speed at the end predicted where f depends on it.

        q_{n+1} = q_n + h q'_n + h^2/2 f_n,   q'* = q'_n + h f_n
        q'_{n+1} = q'_n + h/2 (f_n + f(q_{n+1}, q'*))

    Where f depends on q alone this is symplectic and symmetric.
    """


# --- orders --------------------------------------------------------------------------------------------------------


def _slope(power: int, ahead: int, weights: Weights, derivative: int) -> Fraction:
    """Return the weighted sum of a derivative of t^power at t = ahead, ahead - 1, ..."""
    factor = power if derivative == 1 else power * (power - 1)
    left = power - derivative
    values = (Fraction(ahead - j) ** left for j in range(len(weights)))
    return factor * sum((w * v for w, v in zip(weights, values, strict=True)), Fraction(0))


def _adams_order(weights: Weights, ahead: int) -> int:
    """Return up to which power of t  x(1) - x(0) = sum_j weights[j] x'(ahead - j)."""
    return next(m - 1 for m in count(1) if _slope(m, ahead, weights, 1) != 1)


def _stoermer_order(weights: Weights) -> int:
    """Return m - 2 for the highest power m of t with  q(1) - 2 q(0) + q(-1) = sum_j weights[j] q''(-j), less one."""
    return next(m - 2 for m in count(2) if _slope(m, 0, weights, 2) != 1 + (-1) ** m)


def _speed_order(weights: Weights, ahead: int) -> int:
    """Return up to which power of t  q'(1) = q(1) - q(0) + sum_j weights[j] q''(ahead - j)."""
    return next(m - 1 for m in count(2) if _slope(m, ahead, weights, 2) != m - 1)


# --- coefficients --------------------------------------------------------------------------------------------------


def _from_differences(coefficients: Sequence[str]) -> Weights:
    """Return weights of values f_0, f_-1, ... from those of the backward differences D0 f, D1 f, ..."""
    weights = [Fraction(0)] * len(coefficients)
    for k, coefficient in enumerate(coefficients):
        for j in range(k + 1):
            weights[j] += Fraction(coefficient) * (-1) ** j * comb(k, j)
    return tuple(weights)


MULTISTEP: Final[Mapping[str, Callable[[], Multistep]]] = MappingProxyType(
    {
        "adams_bashforth_moulton": lambda: AdamsBashforthMoulton(
            name="adams_bashforth_moulton",
            order=4,
            predictor=_from_differences(("1", "1/2", "5/12", "3/8")),
            corrector=_from_differences(("1", "-1/2", "-1/12", "-1/24")),
        ),
        "stoermer_6": lambda: Stoermer(
            name="stoermer_6",
            order=6,
            position=_from_differences(("1", "0", "1/12", "1/12", "19/240", "3/40")),
            predictor=_from_differences(("1/2", "1/3", "7/24", "97/360", "367/1440")),
            corrector=_from_differences(("1/2", "-1/6", "-1/24", "-1/45", "-7/480")),
        ),
        "stoermer_verlet": lambda: StoermerVerlet("stoermer_verlet", 2),
    }
)
