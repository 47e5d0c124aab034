"""A figure of matplotlib that shows itself in a notebook, whatever that has switched on."""

from __future__ import annotations

from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from multibody_sym.pictures.page.files import figure_content


class ShownFigure(Figure):
    """A matplotlib figure drawn by Agg, which needs no screen."""

    def __init__(self, *sizes: Any, **named: Any) -> None:
        super().__init__(*sizes, **named)
        FigureCanvasAgg(self)

    def _repr_png_(self) -> bytes:
        return figure_content(self, "png")
