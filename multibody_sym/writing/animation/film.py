"""A motion as a GIF or an MP4: its figure, frame by frame, without labels."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.look.scene_marks import item_marks
from multibody_sym.drawing.look.sheet import Sheet
from multibody_sym.drawing.look.strands import strand_marks
from multibody_sym.drawing.picture import Picture, Wanted, in_order, moved
from multibody_sym.drawing.projection import Projection
from multibody_sym.drawing.raster import pixels
from multibody_sym.errors import OutputError
from multibody_sym.writing.animation.frames import Frames

_RATE: Final = 25
"""Frames a second."""
_MOST: Final = 750
_MARGIN: Final = 30.0
_DOTS: Final = 110


def film(frames: Frames, ending: str, projection: Projection) -> bytes:
    """Return a GIF or an MP4 of a motion in real time. Raises OutputError where a library or ffmpeg is missing."""
    span = float(frames.times[-1] - frames.times[0])
    count = min(_MOST, max(2, round(span * _RATE)))
    even = np.linspace(frames.times[0], frames.times[-1], count)
    at = np.searchsorted(frames.times, even).clip(0, len(frames.times) - 1)
    images = [_image(frames, projection, int(k)) for k in at]
    return _gif(images, span / count) if ending == ".gif" else _mp4(images, count / span if span else _RATE)


def _image(frames: Frames, projection: Projection, k: int) -> Any:
    """Return one frame as an array of pixels; all have one size."""
    corners = projection.page(frames.extent)
    shift = _MARGIN - corners.min(axis=0)
    width, height = corners.max(axis=0) + shift + _MARGIN
    placed = frames.placed[k]
    sheet = Sheet(frames.scene, placed, frames.placed[0], projection, others=frames.looked_at)
    marks = [mark for item in frames.scene.items if item.role != "frame" for mark in item_marks(sheet, item)]
    marks += [mark for strand in placed.strands for mark in strand_marks(sheet, strand)]
    drawn = in_order([moved(mark, shift) for mark in marks if not isinstance(mark, Wanted)])  # type: ignore[arg-type]
    return pixels(Picture(float(width), float(height), drawn, frames.scene.name), _DOTS)


def _gif(images: list[Any], seconds: float) -> bytes:
    import io

    try:
        from PIL import Image
    except ImportError:
        raise OutputError("a GIF needs Pillow: pip install 'multibody_sym[plot]'", number="O104") from None
    content = io.BytesIO()
    first, *others = [Image.fromarray(image).quantize(64) for image in images]
    hundredths = max(2, round(100 * seconds))
    first.save(content, "GIF", save_all=True, append_images=others, duration=10 * hundredths, loop=0, optimize=False)
    return content.getvalue()


def _mp4(images: list[Any], rate: float) -> bytes:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise OutputError("an MP4 needs imageio-ffmpeg: pip install 'multibody_sym[animate]'", number="O104") from None
    height, width = images[0].shape[:2]
    folder = tempfile.mkdtemp()
    file = Path(folder) / "film.mp4"
    try:
        writer = imageio_ffmpeg.write_frames(str(file), (width, height), fps=rate, macro_block_size=2)
        writer.send(None)
        for image in images:
            writer.send(np.ascontiguousarray(image))
        writer.close()
        return file.read_bytes()
    finally:
        file.unlink(missing_ok=True)
        os.rmdir(folder)
