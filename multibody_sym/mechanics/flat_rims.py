"""Rims of discs on planes: how steep they stand, and which lie flat, where they touch all around, in no one place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import hypot
from typing import Final

from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import UnitVector, angular_velocity, direction
from multibody_sym.mechanics.row_records import PlaneSurface, Rim, Row
from multibody_sym.scalars.functions import minimum
from multibody_sym.scalars.vectors import S, cross, dot

_PARALLEL: Final = 1e-6
"""The angle (rad) up to which a rim lies flat: there rounding of the axis makes the direction to its lowest point."""
_NEARLY: Final = 1e-3
"""The angle (rad) up to which a rim that does not come flatter may lie flat."""
ON_POINTS: Final = "name points of it (points: {p1: [r, 0, 0], ..}, three or more, and contacts with repeat)"
"""How a body stands on a rim that lies flat."""


def steepness(row: Row, motion: Motion) -> float | None:
    """Return the sine of the angle between a rim and the plane of its contact; None of what has no rim."""
    return None if row.rim is None else hypot(*_across(row, motion).vector)


def flattened(row: Row, motion: Motion) -> S:
    """Return what becomes positive where a rim has come as near to lying flat as it does, if that is near."""
    across = _across(row, motion)
    return minimum(_NEARLY * _NEARLY - dot(across.vector, across.vector), dot(across.vector, across.rate))


def _across(row: Row, motion: Motion) -> UnitVector:
    """Return the axis of a rim x the normal of its plane, with its rate."""
    rim, face = _rim_and_face(row)
    axis, normal = direction(motion, rim.place, rim.axis), direction(motion, face.place, face.normal)
    turning = (angular_velocity(motion, skin.place.body) for skin in (rim, face))
    first, second = (UnitVector(x, cross(w, x)) for x, w in zip((axis, normal), turning, strict=True))
    return first.cross(second)


def _rim_and_face(row: Row) -> tuple[Rim, PlaneSurface]:
    rim, face = sorted(row.surfaces or (), key=lambda skin: isinstance(skin, PlaneSurface))
    assert isinstance(rim, Rim)
    assert isinstance(face, PlaneSurface)
    return rim, face


def flat_rims(rows: Iterable[Row], motion: Motion) -> Iterator[str]:
    """Yield which rims lie flat on the planes of their contacts, in words, at a state in floats."""
    for row in rows:
        if row.rim is None or not row.is_holonomic:
            continue
        if hypot(*_across(row, motion).vector) <= _PARALLEL:
            rim, face = (skin.place.name for skin in _rim_and_face(row))
            yield f"the rim of {rim} lies flat on {face} and touches all around, in no one place"
