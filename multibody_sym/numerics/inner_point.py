"""A point well inside cones, among those that linear equations allow: the analytic centre.

Of forces that are not unique it is the choice that keeps away from all bounds, changes smoothly with the load, and
comes to its bounds no sooner than any choice does. Newton's method on the sum of -log of what is left to each bound; a
first point inside is found by cones that are made wider by a number, which is made as small as can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
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
_SHARPER: Final = 10.0
_SHARPEST: Final = 1e14
"""How much width counts at last: what can be narrower by more than 1e-13 has been."""


@dataclass(frozen=True)
class Cone:
    """|z_rows| <= the sum of factors times z_axes; without rows that sum is not negative."""

    rows: tuple[int, ...]
    axes: tuple[int, ...]
    factors: tuple[float, ...]

    @cached_property
    def places(self) -> list[int]:
        """Rows, then axes."""
        return [*self.rows, *self.axes]

    def left(self, z: Floats) -> tuple[float, float]:
        """Return what is left to the bound, and the bound."""
        most = sum(factor * float(z[k]) for factor, k in zip(self.factors, self.axes, strict=True))
        return most - (float(np.linalg.norm(z[list(self.rows)])) if self.rows else 0.0), most

    def barrier(self, z: Floats) -> tuple[Floats, Floats]:
        """Return the derivatives of -log(b^2 - |z_rows|^2), or of -log b, by rows and axes."""
        left, most = self.left(z)
        along, across = z[list(self.rows)], np.array(self.factors)
        if not self.rows:
            return -across / most, np.outer(across, across) / most**2
        q, n = left * (2.0 * most - left), len(along)
        slope = np.concatenate([-2.0 * along, 2.0 * most * across])
        curve = np.zeros((len(slope), len(slope)))
        curve[:n, :n] = -2.0 * np.eye(n)
        curve[n:, n:] = 2.0 * np.outer(across, across)
        return -slope / q, np.outer(slope, slope) / q**2 - curve / q


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
    width = max(1.0, -2.0 * _room(start, cones))
    wide = [replace(cone, axes=(*cone.axes, count), factors=(*cone.factors, 1.0)) for cone in cones]
    further = np.block([[ways, np.zeros((count, 1))], [np.zeros((1, free)), np.ones((1, 1))]])
    first = _Search(np.append(start, width), further, wide, np.array(loose, dtype=int))
    y, sharp = np.zeros(free + 1), 1.0
    while sharp <= _SHARPEST and y[-1] + width > 0.0:
        y = first.centred(y, sharp, least=-width)
        if y[-1] + width > 10.0 * (2.0 * len(cones) + 1.0) / sharp:  # there is no room at all
            break
        sharp *= _SHARPER
    left = max(y[-1] + width, 0.0)
    if left > 0.0:
        z = first.at(y)
        return Inside(z[:-1], y[:-1], _room(z[:-1], cones), first.slopes(z)[1][:-1, :-1])
    second = _Search(start, ways, cones, np.array(loose, dtype=int))
    y = second.centred(y[:-1])
    z = second.at(y)
    return Inside(z, y, _room(z, cones), second.slopes(z)[1])


def _room(z: Floats, cones: Sequence[Cone]) -> float:
    """Return what is left to the nearest bound, negative beyond it."""
    return min((cone.left(z)[0] for cone in cones), default=np.inf)


@dataclass(frozen=True, eq=False)
class _Search:
    """The points start + ways y, the cones, and what is `loose`."""

    start: Floats
    ways: Floats
    cones: Sequence[Cone]
    loose: NDArray[Any]

    def at(self, y: Floats) -> Floats:
        found: Floats = self.start + self.ways @ y
        return found

    def centred(self, y: Floats, sharp: float = 0.0, least: float = -np.inf) -> Floats:
        """Return the centre from a point inside; where the last of z counts `sharp` as well, until it is `least`."""
        for _ in range(_STEPS):
            step, gain = self._step(y, sharp)
            if gain < _CENTRED or y[-1:].sum() <= least:
                break
            far = 1.0 if gain < 0.06 else 1.0 / (1.0 + float(np.sqrt(gain)))
            while far > 1e-9 and not _room(self.at(y + far * step), self.cones) > 0.0:
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
        gradient, hessian = np.zeros(len(z)), np.zeros((len(z), len(z)))
        gradient[self.loose] += z[self.loose]
        hessian[self.loose, self.loose] += 1.0
        for cone in self.cones:
            g, h = cone.barrier(z)
            gradient[cone.places] += g
            hessian[np.ix_(cone.places, cone.places)] += h
        return gradient, hessian
