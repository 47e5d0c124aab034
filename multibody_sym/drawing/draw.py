"""From a scene and the places of its bodies to a picture: view, scale, marks, places for letters, title."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.drawing.described import description
from multibody_sym.drawing.layout import laid_out
from multibody_sym.drawing.look.scene_marks import scene_marks
from multibody_sym.drawing.notes import in_legend, notes
from multibody_sym.drawing.picture import Mark, Picture
from multibody_sym.drawing.projection import Projection, view_of
from multibody_sym.drawing.shown import Shown
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Face, Symbol
from multibody_sym.scene.items import Placed
from multibody_sym.scene.scene import Scene

WIDEST: Final = 425.0
"""A page (pt) is at most 150 mm wide and high, as far as letters allow that."""
_UNSEEN: Final = frozenset(("couple", "drag"))
"""Arrows that a figure does not show: a drag acts against what moves, and `--forces` tells it."""
MOST_NAMED: Final = 40
"""Of more bodies no page has room for all names: the figure shows none, its description tells them."""
_TRIES: Final = 3
_USUAL, _LARGEST = 16.0, 1.5
"""So many letters a figure of the usual size has room for; one of more is larger, up to so many times."""
_STAGE: Final = 44.0
"""How high (pt) a body is drawn on whose face masses stand that have no size."""
_SPRING: Final = 120.0
"""How long (pt) a spring without a length is drawn where nothing else has a size."""


def draw(
    scene: Scene, placed: Placed, *, view: str | Sequence[float] | None = None, shown: Shown | None = None
) -> Picture:
    """Return the picture of a scene whose bodies are `placed`; the same picture every time.

    `view` is a name (front, back, top, right, left, iso), or azimuth and elevation in degrees; the scene's own
    otherwise. Raises InputError for another one.
    """
    wanted = shown or Shown()
    scene, placed = _with_arrows(scene, placed, wanted)
    projection = _projection(scene, view)
    projection = projection.scaled(extent(scene, placed), _room(scene, wanted), _highest(scene, projection))
    title, told = scene.name, description(scene, placed, wanted)
    picture = laid_out(_marks(scene, placed, projection, wanted), title, told)
    for _ in range(_TRIES):
        room = min(WIDEST / picture.width, WIDEST / picture.height)
        if room >= 1.0:
            break
        projection = replace(projection, scale=projection.scale * max(0.4, 0.97 * room))
        picture = laid_out(_marks(scene, placed, projection, wanted), title, told)
    return picture


def _with_arrows(scene: Scene, placed: Placed, shown: Shown) -> tuple[Scene, Placed]:
    """Return the scene with those arrows that are to be seen: gravity, declared loads and given motions always.

    The speeds of the start are seen there alone.
    """
    kept = [k for k, arrow in enumerate(scene.arrows) if shown.forces or arrow.role not in _UNSEEN]
    kept = [k for k in kept if scene.arrows[k].role != "velocity" or placed.time == 0.0]
    arrows = (*(scene.arrows[k] for k in kept), *shown.reactions)
    vectors = np.vstack([placed.vectors[kept].reshape(-1, 3), *(arrow.vector for arrow in shown.reactions)])
    return replace(scene, arrows=arrows), replace(placed, vectors=vectors)


def _marks(scene: Scene, placed: Placed, projection: Projection, shown: Shown) -> list[Mark]:
    named = shown.names and len(scene.bodies) <= MOST_NAMED
    scene, told = in_legend(scene) if named else (scene, [])
    return [*scene_marks(scene, placed, projection, names=named, marked=shown.marked), *told, *notes(shown)]


def _projection(scene: Scene, view: str | Sequence[float] | None) -> Projection:
    usual = Projection(scene.view.right, scene.view.up, 1.0, scene.plane)
    normal = scene.view.towards if scene.plane else None
    upward = list(scene.view.up) if scene.plane else _upward(scene)
    return view_of(view, usual, upward, normal)


def _room(scene: Scene, shown: Shown) -> float:
    """Return how many times as large as usual a figure may be, since it has so many letters."""
    items = {item.name for item in scene.items if item.role in ("body", "joint", "pulley")}
    count = len(items) + len(scene.strands) + len(scene.dimensions) + len(scene.angles)
    return float(np.clip(np.sqrt(count / _USUAL), 1.0, _LARGEST)) if shown.names else 1.0


def _highest(scene: Scene, projection: Projection) -> float:
    """Return the scale (pt/m) at which faces and springs are no larger than the masses without a size beside them."""
    heights = [0.0]
    for item in scene.items:
        masses = (i for i in scene.items if i.role == "contact" and item.body in i.bodies)
        if isinstance(item.form, Face) and item.form.ends is None and item.body >= 0 and any(masses):
            heights.append(abs(float(np.dot(item.form.through, item.form.normal))))
    if not _is_without_sizes(scene):
        return np.inf
    loose = [float(np.linalg.norm(np.ptp(strand.pieces, axis=(0, 1)))) for strand in scene.at().strands]
    return min([_STAGE / max(heights) if max(heights) > 0.0 else np.inf, *(_SPRING / each for each in loose if each)])


def _is_without_sizes(scene: Scene) -> bool:
    """Return whether no body has a size but those whose faces have no ends."""
    bodies = (item for item in scene.items if item.role == "body" and not isinstance(item.form, Face))
    return all(each.loose for each in scene.strands) and all(isinstance(item.form, Symbol) for item in bodies)


def _upward(scene: Scene) -> list[float]:
    """Return the direction against gravity of a scene in space, z where there is none or it is not along an axis."""
    up = np.asarray(scene.view.up)
    axis = int(np.argmax(np.abs(up)))
    return [float(x) for x in np.sign(up[axis]) * np.eye(3)[axis]]


def extent(scene: Scene, placed: Placed) -> Floats:
    """Return points (n, 3) in the world that bound what has a size: bodies, places of joints, strands."""
    found = [np.zeros((0, 3))]
    for item in scene.items:
        if isinstance(item.form, Face) and item.form.ends is None:
            continue
        found.append(placed.world(item.body, item.form.bounds))
    for strand in placed.strands:
        found.append(np.asarray(strand.pieces).reshape(-1, 3))
        found.extend(bow.points() for bow in strand.bows)
    points = np.vstack(found)
    kept: Floats = points[np.isfinite(points).all(1)]
    return kept
