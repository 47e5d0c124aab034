"""Figures of matplotlib as files, in its default style and the same bytes each time."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from typing import Any

from multibody_sym.errors import OutputError
from multibody_sym.text.files import path_name, write_whole


def write_figure(figure: Any, path: str | os.PathLike[str]) -> None:
    """Write the figure as PNG, SVG or PDF, by the ending of `path`. Raises OutputError."""
    ending = os.path.splitext(path_name(path))[1].removeprefix(".").lower() or "png"
    write_whole(path, figure_content(figure, ending))


def figure_content(figure: Any, ending: str) -> bytes:
    """Return the figure in a format, the same bytes each time. Raises OutputError for what is no format."""
    import matplotlib as mpl

    found, dated = io.BytesIO(), {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with plain_style(), mpl.rc_context({"svg.hashsalt": "multibody_sym"}), _fixed_layout(figure):
        try:
            figure.savefig(found, format=ending, metadata=dated.get(ending))
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
