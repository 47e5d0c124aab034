"""Methods of constant step as exact data that checks itself: Adams-Bashforth-Moulton, Stoermer's, Stoermer-Verlet.

`MULTISTEP` makes each of them by name. What they need of the past is made by steps of order 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import count
from math import comb
from types import MappingProxyType
from typing import Final

import numpy as np

from multibody_sym.motion.methods.explicit import dormand_prince_8
from multibody_sym.motion.methods.runge_kutta import Tableau
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

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


def _adams_bashforth_moulton() -> AdamsBashforthMoulton:
    """Return the method of order 4; any textbook has its coefficients."""
    return AdamsBashforthMoulton(
        name="adams_bashforth_moulton",
        order=4,
        predictor=_from_differences(("1", "1/2", "5/12", "3/8")),
        corrector=_from_differences(("1", "-1/2", "-1/12", "-1/24")),
    )


def _stoermer_6() -> Stoermer:
    return Stoermer(
        name="stoermer_6",
        order=6,
        position=_from_differences(("1", "0", "1/12", "1/12", "19/240", "3/40")),
        predictor=_from_differences(("1/2", "1/3", "7/24", "97/360", "367/1440")),
        corrector=_from_differences(("1/2", "-1/6", "-1/24", "-1/45", "-7/480")),
    )


MULTISTEP: Final[Mapping[str, Callable[[], Multistep]]] = MappingProxyType(
    {
        "adams_bashforth_moulton": _adams_bashforth_moulton,
        "stoermer_6": _stoermer_6,
        "stoermer_verlet": lambda: StoermerVerlet("stoermer_verlet", 2),
    }
)
