"""Angles on planes that turn: where ground's axes, seen on a plane, lead."""

from __future__ import annotations

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.relative import direction
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Pose
from multibody_sym.model.mechanism.start_constants import TangentAngle
from multibody_sym.scalars.functions import atan2
from multibody_sym.scalars.vectors import S, cross, dot


def tangent_components(motion: Motion, measure: TangentAngle, axis: Point) -> tuple[S, S]:
    """Return the components of an axis of ground along `across` of a plane, and along normal x across."""
    ground = motion.mechanism.body_index(GROUND)
    seen = direction(motion, Marker(GROUND, ground, Pose()), axis)
    along = direction(motion, measure.plane, measure.across)
    return dot(seen, along), dot(seen, cross(direction(motion, measure.plane, measure.normal), along))


def tangent_angle(motion: Motion, measure: TangentAngle, axis: Point) -> S:
    """Return the angle by which an axis of ground, seen on a plane, leads `across` about the normal there."""
    along, ahead = tangent_components(motion, measure, axis)
    return atan2(ahead, along)
