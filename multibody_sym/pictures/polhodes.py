"""Poinsot's ellipsoid of a body that turns freely: the energy ellipsoid with its polhodes, in the principal axes.

    A w1^2 + B w2^2 + C w3^2 = 2 T        A^2 w1^2 + B^2 w2^2 + C^2 w3^2 = L^2

Each polhode is the curve of one L on the ellipsoid of one T: it surrounds the axis of the least or the greatest moment;
those of L^2 = 2 T B, through the middle axis, separate them. In: moments and angular velocity. Out: a Picture.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.page.picture import (
    HIDDEN,
    INK,
    MARKED,
    THIN,
    VELOCITY,
    Arc,
    Arrow,
    Pen,
    Picture,
    Placed,
    Projection,
    Run,
    Stroke,
    TextMark,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_RADIUS, _MARGIN, _SIZE = 110.0, 40.0, 10.0
_POINTS: Final = 241
_PARTS: Final = (0.12, 0.45, 0.78)
"""Polhodes about an axis, by the part of the way of L^2 from its value at the axis to that of the separatrix."""
_EQUAL: Final = 1e-9
"""The part of the greatest moment by which moments differ that are equal."""
_VIEW: Final = Projection((-0.5299192642, 0.8480480962, 0.0), (-0.3, -0.1874606, 0.9353604))
_PENS: Final = {"polhode": THIN, "separatrix": MARKED, "start": Pen(1.4, VELOCITY.colour)}


@dataclass(frozen=True, eq=False)
class Polhodes:
    """The `moments` of a body (3, ascending) and its angular velocity `omega` (3, rad/s), both in principal axes."""

    body: str
    moments: Floats
    omega: Floats

    @cached_property
    def double_energy(self) -> float:
        """2 T."""
        return float(self.moments @ self.omega**2)

    @cached_property
    def _square(self) -> float:
        """L^2."""
        return float(self.moments**2 @ self.omega**2)

    @cached_property
    def axes(self) -> Floats:
        """The half axes of the ellipsoid (3,)."""
        return np.sqrt(self.double_energy / self.moments)

    def about(self, axis: int, square: float) -> Floats:
        """Return the polhode of L^2 = `square` about the axis 0 or 2, on its positive side, (n, 3)."""
        others = [k for k in range(3) if k != axis]
        moments = self.moments
        level = square - self.double_energy * moments[axis]
        turn = np.linspace(0.0, 2 * np.pi, _POINTS)
        w = np.zeros((_POINTS, 3))
        for k, wave in zip(others, (np.cos(turn), np.sin(turn)), strict=True):
            w[:, k] = np.sqrt(level / (moments[k] * (moments[k] - moments[axis]))) * wave
        rest = self.double_energy - w**2 @ moments
        w[:, axis] = np.sqrt(np.maximum(rest, 0.0) / moments[axis])
        return w

    @property
    def is_symmetric(self) -> bool:
        """Whether two moments are equal."""
        return float(np.diff(self.moments).min()) <= _EQUAL * float(self.moments[2])

    def curves(self) -> Iterator[tuple[str, Floats]]:
        """Yield the polhodes by their kinds; the motion from the start last."""
        a, b, c = self.moments
        middle = self.double_energy * b
        for axis, moment, other in ((0, a, b), (2, c, b)):
            if abs(moment - other) <= _EQUAL * c:
                continue
            for part in _PARTS:
                way = self.about(axis, self.double_energy * moment + part * (middle - self.double_energy * moment))
                yield "polhode", way
                yield "polhode", -way
        if not self.is_symmetric:
            yield from (("separatrix", sign * self.about(2, middle)) for sign in (1.0, -1.0))
        own = self._own
        if own is not None:
            yield "start", own

    @property
    def _own(self) -> Floats | None:
        """The polhode of the start, None where it is a point, or the separatrix."""
        axis = self.surrounded
        if axis is None:
            return None
        way = self.about(axis, self._square)
        return way if self.omega[axis] > 0.0 else -way

    @property
    def surrounded(self) -> int | None:
        """The axis that the motion surrounds, 0 or 2; None where it turns steadily or comes to the middle axis."""
        a, b, c = self.moments * self.double_energy
        little = _EQUAL * c
        if self._square > b + little:
            return 2 if self._square < c - little else None
        return 0 if a + little < self._square < b - little else None

    @property
    def description(self) -> str:
        """What is seen, in words."""
        named = ", ".join(f"{x:.4g}" for x in self.moments)
        told = [f"Poinsot's ellipsoid of {self.body} in principal axes, moments {named} kg m^2, with its polhodes."]
        if self.is_symmetric:
            told.append("Two moments are equal: polhodes are circles about the third axis.")
        else:
            told.append("Turning about axes 1 and 3 is stable, about axis 2 unstable.")
        axis = self.surrounded
        own = "turns steadily or comes to axis 2" if axis is None else f"surrounds axis {axis + 1}"
        return " ".join([*told, f"The declared motion {own}."])

    # --- on the page ----------------------------------------------------------------------------------------------

    def picture(self, title: str) -> Picture:
        """Return the ellipsoid on a page, seen with axis 1 to the lower left, axis 2 to the right and axis 3 up."""
        outline = self._outline
        reach = np.abs(outline).max(axis=0)
        scale = _RADIUS / float(reach.max())
        size = 2 * (reach * scale + _MARGIN)
        centre = size / 2
        marks: list[Placed] = [Stroke(outline * scale + centre, INK, closed=True, role="ellipsoid", name=self.body)]
        marks += self._axes(scale, centre)
        for kind, way in self.curves():
            marks += self._curve(kind, way, scale, centre)
        at = _VIEW.page(np.array([self.omega]))[0] * scale + centre
        marks.append(Arc(at, 2.4, None, fill=VELOCITY.colour, layer=1.0, role="polhode", name="start"))
        return Picture(float(size[0]), float(size[1]), marks, title, self.description)

    @property
    def _outline(self) -> Floats:
        """The outline of the ellipsoid on the page (n, 2): the image of the unit circle in the rows of its map."""
        across = np.array([_VIEW.right, _VIEW.up]) * self.axes
        first = across[0] / np.linalg.norm(across[0])
        rest = across[1] - (across[1] @ first) * first
        turn = np.linspace(0.0, 2 * np.pi, _POINTS)[:-1]
        circle = np.outer(np.cos(turn), first) + np.outer(np.sin(turn), rest / np.linalg.norm(rest))
        return np.asarray(circle @ across.T)

    def _axes(self, scale: float, centre: Floats) -> Iterator[Placed]:
        for k in range(3):
            named: Any = {"role": "axis", "name": str(k + 1)}
            tip = np.zeros(3)
            tip[k] = self.axes[k]
            ends = _VIEW.page(np.array([np.zeros(3), tip])) * scale + centre
            along = ends[1] - ends[0]
            unit = along / float(np.hypot(*along))
            yield Stroke(ends, HIDDEN, **named)
            yield Arrow(np.array([ends[1], ends[1] + 22.0 * unit]), THIN, **named)
            runs: tuple[Run, ...] = (("\u03c9", "italic"), (str(k + 1), "subscript"))
            yield TextMark(ends[1] + 30.0 * unit - np.array([5.0, 3.0]), runs, _SIZE, **named)

    def _curve(self, kind: str, way: Floats, scale: float, centre: Floats) -> Iterator[Placed]:
        """Yield the parts of a curve, those on the far side dashed, or left out where many curves lie."""
        near = (way * self.moments) @ _VIEW.toward >= 0.0
        points = _VIEW.page(way) * scale + centre
        pen = _PENS[kind]
        behind = Pen(pen.width, pen.colour, HIDDEN.dash)
        for part in np.split(np.arange(len(way)), np.flatnonzero(np.diff(near)) + 1):
            if kind == "polhode" and not near[part[0]]:
                continue
            reached = np.append(part, min(part[-1] + 1, len(way) - 1))
            yield Stroke(points[reached], pen if near[part[0]] else behind, role="polhode", name=kind)
