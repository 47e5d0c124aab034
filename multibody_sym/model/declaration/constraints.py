"""Constraints that are declared beside the joints: rods, ropes, guides, rolling, prescribed motion, expressions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Final

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.fields import Element, ListOf, MapOf, OneOf, Record, holds
from multibody_sym.model.declaration.values import Choice, Direction, Flag, Point, Scalar, Text
from multibody_sym.scalars.node import Node

_ACTS: Final = Choice(("in_joints",))


@dataclass(frozen=True)
class Distance(Element):
    """A massless rigid rod: the distance of two points equals `value`; its multiplier is the rod's tension."""

    between: tuple[str, ...] = holds(ListOf(Text(), 2, 2))
    value: Node = holds(Scalar("m"))


@dataclass(frozen=True)
class Rope(Element):
    """A massless rope from end to end of `path` over pulleys; its multiplier is the tension.

    `path` names points of bodies at both ends and pulleys or points between. Without `length` it is as long as the
    initial positions make it. It is taut, unless it may go `slack`.
    """

    path: tuple[str, ...] = holds(ListOf(Text(), 2))
    length: Node | None = holds(Scalar("m"), None)
    slack: bool = holds(Flag(), False)


@dataclass(frozen=True)
class Expression(Element):
    """A holonomic constraint: the expression of coordinates and t equals zero.

    It gives generalised forces and no place where they act, so that reactions of joints which they could reach are
    withheld; `acts="in_joints"` says that each joint is driven along its own axes.
    """

    zero: Node = holds(Scalar())
    acts: str | None = holds(_ACTS, None)


@dataclass(frozen=True)
class Gear(Element):
    """Two joints with one freedom each in mesh: q_1 = ratio q_2 + value; wheels that touch outside turn oppositely.

    The multiplier is the moment (or force) of the gear on the first joint; on the second it acts -ratio times. `acts`
    is that of `Expression`.

    With `radii`, those of wheels on revolute joints that both lead to one body, which carries them, the force acts
    where the wheels touch, across the line from axis to axis, and bearings have their reactions (what oblique flanks
    push apart is left out). Axes are parallel, or meet (bevel wheels). Of a planet in a ring that is ground, the arm's
    joint stands for the ring. `at`, a point of the carrying body, tells in which plane across the axes, or on which
    side of where these meet, wheels touch.
    """

    joints: tuple[str, ...] = holds(ListOf(Text(), 2, 2))
    ratio: Node = holds(Scalar())
    value: Node = holds(Scalar(), 0)
    acts: str | None = holds(_ACTS, None)
    radii: tuple[Node, ...] | None = holds(ListOf(Scalar("m"), 2, 2), None)
    at: str | None = holds(Text(), None)

    def verify(self) -> None:
        if self.radii is not None and self.acts is not None:
            raise ModelError("the gear's force acts at the tooth or in the joints: give radii or acts").under("acts")
        if self.radii is None and self.at is not None:
            raise ModelError("a point where wheels touch goes with radii; give them too").under("at")


@dataclass(frozen=True)
class Coupler(Element):
    """Joints with one freedom each whose coordinates are tied: the sum of factor times q over `joints` equals `value`.

    The multiplier acts on each joint as factor times its own. `acts` is that of `Expression`.
    """

    joints: Mapping[str, Node] = holds(MapOf(Scalar()))
    value: Node = holds(Scalar(), 0)
    acts: str | None = holds(_ACTS, None)

    def verify(self) -> None:
        if not self.joints:
            raise ModelError("name the joints with their factors, such as {A: 1, B: -2}").under("joints")


@dataclass(frozen=True)
class Line(Element):
    """A line on a body: `through` a point of it, along a `direction` in its axes."""

    through: str = holds(Text())
    direction: Point = holds(Direction())


@dataclass(frozen=True)
class PointOnLine(Element):
    """A point of one body stays on a line of another; both multipliers are forces on the point's body."""

    components: ClassVar[tuple[str, ...]] = ("n1", "n2")

    point: str = holds(Text())
    line: Line = holds(Record(Line))


@dataclass(frozen=True)
class Plane(Element):
    """A plane on a body: `through` a point of it, with a `normal` in its axes."""

    through: str = holds(Text())
    normal: Point = holds(Direction())


@dataclass(frozen=True)
class PointInPlane(Element):
    """A point of one body stays in a plane of another; the multiplier is the force on the point's body."""

    point: str = holds(Text())
    plane: Plane = holds(Record(Plane))


@dataclass(frozen=True)
class Rolling(Element):
    """A ball or disc (`body`, a surface of it) rolls on a plane (`on`) without slip and without lifting off.

    Its multipliers are the components of the force on the rolling body: `n` along the normal, and two across it. In a
    plane model t1 is normal x z (uphill), in space ground's x at the start as far as it lies in the plane (its y where
    the normal is x there), carried along with the plane from then on; t2 = normal x t1.
    """

    components: ClassVar[tuple[str, ...]] = ("n", "t1", "t2")

    body: str = holds(Text())
    on: str = holds(Text())


@dataclass(frozen=True)
class PrescribedMotion(Element):
    """The coordinate of a joint with one freedom follows an expression of time; the multiplier is the drive's force."""

    joint: str = holds(Text())
    value: Node = holds(Scalar())


@dataclass(frozen=True)
class VelocityConstraint(Element):
    """A nonholonomic constraint: an expression that is linear in the speeds equals zero. `acts` as for `Expression`."""

    zero: Node = holds(Scalar())
    acts: str | None = holds(_ACTS, None)


def row_names(name: str, element: Element) -> list[str]:
    """Return the names of the rows that stand for a constraint: its own, or with a component each."""
    components: tuple[str, ...] = getattr(element, "components", ())
    return [f"{name}.{component}" for component in components] or [name]


CONSTRAINTS: Final = OneOf(
    {
        "distance": Distance,
        "rope": Rope,
        "point_on_line": PointOnLine,
        "point_in_plane": PointInPlane,
        "rolling": Rolling,
        "gear": Gear,
        "coupler": Coupler,
        "motion": PrescribedMotion,
        "expression": Expression,
        "velocity": VelocityConstraint,
    },
    {},
)


@dataclass(frozen=True)
class Pulley(Element):
    """A massless, frictionless pulley at a point; without a radius the rope bends at the point itself.

    With a radius the rope lies in the plane normal to `axis` (of the body that carries it) and wraps the side on
    which the pulley's centre is inside the bend.
    """

    at: str = holds(Text())
    radius: Node = holds(Scalar("m"), 0)
    axis: Point = holds(Direction(), "z")
