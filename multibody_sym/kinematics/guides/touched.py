"""Curves that are touched, by the foot that follows each: its normal, and the way there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import hypot, inf
from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position, velocity
from multibody_sym.kinematics.relative import angular_velocity, direction
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.contact_rows import Bent, ContactRow, Round
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, ZERO, negate
from multibody_sym.scalars.vectors import Vec, cross, subtract

_LEFT: Final[Point] = (ZERO, ONE, ZERO)
_RIGHT: Final[Point] = (ZERO, negate(ONE), ZERO)


def bent_normal(skin: Bent, motion: Motion) -> tuple[Vec, Vec]:
    """Return the normal at the foot, towards what touches the curve, and its rate (world axes)."""
    n = direction(motion, skin.foot, _LEFT if skin.left else _RIGHT)
    return n, cross(angular_velocity(motion, skin.foot.body), n)


def to_foot(skin: Bent, motion: Motion) -> tuple[Vec, Vec]:
    """Return the way from a curve's place to its foot, and its rate (world axes)."""
    arm = subtract(position(motion, skin.foot), position(motion, skin.place))
    return arm, subtract(velocity(motion, skin.foot), velocity(motion, skin.place))


@dataclass(frozen=True)
class Fit:
    """How a disc fits to a curve where it touches, or an outline into a hollow disc.

    `ratio` is the radius of what is inside by that of what is around it, both radii of curvature: 1 at the limit.
    """

    row: ContactRow
    place: Floats
    radius: float
    ratio: float
    hollow: bool

    @property
    def text(self) -> str:
        """What does not fit there, and where."""
        wheel, curve = sorted(self.row.skins, key=lambda skin: isinstance(skin, Bent))
        x, y, _ = self.place
        round_one, bend = f"{wheel.place.name} (radius {self.radius:.6g} m)", self.radius / self.ratio
        inner, outer, whose = round_one, curve.place.name, "the"
        if self.hollow:
            inner, outer, whose, bend = outer, inner, "its", self.radius * self.ratio
        return (
            f"{inner} does not fit into {outer} at ({x:.6g}, {y:.6g}) m, where {whose} radius of curvature is "
            f"{bend:.6g} m: it would touch in two places"
        )

    @property
    def advice(self) -> str:
        """How what is inside fits."""
        return f"make the radius {'larger' if self.hollow else 'smaller'}"


def fits(motion: Motion, rows: Iterable[Row]) -> Iterator[Fit]:
    """Yield how each ball or disc fits to its curve, at a state in floats."""
    for row in rows:
        if not isinstance(row, ContactRow) or row.along != "normal":
            continue
        wheel, bent = sorted(row.skins, key=lambda skin: isinstance(skin, Bent))
        if isinstance(bent, Bent) and isinstance(wheel, Round):
            place = np.array(position(motion, bent.foot), dtype=float)
            (radius,) = map(float, motion.state.values([wheel.radius]))
            bends = radius * bending(bent, motion)
            ratio = bends if not wheel.inside else -1.0 / bends if bends < 0.0 else inf
            yield Fit(row, place, radius, ratio, wheel.inside)


def bending(skin: Bent, motion: Motion) -> float:
    """Return the curvature (1/m) at the foot, positive towards what touches the curve, at a state in floats."""
    body = motion.mechanism.bodies[skin.foot.body]
    step = body.steps[0]
    assert isinstance(step, Follow)
    turning, *way = motion.state.values((*step.turning.s, *step.rates.s), {step.leaf: motion.state.q[body.q[0]]})
    return float(turning / hypot(*way)) * (1.0 if skin.left else -1.0)
