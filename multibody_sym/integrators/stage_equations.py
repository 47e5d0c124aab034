"""What the stages of an implicit method solve: differential equations, with constraint rows among them or without."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class StageEquations:
    """x' = F(t, x, z), 0 = G(t, x) of n states and m multipliers, as E y' = f(t, y) with y = (x, z), f = (F, G).

    F is linear in z, and G_x F_z regular but for dependent rows of G: index 2. Without rows m = 0, an ordinary
    differential equation. `values(t, y)` is f (n + m,), `jacobian(t, y)` its derivative by y, `multipliers(t, x)` (m,)
    are those to begin with, and `kept(jacobian)` tells which of the m rows, and of the multipliers in their places,
    are independent; the other multipliers are zero. `found(t, x)` is told of each stage of a trial.
    """

    values: Callable[[float, Floats], Floats]
    jacobian: Callable[[float, Floats], Floats]
    multipliers: Callable[[float, Floats], Floats]
    kept: Callable[[Floats], Sequence[int]]
    found: Callable[[float, Floats], None] = lambda t, x: None


def ordinary(
    derivative: Callable[[float, Floats], Floats], jacobian: Callable[[float, Floats], Floats]
) -> StageEquations:
    """Return x' = derivative(t, x) as equations without rows."""
    none = np.zeros(0)
    return StageEquations(derivative, jacobian, lambda t, x: none, lambda J: ())
