"""What is left when equalities are eliminated: motion and all forces as affine functions of the other rows' forces.

K = A X + D.. of these rows is formed, which squares the condition of A: it proposes modes, and judges none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.contact_laws.problem import (
    IN_SPACE,
    STICKS,
    Flags,
    ModeArrays,
    Places,
    Scaled,
    ScaledFriction,
    beyond,
    limits_of,
    over_parts,
    signed,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats, lengths
from multibody_sym.scalars.limits import ACCEPTED, OF_FORCES, TIED, Kind
from multibody_sym.scalars.pivoted_qr import PivotedQr, blas, pivoted_qr
from multibody_sym.scalars.rank import ROUNDED, exact, least_squares, null_space

# ----------------------------------------------------------------------------------------------------------------------
# The motion and the forces of a mode, by QR of its rows: W = H M^-1 H^T is not formed, which squares the condition.
#
# With the active rows A_k^T = Q R and all forces z = S zeta (what slides exerts -+ mu times its normals):
#
#     R^T y = r,   x = Q y + (E - Q Q^T) C^T S zeta,   Q^T C^T S zeta = y   and the rows that define forces,
#
# solved by QR with column pivoting. Directions of slip that starts in space, and of forces whose length presses, are
# found by Newton's method around that solve.


SETTLED: Final = 1e-13
PASSES: Final = 30
TURNS: Final = 15
TURNED: Final = 1e-10
LOST: Final = 2
TURN_LOST: Final = 0.3
"""Directions that still turn by so much (rad) after so many passes do not settle."""
STANDS: Final = 1e-12
"""Part of its terms below which an acceleration has no direction."""
VANISHING: Final = 1e-12
"""Part of the largest force below which a force whose length presses is none, and has no direction."""


@dataclass(frozen=True)
class ModeSolution:
    """What a mode of a problem leads to: x (n), z (m), a (m), whether its equations can be `solved` at all.

    `active` (m) are the rows with a = 0, those that define forces among them; `forces` (m, k) is the map from those z
    that were free to all, `idle` (k, j) combinations of them that no equation sees, and `moved` (n, j) what these do to
    x; `basic` are the rows whose z the solution is made of.
    """

    problem: Scaled
    mode: ModeArrays
    mu: Floats
    active: Flags
    x: Floats
    z: Floats
    a: Floats
    solved: bool
    basic: Places
    forces: Floats
    idle: Floats
    moved: Floats

    @cached_property
    def largest(self) -> float:
        """The size of the largest force."""
        return float(np.abs(self.z).max(initial=0.0))

    @cached_property
    def terms(self) -> Floats:
        """How large (m) the terms of which a consists are."""
        return self.problem.terms(self.x, self.z)

    @cached_property
    def rounding(self) -> Floats:
        """Rounding (m) of the largest terms: x = C^T z is what large forces leave of each other where things jam."""
        largest = math.sqrt(self.x @ self.x) + self.problem.wanted
        found: Floats = 100.0 * EPSILON * (largest + self.problem.couplings * self.largest)
        return found + EPSILON * float(np.abs(self.z).sum())


def solve_mode(problem: Scaled, mode: ModeArrays, mu: Floats, carrying: Flags | None = None) -> ModeSolution:
    """Return what a mode leads to with coefficients mu (p); forces that `carrying` (m) leaves out are zero."""
    pressing: dict[int, Floats] = {}
    touching = problem.pressed_parts(mode.sides)
    slides = [p for p in problem.parts if touching[p.number] and (mode.slips[p.number] != STICKS or not p.rests)]
    norms = [p for p in slides if p.norm and mu[p.number]]
    turning = [p for p in slides if p.in_space and p.rests]
    equations = _equations(problem, mode, mu, carrying)
    if norms and not turning:
        settled = _press_until_settled(equations, mode, norms, pressing)
        trial = equations.solved(mode, pressing).trial
        return trial if settled or _is_settled(norms, turning, trial, pressing) else replace(trial, solved=False)
    solution = equations.solved(mode, pressing)
    trial = solution.trial
    if any(_stands(part, trial) or not mode.direction(part).any() for part in turning):
        return replace(trial, solved=False)
    for k in range(TURNS if turning else 0):
        change = press(norms, trial.z, pressing)
        solution = equations.solved(mode, pressing) if norms else solution
        mode, turned = _turn_slips(turning, solution)
        if k >= LOST and turned > TURN_LOST:
            return replace(trial, solved=False)
        # Newton's method has converged where its step is small: what is left is the step's square.
        change = max(change, turned if turned > TURNED else 0.0)
        solution = equations.solved(mode, pressing)
        trial = solution.trial
        if change < SETTLED:
            return trial
    if turning:
        return trial if _is_settled(norms, turning, trial, pressing) else replace(trial, solved=False)
    return trial


def roughly(problem: Scaled, mode: ModeArrays, mu: Floats) -> ModeSolution:
    """Return what a mode leads to with the directions that it comes with."""
    return _equations(problem, mode, mu, None).solved(mode, {}).trial


def _press_until_settled(
    equations: _Equations, mode: ModeArrays, norms: list[ScaledFriction], pressing: dict[int, Floats]
) -> bool:
    """Take the directions of pressing forces from passes that begin without them, and return whether they settle."""
    z = equations.forces(mode, pressing)
    for _ in range(PASSES):
        change = press(norms, z, pressing)
        z = equations.forces(mode, pressing)
        if change < SETTLED:
            return True
    return False


def press(norms: list[ScaledFriction], z: Floats, pressing: dict[int, Floats]) -> float:
    """Take the directions of pressing forces from the last pass, and return by how much they moved."""
    change, least = 0.0, VANISHING * float(np.abs(z).max(initial=0.0))
    for part in norms:
        new = part.along(z, least)
        change = max(change, float(np.abs(new - pressing.get(part.number, 0.0)).max(initial=0.0)))
        pressing[part.number] = new
    return change


def _is_settled(
    norms: list[ScaledFriction], turning: list[ScaledFriction], trial: ModeSolution, pressing: dict[int, Floats]
) -> bool:
    """Accept what rounding keeps from settling altogether."""
    if norms and press(norms, trial.z, dict(pressing)) > 1e-10:
        return False
    terms = trial.terms
    sizes = [1e-10 * float(np.linalg.norm(trial.a[p.rows])) + 1e-13 * float(terms[p.rows].max()) for p in turning]
    return all(across_slip(part, trial) <= size for part, size in zip(turning, sizes, strict=True))


# --- directions of slip in space --------------------------------------------------------------------------------------


def _stands(part: ScaledFriction, trial: ModeSolution) -> bool:
    """Return whether a part does not slip at all, so that there is no direction: what sticks is another mode."""
    terms = trial.terms[part.rows].max() + float(np.linalg.norm(trial.x))
    return bool(np.abs(trial.a[part.rows]).max() <= STANDS * terms)


def across_slip(part: ScaledFriction, trial: ModeSolution) -> float:
    """Return how large the part of a_t across the direction in which it slips is."""
    return float(np.linalg.norm(_across(trial.mode.direction(part), trial.a[part.rows])))


def _across(direction: Floats, a: Floats) -> Floats:
    return a - (a @ direction) * direction


def _turn_slips(turning: list[ScaledFriction], solution: _Solution) -> tuple[ModeArrays, float]:
    """Return the mode after a Newton step for the angles at which slip is along a_t, and the largest turn.

    A direction turns by one angle in a plane, by two in space, each towards a unit vector across it.
    """
    trial, mode = solution.trial, solution.trial.mode
    ways = [_beside(mode.direction(part)) for part in turning]
    ends = np.cumsum([0, *(way.shape[1] for way in ways)])
    own = [slice(first, last) for first, last in pairwise(ends)]
    forces = np.zeros((len(trial.z), ends[-1]))  # (m, angles): friction for each angle
    for part, way, k in zip(turning, ways, own, strict=True):
        weights = part.weights(mode.sides, solution.pressing)
        forces[part.rows, k] = -trial.mu[part.number] * weights @ trial.z[part.normals] * way
    changes = solution.change(forces)
    missing, slopes = np.empty(ends[-1]), np.empty((ends[-1], ends[-1]))
    for part, way, k in zip(turning, ways, own, strict=True):
        e, a = mode.direction(part), trial.a[part.rows]
        missing[k] = way.T @ a
        slopes[k] = way.T @ changes[part.rows]
        slopes[k, k] -= (a @ e) * np.eye(way.shape[1])
    step = least_squares(slopes, -missing)
    for part, way, k in zip(turning, ways, own, strict=True):
        e, a = mode.direction(part), trial.a[part.rows]
        if e @ a < -0.5 * float(np.linalg.norm(a)):  # slip that goes backward turns around
            step[k] = np.arctan2(np.linalg.norm(_across(e, a)), e @ a) * _unit(way.T @ a)
    step = np.clip(step, -0.7, 0.7)
    found = mode.copy()
    for part, way, k in zip(turning, ways, own, strict=True):
        angle = float(np.linalg.norm(step[k]))
        e = np.cos(angle) * mode.direction(part) + np.sin(angle) * (way @ _unit(step[k]))
        found.direction(part)[:] = e / np.linalg.norm(e)
    return found, float(np.abs(step).max())


def _beside(direction: Floats) -> Floats:
    """Return (d, d - 1) unit vectors across a unit vector and each other."""
    if len(direction) == 2:
        return np.array([[-direction[1]], [direction[0]]])
    first = np.cross(direction, np.eye(3)[int(np.abs(direction).argmin())])
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(direction, first)])


def _unit(vector: Floats) -> Floats:
    """Return a vector's direction, the first one there is where it is zero."""
    size = float(np.linalg.norm(vector))
    return vector / size if size else np.eye(len(vector))[0]


# --- the linear solve -------------------------------------------------------------------------------------------------


def sticking(problem: Scaled, mode: ModeArrays, mu: Floats) -> Flags:
    """Return (m) which friction rows restrict motion: those of parts that touch and stick."""
    table = problem.table
    stuck = np.zeros(problem.count, dtype=bool)
    parts = table.rests & (mode.slips == STICKS) & (mu != 0.0) & problem.pressed_parts(mode.sides)
    stuck[table.rows] = np.repeat(parts, table.sizes)
    return stuck


def active_rows(problem: Scaled, mode: ModeArrays, mu: Floats) -> Flags:
    """Return (m) which rows have a = 0, those that define forces among them."""
    active = sticking(problem, mode, mu)
    active[problem.kinematic] = active[problem.defining] = True
    active[problem.unilateral] = mode.sides[problem.unilateral] > 0
    return active


def forces_of(problem: Scaled, mode: ModeArrays, mu: Floats, free: Places, pressing: dict[int, Floats]) -> Floats:
    """Return S (m, k): all forces of free ones, which sliding friction follows."""
    return _Following.of(problem, mode, mu, free).forces(mode, pressing)


@dataclass(frozen=True, eq=False)
class _Following:
    """What sliding friction follows: S (m, k) but for its `parts` that turn or that a length presses.

    Each of these with the entries of S, and those of its normals whose forces are free.
    """

    mu: Floats
    parts: tuple[tuple[ScaledFriction, tuple[Places, Places], Flags], ...]
    fixed: Floats

    @staticmethod
    def of(problem: Scaled, mode: ModeArrays, mu: Floats, free: Places) -> _Following:
        """Return it by what slides in a mode, whatever its directions."""
        S, place = np.zeros((problem.count, len(free))), np.full(problem.count, -1)
        S[free, np.arange(len(free))] = 1.0
        place[free] = np.arange(len(free))
        table = problem.table
        slides = (mu != 0.0) & (~table.rests | (mode.slips != STICKS)) & problem.pressed_parts(mode.sides)
        lines = slides & (table.sizes == 1) & ~table.norm
        normals = np.flatnonzero(lines[table.owners] & (place[table.normals] >= 0))
        owners, pressing = table.owners[normals], table.normals[normals]
        weights = signed(table.base[normals], mode.sides[pressing])
        ways = np.where(table.rests, mode.slips, table.senses)
        S[table.rows[table.first[owners]], place[pressing]] = -(mu * ways)[owners] * weights
        parts = list[tuple[ScaledFriction, tuple[Places, Places], Flags]]()
        for number in np.flatnonzero(slides & ~lines):
            part = problem.parts[number]
            columns = place[part.normals]
            there = columns >= 0
            parts.append((part, (part.rows[:, None], columns[there]), there))
        return _Following(mu, tuple(parts), S)

    def forces(self, mode: ModeArrays, pressing: dict[int, Floats]) -> Floats:
        """Return S (m, k) by the directions of a mode, and of what presses."""
        S = self.fixed.copy()
        for part, entries, there in self.parts:
            weights = part.weights(mode.sides, pressing)
            S[entries] = -self.mu[part.number] * (mode.way(part)[:, None] * weights[there])
        return S


@dataclass(frozen=True, eq=False)
class _Equations:
    """What a mode's equations are whatever its directions: (m) which rows are `active`, and the `free` forces.

    `restricting` are A and r of those that restrict, `rows` the independent ones; `defining` A and D of those that
    define forces. `still` (n) is the motion without forces beside the rows, `right` the right sides along these, then
    of forces; `following` what sliding friction follows.
    """

    problem: Scaled
    mu: Floats
    active: Flags
    free: Places
    following: _Following
    restricting: tuple[Floats, Floats]
    defining: tuple[Floats, Floats]
    rows: Restricted
    still: Floats
    right: Floats

    def forces(self, mode: ModeArrays, pressing: dict[int, Floats]) -> Floats:
        """Return the forces z (m) alone."""
        S = self.following.forces(mode, pressing)
        return np.asarray(S @ _basic(self.seen(S)[0]).solution(self.right[:, None])[:, 0], dtype=float)

    def solved(self, mode: ModeArrays, pressing: dict[int, Floats]) -> _Solution:
        """Solve the mode with directions as they are."""
        problem, Q = self.problem, self.rows.Q
        S = self.following.forces(mode, pressing)
        seen, beside = self.seen(S)
        basic = _basic(seen)
        zeta = basic.solution(self.right[:, None])[:, 0]
        x = self.still + beside @ zeta
        z = S @ zeta
        # Q mixes light bodies with what moves heavy ones: what that left of their rows is taken back.
        A, r = self.restricting
        x -= Q @ self.rows.components(A @ x - r)
        a = problem.A @ x + problem.D @ z - problem.r
        idle, places, solved = basic.idle(), self.free[basic.places], basic.solves(zeta, self.right)
        trial = ModeSolution(problem, mode, self.mu, self.active, x, z, a, solved, places, S, idle, beside @ idle)
        return _Solution(self, trial, beside, basic, pressing)

    def seen(self, forces: Floats) -> tuple[Floats, Floats]:
        """Return what the equations see of forces (m, k), and what these do beside the rows (n, k)."""
        Q, (A, D) = self.rows.Q, self.defining
        pushes = self.problem.C.T @ forces
        along = Q.T @ pushes
        beside = pushes - Q @ along
        return np.concatenate([along, A @ beside + D @ forces]) if len(A) else along, beside


def _equations(problem: Scaled, mode: ModeArrays, mu: Floats, carrying: Flags | None) -> _Equations:
    active = active_rows(problem, mode, mu)
    free = np.flatnonzero(active if carrying is None else active & carrying)
    restricting = active.copy()
    restricting[problem.defining] = False
    A, r = problem.A[restricting], problem.r[restricting]
    rows = restricted(A)
    y = rows.components(r)
    still = rows.Q @ y
    F = problem.defining
    defining = problem.A[F], problem.D[F]
    right = np.concatenate([y, problem.r[F] - defining[0] @ still])
    following = _Following.of(problem, mode, mu, free)
    return _Equations(problem, mu, active, free, following, (A, r), defining, rows, still, right)


@dataclass(frozen=True, eq=False)
class _Solution:
    """A solution of a mode's equations, and what it takes to change it; `beside` (n, k) is what free forces do."""

    equations: _Equations
    trial: ModeSolution
    beside: Floats
    basic: _Basic
    pressing: dict[int, Floats]

    def change(self, forces: Floats) -> Floats:
        """Return by how much a (m, j) changes with forces (m, j), which others answer as the equations ask."""
        problem = self.equations.problem
        seen, beside = self.equations.seen(forces)
        zeta = self.basic.solution(-seen)
        return problem.A @ (beside + self.beside @ zeta) + problem.D @ (forces + self.trial.forces @ zeta)


@dataclass(frozen=True, eq=False)
class Restricted:
    """The independent ones, `kept`, among rows A: A[kept]^T = Q R, Q (n, k)."""

    Q: Floats
    R: Floats
    kept: Places

    def components(self, right: Floats) -> Floats:
        """Return y (k) with x = Q y the shortest that fulfils the independent ones among A x = r."""
        return _triangular(self.R, right[self.kept, None], transposed=True)[:, 0]


def restricted(rows: Floats) -> Restricted:
    """Return the independent ones among rows A, which restrict motion."""
    size = rows.shape[1]
    if not len(rows):
        return Restricted(np.zeros((size, 0)), np.zeros((0, 0)), np.zeros(0, dtype=np.intp))
    Q, R, order, kept = pivoted_qr(rows.T, least=1.0)
    return Restricted(Q[:, :kept], R[:kept, :kept], np.asarray(order[:kept], dtype=np.intp))


def _triangular(R: Floats, right: Floats, *, transposed: bool = False) -> Floats:
    """Return R^-1 B or R^-T B; LAPACK's own routine waits for threads even where the matrix is small."""
    if not R.size or not right.size:
        return np.zeros(right.shape)
    return np.asarray(blas().dtrsm(1.0, R, right, trans_a=int(transposed)), dtype=float)


@dataclass(frozen=True, eq=False)
class _Basic:
    """Equations E (k, j) as `unit`, whose columns are E's over `sizes` (j), and the QR of these in an order."""

    unit: Floats
    sizes: Floats
    qr: PivotedQr

    @cached_property
    def places(self) -> Places:
        """The places of what solutions are made of."""
        return np.asarray(self.qr.order[: self.qr.rank], dtype=np.intp)

    def idle(self) -> Floats:
        """Return combinations (j, j - rank) that the equations do not see."""
        count, rank = len(self.sizes), self.qr.rank
        idle = np.zeros((count, count - rank))
        if rank < count:
            idle[self.places] = -_triangular(self.qr.R[:rank, :rank], self.qr.R[:rank, rank:])
            idle[self.qr.order[rank:]] = np.eye(count - rank)
            idle /= self.sizes[:, None]
        return idle

    def solution(self, right: Floats) -> Floats:
        """Return zeta (j, c) for right sides (k, c)."""
        zeta, rank = np.zeros((len(self.sizes), right.shape[1])), self.qr.rank
        turned, R, places = self.qr.Q[:, :rank].T, self.qr.R[:rank, :rank], self.places
        for _ in range(2):  # once more for what rounding left
            zeta[places] += _triangular(R, turned @ (right - self.unit @ zeta))
        return zeta / self.sizes[:, None]

    def solves(self, zeta: Floats, right: Floats) -> bool:
        """Return whether zeta (j) fulfils the equations with a right side (k)."""
        zeta = zeta * self.sizes
        missing = float(np.abs(right - self.unit @ zeta).max(initial=0.0))
        terms = float((np.abs(self.unit) @ np.abs(zeta) + np.abs(right)).max(initial=0.0))
        return missing <= 1e-10 * terms + 1e3 * EPSILON * terms


def _basic(equations: Floats) -> _Basic:
    sizes = lengths(equations.T)
    sizes[sizes <= exact(equations) * float(sizes.max(initial=0.0))] = 1.0
    unit = equations / sizes
    return _Basic(unit, sizes, pivoted_qr(unit))


# ----------------------------------------------------------------------------------------------------------------------

LEFT: Final = 1e-14
"""What equalities leave of rows of unit length that depend on them: rounding, which must not look like a row."""


@dataclass(frozen=True)
class Reduced:
    """z = z0 + Z f, x = x0 + X f, a = a0 + K f for the forces f (k) of the rows `own`, all other rows equalities.

    With `open_sides` equalities depend on each other so that forces which rub are not unique: these are some of them.
    """

    own: Places
    place: Places
    z0: Floats
    Z: Floats
    x0: Floats
    X: Floats
    a0: Floats
    K: Floats
    open_sides: bool


def eliminate_equalities(problem: Scaled) -> Reduced:
    """Return the problem without its equalities."""
    equal = np.sort(np.concatenate([problem.kinematic, problem.defining]))
    own = np.setdiff1d(np.arange(problem.count), equal)
    A, C, D, r = problem.A, problem.C, problem.D, problem.r
    F = problem.defining
    rows = restricted(A[problem.kinematic])
    Q, y = rows.Q, rows.components(r[problem.kinematic])
    along = Q.T @ C.T
    beside = C.T - Q @ along
    still = Q @ y
    equations = np.vstack([along, A[F] @ beside + D[F]])
    right = np.concatenate([y, r[F] - A[F] @ still])
    z0, Z = np.zeros(problem.count), np.zeros((problem.count, len(own)))
    Z[own, np.arange(len(own))] = 1.0
    if len(equal):
        both = np.column_stack([right, -equations[:, own]])
        answer = least_squares(equations[:, equal], both, ROUNDED)
        z0[equal], Z[equal] = answer[:, 0], answer[:, 1:]
    open_sides = False  # whether forces of equalities that nothing determines press what rubs
    if problem.parts and np.isin(problem.both, equal).any():
        idle = null_space(equations[:, equal], ROUNDED)
        open_sides = bool(np.abs(idle[np.isin(equal, problem.both)]).max(initial=0.0) > ROUNDED)
    x0, X = still + beside @ z0, beside @ Z
    place = np.full(problem.count, -1)
    place[own] = np.arange(len(own))
    a0, K = A @ x0 + D @ z0 - r, A @ X + D @ Z
    terms = problem.terms(x0, z0)
    a0[np.abs(a0) <= LEFT * (terms + float(np.linalg.norm(x0)))] = 0.0
    K[np.abs(K) <= LEFT] = 0.0
    return Reduced(own, place, z0, Z, x0, X, a0, K, open_sides)


# ----------------------------------------------------------------------------------------------------------------------
# Modes whose equations leave one combination of forces open: whether it has values at which their laws may hold.


def may_hold(
    problem: Scaled,
    mu: Floats,
    modes: ModeArrays,
    here: tuple[Floats, Floats],
    way: tuple[Floats, Floats],
    loose: float,
) -> Flags:
    """Return (b) whether all inequalities on lines hold for some t, to a part `loose` of what is largest.

    `here`: z (b, m) and a (b, m) of modes, which change by t times the `way`. Only with friction on lines; of what
    sticks between two sides nothing is asked.
    """
    present, slope = (_limits(problem, mu, modes, *values) for values in (here, way))
    gap = float(np.abs(problem.r).max(initial=0.0))
    z, dz = (_largest(values[0]) for values in (here, way))
    a, da = _largest(here[1]) + gap, _largest(way[1])
    own = np.where(present[1], z[:, None], (a + z)[:, None]), np.where(present[1], dz[:, None], (da + dz)[:, None])
    allowed, grows = present[0] + loose * own[0], loose * own[1]
    forward = _from_zero(allowed, slope[0] + grows)
    return np.asarray(forward | _from_zero(allowed, -slope[0] + grows))


def _largest(values: Floats) -> Floats:
    return np.asarray(np.abs(values).max(axis=1, initial=0.0))


def _from_zero(present: Floats, slope: Floats) -> Flags:
    """Return (b) whether present + slope t >= 0 (b, i) for some t >= 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = -present / slope
    low = np.where((slope > 0.0) & (present < 0.0), ends, 0.0).max(axis=1, initial=0.0)
    high = np.where(slope < 0.0, ends, np.inf).min(axis=1, initial=np.inf)
    never = ((slope == 0.0) & (present < 0.0)).any(axis=1)
    return np.asarray((low <= high) & ~never)


def _limits(problem: Scaled, mu: Floats, modes: ModeArrays, z: Floats, a: Floats) -> tuple[Floats, Flags]:
    """Return what must not be negative (b, i), zero where nothing is asked, and which (i) are forces."""
    table, (force, gap, cone, slip, side) = problem.table, limits_of(problem, modes, mu, z, a)
    N, rubs = over_parts(np.add, problem.loads(z), table.starts), z[:, table.rows[table.first]]
    one_sided = ~over_parts(np.logical_or, problem.two_sided[table.normals], table.starts)
    cones = [replace(cone, values=-beyond(x, N, mu), asked=cone.asked & one_sided) for x in (rubs, -rubs)]
    limits = [force, side, *cones, gap, slip]
    forces = np.repeat([x.kind in OF_FORCES for x in limits], [len(x.places) for x in limits])
    return np.hstack([np.where(x.asked, x.values, 0.0) for x in limits]), forces


# ----------------------------------------------------------------------------------------------------------------------
# Whether the solution of a mode fulfils all laws, what to flip where it does not, and its labels by motion.


@dataclass(frozen=True)
class Violation:
    """An inequality that does not hold: which (`place` is the number of a row, or of a part), and by how much."""

    kind: Kind
    place: int
    by: float


def gap_tolerance(trial: ModeSolution, part: float) -> Floats:
    """Return (m) what of a counts as zero: a part of each row's terms, and rounding of the largest ones."""
    return np.asarray(part * trial.terms + trial.rounding + 1e-300, dtype=float)


def force_tolerance(trial: ModeSolution, part: float) -> float:
    """Return what of z counts as zero: a part of the largest, and rounding of what the forces come from."""
    return part * trial.largest + 100.0 * EPSILON * trial.problem.wanted + 1e-300


def fulfils(trial: ModeSolution) -> bool:
    return holds_equations(trial) and next(violations(trial), None) is None


def holds_equations(trial: ModeSolution) -> bool:
    """Return whether a = 0 wherever the mode says so, dependent rows too."""
    if not trial.solved or not np.isfinite(trial.x).all():
        return False
    return bool((np.abs(trial.a) <= gap_tolerance(trial, ACCEPTED))[trial.active].all())


def violations(trial: ModeSolution) -> Iterator[Violation]:
    """Yield the inequalities that do not hold, sizes relative to what is largest of their kind."""
    problem, force, gap = trial.problem, force_tolerance(trial, ACCEPTED), gap_tolerance(trial, ACCEPTED)
    table = problem.table
    of_parts = over_parts(np.maximum, gap[table.rows], table.first)
    of_kinds = {"gap": gap[problem.unilateral], "slip": of_parts}
    for limits in limits_of(problem, trial.mode, trial.mu, trial.z, trial.a):
        allowed = of_kinds[limits.kind] if limits.kind in of_kinds else np.full(len(limits.places), force)
        for k in (limits.asked & (limits.values < -allowed)).nonzero()[0]:
            yield Violation(limits.kind, int(limits.places[k]), float(-limits.values[k] / (allowed[k] / ACCEPTED)))
        for number in np.flatnonzero(limits.asked & (table.sizes > 1)) if limits.kind == "slip" else ():
            part = problem.parts[number]
            across, size = across_slip(part, trial), float(np.linalg.norm(trial.a[part.rows]))
            if across > ACCEPTED * size + of_parts[number]:
                yield Violation("slip", part.number, across / size)


def flip(problem: Scaled, trial: ModeSolution, found: Violation) -> ModeArrays:
    """Return the mode in which the violated inequality gives way to its complement."""
    mode = trial.mode.copy()
    if found.kind in ("force", "gap"):
        mode.sides[found.place] = 1 - mode.sides[found.place]
    elif found.kind == "side":
        mode.sides[found.place] = -1 if mode.sides[found.place] >= 0 else 1
    elif found.kind == "slip":
        mode.slips[found.place] = STICKS
    else:
        part = problem.parts[found.place]
        force = trial.z[part.rows]
        if part.in_space:
            mode.slips[found.place] = IN_SPACE
            mode.direction(part)[:] = -force / np.linalg.norm(force)
        else:
            mode.slips[found.place] = -1 if force[0] > 0 else 1
        for k in part.normals:
            if k in problem.both:
                mode.sides[k] = -1 if trial.z[k] < 0 else 1
    return mode


# --- labels -----------------------------------------------------------------------------------------------------------


def label_by_motion(trial: ModeSolution) -> ModeArrays:
    """Return the mode by what moves: closed, stick and taut wherever a = 0; else what a and v_t say."""
    problem, mode = trial.problem, trial.mode.copy()
    tolerance = gap_tolerance(trial, TIED)
    still = np.abs(trial.a) <= tolerance
    unilateral = problem.unilateral
    mode.sides[unilateral] = (trial.mode.sides[unilateral] > 0) | still[unilateral]
    force = force_tolerance(trial, TIED)
    mode.sides[problem.both] = np.where(np.abs(trial.z[problem.both]) <= force, 0, np.sign(trial.z[problem.both]))
    touching = problem.pressed_parts(mode.sides)
    turned = problem.pressed_parts(trial.mode.sides)
    stands = touching & problem.table.rests & (trial.mode.slips == STICKS) & turned
    stands |= touching & problem.table.rests & problem.of_all_rows(still)
    mode.slips[:], mode.directions[:] = STICKS, 0.0
    for number in np.flatnonzero(touching & ~(stands & (trial.mu != 0.0))):
        part = problem.parts[number]
        mode.slips[number], mode.direction(part)[:] = _slip(part, trial, bool(stands[number]), bool(turned[number]))
    sticks = touching & problem.table.rests & (mode.slips == STICKS)
    mode.sides[problem.table.rows] = np.repeat(sticks, problem.table.sizes)
    return mode


def _slip(part: ScaledFriction, trial: ModeSolution, stands: bool, turned: bool) -> tuple[int, Floats]:
    """Return how a part slips, and its direction from rest in space; what is smooth never sticks.

    `turned`: it touches in the trial's mode, so that its direction there was found.
    """
    nowhere = np.zeros(len(part.rows))
    if part.held and part.rests:
        return STICKS, nowhere
    if not part.rests:
        return part.moving_slip, nowhere
    a = trial.a[part.rows]
    if part.in_space:
        # The direction that was found has more digits than a small a_t.
        known = trial.mode.direction(part) * turned
        first = np.eye(len(part.rows))[0]
        return IN_SPACE, known.copy() if known.any() else first if stands else a / np.linalg.norm(a)
    return (1 if stands or a[0] > 0 else -1), nowhere
