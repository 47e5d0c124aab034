"""The records of a scene: items on one body, strands between bodies, dimensions, angles, arrows; and where they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import ClassVar, Final, Literal

import numpy as np

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Forms: the geometry of what is seen, in the axes of one body (m). A new form is a class here and an entry in FORMS.
#
# Each form can tell points that bound it; a symbol's size is the page's affair, so that it tells its place alone.


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


def unit(values: Values) -> Vector:
    """Return a vector of length one along another, z where that is zero."""
    found = np.asarray(values, dtype=float)
    size = float(np.linalg.norm(found))
    return vector(found / size) if size > 0.0 and np.isfinite(size) else (0.0, 0.0, 1.0)


def rim(axis: Values, angles: Floats) -> Floats:
    """Return the unit vectors (n, 3) across a unit axis at angles (n,) from the first one."""
    e1 = np.array(across(axis))
    return np.asarray(np.cos(angles)[:, None] * e1 + np.sin(angles)[:, None] * np.cross(axis, e1))


def circle(centre: Values, axis: Values, radius: float, count: int = 24) -> Floats:
    """Return points of a circle (count, 3)."""
    ways = rim(unit(axis), np.linspace(0.0, 2.0 * np.pi, count, endpoint=False))
    return np.asarray(np.asarray(centre, dtype=float) + radius * ways)


class _Form:
    """What a form says of itself beside its geometry."""

    shows_body: ClassVar[bool] = False
    """Whether a surface of this form shows the whole of its body."""
    sized: ClassVar[bool] = True
    """Whether its bounds say how large it is; not so for signs, rails and planes."""
    guides: ClassVar[bool] = False
    """Whether others slide along it or lie on it."""

    @property
    def hollow_disc(self) -> Disc | None:
        """It, if it is a hollow disc."""
        return None

    @property
    def open_line(self) -> Polyline | None:
        """It, if it is a line that encloses nothing."""
        return None

    @property
    def face(self) -> Face | None:
        """It, if it is a plane."""
        return None

    @property
    def bounds(self) -> Floats:
        """Points that bound it (n, 3)."""
        raise NotImplementedError

    @property
    def endless(self) -> bool:
        """Whether it goes as far as the picture does."""
        return False

    @property
    def symbol(self) -> Symbol | None:
        """It, if it is a sign whose size is the page's affair."""
        return None


@dataclass(frozen=True)
class Polyline(_Form):
    """Points joined by straight lines: rods, links, outlines, curves as they were sampled; `closed` ones are filled.

    A `thin` rod has no mass of its own, a `chain` hangs in links.
    """

    points: tuple[Vector, ...]
    closed: bool = False
    thin: bool = False
    chain: bool = False
    shows_body: ClassVar[bool] = True

    @property
    def open_line(self) -> Polyline | None:
        return None if self.closed else self

    @property
    def bounds(self) -> Floats:
        return np.array(self.points)


@dataclass(frozen=True)
class Disc(_Form):
    """A disc about an axis; `hollow` is a ring; with `teeth` it is the pitch circle of a gear."""

    centre: Vector
    axis: Vector
    radius: float
    hollow: bool = False
    teeth: bool = False
    shows_body: ClassVar[bool] = True

    @property
    def hollow_disc(self) -> Disc | None:
        return self if self.hollow else None

    @property
    def bounds(self) -> Floats:
        return circle(self.centre, self.axis, self.radius)


@dataclass(frozen=True)
class Sphere(_Form):
    """A ball; `hollow` is a shell, or a bowl that is touched inside."""

    centre: Vector
    radius: float
    hollow: bool = False
    shows_body: ClassVar[bool] = True

    @property
    def bounds(self) -> Floats:
        offsets = self.radius * np.vstack([np.eye(3), -np.eye(3)])
        return np.asarray(np.array(self.centre) + offsets)


@dataclass(frozen=True)
class Block(_Form):
    """A box about a centre; the columns of `rotation` are the directions of its edges, `sizes` their lengths."""

    centre: Vector
    rotation: tuple[Vector, Vector, Vector]
    sizes: Vector

    @property
    def bounds(self) -> Floats:
        """Its corners (8, 3), the first index slowest in z: 0 to 3 the bottom around, 4 to 7 the top."""
        square = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        signs = np.array([(x, y, z) for z in (-1, 1) for x, y in square], dtype=float)
        return np.asarray(np.array(self.centre) + (signs * np.array(self.sizes) / 2.0) @ np.array(self.rotation).T)


@dataclass(frozen=True)
class Barrel(_Form):
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
class ConeBody(_Form):
    """A cone that stands on its `tip`: a top, as high as `height` along the unit axis, where it has its radius."""

    tip: Vector
    axis: Vector
    radius: float
    height: float

    @property
    def bounds(self) -> Floats:
        """Its tip, then the circle of its top (n, 3)."""
        top = np.array(self.tip) + self.height * np.array(self.axis)
        return np.vstack([self.tip, circle(top, self.axis, self.radius)])


@dataclass(frozen=True)
class Face(_Form):
    """A plane: a line (in space a sheet) with hatching on the side away from its normal.

    Without `ends` it goes as far as the picture does. A body with it `rides` on wheels or is a belt, or does neither.
    """

    through: Vector
    normal: Vector
    ends: tuple[Vector, Vector] | None = None
    rides: str = ""
    shows_body: ClassVar[bool] = True
    sized: ClassVar[bool] = False
    guides: ClassVar[bool] = True

    @property
    def face(self) -> Face | None:
        return self

    @property
    def bounds(self) -> Floats:
        """The place that it goes through, and its ends (n, 3)."""
        return np.array([self.through] if self.ends is None else self.ends)

    @property
    def endless(self) -> bool:
        return self.ends is None


@dataclass(frozen=True)
class Rail(_Form):
    """What a slider runs along: a line through a place, seen from `reach[0]` to `reach[1]` (m) along its unit axis.

    A `light` one is the way of what hangs there, where a figure has no rail; a `bar` goes through what slides, a ring.
    A `polar` one is the distance of a free particle, a dashed line.
    """

    at: Vector
    axis: Vector
    reach: tuple[float, float]
    light: bool = False
    bar: bool = False
    polar: bool = False
    sized: ClassVar[bool] = False
    guides: ClassVar[bool] = True

    @property
    def bounds(self) -> Floats:
        return np.asarray(np.array(self.at) + np.outer(self.reach, self.axis))


@dataclass(frozen=True)
class Stop(_Form):
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
        return np.asarray(np.array([self.at]) + self.front * np.array(self.axis))


@dataclass(frozen=True)
class TurnStop(_Form):
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
        return np.array([self.at])


@dataclass(frozen=True)
class Symbol(_Form):
    """A sign of a `kind` at a place, whose size is the page's affair, with an axis and a direction along which it lies.

    The kinds are the keys of `SYMBOLS` in `marks/symbols.py`.
    """

    kind: str
    at: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    along: Vector = (1.0, 0.0, 0.0)
    sized: ClassVar[bool] = False

    @property
    def bounds(self) -> Floats:
        return np.array([self.at])

    @property
    def symbol(self) -> Symbol:
        return self


@dataclass(frozen=True)
class Bowl(_Form):
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
        (side,) = rim(self.axis, np.array([angle]))
        profile = np.array(self.profile)
        return np.asarray(np.array(self.centre) + np.outer(profile[:, 0], side) + np.outer(profile[:, 1], self.axis))


@dataclass(frozen=True)
class Axes(_Form):
    """The directions along which something moves freely, with the names of its coordinates; those of turns last.

    Those of the equation of a curve are drawn always (`of_equation`).
    """

    at: Vector
    axes: tuple[Vector, ...]
    names: tuple[str, ...]
    of_equation: bool = False
    sized: ClassVar[bool] = False

    @property
    def bounds(self) -> Floats:
        return np.array([self.at])


Form = Axes | Bowl | Polyline | Disc | Sphere | Block | Barrel | ConeBody | Face | Rail | Stop | Symbol | TurnStop


# ----------------------------------------------------------------------------------------------------------------------

BLOCKS: Final = ("block", "wagon", "belt", "rocket", "pile")
"""The symbols of masses without a size that lie or hang as a block does."""
GROUND: Final = -1
"""The body of what stands in the world; poses have it at their end."""
Role = Literal[
    "body", "joint", "guide", "ground", "surface", "pulley", "gear", "contact", "mass centre", "frame", "point",
    "limit", "force", "stop", "drum", "flow",
]
Path = tuple[str, ...]


@dataclass(frozen=True)
class Item:
    """A form on a body: what it is (`role`), its name and label, the `path` where the model declares it.

    A joint's item stands on its parent or its child; `bodies` are both, in that order. `on_ground` where what carries
    it is ground. `touching` are the names of what touches in a contact, a body each or a part of it. `letters` are
    those of the problem, such as of a mass or of coefficients; `titled` says that the label is the problem's too,
    `heavy` that the body has a mass.
    """

    role: Role
    name: str
    label: str
    path: Path
    body: int
    form: Form
    bodies: tuple[int, ...] = ()
    on_ground: bool = False
    touching: tuple[str, ...] = ()
    letters: str = ""
    titled: bool = False
    heavy: bool = False

    @property
    def symbol(self) -> Symbol | None:
        return self.form.symbol


@dataclass(frozen=True)
class Anchor:
    """A point of a body, in its axes."""

    body: int
    point: Vector


@dataclass(frozen=True)
class Strand:
    """What runs between bodies: `kind` is spring, damper, spring_damper, rope, rod, pull, potential, attraction, tie.

    From end to end of `anchors` in a straight line, or for a rope by its `rope`, a number among those of the scene.
    How long a `loose` one is drawn is the page's affair: it is declared in a slider, without a length. `letters` and
    `titled` as of an Item; those of the damper beside a spring are its `damping`.
    """

    kind: str
    name: str
    label: str
    path: Path
    anchors: tuple[Anchor, ...]
    rope: int | None = None
    loose: bool = False
    letters: str = ""
    damping: str = ""
    titled: bool = False


@dataclass(frozen=True)
class NamedLength:
    """A named length between two points, or a coordinate along a way (`coordinate`).

    `component` is the one of a point of the body, sign and all, whose size the label is. At the start the label is
    `start_label` where the model gives a letter to the coordinate then. One that is `unnamed` has its joint's name.
    What is measured reaches as far as `beyond` (a vector in the axes of the body of a) to both sides in the plane.
    """

    name: str
    label: str
    a: Anchor
    b: Anchor
    coordinate: bool = False
    radius: bool = False
    component: str = ""
    start_label: str = ""
    unnamed: bool = False
    beyond: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class AngleMark:
    """A named angle at a point: from a direction of one body to a direction of another, about an axis of the first.

    An axis that is zero is the one across both. At the start its label is `start_label` where the model gives that
    angle a letter; without a `label` it is no angle later. One that is `unnamed` has the name of its joint.
    """

    name: str
    label: str
    at: Anchor
    start: Anchor
    stop: Anchor
    axis: Vector
    coordinate: bool = True
    start_label: str = ""
    unnamed: bool = False


@dataclass(frozen=True)
class ArrowItem:
    """An arrow at a point of a body: gravity, a force, torque, motion of ground, impulse; its vector is in the world.

    `vector` is what it was at the start; at another state `Placed.vectors` has it, by its place among the arrows.
    `way` is the direction in which it counts, by which it is seen while it is zero; zero where it has several. What is
    `open` is not unique: others would do as well. `lever` (m) is the couple of a force over its size, in the world: its
    line of action passes the point at that distance, as that of a thread which leaves a drum does. A force at an
    `angle` (its letter) from an axis of a body has that axis as `beside`. One of the row of a distributed load has its
    `share` of the longest of the row. A velocity that is `turning` is an angular one.
    """

    role: Literal["gravity", "force", "torque", "motion", "impulse", "couple", "drag", "velocity", "reaction"]
    name: str
    label: str
    path: Path
    at: Anchor
    vector: Vector
    way: Vector = ZERO
    open: bool = False
    lever: Vector = ZERO
    angle: str = ""
    beside: Anchor | None = None
    share: float | None = None
    turning: bool = False


@dataclass(frozen=True)
class Bow:
    """The part of a rope around a wheel (world): from `start` by `angle` (rad, positive about `axis`)."""

    centre: Vector
    axis: Vector
    radius: float
    start: Vector
    angle: float

    def points(self, step: float = np.pi / 60.0) -> Floats:
        """Return points of it, at most `step` (rad) apart (n, 3)."""
        count = max(2, int(np.ceil(abs(self.angle) / step)) + 1)
        return self.at(np.linspace(0.0, self.angle, count))

    def at(self, angles: Floats) -> Floats:
        """Return its points (n, 3) at angles (n,) from its start."""
        e1 = np.array(self.start) - np.array(self.centre)
        e2 = np.cross(self.axis, e1)
        cosines, sines = np.cos(angles)[:, None], np.sin(angles)[:, None]
        return np.asarray(np.array(self.centre) + cosines * e1 + sines * e2)


@dataclass(frozen=True)
class PlacedStrand:
    """A strand in the world: straight pieces (n, 2, 3), and a bow between each two, from end to end.

    Where it bends at a point the bow's radius and angle are zero; `turns` are those that have one. `wound` are bows of
    what is wound on drums, which do not count to the rope's length.
    """

    strand: Strand
    pieces: Floats
    bows: tuple[Bow, ...] = ()
    wound: tuple[Bow, ...] = ()

    @property
    def turns(self) -> tuple[Bow, ...]:
        """The bows on wheels with a radius."""
        return tuple(bow for bow in self.bows if bow.radius > 0.0)

    @property
    def length(self) -> float:
        """The length of all pieces and bows."""
        straight = float(np.linalg.norm(self.pieces[:, 1] - self.pieces[:, 0], axis=1).sum())
        return straight + sum(bow.radius * abs(bow.angle) for bow in self.bows)


@dataclass(frozen=True)
class View:
    """How a scene is looked at: unit vectors to the right and up on the page (world)."""

    right: Vector
    up: Vector

    @property
    def towards(self) -> Vector:
        """The unit vector from the page to the reader."""
        return vector(np.cross(self.right, self.up))

    def project(self, points: Floats) -> Floats:
        """Return where points (.., 3) are on the page (.., 2), in m."""
        return np.asarray(np.asarray(points, dtype=float) @ np.array([self.right, self.up]).T)


@dataclass(frozen=True, eq=False)
class Placed:
    """A scene at a state: `poses` (nb + 1, 3, 4) have the rotation and the position of each body, the last the world.

    `strands` and `vectors` (of arrows) are in the order of the scene.
    """

    time: float
    poses: Floats
    strands: tuple[PlacedStrand, ...]
    vectors: Floats
    values: Mapping[str, float] = field(default_factory=dict)

    def point(self, anchor: Anchor) -> Floats:
        """Return where a point of a body is (3)."""
        return np.asarray(self.world(anchor.body, np.array([anchor.point]))[0])

    def world(self, body: int, points: Floats) -> Floats:
        """Return points (n, 3) in the axes of a body as points in the world."""
        pose = self.poses[body]
        return np.asarray(np.asarray(points, dtype=float) @ pose[:, :3].T + pose[:, 3])

    def turned(self, body: int, direction: Values) -> Floats:
        """Return a direction (3) in the axes of a body as one in the world."""
        return np.asarray(self.poses[body][:, :3] @ np.asarray(direction, dtype=float))
