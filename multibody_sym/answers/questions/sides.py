"""Values of what is asked along a run, each on its own side of what bends or jumps there."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.answers.questions.bends import Crossing
from multibody_sym.answers.questions.simulated_motion import ASKED
from multibody_sym.kinematics.state import state_of
from multibody_sym.numerics.arrays import Floats
from multibody_sym.simulation.along.adding import Adding, told
from multibody_sym.simulation.along.fine import FineLeg
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.told import Alone, Told
from multibody_sym.simulation.trajectory import Trajectory

_ROUNDED: Final = 1e-15


class Sides:
    """What is asked along a run, from its own stretches: another run would have its changes at times a little off."""

    def __init__(self, run: Trajectory) -> None:
        self._run, self._asked = run, run.ready.mechanism
        self._stretches = [x for x in run.stretches if x.duration > 0.0]
        self._starts = np.array([x.problem.start for x in self._stretches])
        self._times: dict[Crossing, float] = {}

    def value(self, t: float) -> float:
        """Return the value at a time."""
        return self._value(self._at(t), t)

    def beside(self, change: float, side: int) -> float:
        """Return the value before (side < 0) or behind a change of state.

        Its time is when it was, which may be a little off that at which a stretch ended and the next began.
        """
        k = int(np.argmin(np.abs(self._starts - change)))
        if side > 0 or k == 0:
            return self._value(k, max(change, float(self._starts[k])))
        return self._value(k - 1, self._stretches[k - 1].until)

    def _value(self, k: int, t: float) -> float:
        """Return the value at a time in a stretch."""
        stretch = self._stretches[k]
        time, q, u = self._state(stretch, t)
        own = Told(Alone(stretch.mechanism)), stretch.compiled, stretch.problem.parameters
        part = Part(*own, np.array([time]), q[None], u[None], stretch.problem.modes)
        if ASKED in part.told.outputs:
            return float(part.evaluated("outputs")[0][0, part.told.outputs.index(ASKED)])
        if ASKED not in self._asked.run_outputs:
            return float("nan")
        adding, middle = Adding(self._asked.run_outputs), stretch.problem.start + stretch.duration / 2
        jumps = [] if self._run.modes is None else self._run.modes.added(adding.leaves)
        before = [(-np.inf, more) for at, more in jumps if at < middle]
        return float(told(adding, self._run.stretches, [part], before)[ASKED][0])

    def when(self, crossing: Crossing) -> float:
        """Return when a function crosses zero, to rounding."""
        if crossing not in self._times:
            self._times[crossing] = self._crossed(crossing)
        return self._times[crossing]

    def _crossed(self, crossing: Crossing) -> float:
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        def value(t: float) -> float:
            stretch = self._stretches[self._at(t)]
            time, q, u = self._state(stretch, t)
            known = time, q.tolist(), u.tolist(), self._run.parameters.tolist()
            return float(state_of(stretch.mechanism, float, *known).values([crossing.function])[0])

        low, high = crossing.between
        if not value(low) * value(high) < 0.0:
            return crossing.t
        return float(brentq(value, low, high, xtol=_ROUNDED * high, rtol=4.0 * np.finfo(float).eps))

    def _at(self, t: float) -> int:
        """Return the number of the stretch at a time."""
        return max(int(np.searchsorted(self._starts, t, side="right")) - 1, 0)

    @staticmethod
    def _state(stretch: FineLeg, t: float) -> tuple[float, Floats, Floats]:
        """Return a time in a stretch, and the coordinates and speeds then."""
        time, problem = min(t, stretch.until), stretch.problem
        return max(time, problem.start), *stretch.at(time)
