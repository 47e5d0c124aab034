"""Rolling: the place where a ball or the sharp rim of a disc touches a plane, and the velocity of slip there.

With the plane's normal n, the disc's axis a and g = n - (n . a) a, the rim's lowest point is rho = -r g / |g| from the
centre; a ball's is -r n. The gap is n . (p_C - p_P) + n . rho.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import acceleration, position, velocity
from multibody_sym.kinematics.relative import angular_acceleration, angular_velocity, direction
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Pose
from multibody_sym.model.mechanism.rows import RollingRow
from multibody_sym.model.mechanism.start_constants import TangentAngle
from multibody_sym.scalars.functions import atan2, sqrt
from multibody_sym.scalars.vectors import S, Vec, add, cross, dot, negate, scale, subtract


@dataclass(frozen=True)
class RollingContact:
    """The place of contact, the gap, the velocity of slip of the rolling body on the plane's, and its rate.

    The rate is that for udot = 0; all in world axes.
    """

    place: Vec
    gap: S
    slip: Vec
    slip_rate: Vec


def rolling_contact(row: RollingRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> RollingContact:
    """Return where and how a row's bodies touch; `bias` holds the bodies' accelerations for udot = 0."""
    w, w_P = (angular_velocity(motion, marker.body) for marker in (row.wheel, row.plane))
    alpha, alpha_P = (angular_acceleration(motion, marker.body, bias) for marker in (row.wheel, row.plane))
    normal = direction(motion, row.plane, row.normal)
    arm, arm_rate = _lowest(row, motion, normal, cross(w_P, normal), w)
    from_plane = subtract(position(motion, row.wheel), position(motion, row.plane))
    approach = subtract(velocity(motion, row.wheel), velocity(motion, row.plane))
    to_place, to_place_rate = add(from_plane, arm), add(approach, arm_rate)
    slip = subtract(add(approach, cross(w, arm)), cross(w_P, to_place))
    rate = subtract(acceleration(motion, row.wheel, bias), acceleration(motion, row.plane, bias))
    rate = add(rate, add(cross(alpha, arm), cross(w, arm_rate)))
    rate = subtract(rate, add(cross(alpha_P, to_place), cross(w_P, to_place_rate)))
    return RollingContact(add(position(motion, row.wheel), arm), dot(normal, to_place), slip, rate)


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


def _lowest(row: RollingRow, motion: Motion, normal: Vec, normal_rate: Vec, w: Vec) -> tuple[Vec, Vec]:
    """Return the vector from the centre to the lowest point and its rate."""
    radius = motion.state.values([row.radius])[0]
    if row.axis is None:
        up, up_rate = normal, normal_rate
    else:
        axis = direction(motion, row.wheel, row.axis)
        axis_rate = cross(w, axis)
        tilt, tilt_rate = dot(normal, axis), dot(normal_rate, axis) + dot(normal, axis_rate)
        steep = subtract(normal, scale(tilt, axis))
        steep_rate = subtract(normal_rate, add(scale(tilt_rate, axis), scale(tilt, axis_rate)))
        length = sqrt(dot(steep, steep))
        up = scale(1 / length, steep)
        up_rate = scale(1 / length, subtract(steep_rate, scale(dot(up, steep_rate), up)))
    return scale(radius, negate(up)), scale(radius, negate(up_rate))
