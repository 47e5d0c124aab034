"""Contacts: gap, normal, place, and the velocity of one body's material on the other's where their skins are nearest.

A skin with a centre C (a ball, a point, the rim of a disc) faces another one: n leads from that one to C, h is how far
C is above it along n, and k leads from C to the place of contact, which lies on the round skin. Then

    gap = h + n . k,    slip = v_1 + w_1 x k - v_2 - w_2 x (d + k),    d = C - (what stands for the other skin)

and n . slip is the rate of the gap, because k' . n and d' - n' h contribute nothing along n. Of two segments that cross
n is normal to both, C an end of the first and k leads from there to where it crosses the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import singledispatch
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.kinematics.guides.touched import bent_normal, to_foot
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import acceleration, position, velocity
from multibody_sym.kinematics.relative import Direction, angular_acceleration, angular_velocity, direction, separation
from multibody_sym.model.mechanism.contact_rows import (
    LOCAL,
    Bent,
    ContactRow,
    Edge,
    Face,
    Flat,
    Level,
    Rim,
    Round,
    Skin,
)
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import IDENTITY
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, is_exactly, maximum, minimum, sign, sqrt, where
from multibody_sym.scalars.functions import apply as operation
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.vectors import (
    S,
    Vec,
    add,
    apply,
    combination,
    cross,
    dot,
    negate,
    scale,
    subtract,
    symmetric,
)

_PARALLEL: Final = 1e-12
"""The square of an angle (rad) up to which a normal is along an axis."""
_PARALLEL_LINES: Final = 1e-18
"""The same for two lines that cross: they are where they touch to what is left of their digits."""
AT_END: Final = 1e-10
"""The part of the length of a face by which a corner may be beyond its end if its body is not, ..."""
PAST_END: Final = 1e-8
"""... and by which it has to be inside if its body is beyond: more than what counts as touching."""
_ALLOWED: Final = 0.25
"""The part of that by which anything may be beyond an end, however large the model is beside the face."""
_Z: Vec = (0, 0, 1)


@dataclass(frozen=True)
class Touch:
    """Where two skins are nearest: the gap, the normal from the second to the first, and the slip of the first there.

    `slip_rate` is for udot = 0, `turning` the first body's angular velocity relative to the second, `turning_rate` its
    rate; all in world axes.
    """

    place: Vec
    gap: S
    normal: Direction
    slip: Vec
    slip_rate: Vec
    turning: Vec
    turning_rate: Vec


@dataclass(frozen=True)
class _Facing:
    """What a skin shows to a centre: the normal towards it, and how far it is along that."""

    normal: Direction
    height: S


@dataclass(frozen=True)
class _Met:
    """A skin with a centre that is `apart` from the place of another one: what that shows, and its own arm to there."""

    apart: Vec
    apart_rate: Vec
    facing: _Facing
    arm: Vec
    arm_rate: Vec


def gap(skins: tuple[Skin, Skin], motion: Motion) -> S:
    """Return the gap between two skins alone."""
    met = _met(skins[::-1] if _faces(*skins) else skins, motion)
    return met.facing.height + dot(met.facing.normal.vector, met.arm)


def touch(skins: tuple[Skin, Skin], motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> Touch:
    """Return where and how two skins touch; `bias` holds the bodies' accelerations for udot = 0."""
    if _faces(*skins):
        found = _centre_on((skins[1], skins[0]), motion, bias)
        return replace(
            found,
            normal=found.normal.reversed,
            slip=negate(found.slip),
            slip_rate=negate(found.slip_rate),
            turning=negate(found.turning),
            turning_rate=negate(found.turning_rate),
        )
    return _centre_on(skins, motion, bias)


def _faces(first: Skin, second: Skin) -> bool:
    """Return whether the first of two skins faces the second, which has the centre."""
    if isinstance(first, (Edge, Bent)):
        return isinstance(second, Round)
    return isinstance(first, (Flat, Level))


def _centre_on(skins: tuple[Skin, Skin], motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> Touch:
    """Return the same for a first skin that has a centre, or a segment that crosses another."""
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
        facing.height + dot(facing.normal.vector, arm),
        facing.normal,
        slip,
        rate,
        subtract(w, w_2),
        subtract(alpha, alpha_2),
    )


def _met(skins: tuple[Skin, Skin], motion: Motion) -> _Met:
    first, second = skins
    apart = subtract(position(motion, first.place), position(motion, second.place))
    apart_rate = subtract(velocity(motion, first.place), velocity(motion, second.place))
    if isinstance(first, Edge) and isinstance(second, Edge):
        crossing = _crossing(first, second, motion, apart, apart_rate)
        return _Met(apart, apart_rate, crossing.facing, crossing.arm, crossing.arm_rate)
    facing = _facing(second, motion, apart, apart_rate, isinstance(first, Round) and first.inside)
    return _Met(apart, apart_rate, facing, *_arm(first, motion, facing.normal))


@singledispatch
def _facing(skin: Skin, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """Return what a skin shows to a centre that is `apart` from its place; `hollow`: to what is round that centre."""
    raise TypeError(f"nothing says how {type(skin).__name__} is touched")


@_facing.register
def _(skin: Flat, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    n = direction(motion, skin.place, skin.normal)
    return _Facing(Direction(n, cross(angular_velocity(motion, skin.place.body), n)), dot(n, apart))


@_facing.register
def _(skin: Round, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """Of one in the other the normal leads from centre to centre the other way, along x where they are in one place.

    There each direction is as near as any other: what is wide open is open, and what is inside is found to be.
    """
    sense = -1 if skin.inside or hollow else 1
    length = sqrt(dot(apart, apart))
    if is_exactly(length, 0):
        return _Facing(Direction((1, 0, 0), (0, 0, 0)), -_radius(skin, motion))
    n = scale(sense / length, apart)
    across = subtract(apart_rate, scale(dot(n, apart_rate), n))
    return _Facing(Direction(n, scale(sense / length, across)), sense * length - _radius(skin, motion))


@_facing.register
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
    return _Facing(Direction(normal, add(cross(w, normal), combination(axes, turning))), function / size)


@_facing.register
def _(skin: Edge, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """From the foot on the segment's line to the centre; along x where that is on the line, as of balls."""
    along, _ = _course(skin, motion)
    away = subtract(apart, scale(dot(along.vector, apart), along.vector))
    length = sqrt(dot(away, away))
    if is_exactly(length, 0):
        return _Facing(Direction((1, 0, 0), (0, 0, 0)), length)
    before, after = dot(along.rate, apart) + dot(along.vector, apart_rate), dot(along.vector, apart)
    away_rate = subtract(apart_rate, add(scale(before, along.vector), scale(after, along.rate)))
    n = scale(1 / length, away)
    return _Facing(Direction(n, scale(1 / length, subtract(away_rate, scale(dot(n, away_rate), n)))), length)


@_facing.register
def _(skin: Bent, motion: Motion, apart: Vec, apart_rate: Vec, hollow: bool) -> _Facing:
    """Where the foot is right below the centre, as its row says, the height over its tangent is the distance."""
    n, rate = bent_normal(skin, motion)
    return _Facing(Direction(n, rate), dot(n, subtract(apart, to_foot(skin, motion)[0])))


@singledispatch
def _arm(skin: Skin, motion: Motion, normal: Direction) -> tuple[Vec, Vec]:
    """Return the vector from a skin's centre to its place that is nearest against the normal, and its rate."""
    raise TypeError(f"nothing says where {type(skin).__name__} is nearest")


@_arm.register
def _(skin: Round, motion: Motion, normal: Direction) -> tuple[Vec, Vec]:
    radius = _radius(skin, motion)
    return scale(-radius, normal.vector), scale(-radius, normal.rate)


@_arm.register
def _(skin: Rim, motion: Motion, normal: Direction) -> tuple[Vec, Vec]:
    """With the axis a and g = a x (n x a), of the size |n x a|, it is -r g / |g|; the centre where n x a is zero.

    g is across a to the last digit, so that its direction, which rounding makes where the rim lies flat, is in the rim.
    """
    (radius,) = motion.state.values([skin.radius])
    a = direction(motion, skin.place, skin.axis)
    axis = Direction(a, cross(angular_velocity(motion, skin.place.body), a))
    across = normal.cross(axis)
    steep, square = axis.cross(across), dot(across.vector, across.vector)
    if is_exactly(square, 0) or not skin.rolls:
        square = where(operation("less", 0, square), square, 1)
    length = sqrt(square)
    up = scale(1 / length, steep.vector)
    up_rate = scale(1 / length, subtract(steep.rate, scale(dot(up, steep.rate), up)))
    return scale(-radius, up), scale(-radius, up_rate)


@_arm.register
def _(skin: Bent, motion: Motion, normal: Direction) -> tuple[Vec, Vec]:
    """The foot is where the tangent is across the normal, as its row says."""
    return to_foot(skin, motion)


def _course(skin: Edge, motion: Motion) -> tuple[Direction, S]:
    """Return the direction of a segment, and its length."""
    whole = subtract(position(motion, skin.tip), position(motion, skin.place))
    length = sqrt(dot(whole, whole))
    if is_exactly(length, 0):
        raise ModelError(f"{skin.place.name} leads from a place to the same place; give it two ends")
    along = scale(1 / length, whole)
    return Direction(along, cross(angular_velocity(motion, skin.place.body), along)), length


@dataclass(frozen=True)
class _Crossing:
    """Where the lines of two segments are nearest: the normal and the gap; `on_first` and `on_second` how far from
    their places that is (m), `arm` the way there along the first."""

    facing: _Facing
    on_first: S
    on_second: S
    arm: Vec
    arm_rate: Vec


def _crossing(first: Edge, second: Edge, motion: Motion, apart: Vec, apart_rate: Vec) -> _Crossing:
    """With c = d1 . d2 and w = `apart` the first is nearest at (c d2 . w - d1 . w) / (1 - c^2) along d1."""
    d1, d2 = _course(first, motion)[0], _course(second, motion)[0]
    c, c_rate = _product(d1, d2)
    on_1, on_1_rate = _product(d1, Direction(apart, apart_rate))
    on_2, on_2_rate = _product(d2, Direction(apart, apart_rate))
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
    normal = Direction(n, subtract(across_rate, scale(dot(n, across_rate), n)))
    arm_rate = add(scale(way_rate, d1.vector), scale(way, d1.rate))
    facing = _Facing(normal, dot(n, apart))
    return _Crossing(facing, way, (on_2 - c * on_1) / steep, scale(way, d1.vector), arm_rate)


def _product(a: Direction, b: Direction) -> tuple[S, S]:
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


def _radius(skin: Round, motion: Motion) -> S:
    (radius,) = motion.state.values([skin.radius])
    return -radius if skin.inside else radius


def contact_direction(row: ContactRow, motion: Motion, touching: Touch) -> Direction:
    """Return the direction of a row: the normal, a tangent, or the axis of rolling along a tangent, normal x t."""
    if row.along == "normal":
        return touching.normal
    first = _first_tangent(row, motion, touching.normal)
    turned = touching.normal.cross(first)
    if row.along in ("t1", "roll2"):
        return first if row.along == "t1" else first.reversed
    return turned


def _first_tangent(row: ContactRow, motion: Motion, normal: Direction) -> Direction:
    if row.across is not None:
        plane = next(skin for skin in row.skins if isinstance(skin, Flat)).place
        t = direction(motion, plane, row.across)
        return Direction(t, cross(angular_velocity(motion, plane.body), t))
    if row.upright:
        return Direction(cross(normal.vector, _Z), cross(normal.rate, _Z))
    seen = _axis_seen(normal.vector)
    inclined = dot(normal.vector, seen)
    lying = subtract(seen, scale(inclined, normal.vector))
    rate = negate(add(scale(dot(normal.rate, seen), normal.vector), scale(inclined, normal.rate)))
    length = sqrt(dot(lying, lying))
    t = scale(1 / length, lying)
    return Direction(t, scale(1 / length, subtract(rate, scale(dot(t, rate), t))))


def _axis_seen(normal: Vec) -> Vec:
    """Return the axis of ground that tangents follow: x, or y where x is normal to the surface.

    On the way from one to the other components of friction change their names; the force does not.
    """
    steep = normal[1] * normal[1] + normal[2] * normal[2]
    along_y = where(operation("less", steep, _PARALLEL), 1, 0)
    return (1 - along_y, along_y, 0)


def reach(row: ContactRow, motion: Motion) -> list[S]:
    """Return functions that are >= 0 where a contact with a face that ends may hold; beyond it, it does not.

    What is round is above the face, from end to end. A corner at the very end is there if its body is: a body beyond
    the end slides along the face that begins there. The body whose corner touches is above the face; a point is nearer
    to it than to the faces beside it, of which those do not count that this body is not above, as its corners do not
    touch them anywhere. Points meet where they are at one place, and nowhere else.
    """
    if any(isinstance(skin, Edge) for skin in row.skins):
        return _reach_along(row.skins, motion)
    if row.tip is not None:
        away, _ = separation(motion, *(skin.place for skin in row.skins))
        return [-sqrt(dot(away, away))]
    face = next((skin for skin in row.skins if isinstance(skin, Flat)), None)
    if face is None:
        return []
    other = row.skins[0] if row.skins[1] is face else row.skins[1]
    found = _nearest(face, other, row.inner, motion)
    if face.ends is not None:
        p, q = face.ends
        along = subtract(position(motion, q), position(motion, p))
        length = sqrt(dot(along, along))
        for end, inward in ((p, along), (q, negate(along))):
            way = _way(inward, length, end, other.place, motion)
            if row.inner is not None:
                found.append(way + AT_END * length)
                way = maximum(way - PAST_END * length, _way(inward, length, end, row.inner, motion))
            found.append(way + AT_END * length if face.at_end else way)
    if row.inner is not None:
        found.append(_height(Face(face.place, face.normal), motion, row.inner))
    return found


def allowed_past_end(row: ContactRow, motion: Motion) -> list[S]:
    """Return how far (m) beyond each end of a face what touches it may be at most; nothing where no body ends there."""
    face = next((skin for skin in row.skins if isinstance(skin, Flat)), None)
    if face is None or row.inner is None or row.tip is not None:
        return []
    sizes = [_depth(face, beside) for beside in face.beside if face.ends is None]
    if face.ends is not None:
        along = subtract(*(end.pose.position for end in face.ends))
        sizes.append(sqrt(dot(along, along)))
    return [_ALLOWED * PAST_END * absolute(size) for size in motion.state.values(sizes)]


def _depth(face: Flat, beside: Face) -> Node:
    """Return how far (m) behind a face beside it the middle of a face is."""
    depth: Node = dot(beside.normal, subtract(beside.place.pose.position, face.place.pose.position))
    return depth


def _way(inward: Vec, length: S, end: Marker, marker: Marker, motion: Motion) -> S:
    """Return how far a marker is inside an end of a face, whose other end is away by `inward`, of this `length`."""
    return dot(inward, subtract(position(motion, marker), position(motion, end))) / length


def _nearest(face: Flat, other: Skin, inner: Marker | None, motion: Motion) -> list[S]:
    """Return functions >= 0 where what may touch a face is nearer to it than to those beside it that it may touch.

    In space a face ends at the faces that it meets at its edges: what touches it is between them.
    """
    place = _nearest_place(face, other, motion)
    height = _above(Face(face.place, face.normal), motion, place)
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


def _reach_along(skins: tuple[Skin, Skin], motion: Motion) -> list[S]:
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
    crossing = _crossing(first, second, motion, apart, rate)
    found: list[S] = []
    for skin, way, sense in ((first, crossing.on_first, -1), (second, crossing.on_second, 1)):
        _, length = _course(skin, motion)
        normals = (direction(motion, skin.place, normal) for normal in skin.between)
        found += [way, length - way, *(sense * length * dot(n, crossing.facing.normal.vector) for n in normals)]
    return found


def _nearest_place(face: Flat, skin: Skin, motion: Motion) -> Vec:
    """Return the place of a rim that is nearest to a face, of what is round its centre: it is right above that."""
    centre = position(motion, skin.place)
    if not isinstance(skin, Rim):
        return centre
    n = direction(motion, face.place, face.normal)
    normal = Direction(n, cross(angular_velocity(motion, face.place.body), n))
    return add(centre, _arm(skin, motion, normal)[0])


def _height(face: Face, motion: Motion, marker: Marker) -> S:
    """Return how far a marker is above a face."""
    return _above(face, motion, position(motion, marker))


def _above(face: Face, motion: Motion, place: Vec) -> S:
    """Return how far a place is above a face."""
    return dot(direction(motion, face.place, face.normal), subtract(place, position(motion, face.place)))
