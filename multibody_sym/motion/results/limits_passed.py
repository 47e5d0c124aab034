"""Limits of joints: which ones a motion passes, and when."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import slot

ERROR_OF_A_RUN: Final = 1e-9
"""How far beyond a limit a motion that rests there may be found."""


class PassedLimit(NamedTuple):
    """A limit (`lower`, `upper` or `velocity`) of a joint, `bound` in its SI unit, passed first at a sample."""

    joint: str
    limit: str
    bound: float
    unit: str
    sample: int


def limits_passed(
    mechanism: Mechanism, parameters: Sequence[float] | Floats, samples: Callable[[str], Floats]
) -> list[PassedLimit]:
    """Return the limits that a motion passes; `samples` gives those (m,) of a coordinate or speed by name."""
    units = MechanismUnits(mechanism).state
    values = {slot("parameters", i): float(x) for i, x in enumerate(parameters)}
    found = []
    for limit in mechanism.limits:
        position, speed = samples(limit.coordinate), np.abs(samples(limit.speed))
        sides = (("lower", limit.lower, position, -1), ("upper", limit.upper, position, 1))
        for name, declared, size, side in (*sides, ("velocity", limit.velocity, speed, 1)):
            unit = units[limit.coordinate if size is position else limit.speed]
            if declared is not None:
                bound = evaluate_float([declared], values)[0]
                beyond = np.flatnonzero(side * (size - bound) > ERROR_OF_A_RUN)
                found += [PassedLimit(limit.joint, name, bound, unit, int(k)) for k in beyond[:1]]
    return found
