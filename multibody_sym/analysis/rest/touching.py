"""What touches in a position: how near is touching, and on which side of planes bodies are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.analysis.rest.statics import Statics
from multibody_sym.dynamics.laws.assemble import OneWayRows, Scale
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
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import dot, subtract

_AT_END: Final = 1e-2
"""The part of a gap that is none up to which what is beyond the end of a face is at it."""


def size_of(motion: Motion) -> float:
    """Return the largest distance of a body's origin from ground's along an axis (m), 1 where there is none."""
    return max((float(np.abs(np.array(p, dtype=float)).max()) for _, p in motion.poses), default=0.0) or 1.0


def out_of_touch(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> frozenset[int] | None:
    """Return the rows of what does not touch; None where something is inside of what it may only touch."""
    standing = list(stands(statics, motion, rows))
    if any(how == "inside" for _, how in standing):
        return None
    return frozenset(statics.place(row) for element, how in standing if how == "open" for row in element.rows)


def crossed(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> str | None:
    """Return the declared contact, rope or stop at which something is inside of what it may only touch, if any."""
    return next((x.group or x.name for x, how in stands(statics, motion, rows) if how == "inside"), None)


@dataclass(frozen=True, eq=False)
class _AtRest(OneWayRows):
    """The rows in a position at rest, where the ends of faces are told more sharply."""

    def past_end(self, element: OneWay) -> float:
        return _AT_END * self.allowed_gap(element)


def stands(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> Iterator[tuple[OneWay, str]]:
    """Yield what may open, and how it stands in a position at rest."""
    there = _AtRest(statics.numbered, Scale(size_of(motion), 0.0), motion, tuple(rows))
    yield from ((x, "open" if x.open else there.standing(x)) for x in statics.mechanism.one_way if x.unilateral)


def ways_of(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> tuple[Floats, Floats]:
    """Return the gaps (m) of what may open, and how far inside the ends of faces it is."""
    normals = [element.normals[0] for element in statics.mechanism.one_way if element.unilateral]
    ends = [float(way) for row in normals if isinstance(row, ContactRow) for way in reach(row, motion)]
    return np.array([float(rows[statics.place(row)].phi) for row in normals]), np.array(ends)


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
