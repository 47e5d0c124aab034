"""A run as a figure: coordinates, speeds and outputs over time."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from multibody_sym.errors import OutputError
from multibody_sym.formats.files import path_name, write_whole
from multibody_sym.model.mechanism.mechanism import Coordinate, Speed

if TYPE_CHECKING:
    from multibody_sym.numerics.arrays import Floats
    from multibody_sym.simulation.samples import Samples

_MOST_CURVES = 12


def figure_of(samples: Samples) -> Any:
    """Return a matplotlib figure, one axis for each unit among coordinates and speeds and one for the outputs."""
    panels = _panels(samples)
    with _plain_style():
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 1.0 + 2.2 * len(panels)), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axis, (label, curves) in zip(axes, panels.items(), strict=True):
            for name, values in list(curves.items())[:_MOST_CURVES]:
                axis.plot(samples.t, values, label=_literal(name), linewidth=1.2)
            axis.set_ylabel(_literal(label))
            axis.grid(visible=True, alpha=0.3)
            axis.legend(loc="upper right", fontsize="small")
        axes[0].set_title(_literal(samples.ready.mechanism.name))
        axes[-1].set_xlabel("t in s")
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


def _panels(samples: Samples) -> Mapping[str, Mapping[str, Floats]]:
    mechanism = samples.ready.mechanism
    named: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    panels: dict[str, dict[str, Floats]] = {}
    for each in named:
        panels.setdefault(each.unit or "quaternion", {})[each.name] = samples[each.name]
    if samples.outputs:
        panels["outputs"] = dict(samples.outputs)
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
