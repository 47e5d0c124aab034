"""Times of samples and of fixed steps."""

from __future__ import annotations

import math

import numpy as np

from multibody_sym.numerics.arrays import Floats


def steps_before(t0: float, time: float, step: float) -> int:
    """Return how many whole steps from t0 on do not end after a time."""
    number = math.floor((time - t0) / step)
    return number + (t0 + (number + 1) * step <= time) - (t0 + number * step > time)


def sample_times(t0: float, t_end: float, samples: int) -> Floats:
    """Return the times (samples,) of evenly spaced samples, both ends among them and exact."""
    times = t0 + (t_end - t0) * np.arange(samples) / (samples - 1)
    times[-1] = t_end
    return times
