"""Constants of a run: what is measured at its start and then kept, in the parameter vector beside what is declared."""

from __future__ import annotations

from typing import ClassVar

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class RopeSide:
    """On which side of a wheel a rope runs: 1 where it turns to the left about its axis, -1 to the right.

    The centre is inside the bend; 0 where the rope runs straight back, or its neighbours are in line with the centre.
    """

    rope: str
    pulley: str
    unit: ClassVar[str] = "1"


@dataclass(frozen=True)
class RopeLength:
    """How long the path of a rope is, for ropes that declare no length; `row` is the name of its row.

    Where it `winds` on wheels, whose turning counts to it, it may be of either sign.
    """

    row: str
    winds: bool = False
    unit: ClassVar[str] = "m"


@dataclass(frozen=True)
class TangentDirection:
    """At what angle from its grip's `across` a run of rope leaves a wheel, at the end (0 or 1) of the row's path."""

    row: str
    end: int
    unit: ClassVar[str] = "rad"


@dataclass(frozen=True)
class WrapAngle:
    """Around how much of a rough wheel a rope lies, full turns included; `row` is that of its slip."""

    row: str
    unit: ClassVar[str] = "rad"


@dataclass(frozen=True)
class TangentAngle:
    """By how much the tangent t1 of a plane on a body that turns leads `across` about `normal` (plane's body's axes).

    At the start t1 is ground's x as far as it lies in the plane, or its y where x is normal to the plane; then the body
    carries it along. Both vectors are of length one and normal to each other.
    """

    plane: Marker
    normal: Point
    across: Point
    unit: ClassVar[str] = "rad"


Measure = RopeSide | RopeLength | TangentDirection | WrapAngle | TangentAngle
