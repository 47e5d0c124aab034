"""A motion as a GIF or an MP4: its figure, frame by frame, without labels."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np

from multibody_sym.documents.animation.frames import Frames, ViewWindow
from multibody_sym.errors import OutputError
from multibody_sym.pictures.draw import item_marks
from multibody_sym.pictures.marks.forces import strand_marks
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.picture import (
    LAYER_GROUND,
    Hatch,
    Pen,
    Picture,
    Placed,
    Stroke,
    Wanted,
    in_order,
    shifted_mark,
)
from multibody_sym.pictures.page.raster import pixels
from multibody_sym.pictures.scene.items import Anchor
from multibody_sym.scalars.arrays import Floats

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
            yield _image(frames, window, moved[k], [_path(way[: k + 1], colour) for way, colour in paths], int(k))

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


def _path(points: Floats, colour: str) -> Stroke:
    """Return the path of a point as a line below all that moves."""
    return Stroke(points, Pen(_PATH, colour), role="", name="", layer=LAYER_GROUND, depth=-np.inf)


def _squared_paper(size: tuple[float, float], shift: Floats) -> Iterator[Stroke]:
    """Yield the lines of squared paper in a window, at places that stay as the window moves."""
    for axis in (0, 1):
        for way in np.arange(shift[axis] % SQUARE, size[axis], SQUARE):
            ends = np.array([[way, 0.0], [way, size[1]]]) if axis == 0 else np.array([[0.0, way], [size[0], way]])
            yield Stroke(ends, Pen(0.6, PAPER), role="", name="", layer=LAYER_GROUND, depth=0.0)


def _cut(mark: Placed, size: tuple[float, float]) -> Placed:
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
