"""Geometry at the start, in floats: contacts, ropes, curves and wheels.

It checks coefficients and gaps of contacts, decides on which side ropes and springs lie, measures constants such as
lengths of ropes, places feet on their curves, and reports ropes that slip over wheels.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.start.parameters import require_values
from multibody_sym.errors import ModelError, MultibodyError, at, gathered
from multibody_sym.mechanics.contact_geometry import ON_POINTS, allowed_past_end, fits, flat_rims, reach, touch
from multibody_sym.mechanics.forces import apart
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.load_records import Load, PointPull, PointSpring
from multibody_sym.mechanics.mechanism import (
    Measure,
    Mechanism,
    RopeLength,
    RopeSide,
    TangentAngle,
    TangentDirection,
    WrapAngle,
)
from multibody_sym.mechanics.motion import Motion, State, accelerations, motion_of, pose, slot_state, state_of
from multibody_sym.mechanics.points import direction, position, tangent_angle, tangent_components
from multibody_sym.mechanics.ropes import (
    Segment,
    inner_side,
    segments,
    sides,
    tangent_direction,
    wrap_angle,
)
from multibody_sym.mechanics.row_records import (
    Bent,
    ContactRow,
    ContactSurface,
    DistanceRow,
    Marker,
    PositionRow,
    RopeBend,
    RopeRow,
    RoundSurface,
    Row,
    SlidingRow,
    is_point,
)
from multibody_sym.model.bodies import IDENTITY
from multibody_sym.model.fields import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.vectors import Vec, cross, dot, scale, subtract


def verify_outside(motion: Motion, tolerance: float) -> None:
    """Raise ModelError for contacts whose bodies are inside each other by more than a tolerance (m).

    There is one error for each declared contact: that of its first part inside.
    """
    wrong, told = gathered(), set[tuple[str, str]]()
    for element, row, gap in contact_gaps(motion, tolerance):
        error = None if element.path in told else _start_inside(element, row, gap, motion, tolerance)
        if error is not None:
            told.add(element.path)
            with wrong, at(*element.path):
                raise error
    wrong.told()


def _start_inside(
    element: LawElement, row: ContactRow, gap: float, motion: Motion, tolerance: float
) -> ModelError | None:
    """Return the error of a contact that cannot begin with its gap (m); None where it can."""
    first, second = (skin.place.name for skin in row.skins)
    if gap < -tolerance:
        part = "" if element.name == element.group else f" ({element.name})"
        return ModelError(
            f"{first} starts {-gap:.6g} m inside {second}{part}; move it out along the normal "
            "(initial: {q: ..}), or correct the surface: its normal points out of its body",
            number="M114",
        )
    if gap <= tolerance and all(is_point(skin) for skin in row.skins):
        return ModelError(
            f"{first} and {second} are points and start at one place, where nothing says which way they push "
            "each other: start them apart, give one of them a surface (surfaces: {face: {plane: [0, 0, 0], "
            "normal: y}}) and name it, or let them strike there (impact: {between: [..]})",
            number="M114",
        )
    flat = next(iter(flat_rims([row], motion)), None) if gap <= tolerance else None
    return None if flat is None else ModelError(f"{flat}: {ON_POINTS}, or tilt it", number="M114")


def contact_gaps(motion: Motion, tolerance: float) -> Iterator[tuple[LawElement, ContactRow, float]]:
    """Yield each contact with its normal row and the gap (m) at a state in floats, negative inside.

    Contacts whose face ends before, by more than a tolerance (m), are left out: they do not hold there.
    """
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    for element in motion.mechanism.one_way:
        for row in element.normals:
            if not isinstance(row, ContactRow):
                continue
            beyond = min((tolerance, *map(float, allowed_past_end(row, motion))))
            if all(way >= -beyond for way in reach(row, motion)):
                yield element, row, float(touch(row.skins, motion, bias).gap)


# ----------------------------------------------------------------------------------------------------------------------
# On which side ropes and springs lie at the start, and which of their pieces keep their directions.
#
# A load that is led along its rope hangs at the distance y_pulley - y, in general a square root, as long as it stays
# on its side. Formulas use this distance; Programs do not, as they hold on every side.


_TRIALS: Final = 4
_ROUNDING: Final = 1e-11

Line = TypeVar("Line", DistanceRow, PointSpring, PointPull)


@dataclass(frozen=True)
class SignedLength:
    """The signed `length` (in slots) of a piece between two markers, which is positive on its side."""

    element: str
    ends: tuple[str, str]
    length: Node


def fix_directions(
    mechanism: Mechanism, q: Sequence[float], u: Sequence[float], parameters: Sequence[float]
) -> tuple[Mechanism, tuple[SignedLength, ...]]:
    """Return the mechanism with sides and directions as at a start (nq, nu, np), and the lengths that hold only there.

    A piece keeps its direction if that is the same for random parameters and coordinates.
    """
    found: list[SignedLength] = []
    try:
        there = motion_of(mechanism, state_of(mechanism, float, 0.0, list(q), list(u), list(parameters)))
        decider = _Decider(there, motion_of(mechanism, slot_state(mechanism)), found)
        rows = [decider.row(row) for row in mechanism.rows]
        loads = [decider.load(load) for load in mechanism.loads]
        one_way = [decider.element(element) for element in mechanism.one_way]
    except (*UNDEFINED, MultibodyError):
        return mechanism, ()
    decided = replace(mechanism, rows=tuple(rows), loads=tuple(loads), one_way=tuple(one_way))
    return decided, tuple(dict.fromkeys(found))


@dataclass
class _Decider:
    """The motion `there` in floats and `anywhere` in slots, and the sides that were found."""

    there: Motion
    anywhere: Motion
    found: list[SignedLength]

    def row(self, row: Row) -> Row:
        """Return a row; a rope or rod with its sides and directions."""
        if row.rope_run is not None:
            return self.rope(row.rope_run)
        if row.rope_slip is not None:
            return replace(row.rope_slip, rope=self.rope(row.rope_slip.rope))
        if isinstance(row, SlidingRow):
            frictions = tuple(replace(x, rows=tuple(map(self.row, x.rows))) for x in row.frictions)
            return replace(row, of=self.row(row.of), frictions=frictions)
        return self.line(row) if isinstance(row, DistanceRow) else row

    def element(self, element: LawElement) -> LawElement:
        """Return a one-way element; a rope with its sides and directions."""
        if element.kind != "rope":
            return element
        frictions = tuple(replace(part, rows=tuple(map(self.row, part.rows))) for part in element.frictions)
        return replace(element, normals=tuple(map(self.row, element.normals)), frictions=frictions)

    def load(self, load: Load) -> Load:
        """Return a load; a spring or pull with its direction."""
        if isinstance(load, PointSpring):
            return self.line(load)
        return self.line(load) if isinstance(load, PointPull) else load

    def rope(self, row: RopeRow) -> RopeRow:
        """Return a rope with the sides of its wheels, and directions of its pieces."""
        wheels = sides(self.there, row.path)
        path = tuple(
            bend if side is None else replace(bend, side=as_node(round(side)))
            for bend, side in zip(row.path, wheels, strict=True)
        )
        row = replace(row, path=path)
        here, everywhere = (segments(motion, path)[0] for motion in (self.there, self.anywhere))
        straight = tuple(self._direction(row.told[0], a, b.rims) for a, b in zip(here, everywhere, strict=True))
        ends = {0: straight[0], len(path) - 1: straight[-1]}
        path = tuple(  # where a piece keeps its direction, the one at the start does not matter
            bend if bend.grip is None or ends.get(k) is None else replace(bend, grip=replace(bend.grip, start=ZERO))
            for k, bend in enumerate(path)
        )
        return replace(row, path=path, straight=straight if any(straight) else ())

    def line(self, part: Line) -> Line:
        """Return a rod or spring with its direction, if it keeps it."""
        d = apart(self.there, part.ends)
        length = float(sqrt(dot(d, d)))
        return replace(part, straight=self._direction(part.name, Segment(part.ends, length, scale(1 / length, d)), ()))

    def _direction(self, element: str, piece: Segment, rims: Sequence[Vec]) -> Point | None:
        """Return the direction (world) that a piece keeps, if it does; `rims` are radius times axis, signed."""
        d = apart(self.anywhere, piece.ends)
        for way in self._candidates(d, piece.direction):
            along = dot(way, d)
            rest = subtract(d, scale(along, way))
            for rim in rims:
                rest = subtract(rest, cross(rim, way))
            if self._vanish([as_node(x) for x in rest]):
                first, second = piece.ends
                self.found.append(SignedLength(element, (first.name, second.name), as_node(along)))
                return way
        return None

    def _candidates(self, d: Vec, here: Vec) -> Iterator[Point]:
        """Yield unit vectors of parameters along which coordinates move the second end relative to the first."""
        nodes = [as_node(x) for x in d]
        for leaf in leaves(nodes, "slot"):
            if leaf.data[0] != "q":
                continue
            way = tangents(nodes, {leaf: ONE})
            if any(x.data[0] != "parameters" for x in leaves(way, "slot")):
                continue
            square = dot(way, way)
            if not self._vanish([as_node(square - 1)]):
                way = [x / sqrt(square) for x in way]
            sense = dot(here, self.there.state.values(way))
            if abs(abs(sense) - 1.0) <= _ROUNDING:
                x, y, z = (as_node(x if sense > 0 else -x) for x in way)
                yield x, y, z

    def _vanish(self, nodes: Sequence[Node]) -> bool:
        """Return whether expressions are zero for random parameters, coordinates and times."""
        if all(node.shadow == 0 for node in nodes):
            return True
        chance = random.Random(1)
        named = leaves(nodes, "slot")
        for _ in range(_TRIALS):
            values = {leaf: self._beside(leaf, chance) for leaf in named}
            if any(abs(x) > _ROUNDING for x in evaluate_float(nodes, values)):
                return False
        return True

    def _beside(self, leaf: Node, chance: random.Random) -> float:
        here = float(self.there.state.slots.get(leaf, 0.0))
        if leaf.data[0] == "parameters" and here:
            return here * chance.uniform(0.7, 1.4)
        return here + chance.uniform(-0.5, 0.5)


# ----------------------------------------------------------------------------------------------------------------------
# Constants of a run, measured in the assembled position: lengths and sides of ropes, angles of tangents.


_PARALLEL: Final = 1e-9


def measured_rows(mechanism: Mechanism) -> frozenset[int]:
    """Return the rows of ropes that take their lengths from the start: any position satisfies them."""
    ropes = {m.row for entry in mechanism.parameters if isinstance(m := entry.measure, RopeLength)}
    return frozenset(k for k, row in enumerate(mechanism.rows) if row.name in ropes)


def with_constants(mechanism: Mechanism, parameters: Sequence[float], q: Floats) -> list[float]:
    """Return the parameter vector (np) with constants measured in the position q (nq) in place of its zeros.

    Raises ModelError where an expression has no finite value there.
    """
    found = with_sides(mechanism, parameters, q)
    # lengths come last: what is wound counts from the direction of the tangent
    for kinds in ((TangentAngle, TangentDirection, WrapAngle), (RopeLength,)):
        found = _with_measures(mechanism, found, q, kinds)
    return found


def with_sides(mechanism: Mechanism, parameters: Sequence[float], q: Floats) -> list[float]:
    """Return the parameter vector (np) with the sides on which ropes have wheels inside their bends in a position."""
    return _with_measures(mechanism, parameters, q, (RopeSide,))


def verify_sides(mechanism: Mechanism, parameters: Sequence[float], q: Floats) -> None:
    """Raise ModelError where the sides that ropes have in a position are not those with which it was found."""
    there = with_sides(mechanism, parameters, q)
    found = (e.measure for e, x, y in zip(mechanism.parameters, parameters, there, strict=True) if x != y)
    for measure in (measure for measure in found if isinstance(measure, RopeSide)):
        with at("constraints", measure.rope, "path"):
            raise _which_side(measure.pulley, "start values and what the constraints make of them lie on both sides")


def _which_side(pulley: str, why: str) -> ModelError:
    return ModelError(
        f'{why}, so that no bend tells on which side the rope runs: wrap: {{{pulley}: "+"}} leads it counter-clockwise '
        f'about the axis, wrap: {{{pulley}: "-"}} clockwise',
        number="M115",
    )


def _with_measures(
    mechanism: Mechanism, parameters: Sequence[float], q: Floats, kinds: tuple[type[Measure], ...]
) -> list[float]:
    """Return the parameter vector (np) with the constants of some kinds of measure in the position q (nq)."""
    found = list(parameters)
    asked = [(k, entry.measure) for k, entry in enumerate(mechanism.parameters) if isinstance(entry.measure, kinds)]
    if asked:
        with require_values():
            motion = ConstraintRows(mechanism, found, []).motion(q, np.zeros(len(mechanism.speeds)))
            for place, measure in asked:
                found[place] = _measure_constant(motion, measure)
    return found


def seen_axis(motion: Motion, measure: TangentAngle) -> Point:
    """Return the axis of ground that the tangent t1 follows at a state in floats: x, or y where x is normal to it."""
    x, y, _ = IDENTITY
    return x if np.hypot(*tangent_components(motion, measure, x)) >= _PARALLEL else y


def _measure_constant(motion: Motion, measure: Measure) -> float:
    if isinstance(measure, TangentAngle):
        return float(tangent_angle(motion, measure, seen_axis(motion, measure))) + 0.0  # no -0
    slackening = [(row, element.path) for element in motion.mechanism.one_way for row in element.rows]
    taut = [(row, motion.mechanism.row_path(k)) for k, row in enumerate(motion.mechanism.rows)]
    if isinstance(measure, RopeSide):
        runs = [row.rope_run for row, _ in (*slackening, *taut) if row.rope_run is not None]
        bends = (bend for run in runs if run.told[0] == measure.rope for bend in run.path)
        return float(inner_side(motion, next(bend for bend in bends if bend.pulley == measure.pulley)))
    row, path = next((row, path) for row, path in (*slackening, *taut) if row.name == measure.row)
    with at(*path):
        if (slip := row.rope_slip) is not None:
            _verify_side(motion, slip.rope, slip.bend)
            return float(wrap_angle(motion, slip.rope, slip.bend))
        run = row.rope_run
        assert run is not None
        if isinstance(measure, TangentDirection):
            _verify_side(motion, run, -measure.end)
            return float(tangent_direction(motion, run, measure.end)) + 0.0
        return float(segments(motion, run.path)[1])


def _verify_side(motion: Motion, rope: RopeRow, bend: int) -> None:
    """Raise ModelError where nothing tells on which side of a wheel a rope runs, with both readings."""
    if sides(motion, rope.path)[bend] != 0:
        return
    name = rope.path[bend].pulley
    with at("path"):
        before = f"what comes before pulley {name} on the path and what comes behind lie in one line with its centre"
        raise _which_side(name, before)


# ----------------------------------------------------------------------------------------------------------------------
# Feet at the start: the parameters of curves that are touched or guide points.
#
# The condition of a foot, that the curve is normal to the way to it, holds at each nearest and each farthest place.
# Rows are closed from the nearest of many places along the curve.


_PLACES: Final = 360
"""How many places are looked at along a curve: a degree of an outline apart."""
_WIDE: Final = 4.0
"""How much farther than the body that touches it a curve is searched whose parameter is a length."""
_CLOSED: Final = 1e-6
"""The part of its radius by which a body may be off the curve that it touches at the start."""
_SIDES: Final = {True: 1.0, False: -1.0}


_FootPlace = tuple[list[int], list[float]]
"""Coordinates of feet and their values."""


@dataclass(frozen=True)
class _Along:
    """Places along the curve of a foot: parameters (n), positions and unit tangents (n x 3, world axes)."""

    coordinate: int
    parameters: Floats
    places: Floats
    ways: Floats

    def normals(self, skin: Bent) -> Floats:
        """Return the normals (n x 3) towards the body that touches it."""
        turned = np.column_stack([-self.ways[:, 1], self.ways[:, 0], np.zeros(len(self.ways))])
        return _SIDES[skin.left] * turned

    def lowest(self, height: Floats) -> _FootPlace:
        """Return the foot at the place of the least height (n)."""
        return [self.coordinate], [float(self.parameters[int(np.nanargmin(height))])]


def with_feet(motion: Motion, q: Floats) -> Floats:
    """Return coordinates with those of feet where their curves are nearest to the bodies they touch or guide."""
    placed, mechanism = q.copy(), motion.mechanism
    for row in (*mechanism.rows, *(row for element in mechanism.one_way for row in element.normals)):
        foot: _FootPlace | None = None
        if isinstance(row, ContactRow) and row.along == "normal":
            skins = row.skins
            bent = [skin for skin in skins if isinstance(skin, Bent)]
            if len(bent) == 2:
                foot = _between_curves(motion, bent)
            elif bent:
                foot = _on_curve(motion, bent[0], skins[1] if skins[0] is bent[0] else skins[0])
        elif isinstance(row, PositionRow) and row.name.endswith(".x"):
            marker = row.frames[0]
            if marker.body >= 0 and mechanism.bodies[marker.body].is_foot:
                foot = _nearest(motion, row.frames)
        if foot is not None:
            coordinates, parameters = foot
            placed[coordinates] = parameters
    return placed


def verify_ways(mechanism: Mechanism, state: State) -> None:
    """Raise ModelError where a curve has no value, or leads nowhere: in a cusp its bead has no direction to move in."""
    for body in mechanism.bodies:
        for free in body.free_steps:
            step = free.step.curve
            if step is None:
                continue
            s, (name, unit) = state.q[free.q[0]], step.leaf.data[1]
            with at("joints", body.joint_name, "curve"), require_values():
                *place, x, y, z = state.values((*step.place, *step.rates.s), {step.leaf: s})
                if x == y == z == 0.0:
                    listed = ", ".join(f"{x:.6g}" for x in place)
                    raise ModelError(
                        f"the curve has a cusp, or stops, at {name} = {s:.6g} {unit}, where nothing tells which way it "
                        f"leads from ({listed}) m; start beside it",
                        number="M114",
                    )


def verify_fits(motion: Motion) -> None:
    """Raise ModelError for a hollow that bends more than the ball or disc that touches it."""
    mechanism = motion.mechanism
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    paths = [(mechanism.row_path(k), row) for k, row in enumerate(mechanism.rows)]
    paths += [(element.path, row) for element in mechanism.one_way for row in element.normals]
    for path, row in paths:
        for fit in fits(motion, [row]):
            if fit.ratio >= 1.0 and touch(fit.row.skins, motion, bias).gap <= _CLOSED * fit.radius:
                with at(*path):
                    raise ModelError(f"{fit.text}; {fit.advice}, or start elsewhere", number="M114")


def _nearest(motion: Motion, frames: tuple[Marker, Marker], *, farthest: bool = False) -> _FootPlace | None:
    target = np.array(position(motion, frames[1]), dtype=float)
    along = _along(motion, frames[0], target)
    if along is None:
        return None
    away = np.linalg.norm(along.places - target, axis=1)
    return along.lowest(-away if farthest else away)


def _on_curve(motion: Motion, bent: Bent, other: ContactSurface) -> _FootPlace | None:
    """Return where an outline is lowest over a plane, or a curve nearest to a centre, or farthest from a hollow's."""
    if other.plane is None:
        return _nearest(motion, (bent.foot, other.place), farthest=isinstance(other, RoundSurface) and other.inside)
    normal = np.array(direction(motion, other.place, other.plane.normal), dtype=float)
    along = _along(motion, bent.foot, np.array(position(motion, other.place), dtype=float))
    return None if along is None else along.lowest(along.places @ normal)


def _between_curves(motion: Motion, bent: Sequence[Bent]) -> _FootPlace | None:
    """Return where two curves face each other, nearest of all."""
    first, second = bent
    centres = [np.array(position(motion, skin.place), dtype=float) for skin in bent]
    one, other = _along(motion, first.foot, centres[1]), _along(motion, second.foot, centres[0])
    if one is None or other is None:
        return None
    apart = one.places[:, None, :] - other.places[None, :, :]
    size = max(float(np.ptp(one.places, axis=0).max()), float(np.ptp(other.places, axis=0).max()))
    facing = one.normals(first) @ other.normals(second).T
    missed = np.linalg.norm(apart, axis=2) + size * (1.0 + facing)
    i, k = np.unravel_index(int(np.nanargmin(missed)), missed.shape)
    return [one.coordinate, other.coordinate], [float(one.parameters[i]), float(other.parameters[k])]


def _along(motion: Motion, foot: Marker, target: Floats) -> _Along | None:
    """Return places along the curve of a foot: once around, or as far as a target is away and more."""
    body = motion.mechanism.bodies[foot.body]
    step = body.steps[0].curve
    assert step is not None
    R, p = (np.array(x, dtype=float) for x in pose(motion.state, body.frame_on_parent))
    if body.parent >= 0:  # the pose of the frame that carries the curve
        R_WP, p_WP = (np.array(x, dtype=float) for x in motion.poses[body.parent])
        R, p = R_WP @ R, p_WP + R_WP @ p
    axes = np.array([motion.state.values(axis) for axis in step.axes], dtype=float)
    local = axes @ R.T @ (target - p)
    if step.unit == "rad":
        around, middle = 2.0 * np.pi, 0.0
    else:
        own = [k for k, x in enumerate(step.place) if x is step.leaf]
        middle = float(local[own[0]]) if own else 0.0
        around = _WIDE * max(1.0, float(np.linalg.norm(local)))
    found = []
    for s in middle + around * (np.arange(_PLACES) / _PLACES - 0.5):
        try:
            values = motion.state.values((*step.place, *step.rates.s), {step.leaf: float(s)})
        except UNDEFINED:
            continue
        found.append((s, *values))
    table = np.array([row for row in found if np.isfinite(row).all()], dtype=float)
    if not len(table):
        return None
    ways = table[:, 4:] / np.maximum(np.linalg.norm(table[:, 4:], axis=1, keepdims=True), 1e-300)
    return _Along(body.q[0], table[:, 0], p + table[:, 1:4] @ axes @ R.T, ways @ axes @ R.T)


# ----------------------------------------------------------------------------------------------------------------------
# Ropes that run over a wheel which could turn, and do not turn it: frictionless pulleys on bodies that are wheels.


_WHEEL_ROUNDING: Final = 1e-9


def slipped_wheels(mechanism: Mechanism, parameters: Sequence[float]) -> list[str]:
    """Return a remark for each rope and each wheel that it slips over; `parameters` (np) in numbers.

    A pulley's body is a wheel where its joint lets it turn about the pulley's axis with the centre at rest; one
    without a radius, only if its centre of mass is there too. A wheel whose coordinate a constraint names is tied.
    A rough pulley turns its wheel by friction.
    """
    declared = mechanism.relative or mechanism
    runs = [row.rope_run for row in declared.rows if row.rope_run is not None]
    if not any(bend.at.body >= 0 for run in runs for bend in run.path[1:-1]):
        return []
    known = {slot("parameters", k): value for k, value in enumerate(parameters)}
    q = [evaluate_float([c.initial], known)[0] for c in declared.coordinates]
    motion = motion_of(declared, state_of(declared, float, 0.0, q, [0.0] * len(declared.speeds), parameters))
    named = {leaf.data for row in declared.rows for leaf in leaves(row.laws, "slot")}
    tied = {place for array, place in named if array == "q"}
    for body in declared.bodies:
        tied.update(free.q[-1] for free in body.free_steps if any(("u", u) in named for u in free.u))
    found: dict[tuple[str, str], None] = {}
    for row in runs:
        for bend in row.path[1:-1]:
            frictionless = bend.grip is None and not bend.rough
            if frictionless and bend.at.body >= 0 and any(
                q not in tied for q in _turning_coordinates(motion, bend)
            ):
                found[row.name, motion.mechanism.bodies[bend.at.body].name] = None
    return [
        f"rope {rope} slips over {wheel} without turning it: a pulley is without friction whatever it stands on. "
        f"Let it turn with the rope (a pulley {{body: {wheel}, radius: ..}}), or put it on what carries {wheel}"
        for rope, wheel in found
    ]


def _turning_coordinates(motion: Motion, bend: RopeBend) -> Iterator[int]:
    """Yield the last coordinate of each joint step that turns a pulley's body about the pulley's axis."""
    body, moved = motion.mechanism.bodies[bend.at.body], motion.bodies[bend.at.body]
    centre = np.array(motion.point(bend.at), dtype=float)
    radius, *components = (float(x) for x in motion.state.values([bend.radius, *bend.axis]))
    com = np.array(motion.masses[bend.at.body].com, dtype=float) - centre
    axis = np.array(components)
    if radius == 0.0 and np.linalg.norm(np.cross(axis, com)) > _WHEEL_ROUNDING * (1.0 + float(np.linalg.norm(centre))):
        return
    partial = dict(zip(body.u, zip(moved.linear, moved.angular, strict=True), strict=True))
    wanted = np.concatenate([axis, np.zeros(3)])
    for free in body.free_steps:
        linear, angular = zip(*(partial[k] for k in free.u), strict=True)
        spin = np.array(angular, dtype=float)
        moving = np.array(linear, dtype=float) + np.cross(spin, centre)
        rates = np.hstack([spin, moving]).T
        missed = wanted - rates @ least_squares(rates, wanted)
        if float(np.linalg.norm(missed)) <= _WHEEL_ROUNDING:
            yield free.q[-1]
