"""A study as a figure: its results over one value that is varied, or as maps over two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.plots.figure import COLOURS, literal
from multibody_sym.drawing.plots.files import plain_style
from multibody_sym.errors import InputError, suggestion
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.studies.plan import Plan
from multibody_sym.studies.tables import results

_MOST: Final = 12
_DOTTED: Final = 200
"""Runs that are so few that each has a dot."""
_CURVES: Final = {" end": (0, "-"), " min": (1, "--"), " max": (2, "-.")}


@dataclass(frozen=True, eq=False)
class _Shown:
    """What is shown of a study: the `columns` of these `names`."""

    plan: Plan
    system: str
    columns: Mapping[str, Floats]
    names: Sequence[str]

    def __getitem__(self, name: str) -> Floats:
        return self.columns[name]

    @property
    def title(self) -> str:
        """What the figure is of."""
        return literal(f"{self.system}: {len(self.plan)} runs")


def figure_of(plan: Plan, system: str, columns: Mapping[str, Any], show: Sequence[str] | None = None) -> Any:
    """Return a matplotlib figure of the columns that are to be shown; by default of all, the first twelve quantities.

    Over one varied value it has an axis for each quantity, with end, min and max as curves; over two a map of each
    column, as cells of a grid or as points of samples. Raises InputError for unknown columns, and for three values.
    """
    if len(plan.names) > 2:
        message = f"a figure is over one or two varied values; here are {len(plan.names)}: {', '.join(plan.names)}"
        raise InputError(message)
    known = results(plan, columns)
    for name in show or ():
        if name not in known:
            raise InputError(f"no column of results is called {name!r}{suggestion(name, known)}")
    names = tuple(show or _usual(len(plan.names), {name: columns[name] for name in known}))
    if not names:
        raise InputError("there is no result to plot: every run failed")
    study = _Shown(plan, system, columns, names)
    with plain_style():
        return _curves(study) if len(plan.names) == 1 else _maps(study)


def _usual(varied: int, columns: Mapping[str, Floats]) -> list[str]:
    """Return what is shown where nothing else is asked for: what is not the same in all runs, end values in maps."""
    changing = [name for name, values in columns.items() if _changes(values)] or list(columns)[:1]
    if varied == 2:
        return ([name for name in changing if _quantity(name) == name or name.endswith(" end")] or changing)[:_MOST]
    quantities = list(dict.fromkeys(map(_quantity, changing)))[:_MOST]
    return [name for name in changing if _quantity(name) in quantities]


def _changes(values: Floats) -> bool:
    found = values[np.isfinite(values)]
    return len(found) > 0 and bool(found.min() < found.max())


def _quantity(name: str) -> str:
    return name.removesuffix(" end").removesuffix(" min").removesuffix(" max")


def _curves(study: _Shown) -> Any:
    quantities = list(dict.fromkeys(map(_quantity, study.names)))
    (varied,) = study.plan.names
    order = np.argsort(study[varied], kind="stable")
    figure, axes = _empty(len(quantities), 1, (8.0, 1.0 + 2.0 * len(quantities)))
    marker = "." if len(study.plan) <= _DOTTED else None
    for axis, quantity in zip(axes[:, 0], quantities, strict=True):
        for name in (name for name in study.names if _quantity(name) == quantity):
            k, style = _CURVES.get(name.removeprefix(quantity), (0, "-"))
            look = {"label": name.removeprefix(quantity).strip() or name, "color": COLOURS[k], "marker": marker}
            axis.plot(study[varied][order], study[name][order], style, linewidth=1.2, **look)
        axis.set_ylabel(literal(quantity))
        axis.grid(visible=True, alpha=0.3)
        axis.legend(loc="best", fontsize="small")
    axes[0, 0].set_title(study.title)
    axes[-1, 0].set_xlabel(literal(varied))
    return figure


def _maps(study: _Shown) -> Any:
    columns = study.names
    wide = min(len(columns), 3)
    high = -(-len(columns) // wide)
    figure, axes = _empty(high, wide, (1.0 + 4.0 * wide, 0.6 + 3.2 * high))
    x, y = study.plan.names
    for axis, name in zip(axes.flat, columns, strict=False):
        if study.plan.method == "grid":
            first, second = (study[name].reshape(study.plan.shape) for name in (x, y))
            drawn = axis.pcolormesh(first, second, study[name].reshape(study.plan.shape), shading="nearest")
        else:
            drawn = axis.scatter(study[x], study[y], c=study[name], s=8)
        figure.colorbar(drawn, ax=axis)
        axis.set_title(literal(name), fontsize="medium")
        axis.set_xlabel(literal(x))
        axis.set_ylabel(literal(y))
    for axis in axes.flat[len(columns) :]:
        axis.set_visible(False)
    figure.suptitle(study.title)
    return figure


def _empty(high: int, wide: int, size: tuple[float, float]) -> tuple[Any, Any]:
    from multibody_sym.drawing.plots.shown import ShownFigure

    figure = ShownFigure(figsize=size, layout="constrained")
    return figure, figure.subplots(high, wide, squeeze=False)
