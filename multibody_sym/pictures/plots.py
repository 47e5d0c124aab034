"""A plot as a figure of matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from multibody_sym.pictures.page.raster import plain_style
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.pictures.notebook_figure import ShownFigure


# ----------------------------------------------------------------------------------------------------------------------
# What a plot shows, as data: panels of curves over one quantity, and marks.


@dataclass(frozen=True, eq=False)
class PlottedCurve:
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
    curves: tuple[PlottedCurve, ...]
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
    def is_constant(self) -> bool:
        """Whether no curve changes by more than rounding or drift."""
        return self.is_flat or all(low == high for low, high in (curve.range for curve in self.curves))

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
class PlotMark:
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
    marks: tuple[PlotMark, ...] = ()
    runs: tuple[str, ...] = ("",)
    over_time: bool = True
    equal: bool = False
    dots: bool = False


# ----------------------------------------------------------------------------------------------------------------------

COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9")
"""Okabe and Ito's colours, which differ for the colour-blind too; their yellow is too light for a line on white."""
STYLES: Final = ("-", "--", "-.", ":")
_DISTINCT: Final = len(COLOURS) * len(STYLES)
_COLUMN: Final = 10
"""So many names stand below each other in a legend."""
_BESIDE: Final[Any] = {
    "loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "fontsize": "small", "title_fontsize": "small",
}  # fmt: skip
_WIDTH, _HEIGHT, _MARGIN = 8.0, 2.4, 1.0
_CLOSEST: Final = 0.018
"""Marks closer than this part of the axis are not named one by one."""


def figure_of(plot: Plot) -> ShownFigure:
    """Return a matplotlib figure of a plot. Raises OutputError where matplotlib is missing."""
    with plain_style():
        from multibody_sym.pictures.notebook_figure import ShownFigure

        square = plot.equal and not plot.over_time
        height = _MARGIN + (4.5 if square else _HEIGHT) * len(plot.panels)
        figure = ShownFigure(figsize=(_WIDTH, height), layout="constrained")
        axes = figure.subplots(len(plot.panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, panel in zip(axes, plot.panels, strict=True):
            _draw_panel(axis, panel, plot)
        _draw_marks(axes, plot)
        axes[-1].set_xlabel(literal(plot.across))
        figure.suptitle(literal(plot.title), fontsize="large")
    return figure


def literal(name: str) -> str:
    """Return a name that matplotlib shows as it stands: no formula, and no leading _ that would hide it."""
    shown = name.replace("$", r"\$")
    return f" {shown}" if shown.startswith("_") else shown


# --- one panel -------------------------------------------------------------------------------------------------------


def _draw_panel(axis: Any, panel: Panel, plot: Plot) -> None:
    lines = []
    for k, curve in enumerate(panel.curves):
        colour, style = _look(k, curve, panel, plot)
        run, (low, high) = plot.runs[curve.run], curve.range
        drift = f",\nchanges by {high - low:.1e}" if panel.is_flat else ""
        told = literal((f"{curve.name}, {run}" if run else curve.name) + drift)
        marker = "." if plot.dots else None
        (line,) = axis.plot(curve.x, curve.y, style, color=colour, linewidth=1.2, label=told, marker=marker)
        lines.append(line)
        if not plot.over_time and len(curve.x):
            axis.plot(curve.x[:1], curve.y[:1], "o", color=colour, markersize=4)
    axis.set_ylabel(literal(panel.label))
    axis.grid(visible=True, alpha=0.3)
    if panel.is_flat:
        axis.set_ylim(panel.shown)
    if lines and len(lines) <= _DISTINCT:
        axis.legend(handles=lines, ncols=-(-len(lines) // _COLUMN), **_BESIDE)
    elif lines:  # of more than can differ some are named
        last = len(lines) - 1
        shown = [lines[round(k * last / (_COLUMN - 2))] for k in range(_COLUMN - 1)]
        axis.legend(handles=shown, title=f"{len(lines)} curves,\ncoloured in order", **_BESIDE)
    if plot.equal:
        axis.set_aspect("equal", adjustable="datalim")


def _look(k: int, curve: PlottedCurve, panel: Panel, plot: Plot) -> tuple[Any, str]:
    """Return colour and style: of several runs each has a colour, of more curves than can differ all follow a scale."""
    if len(plot.runs) > 1 and len(plot.runs) <= len(COLOURS):
        names = list(dict.fromkeys(each.name for each in panel.curves))
        return COLOURS[curve.run], STYLES[names.index(curve.name) % len(STYLES)]
    if len(panel.curves) <= _DISTINCT:
        return COLOURS[k % len(COLOURS)], STYLES[k // len(COLOURS)]
    import matplotlib as mpl

    return mpl.colormaps["viridis"](0.92 * k / (len(panel.curves) - 1)), "-"


# --- marks -----------------------------------------------------------------------------------------------------------


def _draw_marks(axes: Any, plot: Plot) -> None:
    if not plot.marks:
        return
    if not plot.over_time:
        for mark in plot.marks:
            for panel, x, y in mark.places:
                axes[panel].plot([x], [y], "|", color="0.4", markersize=8)
        return
    for axis in axes:
        for mark in plot.marks:
            axis.axvline(mark.x, color="0.6", linewidth=0.6, linestyle=":", zorder=0)
    left, right = axes[0].get_xlim()
    named: list[PlotMark] = []  # those whose names do not stand in each other's way
    for mark in plot.marks:
        if not named or mark.x - named[-1].x >= _CLOSEST * (right - left):
            named.append(mark)
    for mark in named:
        axes[0].annotate(
            literal(mark.text), (mark.x, 1.0), (0, 3), xycoords=axes[0].get_xaxis_transform(), rotation=60, fontsize=7,
            textcoords="offset points", ha="left", va="bottom",
        )  # fmt: skip
    if len(named) < len(plot.marks):
        told = f"{len(plot.marks)} changes marked, {len(named)} named"
        axes[-1].annotate(told, (1.0, 0.0), (4, 2), xycoords="axes fraction", textcoords="offset points", fontsize=7)
