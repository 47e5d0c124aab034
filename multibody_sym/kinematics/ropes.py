"""The path of a rope: straight segments between points and tangents of pulleys, and its whole length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.rows import Bend
from multibody_sym.scalars.functions import absolute, atan2, sign, sqrt
from multibody_sym.scalars.node import PI
from multibody_sym.scalars.vectors import S, Vec, apply, cross, dot, scale, subtract


@dataclass(frozen=True)
class Segment:
    """A straight piece of rope from the first to the second marker's body: its length and unit direction (world).

    On a wheel the piece is a tangent; frictionless wheels let the rope slide, so the rate of the rope's length and its
    derivative are those of a piece fixed to the wheel's centre with the tangent's direction and length.
    """

    ends: tuple[Marker, Marker]
    length: S
    direction: Vec


@dataclass(frozen=True)
class Wheel:
    """A pulley with a radius on a rope's path, and the axis about which the rope turns to the left there (world)."""

    radius: S
    axis: Vec


def segments(motion: Motion, path: Sequence[Bend]) -> tuple[list[Segment], S]:
    """Return the straight pieces of a rope's path and its length, arcs on wheels included."""
    centres = [position(motion, bend.at) for bend in path]
    wheels = [_wheel(motion, path, centres, k) for k in range(len(path))]
    pieces = [
        _tangent((path[k].at, path[k + 1].at), subtract(centres[k + 1], centres[k]), wheels[k], wheels[k + 1])
        for k in range(len(path) - 1)
    ]
    length = sum((piece.length for piece in pieces), 0)
    quarter = motion.state.values([PI / 2])[0]
    for wheel, before, after in zip(wheels[1:-1], pieces[:-1], pieces[1:], strict=True):
        if wheel is not None:
            length = length + wheel.radius * (quarter + _turned(wheel, before.direction, after.direction))
    return pieces, length


def _wheel(motion: Motion, path: Sequence[Bend], centres: Sequence[Vec], k: int) -> Wheel | None:
    """Return the wheel at bend k, None for a point; its centre is inside the bend.

    Where the rope runs straight back (both ends hang below the centre) the bend has no inside, and the wheel no radius.
    """
    if path[k].radius.shadow == 0 or k in (0, len(path) - 1):
        return None
    radius, *components = motion.state.values([path[k].radius, *path[k].axis])
    axis = apply(motion.rotation(path[k].at.body), components)
    before, after = subtract(centres[k], centres[k - 1]), subtract(centres[k + 1], centres[k])
    side = sign(dot(axis, cross(before, after)))
    return Wheel(radius * absolute(side), scale(side, axis))


def _tangent(ends: tuple[Marker, Marker], d: Vec, first: Wheel | None, second: Wheel | None) -> Segment:
    """Return the common tangent of two circles whose centres are d apart (None: a point).

    With m = axis x n the left normal of the direction n: the tangent touches at c - r m, so d = l n + (r2 - r1) m and
    l^2 = d^2 - (r2 - r1)^2; where the second wheel turns the rope the other way, its radius counts negative.
    """
    square = dot(d, d)
    if first is None and second is None:
        length = sqrt(square)
        return Segment(ends, length, scale(1 / length, d))
    step, axis = _step(first, second)
    length = sqrt(square - step * step)
    across = subtract(scale(length, d), scale(step, cross(axis, d)))
    return Segment(ends, length, scale(1 / square, across))


def _step(first: Wheel | None, second: Wheel | None) -> tuple[S, Vec]:
    """Return r2 - r1 and the axis."""
    if first is None:
        assert second is not None
        return second.radius, second.axis
    if second is None:
        return -first.radius, first.axis
    return second.radius * dot(first.axis, second.axis) - first.radius, first.axis


def _turned(wheel: Wheel, incoming: Vec, outgoing: Vec) -> S:
    """Return the angle between both tangents less a quarter turn: so cut that it runs on past half a turn."""
    return atan2(-dot(incoming, outgoing), dot(wheel.axis, cross(incoming, outgoing)))
