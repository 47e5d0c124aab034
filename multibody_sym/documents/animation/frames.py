"""A run as frames: its scene, placed at samples, the projection into which all of them fit, and films of them."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from multibody_sym.errors import InputError, OutputError
from multibody_sym.motion.results.samples import Samples
from multibody_sym.pictures.draw import item_marks
from multibody_sym.pictures.marks.forces import strand_marks
from multibody_sym.pictures.marks.sheet import Sheet, points_drawn
from multibody_sym.pictures.page.files import pixels
from multibody_sym.pictures.page.picture import (
    LAYER_GROUND,
    Hatch,
    Pen,
    Picture,
    Projection,
    Stroke,
    Wanted,
    in_order,
    shifted_mark,
    view_of,
)
from multibody_sym.pictures.page.picture import Placed as PlacedMark
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
        return [face for item in self.scene.items if item.body < 0 and (face := item.form.face) is not None]

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
        bodies = (body for body in self.scene.mechanism.bodies if not (body.is_double or body.is_foot))
        return {name: known[name] for name in ([body.name for body in bodies][-3:] if names is None else names)}

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


# ----------------------------------------------------------------------------------------------------------------------
# A motion as a GIF or an MP4: its figure, frame by frame, without labels.


SQUARE: Final = 55
"""The size of squared paper (pt), and the colour of its lines."""
PAPER: Final = "#d5dae0"
_RATE: Final = 25
"""Frames a second."""
_MOST: Final = 750
_MARGIN: Final = 30.0
_DOTS: Final = 110
_PATH: Final = 1.2
"""The width of a path (pt)."""


def film(
    frames: Frames, window: ViewWindow, traced: Iterable[tuple[Anchor, str]], ending: str, show: Callable[[float], None]
) -> bytes:
    """Return a film in real time, `.gif` or `.mp4`, with the paths of points (`traced`), each in its colour.

    `show` is called with the part that is drawn. Raises OutputError where a library is missing.
    """
    span = float(frames.times[-1] - frames.times[0])
    count = min(_MOST, max(2, round(span * _RATE)))
    even = np.linspace(frames.times[0], frames.times[-1], count)
    at = np.searchsorted(frames.times, even).clip(0, len(frames.times) - 1)

    home = Sheet(frames.scene, frames.placed[0], frames.placed[0], window.projection, others=frames.looked_at)
    moved = [home.moved(placed) for placed in frames.placed]
    paths = [(np.array([sheet.at(each.body, each.point) for sheet in moved]), colour) for each, colour in traced]

    def images() -> Iterator[Any]:
        for done, k in enumerate(at):
            show(done / count)
            below: dict[str, Any] = {"role": "", "name": "", "layer": LAYER_GROUND, "depth": -np.inf}
            ways = [Stroke(way[: k + 1], Pen(_PATH, colour), **below) for way, colour in paths]
            yield _image(frames, window, moved[k], ways, int(k))

    return _gif(images(), span / count) if ending == ".gif" else _mp4(images(), count / span if span else _RATE)


def _image(frames: Frames, window: ViewWindow, sheet: Sheet, paths: Iterable[Stroke], k: int) -> Any:
    """Return one frame as an array of pixels; all have one size."""
    corners = window.projection.page(frames.extent)
    if window.size is None or window.middles is None:
        shift = _MARGIN - corners.min(axis=0)
        width, height = corners.max(axis=0) + shift + _MARGIN
    else:
        (width, height), shift = window.size, np.array(window.size) / 2 - window.middles[k]
    marks = [mark for item in frames.scene.items if item.role != "frame" for mark in item_marks(sheet, item)]
    marks += [mark for strand in sheet.placed.strands for mark in strand_marks(sheet, strand)]
    drawn = in_order([shifted_mark(mark, shift) for mark in (*paths, *marks) if not isinstance(mark, Wanted)])  # type: ignore[arg-type]
    if window.size is not None:
        paper = [] if frames.stays_near_a_face else list(_squared_paper(window.size, shift))
        drawn = [*paper, *(_cut(mark, window.size) for mark in drawn)]
    return pixels(Picture(float(width), float(height), drawn, frames.scene.name), _DOTS)


def _squared_paper(size: tuple[float, float], shift: Floats) -> Iterator[Stroke]:
    """Yield the lines of squared paper in a window, at places that stay as the window moves."""
    for axis in (0, 1):
        for way in np.arange(shift[axis] % SQUARE, size[axis], SQUARE):
            ends = np.array([[way, 0.0], [way, size[1]]]) if axis == 0 else np.array([[0.0, way], [size[0], way]])
            yield Stroke(ends, Pen(0.6, PAPER), role="", name="", layer=LAYER_GROUND, depth=0.0)


def _cut(mark: PlacedMark, size: tuple[float, float]) -> PlacedMark:
    """Return a mark without the hatching outside a window, whose ticks stay where they are."""
    if not (isinstance(mark, Hatch) and len(mark.points) == 2):
        return mark
    start, end = np.asarray(mark.points, dtype=float)
    length = float(np.hypot(*(end - start)))
    if length == 0.0:
        return mark
    along, reach = (end - start) / length, float(np.hypot(*size)) / 2 + mark.tick
    middle = float((np.array(size) / 2 - start) @ along)
    first = max(0.0, mark.gap * np.floor((middle - reach) / mark.gap))
    last = max(first, min(length, middle + reach))
    return replace(mark, points=np.array([start + first * along, start + last * along]))


def _gif(images: Iterator[Any], seconds: float) -> bytes:
    try:
        from PIL import Image
    except ImportError:
        raise OutputError("a GIF needs Pillow: pip install 'multibody_sym[plot]'", number="O104") from None
    content = io.BytesIO()
    pictures = (Image.fromarray(image).quantize(64) for image in images)
    hundredths = max(2, round(100 * seconds))
    following = {"save_all": True, "append_images": pictures, "duration": 10 * hundredths, "loop": 0}
    next(pictures).save(content, "GIF", optimize=False, **following)
    return content.getvalue()


def _mp4(images: Iterator[Any], rate: float) -> bytes:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise OutputError("an MP4 needs imageio-ffmpeg: pip install 'multibody_sym[animate]'", number="O104") from None
    first = next(images)
    height, width = first.shape[:2]
    folder = tempfile.mkdtemp()
    file = Path(folder) / "film.mp4"
    try:
        writer = imageio_ffmpeg.write_frames(str(file), (width, height), fps=rate, macro_block_size=2)
        writer.send(None)
        for image in chain([first], images):
            writer.send(np.ascontiguousarray(image))
        writer.close()
        return file.read_bytes()
    finally:
        file.unlink(missing_ok=True)
        os.rmdir(folder)
