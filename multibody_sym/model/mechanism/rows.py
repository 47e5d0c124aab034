"""Rows: what each scalar constraint equation says, and which of them stand for joints that were cut.

Each kind has the `unit` of its multiplier in SI; None where its expression, `zero`, gives it one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import NOWHERE, Marker
from multibody_sym.model.mechanism.mass import ORIGIN
from multibody_sym.scalars.node import ZERO, Node


@dataclass(frozen=True)
class DistanceRow:
    """phi = value - |a - b|; the multiplier is the tension."""

    unit: ClassVar[str | None] = "N"

    name: str
    ends: tuple[Marker, Marker]
    value: Node


@dataclass(frozen=True)
class Bend:
    """A place on a rope's path: a marker, and the pulley's radius and axis where it is a wheel."""

    at: Marker
    radius: Node
    axis: Point


@dataclass(frozen=True)
class RopeRow:
    """phi = length - (length of the path); the multiplier is the tension."""

    unit: ClassVar[str | None] = "N"

    name: str
    path: tuple[Bend, ...]
    length: Node


@dataclass(frozen=True)
class ExpressionRow:
    """phi = zero, an expression of q and t; the multiplier has the unit that the expression gives it.

    With `no_place` nothing says where its force acts; otherwise it drives the joints whose coordinates it names.
    """

    unit: ClassVar[str | None] = None

    name: str
    zero: Node
    no_place: bool = False


@dataclass(frozen=True)
class GearRow(ExpressionRow):
    """The same for two wheels whose teeth touch at the `pitch` point of the body that their axes stay on.

    A unit multiplier is `force` (that body's axes) at the pitch point: times -1, 0 or 1 on each of some bodies (`on`),
    and times such a factor what each joint's child gets of it that its reaction does not (`beside`). In a tree
    (`in_tree`) these bodies are the wheels; other joints' rows hold the force back, as H is that of drives in joints.
    """

    pitch: Marker = NOWHERE
    force: Point = ORIGIN
    on: tuple[tuple[int, int], ...] = ()
    beside: tuple[tuple[str, int], ...] = ()
    in_tree: bool = True


@dataclass(frozen=True)
class VelocityRow:
    """psi = zero, an expression of q, u and t that is linear in u: a nonholonomic constraint; `no_place` as above."""

    unit: ClassVar[str | None] = None

    name: str
    zero: Node
    no_place: bool = False


@dataclass(frozen=True)
class PositionRow:
    """phi = axis . (p_M - p_F): frame M's origin stays where it is along an axis of frame F.

    The multiplier is the component of the force on M's body along the axis.
    """

    unit: ClassVar[str | None] = "N"

    name: str
    frames: tuple[Marker, Marker]
    axis: Point


@dataclass(frozen=True)
class AngleRow:
    """phi = e . d - value: a direction e of frame F and a direction d of frame M keep their angle.

    The multiplier is the moment on M's body along d x e, if that is of length one. Where frames could satisfy the row
    turned over, `shared` is an axis of both that must not point opposite ways.
    """

    unit: ClassVar[str | None] = "N*m"

    name: str
    frames: tuple[Marker, Marker]
    directions: tuple[Point, Point]
    value: Node = ZERO
    shared: Point | None = None


@dataclass(frozen=True)
class RollingRow:
    """Where a ball, or the sharp rim of a disc about `axis`, touches a plane, both bodies have one velocity `along`.

    `along` is a direction fixed in the plane's frame. Along the normal the row is holonomic (the gap stays closed);
    across it is not. The multiplier is that component of the force on the rolling body.
    """

    unit: ClassVar[str | None] = "N"

    name: str
    wheel: Marker
    axis: Point | None
    radius: Node
    plane: Marker
    normal: Point
    along: Point


Row = DistanceRow | RopeRow | ExpressionRow | VelocityRow | PositionRow | AngleRow | RollingRow


def is_holonomic(row: Row) -> bool:
    """Return whether a row restricts positions, not speeds only."""
    return not isinstance(row, VelocityRow) and (not isinstance(row, RollingRow) or row.along == row.normal)


@dataclass(frozen=True)
class Drive:
    """What row number `row` exerts on a freedom of a joint for a unit multiplier: a force `factor` on its `rate`."""

    row: int
    rate: Node
    factor: Node


@dataclass(frozen=True)
class CutJoint:
    """A joint without coordinates of its own: its frames on parent and child, and which rows stand for it.

    `drives` are what rows that name coordinates exert on its freedoms, `teeth` the rows of gears whose force at the
    teeth its reaction is without, with the factor of that force on its child.
    """

    name: str
    frames: tuple[Marker, Marker]
    rows: range
    drives: tuple[Drive, ...] = ()
    teeth: tuple[tuple[int, int], ...] = ()
