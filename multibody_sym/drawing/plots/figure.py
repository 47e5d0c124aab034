"""A plot as a figure of matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from multibody_sym.drawing.plots.files import plain_style
from multibody_sym.drawing.plots.panels import Curve, Mark, Panel, Plot

if TYPE_CHECKING:
    from multibody_sym.drawing.plots.shown import ShownFigure

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
        from multibody_sym.drawing.plots.shown import ShownFigure

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
        told = literal(_told(curve, plot) + (_drift(curve) if panel.is_flat else ""))
        marker = "." if plot.dots else None
        (line,) = axis.plot(curve.x, curve.y, style, color=colour, linewidth=1.2, label=told, marker=marker)
        lines.append(line)
        if not plot.over_time and len(curve.x):
            axis.plot(curve.x[:1], curve.y[:1], "o", color=colour, markersize=4)
    axis.set_ylabel(literal(panel.label))
    axis.grid(visible=True, alpha=0.3)
    if panel.is_flat:
        axis.set_ylim(panel.shown)
    if lines:
        _legend(axis, lines)
    if plot.equal:
        axis.set_aspect("equal", adjustable="datalim")


def _drift(curve: Curve) -> str:
    low, high = curve.range
    return f",\nchanges by {high - low:.1e}"


def _look(k: int, curve: Curve, panel: Panel, plot: Plot) -> tuple[Any, str]:
    """Return colour and style: of several runs each has a colour, of more curves than can differ all follow a scale."""
    if len(plot.runs) > 1 and len(plot.runs) <= len(COLOURS):
        names = list(dict.fromkeys(each.name for each in panel.curves))
        return COLOURS[curve.run], STYLES[names.index(curve.name) % len(STYLES)]
    if len(panel.curves) <= _DISTINCT:
        return COLOURS[k % len(COLOURS)], STYLES[k // len(COLOURS)]
    import matplotlib as mpl

    return mpl.colormaps["viridis"](0.92 * k / (len(panel.curves) - 1)), "-"


def _told(curve: Curve, plot: Plot) -> str:
    run = plot.runs[curve.run]
    return f"{curve.name}, {run}" if run else curve.name


def _legend(axis: Any, lines: list[Any]) -> None:
    """Name every curve beside the axis; of more than can differ some, and how many there are."""
    if len(lines) <= _DISTINCT:
        axis.legend(handles=lines, ncols=-(-len(lines) // _COLUMN), **_BESIDE)
        return
    last = len(lines) - 1
    shown = [lines[round(k * last / (_COLUMN - 2))] for k in range(_COLUMN - 1)]
    axis.legend(handles=shown, title=f"{len(lines)} curves,\ncoloured in order", **_BESIDE)


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
    named = _named(plot.marks, axes[0].get_xlim())
    for mark in named:
        axes[0].annotate(
            literal(mark.text), (mark.x, 1.0), (0, 3), xycoords=axes[0].get_xaxis_transform(), rotation=60, fontsize=7,
            textcoords="offset points", ha="left", va="bottom",
        )  # fmt: skip
    if len(named) < len(plot.marks):
        told = f"{len(plot.marks)} changes marked, {len(named)} named"
        axes[-1].annotate(told, (1.0, 0.0), (4, 2), xycoords="axes fraction", textcoords="offset points", fontsize=7)


def _named(marks: tuple[Mark, ...], span: tuple[float, float]) -> list[Mark]:
    """Return the marks whose names do not stand in each other's way."""
    found: list[Mark] = []
    for mark in marks:
        if not found or mark.x - found[-1].x >= _CLOSEST * (span[1] - span[0]):
            found.append(mark)
    return found
