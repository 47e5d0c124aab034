"""From places in space to places on a page: the direction of view, the scale, and what is nearer to the reader."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.errors import InputError, Where, shown
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

WIDTH: Final = 255.0
HEIGHT: Final = 215.0
"""What the mechanism itself covers at most (pt): 90 mm wide, with room for labels around it within 150 mm."""
LEAST: Final = 60.0
"""The length (pt) of a mechanism whose extent is zero or all but zero in one direction decides nothing by itself."""
_STEEPEST: Final = 90.0
VIEWS: Final = {
    "front": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "back": ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "top": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    "right": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "left": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
}
"""Views by name where y points up: the directions to the right and up on the page, in space."""
ISO: Final = (45.0, math.degrees(math.atan(math.sqrt(0.5))))
"""Azimuth and elevation (deg) of the isometric view."""


@dataclass(frozen=True)
class Projection:
    """A parallel projection: unit vectors to the right and up on the page, and its scale in points per metre."""

    right: tuple[float, float, float]
    up: tuple[float, float, float]
    scale: float = 1.0
    flat: bool = False

    @property
    def toward(self) -> Floats:
        """The unit vector from the page to the reader."""
        return np.cross(self.right, self.up)

    def page(self, points: Floats | Sequence[Sequence[float]]) -> Floats:
        """Return where points (.., 3) in space (m) are on the page (.., 2) in points."""
        found: Floats = self.scale * (np.asarray(points, dtype=float) @ np.array([self.right, self.up]).T)
        return found

    def depth(self, points: Floats | Sequence[Sequence[float]]) -> Floats:
        """Return how far points (.., 3) are towards the reader (m)."""
        found: Floats = np.asarray(points, dtype=float) @ self.toward
        return found

    def scaled(self, extent: Floats, times: float = 1.0, most: float = math.inf) -> Projection:
        """Return this view at the scale at which points (n, 3) fill the page, as far as they have an extent.

        A page `times` as large as usual; the scale (pt/m) is at most `most`.
        """
        spans = np.ptp(Projection(self.right, self.up).page(extent), axis=0) if len(extent) else np.zeros(2)
        spans = np.where(np.isfinite(spans), spans, 0.0)
        wide = spans > 1e-9 * spans.max()
        room = [times * limit / span for limit, span in zip(np.array([WIDTH, HEIGHT])[wide], spans[wide], strict=True)]
        return Projection(self.right, self.up, float(min([most, *(room or [LEAST])])), self.flat)


def view_of(
    asked: str | Sequence[float] | None,
    usual: Projection,
    upward: Sequence[float] = (0.0, 1.0, 0.0),
    plane: Sequence[float] | None = None,
) -> Projection:
    """Return the projection that was asked for: a name of VIEWS, iso, azimuth and elevation in degrees, None for usual.

    `upward` is the direction in space that points up where azimuth and elevation are asked for. `plane` is the normal
    of a plane mechanism: seen along it the picture is flat. Raises InputError.
    """
    if asked is None:
        return usual
    if isinstance(asked, str) and (asked == "iso" or asked in VIEWS):
        right, up = _turned(*ISO, upward) if asked == "iso" else _named(str(asked), upward)
    else:
        right, up = _turned(*_angles(asked), upward)
    toward = np.cross(right, up)
    flat = plane is not None and abs(float(np.dot(toward, np.asarray(plane, dtype=float)))) > 1.0 - 1e-9
    return Projection(right, up, 1.0, flat)


def _angles(asked: str | Sequence[float]) -> tuple[float, float]:
    """Return azimuth and elevation in degrees. Raises InputError."""
    try:
        words = re.split(r"\s*,\s*|\s+", asked.strip()) if isinstance(asked, str) else list(asked)
        azimuth, elevation = (float(word) for word in words)
    except (TypeError, ValueError, OverflowError):
        message = f"expected a view by name or as AZIMUTH,ELEVATION such as 30,20 (degrees), got {shown(asked)}"
        named = [*VIEWS, "iso"]
        raise InputError(message, where=Where(path=("view",)), word=str(asked), known=named) from None
    if not math.isfinite(azimuth) or not abs(elevation) <= _STEEPEST:
        message = "a view has a finite azimuth, and an elevation from -90 to 90 degrees"
        raise InputError(message, where=Where(path=("view",)))
    return azimuth, elevation


Pair = tuple[tuple[float, float, float], tuple[float, float, float]]


def _axes(upward: Sequence[float]) -> Floats:
    """Return the columns right, up and toward of the front view, where `upward` points up."""
    up = np.asarray(upward, dtype=float)
    up = up / (np.linalg.norm(up) or 1.0)
    right = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    right = right - up * float(right @ up)
    right /= np.linalg.norm(right)
    return np.column_stack((right, up, np.cross(right, up)))


def _named(name: str, upward: Sequence[float]) -> Pair:
    axes = _axes(upward)
    right, up = (axes @ np.array(direction) for direction in VIEWS[name])
    return _vector(right), _vector(up)


def _turned(azimuth: float, elevation: float, upward: Sequence[float]) -> Pair:
    """Return the page's axes of a reader who went around by the azimuth, from the front to the right, and then up."""
    a, e = math.radians(azimuth), math.radians(elevation)
    axes = _axes(upward)
    right = axes @ np.array([math.cos(a), 0.0, -math.sin(a)])
    up = axes @ np.array([-math.sin(a) * math.sin(e), math.cos(e), -math.cos(a) * math.sin(e)])
    return _vector(right), _vector(up)


def _vector(values: Floats) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 15) + 0.0 for value in values)
    return x, y, z
