"""A plane motion for a page: its figure as groups that move with bodies, and their places as numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import groupby
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.draw import MOST_NAMED
from multibody_sym.drawing.look.scene_marks import item_marks
from multibody_sym.drawing.look.sheet import Sheet, extent
from multibody_sym.drawing.look.strands import strand_marks
from multibody_sym.drawing.picture import Hatch, Mark, Pen, Placed, Simple, Stroke, Wanted, box_of, simple
from multibody_sym.drawing.projection import Projection
from multibody_sym.drawing.style import ROPE
from multibody_sym.drawing.svg import elements, escaped, number
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Face
from multibody_sym.scene.items import Anchor, PlacedStrand
from multibody_sym.writing.animation.frames import Frames, alike, side_by_side, strand_points
from multibody_sym.writing.animation.names import lines_on_page, names_on_page, rule
from multibody_sym.writing.animation.packing import packed, short

_MARGIN: Final = 30.0
"""What stays free around the motion (pt): symbols reach beyond the places that they mark."""
_EDGE: Final = 8.0
_WINDOW: Final = (420.0, 240.0)
"""Width and height (pt) of a window that follows what moves."""
_NEAR: Final = 110.0
"""How large (pt) what moves is in such a window."""
_LONGEST: Final = 20_000.0
"""How long a way (pt) is drawn at most."""
_FAR: Final = 3.0
"""So many times as large as all of the way in view something must be seen to be followed."""
_SQUARE: Final = 55
"""The size of squared paper (pt)."""
_TICKS: Final = 400
"""Hatching with more ticks is drawn as one dashed line."""
_TICK: Final = 0.55
_HATCHED: Final = f'stroke-dasharray="{number(_TICK)} '
"""The width of a tick (pt), and what tells such a line, whose dashes have no round ends."""
_ROPES: Final = ("rope", "belt")


def plane_stage(frames: Frames, projection: Projection, traces: list[Anchor]) -> tuple[str, dict[str, Any]]:
    """Return the SVG of a plane motion and the numbers that move it: all of its way, or a window that follows it."""
    projection, follows = _followed(frames, projection)
    corners = projection.page(frames.extent)
    margin = _margin(frames, projection)
    shift = margin - corners.min(axis=0)
    width, height = corners.max(axis=0) + shift + margin
    view = _WINDOW if follows else (width, height)
    poses = [_page_poses(frames, projection, k) for k in range(len(frames.scene.bodies))]
    home = frames.placed[0]
    sheet = Sheet(frames.scene, home, home, projection, others=frames.looked_at)
    lines = [_line(frames, sheet, k) for k in range(len(home.strands))]
    rows = len(frames.times)
    data = {
        "poses": packed(side_by_side(poses, rows)),
        "home": [[short(x) for x in pose[0]] for pose in poses],
        "ropes": packed(side_by_side(lines, rows)),
        "pieces": _pieces(lines),
        "ends": [[[short(x), short(height - y)] for x, y in line[_longest(line)][[0, -1]]] for line in lines],
        "height": short(height),
        "window": _WINDOW if follows else None,
        "traces": [_trace(frames, projection, each, height) for each in traces],
    }
    if len(frames.scene.bodies) <= MOST_NAMED:
        data["names"] = names_on_page(frames.scene, sheet, height)
        data |= {"lines": lines_on_page(frames.scene, sheet, height), "rule": rule()}
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {number(view[0])} {number(view[1])}" '
        f'aria-label="{escaped(frames.scene.name)}"><title>{escaped(frames.scene.name)}</title>'
        '<g stroke-linejoin="round" stroke-linecap="round" '
        f'transform="translate({number(shift[0])} {number(-shift[1])})">'
    )
    body = _groups(frames, projection, lines, height)
    trails = (f'<path data-trace="{k}" fill="none" stroke="#c2410c" stroke-width="0.8"/>' for k in range(len(traces)))
    paper = _squares(corners, height) if follows and not frames.faces else ""
    return "".join([head, paper, *body, *trails, "</g></svg>"]), data


def _squares(corners: Floats, height: float) -> str:
    """Return squared paper below all of a way, on which a window that follows it is seen to move."""
    (left, low), (right, high) = corners.min(axis=0) - _WINDOW[0], corners.max(axis=0) + _WINDOW[0]
    place = f'x="{number(left)}" y="{number(height - high)}"'
    area = f'width="{number(right - left)}" height="{number(high - low)}"'
    line = f'<path d="M{_SQUARE} 0H0V{_SQUARE}" fill="none" stroke="#d5dae0" stroke-width="0.6"/>'
    size = f'width="{_SQUARE}" height="{_SQUARE}" patternUnits="userSpaceOnUse"'
    return f'<pattern id="squares" {size}>{line}</pattern><rect {place} {area} fill="url(#squares)"/>'


def _followed(frames: Frames, projection: Projection) -> tuple[Projection, bool]:
    """Return the scale at which what goes far is well seen, and whether it is followed."""
    reach = float(np.linalg.norm(np.ptp(projection.page(frames.extent), axis=0)))
    if not (frames.near > 0.0 and reach > 0.0 and frames.follows):
        return projection, False
    scale = min(_NEAR / frames.near, projection.scale * _LONGEST / reach)
    return (replace(projection, scale=scale), True) if scale > _FAR * projection.scale else (projection, False)


def _margin(frames: Frames, projection: Projection) -> float:
    """Return what stays free around the motion (pt), in which bodies have room that show nothing but a face."""
    home = frames.placed[0]
    corners, faces = projection.page(extent(frames.scene, home)), Sheet(frames.scene, home, home, projection)
    found = [_MARGIN]
    for item in frames.scene.items:
        if isinstance(item.form, Face) and item.form.ends is None and item.body >= 0:
            for part in (part for mark in item_marks(faces, item) for part in _simple(mark)):
                _, left, bottom, right, top = box_of(part)
                beyond = [*(corners.min(axis=0) - (left, bottom)), *((right, top) - corners.max(axis=0))]
                found += [_EDGE + float(way) for way in beyond]
    return max(found)


def _page_poses(frames: Frames, projection: Projection, body: int) -> Floats:
    """Return places and angles of a body on the page (m, 3); the angle is zero at the start."""
    poses = np.array([placed.poses[body] for placed in frames.placed])
    places = projection.page(poses[:, :, 3])
    across = poses[0, :, :3].T @ np.array(projection.right)
    ways = projection.page(poses[:, :, :3] @ across)
    return np.column_stack([places, np.arctan2(ways[:, 1], ways[:, 0])])


def _line(frames: Frames, sheet: Sheet, number_: int) -> Floats:
    """Return points of a strand on the page at each instant (m, n, 2); a rope as figures lay it round what it meets."""
    along = [placed.strands[number_] for placed in frames.placed]
    if _is_rope(along[0]):
        marks = [next(strand_marks(sheet.moved(p), s), None) for p, s in zip(frames.placed, along, strict=True)]
        if all(isinstance(mark, Stroke) for mark in marks):
            return alike([np.asarray(mark.points, dtype=float) for mark in marks if isinstance(mark, Stroke)])
    found: Floats = sheet.projection.page(strand_points(along))
    return found


def _is_rope(placed: PlacedStrand) -> bool:
    return placed.strand.kind in _ROPES or placed.strand.rope is not None


def _pieces(lines: list[Floats]) -> list[list[int]]:
    """Return for each strand its first column among all, and how many points it has."""
    found, first = [], 0
    for line in lines:
        found.append([first, line.shape[1]])
        first += 2 * line.shape[1]
    return found


def _longest(line: Floats) -> int:
    """Return the instant at which the ends of a strand are farthest from each other: there it is drawn."""
    return int(np.argmax(np.linalg.norm(line[:, -1] - line[:, 0], axis=1)))


def _trace(frames: Frames, projection: Projection, anchor: Anchor, height: float) -> dict[str, Any]:
    x, y = projection.page(frames.placed[0].point(anchor))
    return {"body": anchor.body, "at": [short(x), short(height - y)]}


# --- what is drawn ---------------------------------------------------------------------------------------------------


def _groups(frames: Frames, projection: Projection, lines: list[Floats], height: float) -> Iterator[str]:
    """Yield groups of what moves together, in the order of their layers."""
    drawn = [*_on_bodies(frames, projection), *_between_bodies(frames, projection, lines)]
    drawn.sort(key=lambda each: each[1].layer)
    for (attribute, place), marks in groupby(drawn, key=lambda each: each[0]):
        simple_marks = [part for _, mark in marks for part in _simple(mark)]
        if attribute == "rope":
            yield f'<path data-rope="{place}" fill="none" stroke="{ROPE.colour}" stroke-width="{ROPE.width}"/>'
            continue
        shapes = "".join(elements(simple_marks, height)).replace(_HATCHED, 'stroke-linecap="butt" ' + _HATCHED)
        if attribute == "strand":
            shapes = shapes.replace("/>", ' vector-effect="non-scaling-stroke"/>')
        yield f'<g data-{attribute}="{place}">{shapes}</g>' if attribute else f"<g>{shapes}</g>"


_Drawn = tuple[tuple[str, int], Mark]


def _on_bodies(frames: Frames, projection: Projection) -> Iterator[_Drawn]:
    home = frames.placed[0]
    sheet = Sheet(frames.scene, home, home, projection, others=frames.looked_at)
    for item in frames.scene.items:
        if item.role in ("frame", "contact"):  # the dot where bodies touch stays with neither of them
            continue
        group = ("body", item.body) if item.body >= 0 else ("", -1)
        yield from ((group, mark) for mark in item_marks(sheet, item))


def _between_bodies(frames: Frames, projection: Projection, lines: list[Floats]) -> Iterator[_Drawn]:
    for number_, line in enumerate(lines):
        placed = frames.placed[_longest(line)]
        strand = placed.strands[number_]
        marks = list(strand_marks(Sheet(frames.scene, placed, placed, projection), strand))
        if _is_rope(strand):
            yield from ((("rope", number_), mark) for mark in marks[:1])
        else:
            yield from ((("strand", number_), mark) for mark in marks)


def _simple(mark: Mark) -> list[Simple]:
    """Return a mark as lines and letters; labels that still want a place are left out."""
    placed: Placed | Wanted = mark  # type: ignore[assignment]
    if isinstance(placed, Hatch) and len(placed.points) == 2 and _length(placed.points) > _TICKS * placed.gap:
        return _dashed(placed)
    return [] if isinstance(placed, Wanted) else simple(placed)


def _length(points: Floats) -> float:
    return float(np.hypot(*(np.asarray(points[1]) - points[0])))


def _dashed(hatch: Hatch) -> list[Simple]:
    """Return a long line with its hatching as a second one beside it, wide and dashed."""
    start, end = np.asarray(hatch.points, dtype=float)
    along, deep = (end - start) / _length(hatch.points), hatch.tick * np.sqrt(0.5)
    away = hatch.side * np.array([-along[1], along[0]]) * deep / 2
    named: dict[str, Any] = {"role": hatch.role, "name": hatch.name, "layer": hatch.layer, "depth": hatch.depth}
    ticks = Pen(deep, hatch.pen.colour, (_TICK, hatch.gap - _TICK))
    return [Stroke(hatch.points, hatch.pen, **named), Stroke(hatch.points + away, ticks, **named)]
