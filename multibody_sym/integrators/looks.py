"""Looks at switching functions within a step, until they are certain to keep their signs; `looks.c` is the same in C.

A function that has one sign at both ends of a piece of a step, and changes at rates known there, is certain to keep it
if its rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way.
A piece of which neither is true is halved. So a body that can reach another within a step is looked at ever more
closely where it comes near, and few looks are taken at what stays away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.sign_changes import PROBE, Look


@dataclass(frozen=True)
class Ends:
    """Values (ng,) at both ends of a step, times the sides on which they were, and PROBE after and before them."""

    start: Floats
    after: Floats
    before: Floats
    end: Floats

    def uncertain(self) -> NDArray[np.bool_]:
        """Tell which functions may change their sign in the step."""
        rise, fall = (self.after - self.start) / PROBE, (self.end - self.before) / PROBE
        found: NDArray[np.bool_] = (self.end < 0.0) | _uncertain(self.start, self.end, rise, fall)
        return found

    def looks(self, index: int) -> tuple[Look, Look]:
        """Return the looks at one function at the ends of the step."""
        start, after, before, end = (float(values[index]) for values in (self.start, self.after, self.before, self.end))
        rise, fall = (after - start) / PROBE, (end - before) / PROBE
        return Look(0.0, start, rise, rise), Look(1.0, end, fall, fall)


def _uncertain(start: Floats, end: Floats, rise: Floats, fall: Floats) -> NDArray[np.bool_]:
    """Tell where values at both ends and changes at the rates there do not say that a function keeps its sign."""
    change = end - start
    bend = np.maximum(np.abs(rise - change), np.abs(fall - change))
    found: NDArray[np.bool_] = (np.minimum(start, end) < bend) & (bend > 0.5 * np.abs(change))
    return found
