"""All states of one-way problems by brute force.

It knows no Lemke and no QR of rows: it solves M udot - C^T z = f, H udot + D z = gamma in every mode for accelerations
and forces at once, and looks at every inequality.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from one_way_problems import GRAVITY, Blocks
from scipy.optimize import linprog

from multibody_sym.contact_laws.problem import FrictionRow, Unilateral

ROUNDED = 1e-12
"""What rounding leaves (N) where all forces are none: less than a billionth of the lightest weight."""


@dataclass
class BruteState:
    """Accelerations, what forces can be at least and at most, and whether forces that are open move the system."""

    udot: np.ndarray
    least: np.ndarray
    most: np.ndarray
    moves: bool = False


def brute_force(blocks: Blocks) -> list[BruteState]:
    """Return all states under the rule for two coefficients; distinct by accelerations and by unique forces.

    One alone where forces that are open move the system: there are more than can be counted.
    """
    rested = [k for k, part in enumerate(blocks.parts) if not any(part.velocity)]
    queue, seen, ends = [frozenset[int]()], set[frozenset[int]](), list[BruteState]()
    while queue:
        kinetic = queue.pop()
        if kinetic in seen:
            continue
        seen.add(kinetic)
        mu = [p.kinetic if k not in rested or k in kinetic else p.static for k, p in enumerate(blocks.parts)]
        for state, slipping in _states(blocks, np.array(mu)):
            new = {k for k in slipping - kinetic if blocks.parts[k].kinetic != blocks.parts[k].static}
            if new:
                queue.append(kinetic | new)
            else:
                ends.append(state)
            if not new and state.moves:
                return [state]
    return _distinct(ends)


def _distinct(ends: list[BruteState]) -> list[BruteState]:
    """Merge what has the same accelerations and no force that is unique in both and differs."""
    found = list[BruteState]()
    for state in sorted(ends, key=lambda s: -int((s.most - s.least > 1e-7 * _force(s)).sum())):
        for other in found:
            if _alike(state, other):
                other.least, other.most = np.minimum(other.least, state.least), np.maximum(other.most, state.most)
                other.moves |= state.moves
                break
        else:
            found.append(state)
    return found


def _force(state: BruteState) -> float:
    largest = np.maximum(np.abs(state.least), np.abs(state.most))
    return float(largest[np.isfinite(largest)].max(initial=1e-3))


def _alike(one: BruteState, other: BruteState) -> bool:
    if np.abs(one.udot - other.udot).max() > 1e-7 * max(float(np.abs(one.udot).max()), GRAVITY):
        return False
    scale = 1e-6 * max(_force(one), _force(other))
    fixed = (one.most - one.least <= scale) & (other.most - other.least <= scale)
    return not (fixed & ~((one.least >= other.least - scale) & (one.most <= other.most + scale))).any()


def _labels(blocks: Blocks) -> tuple[np.ndarray, np.ndarray]:
    """Return all modes: sides (b, m) of unilateral rows and two-sided normals, slips (b, p)."""
    rows = [k for k, law in enumerate(blocks.laws) if isinstance(law, Unilateral)]
    both = sorted({k for part in blocks.parts for k in part.normals} - set(rows))
    normal = {row: [p for p, part in enumerate(blocks.parts) if row in part.normals] for row in (*rows, *both)}
    options = []
    for row in (*rows, *both):
        of_row = [(0, {})] if row in rows else []
        for side in (1,) if row in rows else (1, -1):
            speeds = [int(blocks.parts[p].velocity[0]) for p in normal[row]]
            for slips in product(*((speed,) if speed else (0, 1, -1) for speed in speeds)):
                of_row.append((side, dict(zip(normal[row], slips, strict=True))))
        options.append(of_row)
    sides, slips = [], []
    for chosen in product(*options):
        side, slip = np.zeros(len(blocks.rows), dtype=int), np.zeros(len(blocks.parts), dtype=int)
        for row, (s, of_parts) in zip((*rows, *both), chosen, strict=True):
            side[row] = s
            for p, value in of_parts.items():
                slip[p] = value
        sides.append(side)
        slips.append(slip)
    return np.array(sides), np.array(slips)


def _states(blocks: Blocks, mu: np.ndarray) -> Iterator[tuple[BruteState, frozenset[int]]]:
    """Yield the states with given coefficients and which parts at rest slip in each.

    Modes that leave forces open and lead to the same motion have their forces among those of the one that is closed
    and stuck wherever nothing moves: that one alone is asked which forces there can be.
    """
    modes, asked = _Modes(blocks, mu), set[bytes]()
    sides, slips = _labels(blocks)
    for first in range(0, len(sides), 1024):
        side, slip = sides[first : first + 1024], slips[first : first + 1024]
        g, g0 = modes.inequalities(side, slip)
        solved = _all_solved(*modes.systems(side, slip), modes.n)
        holds = solved.exists & _hold(modes, g, g0, solved.y)
        for k in np.flatnonzero(holds & ~solved.open):
            yield modes.state(solved.y[k], side[k])
        still = solved.open & ~solved.moves
        fits = solved.exists & (~still | _hold(modes, g, g0, solved.y, motion_alone=True))
        for k in np.flatnonzero(solved.open & fits):
            mode = modes.by_what_moves(side[k], slip[k], solved.y[k]) if still[k] else (side[k], slip[k])
            if (name := b"".join(part.tobytes() for part in mode)) not in asked:
                asked.add(name)
                yield from modes.opened(*mode)


class _Modes:
    """The equations and inequalities of modes for y = (udot, z) scaled, at given coefficients."""

    def __init__(self, blocks: Blocks, mu: np.ndarray) -> None:
        M, _, H, C, D, gamma = blocks.mechanical()
        self.blocks, self.mu, self.n = blocks, mu, len(M)
        sizes = np.sqrt(1.0 / np.maximum((C * C / M).sum(axis=1), 1e-300))
        sizes[~C.any(axis=1)] = 1.0
        self.scale = np.concatenate([1.0 / np.sqrt(M), sizes])
        self.gap, self.gamma = np.hstack([H, D]), gamma
        self.force = np.hstack([np.zeros((len(gamma), self.n)), np.eye(len(gamma))])

    def systems(self, side: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the equations of modes, (b, n + m, n + m) and (b, n + m), all rows of length one."""
        M, f, _, C, _, _ = self.blocks.mechanical()
        n, m = self.n, len(self.gamma)
        matrix, right = np.zeros((len(side), n + m, n + m)), np.zeros((len(side), n + m))
        matrix[:, :n, :n], matrix[:, :n, n:], right[:, :n] = np.diag(M), -C.T, f
        for k, law in enumerate(self.blocks.laws):
            holds = np.ones(len(side), dtype=bool)
            if isinstance(law, Unilateral):
                holds = side[:, k] > 0
            elif isinstance(law, FrictionRow):
                (normal,) = self.blocks.parts[law.part].normals
                touches = side[:, normal] != 0
                holds = touches & (slip[:, law.part] == 0)
                slides = touches & ~holds
                matrix[slides, n + k, n + normal] = (self.mu[law.part] * slip[:, law.part] * side[:, normal])[slides]
            matrix[holds, n + k], right[holds, n + k] = self.gap[k], self.gamma[k]
            matrix[~holds, n + k, n + k] = 1.0
        matrix *= self.scale
        lengths = np.linalg.norm(matrix, axis=2)
        return matrix / lengths[:, :, None], right / lengths

    def inequalities(self, side: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all inequalities g y >= g0 of modes, (b, i, n + m) and (b, i); 0 >= 0 for those a mode has not."""
        rows: list[tuple[np.ndarray, np.ndarray]] = []
        one = np.ones(len(side))
        for k, law in enumerate(self.blocks.laws):
            if isinstance(law, Unilateral):
                rows += [(np.outer(one, self.force[k]), 0.0 * one), (np.outer(one, self.gap[k]), one * self.gamma[k])]
        for number, part in enumerate(self.blocks.parts):
            (row,), (normal,) = part.rows, part.normals
            pressed = side[:, [normal]] * self.force[normal]
            begun = slip[:, number] * (side[:, normal] != 0) * float(not any(part.velocity))
            sticks = ((side[:, normal] != 0) & (slip[:, number] == 0))[:, None]
            limit = self.mu[number] * pressed
            rows += [(pressed, 0.0 * one), (np.outer(begun, self.gap[row]), begun * self.gamma[row])]
            rows += [(sticks * (limit + way * self.force[row]), 0.0 * one) for way in (1.0, -1.0)]
        g, g0 = [g for g, _ in rows], [g0 for _, g0 in rows]
        return np.stack(g, axis=1) * self.scale, np.stack(g0, axis=1)

    def by_what_moves(self, side: np.ndarray, slip: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mode that is closed, taut and stuck wherever nothing moves."""
        side, slip, a = side.copy(), slip.copy(), self.rates(y)
        for k, law in enumerate(self.blocks.laws):
            side[k] |= isinstance(law, Unilateral) and not a[k]
        for number, part in enumerate(self.blocks.parts):
            if side[part.normals[0]]:
                slip[number] = part.velocity[0] if any(part.velocity) else np.sign(a[part.rows[0]])
        return side, slip

    def rates(self, y: np.ndarray) -> np.ndarray:
        """Return a (m), 0 where it is rounding."""
        terms = np.abs(self.gap[:, : self.n]) @ np.abs(y[: self.n] * self.scale[: self.n])
        a = self.gap @ (y * self.scale) - self.gamma
        return np.where(np.abs(a) > 1e-8 * (terms + GRAVITY), a, 0.0)

    def state(self, y: np.ndarray, side: np.ndarray) -> tuple[BruteState, frozenset[int]]:
        """Return a state without open forces, and what slips in it."""
        udot, z = y[: self.n] * self.scale[: self.n], y[self.n :] * self.scale[self.n :]
        return BruteState(udot, z, z), self.slipping(y, side)

    def slipping(self, y: np.ndarray, side: np.ndarray) -> frozenset[int]:
        a, parts = self.rates(y), enumerate(self.blocks.parts)
        return frozenset(p for p, x in parts if not any(x.velocity) and side[x.normals[0]] and a[x.rows[0]])

    def opened(self, side: np.ndarray, slip: np.ndarray) -> Iterator[tuple[BruteState, frozenset[int]]]:
        """Yield the state of a mode that leaves forces open, and what slips in it, if it is one."""
        solved = _all_solved(*self.systems(side[None], slip[None]), self.n)
        if not solved.exists[0]:
            return
        g, g0 = self.inequalities(side[None], slip[None])
        laws, idle = _Inequalities(self, g[0], g0[0]), solved.idle(0)
        y = laws.somewhere(solved.y[0], idle) if len(idle) else solved.y[0]
        if y is None or not laws.hold(y):
            return
        udot, z = y[: self.n] * self.scale[: self.n], y[self.n :] * self.scale[self.n :]
        moves = laws.moves(y, idle)
        least, most = laws.ranges(y, idle) if len(idle) and not moves else (z, z)
        yield BruteState(udot, least, most, moves), self.slipping(y, side)


@dataclass
class _Solved:
    """Solutions y (b, k) of systems, which exist, which are not the only ones, and whether udot differs in others."""

    y: np.ndarray
    exists: np.ndarray
    open: np.ndarray
    moves: np.ndarray
    null: dict[int, np.ndarray]

    def idle(self, k: int) -> np.ndarray:
        """Return what may be added to solution k (j, k)."""
        return self.null.get(k, np.zeros((0, self.y.shape[1])))


def _all_solved(matrix: np.ndarray, right: np.ndarray, speeds: int) -> _Solved:
    diagonal = np.abs(np.diagonal(np.linalg.qr(matrix, mode="r"), axis1=1, axis2=2))
    regular = diagonal.min(axis=1) > 1e-9
    y, exists, moves = np.zeros_like(right), regular.copy(), np.zeros(len(right), dtype=bool)
    null = dict[int, np.ndarray]()
    y[regular] = np.linalg.solve(matrix[regular], right[regular][:, :, None])[:, :, 0]
    places = np.flatnonzero(~regular)
    for k, u, s, v in zip(places, *np.linalg.svd(matrix[places]), strict=True):
        kept = s > 1e-10 * s[0]
        y[k] = v[kept].T @ ((u.T @ right[k])[kept] / s[kept])
        missing = np.abs(matrix[k] @ y[k] - right[k]).max()
        exists[k] = missing <= 1e-9 * max(np.abs(y[k]).max(), np.abs(right[k]).max())
        null[int(k)] = v[~kept]
        moves[k] = np.abs(v[~kept][:, :speeds]).max(initial=0.0) > 1e-9
    return _Solved(y, exists, ~regular, moves, null)


def _allowed(modes: _Modes, g: np.ndarray, g0: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return what rounding may leave of inequalities (b, i) for y (b, n + m).

    It is a part of the forces of which they are made; of the largest force there is, perhaps elsewhere, as little as
    linear programs leave: a clamp of 5e7 N does not let a rope push with 0.03 N.
    """
    terms = (np.abs(g) @ np.abs(y)[:, :, None])[:, :, 0] + np.abs(g0)
    largest = np.abs(y[:, modes.n :] * modes.scale[modes.n :]).max(axis=1, initial=0.0)
    return 1e-9 * terms + np.where(_of_motion(modes, g), 1e-9 * GRAVITY, 1e-10 * largest[:, None] + ROUNDED)


def _of_motion(modes: _Modes, g: np.ndarray) -> np.ndarray:
    """Return which inequalities (b, i) are about accelerations."""
    return np.asarray(g[:, :, : modes.n].any(axis=2))


def _hold(modes: _Modes, g: np.ndarray, g0: np.ndarray, y: np.ndarray, *, motion_alone: bool = False) -> np.ndarray:
    """Return whether the inequalities of modes hold (b)."""
    holds = (g @ y[:, :, None])[:, :, 0] - g0 >= -_allowed(modes, g, g0, y)
    return (holds | ~_of_motion(modes, g) if motion_alone else holds).all(axis=1)


class _Inequalities:
    """All inequalities of one mode as g y >= g0, y = (udot, z) scaled, where some of y is open."""

    def __init__(self, modes: _Modes, g: np.ndarray, g0: np.ndarray) -> None:
        there = g.any(axis=1)
        self.modes, self.g, self.g0 = modes, g[there], g0[there]
        self.n, self.scale = modes.n, modes.scale

    def hold(self, y: np.ndarray) -> bool:
        return bool(_hold(self.modes, self.g[None], self.g0[None], y[None])[0])

    def somewhere(self, y: np.ndarray, idle: np.ndarray) -> np.ndarray | None:
        """Return where the inequalities hold among the solutions y + idle^T t, not at their edge if there is room."""
        if self.hold(y):
            return y
        size = self._size(y, idle)
        found = self._near(y, idle, size)
        # A linear program is as exact as its numbers are large: what it leaves of small forces beside them, a second
        # one about its solution takes away.
        return found if found is None or self.hold(found) else self._near(found, idle, 1e-3 * size)

    def _near(self, y: np.ndarray, idle: np.ndarray, size: float) -> np.ndarray | None:
        """Return y + idle^T t where the inequalities hold, or nearly hold; t is as large as numbers of a size are."""
        last = None
        room, slopes = self._room(y / size, size), np.linalg.norm(self.g @ idle.T, axis=1)
        lengths = np.where(slopes > 1e-9 * np.linalg.norm(self.g, axis=1), slopes, 0.0)
        cost, left = np.append(np.zeros(len(idle)), -1.0), np.column_stack([-self.g @ idle.T, lengths])
        # What squeezes itself may do so without bound: near solutions first, as large ones are full of rounding.
        for most in (1.0, 30.0, 1e3, 1e4):
            if len(idle) == 1:
                best = self._end(0.0, room, -left[:, 0], most)
            else:
                best = _least(cost, left, room, (*[most] * len(idle), 1e-3))
            if best is not None and self.hold(last := y + size * (idle.T @ best[: len(idle)])):
                return last
        return last

    def _room(self, y: np.ndarray, size: float) -> np.ndarray:
        return self.g @ y - self.g0 / size + 1e-10 * np.abs(self.g).max(axis=1)

    def _size(self, y: np.ndarray, idle: np.ndarray) -> float:
        """Return how large what is open is: itself, or what limits it.

        The forces of light blocks are small beside those of heavy ones; and forces that are zero in one solution are
        as large as the friction that there may be in others.
        """
        largest = float(np.abs(y).max(initial=0.0)) or 1.0
        slopes = np.abs(self.g @ idle.T).max(axis=1, initial=0.0)
        steep = slopes > 1e-3 * np.linalg.norm(self.g, axis=1)
        if not steep.any():
            return largest
        room = float(((self.g @ y - self.g0)[steep] / slopes[steep]).max())
        open_ = np.abs(idle).max(axis=0) > 1e-9
        size = max(room, float(np.abs(y[open_]).max(initial=0.0)))
        return size if size > 1e-12 * largest else largest

    def ranges(self, y: np.ndarray, idle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest forces."""
        z = y[self.n :] * self.scale[self.n :]
        least, most, size = z.copy(), z.copy(), self._size(y, idle)
        slopes = idle[:, self.n :] * self.scale[self.n :]
        for k in np.flatnonzero(np.abs(slopes).max(axis=0) > 1e-9 * np.abs(slopes).max()):
            for sense, bound in ((1.0, least), (-1.0, most)):
                t = self._best(sense * slopes[:, k] / np.abs(slopes[:, k]).max(), y / size, idle, size)
                if t is not None:
                    bound[k] = z[k] + size * (slopes[:, k] @ t)
        nothing = max(float(np.abs(bound).max(initial=0.0)) for bound in (least, most)) < 1e-6  # no weight is so small
        return (z, z) if nothing else (least, most)

    def moves(self, y: np.ndarray, idle: np.ndarray) -> bool:
        """Return whether udot changes with what is open."""
        way, size = idle[:, : self.n] @ np.random.default_rng(1).normal(size=self.n), self._size(y, idle)
        if np.abs(way).max(initial=0.0) < 1e-9:
            return False
        ends = [self._best(sense * way, y / size, idle, size) for sense in (1.0, -1.0)]
        moved = [float(way @ t) for t in ends if t is not None]
        return len(moved) == 2 and abs(moved[1] - moved[0]) > 1e-6

    def _best(self, cost: np.ndarray, y: np.ndarray, idle: np.ndarray, size: float) -> np.ndarray | None:
        room = self._room(y, size)
        if len(idle) == 1:
            return self._end(float(cost[0]), room, self.g @ idle[0])
        return _least(cost, -self.g @ idle.T, room, (1e3,) * len(idle))

    def _end(self, cost: float, room: np.ndarray, slopes: np.ndarray, most: float = 1e3) -> np.ndarray | None:
        """Return the t of least cost t with room + slopes t >= 0 and |t| <= most; in the middle without cost."""
        steep = np.abs(slopes) > 1e-12
        ends = -room[steep] / slopes[steep]
        low = max(-most, float(ends[slopes[steep] > 0].max(initial=-most)))
        high = min(most, float(ends[slopes[steep] < 0].min(initial=most)))
        if low > high or (room[~steep] < 0).any():
            return None
        return np.array([low if cost > 0 else high if cost < 0 else (low + high) / 2])


def _least(cost: np.ndarray, left: np.ndarray, right: np.ndarray, most: Sequence[float]) -> np.ndarray | None:
    """Return t of least cost with left t <= right and -most <= t <= most."""
    exact = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    bounds = [(-size, size) for size in most]
    found = linprog(cost, A_ub=left, b_ub=right, bounds=bounds, method="highs-ds", options=exact)
    return np.asarray(found.x) if found.status == 0 else None
