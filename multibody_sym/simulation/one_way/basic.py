"""Forces that are not unique, as of a box on two corners: a basic solution, which a run follows until it ends.

What the laws allow them to be is a convex set, and a basic solution one of its corners: what touches may carry nothing
there, what rests may exert nothing or be at its static limit, and all others have unique forces. Where these leave
their bounds another corner is taken, or the state is another. Corners are found from the forces of the state, which
lie in the set: along what the motion does not see, to one bound after another. In space, where limits are circles, all
rows are kept instead, and share what they carry (`laws.shares`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.assemble import PosedLaws
from multibody_sym.dynamics.laws.judgement import fulfils
from multibody_sym.dynamics.laws.mode_solve import active_rows, solve_mode, sticking
from multibody_sym.dynamics.laws.problem import LawState
from multibody_sym.dynamics.laws.scaled import Flags, Modes, Part, Scaled, scaled
from multibody_sym.dynamics.laws.search import modes_of
from multibody_sym.dynamics.laws.shares import shared
from multibody_sym.model.mechanism.one_way import Mode, OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import SWITCHED, null_space, rank, row_space
from multibody_sym.records import dataclass

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
        return shared(problem, mode, state)
    best: _Corner | None = None
    for corner in forces.corners():
        best = corner if best is None or corner.room > best.room else best
        if best.room > _ROOM:
            break
    if best is not None:
        return best.mode
    return None if coupled else shared(problem, mode, state)


@dataclass(frozen=True, eq=False)
class _Forces:
    """The forces z (m) of a state in a mode, as parts of the largest, and what else they may be.

    `idle` (m, j) are combinations of them that no equation sees, `touches` (p) which parts anything presses. Where what
    slides rubs by such a force it moves otherwise: these are other states.
    """

    posed: PosedLaws
    problem: Scaled
    state: LawState
    modes: Modes
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
        restricting = _restricting(problem, modes, mu)
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
        least = _least(self.z, ways, rows)
        seen = set[tuple[int, ...]]()
        for wish in (None, rows.sum(axis=0), *rows, *-rows):
            z, reached = _walked(least, ways, rows, wish)
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

    def _limits(self, element: str, part: Part) -> Iterator[_Bound]:
        """Yield the static limits of a part, slip either way."""
        weights = part.weights(self.modes.sides, {part.number: part.along(self.z)})
        bound = part.bound(float(self.mu[part.number]), weights, len(self.z))
        for slip, row in zip((1, -1), part.cone(bound, np.array([[-1.0], [1.0]])), strict=True):
            yield _Bound(row, element, carried={self.posed.parts[part.number].name: slip})

    def _is_bare(self, element: OneWay, z: Floats) -> bool:
        """Return whether an element exerts nothing."""
        places = [self.posed.places[row.name] for row in element.rows if row.name in self.posed.places]
        return bool((np.abs(z[places]) <= _FLAT).all())

    def _unit(self, place: int) -> Floats:
        row = np.zeros(len(self.z))
        row[place] = 1.0
        return row

    def _at(self, z: Floats, reached: Sequence[_Bound]) -> Mode | None:
        """Return the mode in which forces z are at bounds, None where they are not the only ones, or beyond others."""
        posed, problem = self.posed, self.problem
        if any(not x.idle and not x.carried for x in reached):
            return None
        bare = {x.name for x in posed.elements if x.unilateral and self._is_bare(x, z)}  # its limits are all reached
        idle = list(dict.fromkeys(x.element for x in reached if x.idle or x.element in bare))
        carried = {name: how for x in reached if x.element not in idle for name, how in x.carried.items()}
        carrying, modes = np.ones(problem.count, dtype=bool), self.modes.copy()
        modes.sides[problem.both] = np.where(np.abs(z) > _FLAT, np.sign(z), 0)[problem.both]
        for element in posed.elements:
            if element.name in idle:
                carrying[[posed.places[row.name] for row in element.rows if row.name in posed.places]] = False
        for number, part in enumerate(posed.parts):
            if part.name in carried:
                carrying[problem.parts[number].rows] = False
                modes.slips[number] = carried[part.name]
        carrying[[posed.places[name] for name in carried if name in posed.places]] = False
        restricting = _restricting(problem, self.modes, self.mu)
        if rank(problem.A[restricting & carrying], SWITCHED) < rank(problem.A[restricting], SWITCHED):
            return None
        if not fulfils(problem, solve_mode(problem, modes, self.mu, carrying)):
            return None
        law_mode = replace(self.state.mode, sides=tuple(modes.sides.tolist()))
        return replace(posed.mode(replace(self.state, mode=law_mode)), idle=tuple(idle), carried=carried)


def _restricting(problem: Scaled, modes: Modes, mu: Floats) -> Flags:
    """Return (m) which rows restrict motion in a mode."""
    active = active_rows(problem, modes, mu)
    active[problem.defining] = False
    return active


def _sign(value: float) -> float:
    return -1.0 if value < 0.0 else 1.0


def _walked(z: Floats, ways: Floats, rows: Floats, wish: Floats | None) -> tuple[Floats, list[int]]:
    """Return a corner of what rows (b, m) z >= 0 leave of z along `ways` (m, j), and the bounds that it lies at.

    The way to it goes towards a wish (m) as far as it can, or else to the nearest bound, on along that, and so on.
    """
    reached: list[int] = []
    while ways.shape[1]:
        wanted = _towards(ways, wish) if wish is not None else _nearest(z, ways, rows)
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


def _least(z: Floats, ways: Floats, rows: Floats) -> Floats:
    """Return the least forces that differ from z along ways, or what is on the way there as bounds end it."""
    along = -ways @ (ways.T @ z)
    return np.asarray(z + min(1.0, float(_steps(z, along, rows).min(initial=1.0))) * along, dtype=float)


def _towards(ways: Floats, wish: Floats) -> Floats:
    """Return the direction (j) along ways that is nearest to a wish; the first one where they are across it."""
    wanted: Floats = ways.T @ wish
    size = float(np.linalg.norm(wanted))
    return wanted / size if size > _FLAT * float(np.linalg.norm(wish)) else np.eye(len(wanted))[0]


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
