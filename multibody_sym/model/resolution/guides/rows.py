"""Rows of feet: each is where the other end is nearest to its curve."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

from multibody_sym.errors import at
from multibody_sym.model.declaration.constraints import OnCurve, row_names
from multibody_sym.model.declaration.curves.foot import Foot
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.contact_rows import Bent, Flat, Skin
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.rows import AngleRow, PositionRow, Row
from multibody_sym.model.resolution.contacts.skins import solid_of
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.scalars.node import ONE, ZERO, negate
from multibody_sym.scalars.vectors import negate as opposite

_X: Final[Point] = (ONE, ZERO, ZERO)
_Y: Final[Point] = (ZERO, ONE, ZERO)
_Z: Final[Point] = (ZERO, ZERO, ONE)


def footed(owner: str, skins: tuple[Skin, Skin], references: References) -> tuple[Skin, Skin]:
    """Return the skins of a contact, curves with their feet."""
    feet = {joint.end: name for name, joint in feet_of(owner, references).items()}
    first, second = (
        replace(skin, foot=_foot(feet[k], references)) if isinstance(skin, Bent) else skin
        for k, skin in enumerate(skins)
    )
    return first, second


def feet_of(owner: str, references: References) -> Mapping[str, Foot]:
    """Return the joints of the feet of a contact or constraint, by their names."""
    joints = references.system.joints.items()
    return {name: joint for name, joint in joints if isinstance(joint, Foot) and joint.owner == owner}


def _foot(joint: str, references: References) -> Marker:
    return references.marker(references.system.joints[joint].child)


def foot_rows(references: References) -> Iterator[Row]:
    """Yield the rows of all feet that touch: across the way to the other end, or along a plane."""
    owners = {joint.owner: joint for joint in references.system.joints.values() if isinstance(joint, Foot)}
    for owner, joint in owners.items():
        if isinstance(references.system.constraints.get(owner), OnCurve):
            continue
        solids = (solid_of(end, references, flat=True) for end in joint.between)
        first, second = (solid.skins[0][1] for solid in solids)
        yield from _rows(owner, footed(owner, (first, second), references), references)


def _rows(owner: str, skins: tuple[Skin, Skin], references: References) -> Iterator[Row]:
    names = list(feet_of(owner, references))
    bent = [skin for skin in skins if isinstance(skin, Bent)]
    if len(bent) == 2:
        first, second = bent
        facing = _turned(first.foot, _Y if first.left != second.left else opposite(_Y))
        yield AngleRow(f"{names[0]}.t", (facing, second.foot), (_Y, _X), shared=_Y)
        yield PositionRow(f"{names[1]}.t", (second.foot, first.foot), _X)
        return
    other = next(skin for skin in skins if not isinstance(skin, Bent))
    if isinstance(other, Flat):
        facing = _turned(other.place, opposite(other.normal) if bent[0].left else other.normal)
        yield AngleRow(f"{names[0]}.t", (facing, bent[0].foot), (_Y, _X), shared=_Y)
    else:
        yield PositionRow(f"{names[0]}.t", (bent[0].foot, other.place), _X)


def _turned(marker: Marker, normal: Point) -> Marker:
    """Return a frame at a marker of which y is a unit vector of the marker's axes, in the plane.

    What faces a curve does so from one side: of two places where the tangent is along it, the one where y is y.
    """
    x, y, _ = normal
    rotation = ((y, x, ZERO), (negate(x), y, ZERO), _Z)
    return replace(marker, pose=replace(marker.pose, rotation=rotation))


def rows_on_curve(name: str, element: OnCurve, references: References) -> list[Row]:
    """Return the rows that keep a point where its foot on the curve is, along the axes of what carries that."""
    with at("point"):
        point = references.marker(element.point)
    (joint,) = feet_of(name, references)
    rows = zip(row_names(name, element), (_X, _Y, _Z), strict=True)
    made: list[Row] = [PositionRow(row, (_foot(joint, references), point), axis) for row, axis in rows]
    return made[:2] if in_plane(references.system) else made
