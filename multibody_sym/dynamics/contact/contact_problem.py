"""From a mechanism in motion, in numbers, to the problem of its one-way laws, and from what is found back to a mode."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.contact_laws.problem import (
    INACTIVE,
    STICKS,
    Equality,
    FrictionLaw,
    FrictionRow,
    Law,
    LawMode,
    LawProblem,
    LawState,
    LawStates,
    Unilateral,
)
from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.contact_geometry import allowed_past_end, reach
from multibody_sym.mechanics.law_elements import ACTIVE, FrictionPart, LawElement, Mode, Share, Shares
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.modes import every_row, friction_parts
from multibody_sym.mechanics.motion import Motion, motion_of, qdot_of, state_of
from multibody_sym.mechanics.points import position, velocity
from multibody_sym.mechanics.row_kinematics import RowMotion, coefficients, row_motions
from multibody_sym.mechanics.row_records import Row
from multibody_sym.program.runtime_constants import TOUCHING, ULPS
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.limits import creep_coefficient, most, sliding
from multibody_sym.scalars.linear_inequalities import Cone, Inside, inner_point
from multibody_sym.scalars.node import slot
from multibody_sym.scalars.rank import SWITCHED, least_squares, null_space, row_space

_LITTLE: Final = 1e-6
"""The part of the time that the fastest needs for the model's size over which rates are taken."""
_OF_FALLING: Final = 1e-3
"""No speed is the largest that is below this part of that after a fall through the model's size."""


@dataclass(frozen=True)
class Scale:
    """How large a model is (m) and how fast it moves (m/s): what small gaps and speeds are measured by.

    Slip in space that is slower than `unseen` (m/s) has no direction, since a run does not tell it from rest. `rtol`
    and `atol` are the tolerances of a method whose steps do not tell lower bounces from rest; `steps` is the part of
    lengths by which those of any method may err.
    """

    length: float
    speed: float
    unseen: float = 0.0
    rtol: float = 0.0
    atol: float = 0.0
    steps: float = 0.0

    @property
    def turning(self) -> float:
        """The angular velocity (rad/s) that goes with the speed."""
        return self.speed / self.length

    @property
    def time(self) -> float:
        """The time (s) in which the fastest passes the model's size; 1 s where nothing moves and nothing falls."""
        return self.length / self.speed if self.speed else 1.0


def scale_of(motion: Motion) -> Scale:
    """Return how far a body or named point is from the origin (1 m where all are at it), and how fast the fastest is.

    Speeds count as no less than a thousandth of that after a fall through the model's size; where nothing moves or
    falls, as after an acceleration by the other forces over that size.
    """
    points = [np.array(position(motion, x), dtype=float) for x in motion.mechanism.markers.values()]
    points += [np.array(p, dtype=float) for _, p in motion.poses]
    length = max((float(np.linalg.norm(p)) for p in points), default=0.0) or 1.0
    moving = [np.array(velocity(motion, x), dtype=float) for x in motion.mechanism.markers.values()]
    moving += [np.array(body.v_WB, dtype=float) for body in motion.bodies]
    turning = [length * np.array(body.w_WB, dtype=float) for body in motion.bodies]
    fastest = max((float(np.linalg.norm(v)) for v in (*moving, *turning)), default=0.0)
    falling = float(np.sqrt(np.linalg.norm(np.array(motion.gravity, dtype=float)) * length))
    speed = max(fastest, _OF_FALLING * falling)
    return Scale(length, speed or _OF_FALLING * float(np.sqrt(_largest_acceleration(motion, length) * length)))


def _largest_acceleration(motion: Motion, length: float) -> float:
    """Return the largest acceleration (m/s^2) that forces cause without rows; angular ones count by the length."""
    speeds = motion.mechanism.speeds
    try:
        found = np.array(tree_dynamics_of(motion.mechanism, motion.state).bias_acceleration, dtype=float)
    except (*UNDEFINED, np.linalg.LinAlgError, NoSolutionError):
        return 0.0
    sizes = np.array([1.0 if speed.unit == "m/s" else length for speed in speeds])
    largest = float(np.abs(found * sizes).max(initial=0.0))
    return largest if np.isfinite(largest) else 0.0


@dataclass(frozen=True)
class Numbered:
    """The rows, elements and friction parts of a mechanism in no mode, by their numbers."""

    mechanism: Mechanism

    @cached_property
    def places(self) -> dict[str, int]:
        return {row.name: k for k, row in enumerate(every_row(self.mechanism))}

    @cached_property
    def elements(self) -> dict[str, int]:
        return {element.name: k for k, element in enumerate(self.mechanism.one_way)}

    @cached_property
    def two_sided(self) -> tuple[str, ...]:
        """The names of the elements that do not only press: they may act at any time."""
        return tuple(element.name for element in self.mechanism.one_way if not element.unilateral)

    def named(self, names: Iterable[str]) -> list[LawElement]:
        """Return the elements of these names, in order."""
        numbers = {self.elements[name] for name in names if name in self.elements}
        return [self.mechanism.one_way[k] for k in sorted(numbers)]

    @cached_property
    def turning(self) -> frozenset[str]:
        """The stops whose gap is an angle."""
        units = {coordinate.joint: coordinate.unit for coordinate in self.mechanism.coordinates}
        stops = (x for x in self.mechanism.one_way if x.kind == "stop")
        return frozenset(x.name for x in stops if units.get(x.group) == "rad")

    @cached_property
    def slides(self) -> Floats:
        """Of each speed (nu,) 1 where it is in m/s, else 0."""
        return np.array([float(speed.unit == "m/s") for speed in self.mechanism.speeds])

    @cached_property
    def parts(self) -> dict[str, int]:
        return {part.name: k for k, (_, part) in enumerate(friction_parts(self.mechanism))}


@dataclass(frozen=True, eq=False)
class RowNumbers(ABC):
    """All rows of a mechanism and of its one-way elements at an instant, whether they act or not, in numbers.

    `scale` is that of the run.
    """

    laws: Numbered
    scale: Scale

    @abstractmethod
    def phi(self, row: Row) -> float:
        """Return phi of a row."""

    @abstractmethod
    def phidot(self, row: Row) -> float:
        """Return the speed along a row."""

    @abstractmethod
    def jacobian(self, row: Row) -> Floats:
        """Return H (nu,) of a row."""

    @abstractmethod
    def reach(self, element: LawElement) -> float:
        """Return how far what may touch is inside the end of a face, negative beyond it."""

    @abstractmethod
    def past_end(self, element: LawElement) -> float:
        """Return how far (m) beyond the end of a face counts as there at most."""

    @abstractmethod
    def coefficients(self, part: FrictionPart) -> tuple[float, float]:
        """Return the static and the kinetic coefficient of a part; of one that creeps both are what it has now."""

    @abstractmethod
    def restitution(self, element: LawElement) -> float:
        """Return how much of its impulse of compression an element gives back."""

    @abstractmethod
    def matrices(self, places: Sequence[int]) -> tuple[Floats, Floats, Floats, Floats]:
        """Return A, C, D and r of the rows at some places."""

    def gap(self, element: LawElement) -> float:
        return self.phi(element.normals[0])

    def rate(self, element: LawElement) -> float:
        """Return the speed at which an element opens."""
        return self.phidot(element.normals[0])

    def allowed_gap(self, element: LawElement, part: float = TOUCHING) -> float:
        """Return the gap up to which an element counts as closed; of stops of turning joints it is an angle."""
        return part * (1.0 if element.name in self.laws.turning else self.scale.length)

    def allowed_speed(self, row: Row, part: float = TOUCHING) -> float:
        """Return the speed along a row up to which it counts as being at rest: where all speeds cancel, rounding."""
        return max(part * self.fastest(row), ULPS * EPSILON * self.scale.speed)

    def fastest(self, row: Row) -> float:
        """Return the speed along a row where each of the speeds on which it depends is that of the scale."""
        return float(np.abs(self.jacobian(row)) @ self.speed_sizes)

    @cached_property
    def speed_sizes(self) -> Floats:
        """How large (nu,) speeds are in this run."""
        slides: Floats = self.laws.slides
        return slides * self.scale.speed + (1.0 - slides) * self.scale.turning

    def allowed_slip(self, part: FrictionPart, of_speed: float = TOUCHING) -> float:
        """Return the speed of slip up to which a friction part counts as being at rest."""
        seen = self.scale.unseen if len(part.rows) > 1 else 0.0
        return max(seen, *(self.allowed_speed(row, of_speed) for row in part.rows))

    def reaches(self, element: LawElement) -> bool:
        """Return whether what may touch is above the part of a face that there is, or as near as to touch its end."""
        return self.reach(element) >= -min(self.allowed_gap(element), self.past_end(element))

    def standing(self, element: LawElement) -> str:
        """Return how a unilateral element stands: `open`, `inside`, or closed: `touching`, `leaving`, `closing`."""
        gap, allowed = self.gap(element), self.allowed_gap(element)
        if gap > allowed or not self.reaches(element):
            return "open"
        if gap < -allowed:
            return "inside"
        return ("closing", "touching", "leaving")[1 + self.sense(element)]

    def sense(self, element: LawElement) -> int:
        """Return 1 where the gap of an element opens, -1 where it closes, 0 at rest."""
        rate = self.rate(element)
        return 0 if abs(rate) <= self.allowed_speed(element.normals[0]) else 1 if rate > 0.0 else -1

    def touching(self, closed: Collection[str] = ()) -> list[str]:
        """Return the unilateral elements that touch: those `closed` unless they leave, and those that stand so."""
        names = {x.name for x in self.near}.union(closed)
        standing = {x.name: self.standing(x) for x in self.laws.named(names) if x.unilateral}
        stays = {"touching", "closing"}
        return [x for x, how in standing.items() if how in stays or (x in closed and how != "leaving")]

    @property
    def near(self) -> list[LawElement]:
        """The unilateral elements whose gaps are no larger than what counts as closed."""
        return [x for x in self.laws.mechanism.one_way if x.unilateral and self.gap(x) <= self.allowed_gap(x)]

    def wedged(self, touching: Iterable[LawElement], found: LawStates) -> bool:
        """Return whether friction leaves no forces that fulfil the laws of what touches and rests, as is proved.

        Some of it collides, and each can be moved: impulses may stop its slip.
        """
        if found.states or not found.proved:
            return False
        elements = list(touching)
        rest = all(self.standing(x) == "touching" and self.allowed_speed(x.normals[0]) > 0.0 for x in elements)
        rubs = any(part.rubs for x in elements for part in x.frictions)
        return rest and rubs and any(x.collides for x in elements)

    def posed(self, closed: Collection[str]) -> PosedLaws:
        """Return the problem in which the unilateral elements named `closed` may act, and friction in joints always."""
        known, names = self._problems, frozenset(closed)
        if names not in known:
            known[names] = self._pose(names)
        return known[names]

    @cached_property
    def _problems(self) -> dict[frozenset[str], PosedLaws]:
        return {}

    def _pose(self, closed: Collection[str]) -> PosedLaws:
        mechanism = self.laws.mechanism
        elements = tuple(self.laws.named({*closed, *self.laws.two_sided}))
        rubbing = [[part for part in x.frictions if part.name in self.laws.parts] for x in elements]
        names = [row.name for row in mechanism.rows]
        for element, parts in zip(elements, rubbing, strict=True):
            names += [row.name for row in (*element.normals, *(row for part in parts for row in part.rows))]
        found = {name: k for k, name in enumerate(names)}
        laws = element_laws(zip(elements, rubbing, strict=True), found, self._friction_law)
        problem = LawProblem(*self.matrices([self.laws.places[name] for name in names]), *laws)
        return PosedLaws(mechanism, problem, elements, tuple(part for parts in rubbing for part in parts), tuple(names))

    def _friction_law(self, element: LawElement, part: FrictionPart, places: Mapping[str, int]) -> FrictionLaw:
        law = friction_law(element, part, places, self.coefficients(part))
        return replace(law, velocity=self._slip(part), held=part.enough and not element.unilateral)

    def _slip(self, part: FrictionPart) -> tuple[float, ...]:
        """Return the velocity of a part along its rows, zeros where it counts as being at rest."""
        velocity = tuple(self.phidot(row) for row in part.rows)
        allowed = self.allowed_slip(part) if part.regularised is None else 0.0
        return (0.0,) * len(velocity) if float(np.linalg.norm(velocity)) <= allowed else velocity


def element_laws(
    elements: Iterable[tuple[LawElement, Sequence[FrictionPart]]],
    places: Mapping[str, int],
    friction: Callable[[LawElement, FrictionPart, Mapping[str, int]], FrictionLaw],
) -> tuple[tuple[Law, ...], tuple[FrictionLaw, ...]]:
    """Return the laws of rows, by their places, and those of the friction of elements, of the given parts."""
    laws: list[Law] = [Equality() for _ in places]
    frictions: list[FrictionLaw] = []
    for element, parts in elements:
        if element.unilateral:
            laws[places[element.normals[0].name]] = Unilateral()
        for part in parts:
            for component, row in enumerate(part.rows):
                laws[places[row.name]] = FrictionRow(len(frictions), component)
            frictions.append(friction(element, part, places))
    return tuple(laws), tuple(frictions)


def friction_law(
    element: LawElement, part: FrictionPart, places: Mapping[str, int], coefficients: tuple[float, float]
) -> FrictionLaw:
    """Return the law of a part at rest, of rows at some places."""
    return FrictionLaw(
        tuple(places[row.name] for row in part.rows),
        tuple(places[row.name] for row in element.normals_of(part)),
        *coefficients,
        (0.0,) * len(part.rows),
        part.norm,
        part.enough,
    )


@dataclass(frozen=True, eq=False)
class OneWayRows(RowNumbers):
    """These rows over floats; `motion` is of the mechanism with the elements' rows after its own."""

    motion: Motion
    rows: tuple[RowMotion, ...]

    @property
    def mechanism(self) -> Mechanism:
        return self.laws.mechanism

    @cached_property
    def dynamics(self) -> TreeDynamics:
        return tree_dynamics_of(self.mechanism, self.motion.state)

    def of(self, rows: Sequence[Row]) -> list[RowMotion]:
        return [self.rows[self.laws.places[row.name]] for row in rows]

    def phi(self, row: Row) -> float:
        return float(self.of([row])[0].gap)

    def phidot(self, row: Row) -> float:
        return float(self.of([row])[0].phidot)

    def jacobian(self, row: Row) -> Floats:
        return np.array(self.of([row])[0].jacobian, dtype=float)

    def reach(self, element: LawElement) -> float:
        ways = reach(element.normals[0], self.motion)
        return min(map(float, ways), default=np.inf)

    def past_end(self, element: LawElement) -> float:
        found = allowed_past_end(element.normals[0], self.motion)
        return min(map(float, found), default=np.inf)

    def coefficients(self, part: FrictionPart) -> tuple[float, float]:
        static, kinetic = map(float, coefficients(self.motion, part.rows, [part.static, part.kinetic]))
        if part.regularised is None:
            return static, kinetic
        velocity = [self.phidot(row) for row in part.rows]
        now = float(creep_coefficient(kinetic, velocity, *self.motion.state.values([part.regularised])))
        return now, now

    def restitution(self, element: LawElement) -> float:
        return float(*self.motion.state.values([element.restitution]))

    def matrices(self, places: Sequence[int]) -> tuple[Floats, Floats, Floats, Floats]:
        if not places:
            nothing = np.zeros((0, len(self.mechanism.speeds)))
            return nothing, nothing, np.zeros((0, 0)), np.zeros(0)
        return weighted_rows(self.dynamics, [self.rows[k] for k in places], places)

    def later(self, step: float, udot: Floats) -> OneWayRows:
        """Return the rows a little later, to first order."""
        state = self.motion.state
        q, u = np.array(state.q, dtype=float), np.array(state.u, dtype=float)
        rates = np.array(qdot_of(state, self.mechanism), dtype=float)
        parameters = [state.slots[slot("parameters", k)] for k in range(len(self.mechanism.parameters))]
        t = float(state.slots[TIME]) + step
        moved = state_of(self.mechanism, float, t, (q + step * rates).tolist(), (u + step * udot).tolist(), parameters)
        return one_way_rows(self.mechanism, motion_of(self.mechanism, moved), self.scale)


def one_way_rows(mechanism: Mechanism, motion: Motion, scale: Scale | None = None) -> OneWayRows:
    """Return the rows of a mechanism in no mode and of all its one-way elements; `scale` is that of the run."""
    whole = replace(motion, mechanism=replace(mechanism, rows=every_row(mechanism)))
    return OneWayRows(Numbered(mechanism), scale or scale_of(whole), whole, tuple(row_motions(whole)))


@dataclass(frozen=True, eq=False)
class PosedLaws:
    """The problem of the laws of a mechanism's one-way elements, and what its rows and parts are.

    `elements` are those that take part: touching ones and all friction in joints; `parts` their friction parts.
    `names` are those of the problem's rows.
    """

    mechanism: Mechanism
    problem: LawProblem
    elements: tuple[LawElement, ...]
    parts: tuple[FrictionPart, ...]
    names: tuple[str, ...]

    @cached_property
    def places(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.names)}

    def mode(self, state: LawState) -> Mode:
        """Return the mode of a state that was found; elements that take no part are inactive."""
        sides = dict.fromkeys((element.name for element in self.mechanism.one_way), INACTIVE)
        found = state.mode
        for element in self.elements:
            own = {row.name: found.sides[self.places[row.name]] for row in element.normals}
            if len(own) == 1:
                sides[element.name] = next(iter(own.values()))
            else:
                sides |= own
                sides[element.name] = own[element.normals[0].name] if element.unilateral else ACTIVE
        pairs = list(zip(self.parts, found.slips, found.directions, strict=True))
        acting = {part.name for element in self.elements if sides[element.name] for part in element.frictions}
        return Mode(
            sides,
            {part.name: slip for part, slip, _ in pairs if part.name in acting},
            {part.name: way for part, _, way in pairs if way is not None and part.name in acting},
        )

    def law_mode(self, mode: Mode) -> LawMode:
        """Return a mode as one of the problem's rows and parts, to begin a search with."""
        sides = [1] * len(self.names)
        for element in self.elements:
            for row in element.normals:
                sides[self.places[row.name]] = mode.side(element, row)
        slips = tuple(map(mode.slip, self.parts))
        for part, slip in zip(self.parts, slips, strict=True):
            for row in part.rows:
                sides[self.places[row.name]] = int(slip == STICKS)
        return LawMode(tuple(sides), slips, tuple(mode.directions.get(part.name) for part in self.parts))


@dataclass(frozen=True, eq=False)
class Posed(PosedLaws):
    """The same with all `rows` of the mechanism in no mode at that state."""

    rows: OneWayRows

    @classmethod
    def at(cls, rows: OneWayRows, closed: Collection[str]) -> Posed:
        """Return the problem in which the elements named `closed` may act."""
        of = rows.posed(closed)
        return cls(of.mechanism, of.problem, of.elements, of.parts, of.names, rows)

    @property
    def dynamics(self) -> TreeDynamics:
        return self.rows.dynamics

    @property
    def without_freedom(self) -> list[LawElement]:
        """The unilateral elements that no motion opens or closes, since joints and constraints determine their gaps."""
        speeds = self.mechanism.speeds
        sizes = np.array([1.0 if speed.unit == "m/s" else 1.0 / self.rows.scale.length for speed in speeds])
        held = sizes[:, None] * _jacobian(self.rows.of(self.mechanism.rows), len(speeds)).T
        found = []
        for element in self.elements if len(speeds) else ():
            normal = sizes * _jacobian(self.rows.of(element.normals[:1]), len(speeds))[0]
            left = normal - held @ least_squares(held, normal)
            if element.unilateral and np.abs(left).max() <= TOUCHING:
                found.append(element)
        return found

    def drift(self, state: LawState) -> Floats:
        """Return the rates (m) at which what is left of the rows changes along the motion while multipliers do not.

        A difference quotient between the state and one a little later; exactly zero where nothing changes.
        """
        step = _LITTLE * self.rows.scale.time
        udot = accelerations_of(self.dynamics, state.x)
        rows = self.rows.later(step, udot)
        places = [rows.laws.places[name] for name in self.names]
        later = rows.matrices(places)
        now = self.problem.matrix, self.problem.exerted, self.problem.coupling, self.problem.right
        left = [A @ (C.T @ state.z) + D @ state.z - r for A, C, D, r in (now, later)]
        found: Floats = (left[1] - left[0]) / step
        return found


def accelerations_of(dynamics: TreeDynamics, x: Floats) -> Floats:
    """Return the accelerations (nu,), or the jumps of an impact, that weighted coordinates x (n,) stand for."""
    free = np.array(dynamics.bias_acceleration, dtype=float)
    found: Floats = free + np.array(dynamics.factors.unweighted(x.tolist()), dtype=float)
    return found


def weighted_rows(
    dynamics: TreeDynamics, rows: Sequence[RowMotion], places: Sequence[int]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return A, C, D and r of some rows, which are at some places among those that their couplings count."""
    size, count = len(dynamics.forcing), len(rows)
    weighted, free = dynamics.factors.weighted, np.array(dynamics.bias_acceleration, dtype=float)
    matrix = np.array([weighted(row.jacobian) for row in rows], dtype=float).reshape(count, size)
    exerted = matrix.copy()
    for k, row in enumerate(rows):
        if row.exerts is not None:
            exerted[k] = weighted(row.exerts)
    coupling = np.array([[row.coupling.get(k, 0.0) for k in places] for row in rows], dtype=float).reshape(count, count)
    jacobian = _jacobian(rows, size)
    right = np.array([row.gamma for row in rows], dtype=float) - jacobian @ free
    return matrix, exerted, coupling, right


def _jacobian(rows: Sequence[RowMotion], size: int) -> Floats:
    return np.array([row.jacobian for row in rows], dtype=float).reshape(len(rows), size)


# ----------------------------------------------------------------------------------------------------------------------
# Forces that are not unique, as of a box on four corners in space: shares that keep away from all bounds.


CLEAR: Final = 1e-11
"""Shares that are this part of the largest force away from all bounds are clearly inside."""
_MOST_CURVED: Final = 1e8
"""The second derivative at a ten thousandth of the largest force from a bound; larger ones count as this one.

Without it the rows of a contact without force, as of a wall beside a disc in a corner, exert so little that the solve
for the motion along them is rounding.
"""
_LEAST_CURVED: Final = 0.1
"""Smaller second derivatives count as this one, so that their inverse stays finite."""


@dataclass(frozen=True, eq=False)
class _Sharing:
    """The rows that act in a mode, by the problem's places, with their forces, sliding friction included."""

    posed: PosedLaws
    mode: Mode
    rows: tuple[int, ...]
    exerted: Floats

    def place(self, name: str) -> int:
        return self.rows.index(self.posed.places[name])


def with_shares(posed: PosedLaws, mode: Mode, state: LawState) -> Mode:
    """Return a mode with the shares of all its rows; unchanged where no force presses."""
    one = _acting_rows(posed, mode)
    lengths: Floats = np.linalg.norm(one.exerted, axis=1)  # one for all rows of a friction part
    for *_, law in _parts(posed, mode):
        own = [one.rows.index(row) for row in law.rows if row in one.rows]
        lengths[own] = lengths[own].max(initial=0.0)
    lengths[lengths == 0.0] = 1.0
    unit = one.exerted / lengths[:, None]
    start = least_squares(unit.T, state.x, SWITCHED)
    largest = float(np.abs(start).max(initial=0.0))
    if not largest > 0.0:
        return mode
    start, sizes = start / largest, largest / lengths
    bounds = _cones(one, sizes)
    found = inner_point(start, null_space(unit.T, SWITCHED), *bounds)
    if found.room <= CLEAR:  # other forces may change the motion of sliding parts
        kept = row_space(posed.problem.matrix[list(one.rows)], SWITCHED)
        found = inner_point(start, null_space(kept @ unit.T, SWITCHED), *bounds)
    return replace(mode, shares=Shares(tuple(_shares(one, found, sizes)), found.room))


def _acting_rows(posed: PosedLaws, mode: Mode) -> _Sharing:
    rows = [posed.places[row.name] for row in posed.mechanism.rows]
    exerted = posed.problem.exerted.copy()
    for element, part, law in _parts(posed, mode):
        slip = mode.slips.get(part, STICKS)
        normal = posed.places[element.normals[0].name]
        if slip != STICKS:  # friction along each row for a unit normal force
            if len(law.rows) == 1:
                friction = np.array(sliding(law.kinetic, [slip]))
            else:
                direction = mode.directions.get(part)
                way = law.velocity if not law.rests or direction is None else direction
                friction = np.array(sliding(law.kinetic, way, max(float(np.linalg.norm(way)), 1e-300)))
            exerted[normal] += friction @ posed.problem.exerted[list(law.rows)]
    for element in _elements(posed, mode):
        rows.append(posed.places[element.normals[0].name])
        own = (law for x, part, law in _parts(posed, mode) if x is element and mode.slips.get(part, STICKS) == STICKS)
        rows += [row for law in own if law.enough or law.static > 0.0 for row in law.rows]
    return _Sharing(posed, mode, tuple(rows), exerted[rows])


def _elements(posed: PosedLaws, mode: Mode) -> list[LawElement]:
    return [x for x in posed.elements if x.unilateral and mode.acts(x) and x.name not in mode.idle]


def _parts(posed: PosedLaws, mode: Mode) -> Iterator[tuple[LawElement, str, FrictionLaw]]:
    laws = {part.name: law for part, law in zip(posed.parts, posed.problem.parts, strict=True)}
    for element in _elements(posed, mode):
        yield from ((element, part.name, laws[part.name]) for part in element.frictions if part.name in laws)


def _cones(one: _Sharing, sizes: Floats) -> tuple[list[Cone], list[int]]:
    """Return the bounds of the acting rows, in forces over their `sizes`, and the rows without bounds."""
    places = {row: k for k, row in enumerate(one.rows)}
    loose = [places[one.posed.places[row.name]] for row in one.posed.mechanism.rows]
    found = []
    for element in _elements(one.posed, one.mode):
        found.append(Cone((), (one.place(element.normals[0].name),), (1.0,)))
    for element, part, law in _parts(one.posed, one.mode):
        if one.mode.slips.get(part, STICKS) != STICKS or not (law.enough or law.static > 0.0):
            continue
        own = tuple(places[row] for row in law.rows)
        if law.enough:
            loose += own
        else:
            normal = one.place(element.normals[0].name)
            found.append(Cone(own, (normal,), (most(law.static, float(sizes[normal] / sizes[own[0]])),)))
    return found, loose


def _shares(one: _Sharing, found: Inside, sizes: Floats) -> Iterator[Share]:
    """Yield the shares of each element, with ways of which the longest exerts a force of length one."""
    count = len(one.posed.mechanism.rows)
    normals = {one.posed.places[x.normals[0].name] for x in _elements(one.posed, one.mode)}
    begins = [k for k in range(count, len(one.rows)) if one.rows[k] in normals]
    groups: list[tuple[int, ...]] = [(k,) for k in range(count)]  # the model's own rows, then each element's
    groups += [tuple(range(a, b)) for a, b in zip(begins, [*begins[1:], len(one.rows)], strict=True)]
    roots = [_root(found.hessian[np.ix_(group, group)]) * sizes[list(group)][:, None] for group in groups]
    pairs = list(zip(groups, roots, strict=True))
    longest = max(float(np.linalg.norm(way @ one.exerted[list(g)])) for g, root in pairs for way in root.T)
    names = {place: name for name, place in one.posed.places.items()}
    for group, root in pairs:
        ways = tuple(tuple((root[k:, k] / longest).tolist()) for k in range(len(group)))
        forces = tuple((found.z * sizes)[list(group)].tolist())
        yield Share(tuple(names[one.rows[k]] for k in group), forces, ways)


def _root(hessian: Floats) -> Floats:
    """Return lower triangular L with L L^T the inverse of second derivatives within their bounds."""
    sizes, axes = np.linalg.eigh(hessian)
    inverse = axes / np.clip(sizes, _LEAST_CURVED, _MOST_CURVED) @ axes.T
    return np.asarray(np.linalg.cholesky(inverse), dtype=float)
