"""When one contact has been compressed, and when it lets go: by speeds, by impulses or by works."""

from __future__ import annotations

import math
from typing import Literal

from multibody_sym.dynamics.impacts.problem import ImpactLaw
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Normal:
    """The normal state on the way: the speed v, the impulse p so far, and its work W."""

    v: float
    p: float = 0.0
    W: float = 0.0

    def on(self, dp: float, rate: float) -> Normal:
        """Return the state dp later, while v' = rate."""
        return Normal(self.v + rate * dp, self.p + dp, self.W + self.v * dp + rate * dp * dp / 2.0)


@dataclass(frozen=True)
class Goal:
    """Where a stage ends: at a value of v, p or W."""

    what: Literal["v", "p", "W"]
    value: float

    def missing(self, at: Normal) -> float:
        """Return what is missing: the stage has ended where nothing is."""
        return self.value - {"v": at.v, "p": at.p, "W": at.W}[self.what]

    def slope(self, at: Normal, rate: float) -> float:
        """Return by how much it changes with p."""
        return {"v": rate, "p": 1.0, "W": at.v}[self.what]

    def ahead(self, at: Normal, rate: float) -> float:
        """Return the dp after which the stage ends while v' = rate; inf if it never does."""
        missing = self.missing(at)
        if self.what == "W":
            square = at.v * at.v + 2.0 * rate * missing
            root = math.sqrt(square) if square > 0.0 else 0.0
            if missing <= 0.0:
                return 0.0
            return 2.0 * missing / (at.v + root) if square > 0.0 and at.v + root > 0.0 else math.inf
        slope = self.slope(at, rate)
        return max(missing, 0.0) / slope if slope > 0.0 else 0.0 if missing <= 0.0 else math.inf

    def met(self, at: Normal) -> Normal:
        """Return the state at the end, without the rounding on the way."""
        return Normal(**{**at.__dict__, self.what: self.value})


COMPRESSED = Goal("v", 0.0)


def let_go(law: ImpactLaw, e: float, first: float, compressed: Normal) -> Goal:
    """Return where restitution ends, for the speed at `first` and the state at the end of compression."""
    if law == "newton":
        return Goal("v", -e * first)
    if law == "poisson":
        return Goal("p", (1.0 + e) * compressed.p)
    return Goal("W", (1.0 - e * e) * compressed.W)
