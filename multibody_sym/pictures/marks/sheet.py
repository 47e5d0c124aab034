"""Sheet: a scene at a state, seen in a projection; what the functions that draw ask for places, directions and pens."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.place_symbols import Settled, settle
from multibody_sym.pictures.page.picture import INK, LAYER_BODY, LAYER_JOINT, LAYER_STRAND, MARKED, Pen, Projection
from multibody_sym.pictures.scene.items import Axes, Face, Item, Path, Placed
from multibody_sym.pictures.scene.scene import Scene
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

Values = Sequence[float] | Floats
UNSEEN: Final = ("tie", "free", "contact", "point", "used_point", "drive_about", "drive_along", "friction")
"""Symbols whose place does not say how far a figure reaches."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A scene, where it is `placed`, where it begins (`home`), how it is seen; `marked` are paths with a word.

    In a motion `others` are places on the way, as far as which lines without ends are drawn.
    """

    scene: Scene
    placed: Placed
    home: Placed
    projection: Projection
    marked: Mapping[Path, str] = field(default_factory=dict)
    others: tuple[Placed, ...] = ()

    @property
    def flat(self) -> bool:
        """Whether a plane mechanism is seen across its plane."""
        return self.projection.flat

    def page(self, body: int, points: Any) -> Floats:
        """Return where points (n, 3) of a body are on the page (n, 2)."""
        found = self.projection.page(self.placed.world(body, np.asarray(points, dtype=float)))
        return found + self.settled.bodies[body] if body in self.settled.bodies else found

    def at(self, body: int, point: Values) -> Floats:
        """Return where a point of a body is on the page (2)."""
        return np.asarray(self.page(body, [point])[0])

    def through(self, item: Item, face: Face) -> Floats:
        """Return a place of a face on the page (2), which may lie lower than its plane."""
        lower = self.settled.lower.get(item.path, 0.0)
        return self.at(item.body, face.through) - lower * self.way(item.body, face.normal)

    def way(self, body: int, direction: Values) -> Floats:
        """Return a direction of a body on the page (2): of length 1 where it lies in the page, 0 across it."""
        turned = self.placed.turned(body, direction)
        return self.projection.page(turned) / self.projection.scale

    def depth(self, body: int, point: Values) -> float:
        """Return how far a point of a body is towards the reader (m)."""
        return float(self.projection.depth(self.placed.world(body, np.array([point])))[0])

    def metres(self, points: float) -> float:
        """Return a length on the page in metres."""
        return points / self.projection.scale

    def named(self, item: Any, layer: float, point: Values | None = None, *, body: int | None = None) -> dict[str, Any]:
        """Return what marks of an item say of themselves: role, name, layer and depth."""
        number = getattr(item, "body", -1) if body is None else body
        depth = 0.0 if self.flat or point is None else self.depth(number, point)
        if not self.flat and layer in (LAYER_BODY, LAYER_STRAND, LAYER_JOINT):
            depth += 1e-4 * self.scene.size * (layer - LAYER_BODY)
            layer = LAYER_BODY
        return {"role": getattr(item, "role", ""), "name": item.name, "layer": layer, "depth": depth}

    def pen(self, item: Any, pen: Pen = INK) -> Pen:
        """Return the pen for an item: another one if it is marked."""
        return MARKED if self.is_marked(item.path) else pen

    def is_marked(self, path: Path) -> bool:
        """Return whether a path, or what it is part of, is marked."""
        return any(path[: len(each)] == each for each in self.marked)

    @cached_property
    def ground(self) -> frozenset[int]:
        """The numbers of ground: that of the world, and of a ground that moves."""
        return frozenset({-1, *(k for k, name in enumerate(self.scene.bodies) if name == "ground")})

    @cached_property
    def settled(self) -> Settled:
        """How far things without a size are displaced on the page."""
        seen = self.projection
        return settle(self.scene, self.home, np.array(seen.right), np.array(seen.up), seen.scale)

    def moved(self, placed: Placed) -> Sheet:
        """Return the sheet of another instant, on which things without a size are displaced as on this one."""
        found = replace(self, placed=placed)
        found.__dict__["settled"] = self.settled  # as the cached property would have it
        return found

    @cached_property
    def span(self) -> Floats:
        """The lowest and highest places on the page of all that has ends (2, 2), now, at the start and on the way."""
        places = self.placed, self.home, *self.others
        points = [self.projection.page(points_drawn(self.scene, each)) for each in places]
        every = np.vstack(points)
        return np.array([every.min(axis=0), every.max(axis=0)])

    @cached_property
    def down(self) -> Floats:
        """The direction of gravity on the page (2), down where there is none in it."""
        found = self.projection.page(np.asarray(self.scene.gravity, dtype=float))
        size = float(np.linalg.norm(found))
        return np.array([0.0, -1.0]) if size == 0.0 else found / size

    @cached_property
    def touched(self) -> Mapping[int, list[Item]]:
        found: dict[int, list[Item]] = {}
        for item in self.scene.items:
            found.setdefault(item.body, []).append(item)
        return found


def points_drawn(scene: Scene, placed: Placed) -> Floats:
    """Return the points (n, 3) in the world between which a scene is drawn: all that has an end."""
    points = [np.zeros((0, 3))]
    for item in scene.items:
        if item.form.endless or isinstance(item.form, Axes):
            continue
        if item.symbol is not None and item.symbol.kind in UNSEEN:
            continue
        points.append(placed.world(item.body, item.form.bounds))
    for strand in placed.strands:
        points.append(strand.pieces.reshape(-1, 3))
    every = np.vstack(points)
    every = every[np.all(np.isfinite(every), axis=1)]
    if not len(every):
        every = np.vstack([placed.poses[:-1, :, 3], np.zeros((1, 3))])
    return every


def unit2(way: Values, otherwise: Values = (1.0, 0.0)) -> Floats:
    """Return a direction on the page (2) of length 1."""
    found = np.asarray(way, dtype=float)
    size = float(np.linalg.norm(found))
    return found / size if size > 1e-12 else np.asarray(otherwise, dtype=float)


def left(way: Values) -> Floats:
    """Return a direction (2) turned by a quarter to the left."""
    return np.array([-way[1], way[0]], dtype=float)

