"""Arrows: gravity beside the figure, forces at their points, torques as bows around them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.lettering import letters
from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.drawing.picture import Arrow, Mark, Wish
from multibody_sym.drawing.style import FORCE, LAYER_ARROW, LAYER_TEXT, REACTION, THIN
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scene.forms import across, unit
from multibody_sym.scene.items import ArrowItem

_FORCE: Final = 34.0
_TORQUE: Final = 15.0
_GRAVITY: Final = 30.0
_BESIDE: Final = 6.0
"""How far arrows of the same place and way are apart (pt)."""
_SAME_WAY: Final = 0.98


def arrow_marks(sheet: Sheet, corner: Floats) -> Iterator[Mark]:
    """Yield all arrows of a scene with their letters; gravity stands beside the `corner` of what is drawn."""
    taken = _Taken()
    for item, vector in zip(sheet.scene.arrows, sheet.placed.vectors, strict=True):
        named = {"role": item.role, "name": item.name, "layer": LAYER_ARROW}
        at = sheet.at(item.at.body, item.at.point)
        if item.role == "gravity":
            yield from _gravity(sheet, item, vector, named, corner)
        elif item.role in ("torque", "couple"):
            pen = REACTION if item.role == "couple" else FORCE
            yield from torque_marks(sheet, at, vector, item.label, named, pen, taken.radius(at))
        elif item.role != "drag":
            pen = REACTION if item.role == "reaction" else FORCE
            at = at + taken.aside(at, sheet.projection.page(vector))
            yield from force_marks(sheet, at, vector, item.label, named, pen)


@dataclass
class _Taken:
    """Where arrows are: one that would lie on another stands beside it, a bow about another."""

    forces: list[tuple[Floats, Floats]] = field(default_factory=list)
    torques: list[Floats] = field(default_factory=list)

    def aside(self, at: Floats, way: Floats) -> Floats:
        """Return how far (2) a force that starts at a place moves across its way."""
        along = unit2(way)
        same = [1 for other, ahead in self.forces if _near(at, other) and float(along @ ahead) > _SAME_WAY]
        self.forces.append((at, along))
        side = (len(same) + 1) // 2 * (1 if len(same) % 2 else -1)
        found: Floats = _BESIDE * side * left(along)
        return found

    def radius(self, at: Floats) -> float:
        """Return the radius of the bow of a torque about a place."""
        same = sum(_near(at, other) for other in self.torques)
        self.torques.append(at)
        return _TORQUE + _BESIDE * same


def _near(a: Floats, b: Floats) -> bool:
    return float(np.linalg.norm(a - b)) < 2.0


def _gravity(
    sheet: Sheet, item: ArrowItem, vector: Floats, named: dict[str, Any], corner: Floats
) -> Iterator[Mark]:
    way = sheet.projection.page(vector)
    size = float(np.linalg.norm(way)) / sheet.projection.scale
    if size < 0.05 * float(np.linalg.norm(vector)):
        return
    top = corner + np.array([30.0, 0.0])
    points = np.array([top, top + _GRAVITY * unit2(way)])
    yield Arrow(points, THIN, **named)
    yield Wish(points.mean(axis=0)[None, :], letters(item.label), prefer=(1.0, 0.0), **{**named, "layer": LAYER_TEXT})


def force_marks(
    sheet: Sheet, at: Floats, vector: Floats, label: str, named: dict[str, Any], pen: Any = FORCE
) -> Iterator[Mark]:
    """Yield a force at a place of the page: from there along its direction."""
    way = sheet.projection.page(vector) / sheet.projection.scale
    size = float(np.linalg.norm(vector))
    if size == 0.0 or float(np.linalg.norm(way)) < 0.05 * size:
        return
    points = np.array([at, at + _FORCE * unit2(way) * max(0.4, float(np.linalg.norm(way)) / size)])
    yield Arrow(points, pen, **named)
    side = left(unit2(way))
    prefer = (float(side[0]), float(side[1]))
    yield Wish(points[1:], letters(label), prefer=prefer, colour=pen.colour, **{**named, "layer": LAYER_TEXT})


def torque_marks(
    sheet: Sheet, at: Floats, vector: Floats, label: str, named: dict[str, Any], pen: Any = FORCE,
    radius: float = _TORQUE,
) -> Iterator[Mark]:  # fmt: skip
    """Yield a torque about a place of the page: most of a circle around its axis, as it turns."""
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        return
    axis = np.array(unit(vector))
    e1 = np.array(across(axis))
    e2 = np.cross(axis, e1)
    angles = np.linspace(-0.5, 4.0, 36)[:, None]
    rim = np.cos(angles) * e1 + np.sin(angles) * e2
    points = at + radius * sheet.projection.page(rim) / sheet.projection.scale
    yield Arrow(points, pen, head=5.0, **named)
    yield Wish(points, letters(label), colour=pen.colour, **{**named, "layer": LAYER_TEXT})
