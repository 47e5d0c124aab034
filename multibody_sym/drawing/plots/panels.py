"""What a plot shows, as data: panels of curves over one quantity, and marks."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass


@dataclass(frozen=True, eq=False)
class Curve:
    """Numbers y (m,) over x (m,), called `name`, of one of several runs; all in the units that are told."""

    name: str
    x: Floats
    y: Floats
    run: int = 0

    @property
    def range(self) -> tuple[float, float]:
        """The least and the largest number, zeros where there is none."""
        known = self.y[np.isfinite(self.y)]
        return (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves that share an axis; `unit` is what it counts in, empty where none is known.

    `size` is that of the terms of which the numbers are sums, as kinetic energy is of the energy, zero where unknown.
    """

    unit: str
    curves: tuple[Curve, ...]
    size: float = 0.0

    @property
    def label(self) -> str:
        """What stands at the axis: the names where they are few and short, and the unit."""
        names = ", ".join(dict.fromkeys(curve.name for curve in self.curves))
        unit = f"[{self.unit}]" if self.unit else ""
        return f"{names} {unit}".strip() if len(names) <= _LONGEST else unit

    @property
    def range(self) -> tuple[float, float]:
        """The least and the largest number of all curves."""
        found = [curve.range for curve in self.curves]
        return min((low for low, _ in found), default=0.0), max((high for _, high in found), default=0.0)

    @property
    def is_flat(self) -> bool:
        """Whether all that the curves do is rounding or drift, against the size of what they are made of."""
        low, high = self.range
        return 0.0 < high - low < _NARROWEST * self._largest

    @property
    def shown(self) -> tuple[float, float]:
        """The ends of the axis: a little beyond the numbers, and far around those that only drift."""
        low, high = self.range
        margin = 0.05 * self._largest if self.is_flat else 0.05 * (high - low) or 0.05 * abs(high) or 1.0
        return low - margin, high + margin

    @property
    def _largest(self) -> float:
        return max(self.size, *map(abs, self.range))


_LONGEST: Final = 24
_NARROWEST: Final = 1e-6
"""What changes by less than this part of its size is drift, and is drawn as constant."""


@dataclass(frozen=True)
class Mark:
    """Something that happened at `x`; a plot over another quantity than time marks the points (`places`) instead."""

    x: float
    text: str
    places: tuple[tuple[int, float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Plot:
    """Panels one below the other over the same quantity, `across`, with its unit.

    `runs` are what several are called. `over_time` says that the quantity is time; else each curve is a path, whose
    start is marked, and `equal` says that both directions are lengths, drawn to one scale. With `dots` each number is.
    """

    title: str
    across: str
    panels: tuple[Panel, ...]
    marks: tuple[Mark, ...] = ()
    runs: tuple[str, ...] = ("",)
    over_time: bool = True
    equal: bool = False
    dots: bool = False
