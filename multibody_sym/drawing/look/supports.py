"""Supports: what stands on ground: triangles and stems that end on hatched lines, on the side where nothing is held."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.drawing.picture import Hatch, Mark, Stroke
from multibody_sym.drawing.style import BOLD, LAYER_GROUND, PAPER, SUPPORT
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Face
from multibody_sym.scene.items import Item

_STEP: Final = 46.0
"""How long a step of ground is drawn (pt)."""


def support(sheet: Sheet, item: Any, at: Floats, away: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a triangle on hatched ground under a place, for an item or a strand."""
    across, foot, pen = left(away), at + SUPPORT * away, sheet.pen(item)
    corners = np.array([at, foot + 0.6 * SUPPORT * across, foot - 0.6 * SUPPORT * across])
    yield Stroke(corners, pen, closed=True, fill=PAPER, **named)
    ends = np.array([foot - SUPPORT * across, foot + SUPPORT * across])
    yield Hatch(ends, pen, side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)


def support_side(sheet: Sheet, item: Item, at: Floats) -> Floats:
    """Return the direction in which a support stands: down, or up where what it carries hangs."""
    hanging = 0.0
    for body in item.bodies:
        if body < 0:
            continue
        for other in sheet.touched.get(body, ()):
            points = sheet.projection.page(sheet.home.world(body, other.form.bounds)) - at
            hanging += float((points @ sheet.down).mean())
    return -sheet.down if hanging > 6.0 else sheet.down


def stand(sheet: Sheet, item: Item, at: Floats, away: Floats, length: float) -> Iterator[Mark]:
    """Yield a short stem that ends on hatched ground."""
    named, across, foot = sheet.named(item, LAYER_GROUND + 0.5), left(away), at + length * away
    yield Stroke(np.array([at, foot]), sheet.pen(item, BOLD), **named)
    ends = np.array([foot - 8.0 * across, foot + 8.0 * across])
    yield Hatch(ends, sheet.pen(item), side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)


def step_marks(sheet: Sheet, item: Item, at: Floats) -> Iterator[Mark]:
    """Yield the step from a plane of ground up to a point of ground that a body touches, such as a kerb."""
    if not sheet.flat or item.body not in sheet.ground:
        return
    for contact in (i for i in sheet.scene.items if i.role == "contact" and item.name in i.touching):
        other = next((body for body in contact.bodies if body not in sheet.ground), None)
        for face in (i for i in sheet.scene.items if isinstance(i.form, Face) and i.body == item.body):
            if other is None or not isinstance(face.form, Face):
                continue
            normal = unit2(sheet.way(face.body, face.form.normal))
            height = float((at - sheet.at(face.body, face.form.through)) @ normal)
            away = left(normal) * (1.0 if float((at - sheet.at(other, (0.0, 0.0, 0.0))) @ left(normal)) > 0.0 else -1.0)
            if height > 1.0:
                points = np.array([at - height * normal, at, at + _STEP * away])
                inside = float(left(points[1] - points[0]) @ away) > 0.0
                named = sheet.named(item, LAYER_GROUND)
                yield Hatch(points, sheet.pen(item, BOLD), side=1 if inside else -1, **named)
                return
