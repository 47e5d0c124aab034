"""A study as a figure: its results over one value that is varied, or as maps over two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.plots.figure import figure_of as plotted
from multibody_sym.drawing.plots.figure import literal
from multibody_sym.drawing.plots.files import plain_style
from multibody_sym.drawing.plots.panels import Curve, Panel, Plot
from multibody_sym.errors import InputError
from multibody_sym.expressions.chosen_units import Units
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.studies.plan import Plan
from multibody_sym.studies.rows import FAILURE
from multibody_sym.studies.tables import results

_DOTTED: Final = 200
"""Runs that are so few that each has a dot."""


@dataclass(frozen=True, eq=False)
class _Shown:
    """What is shown of a study: the `columns` of these `names`, told in `units`; `known` are the SI units."""

    plan: Plan
    system: str
    columns: Mapping[str, Floats]
    names: Sequence[str]
    known: Mapping[str, str]
    units: Units

    def __getitem__(self, name: str) -> Floats:
        found: Floats = self.columns[name] / self.units.size(self.known.get(_quantity(name), ""))
        return found

    def named(self, name: str) -> str:
        """Return a name with its unit."""
        return self.units.named(name, self.known.get(_quantity(name), ""))

    @property
    def title(self) -> str:
        """What the figure is of."""
        return f"{self.system}: {len(self.plan)} runs"


def figure_of(
    plan: Plan, about: Mapping[str, Any], columns: Mapping[str, Any], show: Sequence[str] | None, units: Units
) -> Any:
    """Return a matplotlib figure of the columns that are to be shown; by default of all that change, in maps of ends.

    Over one varied value it has a panel for each unit with all curves in it; over two a map of each column, as cells of
    a grid or as points of samples. Raises InputError for unknown columns, and for three values.
    """
    if len(plan.names) > 2:
        message = f"a figure is over one or two varied values; here are {len(plan.names)}: {', '.join(plan.names)}"
        raise InputError(message)
    known = results(plan, columns)
    for name in show or ():
        if name not in known:
            raise InputError(f"no column of results is called {name!r}", word=name, known=known)
    names = tuple(show or _usual(len(plan.names), {name: columns[name] for name in known}))
    if not names:
        failed = all(columns[FAILURE] != "")
        raise InputError(f"there is no result to plot: {'every run failed' if failed else 'no run gave a number'}")
    study = _Shown(plan, about["system"], columns, names, about.get("units", {}), units)
    if len(plan.names) == 1:
        return plotted(_curves(study))
    with plain_style():
        return _maps(study)


def _usual(varied: int, columns: Mapping[str, Floats]) -> list[str]:
    """Return what is shown where nothing else is asked for: what is not the same in all runs, end values in maps."""
    changing = [name for name, values in columns.items() if _changes(values)] or list(columns)[:1]
    if varied == 2:
        return [name for name in changing if _quantity(name) == name or name.endswith(" end")] or changing
    return changing


def _changes(values: Floats) -> bool:
    found = values[np.isfinite(values)]
    return len(found) > 0 and bool(found.min() < found.max())


def _quantity(name: str) -> str:
    return name.removesuffix(" end").removesuffix(" min").removesuffix(" max")


def _curves(study: _Shown) -> Plot:
    """Return the curves over the one value that is varied, by panels; what has no known unit has one of its own."""
    (varied,) = study.plan.names
    order = np.argsort(study[varied], kind="stable")
    panels: dict[tuple[str, str], list[Curve]] = {}
    for name in study.names:
        quantity = _quantity(name)
        unit = study.units.of(study.known.get(quantity, ""))
        curve = Curve(name, study[varied][order], study[name][order])
        panels.setdefault((unit, "" if unit else quantity), []).append(curve)
    found = tuple(Panel(unit, tuple(curves)) for (unit, _), curves in panels.items())
    return Plot(study.title, study.named(varied), found, dots=len(study.plan) <= _DOTTED)


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
        axis.set_title(literal(study.named(name)), fontsize="medium")
        axis.set_xlabel(literal(study.named(x)))
        axis.set_ylabel(literal(study.named(y)))
    for axis in axes.flat[len(columns) :]:
        axis.set_visible(False)
    figure.suptitle(literal(study.title))
    return figure


def _empty(high: int, wide: int, size: tuple[float, float]) -> tuple[Any, Any]:
    from multibody_sym.drawing.plots.shown import ShownFigure

    figure = ShownFigure(figsize=size, layout="constrained")
    return figure, figure.subplots(high, wide, squeeze=False)
