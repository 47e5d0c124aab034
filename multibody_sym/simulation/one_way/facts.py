"""What laws ask at an instant of a run, in numbers, and the problems that these pose."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.dynamics.laws.assemble import TOUCHING, ULPS, Numbered, RowNumbers, Scale
from multibody_sym.kinematics.flat_rims import flat_rims
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.numerics.arrays import EPSILON, Floats
from multibody_sym.numerics.sparse_rows import Pattern, SparseRows
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Compiled

_BESIDE: Final = 1.37
ROUNDED_GAP: Final = 1e-14
"""The part of the largest length by which what touches may be off its face by rounding."""
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
    def unilateral(self) -> tuple[OneWay, ...]:
        """The elements that may close."""
        return tuple(element for element in self.mechanism.one_way if element.unilateral)

    @cached_property
    def unilateral_places(self) -> tuple[NDArray[np.intp], NDArray[np.bool_] | None]:
        """The places of the normals of these, and whether their gaps are angles; None where no gap is one."""
        places = np.array([self.places[x.normals[0].name] for x in self.unilateral], dtype=np.intp)
        turns = np.array([x.name in self.turning for x in self.unilateral], dtype=bool)
        return places, turns if turns.any() else None

    @cached_property
    def two_sided_rub(self) -> bool:
        """Whether there is friction in what does not only press: it may act at any time."""
        always = (part.name for x in self.mechanism.one_way if not x.unilateral for part in x.frictions)
        return any(name in self.parts for name in always)

    @cached_property
    def _outputs(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.compiled["laws"].signature.outputs)

    def at(self, t: float, q: Floats, u: Floats, scale: Scale) -> Facts:
        """Return the numbers at an instant."""
        known = t, q, u, self.parameters
        inputs = self.compiled["inputs"](*known)[0] if self.mechanism.inputs else _NONE
        found = dict(zip(self._outputs, self.compiled["laws"](*known, inputs, _NONE), strict=True))
        return Facts(self, scale, t, q, u, found)

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
        return {name: Pattern.of(*each) for name, each in given.items()}

    @cached_property
    def _exerted(self) -> list[tuple[str, NDArray[np.intp]]]:
        """Where the entries of A, and those of C that differ, stand among all of C."""
        given = [(name, self.matrices[name][1]) for name in ("matrix", "exerted")]
        every = np.union1d(*(places for _, places in given))
        return [(name, np.searchsorted(every, places)) for name, places in given]

    def exerted(self, known: Mapping[str, Floats]) -> Floats:
        """Return the entries of C by those of A and those that differ."""
        found = np.zeros(len(self.patterns["exerted"].columns))
        for name, places in self._exerted:
            found[places] = known[name]
        return found


@dataclass(frozen=True, eq=False)
class Facts(RowNumbers):
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

    def reach(self, element: OneWay) -> float:
        return float(self.known["reaches"][self.laws.elements[element.name]])

    def past_end(self, element: OneWay) -> float:
        return float(self.known["past_ends"][self.laws.elements[element.name]])

    def coefficients(self, part: FrictionPart) -> tuple[float, float]:
        static, kinetic = self.known["coefficients"][self.laws.parts[part.name]].tolist()
        return static, kinetic

    def restitution(self, element: OneWay) -> float:
        return float(self.known["bounces"][self.laws.elements[element.name]])

    def matrices(self, places: Sequence[int]) -> tuple[Floats, Floats, Floats, Floats]:
        at = np.array(places, dtype=int)
        coupling = SparseRows(self.laws.patterns["coupling"], self.known["coupling"])
        return self.by_mass[at], self.exerted[at], coupling.block(at), self.known["right"][at]

    @property
    def sizes(self) -> Floats:
        """How large (1 + nq + nu,) time, coordinates and speeds are in this run."""
        slides, scale = self.laws.slides, self.scale
        lengths = [scale.length if each.unit == "m" else 1.0 for each in self.laws.mechanism.coordinates]
        return np.concatenate([[scale.time], lengths, slides * scale.speed + (1.0 - slides) * scale.turning])

    @cached_property
    def near(self) -> list[OneWay]:
        """The unilateral elements whose gaps are no larger than what counts as closed."""
        places, turns = self.laws.unilateral_places
        gaps: Floats = self.known["phi"][places]
        sizes = self.scale.length if turns is None else np.where(turns, 1.0, self.scale.length)
        return [self.laws.unilateral[k] for k in (gaps <= TOUCHING * sizes).nonzero()[0].tolist()]

    def lying(self, elements: Iterable[OneWay]) -> str:
        """Return which rim of some elements lies flat on its plane, in words; empty where none does."""
        rows = ((x.name, x.normals[0]) for x in elements)
        rims = [(name, row) for name, row in rows if isinstance(row, ContactRow) and row.rim is not None]
        return next((f"{name}: {flat}" for name, row in rims for flat in flat_rims([row], self.motion)), "")

    @cached_property
    def motion(self) -> Motion:
        """The motion over numbers."""
        mechanism, known = self.laws.mechanism, (self.q.tolist(), self.u.tolist(), self.laws.parameters.tolist())
        return motion_of(mechanism, state_of(mechanism, float, self.t, *known))

    def rounding_of_gap(self, element: OneWay) -> float:
        """Return what rounding of the coordinates, such as an angle of many turns, makes of the gap of an element."""
        return ULPS * EPSILON * float(self._reaches[self.place(element.normals[0])])

    def rounded_gap(self, element: OneWay) -> float:
        """Return by how much an element may be off its face by rounding: a mode ends where it has got in so far."""
        return max(self.allowed_gap(element, ROUNDED_GAP), rounded_up(self.rounding_of_gap(element)))

    def rounded_idle_gap(self, element: OneWay) -> float:
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
        for body in self.laws.mechanism.bodies:
            for coordinate, speed in body.rate_pairs:
                reached[speed] = abs(self.q[coordinate])
        return reached

    def taken_over(self, element: OneWay, active: Collection[str]) -> list[str]:
        """Return those `active` that an element replaces as it closes: a corner beside the face that begins there.

        Their rows, of one contact, are alike there; that of the corner is at rest, and the face has begun to turn.
        """
        own, others = self.jacobian(element.normals[0]), (x for x in self.laws.unilateral if x.name in active)
        near = _TURNED * float(np.abs(own).max(initial=0.0))
        alike = (x for x in others if x is not element and x.group == element.group and x.group)
        return [x.name for x in alike if np.abs(self.jacobian(x.normals[0]) - own).max() <= near]

    def farthest(self, element: OneWay) -> float:
        """Return the largest length (m), or angle where the gap is one, of which the gap of an element is made."""
        turns = element.name in self.laws.turning
        pairs = zip(self.laws.mechanism.coordinates, np.abs(self.q).tolist(), strict=True)
        own = (q for coordinate, q in pairs if (coordinate.unit == "rad") == turns)
        return float(max([self.allowed_gap(element, 1.0), *own]))

    def falling(self, element: OneWay, udot: Floats) -> float:
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
    return 2.0 ** math.ceil(math.log2(_BESIDE * value)) / _BESIDE if value > 0.0 else 0.0


def larger(scale: Scale, u: Floats, slides: Floats) -> Scale:
    """Return a run's size and speed, with the largest of the speeds now."""
    fastest = np.abs(u) * (slides + (1.0 - slides) * scale.length)
    return replace(scale, speed=max(scale.speed, float(fastest.max(initial=0.0))))


def rubs(facts: Facts, entered: Mechanism) -> bool:
    """Return whether anything slides with friction at an instant in a mode that is `entered`: coefficients may be 0."""
    sliding = [each for row in entered.rows if isinstance(row, SlidingRow) for each in row.frictions]
    along = {row.name for each in sliding for row in each.rows}
    parts = (part for element in facts.laws.mechanism.one_way for part in element.frictions)
    return any(max(facts.coefficients(part)) > 0.0 for part in parts if along & {row.name for row in part.rows})
