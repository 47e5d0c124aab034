"""What a plot shows, as data: panels of curves over one quantity, and marks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from multibody_sym.numerics.arrays import Floats


@dataclass(frozen=True, eq=False)
class Curve:
    """Numbers y (m,) over x (m,), called `name`, of one of several runs; all in the units that are told."""

    name: str
    x: Floats
    y: Floats
    run: int = 0


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


_LONGEST: Final = 24


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
    start is marked, and `equal` says that both directions are lengths, drawn to one scale.
    """

    title: str
    across: str
    panels: tuple[Panel, ...]
    marks: tuple[Mark, ...] = ()
    runs: tuple[str, ...] = ("",)
    over_time: bool = True
    equal: bool = False
