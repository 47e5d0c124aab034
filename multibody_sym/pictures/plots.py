"""A plot as a figure of matplotlib."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from multibody_sym.pictures.page.files import plain_style
from multibody_sym.pictures.page.picture import letters
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.pictures.notebook_figure import ShownFigure


# ----------------------------------------------------------------------------------------------------------------------
# What a plot shows, as data: panels of curves over one quantity, and marks.


@dataclass(frozen=True, eq=False)
class PlottedCurve:
    """Numbers y (m,) over x (m,), called `name`, of one of several runs; all in the units of the axes.

    A rate of the coordinate `rate_of` has its letter with a dot.
    """

    name: str
    x: Floats
    y: Floats
    run: int = 0
    rate_of: str = ""

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
        """What stands at the axis: the names where they are few and short, else the quantity, and the unit."""
        return self._labelled(", ".join(dict.fromkeys(curve.name for curve in self.curves)))

    @property
    def typeset_label(self) -> str:
        """The same for matplotlib, names in letters."""
        return self._labelled(", ".join(dict.fromkeys(map(typeset, self.curves))))

    def _labelled(self, names: str) -> str:
        unit = f"[{self.unit}]" if self.unit else ""
        told = len(", ".join(dict.fromkeys(curve.name for curve in self.curves))) <= _LONGEST
        return f"{names if told else _quantity(self.unit)} {unit}".strip()

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
_PARTS: Final = ("end", "min", "max")
_TOGETHER: Final = 8
"""More curves than so many have small axes of their own."""
_COLUMN: Final = 10
"""So many names stand below each other in a legend."""
_ABREAST: Final = 4
"""Small axes beside each other."""
_BESIDE: Final[Any] = {
    "loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "fontsize": "small", "title_fontsize": "small",
    "facecolor": "white", "framealpha": 1.0, "edgecolor": "0.8",
}  # fmt: skip
_WIDTH, _HEIGHT, _SMALL, _MARGIN = 8.0, 2.4, 1.3, 1.0
_CLOSEST: Final = 0.018
"""Marks closer than this part of the axis are not named one by one."""


def figure_of(plot: Plot) -> ShownFigure:
    """Return a matplotlib figure of a plot. Raises OutputError where matplotlib is missing."""
    with plain_style():
        from multibody_sym.pictures.notebook_figure import ShownFigure

        heights = [_height(panel, plot) for panel in plot.panels]
        figure = ShownFigure(figsize=(_WIDTH, _MARGIN + sum(heights)), layout="constrained")
        grid: Any = figure.add_gridspec(len(heights), 1, height_ratios=heights)
        axes: list[Any] = []
        for row, panel in zip(grid, plot.panels, strict=True):
            cells = _cells(panel)
            parts = row.subgridspec(-(-len(cells) // _ABREAST), _ABREAST) if len(cells) > 1 else [row]
            first = len(axes)
            for part, cell in zip(parts, cells, strict=False):
                axis = figure.add_subplot(
                    part, sharex=axes[0] if axes else None, sharey=axes[first] if len(axes) > first else None
                )
                axes.append(axis)
                _draw_panel(axis, cell, plot, small=len(cells) > 1)
            for k, axis in enumerate(axes[first:]):
                bottom = row.is_last_row() and (len(cells) == 1 or k >= len(cells) - _ABREAST)
                axis.tick_params(labelbottom=bottom, labelleft=k % _ABREAST == 0)
                axis.set_xlabel(literal(plot.across) if bottom else "")
            axes[first].set_ylabel(panel.typeset_label)
        _draw_marks(axes, plot)
        figure.suptitle(literal(plot.title), fontsize="large")
    return figure


def _height(panel: Panel, plot: Plot) -> float:
    count = len(_cells(panel))
    usual = 4.5 if plot.equal and not plot.over_time else _HEIGHT
    return usual if count == 1 else _SMALL * -(-count // _ABREAST)


def _cells(panel: Panel) -> list[Panel]:
    """Return the panel, or where it has many curves one for each name."""
    names = list(dict.fromkeys(curve.name for curve in panel.curves))
    if len(names) <= _TOGETHER:
        return [panel]
    return [replace(panel, curves=tuple(x for x in panel.curves if x.name == name)) for name in names]


def typeset(curve: PlottedCurve) -> str:
    """Return the name of a curve for matplotlib: in letters as figures have them, rates with a dot, words with a prime.

    `theta end` and the like of studies have letters, too.
    """
    name, _, part = (curve.rate_of or curve.name).rpartition(" ")
    name, part = (name, f" {part}") if part in _PARTS else (curve.rate_of or curve.name, "")
    (text, style), *others = letters(name)
    dotted = bool(curve.rate_of) and style == "italic"
    begin = rf"$\dot{{\mathit{{{text}}}}}$" if dotted else _set_run(text, style)
    prime = "'" if curve.rate_of and not dotted else ""
    return begin + "".join(_set_run(*run) for run in others) + prime + part


def _set_run(text: str, style: str) -> str:
    if style == "subscript" and text.isalnum():
        return rf"$_{{\mathrm{{{text}}}}}$"
    return rf"$\mathit{{{text}}}$" if style == "italic" and text.isalpha() else literal(text)


@cache
def _quantities() -> dict[Any, str]:
    from multibody_sym.text.units import kind_of

    words = {
        "rad": "angle", "m": "length", "rad/s": "angular speed", "m/s": "speed", "N": "force", "N*m": "moment",
        "J": "energy", "W": "power", "kg*m/s": "momentum", "m/s^2": "acceleration", "s": "time", "kg": "mass",
    }  # fmt: skip
    return {kind_of(unit): word for unit, word in words.items()}


def _quantity(unit: str) -> str:
    """Return the word for what a unit measures, empty where it is not known."""
    from multibody_sym.errors import ExpressionError
    from multibody_sym.text.units import kind_of

    try:
        return _quantities().get(kind_of(unit), "") if unit else ""
    except ExpressionError:
        return ""


def literal(name: str) -> str:
    """Return a name that matplotlib shows as it stands: no formula, and no leading _ that would hide it."""
    shown = name.replace("$", r"\$")
    return f" {shown}" if shown.startswith("_") else shown


# --- one panel -------------------------------------------------------------------------------------------------------


def _draw_panel(axis: Any, panel: Panel, plot: Plot, *, small: bool) -> None:
    lines = []
    for k, curve in enumerate(panel.curves):
        colour, style = _look(k, curve, panel, plot)
        run, (low, high) = plot.runs[curve.run], curve.range
        drift = f",\nchanges by {high - low:.1e}" if panel.is_flat else ""
        told = typeset(curve) + literal(f", {run}" if run else "") + drift
        marker = "." if plot.dots else None
        (line,) = axis.plot(curve.x, curve.y, style, color=colour, linewidth=1.2, label=told, marker=marker)
        lines.append(line)
        if not plot.over_time and len(curve.x):
            axis.plot(curve.x[:1], curve.y[:1], "o", color=colour, markersize=4)
    axis.grid(visible=True, alpha=0.3)
    if panel.is_flat:
        axis.set_ylim(panel.shown)
    if small:
        axis.set_title(typeset(panel.curves[0]), fontsize="small", pad=3)
        axis.tick_params(labelsize="small")
    if lines and (not small or len(plot.runs) > 1):
        axis.legend(handles=lines, ncols=-(-len(lines) // _COLUMN), **_BESIDE)
    if plot.equal:
        axis.set_aspect("equal", adjustable="datalim")


def _look(k: int, curve: PlottedCurve, panel: Panel, plot: Plot) -> tuple[Any, str]:
    """Return colour and style: of several runs each has a colour, and of many a scale of them."""
    names = list(dict.fromkeys(each.name for each in panel.curves))
    if len(plot.runs) > 1:
        style = STYLES[names.index(curve.name) % len(STYLES)]
        if len(plot.runs) <= len(COLOURS):
            return COLOURS[curve.run], style
        import matplotlib as mpl

        return mpl.colormaps["viridis"](0.92 * curve.run / (len(plot.runs) - 1)), style
    return COLOURS[k % len(COLOURS)], STYLES[k // len(COLOURS)]


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
