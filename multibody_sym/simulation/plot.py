"""A run as a figure: coordinates, speeds and outputs over time."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from multibody_sym.errors import OutputError
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.formats.files import path_name, write_whole

if TYPE_CHECKING:
    from multibody_sym.numerics.arrays import Floats
    from multibody_sym.simulation.samples import Samples

_MOST_CURVES = 12


def figure_of(samples: Samples, units: Units = SI) -> Any:
    """Return a matplotlib figure in chosen units.

    It has an axis for each unit among coordinates and speeds, for each among the outputs and for those without one.
    What begins to stick, slide, open or close is marked.
    """
    panels, times = _panels(samples, units), samples.t / units.size("s")
    marks = samples.changes
    with _plain_style():
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 1.0 + 2.2 * len(panels)), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, (label, curves) in zip(axes, panels.items(), strict=True):
            for name, values in list(curves.items())[:_MOST_CURVES]:
                axis.plot(times, values, label=_literal(name), linewidth=1.2)
            for event in marks:
                axis.axvline(event["t"] / units.size("s"), color="0.6", linewidth=0.6, linestyle=":", zorder=0)
            axis.set_ylabel(_literal(label))
            axis.grid(visible=True, alpha=0.3)
            axis.legend(loc="upper right", fontsize="small")
        for event in marks[:_MOST_CURVES]:
            told, place = _literal(f"{event['element']} {event['kind']}"), event["t"] / units.size("s")
            axes[0].text(place, 1.0, told, transform=axes[0].get_xaxis_transform(), rotation=90, fontsize=6, va="top")
        axes[0].set_title(_literal(samples.ready.mechanism.name))
        axes[-1].set_xlabel(f"t in {units.of('s')}")
    return figure


def write_figure(figure: Any, path: str | os.PathLike[str]) -> None:
    """Write the figure as PNG, SVG or PDF, by the ending of `path`. Raises OutputError."""
    content, ending = io.BytesIO(), os.path.splitext(path_name(path))[1].removeprefix(".").lower() or "png"
    with _plain_style():
        try:
            figure.savefig(content, format=ending)
        except ValueError as problem:
            raise OutputError(f"the figure cannot be written as '{ending}': {problem}") from None
    write_whole(path, content.getvalue())


def _panels(samples: Samples, units: Units) -> Mapping[str, Mapping[str, Floats]]:
    panels: dict[str, dict[str, Floats]] = {}
    for name, values in {**samples.coordinates, **samples.speeds}.items():
        unit = samples.units[name]
        panels.setdefault(units.of(unit) or "quaternion", {})[name] = values / units.size(unit)
    for name, values in samples.outputs.items():
        unit = samples.output_units[name]
        label = f"outputs in {units.of(unit)}" if unit else "outputs"
        panels.setdefault(label, {})[name] = values / units.size(unit)
    return panels or {"": {}}


def _literal(name: str) -> str:
    """Return a name that matplotlib shows as it stands: no formula, and no leading _ that would hide it."""
    shown = name.replace("$", r"\$")
    return f" {shown}" if shown.startswith("_") else shown


@contextlib.contextmanager
def _plain_style() -> Iterator[None]:
    """Use matplotlib in its default style; a settings file in the working folder is not read."""
    try:
        with _elsewhere() if "matplotlib" not in sys.modules else contextlib.nullcontext():
            import matplotlib.style
    except ImportError:
        raise OutputError("plots need matplotlib: pip install 'multibody_sym[plot]'") from None
    with matplotlib.style.context("default"):
        yield


@contextlib.contextmanager
def _elsewhere() -> Iterator[None]:
    """Work in the root folder for a moment: matplotlib looks for its settings in the working folder first."""
    before = os.getcwd()
    os.chdir(os.path.abspath(os.sep))
    try:
        yield
    finally:
        os.chdir(before)
