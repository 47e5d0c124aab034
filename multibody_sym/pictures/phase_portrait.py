"""Curves of constant energy on a page: a phase portrait over q and p, and Poinsot's ellipsoid with its polhodes.

In: a `PhasePortrait`, or moments of inertia and an angular velocity. Out: a Picture.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any, Final, NamedTuple

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
    letters,
    width_of,
    words,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_WIDTH, _HEIGHT, _MARGIN, _SIZE = 300.0, 200.0, 34.0, 9.0
"""Points: of the plane, around it, and of letters."""
_PENS: Final = {"orbit": THIN, "separatrix": MARKED, "start": Pen(1.2, VELOCITY.colour)}
_DOT: Final = 2.6
_TICK: Final = 3.0
_MOST_TICKS: Final = 5
_FRAME: Final = Pen(0.4, "#9aa3ad")


class FixedPoint(NamedTuple):
    """A point of the phase plane that rests, its energy, and its `kind`: centre, saddle or cusp."""

    q: float
    p: float
    energy: float
    kind: str


@dataclass(frozen=True, eq=False)
class PhaseCurve:
    """A curve of constant energy, points (n, 2) of q and p in the direction of motion.

    `kind`: orbit, separatrix (through saddles), or start (the declared motion).
    """

    points: Floats
    closed: bool
    kind: str


@dataclass(frozen=True, eq=False)
class PhasePortrait:
    """Curves and fixed points of one freedom over a `window` of places; `begin` is where the declared motion starts.

    `units` are those of q and p.
    """

    coordinate: str
    is_angle: bool
    window: tuple[float, float]
    curves: tuple[PhaseCurve, ...]
    fixed_points: tuple[FixedPoint, ...]
    begin: tuple[float, float]
    units: tuple[str, str]

    @property
    def description(self) -> str:
        """What is seen, in words."""
        told = [f"Phase portrait of {self.coordinate}, its momentum over it: curves of constant energy."]
        for kind in ("centre", "saddle", "cusp"):
            found = [x.q for x in self.fixed_points if x.kind == kind]
            places = [(_part_of_pi(q) if self.is_angle else "") or f"{q:.4g}" for q in found]
            if places:
                told.append(f"{kind.capitalize()}{'s' * (len(places) > 1)} at {', '.join(places)}.")
        if any(x.kind == "separatrix" for x in self.curves):
            told.append("The separatrix is the curve of their energy.")
        start = next((x for x in self.curves if x.kind == "start"), None)
        if start is not None:
            told.append("The declared motion goes to and fro." if start.closed else "The declared motion goes on.")
        return " ".join(told)

    # --- on the page, (0, 0) at the lower left corner of the plane ----------------------------------------------------

    @cached_property
    def _top(self) -> float:
        """The largest momentum that is shown: that of all curves, or far above those that matter."""
        every = [float(np.abs(x.points[:, 1]).max()) for x in self.curves]
        tops = [top for top, x in zip(every, self.curves, strict=True) if x.kind != "orbit"]
        return 1.08 * max(max(every, default=0.0) if not tops else min(2.5 * max(tops), max(every)), 1e-300)

    @cached_property
    def _scale(self) -> Floats:
        low, high = self.window
        return np.array([_WIDTH / (high - low), _HEIGHT / (2 * self._top)])

    def _on_page(self, points: Floats) -> Floats:
        """Return points (n, 2) or (2,) of q and p on the page."""
        corner = np.array([self.window[0], -self._top])
        return np.asarray((points - corner) * self._scale + _MARGIN)

    def picture(self, title: str) -> Picture:
        """Return the portrait on a page."""
        size = _WIDTH + 2 * _MARGIN, _HEIGHT + 2 * _MARGIN
        marks = [*self._axes(), *self._curves(), *self._points()]
        return Picture(*size, marks, title, self.description)

    def _curves(self) -> Iterator[Placed]:
        for curve in self.curves:
            named: Any = {"role": "phase", "name": curve.kind}
            for part in self._clipped(curve.points):
                yield Stroke(self._on_page(part), _PENS[curve.kind], **named)
            tip = self._middle(curve)
            if tip is not None:
                yield Arrow(tip, _PENS[curve.kind], head=5.0, **named)

    def _clipped(self, points: Floats) -> Iterator[Floats]:
        """Yield the parts of a curve within the plane, of two points or more."""
        inside = np.abs(points[:, 1]) <= self._top
        edges = np.flatnonzero(np.diff(np.concatenate(([False], inside, [False])).astype(int)))
        yield from (points[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1)

    def _middle(self, curve: PhaseCurve) -> Floats | None:
        """Return a short way along a curve where its momentum is largest in size, None outside of the plane."""
        p = curve.points[:, 1]
        k = int(np.argmax(np.abs(p)))
        if not (1 <= k < len(p) - 1 and abs(p[k]) <= self._top):
            k = len(p) // 2
        if not 1 <= k < len(p) - 1 or abs(p[k]) > self._top:
            return None
        way = self._on_page(curve.points[k - 1 : k + 2])
        along = way[2] - way[0]
        size = float(np.hypot(*along))
        return None if size == 0.0 else np.array([way[1] - 3.0 * along / size, way[1] + 3.0 * along / size])

    def _points(self) -> Iterator[Placed]:
        for each in self.fixed_points:
            at = self._on_page(np.array([each.q, each.p]))
            fill = INK.colour if each.kind == "centre" else "#ffffff"
            yield Arc(at, _DOT, INK, fill=fill, layer=1.0, role="phase", name=each.kind)
        at = self._on_page(np.array(self.begin))
        yield Arc(at, _DOT - 0.6, None, fill=VELOCITY.colour, layer=1.0, role="phase", name="start")

    # --- axes -----------------------------------------------------------------------------------------------------

    def _axes(self) -> Iterator[Placed]:
        named: Any = {"role": "axis", "name": self.coordinate}
        low, high = self.window
        corners = self._on_page(np.array([[low, -self._top], [high, -self._top], [high, self._top], [low, self._top]]))
        yield Stroke(corners, _FRAME, closed=True, **named)
        yield Stroke(self._on_page(np.array([[low, 0.0], [high, 0.0]])), _FRAME, **named)
        if low < 0.0 < high:
            yield Stroke(self._on_page(np.array([[0.0, -self._top], [0.0, self._top]])), _FRAME, **named)
        name, (unit, unit_of_momentum) = letters(self.coordinate), self.units
        momentum: tuple[Run, ...] = (("p", "italic"), ("".join(x for x, _ in name), "subscript"))
        across = (*name, (f" ({unit})", "roman")) if unit else name
        shown = unit_of_momentum.replace("*", " ").replace("^2", "\u00b2")
        up = (*momentum, (f" ({shown})", "roman")) if shown else momentum
        yield TextMark(corners[1] + np.array([-width_of(across, _SIZE), -2.6 * _SIZE]), across, _SIZE, **named)
        yield TextMark(corners[3] + np.array([0.0, 5.0]), up, _SIZE, **named)
        for q in self._ticks(low, high, is_angle=self.is_angle):
            at, runs = self._on_page(np.array([q, -self._top])), _tick_runs(q, is_angle=self.is_angle)
            yield Stroke(np.array([at, at + np.array([0.0, _TICK])]), THIN, **named)
            below = np.array([width_of(runs, _SIZE) / 2, _SIZE + 1.0])
            yield TextMark(at - below, runs, _SIZE, **named)
        for p in self._ticks(-self._top, self._top, is_angle=False):
            at, runs = self._on_page(np.array([low, p])), _tick_runs(p, is_angle=False)
            yield Stroke(np.array([at, at + np.array([_TICK, 0.0])]), THIN, **named)
            yield TextMark(at - np.array([3.0 + width_of(runs, _SIZE), 3.0]), runs, _SIZE, **named)

    @staticmethod
    def _ticks(low: float, high: float, *, is_angle: bool) -> list[float]:
        """Return round numbers between two ends, or multiples of pi."""
        if is_angle:
            return [n * math.pi for n in range(math.ceil(low / math.pi), math.floor(high / math.pi) + 1)]
        rough = (high - low) / _MOST_TICKS
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(x * power for x in (1.0, 2.0, 5.0, 10.0) if x * power >= rough)
        return [n * step for n in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _part_of_pi(q: float) -> str:
    """Return an angle as a multiple of pi by halves; empty for others."""
    halves = q / (math.pi / 2)
    n = round(halves)
    if abs(halves - n) > 1e-6:
        return ""
    if n == 0:
        return "0"
    size, sign = abs(n), "-" if n < 0 else ""
    whole = f"{size // 2 if size > 2 else ''}pi" if size % 2 == 0 else f"{size if size > 1 else ''}pi/2"
    return sign + whole


def _tick_runs(value: float, *, is_angle: bool) -> tuple[Run, ...]:
    text = _part_of_pi(value) if is_angle else f"{value:.4g}"
    return words(text.replace("pi", "\u03c0").replace("-", "\u2212"))


# ----------------------------------------------------------------------------------------------------------------------
# Poinsot's ellipsoid of a body that turns freely: the energy ellipsoid with its polhodes, in the principal axes.
#
#    A w1^2 + B w2^2 + C w3^2 = 2 T        A^2 w1^2 + B^2 w2^2 + C^2 w3^2 = L^2
#
# Each polhode is the curve of one L on the ellipsoid of one T: it surrounds the axis of the least or the greatest
# moment; those of L^2 = 2 T B, through the middle axis, separate them.


_RADIUS, _AROUND, _LETTER = 110.0, 40.0, 10.0
_POINTS: Final = 241
_PARTS: Final = (0.12, 0.45, 0.78)
"""Polhodes about an axis, by the part of the way of L^2 from its value at the axis to that of the separatrix."""
_EQUAL: Final = 1e-9
"""The part of the greatest moment by which moments differ that are equal."""
_VIEW: Final = Projection((-0.5299192642, 0.8480480962, 0.0), (-0.3, -0.1874606, 0.9353604))
_CURVE_PENS: Final = {"polhode": THIN, "separatrix": MARKED, "start": Pen(1.4, VELOCITY.colour)}


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
        about = self.surrounded  # else the start's is a point, or the separatrix
        if about is not None:
            way = self.about(about, self._square)
            yield "start", way if self.omega[about] > 0.0 else -way

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
            gaps = np.diff(self.moments)
            if gaps.max() <= _EQUAL * self.moments[2]:
                told.append("All moments are equal: every polhode is a point.")
            else:
                axis_of_circles = 3 if gaps[0] < gaps[1] else 1
                told.append(f"Two moments are equal: polhodes are circles about axis {axis_of_circles}.")
        else:
            told.append("Turning about axes 1 and 3 is stable, about axis 2 unstable.")
        axis = self.surrounded
        own = "turns steadily" + (" or comes to axis 2" if not self.is_symmetric else "")
        own = own if axis is None else f"surrounds axis {axis + 1}"
        return " ".join([*told, f"The declared motion {own}."])

    # --- on the page ----------------------------------------------------------------------------------------------

    def picture(self, title: str) -> Picture:
        """Return the ellipsoid on a page, seen with axis 1 to the lower left, axis 2 to the right and axis 3 up."""
        outline = self._outline
        reach = np.abs(outline).max(axis=0)
        scale = _RADIUS / float(reach.max())
        size = 2 * (reach * scale + _AROUND)
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
            yield TextMark(ends[1] + 30.0 * unit - np.array([5.0, 3.0]), runs, _LETTER, **named)

    def _curve(self, kind: str, way: Floats, scale: float, centre: Floats) -> Iterator[Placed]:
        """Yield the parts of a curve, those on the far side dashed, or left out where many curves lie."""
        near = (way * self.moments) @ _VIEW.toward >= 0.0
        points = _VIEW.page(way) * scale + centre
        pen = _CURVE_PENS[kind]
        behind = Pen(pen.width, pen.colour, HIDDEN.dash)
        for part in np.split(np.arange(len(way)), np.flatnonzero(np.diff(near)) + 1):
            if kind == "polhode" and not near[part[0]]:
                continue
            reached = np.append(part, min(part[-1] + 1, len(way) - 1))
            yield Stroke(points[reached], pen if near[part[0]] else behind, role="polhode", name=kind)
