"""The states in which all laws hold at an instant: none, one or several.

In: a LawProblem, perhaps a state or mode that is near. Out: LawStates of `find`, with the modes that were searched.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, reduce
from itertools import islice, product
from operator import itemgetter
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from multibody_sym.contact_laws.enumeration import MOST, Proposal, candidate_modes, closer_edges, count_modes, propose
from multibody_sym.contact_laws.problem import (
    STICKS,
    Drift,
    Flags,
    LawMode,
    LawProblem,
    LawState,
    LawStates,
    ModeArrays,
    Places,
    Round,
    Scaled,
    ScaledFriction,
    Verdict,
    scaled,
    select,
)
from multibody_sym.contact_laws.solve_mode import (
    ModeSolution,
    Reduced,
    active_rows,
    eliminate_equalities,
    flip,
    forces_of,
    fulfils,
    holds_equations,
    label_by_motion,
    press,
    roughly,
    solve_mode,
    violations,
)
from multibody_sym.contact_laws.uniqueness import (
    SEEN,
    Ties,
    admissible_solution,
    mode_with_rates,
    open_forces,
    rate_problem,
    tied_limits,
)
from multibody_sym.errors import NoSolutionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import least_squares

# ----------------------------------------------------------------------------------------------------------------------
# Directions in which slip from rest in space begins, found together with the motion that they are those of.
#
#     x = C^T S(e) zeta,   A_k x + D_k S zeta = r_k,   e = a_t/|a_t| with a_t = A_t x - r_t
#
# by Newton's method for x and zeta. Just beyond the limit of rest accelerations are so small that any error of a
# direction makes larger ones: Newton's method for the directions has to begin as close to them as that. Those of x
# belong to one motion from the first, whose size is no matter.


_STEPS: Final = 40
_TURN: Final = 0.7
"""By how much (rad) an acceleration may turn in a step."""
_LEAST: Final = 0.3
"""The part of itself that is left of it along itself at least."""
_SHORTER: Final = 0.8
_SETTLED: Final = 1e-6
"""A step that changes all accelerations by less than this part of them leaves its square."""


def along_motion(
    problem: Scaled, mode: ModeArrays, mu: Floats, carrying: Flags, near: tuple[Floats, Floats]
) -> ModeArrays | None:
    """Return the mode with the directions in which its own motion goes, from x (n) and z (m) that are near.

    None where nothing slips from rest in space, or nothing settles.
    """
    touching = problem.pressed_parts(mode.sides)
    begun = (p for p in problem.parts if p.in_space and p.rests and touching[p.number] and mu[p.number])
    slips = [p for p in begun if mode.slips[p.number] != STICKS and carrying[p.normals].any() and not p.norm]
    if not slips:
        return None
    x, z = near
    active = active_rows(problem, mode, mu)
    one = _Newton(problem, mu, slips, np.flatnonzero(active), np.flatnonzero(active & carrying))
    zeta = z[one.free]
    for _ in range(_STEPS):
        turned = one.turned(mode, x, zeta)
        if turned is None:
            return None
        mode = turned
        step, changes = one.step(mode, x, zeta)
        far = _far(changes)
        x, zeta = x + far * step[: len(x)], zeta + far * step[len(x) :]
        if float(np.abs(changes).max()) < _SETTLED:
            return one.turned(mode, x, zeta)
    return None


def _far(changes: Floats) -> float:
    """Return the part of a step to take that changes accelerations (k), as parts of themselves: along and across."""
    far = 1.0
    while far > _SETTLED:
        along, across = 1.0 + far * changes[:, 0], far * changes[:, 1]
        if (along >= _LEAST).all() and (across <= np.tan(_TURN) * along).all():
            break
        far *= _SHORTER
    return far


@dataclass(frozen=True, eq=False)
class _Newton:
    """The parts that slip, the rows that are `active`, and those whose forces are `free`."""

    problem: Scaled
    mu: Floats
    slips: list[ScaledFriction]
    active: Places
    free: Places

    def accelerations(self, mode: ModeArrays, x: Floats, zeta: Floats) -> Floats:
        z = forces_of(self.problem, mode, self.mu, self.free, {}) @ zeta
        return np.asarray(self.problem.A @ x + self.problem.D @ z - self.problem.r, dtype=float)

    def turned(self, mode: ModeArrays, x: Floats, zeta: Floats) -> ModeArrays | None:
        """Return the mode with slip along a motion's accelerations; None where one has no direction."""
        found, a = mode.copy(), self.accelerations(mode, x, zeta)
        for part in self.slips:
            size = float(np.linalg.norm(a[part.rows]))
            if not size > 0.0:
                return None
            found.direction(part)[:] = a[part.rows] / size
        return found

    def step(self, mode: ModeArrays, x: Floats, zeta: Floats) -> tuple[Floats, Floats]:
        """Return the changes of x and zeta, and those of accelerations (k, 2) along and across themselves, as parts."""
        problem, A, r = self.problem, self.problem.A, self.problem.r
        S = forces_of(problem, mode, self.mu, self.free, {})
        z, pushes = S @ zeta, problem.C.T @ S
        a = A @ x + problem.D @ z - r
        sizes = [float(np.linalg.norm(a[part.rows])) for part in self.slips]
        turns = np.eye(len(x))
        for part, size in zip(self.slips, sizes, strict=True):
            e = mode.direction(part)
            across = np.eye(len(e)) - np.outer(e, e)
            turns += self.mu[part.number] * part.pressed(z) / size * problem.C[part.rows].T @ across @ A[part.rows]
        fixed = problem.D[self.active] @ S
        matrix = np.block([[turns, -pushes], [A[self.active], fixed]])
        missing = np.concatenate([pushes @ zeta - x, -a[self.active]])
        lengths = np.linalg.norm(matrix, axis=1)
        lengths[lengths == 0.0] = 1.0
        step = least_squares(matrix / lengths[:, None], missing / lengths)
        moved = A @ step[: len(x)] + problem.D @ S @ step[len(x) :]
        changes = []
        for part, size in zip(self.slips, sizes, strict=True):
            e, change = mode.direction(part), moved[part.rows] / size
            changes.append((float(e @ change), float(np.linalg.norm(change - (e @ change) * e))))
        return step, np.array(changes)


# ----------------------------------------------------------------------------------------------------------------------
# The states at given coefficients: from a mode that is near, from one that Lemke's method proposes, or among all.


FLIPS: Final = 10
SAME: Final = 1e-8
"""States whose accelerations differ by less than this part of the largest are one."""
SIDED: Final = 6
FINER: Final = 3
"""How often edges are put closer: by 4^3 at last."""
PASSES: Final = 30
ROUGH: Final = 0.01
"""Part of the largest by which directions in space that some passes have brought near may still miss."""


_NEAR, _TURNED = 1e-2, 1e-13
"""Directions of pressing forces that move less from pass to pass are near enough to look for a state; or settled."""
_STEEP: Final = 1e3
"""A coefficient of friction beyond which rounding may lead Lemke's method astray."""


@dataclass(frozen=True)
class Near:
    """A mode that may hold, the rows (m) that carry force in it, and how many flips are worth a try.

    `motion`: x and z near which the directions of its slip from rest in space are looked for.
    """

    mode: ModeArrays
    carrying: Flags | None = None
    flips: int = FLIPS
    motion: tuple[Floats, Floats] | None = None


class States:
    """One problem being searched: how many modes were tried, and whether nothing was left out."""

    def __init__(self, problem: Scaled, every: bool, most: int) -> None:
        self.problem, self.every, self.most = problem, every, most
        self.proved, self.tried = True, 0

    @cached_property
    def small(self) -> Reduced:
        return eliminate_equalities(self.problem)

    def at(self, mu: Floats, near: list[Near]) -> list[ModeSolution]:
        """Return the distinct states with these coefficients, or one of them."""
        found = list[ModeSolution]()
        modes = [replace(place, flips=0) for place in near[:-1]] + near[-1:]
        one = next((trial for place in modes if (trial := self._locally(mu, place)) is not None), None)
        contradicts = False
        if one is None:
            one, contradicts = self._proposed(mu)
        if one is not None:
            found.append(one)
            if not self.every or self._is_convex(mu):
                self.proved &= self._is_convex(mu)
                return found
        count = count_modes(self.problem, mu)
        if count > self.most:
            self.proved &= contradicts and self._copositive(mu)
            return found
        self.tried += count
        for mode, open_ in candidate_modes(self.problem, self.small, mu):
            trials = self._tried(mode, mu, found) if open_ else filter(fulfils, [solve_mode(self.problem, mode, mu)])
            for trial in trials:
                if not any(same(self.problem, trial, other) for other in found):
                    found.append(trial)
        self.proved &= bool(found) or not self._turns_anywhere(mu)
        return found

    def _turns_anywhere(self, mu: Floats) -> bool:
        """Return whether directions of slip or of pressing forces have to be iterated: there may be more of them."""
        rough = [p for p in self.problem.parts if mu[p.number] and not (p.held and p.rests)]
        return any((p.in_space and p.rests) or (p.norm and len(p.normals) > 1) for p in rough)

    def _tried(self, mode: ModeArrays, mu: Floats, found: list[ModeSolution]) -> Iterator[ModeSolution]:
        """Yield states of a mode that leaves forces open, with both sides of two-sided normals that stick.

        Where these forces do not move the system, its motion fits or does not, and may be known already.
        """
        stuck = [p for p in self.problem.parts if p.rests and mode.slips[p.number] == STICKS and not p.norm]
        two_sided = {int(k) for p in stuck for k in p.normals if self.problem.two_sided[k]}
        for sided in _with_sides(mode, two_sided):
            if mode.directions.any() and self._is_hopeless(roughly(self.problem, sided, mu), found):
                continue
            trial = solve_mode(self.problem, sided, mu)
            if fulfils(trial):
                yield trial
                continue
            if not trial.idle.shape[1] or not holds_equations(trial):
                continue
            if not self._open_motion(trial):
                wrong = any(v.kind in ("gap", "slip") for v in violations(trial))
                if wrong or (not self._open_sides(trial) and any(moves_alike(self.problem, trial, t) for t in found)):
                    continue
            other = admissible_solution(self.problem, trial)
            if other is not None and fulfils(other):
                yield other

    def _is_hopeless(self, trial: ModeSolution, found: list[ModeSolution]) -> bool:
        """Return whether a mode with rough directions in space is far from any state, or near one that is known."""
        if not trial.solved or self._open_motion(trial):
            return not trial.solved
        if any(v.kind in ("gap", "slip") and v.by > ROUGH for v in violations(trial)):
            return True
        return not self._open_sides(trial) and any(moves_alike(self.problem, trial, t, ROUGH) for t in found)

    def _open_motion(self, trial: ModeSolution) -> bool:
        """Return whether forces that are open move the system."""
        forces = np.abs(trial.forces @ trial.idle).max(initial=0.0)
        return float(np.abs(trial.moved).max(initial=0.0)) > SEEN * float(forces)

    def _open_sides(self, trial: ModeSolution) -> bool:
        """Return whether forces that are open press a joint."""
        changes = np.abs(trial.forces @ trial.idle).max(axis=1, initial=0.0)
        return bool((changes[self.problem.both] > SEEN * float(changes.max(initial=0.0))).any())

    def _is_convex(self, mu: Floats) -> bool:
        """Return whether nothing rubs: the motion is that of least constraint, and there is one."""
        return not mu.any() and bool(np.array_equal(self.problem.A, self.problem.C))

    def _copositive(self, mu: Floats) -> bool:
        """Return whether a ray means that there is no state: contacts at rest alone rub."""
        parts = [p for p in self.problem.parts if mu[p.number]]
        two_sided = self.problem.two_sided
        rest = all(p.rests and not p.norm and not p.in_space and not two_sided[p.normals].any() for p in parts)
        return rest and bool(np.array_equal(self.problem.A, self.problem.C))

    def _locally(self, mu: Floats, near: Near) -> ModeSolution | None:
        """Return a state in a mode, or in one that few flips lead to."""
        mode, carrying, seen = near.mode, near.carrying, set[bytes]()
        if near.motion is not None and carrying is not None:
            mode = along_motion(self.problem, mode, mu, carrying, near.motion) or mode
        for _ in range(near.flips + 1):
            trial = solve_mode(self.problem, mode, mu, carrying)
            if fulfils(trial):
                return trial
            if carrying is not None:
                carrying, trial = None, solve_mode(self.problem, mode, mu)
                if fulfils(trial):
                    return trial
            broken = sorted(violations(trial), key=lambda v: -v.by) if np.isfinite(trial.z).all() else []
            if near.flips and trial.idle.shape[1] and holds_equations(trial):
                other = admissible_solution(self.problem, trial)
                if other is not None and fulfils(other):
                    return other
            seen.add(mode.sides.tobytes() + mode.slips.tobytes())
            turned = (flip(self.problem, trial, v) for v in broken)
            mode_ = next((m for m in turned if m.sides.tobytes() + m.slips.tobytes() not in seen), None)
            if mode_ is None:
                return None
            mode = mode_
        return None

    def _proposed(self, mu: Floats) -> tuple[ModeSolution | None, bool]:
        """Return a state that Lemke's method leads to, and whether it ended on a ray, which no rounding explains.

        Coefficients that stand for all that is needed are beyond its digits: lower ones propose a mode then.
        """
        found, ray = self._proposed_by(mu, mu)
        if found is None and (mu > _STEEP).any():
            return self._proposed_by(mu, np.minimum(mu, _STEEP))[0], False
        return found, ray

    def _proposed_by(self, mu: Floats, coefficients: Floats) -> tuple[ModeSolution | None, bool]:
        """Return a state with coefficients mu that Lemke's method leads to with others, and whether it met a ray."""
        norms = [p for p in self.problem.parts if p.norm and mu[p.number]]
        pressing: dict[int, Floats] = {}
        ray, turned = False, 1.0 if norms else 0.0
        for k in range(PASSES if norms else 1):
            proposal = propose(self.problem, self.small, coefficients, pressing)
            ray, used = proposal.ray and not proposal.spent, dict(pressing)
            near, turned = turned < _NEAR or k == PASSES - 1, press(norms, proposal.z, pressing)
            trial = self._refined(mu, used, proposal) if (near or turned < _TURNED) and not proposal.ray else None
            if trial is not None:
                return trial, False
            if turned < _TURNED:
                break
        return None, ray

    def _refined(self, mu: Floats, pressing: dict[int, Floats], proposal: Proposal) -> ModeSolution | None:
        """Return a state that a proposal leads to, or one with ever more edges close to its friction in space."""
        for times in range(FINER + 1):
            motion = proposal.x, proposal.z
            trial = self._locally(mu, Near(proposal.mode, proposal.carrying, 0 if times else FLIPS, motion))
            trial = trial or self._moving_so(mu, proposal)
            if trial is not None:
                return trial
            fine = closer_edges(self.problem, mu, proposal, times + 1)
            if not fine:
                return None
            proposal = propose(self.problem, self.small, mu, pressing, fine)
            if proposal.ray:
                return None
        return None

    def _moving_so(self, mu: Floats, proposal: Proposal) -> ModeSolution | None:
        """Return the state in which all presses, sticks and slips as it moves in a proposal, whose forces are few."""
        moving = solve_mode(self.problem, proposal.mode, mu, proposal.carrying)
        if not np.isfinite(moving.x).all():
            return None
        trial = solve_mode(self.problem, label_by_motion(moving), mu)
        if trial.idle.shape[1] and holds_equations(trial):
            trial = admissible_solution(self.problem, trial) or trial
        return trial if fulfils(trial) else None


def either_side(problem: Scaled, trial: ModeSolution) -> Iterator[ModeArrays]:
    """Yield a trial's mode with each choice of sides of two-sided normals that have no force, but may have others.

    Of the first `SIDED` of them, so that there are not too many.
    """
    changes = np.abs(trial.forces @ trial.idle).max(axis=1, initial=0.0)
    open_ = (trial.mode.sides == 0) & (changes > SEEN * changes.max(initial=0.0))
    free = problem.both[open_[problem.both]]
    pressing = {int(k) for part in problem.parts if not part.norm for k in part.normals}
    yield from _with_sides(trial.mode, [int(k) for k in free if int(k) in pressing][:SIDED])


def _with_sides(mode: ModeArrays, chosen_rows: Collection[int]) -> Iterator[ModeArrays]:
    rows = sorted(chosen_rows)
    for sides in product((1, -1), repeat=len(rows)):
        chosen = mode.copy()
        chosen.sides[rows] = sides
        yield chosen


def same(problem: Scaled, one: ModeSolution, other: ModeSolution, unsure: Flags | None = None) -> bool:
    """Return whether two states have the same accelerations and press the same sides of joints that rub.

    Of sides that are `unsure` (m) nothing is asked: there the forces are not unique.
    """
    if not moves_alike(problem, one, other):
        return False
    unsure = np.zeros(problem.count, dtype=bool) if unsure is None else unsure
    if np.array_equal(label_by_motion(one).sides, label_by_motion(other).sides):
        return True
    largest = max(float(np.abs(trial.z).max(initial=0.0)) for trial in (one, other))
    sure = problem.both[~unsure[problem.both]]
    return bool((np.abs(one.z[sure] - other.z[sure]) <= SAME * largest).all())


def moves_alike(problem: Scaled, one: ModeSolution, other: ModeSolution, part: float = SAME) -> bool:
    """Return whether two states have the same accelerations, to a part of the largest."""
    scale = max(float(np.abs(trial.x).max(initial=0.0)) for trial in (one, other))
    scale = max(scale, float(np.abs(problem.r).max(initial=0.0)))
    return float(np.abs(one.x - other.x).max(initial=0.0)) <= part * scale


# ----------------------------------------------------------------------------------------------------------------------
# Groups of numbers that pairs connect.


def connected_groups(near: NDArray[np.bool_]) -> list[list[int]]:
    """Return the numbers that hang together by pairs that are `near` (n, n), over any others; the lowest first."""
    either, left, found = near | near.T, set(range(len(near))), list[list[int]]()
    while left:
        group, waiting = set[int](), {min(left)}
        while waiting:
            group |= waiting
            waiting = set(np.flatnonzero(either[sorted(waiting)].any(axis=0)).tolist()) - group
        left -= group
        found.append(sorted(group))
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Islands of a problem of laws: rows that share no weighted coordinate and no law with the others.


_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class Island:
    """Some `rows` and `parts` of a problem, by number, and the problem that they make, whatever all others do."""

    rows: Sequence[int]
    parts: Sequence[int]
    problem: LawProblem

    def mode(self, of: LawMode) -> LawMode:
        """Return what a mode of the whole is here."""
        return LawMode(_at(self.rows, of.sides), _at(self.parts, of.slips), _at(self.parts, of.directions))

    def state(self, of: LawState) -> LawState:
        """Return the mode and the rounds of a state of the whole, by which the search finds it again here."""
        rounds = tuple(map(self._round, of.rounds))
        return LawState(self.mode(of.mode), of.x, of.z[self.rows], of.a[self.rows], rounds=rounds)

    def _round(self, of: Round) -> Round:
        kinetic = frozenset(k for k, part in enumerate(self.parts) if part in of.kinetic)
        carrying = set(of.carrying)
        return Round(kinetic, self.mode(of.mode), tuple(k for k, row in enumerate(self.rows) if row in carrying))


def islands(problem: LawProblem) -> list[Island]:
    """Return the islands of a problem."""
    acts = (problem.matrix != 0.0) | (problem.exerted != 0.0)
    joined = acts @ acts.T | (problem.coupling != 0.0)
    for part in problem.parts:
        joined[part.rows[0], [*part.rows, *part.normals]] = True
    found = list[Island]()
    for rows in connected_groups(joined):
        own = set(rows)
        parts = [k for k, part in enumerate(problem.parts) if part.rows[0] in own]
        found.append(Island(rows, parts, select(problem, rows, parts)))
    return found


def join_states(apart: Sequence[Island], states: Sequence[LawState]) -> LawState:
    """Return the state of the whole that states of all its islands make."""
    each = list(zip(apart, states, strict=True))
    z, a = (np.zeros(sum(len(island.rows) for island in apart)) for _ in range(2))
    for island, state in each:
        z[island.rows], a[island.rows] = state.z, state.a
    rounds = list[Round]()
    for k in range(max(len(state.rounds) for state in states)):  # who has no more rounds stays at the last one
        now = [(island, state.rounds[min(k, len(state.rounds) - 1)]) for island, state in each if state.rounds]
        kinetic = _kinetic((island, of.kinetic) for island, of in now)
        mode = _mode([(island, of.mode) for island, of in now])
        rounds.append(Round(kinetic, mode, _rows((island, of.carrying) for island, of in now)))
    return LawState(
        _mode([(island, state.mode) for island, state in each]),
        reduce(np.add, (state.x for state in states)),
        z,
        a,
        _kinetic((island, state.kinetic) for island, state in each),
        _rows((island, state.not_unique) for island, state in each),
        _rows((island, state.at_limit) for island, state in each),
        tuple(rounds),
    )


def _mode(each: Sequence[tuple[Island, LawMode]]) -> LawMode:
    sides = _placed_at((island.rows, mode.sides) for island, mode in each)
    slips = _placed_at((island.parts, mode.slips) for island, mode in each)
    return LawMode(sides, slips, _placed_at((island.parts, mode.directions) for island, mode in each))


def _kinetic(each: Iterable[tuple[Island, frozenset[int]]]) -> frozenset[int]:
    return frozenset(island.parts[k] for island, parts in each for k in parts)


def _rows(each: Iterable[tuple[Island, Iterable[int]]]) -> tuple[int, ...]:
    return tuple(sorted(island.rows[k] for island, rows in each for k in rows))


def _at(places: Sequence[int], values: Sequence[_T]) -> tuple[_T, ...]:
    return tuple(values[k] for k in places)


def _placed_at(each: Iterable[tuple[Sequence[int], Sequence[_T]]]) -> tuple[_T, ...]:
    """Return values in the order of the places that are given with them."""
    found = sorted(((k, x) for places, values in each for k, x in zip(places, values, strict=True)), key=itemgetter(0))
    return tuple(x for _, x in found)


# ----------------------------------------------------------------------------------------------------------------------

_MOST_TOGETHER: Final = 64
"""The most states of the whole, where several islands have several each."""


def find(
    problem: LawProblem,
    previous: LawState | LawMode | None = None,
    *,
    every: bool = True,
    drift: Drift | None = None,
    left: Mapping[int, float] | None = None,
    most: int = MOST,
) -> LawStates:
    """Return the states that fulfil all laws, from a previous state or mode where that is still near.

    With `every` all modes of each island are tried as long as there are no more than `most`; without it one state is
    enough, they are tried only where none is found, and forces that are not unique are not told. Of two coefficients
    the static one holds for what does not slip: parts at rest have it first, those that slip then get the kinetic one,
    until no more slip. Where two modes fit at the limit, `left` decides, where exact numbers tell what is left there,
    too little for floats: by rows, z of what touches, and for friction (under its part's first row) mu N - |z_t|. Else
    rates do, which `drift` gives.
    Raises NoSolutionError for rows that are not finite.
    """
    numbers = problem.matrix, problem.exerted, problem.coupling, problem.right[:, None]
    if not all(np.isfinite(each).all() for each in numbers):
        wrong = np.flatnonzero(~np.isfinite(np.hstack(numbers)).all(axis=1))
        raise NoSolutionError(
            f"row {wrong[0]} among those of contacts, ropes and constraints is not finite here: a direction has no "
            "value, or a mass is zero; start from another position",
            number="N105",
        )
    if not every:
        found = _Search(scaled(problem), every, drift, left, most).found(previous)
        if found.states or found.proved:
            return found
    apart = islands(problem)
    alone = _of_islands(apart, previous, every, drift, left or {}, most) if len(apart) > 1 else None
    if alone is not None:
        return alone
    return _Search(scaled(problem), every, drift, left, most).found(previous) if every else found


def _of_islands(
    apart: Sequence[Island],
    previous: LawState | LawMode | None,
    every: bool,
    drift: Drift | None,
    left: Mapping[int, float],
    most: int,
) -> LawStates | None:
    """Return the states by those of each island; None where rates of the whole are to tell modes at limits apart."""
    found = list[LawStates]()
    for island in apart:
        own = island.state(previous) if isinstance(previous, LawState) else previous and island.mode(previous)
        known = {k: left[row] for k, row in enumerate(island.rows) if row in left}
        found.append(_Search(scaled(island.problem), every, None, known, most).found(own))
    if none := [each for each in found if not each.states]:
        return next((each for each in none if each.proved), none[0])
    if drift is not None and any(state.at_limit for each in found for state in each.states):
        return None
    states = list(islice(product(*(each.states for each in found)), _MOST_TOGETHER + 1))
    several = any(each.verdict == "several" for each in found)
    return LawStates(
        tuple(join_states(apart, state) for state in states[:_MOST_TOGETHER]),
        "several" if several else "one",
        ", ".join(dict.fromkeys(each.searched for each in found)),
        all(each.proved for each in found) and len(states) <= _MOST_TOGETHER,
        tuple(sorted(island.rows[k] for island, each in zip(apart, found, strict=True) for k in each.free)),
    )


Rounds = tuple[tuple[frozenset[int], Near], ...]
"""Parts that have the kinetic coefficient, and a solution with it, from static coefficients on."""


@dataclass(frozen=True)
class _End:
    """A state: its mode by what moves, rows at a limit, (m) which forces are not unique, which of these move things.

    No more parts slip in it than have the `kinetic` coefficient; `rounds` lead to it from static ones.
    """

    trial: ModeSolution
    mode: ModeArrays
    at_limit: tuple[int, ...]
    unsure: Flags
    moving: Flags
    kinetic: frozenset[int] = frozenset()
    rounds: Rounds = ()


class _Search:
    def __init__(
        self,
        problem: Scaled,
        every: bool,
        drift: Drift | None = None,
        left: Mapping[int, float] | None = None,
        most: int = MOST,
    ) -> None:
        self.problem, self.drift, self.left = problem, drift, left or {}
        self.exact = every or drift is not None
        self.states = States(problem, every, most)

    def found(self, previous: LawState | LawMode | None) -> LawStates:
        """Return the states, from a previous state or mode where that is still near."""
        ends = self.run(*_begin(self.problem, previous))
        told = tuple(self.state_of(end) for end in ends)
        free = np.flatnonzero(np.any([end.moving for end in ends], axis=0)) if ends else ()
        verdict: Verdict = "none" if not told else "one" if len(told) == 1 and not len(free) else "several"
        return LawStates(told, verdict, self.words(verdict), self.states.proved, tuple(int(k) for k in free))

    def run(self, near: list[Near], known: Rounds = ()) -> list[_End]:
        """Return the states, from those with static coefficients on to those in which no more parts slip.

        Modes `known` for some of the coefficients are tried before those that are near.
        """
        waiting: list[tuple[frozenset[int], list[Near], Rounds]] = [(frozenset(), near, ())]
        begun, ends = set[frozenset[int]](), list[_End]()
        while waiting:
            kinetic, near, rounds = waiting.pop(0)
            if kinetic in begun:
                continue
            begun.add(kinetic)
            near = [place for parts, place in known if parts == kinetic] + near
            for trial in self.states.at(self._coefficients(kinetic), near):
                end = self._labelled(trial, kinetic)
                slips = {p.number for p in self.problem.parts if p.rests and end.mode.slips[p.number] != STICKS}
                new = {k for k in slips - kinetic if self.problem.parts[k].kinetic != self.problem.parts[k].static}
                to_here = (*rounds, (kinetic, Near(trial.mode, self.problem.flags(trial.basic))))
                if new:
                    waiting.append((kinetic | new, [Near(trial.mode), Near(end.mode)], to_here))
                else:
                    self._add(ends, replace(end, kinetic=kinetic | slips, rounds=to_here))
        return ends

    def _add(self, ends: list[_End], new: _End) -> None:
        """Add a state, unless it is one that is there already, whose forces are not unique then."""
        for k, end in enumerate(ends):
            unsure = end.unsure | new.unsure
            if same(self.problem, new.trial, end.trial, unsure):
                ends[k] = replace(end, unsure=unsure)
                return
        ends.append(new)

    def _coefficients(self, kinetic: frozenset[int]) -> Floats:
        parts = self.problem.parts
        values = [p.kinetic if not p.rests or p.number in kinetic else p.static for p in parts]
        return np.array(values, dtype=float).reshape(len(parts))

    def _labelled(self, trial: ModeSolution, kinetic: frozenset[int]) -> _End:
        """Return the end that a state is if nothing else slips in it."""
        mode = label_by_motion(trial)
        none = np.zeros(self.problem.count, dtype=bool)
        if not self.exact:
            return _End(trial, mode, (), none, none)
        unsure, moving = none.copy(), none.copy()
        moved = solve_mode(self.problem, mode, trial.mu)
        sided = list(either_side(self.problem, moved))
        for here in [moved] if len(sided) == 1 else (solve_mode(self.problem, one, trial.mu) for one in sided):
            open_ = open_forces(self.problem, here, trial)
            unsure, moving = unsure | open_[0], moving | open_[1]
        limit = tied_limits(self.problem, trial, mode, unsure)
        for changes in (self._left, self._rates):
            if not limit or (change := changes(limit, self._state(trial, mode, kinetic))) is None:
                continue
            rates = rate_problem(self.problem, trial, mode, limit, *change)
            ends = _Search(rates.problem, every=True).run([])
            if len(ends) == 1:
                after = ends[0].trial, ends[0].mode
                mode, limit = mode_with_rates(self.problem, (trial, mode, limit), rates, after)
        return _End(trial, mode, limit.rows(self.problem), unsure, moving)

    def _left(self, limit: Ties, state: LawState) -> tuple[Floats, Floats] | None:
        """Return the distances from limits, over the largest, and no rates; None without exact numbers."""
        known = {k: self.left[k] * self.problem.sizes[k] for k in limit.rows(self.problem) if k in self.left}
        largest = max((abs(value) for value in known.values()), default=0.0)
        if not largest:
            return None
        left = np.zeros(self.problem.count)
        left[list(known)] = np.array(list(known.values())) / largest
        return np.zeros(self.problem.count), left

    def _rates(self, limit: Ties, state: LawState) -> tuple[Floats, Floats] | None:
        if self.drift is None:
            return None
        return self.drift(state) / self.problem.lengths, np.zeros(self.problem.count)

    # --- answers ------------------------------------------------------------------------------------------------------

    def state_of(self, end: _End) -> LawState:
        state = self._state(end.trial, end.mode, end.kinetic)
        return replace(
            state,
            not_unique=tuple(int(k) for k in np.flatnonzero(end.unsure)),
            at_limit=end.at_limit,
            rounds=tuple(self._round(kinetic, place) for kinetic, place in end.rounds),
        )

    def _state(self, trial: ModeSolution, mode: ModeArrays, kinetic: frozenset[int]) -> LawState:
        """Return a state in the units of the problem."""
        sizes, lengths = self.problem.sizes, self.problem.lengths
        return LawState(self._law_mode(mode), trial.x, trial.z / sizes, trial.a * lengths, kinetic)

    def _round(self, kinetic: frozenset[int], place: Near) -> Round:
        carrying = () if place.carrying is None else tuple(np.flatnonzero(place.carrying).tolist())
        return Round(kinetic, self._law_mode(place.mode), carrying)

    def _law_mode(self, mode: ModeArrays) -> LawMode:
        ways = [mode.direction(part) for part in self.problem.parts]
        directions = tuple(tuple(way.tolist()) if way.any() else None for way in ways)
        return LawMode(tuple(int(k) for k in mode.sides), tuple(int(k) for k in mode.slips), directions)

    def words(self, verdict: Verdict) -> str:
        """Return what was searched."""
        states = self.states
        if states.proved and states.tried:
            return f"all {states.tried} modes"
        if states.proved:
            return "a contradiction by Lemke's method" if verdict == "none" else "least constraint: there is no other"
        if verdict == "none":
            near = "the modes near the last one and near that of Lemke's method (they are too many for all)"
            ways = "directions of slip and of forces from a few starts"
            return f"all {states.tried} modes, {ways}" if states.tried else near
        return f"{verdict if verdict == 'several' else 'one state'} found, others not searched"


def _begin(problem: Scaled, previous: LawState | LawMode | None) -> tuple[list[Near], Rounds]:
    """Return the modes to begin with, and those to which coefficients led before."""
    if previous is None:
        return [], ()
    mode, known = (previous.mode, previous.rounds) if isinstance(previous, LawState) else (previous, ())
    rounds = ((each.kinetic, Near(modes_of(problem, each.mode), problem.flags(each.carrying))) for each in known)
    return [Near(modes_of(problem, mode))], tuple(rounds)


def modes_of(problem: Scaled, previous: LawMode) -> ModeArrays:
    """Return a mode by numbers; what moves slips as it does, and what has no direction to slip in sticks."""
    sides, slips = np.array(previous.sides, dtype=np.intp), np.array(previous.slips, dtype=np.intp)
    directions = np.zeros((len(slips), 3))
    for part in problem.parts:
        directions[part.number, : len(part.rows)] = previous.directions[part.number] or 0.0
        if not part.rests:
            slips[part.number] = part.moving_slip
        elif part.in_space and slips[part.number] and not directions[part.number].any():
            slips[part.number] = STICKS
    return ModeArrays(sides, slips, directions)
