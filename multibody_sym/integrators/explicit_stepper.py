"""Steps of explicit Runge-Kutta methods; `explicit.c` is the same in C."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from multibody_sym.integrators.flow import Floats, Flow, Step, Trial, combination, require_finite
from multibody_sym.integrators.runge_kutta import Tableau


@dataclass(frozen=True)
class ExplicitStepper:
    """An explicit Runge-Kutta method at work; the stages of a trial are the slopes k."""

    tableau: Tableau
    flow: Flow

    def restart(self) -> None:
        """Do nothing: a step knows nothing of those before."""

    def attempt(self, t: float, x: Floats, slope: Floats, h: float, t_new: float) -> Trial:
        """Return a step; the last slope is among its stages only if the error estimate needs it."""
        tableau, k = self.tableau, [slope]
        for stage in range(1, len(tableau.c) - 1):
            at = x + h * combination(tableau.A[stage, :stage], k)
            k.append(self.flow.slope(t + float(tableau.c[stage]) * h, at))
        x_new = x + h * combination(tableau.A[-1, :-1], k)
        require_finite(x_new, t_new)
        if tableau.end_in_error:
            k.append(self.flow.slope(t_new, x_new))
        adaptive = self.flow.step is None and tableau.error is not None
        error = h * combination(tableau.error[: len(k)], k) if adaptive and tableau.error is not None else None
        return Trial(t, x, slope, h, t_new, x_new, error, k)

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
            weights = np.zeros(len(k))
            for column in self.tableau.dense.T[::-1]:
                weights = (weights + column) * theta
            return trial.x + trial.h * combination(weights, k)

        return Step(trial.t, trial.x, trial.h, trial.t_new, x_new, slope_new, value)

    def advance(self, step: Step) -> None:
        """Do nothing: a step knows nothing of those before."""
