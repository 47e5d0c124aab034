"""Steps of explicit Runge-Kutta methods; `explicit.c` is the same in C."""

from __future__ import annotations

import numpy as np

from multibody_sym.integrators.flow import Flow, Step, Trial, combination, require_finite
from multibody_sym.integrators.methods.runge_kutta import Tableau
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class ExplicitStepper:
    """An explicit Runge-Kutta method at work; the stages of a trial are the slopes k."""

    tableau: Tableau
    flow: Flow

    def restart(self) -> None:
        """Do nothing: a step knows nothing of those before."""

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> Trial:
        """Return a step; the last slope is among its stages only if the error estimate needs it."""
        tableau, k, end = self.tableau, [slope], self.tableau.stages - 1
        self._extend(t, x, h, k, end)
        x_new = x + h * combination(tableau.A[end, :end], k)
        require_finite(x_new, t_new)
        if tableau.end_in_error:
            k.append(self.flow.slope(t_new, x_new))
        weights = (tableau.error, tableau.coarse_error) if self.flow.step is None else (None, None)
        error, coarse = (None if w is None else h * combination(w[: len(k)], k) for w in weights)
        return Trial(t, x, slope, h, t_new, x_new, error, k, coarse)

    def _extend(self, t: float, x: Floats, h: float, k: list[Floats], count: int) -> None:
        """Add the slopes of further stages to `k` until there are `count`."""
        for stage in range(len(k), count):
            at = x + h * combination(self.tableau.A[stage, :stage], k)
            k.append(self.flow.slope(t + float(self.tableau.c[stage]) * h, at))

    def finish(self, trial: Trial, x_new: Floats) -> Step:
        """Return the step with the slope at its end; a changed end needs one of its own."""
        k = trial.stages
        if not self.tableau.end_in_error:
            slope_new = self.flow.slope(trial.t_new, x_new)
            k = [*k, slope_new]
        else:
            kept = np.array_equal(x_new, trial.x_new)
            slope_new = k[-1] if kept else self.flow.slope(trial.t_new, x_new)

        def value(theta: float) -> Floats:
            self._extend(trial.t, trial.x, trial.h, k, len(self.tableau.c))
            weights = np.zeros(len(k))
            for column in self.tableau.dense.T[::-1]:
                weights = (weights + column) * theta
            return trial.x + trial.h * combination(weights, k)

        return Step(trial.t, trial.x, trial.h, trial.t_new, x_new, slope_new, value)

    def advance(self, step: Step) -> None:
        """Do nothing: a step knows nothing of those before."""
