"""What touches in a position: how near is touching, and on which side of planes bodies are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.analysis.rest.statics import Statics
from multibody_sym.kinematics.contacts import reach
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.relative import direction
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.model.mechanism.contact_rows import ContactRow, Flat
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import Pose
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.vectors import dot, subtract

TOUCHING: Final = 1e-9
"""The part of the model's size up to which a gap is none."""
_AT_END: Final = 1e-2
"""The part of that up to which what is beyond the end of a face is at it."""


def size_of(motion: Motion) -> float:
    """Return the largest distance of a body's origin from ground's along an axis (m), 1 where there is none."""
    return max((float(np.abs(np.array(p, dtype=float)).max()) for _, p in motion.poses), default=0.0) or 1.0


def out_of_touch(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> frozenset[int] | None:
    """Return the rows of what does not touch; None where something is inside of what it may only touch."""
    near, found = TOUCHING * size_of(motion), set[int]()
    for element, gap in _gaps(statics, rows):
        apart = element.open or gap > near or not reaches(element, motion, near)
        if gap < -near and not apart:
            return None
        if apart:
            found |= {statics.place(row) for row in element.rows}
    return frozenset(found)


def crossed(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> str | None:
    """Return the declared contact, rope or stop at which something is inside of what it may only touch, if any."""
    near = TOUCHING * size_of(motion)
    for element, gap in _gaps(statics, rows):
        if gap < -near and not element.open and reaches(element, motion, near):
            return element.group or element.name
    return None


def _gaps(statics: Statics, rows: Sequence[RowMotion]) -> Iterator[tuple[OneWay, float]]:
    """Yield what may open with its gap."""
    for element in statics.mechanism.one_way:
        if element.unilateral:
            yield element, float(rows[statics.place(element.normals[0])].phi)


def ways_of(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> tuple[Floats, Floats]:
    """Return the gaps (m) of what may open, and how far inside the ends of faces it is."""
    gaps = list(_gaps(statics, rows))
    normals = (element.normals[0] for element, _ in gaps)
    ends = [float(way) for row in normals if isinstance(row, ContactRow) for way in reach(row, motion)]
    return np.array([gap for _, gap in gaps]), np.array(ends)


def reaches(element: OneWay, motion: Motion, near: float) -> bool:
    """Return whether what may touch is above the part of a face that there is; `near` (m) is touching."""
    row = element.normals[0]
    ways = reach(row, motion) if isinstance(row, ContactRow) else []
    return all(float(way) >= -_AT_END * near for way in ways)


def with_planes(mechanism: Mechanism) -> Iterator[tuple[Marker, Flat]]:
    """Yield for each contact with an endless plane the other body's centre of mass, named so, and the plane."""
    for element in mechanism.one_way:
        for row in element.normals:
            if isinstance(row, ContactRow):
                planes = [skin for skin in row.skins if isinstance(skin, Flat) and skin.ends is None]
                others = [skin for skin in row.skins if not isinstance(skin, Flat)]
                if planes and others and others[0].place.body >= 0:
                    body = others[0].place.body
                    yield Marker(element.group or element.name, body, Pose(mechanism.bodies[body].mass.com)), planes[0]


def height(motion: Motion, com: Marker, plane: Flat) -> float:
    """Return how far a centre of mass is from a plane, along its normal (m)."""
    away = subtract(position(motion, com), position(motion, plane.place))
    return float(dot(direction(motion, plane.place, plane.normal), away))
