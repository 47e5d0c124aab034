"""How large the terms are whose sum is phidot or gamma of a row: the scale that tells it from rounding, in floats.

Along a chain lengths of terms add up, whatever their directions, with sums in place of |v|, |w|, |a|, |alpha|:

    V = sum |w| |p| + |v'|,   W = sum |w'|,   A = sum (L + W^2) |p| + |a'|,   L = sum |alpha'|

p leads from the parent's origin to the body's; primes mark what a joint adds (for udot = 0).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from itertools import pairwise
from math import hypot
from typing import Final

from multibody_sym.kinematics.flat_rims import steepness
from multibody_sym.kinematics.loads import span
from multibody_sym.kinematics.motion import BodyMotion, Motion, coordinate_rates
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.relative import direction
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.kinematics.wrenches import NO_WRENCH
from multibody_sym.model.mechanism.contact_rows import LOCAL, ContactRow, Edge, Flat, Level, Rim, Round, Skin
from multibody_sym.model.mechanism.force_rows import ReactionRow
from multibody_sym.model.mechanism.impacts import JumpRow, MeetingRow
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import IDENTITY
from multibody_sym.model.mechanism.mechanism import TIME
from multibody_sym.model.mechanism.rope_rows import MeanTensionRow, RopeSlipRow
from multibody_sym.model.mechanism.rows import (
    AngleRow,
    DistanceRow,
    ExpressionRow,
    PositionRow,
    RopeRow,
    Row,
    VelocityRow,
)
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import absolute, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, slot
from multibody_sym.scalars.vectors import S, Vec, cross, dot, scale, subtract

_PARALLEL: Final = 1e-6
"""The sine of an angle below which lines that cross count as if it were this."""


@dataclass(frozen=True)
class Terms:
    """Sums of the lengths of all terms of a point's velocity `V` and acceleration `A`, of its body's `W` and `L`.

    Nodes stand in their places where they become part of a Program (`power_terms`).
    """

    V: float = 0.0
    W: float = 0.0
    A: float = 0.0
    L: float = 0.0

    @property
    def turning(self) -> float:
        """What makes a point accelerate beside another, per distance."""
        return self.L + self.W * self.W

    def at(self, distance: S) -> Terms:
        """Return the terms of a point of the same body, some distance away."""
        return Terms(self.V + self.W * distance, self.W, self.A + self.turning * distance, self.L)


def row_terms(motion: Motion) -> list[float]:
    """Return for each row of a mechanism the sum of the lengths of all terms of gamma."""
    bodies = _bodies(motion)
    return [_terms(row, motion, bodies) for row in motion.mechanism.rows]


def power_terms(motion: Motion, rows: Sequence[RowMotion]) -> list[S]:
    """Return for each row of bodies sum |f| V + |m| W: phidot is the power of a unit multiplier's wrenches (f, m).

    Over floats, and over Nodes for Programs.
    It does not vanish with H, where nothing can move a row: what bodies share of their motion cancels to rounding.
    """
    bodies = _bodies(motion)
    return [
        sum(
            _length(wrench[0]) * body.V + _length(wrench[1]) * body.W
            for body, wrench in zip(bodies, row.of_body, strict=True)
            if wrench is not NO_WRENCH
        )
        for row in rows
    ]


def _bodies(motion: Motion) -> list[Terms]:
    bodies: list[Terms] = []
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        parent = bodies[body.parent] if body.parent >= 0 else Terms()
        bodies.append(_carried(moved, parent.at(_length(moved.p_PB)), [motion.state.u[k] for k in body.u]))
    return bodies


def _carried(moved: BodyMotion, parent: Terms, speeds: Sequence[S]) -> Terms:
    rates = [absolute(x) for x in speeds]
    linear = sum(_length(v) * x for v, x in zip(moved.linear, rates, strict=True)) + _length(moved.given_linear)
    angular = sum(_length(w) * x for w, x in zip(moved.angular, rates, strict=True)) + _length(moved.given_angular)
    bias = _length(moved.linear_bias), _length(moved.angular_bias)
    return Terms(parent.V + linear, parent.W + angular, parent.A + bias[0], parent.L + bias[1])


def _length(vector: Vec) -> S:
    """Return |v|: of Nodes too, as `power_terms` are part of Programs."""
    if any(isinstance(x, Node) for x in vector):
        return sqrt(dot(vector, vector))
    return hypot(*vector)


def _of(motion: Motion, bodies: Sequence[Terms], marker: Marker) -> Terms:
    return bodies[marker.body].at(hypot(*motion.point(marker))) if marker.body >= 0 else Terms()


@singledispatch
def _terms(row: Row, motion: Motion, bodies: Sequence[Terms]) -> float:
    raise TypeError(f"the terms of {type(row).__name__} are unknown")


@_terms.register
def _(row: PositionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    frame, point = (_of(motion, bodies, marker) for marker in row.frames)
    apart = sum(hypot(*position(motion, marker)) for marker in row.frames)
    relative = point.V + frame.V + frame.W * apart
    return point.A + frame.A + frame.turning * apart + 2.0 * frame.W * relative


@_terms.register
def _(row: MeetingRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    first, second = (_of(motion, bodies, marker) for marker in row.ends)
    turning = bodies[row.frame.body].W if row.frame.body >= 0 else 0.0
    return first.A + second.A + turning * (first.V + second.V)


@_terms.register
def _(row: JumpRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _terms(row.row, motion, bodies) + abs(float(motion.state.values([row.wanted])[0]))


@_terms.register
def _(row: AngleRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    frame, other = (_of(motion, bodies, marker) for marker in row.frames)
    return frame.L + other.L + (frame.W + other.W) ** 2


@_terms.register
def _(row: DistanceRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _of_expression(motion, row.value, holonomic=True) + _stretching(motion, bodies, row.ends)


@_terms.register
def _(row: RopeRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    markers = [bend.at for bend in row.path]
    pieces = sum(_stretching(motion, bodies, ends) for ends in pairwise(markers))
    gripped = [bend for bend in row.path if bend.grip is not None and bend.at.body >= 0]
    radii = map(abs, motion.state.values([bend.radius for bend in gripped]))
    rims = [bodies[bend.at.body].turning * float(radius) for bend, radius in zip(gripped, radii, strict=True)]
    return _of_expression(motion, row.length, holonomic=True) + pieces + sum(rims)


@_terms.register
def _(row: RopeSlipRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    bend = row.rope.path[row.bend]
    radius = abs(float(motion.state.values([bend.radius])[0]))
    rim = bodies[bend.at.body].turning * radius if bend.at.body >= 0 else 0.0
    return _terms(row.rope, motion, bodies) + rim


def _stretching(motion: Motion, bodies: Sequence[Terms], ends: Sequence[Marker]) -> float:
    first, second = (_of(motion, bodies, marker) for marker in ends)
    length = float(span(motion, (ends[0], ends[1]))[0])
    return first.A + second.A + (first.V + second.V) ** 2 / length


@_terms.register
def _(row: ContactRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    first, second = (_of(motion, bodies, skin.place) for skin in row.skins)
    if all(isinstance(skin, Edge) for skin in row.skins):
        return _crossing_terms(row, motion, first, second)
    sizes = [_size(skin, motion) for skin in row.skins]
    place = sum(hypot(*position(motion, skin.place)) for skin in row.skins) + sum(sizes)
    arms = [place if isinstance(skin, (Flat, Edge)) else size for skin, size in zip(row.skins, sizes, strict=True)]
    tilting, turning = _turning(row, motion, first, second)
    speeds = first.V + second.V
    slip = speeds + first.W * arms[0] + second.W * arms[1]
    carried = first.A + second.A + first.L * arms[0] + second.L * arms[1]
    return carried + (first.W + second.W) * sum(sizes) * turning + tilting * slip + (first.W + second.W) * speeds


def _crossing_terms(row: ContactRow, motion: Motion, first: Terms, second: Terms) -> float:
    """Return the same of two lines that cross: the place of contact goes along them as fast as they are parallel."""
    apart = hypot(*subtract(*(position(motion, skin.place) for skin in row.skins)))
    steep = max(_sine(row, motion), _PARALLEL)
    turning, way = first.W + second.W, 2.0 * apart / steep**2
    passing = 8.0 * (first.V + second.V + turning * (apart + way)) / steep**4
    slip = first.V + second.V + turning * way
    carried = first.A + second.A + (first.turning + second.turning) * (way + apart)
    return carried + turning * passing + 4.0 * turning / steep * (slip + passing)


def _sine(row: ContactRow, motion: Motion) -> float:
    """Return the sine of the angle between the lines of a row's segments."""
    courses = []
    for skin in row.skins:
        assert isinstance(skin, Edge)
        whole = subtract(position(motion, skin.tip), position(motion, skin.place))
        courses.append(scale(1.0 / hypot(*whole), whole))
    return hypot(*cross(*courses))


def _size(skin: Skin, motion: Motion) -> float:
    radius = skin.radius if isinstance(skin, (Round, Rim)) else ZERO
    return abs(float(motion.state.values([radius])[0]))


def _turning(row: ContactRow, motion: Motion, first: Terms, second: Terms) -> tuple[float, float]:
    """Return how fast the normal turns, and the way from a centre to the place of contact, at most."""
    flats = [terms for skin, terms in zip(row.skins, (first, second), strict=True) if isinstance(skin, Flat)]
    if flats:
        return flats[0].W, (first.W + second.W) * max(_steepness(row, motion), 1.0)
    length = float(span(motion, (row.skins[0].place, row.skins[1].place))[0])
    bending = max(1 / length, *(_bending(skin, motion, row) for skin in row.skins))
    turning = first.W + second.W + (first.V + second.V + (first.W + second.W) * length) * bending
    return turning, turning


def _bending(skin: Skin, motion: Motion, row: ContactRow) -> float:
    """Return how much the normal of a smooth surface turns along a metre, at most, where a row's point is."""
    if not isinstance(skin, Level):
        return 0.0
    point = row.skins[0] if row.skins[1] is skin else row.skins[1]
    apart = subtract(position(motion, point.place), position(motion, skin.place))
    known = {leaf: dot(direction(motion, skin.place, axis), apart) for leaf, axis in zip(LOCAL, IDENTITY, strict=True)}
    gx, gy, gz, *second = motion.state.values([*skin.gradient, *skin.second], known)
    return 2.0 * hypot(*second) / hypot(gx, gy, gz)


def _steepness(row: ContactRow, motion: Motion) -> float:
    """Return twice the inverse sine of the angle between a rim and a plane, else 0."""
    steep = steepness(row, motion)
    return 0.0 if steep is None else 2.0 / max(steep, _PARALLEL)


@_terms.register
def _(row: SlidingRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _terms(row.normal, motion, bodies)


@_terms.register
def _(row: MeanTensionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return 0.0


@_terms.register
def _(row: ReactionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return 0.0


@_terms.register
def _(row: ExpressionRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _of_expression(motion, row.zero, holonomic=True)


@_terms.register
def _(row: VelocityRow, motion: Motion, bodies: Sequence[Terms]) -> float:
    return _of_expression(motion, row.zero, holonomic=False)


def _of_expression(motion: Motion, zero: Node, *, holonomic: bool) -> float:
    """Return sum |d(psi)/dq_i qdot_i| + |d(psi)/dt|, where psi is the rate of a holonomic row's expression."""
    mechanism = motion.mechanism
    q = [slot("q", i) for i in range(len(mechanism.coordinates))]
    qdot = coordinate_rates(mechanism, q, [slot("u", k) for k in range(len(mechanism.speeds))])
    ways: list[tuple[Node, Node]] = [(TIME, ONE), *zip(q, qdot, strict=True)]
    rates = [tangents([zero], {x: rate})[0] for x, rate in ways] if holonomic else [zero]
    parts = [tangents([psi], {x: rate})[0] for psi in rates for x, rate in ways]
    return float(sum(map(abs, motion.state.values(parts))))
