"""The path of a rope: the places where it bends, and how far wheels that it grips have turned."""

from __future__ import annotations

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node


@dataclass(frozen=True)
class Grip:
    """The end of a run of rope on a wheel that turns with it, or on a drum.

    `angle` is how far the wheel has turned about its axis in the axes of `frame`, on a body that keeps the axis, from
    wherever it is zero. There the tangent's direction is counted from `across` (a unit vector, as `axis`, normal to
    it) less `start`, what that was at the start.
    """

    frame: Marker
    axis: Point
    across: Point
    angle: Node
    start: Node


@dataclass(frozen=True)
class Bend:
    """A place on a rope's path: a marker, and the pulley's name, radius and axis where it is a wheel.

    The rope turns about the axis to the left (`side` 1) or to the right (-1); where that is not given, the start
    measures on which side the centre is inside the bend between the neighbours `beside` it. At the end of a run it may
    `grip` the wheel. It lies around it by full `turns` more. A pulley at a point is `massless`; over a `rough` one the
    rope may slip.
    """

    at: Marker
    radius: Node
    axis: Point
    pulley: str = ""
    side: Node = ZERO
    beside: tuple[Marker, Marker] | None = None
    grip: Grip | None = None
    turns: int = 0
    massless: bool = True
    rough: bool = False


def leaves_wheel(row: str, pulley: str) -> str:
    """Return what the stop is called that ends a run where a rope lies around none of a wheel any more."""
    return f"{row} leaves {pulley}"
