"""Loads: forces with their places. Each kind answers the questions of `Load`; `mechanics/forces.py` exerts them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, quantity


@dataclass(frozen=True)
class Load(ABC):
    """A force with its place; `vectors` names the fields that are given along the axes of a body (`axes_of`)."""

    vectors: ClassVar[tuple[str, ...]] = ()

    name: str

    @property
    @abstractmethod
    def points(self) -> tuple[Marker, ...]:
        """The points of bodies at which it acts."""

    @property
    def axes_of(self) -> int | None:
        """The body along whose `axes` its `vectors` are given; None of those that have none."""
        return getattr(self, "axes", None)

    @property
    def spring(self) -> tuple[Node, Node] | None:
        """The stiffness and the rest length or angle of a spring."""
        return None

    @property
    def only_brakes(self) -> bool:
        """Whether it never does positive work."""
        return False

    @property
    def energy(self) -> Node | None:
        """The potential energy as an expression, in leaves of its own; None of springs, and where there is none."""
        return None

    @property
    def line(self) -> tuple[Marker, Marker] | None:
        """The points along whose line it acts, where that needs a direction."""
        return None

    @property
    def path(self) -> tuple[str, str]:
        """Where the model declares it."""
        return "forces", self.name


@dataclass(frozen=True)
class _InJoint:
    """What acts on freedoms of a joint, on the child and back on the parent."""

    points: ClassVar[tuple[Marker, ...]] = ()

    joint: str


@dataclass(frozen=True)
class _AtMarker:
    """What acts at a marker."""

    at: Marker

    @property
    def points(self) -> tuple[Marker, ...]:
        return (self.at,)


@dataclass(frozen=True)
class _BetweenMarkers:
    """What acts on two markers, or along the line from the first to the second."""

    ends: tuple[Marker, Marker]

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.ends


@dataclass(frozen=True)
class PointForce(_AtMarker, Load):
    """A force with components along the axes of body `axes`, acting at a marker."""

    vectors: ClassVar[tuple[str, ...]] = ("value",)

    value: Point
    axes: int


@dataclass(frozen=True)
class LineLoad(_BetweenMarkers, Load):
    """A force for each metre between two markers of a body, with components along the axes of body `axes`.

    `value` names the distance s from the first marker as `arc_leaf` does. `forces` (N) and `moments` (N m) are its
    integrals, and those of s times it, from 0 to s, component by component. `length` is the distance of the markers.
    """

    vectors: ClassVar[tuple[str, ...]] = ("value", "forces", "moments")

    value: Point
    axes: int
    forces: Point
    moments: Point
    length: Node


@dataclass(frozen=True)
class BodyTorque(Load):
    """A torque with components along the axes of body `axes`, acting on a body, at a marker where one is declared."""

    vectors: ClassVar[tuple[str, ...]] = ("value",)

    body: int
    value: Point
    axes: int
    at: Marker | None = None

    @property
    def points(self) -> tuple[Marker, ...]:
        return () if self.at is None else (self.at,)


@dataclass(frozen=True)
class JointForce(_InJoint, Load):
    """A generalised force on a freedom of a joint, whose `rate` is linear in u.

    Its generalised force on speed k is value d(rate)/du_k.
    """

    rate: Node
    value: Node


@dataclass(frozen=True)
class PointSpring(_BetweenMarkers, Load):
    """A spring and damper in parallel that pull two markers together.

    `straight` is its direction (world) from the first marker to the second, where that is known and constant.
    """

    stiffness: Node
    damping: Node
    length: Node
    straight: Point | None = None

    @property
    def spring(self) -> tuple[Node, Node] | None:
        return self.stiffness, self.length

    @property
    def only_brakes(self) -> bool:
        return self.stiffness is ZERO

    @property
    def line(self) -> tuple[Marker, Marker] | None:
        return None if self.length is ZERO and self.damping is ZERO else self.ends


@dataclass(frozen=True)
class JointSpring(_InJoint, Load):
    """A spring and damper in parallel on a freedom of a joint: its `coordinate`, and its `rate`, linear in u."""

    coordinate: Node
    rate: Node
    stiffness: Node
    damping: Node
    rest: Node

    @property
    def spring(self) -> tuple[Node, Node] | None:
        return self.stiffness, self.rest

    @property
    def only_brakes(self) -> bool:
        return self.stiffness is ZERO


@dataclass(frozen=True)
class PointDrag(_AtMarker, Load):
    """F = -(linear + quadratic |v|) v at a marker that moves with v."""

    only_brakes: ClassVar[bool] = True

    linear: Node
    quadratic: Node


@dataclass(frozen=True)
class PointPull(_BetweenMarkers, Load):
    """A force that pulls two markers together; `value` names their distance and its rate as `span_leaves` do.

    `straight` as for springs. `potential` is the energy whose slope it is, if it has one.
    """

    value: Node
    straight: Point | None = None
    potential: Node | None = None

    @property
    def energy(self) -> Node | None:
        return self.potential

    @property
    def line(self) -> tuple[Marker, Marker] | None:
        return self.ends


@dataclass(frozen=True)
class JointPotential(_InJoint, Load):
    """A potential of a joint's coordinates: `value` V in slots, and (rate, dV/dq) of each coordinate it names.

    Of one that several joints share, each has its own rates, and the first the energy.
    """

    value: Node
    slopes: tuple[tuple[Node, Node], ...]

    @property
    def energy(self) -> Node | None:
        return self.value


@dataclass(frozen=True)
class PlacePotential(_AtMarker, Load):
    """A potential of the place of a marker in the frame of another: `value` V names x, y, z as `place_leaves` do.

    `slopes` are dV/dx, dV/dy, dV/dz.
    """

    frame: Marker
    value: Node
    slopes: tuple[Node, Node, Node]

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.at, self.frame

    @property
    def energy(self) -> Node | None:
        return self.value


@dataclass(frozen=True)
class MassFlow(Load):
    """The flow of mass that leaves or joins the `body` of this name, whose mass varies.

    It moves with a `velocity` along the axes of body `axes`, `relative` to the body where it leaves or joins, else to
    inertial space. All of it passes the marker `at`; without one it leaves or joins where the mass is lost or gained.
    """

    vectors: ClassVar[tuple[str, ...]] = ("velocity",)

    body: int
    velocity: Point
    relative: bool
    axes: int
    at: Marker | None = None

    @property
    def points(self) -> tuple[Marker, ...]:
        return () if self.at is None else (self.at,)

    @property
    def path(self) -> tuple[str, str]:
        return "bodies", self.name


def place_leaves(load: str) -> tuple[Node, Node, Node]:
    """Return the leaves that stand for the place of the point on which a potential depends."""
    return quantity("place", (load, "x")), quantity("place", (load, "y")), quantity("place", (load, "z"))


def arc_leaf(load: str) -> Node:
    """Return the leaf that stands for the distance s from the first point of the line along which a load acts."""
    return quantity("arc", (load,))


def span_leaves(load: str) -> tuple[Node, Node]:
    """Return the leaves that stand for the distance of the points that a load pulls together, and for its rate."""
    return quantity("span", (load,)), quantity("span_rate", (load,))
