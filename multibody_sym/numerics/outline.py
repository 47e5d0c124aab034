"""The outline of points in a plane: the corners of the smallest convex polygon around them."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats

_FLAT: Final = 1e-9
"""The part of the points' extent by which one is beside the line of its neighbours."""


def outline(points: Floats, normal: Floats) -> list[int]:
    """Return which of points (n, 3) are corners of their outline, seen along a normal (3,), counter-clockwise about it.

    Two where all are on a line, one where all are in one place.
    """
    across = np.eye(3)[int(np.argmin(np.abs(normal)))]
    x = np.cross(across, normal)
    seen = points @ np.array([x / np.linalg.norm(x), np.cross(normal, x) / np.linalg.norm(np.cross(normal, x))]).T
    size = float(np.ptp(seen, axis=0).max(initial=0.0))
    order = [int(k) for k in np.lexsort((seen[:, 1], seen[:, 0]))]
    if size == 0.0:
        return order[:1]
    halves = [_half(seen, way, _FLAT * size * size) for way in (order, order[::-1])]
    around = [*halves[0][:-1], *halves[1][:-1]]
    first = around.index(min(around))
    return [*around[first:], *around[:first]]


def _half(seen: Floats, order: list[int], least: float) -> list[int]:
    """Return the lower half of an outline, in an order from end to end."""
    found: list[int] = []
    for k in order:
        while len(found) > 1 and _turn(seen[found[-2]], seen[found[-1]], seen[k]) <= least:
            found.pop()
        found.append(k)
    return found


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
