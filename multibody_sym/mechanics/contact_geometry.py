"""Where do two surfaces touch: gap, normal, place, and the velocity of one body's material on the other's there?

Also how far inside the ends of faces and bars that is, how discs fit to curves, and which rims lie flat. In: rows of
contacts, or two surfaces, and a motion. Out: vectors in world axes and gaps, over any scalar.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import singledispatch
from math import hypot, inf
from typing import Final

import numpy as np

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import (
    UnitVector,
    acceleration,
    angular_acceleration,
    angular_velocity,
    direction,
    position,
    separation,
    velocity,
)
from multibody_sym.mechanics.row_records import (
    LOCAL,
    Bent,
    BodyFace,
    ContactRow,
    ContactSurface,
    Edge,
    Level,
    Marker,
    PlaneSurface,
    Rim,
    RoundSurface,
    Row,
    plane_of,
)
from multibody_sym.model.bodies import IDENTITY
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import absolute, is_exactly, maximum, minimum, sign, sqrt, where
from multibody_sym.scalars.functions import apply as operation
from multibody_sym.scalars.node import ONE, ZERO, Node, negate
from multibody_sym.scalars.vectors import S, Vec, add, apply, combination, cross, dot, scale, subtract, symmetric
from multibody_sym.scalars.vectors import negate as opposite

# ----------------------------------------------------------------------------------------------------------------------
# Curves that are touched, by the foot that follows each.

_LEFT: Final[Point] = (ZERO, ONE, ZERO)
_RIGHT: Final[Point] = (ZERO, negate(ONE), ZERO)


def to_foot(skin: Bent, motion: Motion) -> tuple[Vec, Vec]:
    """Return the way from a curve's place to its foot, and its rate (world axes)."""
    arm = subtract(position(motion, skin.foot), position(motion, skin.place))
    return arm, subtract(velocity(motion, skin.foot), velocity(motion, skin.place))


@dataclass(frozen=True)
class Fit:
    """How a disc fits to a curve where it touches, or an outline into a hollow disc.

    `ratio` is the radius of curvature of the inner one by that of the outer one: 1 at the limit.
    """

    row: ContactRow
    place: Floats
    radius: float
    ratio: float
    hollow: bool

    @property
    def text(self) -> str:
        """The error: which does not fit into which, and where."""
        wheel, curve = sorted(self.row.skins, key=lambda skin: isinstance(skin, Bent))
        x, y, _ = self.place
        round_one, bend = f"{wheel.place.name} (radius {self.radius:.6g} m)", self.radius / self.ratio
        inner, outer, whose = round_one, curve.place.name, "the"
        if self.hollow:
            inner, outer, whose, bend = outer, inner, "its", self.radius * self.ratio
        return (
            f"{inner} does not fit into {outer} at ({x:.6g}, {y:.6g}) m, where {whose} radius of curvature is "
            f"{bend:.6g} m: it would touch in two places"
        )

    @property
    def advice(self) -> str:
        return f"make the radius {'larger' if self.hollow else 'smaller'}"


def fits(motion: Motion, rows: Iterable[Row]) -> Iterator[Fit]:
    """Yield how each ball or disc fits to its curve, at a state in floats."""
    for row in rows:
        if not isinstance(row, ContactRow) or row.along != "normal":
            continue
        wheel, bent = sorted(row.skins, key=lambda skin: isinstance(skin, Bent))
        if isinstance(bent, Bent) and isinstance(wheel, RoundSurface):
            place = np.array(position(motion, bent.foot), dtype=float)
            (radius,) = map(float, motion.state.values([wheel.radius]))
            body = motion.mechanism.bodies[bent.foot.body]
            step, known = body.steps[0].curve, motion.state.q[body.q[0]]
            assert step is not None
            turning, *way = motion.state.values((*step.turning.s, *step.rates.s), {step.leaf: known})
            curvature = float(turning / hypot(*way)) * (1.0 if bent.left else -1.0)  # towards what touches the curve
            bends = radius * curvature
            ratio = bends if not wheel.inside else -1.0 / bends if bends < 0.0 else inf
            yield Fit(row, place, radius, ratio, wheel.inside)


# ----------------------------------------------------------------------------------------------------------------------
# Contacts: gap, normal, place, and the velocity of one body's material on the other's where their surfaces are nearest.
#
# A surface with a centre C (a ball, a point, the rim of a disc) faces another one: n leads from that one to C, h is how
# far C is above it along n, and k leads from C to the place of contact, which lies on the round skin. Then
#
#     gap = h + n . k,    slip = v_1 + w_1 x k - v_2 - w_2 x (d + k),    d = C - (what stands for the other skin)
#
# and n . slip is the rate of the gap, because k' . n and d' - n' h contribute nothing along n. Of two segments that
# cross n is normal to both, C an end of the first and k leads from there to where it crosses the second.


_PARALLEL: Final = 1e-12
"""The square of an angle (rad) up to which a normal is along an axis."""
_LIES_FLAT: Final = 1e-6
"""The angle (rad) up to which a rim lies flat: there rounding of the axis makes the direction to its lowest point."""
_NEARLY_FLAT: Final = 1e-3
"""The angle (rad) up to which a rim that does not come flatter may lie flat."""
ON_POINTS: Final = "name points of it (points: {p1: [r, 0, 0], ..}, three or more, and contacts with repeat)"
"""How a body stands on a rim that lies flat."""
_PARALLEL_LINES: Final = 1e-18
"""The same for two lines that cross: up to it rounding moves the place where they touch."""
AT_END: Final = 1e-10
"""The part of the length of a face by which a corner may be beyond its end if its body is not, ..."""
PAST_END: Final = 1e-8
"""... and by which it has to be inside if its body is beyond: more than the gap that counts as touching."""
_ALLOWED: Final = 0.25
"""The part of that by which anything may be beyond an end, however large the model is beside the face."""
_CONTACTS_Z: Vec = (0, 0, 1)


@dataclass(frozen=True)
class Touch:
    """Where two skins are nearest: the gap, the normal from the second to the first, and the slip of the first there.

    `slip_rate` is for udot = 0, `turning` the first body's angular velocity relative to the second, `turning_rate` its
    rate; all in world axes.
    """

    place: Vec
    gap: S
    normal: UnitVector
    slip: Vec
    slip_rate: Vec
    turning: Vec
    turning_rate: Vec


@dataclass(frozen=True)
class _Facing:
    """The normal of a surface towards a centre, and how far the centre is along it."""

    normal: UnitVector
    height: S


@dataclass(frozen=True)
class _Met:
    """A surface with a centre that is `apart` from the place of another one: how that faces it, its arm, the gap."""

    apart: Vec
    apart_rate: Vec
    facing: _Facing
    arm: Vec
    arm_rate: Vec
    gap: S


def gap(skins: tuple[ContactSurface, ContactSurface], motion: Motion) -> S:
    """Return the gap between two skins alone."""
    return _met(skins[::-1] if _contacts_faces(*skins) else skins, motion).gap


def touch(skins: tuple[ContactSurface, ContactSurface], motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> Touch:
    """Return where and how two skins touch; `bias` holds the bodies' accelerations for udot = 0."""
    if _contacts_faces(*skins):
        found = _centre_on((skins[1], skins[0]), motion, bias)
        return replace(
            found,
            normal=found.normal.reversed,
            slip=opposite(found.slip),
            slip_rate=opposite(found.slip_rate),
            turning=opposite(found.turning),
            turning_rate=opposite(found.turning_rate),
        )
    return _centre_on(skins, motion, bias)


def _contacts_faces(first: ContactSurface, second: ContactSurface) -> bool:
    """Return whether the first of two skins faces the second, which has the centre."""
    if isinstance(first, (Edge, Bent)):
        return isinstance(second, RoundSurface)
    return first.plane is not None or isinstance(first, Level)


def _centre_on(skins: tuple[ContactSurface, ContactSurface], motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> Touch:
    """Return how a first surface touches that has a centre, or is a segment that crosses another."""
    first, second = skins
    w, w_2 = (angular_velocity(motion, skin.place.body) for skin in skins)
    alpha, alpha_2 = (angular_acceleration(motion, skin.place.body, bias) for skin in skins)
    met = _met(skins, motion)
    apart, apart_rate, facing, arm, arm_rate = met.apart, met.apart_rate, met.facing, met.arm, met.arm_rate
    to_place, to_place_rate = add(apart, arm), add(apart_rate, arm_rate)
    slip = subtract(add(apart_rate, cross(w, arm)), cross(w_2, to_place))
    rate = subtract(acceleration(motion, first.place, bias), acceleration(motion, second.place, bias))
    rate = add(rate, add(cross(alpha, arm), cross(w, arm_rate)))
    rate = subtract(rate, add(cross(alpha_2, to_place), cross(w_2, to_place_rate)))
    return Touch(
        add(position(motion, first.place), arm),
        met.gap,
        facing.normal,
        slip,
        rate,
        subtract(w, w_2),
        subtract(alpha, alpha_2),
    )


def _met(skins: tuple[ContactSurface, ContactSurface], motion: Motion) -> _Met:
    first, second = skins
    apart = subtract(position(motion, first.place), position(motion, second.place))
    apart_rate = subtract(velocity(motion, first.place), velocity(motion, second.place))
    if isinstance(first, Edge) and isinstance(second, Edge):
        crossing = _closest_points(first, second, motion, apart, apart_rate)
        facing, arm, arm_rate = crossing.facing, crossing.arm, crossing.arm_rate
    else:
        facing = _face_centre(second, motion, apart, apart_rate, isinstance(first, RoundSurface) and first.inside)
        arm, arm_rate = _arm(first, motion, facing.normal)
    along = -_radius(first, motion) if isinstance(first, RoundSurface) else dot(facing.normal.vector, arm)
    return _Met(apart, apart_rate, facing, arm, arm_rate, facing.height + along)


@singledispatch
def _face_centre(skin: ContactSurface, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """Return how a surface faces a centre that is `apart` from its place; `hollow`: what is round that centre."""
    raise TypeError(f"nothing says how {type(skin).__name__} is touched")


@_face_centre.register
def _(skin: PlaneSurface, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    n = direction(motion, skin.place, skin.normal)
    return _Facing(UnitVector(n, cross(angular_velocity(motion, skin.place.body), n)), dot(n, apart))


@_face_centre.register
def _(skin: RoundSurface, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """If one is in the other, the normal leads from centre to centre the other way, along x where both are one place.

    There each direction is as near as any other, and the sign of the gap is right.
    """
    sense = -1 if skin.inside or hollow else 1
    length = sqrt(dot(apart, apart))
    if is_exactly(length, 0):
        return _Facing(UnitVector((1, 0, 0), (0, 0, 0)), -_radius(skin, motion))
    n = scale(sense / length, apart)
    across = subtract(apart_rate, scale(dot(n, apart_rate), n))
    return _Facing(UnitVector(n, scale(sense / length, across)), sense * length - _radius(skin, motion))


@_face_centre.register
def _(skin: Level, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """The height F/|grad F| is the distance near the surface, and its rate along n there."""
    w = angular_velocity(motion, skin.place.body)
    axes = [direction(motion, skin.place, axis) for axis in IDENTITY]
    carried = subtract(apart_rate, cross(w, apart))
    local = [dot(axis, apart) for axis in axes]
    known = dict(zip(LOCAL, local, strict=True))
    function, gx, gy, gz, *second = motion.state.values([skin.function, *skin.gradient, *skin.second], known)
    size = sqrt(gx * gx + gy * gy + gz * gz)
    n = scale(1 / size, (gx, gy, gz))
    bending = apply(symmetric(second), [dot(axis, carried) for axis in axes])
    turning = scale(1 / size, subtract(bending, scale(dot(n, bending), n)))
    normal = combination(axes, n)
    return _Facing(UnitVector(normal, add(cross(w, normal), combination(axes, turning))), function / size)


@_face_centre.register
def _(skin: Edge, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """From the foot on the segment's line to the centre; along x where that is on the line, as of balls."""
    along, _ = _course(skin, motion)
    away = subtract(apart, scale(dot(along.vector, apart), along.vector))
    length = sqrt(dot(away, away))
    if is_exactly(length, 0):
        return _Facing(UnitVector((1, 0, 0), (0, 0, 0)), length)
    before, after = dot(along.rate, apart) + dot(along.vector, apart_rate), dot(along.vector, apart)
    away_rate = subtract(apart_rate, add(scale(before, along.vector), scale(after, along.rate)))
    n = scale(1 / length, away)
    return _Facing(UnitVector(n, scale(1 / length, subtract(away_rate, scale(dot(n, away_rate), n)))), length)


@_face_centre.register
def _(skin: Bent, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """Where the foot is right below the centre, as its row says, the height over its tangent is the distance."""
    n = direction(motion, skin.foot, _LEFT if skin.left else _RIGHT)
    rate = cross(angular_velocity(motion, skin.foot.body), n)
    return _Facing(UnitVector(n, rate), dot(n, subtract(apart, to_foot(skin, motion)[0])))


@singledispatch
def _arm(skin: ContactSurface, motion: Motion, normal: UnitVector) -> tuple[Vec, Vec]:
    """Return the vector from a skin's centre to its place that is nearest against the normal, and its rate."""
    raise TypeError(f"nothing says where {type(skin).__name__} is nearest")


@_arm.register
def _(skin: RoundSurface, motion: Motion, normal: UnitVector) -> tuple[Vec, Vec]:
    radius = _radius(skin, motion)
    return scale(-radius, normal.vector), scale(-radius, normal.rate)


@_arm.register
def _(skin: Rim, motion: Motion, normal: UnitVector) -> tuple[Vec, Vec]:
    """With the axis a and g = a x (n x a), of the size |n x a|, it is -r g / |g|; the centre where n x a is zero.

    g is across a to the last digit, so that its direction, which rounding makes where the rim lies flat, is in the rim.
    """
    (radius,) = motion.state.values([skin.radius])
    a = direction(motion, skin.place, skin.axis)
    axis = UnitVector(a, cross(angular_velocity(motion, skin.place.body), a))
    across = normal.cross(axis)
    steep, square = axis.cross(across), dot(across.vector, across.vector)
    if is_exactly(square, 0) or not skin.rolls:
        square = where(operation("less", 0, square), square, 1)
    length = sqrt(square)
    up = scale(1 / length, steep.vector)
    up_rate = scale(1 / length, subtract(steep.rate, scale(dot(up, steep.rate), up)))
    return scale(-radius, up), scale(-radius, up_rate)


@_arm.register
def _(skin: Bent, motion: Motion, normal: UnitVector) -> tuple[Vec, Vec]:
    """The foot is where the tangent is across the normal, as its row says."""
    return to_foot(skin, motion)


def _course(skin: Edge, motion: Motion) -> tuple[UnitVector, S]:
    whole = subtract(position(motion, skin.tip), position(motion, skin.place))
    length = sqrt(dot(whole, whole))
    if is_exactly(length, 0):
        raise ModelError(f"{skin.place.name} leads from a place to the same place; give it two ends")
    along = scale(1 / length, whole)
    return UnitVector(along, cross(angular_velocity(motion, skin.place.body), along)), length


@dataclass(frozen=True)
class _Crossing:
    """Where the lines of two segments are nearest: the normal and the gap; `on_first` and `on_second` how far from
    their places that is (m), `arm` the way there along the first."""

    facing: _Facing
    on_first: S
    on_second: S
    arm: Vec
    arm_rate: Vec


def _closest_points(first: Edge, second: Edge, motion: Motion, apart: Vec, apart_rate: Vec) -> _Crossing:
    """With c = d1 . d2 and w = `apart` the first is nearest at (c d2 . w - d1 . w) / (1 - c^2) along d1."""
    d1, d2 = _course(first, motion)[0], _course(second, motion)[0]
    c, c_rate = _product(d1, d2)
    on_1, on_1_rate = _product(d1, UnitVector(apart, apart_rate))
    on_2, on_2_rate = _product(d2, UnitVector(apart, apart_rate))
    across = d1.cross(d2)
    steep = dot(across.vector, across.vector)
    if is_exactly(steep, 0) or (isinstance(steep, float) and steep <= _PARALLEL_LINES):
        raise ModelError(
            f"{first.place.name} and {second.place.name} are parallel, and where they touch has no one place: turn one "
            "of them a little, or declare what touches as points on a plane"
        )
    steep_rate = 2 * dot(across.vector, across.rate)
    way = (c * on_2 - on_1) / steep
    way_rate = (c_rate * on_2 + c * on_2_rate - on_1_rate - way * steep_rate) / steep
    length = _side(first, second, motion, across.vector) * sqrt(steep)
    n = scale(1 / length, across.vector)
    across_rate = scale(1 / length, across.rate)
    normal = UnitVector(n, subtract(across_rate, scale(dot(n, across_rate), n)))
    arm_rate = add(scale(way_rate, d1.vector), scale(way, d1.rate))
    facing = _Facing(normal, dot(n, apart))
    return _Crossing(facing, way, (on_2 - c * on_1) / steep, scale(way, d1.vector), arm_rate)


def _product(a: UnitVector, b: UnitVector) -> tuple[S, S]:
    return dot(a.vector, b.vector), dot(a.rate, b.vector) + dot(a.vector, b.rate)


def _side(first: Edge, second: Edge, motion: Motion, across: Vec) -> S:
    """Return 1 where d1 x d2 leads from the second to the first, -1 where it leads back, as one of them faces."""
    told, sense = (second, 1) if second.facing is not None else (first, -1)
    assert told.facing is not None
    towards = sign(dot(across, direction(motion, told.place, told.facing)))
    if is_exactly(towards, 0):
        raise ModelError(
            f"{told.place.name} faces along a line that crosses it, so that nothing says on which side of it the other "
            "one lies; give it a normal across both (surfaces: {..: {segment: .., normal: ..}}; without one it is z)"
        )
    return sense * towards


def _radius(skin: RoundSurface, motion: Motion) -> S:
    (radius,) = motion.state.values([skin.radius])
    return -radius if skin.inside else radius


def contact_direction(row: ContactRow, motion: Motion, touching: Touch) -> UnitVector:
    """Return the direction of a row: the normal, a tangent, or the axis of rolling along a tangent, normal x t."""
    if row.along == "normal":
        return touching.normal
    first = _first_tangent(row, motion, touching.normal)
    turned = touching.normal.cross(first)
    if row.along in ("t1", "roll2"):
        return first if row.along == "t1" else first.reversed
    return turned


def _first_tangent(row: ContactRow, motion: Motion, normal: UnitVector) -> UnitVector:
    if row.across is not None:
        plane = next(skin.place for skin in row.skins if skin.plane is not None)
        t = direction(motion, plane, row.across)
        return UnitVector(t, cross(angular_velocity(motion, plane.body), t))
    if row.upright:
        return UnitVector(cross(normal.vector, _CONTACTS_Z), cross(normal.rate, _CONTACTS_Z))
    # Tangents follow ground's x, or y where x is normal to the surface. On the way from one to the other components of
    # friction change their names; the force does not.
    steep = normal.vector[1] * normal.vector[1] + normal.vector[2] * normal.vector[2]
    along_y = where(operation("less", steep, _PARALLEL), 1, 0)
    seen = 1 - along_y, along_y, 0
    inclined = dot(normal.vector, seen)
    lying = subtract(seen, scale(inclined, normal.vector))
    rate = opposite(add(scale(dot(normal.rate, seen), normal.vector), scale(inclined, normal.rate)))
    length = sqrt(dot(lying, lying))
    t = scale(1 / length, lying)
    return UnitVector(t, scale(1 / length, subtract(rate, scale(dot(t, rate), t))))


def reach(row: Row, motion: Motion) -> list[S]:
    """Return functions that are >= 0 where a contact with a face that ends may hold.

    What is round is above the face, from end to end. A corner at the very end is there if its body is: a body beyond
    the end slides along the face that begins there. The body whose corner touches is above the face; a point is nearer
    to it than to the faces beside it, of which those do not count that this body is not above, as its corners do not
    touch them anywhere. Points meet where they are at one place, and nowhere else.
    """
    if not isinstance(row, ContactRow):
        return []
    if any(isinstance(skin, Edge) for skin in row.skins):
        return _reach_along(row.skins, motion)
    if row.tip is not None:
        away, _ = separation(motion, *(skin.place for skin in row.skins))
        return [-sqrt(dot(away, away))]
    face = plane_of(row.skins)
    if face is None:
        return []
    other = row.skins[0] if row.skins[1] is face else row.skins[1]
    found = _nearest(face, other, row.inner, motion)
    if face.ends is not None:
        p, q = face.ends
        along = subtract(position(motion, q), position(motion, p))
        length = sqrt(dot(along, along))
        for end, inward in ((p, along), (q, opposite(along))):
            way = _way(inward, length, end, other.place, motion)
            if row.inner is not None:
                found.append(way + AT_END * length)
                way = maximum(way - PAST_END * length, _way(inward, length, end, row.inner, motion))
            found.append(way + AT_END * length if face.at_end else way)
    if row.inner is not None:
        found.append(_height(BodyFace(face.place, face.normal), motion, row.inner))
    return found


def allowed_past_end(row: Row, motion: Motion) -> list[S]:
    """Return how far (m) beyond each end of a face a body that touches it may be; empty where no body ends there."""
    face = plane_of(row.surfaces or ())
    if face is None or not isinstance(row, ContactRow) or row.inner is None or row.tip is not None:
        return []
    sizes = [_depth(face, beside) for beside in face.beside if face.ends is None]
    if face.ends is not None:
        along = subtract(*(end.pose.position for end in face.ends))
        sizes.append(sqrt(dot(along, along)))
    return [_ALLOWED * PAST_END * absolute(size) for size in motion.state.values(sizes)]


def _depth(face: PlaneSurface, beside: BodyFace) -> Node:
    depth: Node = dot(beside.normal, subtract(beside.place.pose.position, face.place.pose.position))
    return depth


def _way(inward: Vec, length: S, end: Marker, marker: Marker, motion: Motion) -> S:
    """Return how far a marker is inside an end of a face, whose other end is away by `inward`, of this `length`."""
    return dot(inward, subtract(position(motion, marker), position(motion, end))) / length


def _nearest(face: PlaneSurface, other: ContactSurface, inner: Marker | None, motion: Motion) -> list[S]:
    """Return functions >= 0 where a surface is nearer to a face than to the faces beside it that it may touch.

    In space a face ends at the faces that it meets at its edges: the other surface is between them.
    """
    place = position(motion, other.place)
    if isinstance(other, Rim):
        n = direction(motion, face.place, face.normal)
        normal = UnitVector(n, cross(angular_velocity(motion, face.place.body), n))
        place = add(place, _arm(other, motion, normal)[0])
    height = _above(BodyFace(face.place, face.normal), motion, place)
    found: list[S] = []
    for beside in face.beside:
        to_beside = _above(beside, motion, place)
        if inner is not None:
            (size,) = motion.state.values([_depth(face, beside)])
            body = -_height(beside, motion, inner)
            found.append(maximum(height - to_beside, minimum(body, AT_END * size - to_beside)))
            if face.ends is None and dot(face.normal, beside.normal) is ZERO:
                found.append(maximum(-to_beside - PAST_END * size, body))
            continue
        found.append(height - to_beside)
        if face.ends is None and dot(face.normal, beside.normal) is ZERO:
            found.append(-to_beside)
    return found


def _reach_along(skins: tuple[ContactSurface, ContactSurface], motion: Motion) -> list[S]:
    """Return how far inside the ends of segments the place of contact is, and how far between the faces of an edge."""
    first, second = skins
    if not (isinstance(first, Edge) and isinstance(second, Edge)):
        edge, other = (first, second) if isinstance(first, Edge) else (second, first)
        assert isinstance(edge, Edge)
        along, length = _course(edge, motion)
        way = dot(along.vector, subtract(position(motion, other.place), position(motion, edge.place)))
        return [way, length - way]
    apart = subtract(position(motion, first.place), position(motion, second.place))
    rate = subtract(velocity(motion, first.place), velocity(motion, second.place))
    crossing = _closest_points(first, second, motion, apart, rate)
    found: list[S] = []
    for skin, way, sense in ((first, crossing.on_first, -1), (second, crossing.on_second, 1)):
        _, length = _course(skin, motion)
        normals = (direction(motion, skin.place, normal) for normal in skin.between)
        found += [way, length - way, *(sense * length * dot(n, crossing.facing.normal.vector) for n in normals)]
    return found


def _height(face: BodyFace, motion: Motion, marker: Marker) -> S:
    return _above(face, motion, position(motion, marker))


def _above(face: BodyFace, motion: Motion, place: Vec) -> S:
    return dot(direction(motion, face.place, face.normal), subtract(place, position(motion, face.place)))


# ----------------------------------------------------------------------------------------------------------------------
# Rims of discs on planes: how steep they stand, and which lie flat, where they touch all around, in no one place.


def rim_across(row: Row, motion: Motion) -> UnitVector:
    """Return the axis of a rim x the normal of the plane that it touches, with its rate; its size is the sine."""
    rim, face = _rim_and_face(row)
    axis, normal = direction(motion, rim.place, rim.axis), direction(motion, face.place, face.normal)
    turning = (angular_velocity(motion, skin.place.body) for skin in (rim, face))
    first, second = (UnitVector(x, cross(w, x)) for x, w in zip((axis, normal), turning, strict=True))
    return first.cross(second)


def _rim_and_face(row: Row) -> tuple[Rim, PlaneSurface]:
    rim, face = sorted(row.surfaces or (), key=lambda skin: skin.plane is not None)
    assert isinstance(rim, Rim)
    assert face.plane is not None
    return rim, face.plane


def rim_flatness(row: Row, motion: Motion) -> S:
    """Return a function that becomes positive where a rim is flattest, if it then nearly lies flat."""
    across = rim_across(row, motion)
    return minimum(_NEARLY_FLAT * _NEARLY_FLAT - dot(across.vector, across.vector), dot(across.vector, across.rate))


def flat_rims(rows: Iterable[Row], motion: Motion) -> Iterator[str]:
    """Yield in words which rims lie flat on the planes of their contacts, at a state in floats."""
    for row in rows:
        if row.rim is not None and row.is_holonomic and hypot(*rim_across(row, motion).vector) <= _LIES_FLAT:
            rim, face = (skin.place.name for skin in _rim_and_face(row))
            yield f"the rim of {rim} lies flat on {face} and touches all around, in no one place"
