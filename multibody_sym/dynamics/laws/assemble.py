"""From a mechanism in motion, in floats, to the problem of its one-way laws, and from what is found back to a mode."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.block_ldl import block_ldl
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.formalisms.massless import massless_speeds
from multibody_sym.dynamics.laws.problem import (
    INACTIVE,
    STICKS,
    Equality,
    Friction,
    FrictionLaw,
    Law,
    LawMode,
    LawProblem,
    LawState,
    Unilateral,
)
from multibody_sym.kinematics.contacts import reach
from multibody_sym.kinematics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.kinematics.points import position, velocity
from multibody_sym.kinematics.rows import RowMotion, coefficients, row_motions
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.model.mechanism.one_way import ACTIVE, FrictionPart, Mode, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import creeping
from multibody_sym.scalars.node import ZERO, slot

TOUCHING: Final = 1e-9
"""The part of the model's size, and of its largest speed, up to which things touch, or do not move along each other."""
_LITTLE: Final = 1e-6
"""The part of the time that the fastest needs for the model's size over which rates are taken."""
_OF_FALLING: Final = 1e-3
"""No speed is the largest that is below this part of that after a fall through the model's size."""


@dataclass(frozen=True)
class Scale:
    """How large a model is (m) and how fast it moves (m/s): what small gaps and speeds are measured by.

    Slip in space that is slower than `unseen` (m/s) has no direction, since a run does not tell it from rest.
    """

    length: float
    speed: float
    unseen: float = 0.0

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

    Speeds count as no less than a thousandth of that after a fall through the model's size.
    """
    points = [np.array(position(motion, x), dtype=float) for x in motion.mechanism.markers.values()]
    points += [np.array(p, dtype=float) for _, p in motion.poses]
    length = max((float(np.linalg.norm(p)) for p in points), default=0.0) or 1.0
    moving = [np.array(velocity(motion, x), dtype=float) for x in motion.mechanism.markers.values()]
    moving += [np.array(body.v_WB, dtype=float) for body in motion.bodies]
    turning = [length * np.array(body.w_WB, dtype=float) for body in motion.bodies]
    fastest = max((float(np.linalg.norm(v)) for v in (*moving, *turning)), default=0.0)
    falling = float(np.sqrt(np.linalg.norm(np.array(motion.gravity, dtype=float)) * length))
    return Scale(length, max(fastest, _OF_FALLING * falling))


@dataclass(frozen=True, eq=False)
class OneWayRows:
    """All rows of a mechanism and of its one-way elements, whether they act or not, at a state over floats.

    `mechanism` is in no mode; `motion` is of the same mechanism with the elements' rows after its own.
    """

    mechanism: Mechanism
    motion: Motion
    rows: tuple[RowMotion, ...]
    scale: Scale

    @cached_property
    def places(self) -> dict[str, int]:
        """The place of each row by its name."""
        return {row.name: k for k, row in enumerate(self.motion.mechanism.rows)}

    @cached_property
    def dynamics(self) -> TreeDynamics:
        """The dynamics of the mechanism in floats."""
        return tree_dynamics_of(self.mechanism, self.motion.state)

    def of(self, rows: Sequence[Row]) -> list[RowMotion]:
        """Return some rows."""
        return [self.rows[self.places[row.name]] for row in rows]

    def gap(self, element: OneWay) -> float:
        """Return phi of an element that holds one way only."""
        return float(self.of(element.normals)[0].phi)

    def rate(self, element: OneWay) -> float:
        """Return the speed at which an element opens."""
        return float(self.of(element.normals)[0].phidot)

    def allowed_gap(self, element: OneWay, part: float = TOUCHING) -> float:
        """Return the gap up to which an element counts as closed; of stops of turning joints it is an angle."""
        return part * (1.0 if self._turns(element) else self.scale.length)

    def allowed_speed(self, row: RowMotion, part: float = TOUCHING) -> float:
        """Return the speed along a row up to which it counts as being at rest."""
        units = (speed.unit for speed in self.mechanism.speeds)
        sizes = [self.scale.speed if unit == "m/s" else self.scale.turning for unit in units]
        reach = sum(abs(float(h)) * size for h, size in zip(row.jacobian, sizes, strict=True))
        return part * max(reach, 0.0)

    def later(self, step: float, udot: Floats) -> OneWayRows:
        """Return the rows a little later, to first order."""
        state = self.motion.state
        q, u = np.array(state.q, dtype=float), np.array(state.u, dtype=float)
        rates = np.array(coordinate_rates(self.mechanism, state.q, state.u), dtype=float)
        parameters = [state.slots[slot("parameters", k)] for k in range(len(self.mechanism.parameters))]
        t = float(state.slots[TIME]) + step
        moved = state_of(self.mechanism, float, t, (q + step * rates).tolist(), (u + step * udot).tolist(), parameters)
        return one_way_rows(self.mechanism, motion_of(self.mechanism, moved), self.scale)

    def standing(self, element: OneWay) -> str:
        """Return how a unilateral element stands: `open`, `inside`, or closed: `touching`, `leaving`, `closing`."""
        gap, rate = self.gap(element), self.rate(element)
        if gap > self.allowed_gap(element) or not self.reaches(element):
            return "open"
        if gap < -self.allowed_gap(element):
            return "inside"
        allowed = self.allowed_speed(self.of(element.normals)[0])
        return "touching" if abs(rate) <= allowed else "leaving" if rate > 0.0 else "closing"

    def reaches(self, element: OneWay) -> bool:
        """Return whether what may touch is above the part of a face that there is, or as near as to touch its end."""
        row = element.normals[0]
        ways = reach(row, self.motion) if isinstance(row, ContactRow) else []
        return all(float(way) >= -self.allowed_gap(element) for way in ways)

    def _turns(self, element: OneWay) -> bool:
        units = {coordinate.joint: coordinate.unit for coordinate in self.mechanism.coordinates}
        return element.kind == "stop" and units.get(element.group) == "rad"


def one_way_rows(mechanism: Mechanism, motion: Motion, scale: Scale | None = None) -> OneWayRows:
    """Return the rows of a mechanism in no mode and of all its one-way elements; `scale` is that of the run."""
    every = replace(mechanism, rows=(*mechanism.rows, *(row for x in mechanism.one_way for row in x.rows)))
    whole = replace(motion, mechanism=every)
    return OneWayRows(mechanism, whole, tuple(row_motions(whole)), scale or scale_of(whole))


@dataclass(frozen=True, eq=False)
class PosedLaws:
    """The problem of the laws of a mechanism's one-way elements, and what its rows and parts are.

    `elements` are those that take part: touching ones and all friction in joints; `parts` their friction parts.
    `names` are those of the problem's rows.
    """

    mechanism: Mechanism
    problem: LawProblem
    elements: tuple[OneWay, ...]
    parts: tuple[FrictionPart, ...]
    names: tuple[str, ...]

    @cached_property
    def places(self) -> dict[str, int]:
        """The place of each row by its name."""
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
                name = row.name if len(element.normals) > 1 else element.name
                sides[self.places[row.name]] = mode.sides.get(name, INACTIVE)
        slips = tuple(mode.slips.get(part.name, STICKS) for part in self.parts)
        for part, slip in zip(self.parts, slips, strict=True):
            for row in part.rows:
                sides[self.places[row.name]] = int(slip == STICKS)
        return LawMode(tuple(sides), slips, tuple(mode.directions.get(part.name) for part in self.parts))


@dataclass(frozen=True, eq=False)
class Posed(PosedLaws):
    """The same with all `rows` of the mechanism in no mode at that state."""

    rows: OneWayRows

    @property
    def dynamics(self) -> TreeDynamics:
        """The dynamics of the mechanism in no mode, in floats."""
        return self.rows.dynamics

    @property
    def without_freedom(self) -> list[OneWay]:
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
        places = [rows.places[name] for name in self.names]
        there = tree_dynamics_of(self.mechanism, rows.motion.state)
        later = weighted_rows(there, [rows.rows[k] for k in places], places)
        now = self.problem.matrix, self.problem.exerted, self.problem.coupling, self.problem.right
        left = [A @ (C.T @ state.z) + D @ state.z - r for A, C, D, r in (now, later)]
        found: Floats = (left[1] - left[0]) / step
        return found


def posed(rows: OneWayRows, closed: Collection[str]) -> Posed:
    """Return the problem in which the unilateral elements named `closed` may act, and friction in joints always."""
    mechanism = rows.mechanism
    elements = tuple(x for x in mechanism.one_way if x.name in closed or not x.unilateral)
    parts = tuple(part for x in elements for part in x.frictions if _rubs(part))
    chosen = [row.name for row in mechanism.rows]
    for element in elements:
        chosen += [row.name for row in element.normals]
        chosen += [row.name for part in element.frictions if _rubs(part) for row in part.rows]
    places = [rows.places[name] for name in chosen]
    found = {name: k for k, name in enumerate(chosen)}
    nothing = np.zeros((0, len(mechanism.speeds)))
    chosen_rows = [rows.rows[k] for k in places]
    no_rows = nothing, nothing, np.zeros((0, 0)), np.zeros(0)
    matrices = weighted_rows(rows.dynamics, chosen_rows, places) if places else no_rows
    laws: list[Law] = [Equality() for _ in chosen]
    frictions: list[FrictionLaw] = []
    for element in elements:
        if element.unilateral:
            laws[found[element.normals[0].name]] = Unilateral()
        for part in element.frictions:
            if _rubs(part):
                for component, row in enumerate(part.rows):
                    laws[found[row.name]] = Friction(len(frictions), component)
                frictions.append(_friction_law(part, element, rows, found))
    problem = LawProblem(*matrices, tuple(laws), tuple(frictions))
    return Posed(mechanism, problem, elements, parts, tuple(chosen), rows)


def _rubs(part: FrictionPart) -> bool:
    return part.enough or part.static is not ZERO or part.kinetic is not ZERO


def _friction_law(part: FrictionPart, element: OneWay, rows: OneWayRows, found: dict[str, int]) -> FrictionLaw:
    static, kinetic = (float(x) for x in coefficients(rows.motion, part.rows, [part.static, part.kinetic]))
    moving = rows.of(part.rows)
    velocity = tuple(float(row.phidot) for row in moving)
    speed = float(np.hypot.reduce(np.array(velocity)))
    allowed = max(rows.allowed_speed(row) for row in moving)
    if part.regularised is not None:
        least = float(rows.motion.state.values([part.regularised])[0])
        static = kinetic = float(creeping(kinetic, velocity, least))
        allowed = 0.0
    rests = speed <= allowed
    return FrictionLaw(
        tuple(found[row.name] for row in part.rows),
        tuple(found[element.normals[k].name] for k in part.normals),
        static,
        kinetic,
        (0.0,) * len(velocity) if rests else velocity,
        part.norm,
        part.enough,
        part.enough and not element.unilateral,
    )


def tree_dynamics_of(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics in floats by the formalism that is linear in the bodies, where no freedom is massless."""
    return (composite_body if massless_speeds(mechanism) else block_ldl)(mechanism, state)


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
