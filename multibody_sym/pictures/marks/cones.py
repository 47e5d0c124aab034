"""Cones of friction: within them lies the force of a contact that sticks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan
from typing import Final

import numpy as np

from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.picture import HIDDEN, THIN, Arc, Mark, Stroke
from multibody_sym.pictures.scene.items import Anchor, Vector
from multibody_sym.records import dataclass

_LENGTH, _RADIUS = 58.0, 24.0
"""Points of its sides, and of the arc between them."""
_FLAT: Final = 0.1
"""A normal that is shorter on the page looks at the reader, and its cone is left out."""


@dataclass(frozen=True)
class FrictionCone:
    """The cone of a contact at a place of a body, about the `normal` (body axes) into it, of half angle atan(mu)."""

    name: str
    at: Anchor
    normal: Vector
    coefficient: float


def cone_marks(sheet: Sheet, cones: Sequence[FrictionCone]) -> Iterator[Mark]:
    """Yield the two sides of each cone, and an arc between them."""
    for cone in cones:
        at, way = sheet.at(cone.at.body, cone.at.point), sheet.way(cone.at.body, cone.normal)
        if np.linalg.norm(way) < _FLAT or not sheet.flat:
            continue
        middle, half = float(np.arctan2(way[1], way[0])), atan(cone.coefficient)
        for angle in (middle - half, middle + half):
            side = at + _LENGTH * np.array([np.cos(angle), np.sin(angle)])
            yield Stroke(np.array([at, side]), HIDDEN, role="friction cone", name=cone.name)
        yield Arc(at, _RADIUS, THIN, middle - half, middle + half, role="friction cone", name=cone.name)
