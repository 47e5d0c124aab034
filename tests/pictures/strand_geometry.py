"""What is wrong with ropes and rods as geometry: ends that are off their loads, pieces not tangent to their wheels."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from multibody_sym.model.system import System
from multibody_sym.pictures.draw import item_marks
from multibody_sym.pictures.marks.forces import strand_marks
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.layout import distances
from multibody_sym.pictures.page.picture import Arc, Hatch, Stroke, simple
from multibody_sym.pictures.scene.items import Anchor, PlacedStrand

PIXEL = 1.0
STEEPEST = float(np.sin(np.radians(0.5)))
STRAIGHT = 6.0
"""From this length (pt) on a piece of a rope is no part of a bow on a wheel."""
HELD = ("rope", "rod", "spring", "damper", "spring_damper")
Circle = tuple[np.ndarray, float]


def wheels(system: System, sheet: Sheet, rope: str) -> dict[str, Circle]:
    """Return the wheels of a rope as they are drawn, by pulley; those in which it does not bend are left out."""
    found = {}
    for name in (each for each in system.constraints[rope].path if each in system.pulleys):
        items = (item for item in sheet.scene.items if item.role == "pulley" and item.name == name)
        arcs = [mark for item in items for mark in item_marks(sheet, item) if isinstance(mark, Arc)]
        wheel = max(arcs, key=lambda arc: arc.radius)
        if wheel.radius > 4.5:
            found[name] = np.asarray(wheel.centre), float(wheel.radius)
    return found


def outlines(sheet: Sheet, body: int) -> list[np.ndarray]:
    """Return the lines and areas (n, 2) by which a body is drawn."""
    own = [item for item in sheet.scene.items if item.body == body and item.role in ("body", "surface", "pulley")]
    joints = [item for item in sheet.scene.items if item.role == "joint" and body in item.bodies]
    marks = [part for item in (*own, *joints) for mark in item_marks(sheet, item) for part in simple(mark)]
    return [np.asarray(mark.points, dtype=float) for mark in marks if isinstance(mark, (Arc, Stroke))]


def is_off(end: np.ndarray, drawn: Sequence[np.ndarray], place: np.ndarray) -> bool:
    """Return whether an end lies neither in what is drawn of a body, nor on its edge, nor at its place."""
    if float(np.linalg.norm(end - place)) <= PIXEL:
        return False
    for points in drawn:
        around = np.vstack((points, points[:1]))
        if float(distances(end[None], np.hstack((around[:-1], around[1:]))).min()) <= PIXEL:
            return False
        a, b = around[:-1] - end, around[1:] - end
        turns = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(1))
        if abs(float(turns.sum())) > np.pi:
            return False
    return True


def off_wheels(points: np.ndarray, circles: dict[str, Circle]) -> Iterator[str]:
    """Yield the wheels that a rope does not touch, cuts or leaves at an angle, each by the pieces beside it."""
    pieces = [(a, b) for a, b in pairwise(points) if float(np.linalg.norm(b - a)) > STRAIGHT]
    pieces = pieces or [(a, b) for a, b in pairwise(points) if float(np.linalg.norm(b - a)) > PIXEL]
    for k, (name, (centre, radius)) in enumerate(circles.items()):
        beside = pieces[k : k + 2] if len(pieces) == len(circles) + 1 else pieces
        lines = np.array([np.hstack(piece) for piece in beside])
        gap = float(distances(centre[None], lines).min()) - radius
        if abs(gap) > PIXEL:
            yield f"is {gap:.2f} pt off the rim of {name}"
        for start, stop in beside:
            length = float(np.linalg.norm(stop - start))
            arm = min(start - centre, stop - centre, key=lambda each: float(np.linalg.norm(each)))
            lean = abs(float(arm @ (stop - start))) / (max(float(np.linalg.norm(arm)), PIXEL) * length)
            if float(np.linalg.norm(arm)) < radius + PIXEL and lean > STEEPEST:
                yield f"leaves {name} at {np.degrees(np.arcsin(min(lean, 1.0))):.2f} deg to its tangent"


def strand_faults(system: System, sheet: Sheet) -> Iterator[str]:
    """Yield what is wrong with the ropes and rods of one instant."""
    for placed in sheet.placed.strands:
        strand, drawn = placed.strand, list(strand_marks(sheet, placed))
        if strand.kind not in ("rope", "rod") or not drawn:
            continue
        lines = [np.asarray(mark.points) for mark in drawn if isinstance(mark, Stroke)]
        ends = [lines[0][0], lines[0][-1]]
        if strand.kind == "rod":
            ends = [np.asarray(mark.centre) for mark in drawn if isinstance(mark, Arc)][:2]
        else:
            yield from (f"{strand.name} {what}" for what in off_wheels(lines[0], wheels(system, sheet, strand.name)))
        ground = [np.asarray(mark.points) for mark in drawn if isinstance(mark, Hatch)]
        for anchor, end in held_ends(placed, ends):
            place = sheet.at(anchor.body, anchor.point)
            if is_off(end, outlines(sheet, anchor.body) if anchor.body >= 0 else ground, place):
                yield f"{strand.name} ends {float(np.linalg.norm(end - place)):.2f} pt off its place"


def held_ends(placed: PlacedStrand, ends: Sequence[np.ndarray]) -> list[tuple[Anchor, np.ndarray]]:
    """Return the ends of a strand that are held at points, with these; others are wound on drums."""
    anchors = placed.strand.anchors
    if len(anchors) == 2:
        return [(anchors[0], ends[0]), (anchors[-1], ends[-1])]
    winds_first = any(np.allclose(bow.start, placed.pieces[0][0]) for bow in placed.wound)
    return [(anchors[0], ends[-1] if winds_first else ends[0])] if anchors else []


# ----------------------------------------------------------------------------------------------------------------------
# The same of a page: its numbers, moved as plane.js moves them.


@dataclass(frozen=True)
class PageData:
    """The numbers of an animation in the plane: `poses` (m, bodies, 3), `ropes` (m, columns)."""

    data: dict[str, Any]
    poses: np.ndarray
    ropes: np.ndarray

    def moved(self, body: int, points: np.ndarray, row: int) -> np.ndarray:
        """Return points (n, 2) of what is drawn on a body at the start where they are in a row."""
        if body < 0:
            return points
        x, y, home = self.data["home"][body]
        now_x, now_y, turn = self.poses[row, body]
        c, s = np.cos(turn - home), np.sin(turn - home)
        apart = points - np.array([x, y])
        return np.array([now_x, now_y]) + apart @ np.array([[c, s], [-s, c]])

    def strand(self, number: int, row: int) -> np.ndarray:
        """Return the points (n, 2) of a strand in a row."""
        first, count = self.data["pieces"][number]
        return self.ropes[row, first : first + 2 * count].reshape(-1, 2)


def page_data(html: str) -> PageData:
    """Return the numbers of a page."""
    text = re.search(r'class="animation-data">(.*?)</script>', html, re.DOTALL)
    assert text is not None
    data = json.loads(text[1])
    rows = len(data["times"])
    poses, ropes = (_unpacked(data[name], rows) for name in ("poses", "ropes"))
    return PageData(data, poses.reshape(rows, -1, 3), ropes)


def _unpacked(packed: dict[str, Any], rows: int) -> np.ndarray:
    whole = np.frombuffer(base64.b64decode(packed["data"]), "<i2").reshape(rows, -1)
    low, high = np.array(packed["low"]), np.array(packed["high"])
    return low + (whole + 32767.0) / 65534.0 * (high - low)


def page_faults(system: System, sheet: Sheet, page: PageData, rows: Sequence[int]) -> Iterator[str]:
    """Yield what is wrong with the strands of a page, whose marks are those of a `sheet` at the start."""
    for number, placed in enumerate(sheet.home.strands):
        strand = placed.strand
        if strand.kind not in HELD:
            continue
        circles = wheels(system, sheet, strand.name) if strand.kind == "rope" else {}
        bodies = {item.name: item.body for item in sheet.scene.items if item.role == "pulley"}
        marks = [m for m in strand_marks(sheet, placed) if isinstance(m, Hatch) or getattr(m, "closed", False)]
        plates = [np.asarray(mark.points) for mark in marks]  # ground at its ends, or what it begins at on a body
        for row in rows:
            points = page.strand(number, row)
            now = {name: (page.moved(bodies[name], c[None], row)[0], r) for name, (c, r) in circles.items()}
            yield from (f"{strand.name} {what} in row {row}" for what in off_wheels(points, now))
            for anchor, end in held_ends(placed, points[[0, -1]]):
                place = page.moved(anchor.body, sheet.at(anchor.body, anchor.point)[None], row)[0]
                seen = [*(outlines(sheet, anchor.body) if anchor.body >= 0 else ()), *plates]
                if is_off(end, [page.moved(anchor.body, line, row) for line in seen], place):
                    yield f"{strand.name} ends {float(np.linalg.norm(end - place)):.2f} pt off its place in row {row}"
