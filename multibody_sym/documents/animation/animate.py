"""`animate`: a run as a page of HTML, a GIF or an MP4."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict
from html import escape
from itertools import cycle, groupby
from pathlib import Path
from typing import Any, Final

import numpy as np

from multibody_sym.documents.animation.frames import (
    MOST,
    PAPER,
    SQUARE,
    WINDOW,
    Frames,
    alike,
    film,
    frames_of,
    side_by_side,
    strand_points,
)
from multibody_sym.errors import ArgumentError, InputError, OutputError, Where
from multibody_sym.errors import short_repr as shown_value
from multibody_sym.model.argument_checks import callback, door
from multibody_sym.motion.results.plot import outputs_and_places, plot_of
from multibody_sym.motion.results.samples import Samples
from multibody_sym.pictures.draw import MOST_NAMED, FigureContent, description, item_marks
from multibody_sym.pictures.marks.forces import strand_marks
from multibody_sym.pictures.marks.labels import label_marks, name_runs
from multibody_sym.pictures.marks.ropes import drawn_pieces
from multibody_sym.pictures.marks.sheet import Sheet, points_drawn
from multibody_sym.pictures.page.files import escaped_xml, number, svg_elements
from multibody_sym.pictures.page.layout import ANGLES, FOREIGN, FURTHER, LEADER, STEPS
from multibody_sym.pictures.page.picture import (
    ROD,
    ROPE,
    Arc,
    Hatch,
    Mark,
    Pen,
    Placed,
    Projection,
    Simple,
    Stroke,
    Wanted,
    Wish,
    box_of,
    fields_of,
    letters,
    simple,
    typeset_unit,
)
from multibody_sym.pictures.plots import COLOURS, Plot
from multibody_sym.pictures.scene.items import (
    Anchor,
    Axes,
    Item,
    PlacedStrand,
    TurnStop,
    across,
    unit,
)
from multibody_sym.pictures.scene.scene import Scene
from multibody_sym.program.target_layout import fill_template, template_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.values import Units, chosen_units

FORMATS: Final = (".html", ".gif", ".mp4")
_DASHES: Final[tuple[list[int], ...]] = ([], [6, 3], [6, 2, 2, 2], [2, 2])
_CURVES: Final = tuple("currentColor" if colour == "#000000" else colour for colour in COLOURS)
"""Black is the colour of the letters around it, which are white on a dark page."""
PATHS: Final = tuple(colour for colour in COLOURS if colour != "#000000")
_SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, repr=False)
class Animation:
    """A motion that can be looked at: `html` is a page that needs nothing beside it; a notebook shows it.

    `paths` are the points whose paths are shown at once, in films too.
    """

    frames: Frames
    html: str
    view: str | Sequence[float] | None = None
    paths: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Animation of {self.frames.scene.name}: {len(self.frames.times)} frames, {len(self.html) // 1000} kB>"

    def _repr_html_(self) -> str:
        return framed(self.html)

    @door
    def write(self, path: str | os.PathLike[str], on_progress: Callable[[float], None] | None = None) -> None:
        """Write it as .html, .gif or .mp4, by the ending of `path`; films are in real time.

        `on_progress` is called with the part of the frames that are drawn, from 0 to 1.
        Raises InputError for other endings, OutputError where a library is missing or the file not written.
        """
        ending, show = animation_name(path), callback("on_progress", on_progress)
        if ending == ".html":
            write_whole(path, self.html.encode("utf-8"))
            return
        traced = zip(self.frames.traced(self.paths).values(), cycle(PATHS), strict=False)
        window = self.frames.window(self.frames.projection(self.view))
        write_whole(path, film(self.frames, window, traced, ending, show or (lambda _part: None)))


def framed(html: str) -> str:
    """Return a page within another one, such as a notebook, whose data it cannot read."""
    shown = 'style="width:100%;height:640px;border:0" sandbox="allow-scripts allow-downloads"'
    return f'<iframe srcdoc="{escape(html, quote=True)}" {shown}></iframe>'


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
    on_progress: Callable[[float], None] | None = None,
) -> Animation:
    """Return the motion of a run as an animation, written to `path` (.html, .gif, .mp4) if one is given.

    `trace` names bodies and points whose paths are shown, as `"bob,rod.tip"`; else of the last bodies, at a click.
    `view` is that of `draw`. `show` and `units` say what the plots below show, as in `plot`; without `show` outputs and
    coordinates but quaternions. `speed` is how fast it plays at first. `on_progress` is that of `Animation.write`.
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
    names = _names(trace)
    content = player(run, frames, names, view, show, chosen_units(units), fast)
    whole = page(run.ready.mechanism.name, run.ready.system.description, content)
    found = Animation(frames, whole, view, tuple(names or ()))
    if path is not None:
        found.write(path, on_progress)
    return found


def _names(trace: str | Sequence[str] | None) -> list[str] | None:
    names = trace.split(",") if isinstance(trace, str) else trace
    if names is None:
        return None
    if not (isinstance(names, (list, tuple)) and all(isinstance(name, str) for name in names)):
        raise ArgumentError(f"trace: expected names such as 'bob,rod.tip', got {shown_value(trace)}")
    return [name.strip() for name in names]


def page(name: str, statement: str | None, content: str, *styles: str) -> str:
    """Return a whole page around its player: the name of a model, what it says of itself, the player."""
    title, said = escape(name), f"<p>{escape(statement)}</p>" if statement else ""
    style = "".join(template_text(f"html/{name}.css") for name in ("animation", "alone", *styles))
    body = f'<main class="alone"><h1>{title}</h1>{said}{content}</main>'
    return fill_template("html/page.html.in", title=title, style=style, body=body)


def player(
    run: Samples,
    frames: Frames,
    trace: Sequence[str] | None,
    view: str | Sequence[float] | None,
    show: str | Sequence[str] | None,
    units: Units,
    speed: float,
) -> str:
    """Return the player as a part of a page: stage, controls, plots, data and scripts."""
    projection = frames.projection(view)
    drawn, motion = drawn_stage(frames, projection, trace)
    times = [short(float(t)) for t in frames.times]
    curves = plot_data(plot_of({"": run}, units, outputs_and_places(run) if show is None else show), units)
    data = json_in_page({"times": times, **motion, "plot": curves})
    kind = "plane" if projection.flat else "space"
    parts = ["animation", "plots", *(["names"] if motion.get("names") else []), kind]
    speeds = sorted({*_SPEEDS, speed})
    return fill_template(
        "html/player.html.in",
        kind=kind,
        title=escape(run.ready.mechanism.name),
        drawn=drawn,
        speeds=speed_options(speeds, speed),
        whole=" selected" if trace else "",
        follow="true" if motion.get("follow") else "false",
        data=data,
        library="" if projection.flat else f"<script>{three()}</script>",
        scripts="".join(template_text(f"html/{name}.js") for name in parts),
    )


def drawn_stage(
    frames: Frames, projection: Projection, trace: Sequence[str] | None
) -> tuple[str, dict[str, Any]]:
    """Return a stage and its data; traced points have the colours of their paths."""
    traces = frames.traced(trace)
    stage = plane_stage if projection.flat else space_stage
    drawn, data = stage(frames, projection, list(traces.values()))
    for k, (name, point) in enumerate(zip(traces, data["traces"], strict=True)):
        point |= {"runs": letters(name), "colour": PATHS[k % len(PATHS)]}
    return drawn, data


def speed_options(speeds: Iterable[float], chosen: float) -> str:
    """Return the options of a choice of speeds."""
    return "".join(f'<option value="{x:g}"{" selected" if x == chosen else ""}>{x:g} x</option>' for x in speeds)


def json_in_page(data: Any) -> str:
    """Return data as JSON for a script of a page, which may hold no <, and no line end that a script knows."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _alt_text(frames: Frames) -> str:
    """Return the words in place of a stage: those of its figure, and how long it moves."""
    said = description(frames.scene, frames.placed[0], FigureContent())
    return escaped_xml(f"{said} It moves until t = {frames.times[-1]:g} s.")


def plot_data(plot: Plot, units: Units) -> dict[str, Any] | None:
    """Return the panels of a plot as plots.js reads them, constants last; None where there is nothing to plot."""
    panels = sorted((panel for panel in plot.panels if panel.curves), key=lambda panel: panel.is_constant)
    if not panels:
        return None
    x = panels[0].curves[0].x
    kept = sorted({*range(0, len(x), -(-len(x) // MOST)), len(x) - 1})
    return {
        "x": [short(float(value)) for value in x[kept]],
        "across": plot.across,
        "second": short(1.0 / units.size("s")),
        "marks": [short(mark.x) for mark in plot.marks],
        "panels": [
            {
                "label": panel.label,
                "unit": typeset_unit(panel.unit),
                "range": [short(end) for end in panel.shown],
                "packed": packed_columns(np.column_stack([curve.y[kept] for curve in panel.curves])),
                "curves": [
                    {"runs": letters(curve.name), **_line_style(k, len(panel.curves))}
                    for k, curve in enumerate(panel.curves)
                ],
            }
            for panel in panels
        ],
    }


def _line_style(k: int, count: int) -> dict[str, Any]:
    if count <= len(_CURVES) * len(_DASHES):
        return {"colour": _CURVES[k % len(_CURVES)], "dash": _DASHES[k // len(_CURVES)]}
    return {"colour": f"hsl({240 - 240 * k // (count - 1)} 75% 42%)", "dash": []}


# ----------------------------------------------------------------------------------------------------------------------
# Numbers for a page: columns as int16 between their ends, in base64; names and numbers as JSON that ends no script.


_LARGEST: Final = 32767
_NO_NUMBER: Final = -32768


def packed_columns(rows: Floats) -> dict[str, Any]:
    """Return numbers (m, n) as what `unpack` of animation.js reads: to a 65,534th of each column's range.

    What is not finite becomes no number.
    """
    known = np.isfinite(rows)
    low = np.min(rows, axis=0, where=known, initial=np.inf)
    high = np.max(rows, axis=0, where=known, initial=-np.inf)
    low, high = (np.where(np.isfinite(ends), ends, 0.0) for ends in (low, high))
    span = np.where(high > low, high - low, 1.0)
    parts = np.where(known, (np.where(known, rows, low) - low) / span, 0.0)
    whole = np.where(known, np.rint(parts * 2 * _LARGEST) - _LARGEST, _NO_NUMBER).astype("<i2")
    data = base64.b64encode(np.ascontiguousarray(whole).tobytes()).decode("ascii")
    return {"data": data, "low": [short(x) for x in low], "high": [short(x) for x in high]}


def short(value: float) -> float:
    """Return a number as one of nine digits, which is shorter to write."""
    return float(f"{value:.9g}")


# ----------------------------------------------------------------------------------------------------------------------
# Names in animations: letters with places on bodies, for which pages find room by the rule that figures have.


_NAMED = ("body", "joint", "pulley", "stop")
_CURVE = 12
"""Lines with more points are curves, which letters may lie over."""
_CROSSED = 7.0 * FOREIGN
"""Cost of each line that a name lies over: it goes far rather."""
_CLEAR = 3.0
"""How far letters stay from the sign that they name (px)."""
_ROUND = 6.0
"""The radius (pt) up to which a circle is a sign."""
_BESIDE = 0.12
"""How far from its hinge the name of a stop stands, in sizes of the whole."""


def rule() -> dict[str, Any]:
    """Return the rule by which figures find places for labels, as names.js reads it: pt, rad."""
    angles, rings = [short(float(angle)) for angle in ANGLES], [list(STEPS), *map(list, FURTHER)]
    return {"angles": angles, "rings": rings, "leader": LEADER, "crossed": _CROSSED, "clear": _CLEAR}


def names_in_space(scene: Scene) -> list[dict[str, Any]]:
    """Return the letters of bodies, joints, pulleys and stops with their places on bodies; none of very many.

    A name stands in the middle, of a ring on its rim, of a stop at its bar.
    """
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for item in _named_items(scene):
        form = item.form
        if (ring := form.hollow_disc) is not None:
            at = np.array(ring.centre) + ring.radius * np.array(across(ring.axis))
        elif isinstance(form, TurnStop):
            at = np.array(form.at) + min(0.62 * form.reach, _BESIDE * scene.size) * np.array(form.way)
        else:
            at = form.bounds.mean(axis=0)
        runs = name_runs(scene, item, "letters")
        if runs:
            found.setdefault((item.role, item.name), {"body": item.body, "at": _shorts(at), "runs": runs})
    return list(found.values())


def names_on_page(scene: Scene, sheet: Sheet, height: float) -> list[dict[str, Any]]:
    """Return the letters of the figure's bodies, joints, pulleys and stops with their places at the start (pt)."""
    bodies: dict[tuple[str, str], int] = {}
    for item in _named_items(scene):
        bodies.setdefault((item.role, item.name), item.body)
    found = []
    for mark in label_marks(sheet):
        body = bodies.get((mark.role, mark.name))
        if isinstance(mark, Wish) and body is not None:
            x, y = np.asarray(mark.about, dtype=float).mean(axis=0)
            found.append({"body": body, "at": [short(float(x)), short(float(height - y))], "runs": mark.runs})
    return found


def _lines(sheet: Sheet, item: Item) -> Iterator[tuple[Floats, float]]:
    """Yield the lines of an item that are no curves, with half their width: rods by their middle."""
    if (line := item.form.open_line) is not None:
        yield from [(sheet.page(item.body, line.points), ROD / 2)] if len(line.points) <= _CURVE else []
        return
    for mark in item_marks(sheet, item):
        if isinstance(mark, Arc) and mark.radius > _ROUND:
            turn = np.linspace(mark.start, mark.stop, _CURVE)
            yield np.asarray(mark.centre) + mark.radius * np.column_stack([np.cos(turn), np.sin(turn)]), 0.0
        elif isinstance(mark, (Hatch, Stroke)) and len(mark.points) <= _CURVE:
            points = np.asarray(mark.points)
            yield np.vstack([points, points[:1]]) if getattr(mark, "closed", False) else points, 0.0


def _named_items(scene: Scene) -> Iterator[Item]:
    for item in scene.items if len(scene.bodies) <= MOST_NAMED else ():
        if item.role in _NAMED and item.label and not isinstance(item.form, Axes):
            yield item


# ----------------------------------------------------------------------------------------------------------------------

_MARGIN_OF_STAGE: Final = 30.0
"""What stays free around the motion (pt): symbols reach beyond the places that they mark."""
_EDGE: Final = 8.0
_TICKS: Final = 400
"""Hatching with more ticks is drawn as one dashed line."""
_TICK: Final = 0.55
_HATCHED: Final = f'stroke-dasharray="{number(_TICK)} '
"""The width of a tick (pt), and what tells such a line, whose dashes have no round ends."""
_ROPES: Final = ("rope", "belt")


def plane_stage(frames: Frames, projection: Projection, traces: Sequence[Anchor]) -> tuple[str, dict[str, Any]]:
    """Return the SVG of a plane motion and the numbers that move it: all of its way, or a window that follows it."""
    window = frames.window(projection)
    projection, corners = window.projection, window.projection.page(frames.extent)
    margin = _margin(frames, projection)
    shift = margin - corners.min(axis=0)
    width, height = corners.max(axis=0) + shift + margin
    view = window.size or (width, height)
    home = frames.placed[0]
    sheet = Sheet(frames.scene, home, home, projection, others=frames.looked_at)
    poses = [_page_poses(frames, sheet, k) for k in range(len(frames.scene.bodies))]
    lines = [_line(frames, sheet, k) for k in range(len(home.strands))]
    rows, firsts = len(frames.times), np.cumsum([0, *(2 * line.shape[1] for line in lines)])
    starts = [(each.body, sheet.at(each.body, each.point)) for each in traces]
    data = {
        "poses": packed_columns(side_by_side(poses, rows)),
        "home": [[short(x) for x in pose[0]] for pose in poses],
        "ropes": packed_columns(side_by_side(lines, rows)),
        "pieces": [[int(first), line.shape[1]] for first, line in zip(firsts, lines, strict=False)],
        "ends": [[[short(x), short(height - y)] for x, y in line[_longest(line)][[0, -1]]] for line in lines],
        "height": short(height),
        "whole": [short(width), short(height)],
        "shift": [short(shift[0]), short(-shift[1])],
        "middles": None if window.middles is None else packed_columns(window.middles),
        "follow": window.middles is not None,
        "traces": [{"body": body, "at": [short(x), short(height - y)]} for body, (x, y) in starts],
    }
    if len(frames.scene.bodies) <= MOST_NAMED:
        data["names"] = names_on_page(frames.scene, sheet, height)
        # the lines of what is drawn at the start (pt), on which names stand where there is no other room
        found = []
        for item in frames.scene.items:
            for points, half in _lines(sheet, item) if item.role not in ("frame", "contact") else ():
                line = [[short(float(x)), short(float(height - y))] for x, y in points]
                found.append({"body": item.body, "half": half, "points": line})
        data |= {"lines": found, "rule": rule()}
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {number(view[0])} {number(view[1])}" '
        f'aria-label="{_alt_text(frames)}"><title>{escaped_xml(frames.scene.name)}</title>'
        '<g stroke-linejoin="round" stroke-linecap="round" '
        f'transform="translate({number(shift[0])} {number(-shift[1])})">'
    )
    paper = _squares(corners, height) if window.size and not frames.stays_near_a_face else ""
    return "".join([head, paper, *_groups(frames, projection, lines, height), "</g></svg>"]), data


def _squares(corners: Floats, height: float) -> str:
    """Return squared paper below all of a way, on which a window that follows it is seen to move."""
    (left, low), (right, high) = corners.min(axis=0) - WINDOW[0], corners.max(axis=0) + WINDOW[0]
    place = f'x="{number(left)}" y="{number(height - high)}"'
    area = f'width="{number(right - left)}" height="{number(high - low)}"'
    line = f'<path d="M{SQUARE} 0H0V{SQUARE}" fill="none" stroke="{PAPER}" stroke-width="0.6"/>'
    size = f'width="{SQUARE}" height="{SQUARE}" patternUnits="userSpaceOnUse"'
    return f'<pattern id="squares" {size}>{line}</pattern><rect {place} {area} fill="url(#squares)"/>'


def _margin(frames: Frames, projection: Projection) -> float:
    """Return what stays free around the motion (pt), in which bodies have room that show nothing but a face."""
    home = frames.placed[0]
    corners, faces = projection.page(points_drawn(frames.scene, home)), Sheet(frames.scene, home, home, projection)
    found = [_MARGIN_OF_STAGE]
    for item in frames.scene.items:
        if item.form.endless and item.body >= 0:
            for part in (part for mark in item_marks(faces, item) for part in _simple(mark)):
                _, left, bottom, right, top = box_of(part)
                beyond = [*(corners.min(axis=0) - (left, bottom)), *((right, top) - corners.max(axis=0))]
                found += [_EDGE + float(way) for way in beyond]
    return max(found)


def _page_poses(frames: Frames, sheet: Sheet, body: int) -> Floats:
    """Return places and angles of a body on the page (m, 3), displaced as it is drawn; the angle is 0 at the start."""
    poses = np.array([placed.poses[body] for placed in frames.placed])
    places = np.array([sheet.moved(placed).at(body, (0.0, 0.0, 0.0)) for placed in frames.placed])
    across = poses[0, :, :3].T @ np.array(sheet.projection.right)
    ways = sheet.projection.page(poses[:, :, :3] @ across)
    return np.column_stack([places, np.arctan2(ways[:, 1], ways[:, 0])])


def _line(frames: Frames, sheet: Sheet, number_: int) -> Floats:
    """Return points of a strand on the page at each instant (m, n, 2); a rope as figures lay it round what it meets."""
    along = [placed.strands[number_] for placed in frames.placed]
    if _is_rope(along[0]):
        marks = [next(strand_marks(sheet.moved(p), s), None) for p, s in zip(frames.placed, along, strict=True)]
        if all(isinstance(mark, Stroke) for mark in marks):
            return alike([np.asarray(mark.points, dtype=float) for mark in marks if isinstance(mark, Stroke)])
    found = [drawn_pieces(sheet.moved(p), s).reshape(-1, 2) for p, s in zip(frames.placed, along, strict=True)]
    return np.array(found)


def _is_rope(placed: PlacedStrand) -> bool:
    return placed.strand.kind in _ROPES or placed.strand.rope is not None


def _longest(line: Floats) -> int:
    """Return the instant at which the ends of a strand are farthest from each other: there it is drawn."""
    return int(np.argmax(np.linalg.norm(line[:, -1] - line[:, 0], axis=1)))


# --- what is drawn ---------------------------------------------------------------------------------------------------


def _groups(frames: Frames, projection: Projection, lines: list[Floats], height: float) -> Iterator[str]:
    """Yield groups of what moves together, in the order of their layers."""
    home, drawn = frames.placed[0], list[tuple[tuple[str, int], Mark]]()
    sheet = Sheet(frames.scene, home, home, projection, others=frames.looked_at)
    for item in frames.scene.items:
        if item.role not in ("frame", "contact"):  # the dot where bodies touch stays with neither of them
            group = ("body", item.body) if item.body >= 0 else ("", -1)
            drawn += [(group, mark) for mark in item_marks(sheet, item)]
    for number_, line in enumerate(lines):
        placed = frames.placed[_longest(line)]
        kind = "rope" if _is_rope(placed.strands[number_]) else "strand"
        marks = list(strand_marks(sheet.moved(placed), placed.strands[number_]))
        drawn += [((kind, number_), mark) for mark in (marks[:1] if kind == "rope" else marks)]
    drawn.sort(key=lambda each: each[1].layer)
    for (attribute, place), together in groupby(drawn, key=lambda each: each[0]):
        simple_marks = [part for _, mark in together for part in _simple(mark)]
        if attribute == "rope":
            yield f'<path data-rope="{place}" fill="none" stroke="{ROPE.colour}" stroke-width="{ROPE.width}"/>'
            continue
        shapes = "".join(svg_elements(simple_marks, height)).replace(_HATCHED, 'stroke-linecap="butt" ' + _HATCHED)
        if attribute == "strand":
            shapes = shapes.replace("/>", ' vector-effect="non-scaling-stroke"/>')
        yield f'<g data-{attribute}="{place}">{shapes}</g>' if attribute else f"<g>{shapes}</g>"


def _simple(mark: Mark) -> list[Simple]:
    """Return a mark as lines and letters; labels that still want a place are left out."""
    placed: Placed | Wanted = mark  # type: ignore[assignment]
    if isinstance(placed, Hatch) and len(placed.points) == 2 and _length(placed.points) > _TICKS * placed.gap:
        # the hatching as a second line beside it, wide and dashed
        start, end = np.asarray(placed.points, dtype=float)
        along, deep = (end - start) / _length(placed.points), placed.tick * np.sqrt(0.5)
        away = placed.side * np.array([-along[1], along[0]]) * deep / 2
        named, ticks = fields_of(placed), Pen(deep, placed.pen.colour, (_TICK, placed.gap - _TICK))
        return [Stroke(placed.points, placed.pen, **named), Stroke(placed.points + away, ticks, **named)]
    return [] if isinstance(placed, Wanted) else simple(placed)


def _length(points: Floats) -> float:
    return float(np.hypot(*(np.asarray(points[1]) - points[0])))


# ----------------------------------------------------------------------------------------------------------------------
# A motion in space for a page: forms of bodies as data for three.js, and their poses as numbers.


_COLOURS: Final = (0x5B8DB8, 0xE0A458, 0x6DA67A, 0xB57BA6, 0x8C8C8C, 0xC96F53, 0x4FA3A5, 0xA3A948)
_GROUND: Final = 0x9AA3AD
_SPACE_FAR: Final = 4.0
"""A motion so many times as far as what moves may be followed: all of it in view, nobody could tell what it is."""
_AXES: Final = 0.22
"""How far the axes and their letters reach from the corner of the ground, in sizes of the whole."""
_AIR, _WIDE = 1.3, 1.6
"""How much higher a view is than what it shows, and how much wider than high."""
_BELOW: Final = 0.05
"""How far below everything the grid of the ground lies, as a part of its reach."""


def space_stage(frames: Frames, projection: Projection, traces: Sequence[Anchor]) -> tuple[str, dict[str, Any]]:
    """Return the canvas of a motion in space and the numbers that move it."""
    scene, rows = frames.scene, len(frames.times)
    poses = [_poses(np.array([placed.poses[k] for placed in frames.placed])) for k in range(len(scene.bodies))]
    lines = [strand_points(along) for along in zip(*(placed.strands for placed in frames.placed), strict=True)]
    low, high = frames.extent.min(axis=0), frames.extent.max(axis=0)
    up = np.array(scene.up if scene.plane else unit(-np.array(scene.gravity)))
    far, near = max(float(np.linalg.norm(high - low)), 0.5 * scene.size), frames.near
    firsts = np.cumsum([0, *(3 * line.shape[1] for line in lines)])
    # a level grid below everything, a little wider than the motion; the axes stand at its corner to the left in front
    half = (high - low) / 2
    width = float(np.linalg.norm(half))
    floor = _shorts((low + high) / 2 - (float(np.abs(up) @ half) + _BELOW * width) * up)
    corner = low - float(low @ up) * up + float(np.array(floor) @ up) * up
    middle, reach = _first_view(projection, np.vstack([frames.extent, corner + _AXES * scene.size * np.eye(3)]))
    data = {
        "poses": packed_columns(side_by_side(poses, rows)),
        "ropes": packed_columns(side_by_side(lines, rows)),
        "pieces": [[int(first), line.shape[1]] for first, line in zip(firsts, lines, strict=False)],
        "kinds": [strand.kind for strand in scene.strands],
        "bodies": list(scene.bodies),
        "items": [_item(item) for item in scene.items if item.role != "frame"],
        "size": short(scene.size),
        "middle": _shorts(middle),
        "low": _shorts(corner),
        "floor": {"middle": floor, "width": short(1.8 * width or 1.0)},
        "names": names_in_space(scene),
        "rule": rule(),
        "reach": short(max(reach, 0.5 * scene.size)),
        "near": short(near) if far > _SPACE_FAR * near > 0.0 else None,
        "follow": frames.leaves_nothing and (frames.stays_near_a_face or not frames.faces),
        "right": _shorts(projection.right),
        "up": _shorts(up),
        "towards": _shorts(projection.toward),
        "traces": [{"body": each.body, "at": _shorts(each.point)} for each in traces],
    }
    return f'<canvas width="640" height="400" role="img" aria-label="{_alt_text(frames)}"></canvas>', data


def _first_view(projection: Projection, points: Floats) -> tuple[Floats, float]:
    """Return the point in the middle of a view that shows all points (n, 3), and how high (m) the view is."""
    sides = np.array([projection.right, projection.up])
    seen = points @ sides.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    inside = points.mean(axis=0)
    wide, tall = high - low
    middle: Floats = inside + ((low + high) / 2 - sides @ inside) @ sides
    return middle, _AIR * max(float(tall), float(wide) / _WIDE)


def three() -> str:
    """Return three.js as meshcat's wheel carries it. Raises OutputError where that is not installed."""
    from importlib.util import find_spec

    found = find_spec("meshcat")
    if found is None or found.origin is None:
        raise OutputError("animations in space need meshcat: pip install 'multibody_sym[animate]'", number="O104")
    script = Path(found.origin).parent / "viewer" / "dist" / "main.min.js"
    return script.read_text(encoding="utf-8").replace("</script", "<\\/script")


def _poses(poses: Floats) -> Floats:
    """Return places and quaternions (x, y, z, w) of a body (m, 7), without jumps of sign."""
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_matrix(poses[:, :, :3]).as_quat()
    signs = np.where(np.einsum("ij,ij->i", turns[1:], turns[:-1]) < 0.0, -1.0, 1.0)
    turns[1:] *= np.cumprod(signs)[:, None]
    return np.column_stack([poses[:, :, 3], turns])


def _item(item: Item) -> dict[str, Any]:
    """Return an item as the script's builders read it."""
    still = item.on_ground or item.form.guides or item.role == "ground"
    colour = _GROUND if still or item.body < 0 else _COLOURS[item.body % len(_COLOURS)]
    form = _with_short_numbers(asdict(item.form))
    return {"body": item.body, "form": type(item.form).__name__, "colour": colour, **form}


def _with_short_numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _with_short_numbers(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_with_short_numbers(each) for each in value]
    return short(value) if isinstance(value, float) else value


def _shorts(values: Any) -> list[float]:
    return [short(float(value)) for value in values]
