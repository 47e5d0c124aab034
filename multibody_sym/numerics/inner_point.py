"""A point well inside cones, among those that linear equations allow: the analytic centre.

Of forces that are not unique it is the choice that keeps away from all bounds, changes smoothly with the load, and
comes to its bounds no sooner than any choice does. Newton's method on the sum of -log of what is left to each bound; a
first point inside is found by cones that are made wider by a number, which is made as small as can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass

_STEPS: Final = 60
"""Newton's steps to a centre: a few, and some more from far away."""
_CENTRED: Final = 1e-16
"""What a further step would gain, where one is enough."""
_ROUNDED: Final = 1e-3
"""Gains below this fall from step to step, to their square, until only rounding is left of them."""
_SHARPER: Final = 10.0
_SHARPEST: Final = 1e14
"""How much width counts at last: what can be narrower by more than 1e-13 has been."""


@dataclass(frozen=True)
class Cone:
    """|z_rows| <= the sum of factors times z_axes; without rows that sum is not negative."""

    rows: tuple[int, ...]
    axes: tuple[int, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Cones (c) as arrays: bounds b = `factors` z of the lengths of z_`rows`, (c, m) both; `weights` (c) of -log.

    Their barrier is -w log(b^2 - |z_rows|^2), with w = 1/2 where there are no rows: -log b.
    """

    factors: Floats
    rows: Floats
    weights: Floats

    def left(self, z: Floats) -> tuple[Floats, Floats]:
        """Return what is left to the bounds, and the bounds."""
        most = self.factors @ z
        return most - np.sqrt(self.rows @ (z * z)), most

    def room(self, z: Floats) -> float:
        """Return what is left to the nearest bound, negative beyond it."""
        return float(self.left(z)[0].min(initial=np.inf))

    def barrier(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the first (m) and second (m, m) derivatives of the sum of all barriers."""
        left, most = self.left(z)
        inside = left * (2.0 * most - left)
        slopes = 2.0 * (most[:, None] * self.factors - self.rows * z) / inside[:, None]
        curved = 2.0 * self.weights / inside
        hessian = slopes.T @ (self.weights[:, None] * slopes) - self.factors.T @ (curved[:, None] * self.factors)
        return -self.weights @ slopes, hessian + np.diag(curved @ self.rows)


def _bounds(cones: Sequence[Cone], size: int) -> _Bounds:
    """Return cones in z of some size as arrays."""
    factors, rows = np.zeros((2, len(cones), size))
    for k, cone in enumerate(cones):
        factors[k, list(cone.axes)] = cone.factors
        rows[k, list(cone.rows)] = 1.0
    return _Bounds(factors, rows, np.where(rows.any(axis=1), 1.0, 0.5))


@dataclass(frozen=True, eq=False)
class Inside:
    """A point z (m) = start + ways (m, j) `taken` (j), what is left to the nearest bound, and the `hessian` (m, m)."""

    z: Floats
    taken: Floats
    room: float
    hessian: Floats


def inner_point(start: Floats, ways: Floats, cones: Sequence[Cone], loose: Sequence[int] = ()) -> Inside:
    """Return the point z (m) = start + ways (m, j) y that is most inside the cones.

    Numbers are of order one. What is `loose` has no bounds, and is near zero. Where the cones have no room, the point
    is one that is least beyond them.
    """
    count, free = ways.shape
    bounds, free_of_bounds = _bounds(cones, count), np.array(loose, dtype=int)
    width = max(1.0, -2.0 * bounds.room(start))
    wider = np.column_stack([bounds.factors, np.ones(len(cones))])
    wide = _Bounds(wider, np.column_stack([bounds.rows, np.zeros(len(cones))]), bounds.weights)
    further = np.block([[ways, np.zeros((count, 1))], [np.zeros((1, free)), np.ones((1, 1))]])
    first = _Search(np.append(start, width), further, wide, free_of_bounds)
    y, sharp = np.zeros(free + 1), 1.0
    while sharp <= _SHARPEST and y[-1] + width > 0.0:
        y = first.centred(y, sharp, least=-width)
        if y[-1] + width > 10.0 * (2.0 * len(cones) + 1.0) / sharp:  # there is no room at all
            break
        sharp *= _SHARPER
    left = max(y[-1] + width, 0.0)
    if left > 0.0:
        z = first.at(y)
        return Inside(z[:-1], y[:-1], bounds.room(z[:-1]), first.slopes(z)[1][:-1, :-1])
    second = _Search(start, ways, bounds, free_of_bounds)
    y = second.centred(y[:-1])
    z = second.at(y)
    return Inside(z, y, bounds.room(z), second.slopes(z)[1])


@dataclass(frozen=True, eq=False)
class _Search:
    """The points start + ways y, their bounds, and what is `loose`."""

    start: Floats
    ways: Floats
    bounds: _Bounds
    loose: NDArray[Any]

    def at(self, y: Floats) -> Floats:
        found: Floats = self.start + self.ways @ y
        return found

    def centred(self, y: Floats, sharp: float = 0.0, least: float = -np.inf) -> Floats:
        """Return the centre from a point inside; where the last of z counts `sharp` as well, until it is `least`."""
        before = np.inf
        for _ in range(_STEPS):
            step, gain = self._step(y, sharp)
            if gain < _CENTRED or y[-1:].sum() <= least or before <= gain < _ROUNDED:
                break
            before = gain
            far = 1.0 if gain < 0.06 else 1.0 / (1.0 + float(np.sqrt(gain)))
            while far > 1e-9 and not self.bounds.room(self.at(y + far * step)) > 0.0:
                far *= 0.5
            if far <= 1e-9:
                break
            y = y + far * step
        return y

    def _step(self, y: Floats, sharp: float) -> tuple[Floats, float]:
        gradient, hessian = self.slopes(self.at(y))
        gradient[-1] += sharp
        slope, curve = self.ways.T @ gradient, self.ways.T @ hessian @ self.ways
        size = np.sqrt(np.maximum(np.diag(curve), 1e-300))
        step: Floats = -least_squares(curve / np.outer(size, size), slope / size, 1e-15) / size
        return step, float(-slope @ step)

    def slopes(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the first and second derivatives of what is made least."""
        gradient, hessian = self.bounds.barrier(z)
        gradient[self.loose] += z[self.loose]
        hessian[self.loose, self.loose] += 1.0
        return gradient, hessian
