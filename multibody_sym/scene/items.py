"""The records of a scene: items on one body, strands between bodies, dimensions, angles, arrows; and where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Final, Literal

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scene.forms import ZERO, Form, Values, Vector

GROUND: Final = -1
"""The body of what stands in the world; poses have it at their end."""
Role = Literal[
    "body", "joint", "guide", "ground", "surface", "pulley", "gear", "contact", "mass centre", "frame", "point",
    "limit", "force", "stop",
]
Path = tuple[str, ...]


@dataclass(frozen=True)
class Item:
    """A form on a body: what it is (`role`), its name and label, the `path` where the model declares it.

    A joint's item stands on its parent or its child; `bodies` are both, in that order. `on_ground` where what carries
    it is ground. `touching` are the names of what touches in a contact, a body each or a part of it.
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


@dataclass(frozen=True)
class Anchor:
    """A point of a body, in its axes."""

    body: int
    point: Vector


@dataclass(frozen=True)
class Strand:
    """What runs between bodies: `kind` is spring, damper, spring_damper, rope, rod, pull, potential, attraction, tie.

    From end to end of `anchors` in a straight line, or for a rope by its `rope`, a number among those of the scene.
    How long a `loose` one is drawn is the page's affair: it is declared in a slider, without a length.
    """

    kind: str
    name: str
    label: str
    path: Path
    anchors: tuple[Anchor, ...]
    rope: int | None = None
    loose: bool = False


@dataclass(frozen=True)
class Dimension:
    """A named length between two points, or a coordinate along a way (`coordinate`).

    `component` is the one of a point of the body, sign and all, whose size the label is.
    """

    name: str
    label: str
    a: Anchor
    b: Anchor
    coordinate: bool = False
    radius: bool = False
    component: str = ""


@dataclass(frozen=True)
class AngleMark:
    """A named angle at a point: from a direction of one body to a direction of another, about an axis of the first."""

    name: str
    label: str
    at: Anchor
    start: Anchor
    stop: Anchor
    axis: Vector
    coordinate: bool = True


@dataclass(frozen=True)
class ArrowItem:
    """An arrow at a point of a body: gravity, a force, torque, motion of ground, impulse; its vector is in the world.

    `vector` is what it was at the start; at another state `Placed.vectors` has it, by its place among the arrows.
    `way` is the direction in which it counts, by which it is seen while it is zero; zero where it has several. What is
    `open` is not unique: others would do as well.
    """

    role: Literal["gravity", "force", "torque", "motion", "impulse", "couple", "drag", "velocity", "reaction"]
    name: str
    label: str
    path: Path
    at: Anchor
    vector: Vector
    way: Vector = ZERO
    open: bool = False


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
        angles = np.linspace(0.0, self.angle, count)[:, None]
        e1 = np.array(self.start) - np.array(self.centre)
        e2 = np.cross(self.axis, e1)
        found: Floats = np.array(self.centre) + np.cos(angles) * e1 + np.sin(angles) * e2
        return found


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
        x, y, z = np.cross(self.right, self.up)
        return float(x), float(y), float(z)

    def project(self, points: Floats) -> Floats:
        """Return where points (.., 3) are on the page (.., 2), in m."""
        found: Floats = np.asarray(points, dtype=float) @ np.array([self.right, self.up]).T
        return found

    def depth(self, points: Floats) -> Floats:
        """Return how far points (.., 3) are towards the reader."""
        found: Floats = np.asarray(points, dtype=float) @ np.array(self.towards)
        return found


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
        found: Floats = self.world(anchor.body, np.array([anchor.point]))[0]
        return found

    def world(self, body: int, points: Floats) -> Floats:
        """Return points (n, 3) in the axes of a body as points in the world."""
        pose = self.poses[body]
        found: Floats = np.asarray(points, dtype=float) @ pose[:, :3].T + pose[:, 3]
        return found

    def turned(self, body: int, direction: Values) -> Floats:
        """Return a direction (3) in the axes of a body as one in the world."""
        found: Floats = self.poses[body][:, :3] @ np.asarray(direction, dtype=float)
        return found
