"""`animate`: a run as a page of HTML, a GIF or an MP4."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any, Final

import numpy as np

from multibody_sym.documents.animation.frames import MOST, Frames, frames_of
from multibody_sym.documents.animation.page import packed_columns, plane_stage, short, space_stage, three
from multibody_sym.errors import ArgumentError, InputError, OutputError, Where
from multibody_sym.errors import short_repr as shown_value
from multibody_sym.model.argument_checks import door
from multibody_sym.motion.results.plot import plot_of
from multibody_sym.motion.results.samples import Samples
from multibody_sym.pictures.draw import item_marks
from multibody_sym.pictures.marks.forces import strand_marks
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.picture import Picture, Projection, Wanted, in_order, shifted_mark
from multibody_sym.pictures.page.raster import pixels
from multibody_sym.pictures.plots import COLOURS, Plot
from multibody_sym.program.target_layout import fill_template, template_text
from multibody_sym.records import dataclass
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.values import Units, chosen_units

FORMATS: Final = (".html", ".gif", ".mp4")
_DASHES: Final[tuple[list[int], ...]] = ([], [6, 3], [6, 2, 2, 2], [2, 2])
_SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, repr=False)
class Animation:
    """A motion that can be looked at: `html` is a page that needs nothing beside it; a notebook shows it."""

    frames: Frames
    html: str
    view: str | Sequence[float] | None = None

    def __repr__(self) -> str:
        return f"<Animation of {self.frames.scene.name}: {len(self.frames.times)} frames, {len(self.html) // 1000} kB>"

    def _repr_html_(self) -> str:
        page = escape(self.html, quote=True)
        return f'<iframe srcdoc="{page}" style="width:100%;height:640px;border:0" sandbox="allow-scripts"></iframe>'

    @door
    def write(self, path: str | os.PathLike[str]) -> None:
        """Write it as .html, .gif or .mp4, by the ending of `path`. Raises InputError for others, OutputError."""
        ending = animation_name(path)
        if ending == ".html":
            write_whole(path, self.html.encode("utf-8"))
            return
        # a GIF or an MP4, in real time
        projection = self.frames.projection(self.view)
        span = float(self.frames.times[-1] - self.frames.times[0])
        count = min(_MOST, max(2, round(span * _RATE)))
        even = np.linspace(self.frames.times[0], self.frames.times[-1], count)
        at = np.searchsorted(self.frames.times, even).clip(0, len(self.frames.times) - 1)
        images = [_image(self.frames, projection, int(k)) for k in at]
        rate = count / span if span else _RATE
        write_whole(path, _gif(images, span / count) if ending == ".gif" else _mp4(images, rate))


def animation_name(path: str | os.PathLike[str]) -> str:
    """Return the ending of an animation's name. Raises InputError for one that is none."""
    name = path_name(path)
    ending = os.path.splitext(name)[1].lower()
    if ending not in FORMATS:
        message = f"an animation is written to {', '.join(FORMATS)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name), number="U103")
    return ending


def animate(
    run: Samples,
    path: str | os.PathLike[str] | None = None,
    *,
    trace: str | Sequence[str] | None = None,
    view: str | Sequence[float] | None = None,
    show: str | Sequence[str] | None = None,
    units: str | Sequence[str] | Units | None = None,
    speed: float | str = 1.0,
) -> Animation:
    """Return the motion of a run as an animation, written to `path` (.html, .gif, .mp4) if one is given.

    `trace` names bodies and points, as `"bob,rod.tip"`, whose paths can be shown; `view` is that of `draw`; `show` and
    `units` say what the plots beside it show, as in `plot`; `speed` is how fast it plays at first.
    Raises InputError for unknown names and endings, OutputError where a library is missing or a file not written.
    """
    if not isinstance(run, Samples):
        raise ArgumentError(f"run: expected a Trajectory, got {shown_value(run)}")
    frames = frames_of(run)
    try:
        fast = 0.0 if isinstance(speed, bool) else float(speed)
    except (TypeError, ValueError, OverflowError):
        fast = 0.0
    if not 0.0 < fast < 1e6:
        raise ArgumentError(f"speed: expected a positive number, got {shown_value(speed)}")
    content = player(run, frames, trace, view, show, chosen_units(units), fast)
    found = Animation(frames, page(run.ready.mechanism.name, content), view)
    if path is not None:
        found.write(path)
    return found


def page(name: str, content: str) -> str:
    """Return the whole page of an animation around its player."""
    style, body = template_text("html/animation.css"), f"<main>{content}</main>"
    return fill_template("html/page.html.in", title=escape(name), style=style, body=body)


def player(
    run: Samples,
    frames: Frames,
    trace: str | Sequence[str] | None,
    view: str | Sequence[float] | None,
    show: str | Sequence[str] | None,
    units: Units,
    speed: float,
) -> str:
    """Return the player as a part of a page: stage, controls, plots, data and scripts."""
    projection = frames.projection(view)
    names = trace.split(",") if isinstance(trace, str) else trace
    if names is not None and not (isinstance(names, (list, tuple)) and all(isinstance(name, str) for name in names)):
        raise ArgumentError(f"trace: expected names such as 'bob,rod.tip', got {shown_value(trace)}")
    traces = frames.traced(None if names is None else [name.strip() for name in names])
    stage = plane_stage if projection.flat else space_stage
    drawn, motion = stage(frames, projection, traces)
    times = [short(float(t)) for t in frames.times]
    content = {"times": times, **motion, "plot": plot_data(plot_of({"": run}, units, show))}
    text = json.dumps(content, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    # a script of a page may hold no <, and no line end that a script knows
    data = text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    kind = "plane" if projection.flat else "space"
    parts = ["animation", "plots", *(["names"] if motion.get("names") else []), kind]
    scripts = "".join(template_text(f"html/{name}.js") for name in parts)
    library = "" if projection.flat else f"<script>{three()}</script>"
    speeds = sorted({*_SPEEDS, speed})
    options = "".join(f'<option value="{x:g}"{" selected" if x == speed else ""}>{x:g} x</option>' for x in speeds)
    return (
        f'<section class="animation"><h1>{escape(run.ready.mechanism.name)}</h1><div class="stage">{drawn}</div>'
        '<div class="controls"><button type="button">Play</button>'
        '<input type="range" min="0" max="1" step="any" value="0" aria-label="time"><output></output>'
        f'<label>speed <select>{options}</select></label><label><input type="checkbox"> paths</label></div>'
        '<div class="plots"></div></section>'
        f'<script type="application/json" class="animation-data">{data}</script>{library}<script>{scripts}'
        f'animate(document.querySelector(".animation"), document.querySelector(".animation-data"), {kind}Stage);'
        "</script>"
    )


def plot_data(plot: Plot) -> dict[str, Any] | None:
    """Return the panels of a plot as plots.js reads them; None where there is nothing to plot."""
    panels = [panel for panel in plot.panels if panel.curves]
    if not panels:
        return None
    x = panels[0].curves[0].x
    kept = sorted({*range(0, len(x), -(-len(x) // MOST)), len(x) - 1})
    return {
        "x": [short(float(value)) for value in x[kept]],
        "across": plot.across,
        "clock": plot.over_time,
        "marks": [short(mark.x) for mark in plot.marks],
        "panels": [
            {
                "label": panel.label,
                "range": [short(end) for end in panel.shown],
                "packed": packed_columns(np.column_stack([curve.y[kept] for curve in panel.curves])),
                "curves": [
                    {"name": curve.name, **_line_style(k, len(panel.curves))} for k, curve in enumerate(panel.curves)
                ],
            }
            for panel in panels
        ],
    }


def _line_style(k: int, count: int) -> dict[str, Any]:
    if count <= len(COLOURS) * len(_DASHES):
        return {"colour": COLOURS[k % len(COLOURS)], "dash": _DASHES[k // len(COLOURS)]}
    return {"colour": f"hsl({240 - 240 * k // (count - 1)} 75% 42%)", "dash": []}


# ----------------------------------------------------------------------------------------------------------------------
# A motion as a GIF or an MP4: its figure, frame by frame, without labels.


_RATE: Final = 25
"""Frames a second."""
_MOST: Final = 750
_MARGIN: Final = 30.0
_DOTS: Final = 110


def _image(frames: Frames, projection: Projection, k: int) -> Any:
    """Return one frame as an array of pixels; all have one size."""
    corners = projection.page(frames.extent)
    shift = _MARGIN - corners.min(axis=0)
    width, height = corners.max(axis=0) + shift + _MARGIN
    placed = frames.placed[k]
    sheet = Sheet(frames.scene, placed, frames.placed[0], projection, others=frames.looked_at)
    marks = [mark for item in frames.scene.items if item.role != "frame" for mark in item_marks(sheet, item)]
    marks += [mark for strand in placed.strands for mark in strand_marks(sheet, strand)]
    drawn = in_order([shifted_mark(mark, shift) for mark in marks if not isinstance(mark, Wanted)])  # type: ignore[arg-type]
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
