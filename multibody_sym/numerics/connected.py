"""What hangs together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def connected(near: NDArray[np.bool_]) -> list[list[int]]:
    """Return the numbers that hang together by pairs that are `near` (n, n), over any others; the lowest first."""
    either, left, found = near | near.T, set(range(len(near))), list[list[int]]()
    while left:
        group, waiting = set[int](), {min(left)}
        while waiting:
            group |= waiting
            waiting = set(np.flatnonzero(either[sorted(waiting)].any(axis=0)).tolist()) - group
        left -= group
        found.append(sorted(group))
    return found
