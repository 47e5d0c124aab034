"""All modes, as far as they are few enough, and which of them may fulfil the laws: many small systems at once.

Of a contact at rest there are 4 (open, stick, two slides; in space open, stick, and slip begun from three or four
sides), of a rope, a stop or a contact that slides 2, of a two-sided normal 2 where its friction slides. The systems are
made of K = A X, so what is nearly singular there is `doubtful`: it is tried by QR, as everything that fits is.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.contact_laws.problem import (
    IN_SPACE,
    STICKS,
    Flags,
    LawLimits,
    ModeArrays,
    Places,
    Scaled,
    ScaledFriction,
    limits_of,
)
from multibody_sym.contact_laws.solve_mode import Reduced, may_hold
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import OF_FORCES, Kind
from multibody_sym.scalars.pivoted_qr import blas
from multibody_sym.scalars.rank import least_squares

MOST: Final = 10_000
LOOSE: Final = 1e-6
"""What passes here to this part of the largest is tried by QR."""
DOUBTFUL: Final = 1e-7
"""Pivots of rows of unit length below this leave fewer digits than `LOOSE` asks for."""
STILL: Final = 1e-9
"""Part of the largest below which something does not move: pivots above `DOUBTFUL` leave so many digits."""
ZERO_PIVOT: Final = 1e-13
TURNS: Final = 20
"""Passes in which directions in space settle roughly; Newton's method does the rest."""
ALIKE: Final = 1e-4
"""Directions of slip that differ by less have settled at the same ones."""
AT_ONCE: Final = 2048
_AROUND: Final = tuple((math.cos(t), math.sin(t)) for t in (0.3, 0.3 + 2 * math.pi / 3, 0.3 - 2 * math.pi / 3))
_LOW: Final = tuple((math.sqrt(8) / 3 * x, math.sqrt(8) / 3 * y, -1 / 3) for x, y in _AROUND)
STARTS: Final[dict[int, tuple[tuple[float, ...], ...]]] = {2: _AROUND, 3: ((0.0, 0.0, 1.0), *_LOW)}
"""By how many rows a part has the directions from which slip in space is begun: evenly around."""


@dataclass(frozen=True)
class Enumerated(ModeArrays):
    """Modes as columns of numbers: sides (b, m), slips (b, p), directions (b, p, 3)."""

    def one(self, k: int) -> ModeArrays:
        return ModeArrays(self.sides[k].copy(), self.slips[k].copy(), self.directions[k].copy())

    def some(self, chosen: slice | Places) -> Enumerated:
        return Enumerated(self.sides[chosen], self.slips[chosen], self.directions[chosen])

    def __len__(self) -> int:
        return len(self.sides)


def count_modes(problem: Scaled, mu: Floats) -> int:
    """Return how many modes there are, or more than `MOST` where they are too many."""
    total = 1
    for rows, parts in _clusters(problem, mu):
        if 2 ** min(len(rows), 40) * 3 ** min(len(parts), 40) > 60 * MOST:
            return MOST + 1
        total *= sum(1 for _ in _combinations(problem, rows, parts))
        if total > MOST:
            return MOST + 1
    return total


def every_mode(problem: Scaled, mu: Floats) -> Enumerated:
    """Return all modes; there must not be more than `MOST`."""
    groups = []
    for rows, parts in _clusters(problem, mu):
        both = list(_combinations(problem, rows, parts))
        sides, slips = np.array([a for a, _ in both], dtype=np.intp), np.array([b for _, b in both], dtype=np.intp)
        groups.append((rows, parts, sides.reshape(len(both), -1), slips.reshape(len(both), -1)))
    sizes = [len(sides) for _, _, sides, _ in groups]
    total = math.prod(sizes)
    sides = np.zeros((total, problem.count), dtype=np.intp)
    slips = np.zeros((total, len(problem.parts)), dtype=np.intp)
    sides[:, problem.both] = 1
    for part in problem.parts:
        if not part.rests:
            slips[:, part.number] = part.moving_slip
    places = np.unravel_index(np.arange(total), sizes) if sizes else ()
    for (rows, parts, own_sides, own_slips), place in zip(groups, places, strict=True):
        sides[:, rows] = own_sides[place]
        slips[:, parts] = own_slips[place]
    directions = np.zeros((*slips.shape, 3))
    for part in problem.parts:
        if part.in_space and part.rests:  # slips from rest in space are numbered IN_SPACE + start
            slip = slips[:, part.number]
            for k, start in enumerate(STARTS[len(part.rows)]):
                directions[slip == IN_SPACE + k, part.number, : len(start)] = start
            slips[:, part.number] = np.minimum(slip, IN_SPACE)
    return Enumerated(sides, slips, directions)


def _clusters(problem: Scaled, mu: Floats) -> Iterator[tuple[list[int], list[int]]]:
    """Yield the undecided rows and parts that have to do with each other."""
    rows_left = set(problem.unilateral.tolist())
    groups: list[tuple[set[int], set[int]]] = []
    for part in problem.parts:
        if not mu[part.number]:
            continue
        normals = set(part.normals.tolist()) if not part.norm else set(part.normals.tolist()) & rows_left
        own = {part.number} if part.rests and not part.held else set[int]()
        touched = [group for group in groups if group[0] & normals]
        groups = [group for group in groups if group not in touched]
        groups.append((normals.union(*(g[0] for g in touched)), own.union(*(g[1] for g in touched))))
    yield from ((sorted(rows), sorted(parts)) for rows, parts in groups)
    grouped = set[int]().union(*(rows for rows, _ in groups))
    yield from (([row], []) for row in sorted(rows_left - grouped))


def _combinations(problem: Scaled, rows: list[int], parts: list[int]) -> Iterator[tuple[list[int], list[int]]]:
    """Yield sides of rows and slips of parts: none where nothing touches, no second side where nothing slides.

    Slips in space are numbered on from IN_SPACE, by the direction in which they begin.
    """
    unilateral = set(problem.unilateral.tolist())
    choices = [(1, 0) if row in unilateral else (1, -1) for row in rows]
    slips = list[tuple[int, ...]]()
    for part in (problem.parts[p] for p in parts):
        begun = tuple(IN_SPACE + k for k in range(len(STARTS[len(part.rows)]))) if part.in_space else (1, -1)
        slips.append((STICKS, *begun))
    for sides in product(*choices):
        of_row = dict(zip(rows, sides, strict=True))
        apart = {p for p in parts if not any(of_row.get(k, 1) for k in problem.parts[p].normals.tolist())}
        negative = {row for row, side in of_row.items() if side < 0 and row not in unilateral}
        for chosen in product(*slips):
            slip = dict(zip(parts, chosen, strict=True))
            sliding = (p for p in problem.parts if not p.rests or slip.get(p.number, STICKS) != STICKS)
            rubbed = {int(k) for p in sliding for k in p.normals} if negative else set[int]()
            if negative <= rubbed and not any(slip[p] for p in apart):
                yield list(sides), list(chosen)


# --- many systems at once ---------------------------------------------------------------------------------------------


def candidate_modes(problem: Scaled, small: Reduced, mu: Floats) -> Iterator[tuple[ModeArrays, bool]]:
    """Yield the modes that may fulfil the laws, and whether these may need other forces than a basic solution's.

    Modes that were begun from different directions and have come to the same ones are one.
    """
    everything, seen = every_mode(problem, mu), set[bytes]()
    for first in range(0, len(everything), AT_ONCE):
        modes = everything.some(slice(first, first + AT_ONCE))
        if small.open_sides:
            yield from ((modes.one(k), True) for k in range(len(modes)))
            continue
        tried = _try_modes(problem, small, mu, modes)
        for k in np.flatnonzero(tried.doubtful | (tried.open & tried.moved & ~tried.hopeless)):
            mode = modes.one(int(k))
            name = b"".join(x.tobytes() for x in (mode.sides, mode.slips, np.rint(mode.directions / ALIKE) + 0.0))
            if name not in seen:
                seen.add(name)
                yield mode, bool(tried.open[k])
        yield from _by_motion(problem, mu, modes, tried)


def _by_motion(problem: Scaled, mu: Floats, modes: Enumerated, tried: _Tried) -> Iterator[tuple[ModeArrays, bool]]:
    """Yield one mode of those that lead to the same motion, then that of the motion itself where forces are open.

    Closed, taut and stuck as far as nothing moves, it admits all the forces that the others do.
    """
    chosen = np.flatnonzero((tried.fits | (tried.open & tried.motion_fits)) & ~tried.doubtful & ~tried.moved)
    told = _by_what_moves(problem, mu, modes.some(chosen), tried.a[chosen])
    if not len(chosen):
        return
    _, firsts, group = np.unique(np.hstack([told.sides, told.slips]), axis=0, return_index=True, return_inverse=True)
    for number, first in enumerate(firsts):
        alike = chosen[group.ravel() == number]
        fitting = alike[tried.fits[alike]]
        if len(fitting):
            yield modes.one(int(fitting[0])), False
        if tried.open[alike].any():
            yield told.one(int(first)), True


def _by_what_moves(problem: Scaled, mu: Floats, modes: Enumerated, a: Floats) -> Enumerated:
    """Return the modes in which all is closed and sticks wherever a = 0."""
    sides, slips = modes.sides.copy(), modes.slips.copy()
    directions = modes.directions.copy()
    still = np.abs(a) <= STILL * (np.abs(a).max(axis=1, initial=0.0)[:, None] + np.abs(problem.r).max(initial=0.0))
    sides[:, problem.unilateral] |= still[:, problem.unilateral]
    touching = problem.pressed_parts(sides)
    for part in problem.parts:
        if not part.rests or not mu[part.number]:
            continue
        stuck = part.held | still[:, part.rows].all(axis=1) | ~touching[:, part.number]
        if part.in_space:
            lengths = np.maximum(np.linalg.norm(a[:, part.rows], axis=1), 1e-300)
            ways = np.where(stuck[:, None], 0.0, a[:, part.rows] / lengths[:, None])
            slips[:, part.number] = np.where(stuck, STICKS, IN_SPACE)
            directions[:, part.number, : len(part.rows)] = ways
        else:
            slips[:, part.number] = np.where(stuck, STICKS, np.sign(a[:, part.rows[0]]))
    return Enumerated(sides, slips, directions)


@dataclass(frozen=True)
class _Tried:
    """Of modes (b): which fit loosely, are doubtful, leave forces open, and whether these move things; a (b, m).

    `motion_fits`: the inequalities on a alone hold; `hopeless`: no forces that are open make all of them hold.
    """

    fits: Flags
    doubtful: Flags
    open: Flags
    moved: Flags
    motion_fits: Flags
    hopeless: Flags
    a: Floats


def _try_modes(problem: Scaled, small: Reduced, mu: Floats, modes: Enumerated) -> _Tried:
    """Solve the systems of all modes at once, and return which modes may hold."""
    norms = [p for p in problem.parts if p.norm and mu[p.number]]
    turning = [p for p in problem.parts if p.in_space and p.rests and mu[p.number]]
    pressing = {p.number: np.zeros((len(modes), len(p.normals))) for p in norms}
    for _ in range(TURNS if norms or turning else 1):
        systems = _systems(problem, small, mu, modes, pressing)
        solved = _solve_systems(*systems)
        z, a = small.z0 + solved.f @ small.Z.T, small.a0 + solved.f @ small.K.T
        for part in norms:
            pressing[part.number] = part.along(z)
        for part in turning:
            to = a[:, part.rows]
            turned = to / np.maximum(np.linalg.norm(to, axis=1), 1e-300)[:, None]
            slips = modes.slips[:, part.number] != STICKS
            modes.directions[slips, part.number, : len(part.rows)] = turned[slips]
    loose = 1e-3 if norms or turning else LOOSE
    # Where nothing rubs, the corners of what is admissible are other modes' solutions.
    open_ = solved.consistent & solved.open & bool(mu.any())
    change = np.abs(solved.ways).max(axis=1, initial=0.0)
    moved = np.abs(solved.ways @ small.X.T).max(axis=1, initial=0.0) > STILL * np.maximum(change, 1e-300)
    limits, force = list(limits_of(problem, modes, mu, z, a)), loose * np.abs(z).max(axis=1, initial=0.0)
    gap = loose * (np.abs(a).max(axis=1, initial=0.0) + np.abs(problem.r).max(initial=0.0)) + loose * force
    motion = _fit(limits, ("gap", "slip"), gap)
    fits = solved.consistent & motion & _fit(limits, OF_FORCES, force)
    hopeless = np.zeros(len(modes), dtype=bool)
    if not norms and not turning and solved.single.any():
        way = solved.ways @ small.Z.T, solved.ways @ small.K.T
        hopeless = solved.single & ~may_hold(problem, mu, modes, (z, a), way, LOOSE)
    return _Tried(fits, solved.doubtful, open_, open_ & moved, motion, hopeless, a)


def _systems(
    problem: Scaled, small: Reduced, mu: Floats, modes: Enumerated, pressing: dict[int, Floats]
) -> tuple[Floats, Floats]:
    """Return the matrices (b, k, k) and right sides (b, k) for the forces f."""
    count, size = len(modes), len(small.own)
    identity = np.eye(size)
    left, right = np.zeros((count, size, size)), np.zeros((count, size))
    left[:] = identity
    place = small.place
    for row in problem.unilateral:
        closed = modes.sides[:, row] > 0
        left[closed, place[row]] = small.K[row]
        right[closed, place[row]] = -small.a0[row]
    pressed = problem.pressed_parts(modes.sides)
    for part in problem.parts:
        if not mu[part.number]:
            continue
        touching = pressed[:, part.number]
        sticks = touching & (modes.slips[:, part.number] == STICKS) & part.rests
        weights = part.weights(modes.sides, pressing)
        if not part.rests:
            way = np.broadcast_to(part.moving, (count, len(part.rows)))
        elif part.in_space:
            way = modes.directions[:, part.number, : len(part.rows)]
        else:
            way = modes.slips[:, [part.number]].astype(float)
        for component, row in enumerate(part.rows):
            left[sticks, place[row]] = small.K[row]
            right[sticks, place[row]] = -small.a0[row]
            slides = touching & ~sticks
            factors = (mu[part.number] * way[:, component, None] * weights)[slides]
            left[slides, place[row]] += factors @ small.Z[part.normals]
            right[slides, place[row]] = -factors @ small.z0[part.normals]
    return left, right


@dataclass(frozen=True)
class _Solved:
    """Solutions f (b, k), which are doubtful, consistent at all, not the only ones, and a way (b, k) to others.

    `single`: there is no other way.
    """

    f: Floats
    doubtful: Flags
    consistent: Flags
    open: Flags
    single: Flags
    ways: Floats


def _solve_systems(left: Floats, right: Floats) -> _Solved:
    """Solve all systems by elimination; where a column has no pivot its unknown is zero."""
    count, size, _ = left.shape
    T = np.concatenate([left, right[:, :, None]], axis=2)
    T /= np.maximum(np.abs(left).max(axis=2, initial=0.0), 1e-300)[:, :, None]
    scale = np.maximum(np.abs(T[:, :, -1]).max(axis=1, initial=0.0), 1e-300)
    unused, where = np.ones((count, size), dtype=bool), np.full((count, size), -1)
    doubtful: Flags = np.zeros(count, dtype=bool)
    every = np.arange(count)
    for j in range(size):
        column = np.where(unused, np.abs(T[:, :, j]), -1.0)
        chosen = column.argmax(axis=1)
        pivot = column[every, chosen]
        there = pivot > ZERO_PIVOT
        doubtful |= there & (pivot < DOUBTFUL)
        rows = T[every, chosen] / np.where(there, T[every, chosen, j], 1.0)[:, None]
        factors = T[:, :, j] * there[:, None]
        factors[every, chosen] = 0.0
        T -= factors[:, :, None] * rows[:, None, :]
        T[every[there], chosen[there]] = rows[there]
        where[there, j] = chosen[there]
        unused[every[there], chosen[there]] = False
    solution = np.where(where >= 0, T[every[:, None], where, -1], 0.0)
    missing = np.where(unused, np.abs(T[:, :, -1]), 0.0).max(axis=1, initial=0.0)
    consistent = missing <= LOOSE * np.maximum(scale, np.abs(solution).max(axis=1, initial=0.0))
    # Other solutions: what had no pivot takes values without a pattern.
    free = np.where(where < 0, np.random.default_rng(1).uniform(1.0, 2.0, size), 0.0)
    ways = np.where(where >= 0, -(T[every[:, None], where, :-1] @ free[:, :, None])[:, :, 0], free)
    open_ = np.asarray((where < 0).any(axis=1), dtype=bool)
    single = np.asarray((where < 0).sum(axis=1) == 1, dtype=bool)
    return _Solved(np.asarray(solution), doubtful, np.asarray(consistent), open_, single, np.asarray(ways))


def _fit(limits: Sequence[LawLimits], kinds: Collection[Kind], allowed: Floats) -> Flags:
    """Return (b) whether the limits of some kinds are passed by no more than what is allowed (b)."""
    kept = [(~x.asked | (x.values >= -allowed[:, None])).all(axis=1) for x in limits if x.kind in kinds]
    return np.asarray(np.logical_and.reduce(kept), dtype=bool)


# ----------------------------------------------------------------------------------------------------------------------
# Linear complementarity problems by Lemke's method: w = M z + q, 0 <= w, 0 <= z, w z = 0.


TIED: Final = 1e-10
"""Ratios that differ by less than this part of their size are the same but for the rounding of some hundred pivots."""
SMALL: Final = 1e-10
"""Elements of a column below this part of its largest are what pivots have left of zeros: none of them is a pivot."""
PATTERN: Final = 7
"""Seed of the numbers that tell rows apart."""


@dataclass(frozen=True)
class Complementary:
    """z (n), and which z are basic (n; the w of the others are), or `ray`: nothing was found.

    `pivots` counts them; `spent` is true where there were more than allowed, which proves nothing.
    """

    z: Floats
    basic: NDArray[np.bool_]
    ray: bool
    pivots: int
    spent: bool = False


def lemke(matrix: Floats, right: Floats) -> Complementary:
    """Return a solution of w = M z + q, 0 <= w, 0 <= z, w z = 0 for M (n, n) and q (n), or the ray that Lemke ends on.

    M and q should be scaled: rows and columns of comparable size.
    """
    size = len(right)
    largest = float(np.abs(right).max(initial=0.0))
    if float(right.min(initial=0.0)) >= 0.0:
        return Complementary(np.zeros(size), np.zeros(size, dtype=bool), ray=False, pivots=0)
    tableau = _Tableau(matrix, right / largest)
    ray, spent = tableau.run()
    z, basic = tableau.solution()
    return Complementary(z * largest, basic, ray, tableau.pivots, spent)


@cache
def _apart(size: int) -> Floats:
    """Return p and E (n, n + 1), side by side."""
    return np.column_stack([np.random.default_rng(PATTERN).uniform(1.0, 2.0, size), np.eye(size)])


class _Tableau:
    """B^-1 [q, p, E], kept as it is: the lexicographic order compares its rows. Columns are made where they enter.

    Variables by number: w_0..w_n-1, z_0..z_n-1, and the artificial one, number 2 n, whose column is a vector of ones.
    """

    def __init__(self, matrix: Floats, right: Floats) -> None:
        self.matrix, self.size, self.pivots = matrix, len(right), 0
        self.rows = np.empty((self.size, self.size + 2), order="F")
        self.rows[:, 0], self.rows[:, 1:] = right, _apart(self.size)
        self.basis = np.arange(self.size)

    def run(self) -> tuple[bool, bool]:
        """Pivot until the artificial variable leaves; tell whether it ends on a ray, and whether it took too long."""
        artificial = 2 * self.size
        column = -np.ones(self.size)
        leaving = self._first(column, np.arange(self.size), -1.0)
        entering = artificial
        for _ in range(50 + 20 * self.size):
            left = int(self.basis[leaving])
            self._pivot(leaving, column)
            self.basis[leaving] = entering
            if left == artificial:
                return False, False
            entering = (left + self.size) % (2 * self.size)
            column = self._column(entering)
            candidates = (column > SMALL * max(1.0, float(np.abs(column).max()))).nonzero()[0]
            if not len(candidates):
                return True, False
            leaving = self._first(column, candidates, 1.0)
        return True, True

    def solution(self) -> tuple[Floats, NDArray[np.bool_]]:
        z, basic = np.zeros(self.size), np.zeros(self.size, dtype=bool)
        held = (self.basis >= self.size) & (self.basis < 2 * self.size)
        z[self.basis[held] - self.size] = np.maximum(self.rows[held, 0], 0.0)
        basic[self.basis[held] - self.size] = True
        return z, basic

    def _column(self, variable: int) -> Floats:
        if variable < self.size:
            return self.rows[:, 2 + variable].copy()
        return np.asarray(-(self.rows[:, 2:] @ self.matrix[:, variable - self.size]), dtype=float)

    def _first(self, column: Floats, candidates: NDArray[np.intp], sense: float) -> int:
        """Return the candidate whose row, divided by its element of the column, comes first in lexicographic order.

        With sense -1 (where the artificial variable enters, and its column is -1) the order of the rows themselves.
        """
        ratios = self.rows[candidates, 0] / (sense * column[candidates])
        best = float(ratios.min())
        near = ratios <= best + TIED * max(1.0, abs(best))
        artificial = candidates[near & (self.basis[candidates] == 2 * self.size)]
        if len(artificial):
            return int(artificial[0])
        candidates = candidates[near]
        for first in range(1, self.rows.shape[1]):
            if len(candidates) == 1:
                break
            values = self.rows[candidates, first] / (sense * column[candidates])
            least = float(values.min())
            candidates = candidates[values <= least + TIED * max(1.0, abs(least))]
        return int(candidates[0])

    def _pivot(self, leaving: int, column: Floats) -> None:
        row = self.rows[leaving] / column[leaving]
        column = column.copy()
        column[leaving] -= 1.0
        self.rows = blas().dger(-1.0, column, row, a=self.rows, overwrite_a=1)
        self.pivots += 1


# ----------------------------------------------------------------------------------------------------------------------
# A mode proposed by Lemke's method: Stewart's and Trinkle's unknowns for friction at rest.
#
#     w_n = a_n,  w_j = e_j . a_t + s,  w_s = mu N - sum b_j,   0 <= w, 0 <= (z_n, b_j, s),   z_t = sum e_j b_j
#
# with the edges e_j: both senses of a line, 8 directions in a plane, 14 in space. A two-sided normal presses with N =
# N+ + N-, N+ - N- = z: w = N+ = z + N- beside N- >= 0. What slides already exerts -mu N along its velocity.


EDGES: Final = 8
LINE: Final = np.array([[1.0], [-1.0]])
CIRCLE: Final = np.array([[np.cos(k), np.sin(k)] for k in 2.0 * np.pi * np.arange(EDGES) / EDGES])
_CORNERS: Final = np.array(list(product((1.0, -1.0), repeat=3))) / np.sqrt(3.0)
SPHERE: Final = np.vstack([np.eye(3), -np.eye(3), _CORNERS])
_EDGES: Final = {1: LINE, 2: CIRCLE, 3: SPHERE}
Fans = Mapping[int, Floats]
"""Directions (k, 2) of further edges, by part."""
NO_FANS: Final[Fans] = {}
_CLOSER: Final = 4.0
"""By how much edges are closer each time."""


@dataclass(frozen=True)
class Proposal:
    """A mode, the rows (m) that carry force in it, x (n), forces z (m), and whether the search ended on a ray."""

    mode: ModeArrays
    carrying: Flags
    x: Floats
    z: Floats
    ray: bool
    spent: bool


class _Unknowns:
    """A problem over the unknowns y: normals, N- of two-sided ones, then b and s of each part at rest."""

    def __init__(self, problem: Scaled, small: Reduced, mu: Floats, pressing: dict[int, Floats], fine: Fans) -> None:
        self.problem, self.small, self.mu, self.pressing = problem, small, mu, pressing
        rubbing = [p for p in problem.parts if mu[p.number]]
        used = sorted({int(k) for p in rubbing if not p.norm for k in p.normals} & set(problem.both.tolist()))
        self.normal = {int(k): i for i, k in enumerate(problem.unilateral)}
        self.negative = {k: len(self.normal) + i for i, k in enumerate(used)}
        count = len(self.normal) + len(used)
        self.ways: dict[int, Floats] = {}
        self.edges: dict[int, slice] = {}
        self.slack: dict[int, int] = {}
        for part in rubbing:
            if part.rests:
                finer = [fine[part.number]] if part.number in fine else []
                self.ways[part.number] = np.vstack([_EDGES[len(part.rows)], *finer])
                count += (size := len(self.ways[part.number])) + 1
                self.edges[part.number], self.slack[part.number] = slice(count - size - 1, count - 1), count - 1
        self.count = count
        self.sliding = [p for p in rubbing if not p.rests]

    def pressing_force(self, part: ScaledFriction) -> tuple[float, Floats, Floats]:
        """Return N = n0 + n_f . f + n_y . y."""
        small = self.small
        n0, of_forces, of_unknowns = 0.0, np.zeros(len(small.own)), np.zeros(self.count)
        weights = part.weights(np.ones(len(small.z0)), self.pressing)
        for k, weight in zip(part.normals.tolist(), weights, strict=True):
            n0 += weight * small.z0[k]
            of_forces += weight * small.Z[k]
            if k in self.negative:
                of_unknowns[self.negative[k]] += 2.0 * weight
        return n0, of_forces, of_unknowns

    def forces(self) -> tuple[Floats, Floats]:
        """Return f = f0 + F y: forces of all rows but equalities."""
        small, place = self.small, self.small.place
        f0: Floats = np.zeros(len(small.own))
        F: Floats = np.zeros((len(small.own), self.count))
        for k, i in self.normal.items():
            F[place[k], i] = 1.0
        for number, columns in self.edges.items():
            part = self.problem.parts[number]
            F[place[part.rows], columns] = self.ways[number].T
        implied = np.eye(len(small.own))
        for part in self.sliding:
            n0, of_forces, of_unknowns = self.pressing_force(part)
            against = -self.mu[part.number] * part.moving
            rows = place[part.rows]
            f0[rows] += against * n0
            F[rows] += np.outer(against, of_unknowns)
            implied[rows] -= np.outer(against, of_forces)
        if self.sliding:
            both = least_squares(implied, np.column_stack([f0, F]))
            return np.asarray(both[:, 0], dtype=float), np.asarray(both[:, 1:], dtype=float)
        return f0, F

    def rows(self, f0: Floats, F: Floats) -> tuple[Floats, Floats]:
        """Return q and M of w = M y + q."""
        small, problem, mu = self.small, self.problem, self.mu
        a0, A = small.a0 + small.K @ f0, small.K @ F
        z0, Z = small.z0 + small.Z @ f0, small.Z @ F
        q, M = np.zeros(self.count), np.zeros((self.count, self.count))
        normals = list(self.normal)
        q[: len(normals)], M[: len(normals)] = a0[normals], A[normals]
        for k, i in self.negative.items():
            q[i], M[i] = z0[k], Z[k]
            M[i, i] += 1.0
        for number, columns in self.edges.items():
            part, slack = problem.parts[number], self.slack[number]
            ways = self.ways[number]
            q[columns], M[columns] = ways @ a0[part.rows], ways @ A[part.rows]
            M[columns, slack] += 1.0
            n0, of_forces, of_unknowns = self.pressing_force(part)
            q[slack] = mu[number] * (n0 + of_forces @ f0)
            M[slack] = mu[number] * (of_forces @ F + of_unknowns)
            M[slack, columns] -= 1.0
        return q, M

    def proposal(self, found: Complementary, f: Floats) -> Proposal:
        """Return the mode of a solution: basic unknowns act."""
        problem, small = self.problem, self.small
        y, basic = found.z, found.basic
        z, a = small.z0 + small.Z @ f, small.a0 + small.K @ f
        parts = len(problem.parts)
        mode = ModeArrays(np.zeros(problem.count, dtype=np.intp), np.zeros(parts, dtype=np.intp), np.zeros((parts, 3)))
        carrying = np.zeros(problem.count, dtype=bool)
        carrying[problem.kinematic] = carrying[problem.defining] = True
        for k, i in self.normal.items():
            mode.sides[k] = carrying[k] = basic[i]
        mode.sides[problem.both] = np.where(z[problem.both] < 0.0, -1, 1)
        for k, i in self.negative.items():
            mode.sides[k] = -1 if basic[i] else 1
        for part in problem.parts:
            if not part.rests:
                mode.slips[part.number] = part.moving_slip
            elif part.number in self.edges:  # it slips where its slack s is basic, against the force
                columns = self.edges[part.number]
                pushing = basic[columns]
                if part.held or not basic[self.slack[part.number]] or (not part.in_space and pushing.all()):
                    carrying[part.rows] = pushing.any() if not part.in_space else True
                    continue
                force = y[columns] @ self.ways[part.number]
                if not force.any():
                    force = -a[part.rows]
                if part.in_space:
                    mode.slips[part.number] = IN_SPACE
                    mode.direction(part)[:] = -force / (float(np.linalg.norm(force)) or 1.0)
                else:
                    mode.slips[part.number] = 1 if force[0] < 0.0 else -1
        return Proposal(mode, carrying, small.x0 + small.X @ f, z, found.ray, found.spent)


def propose(problem: Scaled, small: Reduced, mu: Floats, pressing: dict[int, Floats], fine: Fans = NO_FANS) -> Proposal:
    """Return the mode of a solution for coefficients mu (p) and directions of pressing forces, by part.

    Parts with `fine` directions have these as edges too.
    """
    unknowns = _Unknowns(problem, small, mu, pressing, fine)
    f0, F = unknowns.forces()
    q, M = unknowns.rows(f0, F)
    sizes = np.maximum(np.abs(M).max(axis=1, initial=0.0), 1e-12)
    found = lemke(M / sizes[:, None], q / sizes)
    return unknowns.proposal(found, f0 + F @ found.z)


def closer_edges(problem: Scaled, mu: Floats, proposal: Proposal, times: int) -> Fans:
    """Return edges close to the friction of a proposal, which are so many times closer in its middle."""
    apart = 2.0 * np.pi / EDGES / _CLOSER ** np.arange(1, times + 1)
    beside = np.concatenate([-apart, [0.0], apart])
    found = dict[int, Floats]()
    for part in problem.parts:
        x, *y = proposal.z[part.rows].tolist()
        if part.rests and len(y) == 1 and mu[part.number] and (x or y[0]):
            angles = np.arctan2(y[0], x) + beside
            found[part.number] = np.column_stack([np.cos(angles), np.sin(angles)])
    return found
