"""Ropes: straight segments between points and tangents of pulleys, the whole length, and what tensions do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NoReturn

from multibody_sym.errors import ModelError
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import acceleration, position, velocity
from multibody_sym.kinematics.relative import angular_acceleration, angular_velocity
from multibody_sym.kinematics.relative import direction as world
from multibody_sym.kinematics.wrenches import Wrench, Wrenches, add_force, add_force_at
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.rope_path import Bend
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import atan2, cos, is_exactly, sign, sin, sqrt
from multibody_sym.scalars.node import PI
from multibody_sym.scalars.vectors import S, Vec, add, apply, cross, dot, scale, subtract


class NoDirectionError(ModelError, ZeroDivisionError):
    """No straight piece of rope leads from one place to the next: they are one place, or a wheel reaches over both.

    For what tries other positions it is arithmetic that fails there.
    """


@dataclass(frozen=True)
class Wheel:
    """A pulley with a radius on a rope's path, and the axis about which the rope turns to the left there (world).

    `normal` is the axis as it is declared, fixed on a `body`: the rope stays in the plane across it.
    """

    radius: S
    axis: Vec
    side: S
    normal: Vec
    body: int


@dataclass(frozen=True)
class Segment:
    """A straight piece of rope from the first to the second marker's body: its length and unit direction (world).

    On a wheel the piece is a tangent; frictionless wheels let the rope slide, so the rate of the rope's length and its
    derivative are those of a piece fixed to the wheel's centre with the tangent's direction and length. Wheels that it
    `grips` turn with it: it is fixed to their rims. What is `steady` keeps its direction n; of
    other pieces between circles `rims` are vectors with d = length n + sum rim x n, d from centre to centre. On
    a wheel it lies in its `plane`.
    """

    ends: tuple[Marker, Marker]
    length: S
    direction: Vec
    grips: tuple[Wheel | None, Wheel | None] = (None, None)
    steady: bool = False
    rims: tuple[Vec, ...] = ()
    plane: Wheel | None = None

    def touches(self, motion: Motion, end: int) -> Vec:
        """Return where the piece ends (world): its marker, or where it touches the wheel that it grips."""
        centre, wheel = position(motion, self.ends[end]), self.grips[end]
        return centre if wheel is None else add(centre, scale(-wheel.radius, cross(wheel.axis, self.direction)))


def segments(motion: Motion, path: Sequence[Bend], straight: Sequence[Point | None] = ()) -> tuple[list[Segment], S]:
    """Return the straight pieces of a rope's path and its length, arcs on wheels and what is wound on them included.

    `straight` are the directions (world) of pieces that keep them, None where a piece does not.
    """
    centres = [position(motion, bend.at) for bend in path]
    wheels = [wheel_at(motion, path, k) for k in range(len(path))]
    pieces = []
    for k in range(len(path) - 1):
        ends, d = (path[k].at, path[k + 1].at), subtract(centres[k + 1], centres[k])
        held = straight[k] if straight else None
        grips = tuple(wheels[j] if path[j].grip is not None else None for j in (k, k + 1))
        if held is None:
            pieces.append(_tangent(ends, d, wheels[k], wheels[k + 1], (grips[0], grips[1])))
        else:
            x, y, z = motion.state.values(held)
            pieces.append(Segment(ends, dot((x, y, z), d), (x, y, z), (grips[0], grips[1]), steady=True))
    length = sum((piece.length for piece in pieces), 0)
    for bend, wheel, before, after in zip(path[1:-1], wheels[1:-1], pieces[:-1], pieces[1:], strict=True):
        if wheel is not None:
            length = length + wheel.radius * _wrapped(motion, wheel, before, after)
            if bend.turns:
                length = length + wheel.radius * (bend.turns * motion.state.values([2 * PI])[0])
    return pieces, length + _wound(motion, path[-1], wheels[-1], pieces[-1]) - _wound(
        motion, path[0], wheels[0], pieces[0]
    )


def sides(motion: Motion, path: Sequence[Bend]) -> list[S | None]:
    """Return to which side (1, -1; 0: none) a rope turns about each wheel's axis; None for points."""
    wheels = [wheel_at(motion, path, k) for k in range(len(path))]
    return [None if wheel is None else wheel.side for wheel in wheels]


def wheel_at(motion: Motion, path: Sequence[Bend], k: int) -> Wheel | None:
    """Return the wheel at bend k, None for a point; it has no radius where no side was found."""
    bend = path[k]
    if bend.radius.shadow == 0 or (k in (0, len(path) - 1) and bend.grip is None):
        return None
    radius, side, *components = motion.state.values([bend.radius, bend.side, *bend.axis])
    axis = apply(motion.rotation(bend.at.body), components)
    return Wheel(radius * side * side, scale(side, axis), side, axis, bend.at.body)


def inner_side(motion: Motion, bend: Bend) -> S:
    """Return on which side of a wheel a rope has the centre inside its bend: 1 to the left about the axis, -1, or 0.

    Where the rope runs straight back (both ends hang below the centre) the bend has no inside.
    """
    assert bend.beside is not None
    axis = apply(motion.rotation(bend.at.body), motion.state.values(bend.axis))
    centre, (before, behind) = position(motion, bend.at), (position(motion, marker) for marker in bend.beside)
    return sign(dot(axis, cross(subtract(centre, before), subtract(behind, centre))))


def _tangent(
    ends: tuple[Marker, Marker],
    d: Vec,
    first: Wheel | None,
    second: Wheel | None,
    grips: tuple[Wheel | None, Wheel | None],
) -> Segment:
    """Return the common tangent of two circles whose centres are d apart (None: a point).

    With m = axis x n the left normal of the direction n: the tangent touches at c - r m, so d = l n + (r2 - r1) m and
    l^2 = d^2 - (r2 - r1)^2; where the second wheel turns the rope the other way, its radius counts negative. Raises
    NoDirectionError where points are at one place, or one is inside the wheel of the other.
    """
    square = dot(d, d)
    if first is None and second is None:
        length = sqrt(square)
        if isinstance(length, float) and length == 0.0:
            names = " and ".join(end.name for end in ends)
            raise NoDirectionError(f"{names} are at one place, and a rope between them has no direction: start apart")
        return Segment(ends, length, scale(1 / length, d))
    step, axis = _step(first, second)
    rest = square - step * step
    if isinstance(rest, float) and rest <= 0.0:
        _refuse(ends, math.sqrt(square), abs(step))
    length = sqrt(rest)
    across = subtract(scale(length, d), scale(step, cross(axis, d)))
    rims = [scale(s * wheel.radius, wheel.axis) for s, wheel in ((-1, first), (1, second)) if wheel is not None]
    return Segment(ends, length, scale(1 / square, across), grips, rims=tuple(rims), plane=first or second)


def _refuse(ends: tuple[Marker, Marker], apart: float, least: float) -> NoReturn:
    first, second = (end.name for end in ends)
    raise NoDirectionError(
        f"{first} is {apart:g} m from {second}, where no straight piece of rope leads from one to the other: their "
        f"wheels ask for more than {least:g} m; start elsewhere (initial: {{q: ..}}), or give smaller radii",
        number="M119",
    )


def _step(first: Wheel | None, second: Wheel | None) -> tuple[S, Vec]:
    """Return r2 - r1 and the axis."""
    if first is None:
        assert second is not None
        return second.radius, second.axis
    if second is None:
        return -first.radius, first.axis
    return second.radius * dot(first.axis, second.axis) - first.radius, first.axis


def _wrapped(motion: Motion, wheel: Wheel, before: Segment, after: Segment) -> S:
    """Return the angle between both tangents, so cut that it runs on past half a turn; of straight ones in full."""
    quarter, half = motion.state.values([PI / 2, PI])
    across, along = dot(wheel.axis, cross(before.direction, after.direction)), dot(before.direction, after.direction)
    if before.steady and after.steady:
        known = ((0, -1, half), (0, 1, 0), (1, 0, quarter))
        exact = (angle for x, y, angle in known if is_exactly(across, x) and is_exactly(along, y))
        return next(exact, quarter + atan2(-along, across))
    return quarter + atan2(-along, across)


def wrap_angle(motion: Motion, row: RopeRow, k: int) -> S:
    """Return around how much of the wheel at bend k a rope lies, full turns included; 0 at a point."""
    pieces, _ = segments(motion, row.path, row.straight)
    wheel = wheel_at(motion, row.path, k)
    if wheel is None:
        return 0
    (turns,) = motion.state.values([2 * row.path[k].turns * PI])
    return _wrapped(motion, wheel, pieces[k - 1], pieces[k]) + turns


def wrap_between(motion: Motion, before: RopeRow, after: RopeRow) -> S:
    """Return around how much of the wheel a rope lies that two runs of it grip, one behind the other."""
    wheel = wheel_at(motion, before.path, len(before.path) - 1)
    assert wheel is not None
    pieces = [segments(motion, row.path, row.straight)[0] for row in (before, after)]
    return _wrapped(motion, wheel, pieces[0][-1], pieces[1][0])


# --- tensions --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pull:
    """Segments under tensions: the sum of tension times d(length)/dt, of that times d^2(length)/dt^2, and wrenches."""

    stretching: S
    stretching_rate: S
    of_body: list[Wrench]


def pull(motion: Motion, parts: Sequence[Segment], tensions: Sequence[S], bias: Sequence[tuple[Vec, Vec]]) -> Pull:
    """Return what tensions in straight segments do.

    d(length)/dt = sum n . dv;  d^2(length)/dt^2 = sum n . da + n' . dv. On a wheel that turns with the rope, r omega
    and r alpha about its axis are added: forces act at the rim.
    """
    wrenches = Wrenches(len(motion.bodies))
    stretching: S = 0
    stretching_rate: S = 0
    for part, tension in zip(parts, tensions, strict=True):
        dv = subtract(velocity(motion, part.ends[1]), velocity(motion, part.ends[0]))
        da = subtract(acceleration(motion, part.ends[1], bias), acceleration(motion, part.ends[0], bias))
        along = dot(part.direction, dv)
        rate, further = along, dot(part.direction, da)
        further = further + _turning(motion, part, dv, along)
        for end, sense in enumerate((-1, 1)):
            wheel, marker, force = part.grips[end], part.ends[end], scale(-sense * tension, part.direction)
            if wheel is None:
                add_force(wrenches, motion, marker, force)
                continue
            rate = rate + sense * wheel.radius * dot(wheel.axis, angular_velocity(motion, marker.body))
            spinning = dot(wheel.axis, angular_acceleration(motion, marker.body, bias))
            further = further + sense * wheel.radius * spinning
            add_force_at(wrenches, motion, marker.body, part.touches(motion, end), force)
        stretching = stretching + tension * rate
        stretching_rate = stretching_rate + tension * further
    return Pull(stretching, stretching_rate, wrenches.of_body)


def _turning(motion: Motion, part: Segment, dv: Vec, along: S) -> S:
    """Return n' . dv. Between points l n' = dv - (n . dv) n; in the plane across an axis a, n' . a = -n . a'."""
    if part.steady:
        return 0
    if part.plane is None:
        return (dot(dv, dv) - along * along) / part.length
    axis = part.plane.normal
    across = dot(cross(axis, part.direction), dv)
    tilting = dot(part.direction, cross(angular_velocity(motion, part.plane.body), axis))
    return across * across / part.length - dot(axis, dv) * tilting


# --- what is wound on a wheel ---------------------------------------------------------------------------------------


def _wound(motion: Motion, bend: Bend, wheel: Wheel | None, piece: Segment) -> S:
    """Return what a wheel that turns has wound up of the rope that comes to it along a piece, since it stood at zero.

    A point of the rim runs away from the tangent point, which turns about the centre as the piece does.
    """
    if bend.grip is None or wheel is None:
        return 0
    (turned,) = motion.state.values([bend.grip.angle])
    if not piece.steady:
        x, y = _tangent_components(motion, bend, piece.direction)
        (start,) = motion.state.values([bend.grip.start])
        turned = turned - atan2(y * cos(start) - x * sin(start), x * cos(start) + y * sin(start))
    return wheel.side * wheel.radius * turned


def tangent_direction(motion: Motion, row: RopeRow, end: int) -> S:
    """Return the angle from `across` of its grip at which a run of rope meets the wheel at an end (0, 1)."""
    pieces, _ = segments(motion, row.path)
    x, y = _tangent_components(motion, row.path[-end], pieces[-end].direction)
    return atan2(y, x)


def _tangent_components(motion: Motion, bend: Bend, direction: Vec) -> tuple[S, S]:
    """Return a direction's components along `across` of a grip, and a quarter turn on about its axis."""
    assert bend.grip is not None
    along, axis = (world(motion, bend.grip.frame, v) for v in (bend.grip.across, bend.grip.axis))
    return dot(direction, along), dot(direction, cross(axis, along))
