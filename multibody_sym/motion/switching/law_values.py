"""The numbers of the laws at an instant of a run, and basic solutions of forces that are not unique."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.contact_laws.problem import Flags, LawState, ModeArrays, Scaled, ScaledFriction, scaled
from multibody_sym.contact_laws.search import modes_of
from multibody_sym.contact_laws.solve_mode import active_rows, fulfils, solve_mode, sticking
from multibody_sym.dynamics.contact.contact_problem import Numbered, PosedLaws, RowNumbers, Scale, with_shares
from multibody_sym.mechanics.contact_geometry import flat_rims
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, Mode
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, State, motion_of, state_of
from multibody_sym.mechanics.row_records import Row
from multibody_sym.program.loading import Compiled
from multibody_sym.program.runtime_constants import BETWEEN_POWERS, ROUNDED_GAP, TOUCHING, ULPS
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats
from multibody_sym.scalars.rank import SWITCHED, null_space, rank, row_space

# ----------------------------------------------------------------------------------------------------------------------
# Matrices of which few entries differ from zero: rows of them, and products with vectors.


Places = NDArray[np.intp]
_FEW: Final = 4096
"""Entries of a matrix, zeros too, up to which it is kept whole."""


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the entries of a matrix of a shape stand: `places` that count row by row, in any order."""

    shape: tuple[int, int]
    places: Places

    @cached_property
    def order(self) -> Places:
        """The numbers of the entries row by row."""
        return np.argsort(self.places, kind="stable")

    @cached_property
    def rows(self) -> Places:
        """The row of each entry in this order."""
        return self.places[self.order] // max(self.shape[1], 1)

    @cached_property
    def columns(self) -> Places:
        """The column of each."""
        return self.places[self.order] % max(self.shape[1], 1)

    @cached_property
    def begins(self) -> Places:
        """The number of the first entry of each row, and how many entries there are."""
        return np.searchsorted(self.rows, np.arange(self.shape[0] + 1))

    @cached_property
    def is_small(self) -> bool:
        """Whether the matrix is kept whole."""
        return self.shape[0] * self.shape[1] <= _FEW


def ranges(first: Places, counts: Places) -> Places:
    """Return the numbers from each first one on, so many, one after the other."""
    ends = np.cumsum(counts)
    return np.repeat(first - ends + counts, counts) + np.arange(ends[-1] if len(ends) else 0)


@dataclass(frozen=True, eq=False)
class SparseRows:
    """A matrix of a pattern, whose entries are `values` as they were given."""

    pattern: Pattern
    values: Floats

    @cached_property
    def entries(self) -> Floats:
        """The entries row by row."""
        found: Floats = self.values[self.pattern.order]
        return found

    @cached_property
    def whole(self) -> Floats:
        """The matrix with its zeros."""
        found = np.zeros(self.pattern.shape)
        found.reshape(-1)[self.pattern.places] = self.values
        return found

    def __getitem__(self, at: int | Sequence[int] | Places) -> Floats:
        """Return row number `at` (n,), or rows (k, n)."""
        if self.pattern.is_small:
            small: Floats = self.whole[at]
            return small
        if isinstance(at, (int, np.integer)):
            row: Floats = self[[int(at)]][0]
            return row
        rows = np.asarray(at, dtype=np.intp)
        first = self.pattern.begins[rows]
        counts = self.pattern.begins[rows + 1] - first
        read = ranges(first, counts)
        found = np.zeros((len(rows), self.pattern.shape[1]))
        found[np.repeat(np.arange(len(rows)), counts), self.pattern.columns[read]] = self.entries[read]
        return found

    def block(self, at: Places) -> Floats:
        """Return what rows at some places have in the columns there (k, k)."""
        return self[at][:, at] if len(self.values) else np.zeros((len(at), len(at)))

    def __matmul__(self, x: Floats) -> Floats:
        """Return the product with a vector (n,)."""
        found: Floats = self.whole @ x if self.pattern.is_small else self.in_order(x)
        return found

    def in_order(self, x: Floats) -> Floats:
        """Return the product with a vector (n,), each sum added from left to right."""
        terms = self.entries * x[self.pattern.columns]
        found: Floats = np.bincount(self.pattern.rows, terms, minlength=self.pattern.shape[0]).astype(float)
        return found


# ----------------------------------------------------------------------------------------------------------------------
# The numbers of the laws at an instant of a run, and basic solutions of forces that are not unique.


_TURNED: Final = 1e-5
"""The angle between a corner and the face that begins there up to which it is at this corner that the face closes."""
_NONE: Final = np.zeros(0)


@dataclass(frozen=True, eq=False)
class Laws(Numbered):
    """The laws of a mechanism in no mode: the Program `laws` compiled, and the parameters (np,).

    `entries`: the places of what it computes of each matrix, counted row by row.
    """

    compiled: Compiled
    entries: Mapping[str, Sequence[int]]
    parameters: Floats

    @cached_property
    def unilateral(self) -> tuple[LawElement, ...]:
        """The elements that may close."""
        return tuple(element for element in self.mechanism.one_way if element.unilateral)

    @cached_property
    def unilateral_places(self) -> tuple[NDArray[np.intp], NDArray[np.bool_] | None]:
        """The places of the normals of these, and whether their gaps are angles; None where no gap is one."""
        places = np.array([self.places[x.normals[0].name] for x in self.unilateral], dtype=np.intp)
        turns = np.array([x.name in self.turning for x in self.unilateral], dtype=bool)
        return places, turns if turns.any() else None

    @cached_property
    def rate_pairs(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The places of coordinates, and those of the speeds that are their rates."""
        pairs = [pair for body in self.mechanism.bodies for pair in body.rate_pairs]
        coordinates, speeds = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        return coordinates, speeds

    @cached_property
    def turned_coordinates(self) -> NDArray[np.bool_]:
        """Which coordinates (nq,) are angles."""
        return np.array([each.unit == "rad" for each in self.mechanism.coordinates], dtype=bool)

    @cached_property
    def two_sided_rub(self) -> bool:
        """Whether there is friction in what does not only press: it may act at any time."""
        always = (part.name for x in self.mechanism.one_way if not x.unilateral for part in x.frictions)
        return any(name in self.parts for name in always)

    def has_friction(self, element: LawElement) -> bool:
        """Return whether an element has friction that acts by laws."""
        return any(part.name in self.parts for part in element.frictions)

    @cached_property
    def _outputs(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.compiled["laws"].signature.outputs)

    def at(self, t: float, q: Floats, u: Floats, scale: Scale) -> LawValues:
        """Return the numbers at an instant."""
        known = t, q, u, self.parameters
        inputs = self.compiled["inputs"](*known)[0] if self.mechanism.inputs else _NONE
        found = dict(zip(self._outputs, self.compiled["laws"](*known, inputs, _NONE), strict=True))
        return LawValues(self, scale, t, q, u, found)

    @cached_property
    def matrices(self) -> dict[str, tuple[tuple[int, int], NDArray[np.intp]]]:
        """The shapes of the matrices of which the Program computes entries, and where these stand, row by row."""
        rows, speeds = len(self.places), len(self.mechanism.speeds)
        shapes = dict.fromkeys(("jacobian", "matrix", "exerted"), (rows, speeds))
        shapes |= {"coupling": (rows, rows), "inverse": (speeds, speeds)}
        return {name: (shape, np.array(self.entries[name], dtype=np.intp)) for name, shape in shapes.items()}

    @cached_property
    def patterns(self) -> dict[str, Pattern]:
        """Where entries of these may differ from zero: of C those of A, and where it differs from that."""
        (_, of_a), (shape, of_c) = self.matrices["matrix"], self.matrices["exerted"]
        given = {**self.matrices, "exerted": (shape, np.union1d(of_a, of_c))}
        return {name: Pattern(*each) for name, each in given.items()}

    @cached_property
    def _exerted(self) -> list[tuple[str, NDArray[np.intp]]]:
        """Where the entries of A, and those of C that differ, stand among all of C."""
        given = [(name, self.matrices[name][1]) for name in ("matrix", "exerted")]
        every = np.union1d(*(places for _, places in given))
        return [(name, np.searchsorted(every, places)) for name, places in given]

    def exerted(self, known: Mapping[str, Floats]) -> Floats:
        """Return the entries of C by those of A and those that differ."""
        found = np.zeros(len(self.patterns["exerted"].places))
        for name, places in self._exerted:
            found[places] = known[name]
        return found


@dataclass(frozen=True, eq=False)
class LawValues(RowNumbers):
    """The outputs of `law_program` at time t, coordinates q and speeds u."""

    laws: Laws
    t: float
    q: Floats
    u: Floats
    known: dict[str, Floats]

    @cached_property
    def by_mass(self) -> SparseRows:
        """All rows H G^-1 (m, n)."""
        return SparseRows(self.laws.patterns["matrix"], self.known["matrix"])

    @cached_property
    def exerted(self) -> SparseRows:
        """What unit multipliers of all rows exert, times G^-1 (m, n)."""
        return SparseRows(self.laws.patterns["exerted"], self.laws.exerted(self.known))

    @cached_property
    def by_speeds(self) -> SparseRows:
        """How all rows change with the speeds (m, nu)."""
        return SparseRows(self.laws.patterns["jacobian"], self.known["jacobian"])

    @cached_property
    def inverse(self) -> SparseRows:
        """G^-1 (nu, n)."""
        return SparseRows(self.laws.patterns["inverse"], self.known["inverse"])

    def place(self, row: Row) -> int:
        """Return the place of a row."""
        return self.laws.places[row.name]

    def phi(self, row: Row) -> float:
        return float(self.known["phi"][self.laws.places[row.name]])

    def phidot(self, row: Row) -> float:
        return float(self.known["phidot"][self.laws.places[row.name]])

    def jacobian(self, row: Row) -> Floats:
        return self.by_speeds[self.laws.places[row.name]]

    def fastest(self, row: Row) -> float:
        return float(self._fastest[self.laws.places[row.name]])

    @cached_property
    def _fastest(self) -> Floats:
        return SparseRows(self.laws.patterns["jacobian"], np.abs(self.known["jacobian"])) @ self.speed_sizes

    def reach(self, element: LawElement) -> float:
        return float(self.known["reaches"][self.laws.elements[element.name]])

    def past_end(self, element: LawElement) -> float:
        return float(self.known["past_ends"][self.laws.elements[element.name]])

    def coefficients(self, part: FrictionPart) -> tuple[float, float]:
        static, kinetic = self.known["coefficients"][self.laws.parts[part.name]].tolist()
        return static, kinetic

    def restitution(self, element: LawElement) -> float:
        return float(self.known["bounces"][self.laws.elements[element.name]])

    def matrices(self, places: Sequence[int]) -> tuple[Floats, Floats, Floats, Floats]:
        at = np.array(places, dtype=int)
        coupling = SparseRows(self.laws.patterns["coupling"], self.known["coupling"])
        return self.by_mass[at], self.exerted[at], coupling.block(at), self.known["right"][at]

    @property
    def sizes(self) -> Floats:
        """How large (1 + nq + nu,) time, coordinates and speeds are in this run."""
        lengths = [self.scale.length if each.unit == "m" else 1.0 for each in self.laws.mechanism.coordinates]
        return np.concatenate([[self.scale.time], lengths, self.speed_sizes])

    @cached_property
    def near(self) -> list[LawElement]:
        """The unilateral elements whose gaps are no larger than what counts as closed."""
        places, turns = self.laws.unilateral_places
        gaps: Floats = self.known["phi"][places]
        sizes = self.scale.length if turns is None else np.where(turns, 1.0, self.scale.length)
        return [self.laws.unilateral[k] for k in (gaps <= TOUCHING * sizes).nonzero()[0].tolist()]

    def lying(self, elements: Iterable[LawElement]) -> str:
        """Return which rim of some elements lies flat on its plane, in words; empty where none does."""
        rows = ((x.name, x.normals[0]) for x in elements if x.normals[0].rim is not None)
        return next((f"{name}: {flat}" for name, row in rows for flat in flat_rims([row], self.motion)), "")

    @cached_property
    def state(self) -> State:
        """The state over numbers."""
        known = self.q.tolist(), self.u.tolist(), self.laws.parameters.tolist()
        return state_of(self.laws.mechanism, float, self.t, *known)

    @cached_property
    def motion(self) -> Motion:
        """The motion over numbers."""
        return motion_of(self.laws.mechanism, self.state)

    def rounding_of_gap(self, element: LawElement) -> float:
        """Return what rounding of the coordinates, such as an angle of many turns, makes of the gap of an element."""
        return ULPS * EPSILON * float(self._reaches[self.place(element.normals[0])])

    def rounded_gap(self, element: LawElement) -> float:
        """Return by how much an element may be off its face by rounding: a mode ends where it has got in so far."""
        return max(self.allowed_gap(element, ROUNDED_GAP), rounded_up(self.rounding_of_gap(element)))

    @cached_property
    def rounded_gaps(self) -> Floats:
        """The same of all unilateral elements."""
        places, turns = self.laws.unilateral_places
        sizes = self.scale.length if turns is None else np.where(turns, 1.0, self.scale.length)
        rounding = rounded_up_each(ULPS * EPSILON * self._reaches[places])
        found: Floats = np.maximum(ROUNDED_GAP * sizes, rounding)
        return found

    def rounded_idle_gap(self, element: LawElement) -> float:
        """Return the same of one that carries nothing, where others may hold its gap: all lengths cancel in it."""
        return max(self.rounded_gap(element), rounded_up(ULPS * EPSILON * self.farthest(element)))

    @cached_property
    def _reaches(self) -> Floats:
        """How far (m,) from zero what is multiplied in each row is."""
        return SparseRows(self.laws.patterns["jacobian"], np.abs(self.known["jacobian"])) @ self._reach_of_speeds

    @cached_property
    def _reach_of_speeds(self) -> Floats:
        """How far (nu,) from zero the coordinates are whose rates the speeds are; 2 rad for a unit quaternion's."""
        reached = np.full(len(self.u), 2.0)
        coordinates, speeds = self.laws.rate_pairs
        reached[speeds] = np.abs(self.q[coordinates])
        return reached

    def taken_over(self, element: LawElement, active: Collection[str]) -> list[str]:
        """Return those `active` that an element replaces as it closes: a corner beside the face that begins there.

        Their rows, of one contact, are alike there; that of the corner is at rest, and the face has begun to turn.
        """
        own, others = self.jacobian(element.normals[0]), (x for x in self.laws.unilateral if x.name in active)
        near = _TURNED * float(np.abs(own).max(initial=0.0))
        alike = (x for x in others if x is not element and x.group == element.group and x.group)
        return [x.name for x in alike if np.abs(self.jacobian(x.normals[0]) - own).max() <= near]

    def farthest(self, element: LawElement) -> float:
        """Return the largest length (m), or angle where the gap is one, of which the gap of an element is made."""
        return max(self.allowed_gap(element, 1.0), self._farthest[element.name in self.laws.turning])

    @cached_property
    def _farthest(self) -> tuple[float, float]:
        """The largest coordinate that is a length, and the largest angle."""
        turns, sizes = self.laws.turned_coordinates, np.abs(self.q)
        return float(sizes[~turns].max(initial=0.0)), float(sizes[turns].max(initial=0.0))

    def falling(self, element: LawElement, udot: Floats) -> float:
        """Return the acceleration (m/s^2) with which an element closes under accelerations (nu,)."""
        return -float(self.accelerations([self.place(element.normals[0])], udot)[0])

    def accelerations(self, places: Sequence[int], udot: Floats) -> Floats:
        """Return the rates of phidot of rows at some places under accelerations (nu,)."""
        found: Floats = self.by_speeds[places] @ (udot - self.known["free"]) - self.known["right"][places]
        return found

    def weights(self, rows: Sequence[int]) -> Floats:
        """Return of rows at some places the force that holds what they are joined to against all that acts on it."""
        sizes = np.linalg.norm(self.exerted[rows], axis=1)
        driven: Floats = self.known["driven"][rows] / np.where(sizes > 0.0, sizes, 1.0)
        return driven

    def udot(self, x: Floats) -> Floats:
        """Return the accelerations (nu,) that weighted coordinates x (n,) of a state of the laws stand for."""
        return self.known["free"] + self.speeds(x)

    def speeds(self, x: Floats) -> Floats:
        """Return the change of the speeds (nu,) that weighted coordinates x (n,) stand for."""
        return self.inverse @ x


def rounded_up(value: float) -> float:
    """Return a value rounded up to a power of two, beside which forces are rare: it does not hang on digits."""
    return 2.0 ** math.ceil(math.log2(BETWEEN_POWERS * value)) / BETWEEN_POWERS if value > 0.0 else 0.0


def rounded_up_each(values: Floats) -> Floats:
    """Return each of some values rounded up so."""
    some = values > 0.0
    powers = np.ceil(np.log2(BETWEEN_POWERS * np.where(some, values, 1.0))).astype(int)
    return np.where(some, np.ldexp(1.0, powers) / BETWEEN_POWERS, 0.0)


def has_sliding_friction(facts: LawValues, entered: Mechanism) -> bool:
    """Return whether anything slides with friction at an instant in a mode that is `entered`: coefficients may be 0."""
    sliding = [each for row in entered.rows for each in row.sliding]
    along = {row.name for each in sliding for row in each.rows}
    parts = (part for element in facts.laws.mechanism.one_way for part in element.frictions)
    return any(max(facts.coefficients(part)) > 0.0 for part in parts if along & {row.name for row in part.rows})


# ----------------------------------------------------------------------------------------------------------------------
# Forces that are not unique, as of a box on two corners: a basic solution, which a run follows until it ends.
#
# What the laws allow them to be is a convex set, and a basic solution one of its corners: what touches may carry
# nothing there, what rests may exert nothing or be at its static limit, and all others have unique forces. Where these
# leave their bounds another corner is taken, or the state is another. Corners are found from the forces of the state,
# which lie in the set: along what the motion does not see, to one bound after another. In space, where limits are
# circles, all rows are kept instead, and share what they carry (`dynamics.contact.indeterminate_forces`).


_FLAT: Final = 1e-9
"""The part of a way along which a bound comes nearer that is rounding."""
_ROOM: Final = 0.01
"""The part of the largest force from all bounds at which a corner is taken without looking for a better one."""


@dataclass(frozen=True, eq=False)
class _Bound:
    """What forces z (m) keep, `row` z >= 0; at zero an element is `idle`, or parts or rows of it exert as `carried`."""

    row: Floats
    element: str
    idle: bool = False
    carried: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Corner:
    """A basic solution as a mode, and how far its other forces are from their bounds, as a part of the largest."""

    mode: Mode
    room: float


def basic_mode(problem: PosedLaws, state: LawState) -> Mode | None:
    """Return the mode of a state; where its forces are not unique, with a basic solution that keeps its bounds.

    In space, and without one that is found, with shares of all rows. None where reactions in joints press, which have
    no shares, and none is found: the state does not last.
    """
    mode = problem.mode(state)
    coupled = bool(problem.problem.coupling.any())
    forces = _Forces.of(problem, state)
    if forces is None:
        return mode
    if not coupled and any(part.in_space for part in forces.problem.parts if forces.touches[part.number]):
        return with_shares(problem, mode, state)
    best: _Corner | None = None
    for corner in forces.corners():
        best = corner if best is None or corner.room > best.room else best
        if best.room > _ROOM:
            break
    if best is not None:
        return best.mode
    return None if coupled else with_shares(problem, mode, state)


@dataclass(frozen=True, eq=False)
class _Forces:
    """The forces z (m) of a state in a mode, as parts of the largest, and what else they may be.

    `idle` (m, j) are combinations of them that no equation sees, `touches` (p) which parts anything presses. Where what
    slides rubs by such a force it moves otherwise: these are other states.
    """

    posed: PosedLaws
    problem: Scaled
    state: LawState
    modes: ModeArrays
    mu: Floats
    z: Floats
    idle: Floats
    touches: Flags

    @classmethod
    def of(cls, posed: PosedLaws, state: LawState) -> _Forces | None:
        """Return the forces of a state; None where they are the only ones."""
        problem = scaled(posed.problem)
        modes = modes_of(problem, state.mode)
        kinetic = [not part.rests or part.number in state.kinetic for part in problem.parts]
        mu = np.array([part.kinetic if k else part.static for part, k in zip(problem.parts, kinetic, strict=True)])
        z = state.z * problem.sizes
        z = z / (float(np.abs(z).max(initial=0.0)) or 1.0)
        restricting = _restricting_rows(problem, modes, mu)
        if rank(problem.A[restricting], SWITCHED) == restricting.sum():
            return None
        trial = solve_mode(problem, modes, mu)
        idle = trial.forces @ trial.idle
        touches = problem.pressed_parts(modes.sides)
        return cls(posed, problem, state, modes, mu, z, idle, touches) if idle.shape[1] else None

    def corners(self) -> Iterator[_Corner]:
        """Yield basic solutions that keep all bounds, first one that is near the least forces.

        What a length limits exerts nothing in them, or else as much as planes that touch the limit allow.
        """
        yield from self._corners(list(self._bounds()))
        if any(part.norm for part in self.problem.parts):
            yield from self._corners([*self._bounds(), *self._planes()])

    def _corners(self, bounds: Sequence[_Bound]) -> Iterator[_Corner]:
        rows = np.array([bound.row for bound in bounds]).reshape(len(bounds), len(self.z))
        ways = row_space(self.idle.T, SWITCHED).T
        along = -ways @ (ways.T @ self.z)  # to the least forces, or as far as bounds allow
        least = np.asarray(self.z + min(1.0, float(_steps(self.z, along, rows).min(initial=1.0))) * along, dtype=float)
        seen = set[tuple[int, ...]]()
        for wish in (None, rows.sum(axis=0), *rows, *-rows):
            z, reached = _walk_to_corner(least, ways, rows, wish)
            if tuple(sorted(reached)) in seen:
                continue
            seen.add(tuple(sorted(reached)))
            mode = self._at(z, [bounds[k] for k in reached])
            if mode is not None:
                left = np.delete(rows @ z, [k for k, x in enumerate(bounds) if k in reached or x.element in mode.idle])
                yield _Corner(mode, float(left.min(initial=1.0)))

    def _bounds(self) -> Iterator[_Bound]:
        """Yield what the laws ask of forces; of what has no limit, or a cone or circle, that it may exert nothing."""
        posed, problem = self.posed, self.problem
        numbers = {part.name: k for k, part in enumerate(posed.parts)}
        rests = sticking(problem, self.modes, self.mu)
        for element in posed.elements:
            place = posed.places[element.normals[0].name]
            if element.unilateral and self.modes.sides[place] > 0:
                yield _Bound(self._unit(place), element.name, idle=True)
            for part in (problem.parts[numbers[x.name]] for x in element.frictions if x.name in numbers):
                if not part.norm:  # beyond zero what presses has another side
                    pressing = (k for k in part.normals if k in problem.both)
                    yield from (_Bound(_sign(self.modes.sides[k]) * self._unit(k), element.name) for k in pressing)
                if not rests[part.rows[0]]:
                    continue
                name, rows = posed.parts[part.number].name, part.rows
                if len(rows) > 1 or part.enough or part.norm:
                    names = [name] if len(rows) == 1 else [posed.names[row] for row in rows]
                    for own, row in zip(names, rows, strict=True):
                        yield _Bound(_sign(self.z[row]) * self._unit(row), element.name, carried={own: 0})
                elif not part.held:
                    yield from self._limits(element.name, part)

    def _planes(self) -> Iterator[_Bound]:
        """Yield planes that touch the limits of what a length presses, for forces in its direction."""
        rests = sticking(self.problem, self.modes, self.mu)
        owners = {part.name: element.name for element in self.posed.elements for part in element.frictions}
        for part in self.problem.parts:
            if part.norm and len(part.rows) == 1 and rests[part.rows[0]] and not (part.enough or part.held):
                yield from self._limits(owners[self.posed.parts[part.number].name], part)

    def _limits(self, element: str, part: ScaledFriction) -> Iterator[_Bound]:
        """Yield the static limits of a part, slip either way."""
        weights = part.weights(self.modes.sides, {part.number: part.along(self.z)})
        bound = part.bound(float(self.mu[part.number]), weights, len(self.z))
        for slip, row in zip((1, -1), part.cone(bound, np.array([[-1.0], [1.0]])), strict=True):
            yield _Bound(row, element, carried={self.posed.parts[part.number].name: slip})

    def _places(self, element: LawElement) -> list[int]:
        return [self.posed.places[row.name] for row in element.rows if row.name in self.posed.places]

    def _unit(self, place: int) -> Floats:
        row = np.zeros(len(self.z))
        row[place] = 1.0
        return row

    def _at(self, z: Floats, reached: Sequence[_Bound]) -> Mode | None:
        """Return the mode in which forces z are at bounds, None where they are not the only ones, or beyond others."""
        posed, problem = self.posed, self.problem
        if any(not x.idle and not x.carried for x in reached):
            return None
        one_way = (x for x in posed.elements if x.unilateral)
        bare = {x.name for x in one_way if (np.abs(z[self._places(x)]) <= _FLAT).all()}  # its limits are all reached
        idle = list(dict.fromkeys(x.element for x in reached if x.idle or x.element in bare))
        carried = {name: how for x in reached if x.element not in idle for name, how in x.carried.items()}
        carrying, modes = np.ones(problem.count, dtype=bool), self.modes.copy()
        modes.sides[problem.both] = np.where(np.abs(z) > _FLAT, np.sign(z), 0)[problem.both]
        for element in posed.elements:
            if element.name in idle:
                carrying[self._places(element)] = False
        for number, part in enumerate(posed.parts):
            if part.name in carried:
                carrying[problem.parts[number].rows] = False
                modes.slips[number] = carried[part.name]
        carrying[[posed.places[name] for name in carried if name in posed.places]] = False
        restricting = _restricting_rows(problem, self.modes, self.mu)
        if rank(problem.A[restricting & carrying], SWITCHED) < rank(problem.A[restricting], SWITCHED):
            return None
        if not fulfils(solve_mode(problem, modes, self.mu, carrying)):
            return None
        law_mode = replace(self.state.mode, sides=tuple(modes.sides.tolist()))
        return replace(posed.mode(replace(self.state, mode=law_mode)), idle=tuple(idle), carried=carried)


def _restricting_rows(problem: Scaled, modes: ModeArrays, mu: Floats) -> Flags:
    """Return (m) which rows restrict motion in a mode."""
    active = active_rows(problem, modes, mu)
    active[problem.defining] = False
    return active


def _sign(value: float) -> float:
    return -1.0 if value < 0.0 else 1.0


def _walk_to_corner(z: Floats, ways: Floats, rows: Floats, wish: Floats | None) -> tuple[Floats, list[int]]:
    """Return a corner of what rows (b, m) z >= 0 leave of z along `ways` (m, j), and the bounds that it lies at.

    The way to it goes towards a wish (m) as far as it can, or else to the nearest bound, on along that, and so on.
    """
    reached: list[int] = []
    while ways.shape[1]:
        if wish is None:
            wanted = _nearest(z, ways, rows)
        else:
            wanted = ways.T @ wish
            size = float(np.linalg.norm(wanted))  # the first way where all are across the wish
            wanted = wanted / size if size > _FLAT * float(np.linalg.norm(wish)) else np.eye(len(wanted))[0]
        along = next((each for each in (wanted, -wanted) if ((rows @ (ways @ each)) < -_FLAT).any()), None)
        if along is None:  # nothing bounds what it changes
            ways = ways @ null_space(wanted[None], SWITCHED)
            continue
        steps = _steps(z, ways @ along, rows)
        first = int(steps.argmin())
        z = z + steps[first] * (ways @ along)
        reached.append(first)
        ways = ways @ null_space((rows[first] @ ways)[None], SWITCHED)
    return z, reached


def _nearest(z: Floats, ways: Floats, rows: Floats) -> Floats:
    """Return the direction (j) along ways to the bound that is nearest to z; the first one where there is none."""
    along = rows @ ways
    sizes: Floats = np.linalg.norm(along, axis=1)
    if not (sizes > _FLAT).any():
        return np.asarray(np.eye(ways.shape[1])[0], dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        nearest = int(np.where(sizes > _FLAT, np.maximum(rows @ z, 0.0) / sizes, np.inf).argmin())
    return np.asarray(-along[nearest] / sizes[nearest], dtype=float)


def _steps(z: Floats, along: Floats, rows: Floats) -> Floats:
    """Return (b) how far along a way each bound is; infinite where it does not come nearer."""
    rates = rows @ along
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(rates < -_FLAT, np.maximum(rows @ z, 0.0) / -rates, np.inf), dtype=float)
