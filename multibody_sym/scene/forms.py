"""Forms: the geometry of what is seen, in the axes of one body (m). A new form is a class here and an entry in FORMS.

Each form can tell points that bound it; a symbol's size is the page's affair, so that it tells its place alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

ZERO: Final = (0.0, 0.0, 0.0)
Vector = tuple[float, float, float]
Values = Sequence[float] | Floats


def vector(values: Values) -> Vector:
    """Return three floats."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def across(axis: Values) -> Vector:
    """Return a unit vector across an axis: in the x-y plane where the axis allows it."""
    x, y, z = axis
    found = (0.0, 0.0, 1.0) if abs(x) + abs(y) < 1e-12 * abs(z) else (-y, x, 0.0)
    if found[2] == 1.0:
        found = (1.0, 0.0, 0.0)
    return vector(np.array(found) / np.linalg.norm(found))


def unit(values: Values, otherwise: Vector = (0.0, 0.0, 1.0)) -> Vector:
    """Return a vector of length one along another, `otherwise` where that is zero."""
    found = np.asarray(values, dtype=float)
    size = float(np.linalg.norm(found))
    return vector(found / size) if size > 0.0 and np.isfinite(size) else otherwise


def circle(centre: Values, axis: Values, radius: float, count: int = 24) -> Floats:
    """Return points of a circle (count, 3)."""
    e1 = np.array(across(unit(axis)))
    e2 = np.cross(unit(axis), e1)
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)[:, None]
    found: Floats = np.asarray(centre, dtype=float) + radius * (np.cos(angles) * e1 + np.sin(angles) * e2)
    return found


@dataclass(frozen=True)
class Polyline:
    """Points joined by straight lines: rods, links, outlines, curves as they were sampled; `closed` ones are filled."""

    points: tuple[Vector, ...]
    closed: bool = False

    @property
    def bounds(self) -> Floats:
        """Points that bound it (n, 3)."""
        return np.array(self.points)


@dataclass(frozen=True)
class Disc:
    """A disc about an axis; `hollow` is a ring; with `teeth` it is the pitch circle of a gear."""

    centre: Vector
    axis: Vector
    radius: float
    hollow: bool = False
    teeth: bool = False

    @property
    def bounds(self) -> Floats:
        """Points that bound it (n, 3)."""
        return circle(self.centre, self.axis, self.radius)


@dataclass(frozen=True)
class Sphere:
    """A ball; `hollow` is a shell, or a bowl that is touched inside."""

    centre: Vector
    radius: float
    hollow: bool = False

    @property
    def bounds(self) -> Floats:
        """Points that bound it (6, 3)."""
        offsets = self.radius * np.vstack([np.eye(3), -np.eye(3)])
        found: Floats = np.array(self.centre) + offsets
        return found


@dataclass(frozen=True)
class Block:
    """A box about a centre; the columns of `rotation` are the directions of its edges, `sizes` their lengths."""

    centre: Vector
    rotation: tuple[Vector, Vector, Vector]
    sizes: Vector

    @property
    def bounds(self) -> Floats:
        """Its corners (8, 3), the first index slowest in z: 0 to 3 the bottom around, 4 to 7 the top."""
        square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        signs = np.array([(x, y, z) for z in (-1, 1) for x, y in square], dtype=float)
        found: Floats = np.array(self.centre) + (signs * np.array(self.sizes) / 2.0) @ np.array(self.rotation).T
        return found


@dataclass(frozen=True)
class Barrel:
    """A cylinder about a centre, `length` along its axis."""

    centre: Vector
    axis: Vector
    radius: float
    length: float

    @property
    def bounds(self) -> Floats:
        """Points that bound it (n, 3): the circle at its low end, then that at its high one."""
        half = np.array(self.axis) * self.length / 2.0
        ends = (np.array(self.centre) - half, np.array(self.centre) + half)
        return np.vstack([circle(end, self.axis, self.radius) for end in ends])


@dataclass(frozen=True)
class Face:
    """A plane: a line (in space a sheet) with hatching on the side away from its normal.

    Without `ends` it goes as far as the picture does.
    """

    through: Vector
    normal: Vector
    ends: tuple[Vector, Vector] | None = None

    @property
    def bounds(self) -> Floats:
        """The place that it goes through, and its ends (n, 3)."""
        return np.array([self.through] if self.ends is None else self.ends)


@dataclass(frozen=True)
class Rail:
    """What a slider runs along: a line through a place, seen from `reach[0]` to `reach[1]` (m) along its unit axis.

    A `light` one is the way of what hangs there, where a figure has no rail.
    """

    at: Vector
    axis: Vector
    reach: tuple[float, float]
    light: bool = False

    @property
    def bounds(self) -> Floats:
        """Its ends (2, 3)."""
        found: Floats = np.array(self.at) + np.outer(self.reach, self.axis)
        return found


@dataclass(frozen=True)
class Stop:
    """What ends a way: the place of a body that comes `at` it is `point`, in the axes of that body.

    `axis` is the unit direction that is barred, `front` how far (m) what has a size reaches ahead of the place.
    """

    at: Vector
    axis: Vector
    point: Vector
    front: float = 0.0

    @property
    def bounds(self) -> Floats:
        """Its place (1, 3), where the front of the body comes to."""
        found: Floats = np.array([self.at]) + self.front * np.array(self.axis)
        return found


@dataclass(frozen=True)
class TurnStop:
    """What ends a turn about a place: turning on about the unit `axis` is barred.

    There the direction `own` of the body that turns, in its axes, lies along `way`; it is `reach` (m) long.
    """

    at: Vector
    axis: Vector
    way: Vector
    own: Vector
    reach: float

    @property
    def bounds(self) -> Floats:
        """Its place (1, 3)."""
        return np.array([self.at])


@dataclass(frozen=True)
class Symbol:
    """A sign of a `kind` at a place, whose size is the page's affair, with an axis and a direction along which it lies.

    The kinds are the keys of `drawing.look`'s table of symbols.
    """

    kind: str
    at: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    along: Vector = (1.0, 0.0, 0.0)

    @property
    def bounds(self) -> Floats:
        """Its place (1, 3)."""
        return np.array([self.at])


@dataclass(frozen=True)
class Bowl:
    """A surface that is round about an axis through a centre, by its profile: distances from the axis and heights."""

    centre: Vector
    axis: Vector
    profile: tuple[tuple[float, float], ...]

    @property
    def bounds(self) -> Floats:
        """Points that bound it (n, 3): the circle of its edge, and its middle."""
        return np.vstack([self.ring(-1, 24), self.ring(0, 2)])

    def ring(self, k: int, count: int = 49) -> Floats:
        """Return points of the circle (count, 3) of one place of its profile."""
        way, height = self.profile[k]
        return circle(np.array(self.centre) + height * np.array(self.axis), self.axis, way, count)

    def section(self, angle: float) -> Floats:
        """Return the profile (n, 3) at an angle about the axis."""
        e1 = np.array(across(self.axis))
        side = np.cos(angle) * e1 + np.sin(angle) * np.cross(self.axis, e1)
        profile = np.array(self.profile)
        found: Floats = np.array(self.centre) + np.outer(profile[:, 0], side) + np.outer(profile[:, 1], self.axis)
        return found


@dataclass(frozen=True)
class Axes:
    """The directions along which something moves freely, with the names of its coordinates; those of turns last."""

    at: Vector
    axes: tuple[Vector, ...]
    names: tuple[str, ...]

    @property
    def bounds(self) -> Floats:
        """Its place (1, 3)."""
        return np.array([self.at])


Form = Axes | Bowl | Polyline | Disc | Sphere | Block | Barrel | Face | Rail | Stop | Symbol | TurnStop
