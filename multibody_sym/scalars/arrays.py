"""Arrays of floats, and the rounding of one.

The text of this file stands in exported Python, and imports NumPy and the standard library only.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# The spacing of doubles at 1: what every bound of rounding is a multiple of.
EPSILON: Final = 2.0**-52

UNDEFINED: Final = (ValueError, ArithmeticError)
"""What arithmetic on floats raises where an expression has no value."""


def lengths(values: Floats) -> Floats:
    """Return the lengths (..) of vectors (.., n): `norm`, which takes longer than its sum where vectors are small."""
    found: Floats = np.sqrt(np.add.reduce(values * values, axis=-1))
    return found


def row_sums(values: Floats) -> Floats:
    """Return the sum of each row, its elements added from left to right as C does; NumPy's `sum` adds in parts."""
    sums: Floats = values.cumsum(axis=1)[:, -1] + 0.0 if values.shape[1] else np.zeros(len(values))
    return sums
