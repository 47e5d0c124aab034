"""Matplotlib: pictures as PNG and PDF, and figures as files in its default style, the same bytes each time."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.errors import OutputError
from multibody_sym.pictures.page.picture import DROPS, SIZES, Arc, Picture, Stroke, TextMark, run_width
from multibody_sym.text.files import path_name, write_whole

# ----------------------------------------------------------------------------------------------------------------------
# Figures of matplotlib as files, in its default style and the same bytes each time.


def write_figure(figure: Any, path: str | os.PathLike[str]) -> None:
    """Write the figure as PNG, SVG or PDF, by the ending of `path`. Raises OutputError."""
    ending = os.path.splitext(path_name(path))[1].removeprefix(".").lower() or "png"
    write_whole(path, figure_content(figure, ending, _PRINTED))


_PRINTED: Final = 200
"""Dots an inch of a figure in a file."""


def figure_content(figure: Any, ending: str, dots: float | None = None) -> bytes:
    """Return the figure in a format, the same bytes each time; `dots` an inch, those of a screen unless told.

    Raises OutputError for what is no format.
    """
    import matplotlib as mpl

    found, dated = io.BytesIO(), {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with plain_style(), mpl.rc_context({"svg.hashsalt": "multibody_sym"}), _fixed_layout(figure):
        try:
            figure.savefig(found, format=ending, dpi=dots or "figure", metadata=dated.get(ending))
        except ValueError as problem:
            raise OutputError(f"the figure cannot be written as '{ending}': {problem}", number="O102") from None
    return found.getvalue()


@contextlib.contextmanager
def _fixed_layout(figure: Any) -> Iterator[None]:
    """Lay a figure out now: one whose layout is asked for while it is written is drawn twice."""
    engine = figure.get_layout_engine()
    if engine is None:
        yield
        return
    engine.execute(figure)
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)


@contextlib.contextmanager
def plain_style() -> Iterator[None]:
    """Use matplotlib in its default style; a settings file in the working folder is not read."""
    try:
        with _elsewhere() if "matplotlib" not in sys.modules else contextlib.nullcontext():
            import matplotlib.style
    except ImportError:
        raise OutputError("plots need matplotlib: pip install 'multibody_sym[plot]'", number="O104") from None
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


# ----------------------------------------------------------------------------------------------------------------------
# Pictures as PNG and PDF by matplotlib, which is asked to draw marks and to lay out nothing.


DOTS: Final = 200
"""Dots per inch of a PNG."""
_INCH: Final = 72.0


def raster(picture: Picture, ending: str) -> bytes:
    """Return a picture as `png` or `pdf`, the same bytes every time. Raises OutputError without matplotlib."""
    content = io.BytesIO()
    with plain_style():
        figure = _figure(picture, DOTS)
        nameless = ("CreationDate", "Creator", "Producer") if ending == "pdf" else ("Software",)  # no versions, no date
        metadata = {"Title": picture.title, **dict.fromkeys(nameless)}
        figure.savefig(content, format=ending, dpi=DOTS, metadata=metadata)
    return content.getvalue()


def pixels(picture: Picture, dots: int) -> Any:
    """Return a picture as red, green and blue (height, width, 3), both sizes even. Raises OutputError."""
    with plain_style():
        figure = _figure(picture, dots)
        figure.canvas.draw()
        found = np.asarray(figure.canvas.buffer_rgba())[:, :, :3]
    height, width = (2 * (size // 2) for size in found.shape[:2])
    return np.ascontiguousarray(found[:height, :width])


def _figure(picture: Picture, dots: int) -> Any:
    """Return a figure of matplotlib that holds the marks and nothing else."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(picture.width / _INCH, picture.height / _INCH), dpi=dots, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, picture.width)
    axes.set_ylim(0.0, picture.height)
    for order, mark in enumerate(picture.simple):
        for artist in _letters(mark, order) if isinstance(mark, TextMark) else [_line(mark, order)]:
            axes.add_artist(artist)
    return figure


def _line(mark: Stroke | Arc, order: int) -> Any:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    if isinstance(mark, Arc) and mark.full:
        path = Path.circle(tuple(mark.centre), mark.radius)
    elif isinstance(mark, Arc):
        unit = Path.arc(np.degrees(mark.start), np.degrees(mark.stop))
        path = Path(np.asarray(unit.vertices) * mark.radius + np.asarray(mark.centre), unit.codes)
    else:
        points = np.asarray(mark.points)
        path = Path(np.vstack((points, points[:1])), closed=True) if mark.closed else Path(points)
    pen = mark.pen
    dash = ((0, [d / pen.width for d in pen.dash]) if pen.dash else "-") if pen else "-"
    return PathPatch(
        path,
        facecolor=mark.fill or "none",
        edgecolor=pen.colour if pen else "none",
        linewidth=pen.width if pen else 0.0,
        linestyle=dash,
        joinstyle="round",
        capstyle="round",
        zorder=order + 1,
    )


def _letters(mark: TextMark, order: int) -> list[Any]:
    """Return the runs as outlines of STIX letters, as wide as the layout took them to be; a $ starts no formula."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.patches import PathPatch
    from matplotlib.textpath import TextPath
    from matplotlib.transforms import Affine2D

    x, y = (float(v) for v in mark.at)
    found = []
    for run in mark.runs:
        text, style = run
        wide, size, low = run_width(run, mark.size), mark.size * SIZES[style], mark.size * DROPS[style]
        font = FontProperties(family=["STIXGeneral", "DejaVu Serif"], style="italic" if style == "italic" else "normal")
        if text.strip():
            outline = TextPath((0, 0), text.replace("$", r"\$"), size=size, prop=font, usetex=False)
            natural = outline.get_extents().x1 or wide
            squeeze = min(1.0, wide / natural)
            place = Affine2D().scale(squeeze, 1.0).translate(x, y - low)
            found.append(PathPatch(place.transform_path(outline), facecolor=mark.colour, linewidth=0, zorder=order + 1))
        x += wide
    return found
