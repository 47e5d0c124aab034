"""The path of a rope: straight segments between points and tangents of pulleys, and its whole length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.vectors import S, Vec, add, apply, cross, dot, scale, subtract
from multibody_sym.model.mechanism import Bend, Marker
from multibody_sym.scalars.functions import absolute, atan2, sign, sqrt


@dataclass(frozen=True)
class Segment:
    """A straight piece of rope from the first to the second marker's body: its length and unit direction (world).

    On a wheel the piece is a tangent; frictionless wheels let the rope slide, so the rate of the rope's length and its
    derivative are those of a piece fixed to the wheel's centre with the tangent's direction and length.
    """

    ends: tuple[Marker, Marker]
    length: S
    direction: Vec


def segments(motion: Motion, path: Sequence[Bend]) -> tuple[list[Segment], S]:
    """Return the straight pieces of a rope's path and its length, arcs on wheels included."""
    centres = [position(motion, bend.at) for bend in path]
    radii = [_signed_radius(motion, path, centres, k) for k in range(len(path))]
    pieces = [
        _tangent((path[k].at, path[k + 1].at), centres[k : k + 2], radii[k : k + 2], _axis(motion, path, k))
        for k in range(len(path) - 1)
    ]
    length = sum((piece.length for piece in pieces), 0)
    for k in range(1, len(path) - 1):
        if radii[k] != 0:
            length = length + _arc(pieces[k - 1].direction, pieces[k].direction, radii[k], _axis_at(motion, path[k]))
    return pieces, length


def _axis_at(motion: Motion, bend: Bend) -> Vec:
    x, y, z = motion.state.values(bend.axis)
    return apply(motion.rotation(bend.at.body), (x, y, z))


def _axis(motion: Motion, path: Sequence[Bend], k: int) -> Vec:
    """Return the axis of the wheel at either end of piece k."""
    wheel = path[k] if path[k].radius.shadow != 0 else path[k + 1]
    return _axis_at(motion, wheel)


def _signed_radius(motion: Motion, path: Sequence[Bend], centres: Sequence[Vec], k: int) -> S:
    """Return the radius of bend k, positive where the rope turns to the left about the wheel's axis."""
    if path[k].radius.shadow == 0 or k in (0, len(path) - 1):
        return 0
    radius = motion.state.values([path[k].radius])[0]
    before, after = subtract(centres[k], centres[k - 1]), subtract(centres[k + 1], centres[k])
    return radius * sign(dot(_axis_at(motion, path[k]), cross(before, after)))


def _tangent(ends: tuple[Marker, Marker], centres: Sequence[Vec], radii: Sequence[S], axis: Vec) -> Segment:
    """Return the common tangent of two circles (radius 0: a point); a left turn has its centre on the left.

    With d the vector between centres, m = axis x n the left normal: the tangent touches at c - r m, so
    d = l n + (r2 - r1) m, and l^2 = d^2 - (r2 - r1)^2.
    """
    d = subtract(centres[1], centres[0])
    step = radii[1] - radii[0]
    if isinstance(step, int) and step == 0:
        length = sqrt(dot(d, d))
        return Segment(ends, length, scale(1 / length, d))
    length = sqrt(dot(d, d) - step * step)
    left = cross(axis, d)
    across = add(scale(length, d), scale(-step, left))
    return Segment(ends, length, scale(1 / dot(d, d), across))


def _arc(incoming: Vec, outgoing: Vec, signed_radius: S, axis: Vec) -> S:
    """Return the length of rope on a wheel: radius times the angle between both tangents (at most half a turn)."""
    turned = atan2(dot(axis, cross(incoming, outgoing)), dot(incoming, outgoing))
    return absolute(signed_radius * turned)
