"""A phase portrait on a page: axes q and p, curves of constant energy, the separatrix, fixed points.

In: a `PhasePortrait`. Out: a Picture.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.pictures.page.picture import (
    INK,
    MARKED,
    THIN,
    VELOCITY,
    Arc,
    Arrow,
    Pen,
    Picture,
    Placed,
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
            places = [self._place_text(x.q) for x in self.fixed_points if x.kind == kind]
            if places:
                told.append(f"{kind.capitalize()}{'s' * (len(places) > 1)} at {', '.join(places)}.")
        if any(x.kind == "separatrix" for x in self.curves):
            told.append("The separatrix is the curve of their energy.")
        start = next((x for x in self.curves if x.kind == "start"), None)
        if start is not None:
            told.append("The declared motion goes to and fro." if start.closed else "The declared motion goes on.")
        return " ".join(told)

    def _place_text(self, q: float) -> str:
        return _part_of_pi(q) if self.is_angle and _part_of_pi(q) else f"{q:.4g}"

    def picture(self, title: str) -> Picture:
        """Return the portrait on a page."""
        return _Plane(self).picture(title)


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


class _Plane:
    """A portrait on the page, (0, 0) at the lower left corner of the plane."""

    def __init__(self, portrait: PhasePortrait) -> None:
        self.portrait = portrait
        tops = [float(np.abs(x.points[:, 1]).max()) for x in portrait.curves if x.kind != "orbit"]
        every = [float(np.abs(x.points[:, 1]).max()) for x in portrait.curves]
        self.top = 1.08 * max(max(every, default=0.0) if not tops else min(2.5 * max(tops), max(every)), 1e-300)
        low, high = portrait.window
        self.scale = np.array([_WIDTH / (high - low), _HEIGHT / (2 * self.top)])
        self.corner = np.array([low, -self.top])

    def on_page(self, points: Floats) -> Floats:
        """Return points (n, 2) or (2,) of q and p on the page."""
        placed: Floats = (points - self.corner) * self.scale + _MARGIN
        return placed

    def picture(self, title: str) -> Picture:
        size = _WIDTH + 2 * _MARGIN, _HEIGHT + 2 * _MARGIN
        marks = [*self._axes(), *self._curves(), *self._points()]
        return Picture(*size, marks, title, self.portrait.description)

    def _curves(self) -> Iterator[Placed]:
        for curve in self.portrait.curves:
            named: Any = {"role": "phase", "name": curve.kind}
            for part in self._clipped(curve.points):
                yield Stroke(self.on_page(part), _PENS[curve.kind], **named)
            tip = self._middle(curve)
            if tip is not None:
                yield Arrow(tip, _PENS[curve.kind], head=5.0, **named)

    def _clipped(self, points: Floats) -> Iterator[Floats]:
        """Yield the parts of a curve within the plane, of two points or more."""
        inside = np.abs(points[:, 1]) <= self.top
        edges = np.flatnonzero(np.diff(np.concatenate(([False], inside, [False])).astype(int)))
        yield from (points[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1)

    def _middle(self, curve: PhaseCurve) -> Floats | None:
        """Return a short way along a curve where its momentum is largest in size, None outside of the plane."""
        p = curve.points[:, 1]
        k = int(np.argmax(np.abs(p)))
        if not (1 <= k < len(p) - 1 and abs(p[k]) <= self.top):
            k = len(p) // 2
        if not 1 <= k < len(p) - 1 or abs(p[k]) > self.top:
            return None
        way = self.on_page(curve.points[k - 1 : k + 2])
        along = way[2] - way[0]
        size = float(np.hypot(*along))
        return None if size == 0.0 else np.array([way[1] - 3.0 * along / size, way[1] + 3.0 * along / size])

    def _points(self) -> Iterator[Placed]:
        for each in self.portrait.fixed_points:
            at = self.on_page(np.array([each.q, each.p]))
            fill = INK.colour if each.kind == "centre" else "#ffffff"
            yield Arc(at, _DOT, INK, fill=fill, layer=1.0, role="phase", name=each.kind)
        at = self.on_page(np.array(self.portrait.begin))
        yield Arc(at, _DOT - 0.6, None, fill=VELOCITY.colour, layer=1.0, role="phase", name="start")

    # --- axes -----------------------------------------------------------------------------------------------------

    def _axes(self) -> Iterator[Placed]:
        named: Any = {"role": "axis", "name": self.portrait.coordinate}
        low, high = self.portrait.window
        corners = self.on_page(np.array([[low, -self.top], [high, -self.top], [high, self.top], [low, self.top]]))
        yield Stroke(corners, _FRAME, closed=True, **named)
        yield Stroke(self.on_page(np.array([[low, 0.0], [high, 0.0]])), _FRAME, **named)
        if low < 0.0 < high:
            yield Stroke(self.on_page(np.array([[0.0, -self.top], [0.0, self.top]])), _FRAME, **named)
        name, (unit, unit_of_momentum) = letters(self.portrait.coordinate), self.portrait.units
        momentum: tuple[Run, ...] = (("p", "italic"), ("".join(x for x, _ in name), "subscript"))
        across = (*name, (f" ({unit})", "roman")) if unit else name
        shown = unit_of_momentum.replace("*", " ").replace("^2", "\u00b2")
        up = (*momentum, (f" ({shown})", "roman")) if shown else momentum
        yield TextMark(corners[1] + np.array([-width_of(across, _SIZE), -2.6 * _SIZE]), across, _SIZE, **named)
        yield TextMark(corners[3] + np.array([0.0, 5.0]), up, _SIZE, **named)
        for q in self._ticks(low, high, is_angle=self.portrait.is_angle):
            at, runs = self.on_page(np.array([q, -self.top])), _tick_runs(q, is_angle=self.portrait.is_angle)
            yield Stroke(np.array([at, at + np.array([0.0, _TICK])]), THIN, **named)
            below = np.array([width_of(runs, _SIZE) / 2, _SIZE + 1.0])
            yield TextMark(at - below, runs, _SIZE, **named)
        for p in self._ticks(-self.top, self.top, is_angle=False):
            at, runs = self.on_page(np.array([low, p])), _tick_runs(p, is_angle=False)
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


def _tick_runs(value: float, *, is_angle: bool) -> tuple[Run, ...]:
    text = _part_of_pi(value) if is_angle else f"{value:.4g}"
    return words(text.replace("pi", "\u03c0").replace("-", "\u2212"))
