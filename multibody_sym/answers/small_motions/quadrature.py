"""The period of one freedom whose energy is conserved, by quadrature: T is the integral of dq/u over a swing or a turn.

With u^2 = 2 (E - V(q))/M(q) between turning points c - a and c + a, and q = c + a sin(s), the integrand a cos(s)/u is
smooth and periodic in s, as 1/u is for what goes around: equal steps converge faster than any power of their number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.kinematics.energy import kinetic_energy, moved_by_time, potential_energy, working, works_unseen
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass

_FEWEST: Final = 32
_MOST: Final = 4096
_CONVERGED: Final = 1e-12
_BESIDE: Final = 1e-3
"""The part of a swing beside a turn, as a run tells it, within which it is looked for."""
_ROUNDED: Final = 4 * 2.3e-16
_WORTH: Final = 1e-12
"""How well it is known where it is told: runs are good to about 1e-11."""


@dataclass(frozen=True)
class Energy:
    """The energy of one freedom, (M(q) u^2)/2 + V(q), in the motion from a start."""

    mechanism: Mechanism
    begin: Start

    @classmethod
    def of(cls, system: System, coordinate: str) -> Energy | None:
        """Return the energy of a system, None where its one freedom is another, or something does work."""
        state = examined_state(system)
        mechanism, begin = state.in_joints
        one = len(mechanism.coordinates) == len(mechanism.speeds) == 1 and not mechanism.rows
        if not one or mechanism.coordinates[0].name != coordinate or state.declared.one_way or mechanism.inputs:
            return None
        if working(mechanism) or works_unseen(mechanism) or moved_by_time(mechanism):
            return None
        found = cls(mechanism, begin)
        return found if found.parts(begin.q[0], 0.0)[0] == 0.0 else None

    def parts(self, q: float, u: float) -> tuple[float, float]:
        """Return kinetic and potential energy."""
        motion = motion_of(self.mechanism, state_of(self.mechanism, float, 0.0, [q], [u], list(self.begin.parameters)))
        return float(kinetic_energy(motion)), float(potential_energy(motion))

    def square(self, q: float) -> float:
        """Return u^2 at a place, negative where the motion does not come."""
        moving, stored = self.parts(q, 1.0)
        q0, u0 = self.begin.q[0], self.begin.u[0]
        first = self.parts(q0, u0)
        return (first[0] + (first[1] - stored)) / moving

    def of_swing(self, low: float, high: float) -> tuple[float, float] | None:
        """Return the period between turns that a run tells, and the part by which steps twice as long miss it."""
        ends = [self._turn(low, high - low, -1.0), self._turn(high, high - low, 1.0)]
        if ends[0] is None or ends[1] is None:
            return None
        middle, half = (ends[0] + ends[1]) / 2, (ends[1] - ends[0]) / 2
        found = _converged(lambda s: 2 * half * math.cos(s) / math.sqrt(self.square(middle + half * math.sin(s))))
        return self._known(found, middle)

    def of_turn(self) -> tuple[float, float] | None:
        """Return the time in which an angle that goes around advances by 2 pi."""
        q0 = self.begin.q[0]
        return self._known(_converged(lambda s: 2 / math.sqrt(self.square(q0 + 2 * s))), q0)

    def _known(self, found: tuple[float, float] | None, middle: float) -> tuple[float, float] | None:
        """Return what was found with what rounding makes of E - V in it; None where runs know it better."""
        if found is None:
            return None
        total = sum(map(abs, (*self.parts(self.begin.q[0], self.begin.u[0]), self.parts(middle, 0.0)[1])))
        rounded = _ROUNDED * total / (self.square(middle) * self.parts(middle, 1.0)[0])
        missed = max(found[1], rounded)
        return (found[0], missed) if missed <= _WORTH else None

    def _turn(self, near: float, size: float, side: float) -> float | None:
        """Return the turning point near a place; the start itself where it is at rest there."""
        q0, u0 = self.begin.q[0], self.begin.u[0]
        if u0 == 0.0 and abs(q0 - near) <= _BESIDE * size:
            return float(q0)
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        inside, outside = near - side * _BESIDE * size, near + side * _BESIDE * size
        if not self.square(inside) > 0.0 > self.square(outside):
            return None
        return float(brentq(self.square, inside, outside, xtol=_ROUNDED * abs(near) or _ROUNDED, rtol=_ROUNDED))


def _converged(f: Callable[[float], float]) -> tuple[float, float] | None:
    """Return the integral of a function over -pi/2 .. pi/2, of which it has the period pi, and how far it converged."""
    count, before = _FEWEST, math.inf
    best: tuple[float, float] | None = None
    while count <= _MOST:
        step = math.pi / count
        try:
            total = step * math.fsum(f(-math.pi / 2 + (k + 0.5) * step) for k in range(count))
        except (ValueError, *UNDEFINED):
            return best
        missed = abs(total - before) / total
        if best is not None and missed <= _CONVERGED:
            return total, missed
        best = (total, missed)
        count, before = 2 * count, total
    return best if best is not None and best[1] <= math.sqrt(_CONVERGED) else None
