"""Least changes by few rows, in sums of a fixed order: `turns.c` gives the same bits."""

from __future__ import annotations

from math import sqrt
from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import CLEAR

MOST: Final = 8
"""Rows."""


def least_change(rows: Floats, wanted: Floats, inverse: Floats) -> Floats | None:
    """Return `inverse` x (n) with the least x with rows x = wanted (k); None where rows are many or nearly dependent.

    By the triangle L of rows rows^T = L L^T: where something is put back by roundings, its digits do not count.
    """
    if len(rows) > MOST:
        return None
    a, triangle = rows.tolist(), list[list[float]]()
    y: list[float] = []
    for i, right in enumerate(wanted.tolist()):
        line: list[float] = []
        for j in range(i + 1):
            value = _dot(a[i], a[j])
            square = value
            for p in range(j):
                value -= line[p] * (triangle[j] if j < i else line)[p]
            if j < i:
                line.append(value / triangle[j][j])
        if not value > CLEAR * square:
            return None
        line.append(sqrt(value))
        triangle.append(line)
        for p in range(i):
            right -= line[p] * y[p]
        y.append(right / line[i])
    for i in reversed(range(len(y))):
        for p in range(i + 1, len(y)):
            y[i] -= triangle[p][i] * y[p]
        y[i] /= triangle[i][i]
    x = [_dot([row[k] for row in a], y) for k in range(rows.shape[1])]
    return np.array([_dot(row, x) for row in inverse.tolist()])


def _dot(a: list[float], b: list[float]) -> float:
    total = 0.0
    for x, y in zip(a, b, strict=True):
        total += x * y
    return total
