"""What is left of infinitely many impacts, all lower than rounding of positions: each flight on its parabola.

Gaps are added up by themselves, from impact to impact: a gap of 1e-20 m is known well that no position could tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Final

import numpy as np

from multibody_sym.dynamics.contact.contact_problem import PosedLaws
from multibody_sym.mechanics.law_elements import LawElement, Mode
from multibody_sym.mechanics.motion import coordinate_rates
from multibody_sym.motion.switching.law_values import LawValues
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_MOST: Final = 150
"""Impacts that are followed."""
_CYCLE: Final = 6
"""Flights that take as long, but for `_SHRINKS` of it, as those before them, and these too, do not come to an end.

Nor do so many that no longer move the time: one element hops in place while others fly on.
"""
_SHRINKS: Final = 0.99


@dataclass(frozen=True, eq=False)
class AfterImpact:
    """What holds once what touches has struck: `facts`, what stays closed, the laws, the accelerations (nu,), the mode.

    `udot` is None where the laws have no state.
    """

    facts: LawValues
    touching: list[str]
    problem: PosedLaws
    udot: Floats | None
    mode: Mode | None


Strike = Callable[[LawValues, list[str], Mode | None], AfterImpact]
"""Lets what touches strike, near a mode, if one was before."""


def rest_of(facts: LawValues, touching: Collection[str], taking: Collection[str], strike: Strike) -> LawValues | None:
    """Return the end of all impacts of `taking` that begin with those of what is `touching`; None where none is met."""
    gaps = {x.name: 0.0 if x.name in touching else max(facts.gap(x), 0.0) for x in facts.laws.named(taking)}
    now, flights, mode = facts, list[float](), None
    for _ in range(_MOST):
        met = strike(now, [name for name, gap in gaps.items() if gap == 0.0], mode)
        mode = met.mode
        if met.udot is None:
            return None
        off = [x for x in met.facts.laws.named(gaps) if gaps[x.name] or x.name not in met.touching]
        flying = {x.name: Fall.of(met.facts, x, gaps[x.name], met.udot) for x in off}
        if not flying:
            return met.facts
        first = min(flying, key=lambda name: flying[name].left)
        left = flying[first].left
        stops = _time_to_stop(met, left)
        flights.append(min(left, stops))
        oldest, before, last = (sum(flights[k * _CYCLE : (k + 1) * _CYCLE or None]) for k in (-3, -2, -1))
        goes_on = len(flights) >= 3 * _CYCLE and last > _SHRINKS * before and before > _SHRINKS * oldest
        hops = len(flights) >= _CYCLE and met.facts.t + last == met.facts.t
        if not math.isfinite(left) or goes_on or hops:
            return None
        now = _after_flight(met, flights[-1])
        gaps |= {name: fall.gap(flights[-1]) for name, fall in flying.items()}
        gaps |= {first: 0.0} if left <= stops else {}
    return None


@dataclass(frozen=True)
class Fall:
    """The gap (m) of an element that flies, its rate (m/s) and how fast this falls (m/s^2)."""

    start: float
    rate: float
    falling: float

    @staticmethod
    def of(facts: LawValues, element: LawElement, gap: float, udot: Floats) -> Fall:
        """Return how an element flies from a gap (m) on, under accelerations (nu,); what is rounding of rest rests."""
        rate = facts.rate(element) if gap > 0.0 or facts.sense(element) else 0.0
        return Fall(gap, rate, facts.falling(element, udot))

    @property
    def left(self) -> float:
        """How long (s) it flies on, infinitely long where it does not come back."""
        room = self.rate * self.rate + 2.0 * self.falling * self.start
        if room < 0.0 or not (self.falling > 0.0 or self.rate < 0.0):
            return math.inf
        root = math.sqrt(room)
        if self.rate > 0.0:
            return (self.rate + root) / self.falling
        return 2.0 * self.start / (root - self.rate) if root > self.rate else 0.0  # it touches already

    def gap(self, time: float) -> float:
        """Return the gap after a time (s)."""
        return max(self.start + self.rate * time - 0.5 * self.falling * time * time, 0.0)


def _after_flight(met: AfterImpact, time: float) -> LawValues:
    """Return the values of the laws after a flight of some time (s)."""
    facts, udot = met.facts, met.udot
    assert udot is not None
    mean, u = facts.u + 0.5 * time * udot, facts.u + time * udot
    rates = coordinate_rates(facts.laws.mechanism, facts.q.tolist(), mean.tolist())
    return facts.laws.at(facts.t + time, facts.q + time * np.array(rates, dtype=float), u, facts.scale)


def _time_to_stop(met: AfterImpact, most: float) -> float:
    """Return after which time (s), up to `most`, slip in the plane stops first, `most` where none does."""
    facts, udot = met.facts, met.udot
    assert udot is not None
    for part, law in zip(met.problem.parts, met.problem.problem.parts, strict=True):
        if law.rests or len(part.rows) != 1:
            continue
        place = facts.place(part.rows[0])
        speed = float(facts.known["phidot"][place])
        rate = float(facts.accelerations([place], udot)[0])
        if speed * rate < 0.0:
            most = min(most, -speed / rate)
    return most
