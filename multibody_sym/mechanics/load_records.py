"""Loads: forces with their places found."""

from __future__ import annotations

from abc import ABC, abstractmethod

from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, quantity


@dataclass(frozen=True)
class Load(ABC):
    """A force with its place: what all that handles loads asks of one. What it exerts is in `mechanics/forces.py`."""

    name: str

    @property
    @abstractmethod
    def points(self) -> tuple[Marker, ...]:
        """The points of bodies at which it acts."""

    @property
    @abstractmethod
    def axes_of(self) -> int | None:
        """The body along whose axes it is given; None where it is given along none, or those of its points."""

    @property
    @abstractmethod
    def spring(self) -> tuple[Node, Node] | None:
        """The stiffness and the rest length or angle of a spring."""

    @property
    @abstractmethod
    def only_brakes(self) -> bool:
        """Whether it never does positive work."""

    @property
    def energy(self) -> Node | None:
        """The potential energy as an expression, in leaves of its own; None of springs, and where there is none."""
        return None

    @property
    @abstractmethod
    def line(self) -> tuple[Marker, Marker] | None:
        """The points along whose line it acts, where that needs a direction."""


    @property
    def path(self) -> tuple[str, str]:
        """Where the model declares it."""
        return "forces", self.name


class _NoSpring(Load):
    """A load that is no spring."""

    @property
    def spring(self) -> tuple[Node, Node] | None:
        return None

    @property
    def only_brakes(self) -> bool:
        return False


class _Somewhere(Load):
    """A load that does not act along a line between points."""

    @property
    def line(self) -> tuple[Marker, Marker] | None:
        return None


@dataclass(frozen=True)
class PointForce(_NoSpring, _Somewhere):
    """A force with components along the axes of body `axes`, acting at a marker."""

    name: str
    at: Marker
    value: Point
    axes: int

    @property
    def points(self) -> tuple[Marker, ...]:
        return (self.at,)

    @property
    def axes_of(self) -> int | None:
        return self.axes


@dataclass(frozen=True)
class BodyTorque(_NoSpring, _Somewhere):
    """A torque with components along the axes of body `axes`, acting on a body."""

    name: str
    body: int
    value: Point
    axes: int

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def axes_of(self) -> int | None:
        return self.axes


@dataclass(frozen=True)
class JointForce(_NoSpring, _Somewhere):
    """A generalised force on a freedom of a joint (on the child and back on the parent), whose `rate` is linear in u.

    Its generalised force on speed k is value d(rate)/du_k.
    """

    name: str
    joint: str
    rate: Node
    value: Node

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def axes_of(self) -> int | None:
        return None


@dataclass(frozen=True)
class PointSpring(Load):
    """A spring and damper in parallel that pull two markers together.

    `straight` is its direction (world) from the first marker to the second, where that is known and constant.
    """

    name: str
    ends: tuple[Marker, Marker]
    stiffness: Node
    damping: Node
    length: Node
    straight: Point | None = None

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.ends

    @property
    def axes_of(self) -> int | None:
        return None

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
class JointSpring(_Somewhere):
    """A spring and damper in parallel on a freedom of a joint: its `coordinate`, and its `rate`, linear in u."""

    name: str
    joint: str
    coordinate: Node
    rate: Node
    stiffness: Node
    damping: Node
    rest: Node

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def axes_of(self) -> int | None:
        return None

    @property
    def spring(self) -> tuple[Node, Node] | None:
        return self.stiffness, self.rest

    @property
    def only_brakes(self) -> bool:
        return self.stiffness is ZERO


@dataclass(frozen=True)
class PointDrag(_NoSpring, _Somewhere):
    """F = -(linear + quadratic |v|) v at a marker that moves with v."""

    name: str
    at: Marker
    linear: Node
    quadratic: Node

    @property
    def points(self) -> tuple[Marker, ...]:
        return (self.at,)

    @property
    def axes_of(self) -> int | None:
        return None

    @property
    def only_brakes(self) -> bool:
        return True


@dataclass(frozen=True)
class PointPull(_NoSpring):
    """A force that pulls two markers together; `value` names their distance and its rate as `span_leaves` do.

    `straight` as for springs. `potential` is the energy whose slope it is, if it has one.
    """

    name: str
    ends: tuple[Marker, Marker]
    value: Node
    straight: Point | None = None
    potential: Node | None = None

    @property
    def energy(self) -> Node | None:
        return self.potential

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.ends

    @property
    def axes_of(self) -> int | None:
        return None

    @property
    def line(self) -> tuple[Marker, Marker] | None:
        return self.ends


@dataclass(frozen=True)
class JointPotential(_NoSpring, _Somewhere):
    """A potential of a joint's coordinates: `value` V in slots, and (rate, dV/dq) of each coordinate it names.

    Of one that several joints share, each has its own rates, and the first the energy.
    """

    name: str
    joint: str
    value: Node
    slopes: tuple[tuple[Node, Node], ...]

    @property
    def energy(self) -> Node | None:
        return self.value

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def axes_of(self) -> int | None:
        return None


@dataclass(frozen=True)
class PlacePotential(_NoSpring, _Somewhere):
    """A potential of the place of a marker in the frame of another: `value` V names x, y, z as `place_leaves` do.

    `slopes` are dV/dx, dV/dy, dV/dz.
    """

    name: str
    at: Marker
    frame: Marker
    value: Node
    slopes: tuple[Node, Node, Node]

    @property
    def energy(self) -> Node | None:
        return self.value

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.at, self.frame

    @property
    def axes_of(self) -> int | None:
        return None


def place_leaves(load: str) -> tuple[Node, Node, Node]:
    """Return the leaves that stand for the place of the point on which a potential depends."""
    return quantity("place", (load, "x")), quantity("place", (load, "y")), quantity("place", (load, "z"))


@dataclass(frozen=True)
class MassFlow(_NoSpring, _Somewhere):
    """What leaves or joins the `body` of this name, whose mass varies.

    It moves with a `velocity` along the axes of body `axes`, `relative` to the body where it leaves or joins, else to
    inertial space. All of it passes the marker `at`; without one it leaves or joins where the mass is lost or gained.
    """

    name: str
    body: int
    velocity: Point
    relative: bool
    axes: int
    at: Marker | None = None

    @property
    def points(self) -> tuple[Marker, ...]:
        return () if self.at is None else (self.at,)

    @property
    def axes_of(self) -> int | None:
        return self.axes

    @property
    def path(self) -> tuple[str, str]:
        return "bodies", self.name


def span_leaves(load: str) -> tuple[Node, Node]:
    """Return the leaves that stand for the distance of the points that a load pulls together, and for its rate."""
    return quantity("span", (load,)), quantity("span_rate", (load,))
