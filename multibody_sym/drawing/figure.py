"""A figure: a picture that shows itself in notebooks and writes itself in the format of a file's ending."""

from __future__ import annotations

import os
from typing import Final

from multibody_sym.drawing.picture import Picture
from multibody_sym.drawing.svg import svg
from multibody_sym.errors import ArgumentError, InputError, Where, shown
from multibody_sym.formats.files import path_name, write_whole
from multibody_sym.model.declaration.doors import door
from multibody_sym.records import dataclass

ENDINGS: Final = (".svg", ".png", ".pdf", ".tex")
"""The formats by the ending of a file's name; PNG and PDF take matplotlib."""


@dataclass(frozen=True, eq=False)
class Figure:
    """A drawn mechanism. `svg` and `tex` are documents; `description` says in words what is seen, for alt texts."""

    picture: Picture

    @property
    def svg(self) -> str:
        """The figure as an SVG document."""
        return svg(self.picture)

    @property
    def tex(self) -> str:
        """The figure as a LaTeX document with TikZ, which pdflatex makes a page of the figure's size of."""
        from multibody_sym.drawing.tikz import tikz

        return tikz(self.picture)

    @property
    def title(self) -> str:
        """The name of the system."""
        return self.picture.title

    @property
    def description(self) -> str:
        """What is seen, in words."""
        return self.picture.description

    @property
    def size(self) -> tuple[float, float]:
        """Width and height in points (1/72 inch)."""
        return self.picture.width, self.picture.height

    @door
    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the figure as SVG, PNG, PDF or TeX by the ending of `path`, the same bytes every time.

        Raises InputError for another ending, OutputError where it cannot be written or matplotlib is missing.
        """
        write_whole(path, self.content(ending_of(path)))

    @door
    def content(self, ending: str) -> bytes:
        """Return the figure as the content of a file with an ending of ENDINGS. Raises InputError, OutputError."""
        if not isinstance(ending, str) or ending not in ENDINGS:
            raise ArgumentError(f"ending: expected one of {', '.join(ENDINGS)}, got {shown(ending)}")
        if ending == ".svg":
            return self.svg.encode()
        if ending == ".tex":
            return self.tex.encode()
        from multibody_sym.drawing.raster import raster

        return raster(self.picture, ending.removeprefix("."))

    def _repr_svg_(self) -> str:
        return svg(self.picture, alone=False)

    def __repr__(self) -> str:
        width, height = self.size
        return f"Figure({self.title!r}, {width:.0f} pt x {height:.0f} pt)"


def ending_of(path: str | os.PathLike[str]) -> str:
    """Return the ending of a figure's name. Raises InputError for one that is no format."""
    name = path_name(path)
    ending = os.path.splitext(name)[1].lower()
    if ending not in ENDINGS:
        message = f"a figure is written to {', '.join(ENDINGS)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name))
    return ending
