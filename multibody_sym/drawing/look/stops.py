"""Stops: a bar across the way that it ends, a radial one beside the rod that it holds; hatched where ground has it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.drawing.look.rails import block_size, wedge_corners
from multibody_sym.drawing.look.settle import BOB
from multibody_sym.drawing.look.shapes import barrel, wedge
from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.drawing.picture import Hatch, Mark, Stroke
from multibody_sym.drawing.style import BLOCK, BOLD, DARK, LAYER_GROUND, LAYER_JOINT, PIN, ROD
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Barrel, Face, Polyline, Stop, Symbol, TurnStop, vector
from multibody_sym.scene.items import Item

_SLEEVE: Final = (6.5, 7.0)
"""Half the length of a slider in space, and the radius of what stops it (pt)."""
_BEYOND: Final = 1.5
"""How far a bar reaches beyond what it stops (pt)."""
_THICK: Final = 3.5
"""The thickness of a bar on a body that moves (pt)."""
_RADII: Final = (11.0, 30.0, 0.62)
"""How near to a hinge and how far from it a radial bar begins (pt), and at which part of the rod where it is short."""
_LONG: Final = 11.0
"""The length of a radial bar (pt)."""
_BAR: Final = 4.0
"""The width of a rod in space (pt)."""
_INSIDE: Final = 0.75 * np.pi
"""The angle (rad) from which on a plate is around its hinge, and no edge of it comes to a stop."""
_SEEN: Final = 0.05


def stop_marks(sheet: Sheet, item: Item, form: Stop | TurnStop) -> Iterator[Mark]:
    """Yield the bar of a stop: with hatching on its far side on ground, else of some thickness; in space a collar."""
    line = stop_line(sheet, item, form)
    if line is None:
        return
    if isinstance(form, Stop) and not sheet.flat:
        yield from _collar(sheet, item, form)
        return
    far = sheet.way(item.body, form.axis if isinstance(form, Stop) else np.cross(form.axis, form.way))
    side = 1 if float(left(line[1] - line[0]) @ far) > 0.0 else -1
    if item.on_ground:
        named = sheet.named(item, LAYER_GROUND + 0.2, form.at)
        yield Hatch(line, sheet.pen(item, BOLD), side=side, tick=4.0, gap=3.5, **named)
        return
    away = _THICK * side * left(unit2(line[1] - line[0]))
    corners = np.vstack([line, line[::-1] + away])
    named = sheet.named(item, LAYER_JOINT - 0.3, form.at)
    yield Stroke(corners, sheet.pen(item), closed=True, fill=DARK, **named)


def stop_line(sheet: Sheet, item: Item, form: Stop | TurnStop) -> Floats | None:
    """Return the ends (2, 2) of the line that what is stopped comes to; None of one that is seen along its way."""
    if float(np.linalg.norm(sheet.way(item.body, form.axis if isinstance(form, Stop) else form.way))) < _SEEN:
        return None
    return _across(sheet, item, form) if isinstance(form, Stop) else _radial(sheet, item, form)


def _child(item: Item) -> int:
    return item.bodies[1]


def _across(sheet: Sheet, item: Item, form: Stop) -> Floats:
    """Return a line across a way, where the front of what comes there is, as high as that."""
    along = unit2(sheet.way(item.body, form.axis))
    base = sheet.at(item.body, form.at) + sheet.settled.bodies.get(_child(item), np.zeros(2))
    if not sheet.flat:
        foot = base + _reach(sheet, form) * sheet.way(item.body, form.axis)
        return foot + np.outer([-_SLEEVE[1], _SLEEVE[1]], left(along))
    corners = _corners(sheet, item, form)
    heights = corners @ left(along)
    foot = base + float((corners @ along).max()) * along
    return foot + np.outer([heights.min() - _BEYOND, heights.max() + _BEYOND], left(along))


def _reach(sheet: Sheet, form: Stop) -> float:
    """Return how far what is stopped in space reaches ahead of its place (pt)."""
    return sheet.projection.scale * form.front or _SLEEVE[0]


def _corners(sheet: Sheet, item: Item, form: Stop) -> Floats:
    """Return what bounds the body that is stopped, from its place in the joint (n, 2); of a rod the slider's block."""
    child, found = _child(item), []
    at = sheet.at(child, form.point)
    for other in sheet.touched.get(child, ()):
        if other.role not in ("body", "surface") or (isinstance(other.form, Polyline) and not other.form.closed):
            continue
        if isinstance(other.form, Symbol):
            slanted = wedge_corners(sheet, other, other.form)
            found.append(slanted - at if len(slanted) else _block(sheet, item, form, other))
        elif isinstance(other.form, Face):
            found.append(wedge(sheet, other, other.form) - at)
        else:
            found.append(sheet.page(child, other.form.bounds) - at)
    return np.vstack(found or [_block(sheet, item, form, None)])


def _block(sheet: Sheet, item: Item, form: Stop, body: Item | None) -> Floats:
    """Return the corners (4, 2) of a sign whose size is the page's: a mass, a slider, a bead or a bob."""
    if body is not None:
        kind = body.form.kind if isinstance(body.form, Symbol) else ""
        half = np.array(block_size(sheet, body)) / 2 if kind == "block" else np.full(2, BOB)
    else:
        beads = (i for i in sheet.touched.get(_child(item), ()) if i.role == "joint" and isinstance(i.form, Symbol))
        bead = any(i.form.kind == "bead" for i in beads if isinstance(i.form, Symbol))
        half = np.full(2, PIN) if bead else np.array(BLOCK) / 2
    along = unit2(sheet.way(item.body, form.axis))
    signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    corners: Floats = (signs * half) @ np.array([along, left(along)])
    return corners


def _radial(sheet: Sheet, item: Item, form: TurnStop) -> Floats:
    """Return a line away from a hinge along the edge of the rod that it stops."""
    at, way = sheet.at(item.body, form.at), sheet.way(item.body, form.way)
    barred = sheet.way(item.body, np.cross(form.axis, form.way))
    nearest, farthest, part = _RADII
    start = min(farthest, max(nearest, part * sheet.projection.scale * form.reach))
    turn, edge = _edge(sheet, item, form)
    ahead = np.cos(turn) * way + np.sin(turn) * barred
    beside = (edge + BOLD.width / 2) * (np.cos(turn) * barred - np.sin(turn) * way)
    found: Floats = at + beside + np.outer([start, start + _LONG], ahead)
    return found


def _edge(sheet: Sheet, item: Item, form: TurnStop) -> tuple[float, float]:
    """Return by which angle (rad) the edge of what turns is ahead of its longest direction, and how far beside (pt)."""
    plates = [
        sheet.page(other.body, other.form.points) - sheet.at(item.body, form.at)
        for other in sheet.touched.get(_child(item), ())
        if other.role == "body" and isinstance(other.form, Polyline) and other.form.closed and sheet.flat
    ]
    if not plates:
        return 0.0, (ROD if sheet.flat else _BAR) / 2
    own, barred = sheet.way(_child(item), form.own), sheet.way(item.body, np.cross(form.axis, form.way))
    across = left(own) * (1.0 if float(left(sheet.way(item.body, form.way)) @ barred) > 0.0 else -1.0)
    corners = np.vstack(plates)
    corners = corners[np.linalg.norm(corners, axis=1) > PIN]
    ahead = float(np.arctan2(corners @ across, corners @ own).max())
    return (ahead, 0.0) if 0.0 <= ahead < _INSIDE else (0.0, 0.0)


def _collar(sheet: Sheet, item: Item, form: Stop) -> Iterator[Mark]:
    """Yield a disc across the way, behind the front of what comes there."""
    ahead = sheet.metres(_reach(sheet, form) + _THICK / 2)
    centre = vector(np.array(form.at) + ahead * np.array(form.axis))
    disc = Barrel(centre, form.axis, sheet.metres(_SLEEVE[1]), sheet.metres(_THICK))
    yield from barrel(sheet, item.body, disc, sheet.pen(item), sheet.named(item, LAYER_JOINT, centre), fill=DARK)
