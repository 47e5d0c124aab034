"""A run as frames: its scene, placed at samples, and the projection into which all of them fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.errors import InputError
from multibody_sym.motion.results.samples import Samples
from multibody_sym.pictures.marks.sheet import points_drawn
from multibody_sym.pictures.page.picture import Projection, view_of
from multibody_sym.pictures.scene.items import ZERO, Anchor, Axes, Face, Placed, PlacedStrand, vector
from multibody_sym.pictures.scene.scene import Scene, scene_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

MOST: Final = 1000
"""So many samples are placed at most; a page goes smoothly from one to the next."""
_LEFT_BEHIND: Final = ("joint", "guide", "surface", "pulley", "ground")
"""Roles of what stands on ground."""
_LOOKED_AT: Final = 60
"""So many frames say how much room all of them need."""
WINDOW: Final = (420.0, 240.0)
"""Width and height (pt) of a window that follows what moves."""
_NEAR: Final = 110.0
"""How large (pt) what moves is in such a window."""
_LONGEST: Final = 20_000.0
"""How long a way (pt) is drawn at most."""
_FAR: Final = 3.0
"""So many times as large as all of the way in view something must be seen to be followed."""
ARC: Final = 9
"""Points of a rope's arc on a wheel."""


@dataclass(frozen=True, eq=False)
class ViewWindow:
    """How a motion is seen: all of it at the scale of `projection`, or through a window of a `size` (pt) that follows.

    `middles` (m, 2) are the places on the page in the middle of such a window at each frame (pt).
    """

    projection: Projection
    size: tuple[float, float] | None = None
    middles: Floats | None = None


@dataclass(frozen=True, eq=False)
class Frames:
    """A `scene` and where it is (`placed`) at `times` (m,)."""

    scene: Scene
    times: Floats
    placed: tuple[Placed, ...]

    @cached_property
    def looked_at(self) -> tuple[Placed, ...]:
        """Some frames, which say how far the motion goes."""
        step = max(1, len(self.placed) // _LOOKED_AT)
        return self.placed[::step]

    def projection(self, view: str | Sequence[float] | None = None) -> Projection:
        """Return the view that is natural, or asked for, at the scale into which the whole motion fits."""
        usual = Projection(self.scene.view.right, self.scene.view.up, 1.0, self.scene.plane)
        normal = self.scene.view.towards if self.scene.plane else None
        return view_of(view, usual, self.scene.up, normal).scaled(self.extent)

    def window(self, projection: Projection) -> ViewWindow:
        """Return the window of a view: all of the motion, or the part around what moves where that would be a dot.

        So the view stops growing where a motion outgrows the mechanism, and follows: on squared paper where no ground
        is in the window.
        """
        reach = float(np.linalg.norm(np.ptp(projection.page(self.extent), axis=0)))
        if self.near > 0.0 and reach > 0.0 and self.leaves_nothing:
            scale = min(_NEAR / self.near, projection.scale * _LONGEST / reach)
            if scale > _FAR * projection.scale:
                near = replace(projection, scale=scale)
                middles = [near.page(placed.poses[:-1, :, 3].mean(axis=0)) for placed in self.placed]
                return ViewWindow(near, WINDOW, np.array(middles))
        return ViewWindow(projection)

    @cached_property
    def extent(self) -> Floats:
        """Points (n, 3) that bound the motion."""
        return np.vstack([points_drawn(self.scene, placed) for placed in self.looked_at])

    @cached_property
    def near(self) -> float:
        """How far apart all that moves is at most at one instant (m)."""
        items = (item for item in self.scene.items if item.body >= 0 and not item.form.guides)
        moving = [item for item in items if not isinstance(item.form, Axes)]
        found = [0.0]
        for placed in self.looked_at if moving else ():
            points = np.vstack([placed.world(item.body, item.form.bounds) for item in moving])
            found.append(float(np.linalg.norm(np.ptp(points[np.isfinite(points).all(axis=1)], axis=0))))
        return max(found)

    @property
    def faces(self) -> list[Face]:
        return [item.form for item in self.scene.items if item.body < 0 and isinstance(item.form, Face)]

    @property
    def leaves_nothing(self) -> bool:
        """Whether nothing on ground is left behind by what moves, but endless faces."""
        held = [item for item in self.scene.items if item.body < 0 and item.role in _LEFT_BEHIND]
        return all(item.form.endless or isinstance(item.form, Axes) for item in held)

    @property
    def stays_near_a_face(self) -> bool:
        """Whether a face of ground is near all the time."""
        if not self.faces:
            return False
        middles = np.array([placed.poses[:-1, :, 3].mean(axis=0) for placed in self.looked_at])
        away = [np.abs((middles - np.array(face.through)) @ np.array(face.normal)) for face in self.faces]
        return float(np.min(away, axis=0).max()) <= self.near

    def traced(self, names: Sequence[str] | None) -> dict[str, Anchor]:
        """Return the points to be traced: bodies by name (their centres) and `body.point`. Raises InputError.

        Without names they are the centres of the last three bodies at most.
        """
        known = self._points
        for name in names or ():
            if name not in known:
                raise InputError(f"there is no point {name!r} to trace", word=name, known=known)
        return {name: known[name] for name in (self._last if names is None else names)}

    @property
    def _last(self) -> list[str]:
        return [body.name for body in self.scene.mechanism.bodies if not (body.is_double or body.is_foot)][-3:]

    @cached_property
    def _points(self) -> dict[str, Anchor]:
        """The points that can be traced: origins of bodies, in their place what is drawn there, and points."""
        found = {name: Anchor(k, ZERO) for k, name in enumerate(self.scene.bodies)}
        for role in ("body", "mass centre", "point"):
            items = (item for item in self.scene.items if item.role == role and item.symbol is not None)
            found.update((item.name, Anchor(item.body, vector(item.form.bounds[0]))) for item in items)
        return found


def frames_of(run: Samples) -> Frames:
    """Return the frames of a run. Raises InputError for a run without samples."""
    if not len(run):
        raise InputError("the run has no samples: there is nothing to show")
    scene = scene_of(run.ready.system)
    step = -(-len(run) // MOST)
    chosen = sorted({*range(0, len(run), step), len(run) - 1})
    finite = [k for k in chosen if np.isfinite(run.q[k]).all()]
    placed = tuple(scene.at(run.q[k], run.u[k], run.t[k], run.parameters) for k in finite)
    return Frames(scene, run.t[finite], placed)


def strand_points(along: Sequence[PlacedStrand]) -> Floats:
    """Return points along a strand at each instant (m, n, 3), arcs on wheels as short lines."""
    each = []
    for placed in along:
        parts = []
        for k, piece in enumerate(placed.pieces):
            parts.append(piece)
            if k < len(placed.bows):
                parts.append(placed.bows[k].at(np.linspace(0.0, placed.bows[k].angle, ARC)))
        each.append(np.vstack(parts))
    return alike(each)


def alike(each: Sequence[Floats]) -> Floats:
    """Return lines (n, dimensions) with the same number of points, as many as the longest list has."""
    most = max(len(points) for points in each)
    lines = []
    for points in each:
        if len(points) != most:
            way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
            at = np.linspace(0.0, way[-1], most)
            points = np.column_stack([np.interp(at, way, column) for column in points.T])
        lines.append(points)
    return np.array(lines)


def side_by_side(each: Sequence[Floats], rows: int) -> Floats:
    """Return arrays (rows, ..) as columns beside each other (rows, n)."""
    return np.concatenate([part.reshape(rows, -1) for part in each], axis=1) if each else np.zeros((rows, 0))
