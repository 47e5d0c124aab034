"""Names in animations: letters with places on bodies, for which pages find room by the rule that figures have."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from multibody_sym.drawing.draw import MOST_NAMED
from multibody_sym.drawing.labels import ANGLES, FOREIGN, FURTHER, LEADER, STEPS
from multibody_sym.drawing.lettering import letters
from multibody_sym.drawing.look.labels import label_marks
from multibody_sym.drawing.look.scene_marks import item_marks
from multibody_sym.drawing.look.sheet import Sheet
from multibody_sym.drawing.picture import Arc, Hatch, Stroke, Wish
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Axes, Disc, Polyline, TurnStop, Vector, across, vector
from multibody_sym.scene.items import Item
from multibody_sym.scene.scene import Scene
from multibody_sym.writing.animation.packing import short

_NAMED = ("body", "joint", "pulley", "stop")
_CURVE = 12
"""Lines with more points are curves, which letters may lie over."""
_CROSSED = 2.0 * FOREIGN
"""Cost of each line that a name lies over; figures do without."""
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
    """Return the letters of bodies, joints, pulleys and stops with their places on bodies; none of very many."""
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for item in _named(scene):
        at = [short(x) for x in _place(scene, item)]
        found.setdefault((item.role, item.name), {"body": item.body, "at": at, "runs": letters(item.label)})
    return list(found.values())


def names_on_page(scene: Scene, sheet: Sheet, height: float) -> list[dict[str, Any]]:
    """Return the letters of the figure's bodies, joints, pulleys and stops with their places at the start (pt)."""
    bodies: dict[tuple[str, str], int] = {}
    for item in _named(scene):
        bodies.setdefault((item.role, item.name), item.body)
    found = []
    for mark in label_marks(sheet):
        body = bodies.get((mark.role, mark.name))
        if isinstance(mark, Wish) and body is not None:
            x, y = np.asarray(mark.about, dtype=float).mean(axis=0)
            found.append({"body": body, "at": [short(float(x)), short(float(height - y))], "runs": mark.runs})
    return found


def lines_on_page(scene: Scene, sheet: Sheet, height: float) -> list[dict[str, Any]]:
    """Return the lines of what is drawn at the start (pt), on which names stand where there is no other room."""
    found = []
    for item in scene.items:
        for points in _lines(sheet, item) if item.role not in ("frame", "contact") else ():
            line = [[short(float(x)), short(float(height - y))] for x, y in points]
            found.append({"body": item.body, "points": line})
    return found


def _lines(sheet: Sheet, item: Item) -> Iterator[Floats]:
    """Yield the lines of an item that are no curves, and rods by their middle."""
    if isinstance(item.form, Polyline) and not item.form.closed:
        yield from [sheet.page(item.body, item.form.points)] if len(item.form.points) <= _CURVE else []
        return
    for mark in item_marks(sheet, item):
        if isinstance(mark, Arc) and mark.radius > _ROUND:
            turn = np.linspace(mark.start, mark.stop, _CURVE)
            yield np.asarray(mark.centre) + mark.radius * np.column_stack([np.cos(turn), np.sin(turn)])
        elif isinstance(mark, (Hatch, Stroke)) and len(mark.points) <= _CURVE:
            points = np.asarray(mark.points)
            yield np.vstack([points, points[:1]]) if getattr(mark, "closed", False) else points


def _named(scene: Scene) -> Iterator[Item]:
    for item in scene.items if len(scene.bodies) <= MOST_NAMED else ():
        if item.role in _NAMED and item.label and not isinstance(item.form, Axes):
            yield item


def _place(scene: Scene, item: Item) -> Vector:
    """Return where on its body a name stands: in the middle, of a ring on its rim, of a stop at its bar."""
    if isinstance(item.form, Disc) and item.form.hollow:
        return vector(np.array(item.form.centre) + item.form.radius * np.array(across(item.form.axis)))
    if isinstance(item.form, TurnStop):
        way = min(0.62 * item.form.reach, _BESIDE * scene.size)
        return vector(np.array(item.form.at) + way * np.array(item.form.way))
    return vector(item.form.bounds.mean(axis=0))
