"""Limits of values that depend smoothly on a parameter as it goes to zero, from values beside it."""

from __future__ import annotations

import numpy as np

from multibody_sym.numerics.arrays import Floats


def at_zero(parameters: Floats, values: Floats, sizes: Floats) -> tuple[Floats, float]:
    """Return the limit (m,) of values (n, m) as their parameters (n,) go to zero, and its error by `sizes` (m,).

    Parameters grow from the first on. Of the polynomials through neighbouring values (Neville) that one is taken which
    differs least from the two of one degree less that make it: higher degrees amplify rounding. n is at least 2.
    """
    best, error, column = values[0], np.inf, values
    for degree in range(1, len(parameters)):
        near, far = parameters[:-degree, None], parameters[degree:, None]
        former, column = column, (far * column[:-1] - near * column[1:]) / (far - near)
        differ = np.maximum(np.abs(column - former[:-1]), np.abs(column - former[1:])) / sizes
        largest = differ.max(axis=1)
        least = int(np.argmin(largest))
        if largest[least] < error:
            best, error = column[least], float(largest[least])
    return best, error
