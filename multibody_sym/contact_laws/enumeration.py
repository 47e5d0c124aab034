"""All modes, as far as they are few enough, and which of them may fulfil the laws: many small systems at once.

Of a contact at rest there are 4 (open, stick, two slides; in space open, stick, and slip begun from three or four
sides), of a rope, a stop or a contact that slides 2, of a two-sided normal 2 where its friction slides. The systems are
made of K = A X, so what is nearly singular there is `doubtful`: it is tried by QR, as everything that fits is.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from itertools import product
from typing import Final

import numpy as np

from multibody_sym.contact_laws.problem import IN_SPACE, STICKS, Flags, LawLimits, ModeArrays, Places, Scaled, limits_of
from multibody_sym.contact_laws.solve_mode import Reduced, may_hold
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import OF_FORCES, Kind

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

Labels = dict[str, dict[int, int]]


@dataclass(frozen=True)
class Enumerated(ModeArrays):
    """Modes as columns of numbers: sides (b, m), slips (b, p), directions (b, p, 3)."""

    def one(self, k: int) -> ModeArrays:
        return ModeArrays(self.sides[k].copy(), self.slips[k].copy(), self.directions[k].copy())

    def some(self, chosen: slice | Places) -> Enumerated:
        return Enumerated(self.sides[chosen], self.slips[chosen], self.directions[chosen])

    def __len__(self) -> int:
        return len(self.sides)


@dataclass(frozen=True)
class _Group:
    """Rows and parts that have to do with each other, and their combinations: (c, rows), (c, parts), (c, starts)."""

    rows: list[int]
    parts: list[int]
    sides: Places
    slips: Places


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
        groups.append(_Group(rows, parts, sides.reshape(len(both), -1), slips.reshape(len(both), -1)))
    sizes = [len(group.sides) for group in groups]
    total = math.prod(sizes)
    sides = np.zeros((total, problem.count), dtype=np.intp)
    slips = np.zeros((total, len(problem.parts)), dtype=np.intp)
    sides[:, problem.both] = 1
    for part in problem.parts:
        if not part.rests:
            slips[:, part.number] = IN_SPACE if part.in_space else int(np.sign(part.velocity[0]))
    places = np.unravel_index(np.arange(total), sizes) if sizes else ()
    for group, place in zip(groups, places, strict=True):
        sides[:, group.rows] = group.sides[place]
        slips[:, group.parts] = group.slips[place]
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
