"""Random systems of blocks, planes, ropes and guides as numbers, and all their states by brute force.

Brute force knows no Lemke and no QR of rows: it solves M udot - C^T z = f, H udot + D z = gamma in every mode for
accelerations and forces at once, and looks at every inequality.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.optimize import linprog

from multibody_sym.dynamics.laws.problem import Equality, Friction, FrictionLaw, Law, LawProblem, Unilateral

GRAVITY = 10.0


@dataclass
class Blocks:
    """Points of given masses in a vertical plane, and rows between them, while they are put together."""

    masses: np.ndarray
    forces: np.ndarray
    rows: list[np.ndarray] = field(default_factory=list)
    laws: list[Law] = field(default_factory=list)
    parts: list[FrictionLaw] = field(default_factory=list)
    right: list[float] = field(default_factory=list)
    defining: dict[int, np.ndarray] = field(default_factory=dict)

    @property
    def speeds(self) -> int:
        return 2 * len(self.masses)

    def row(self, law: Law, pushed: dict[int, np.ndarray], right: float = 0.0) -> int:
        """Add a row that pushes blocks (by number; -1 is the ground) along vectors."""
        H = np.zeros(self.speeds)
        for block, way in pushed.items():
            if block >= 0:
                H[2 * block : 2 * block + 2] += way
        self.rows.append(H)
        self.laws.append(law)
        self.right.append(right)
        return len(self.rows) - 1

    def contact(
        self,
        block: int,
        under: int,
        normal: np.ndarray,
        mu: tuple[float, float],
        speed: float = 0.0,
        right: float = 0.0,
    ) -> None:
        """Let a block lie on another one or on the ground, with friction unless both coefficients are zero."""
        n = self.row(Unilateral(), {block: normal, under: -normal}, right)
        if any(mu):
            tangent = np.array([normal[1], -normal[0]])
            t = self.row(Friction(len(self.parts)), {block: tangent, under: -tangent}, right / 2)
            self.parts.append(FrictionLaw((t,), (n,), *mu, (speed,)))

    def guide(self, block: int, normal: np.ndarray, mu: tuple[float, float], speed: float, *, written: bool) -> None:
        """Lead a block along a line; its reaction is a constraint's multiplier, or `written` down by Newton's law."""
        n = self.row(Equality(), {block: normal})
        tangent = np.array([normal[1], -normal[0]])
        if written:
            self.defining[self.row(Equality(), {})] = normal
            n = len(self.rows) - 1
            self.defining[n] = np.array([block, *normal])
        t = self.row(Friction(len(self.parts)), {block: tangent})
        self.parts.append(FrictionLaw((t,), (n,), *mu, (speed,)))

    def rope(self, ends: dict[int, np.ndarray], *, slack: bool = True) -> None:
        """Let a rope pull blocks along vectors."""
        self.row(Unilateral() if slack else Equality(), ends)

    def mechanical(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return M (n), f (n), H, C, D and gamma."""
        count = len(self.rows)
        H, D, gamma = np.array(self.rows).reshape(count, self.speeds), np.zeros((count, count)), np.array(self.right)
        f = self.forces.ravel()
        for k, (block, *normal) in self.defining.items():
            # The reaction N of the guide is what Newton's law asks beside all other forces on the block across it.
            way = np.zeros(self.speeds)
            way[2 * int(block) : 2 * int(block) + 2] = normal
            D[k] = H @ way
            D[k, k - 1], D[k, k] = 0.0, 1.0
            gamma[k] = -f @ way
        return np.repeat(self.masses, 2), f, H, H.copy(), D, gamma

    def problem(self) -> LawProblem:
        M, f, H, C, D, gamma = self.mechanical()
        root = np.sqrt(M)
        return LawProblem(H / root, C / root, D, gamma - H @ (f / M), tuple(self.laws), tuple(self.parts))


def unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def random_blocks(rng: np.random.Generator, most: int = 3, two_state: int = 3, sliding: bool = True) -> Blocks:
    """Return 2 to 7 blocks with at most so many undecided contacts, and so many of two states (ropes, sliding, smooth).

    One in three consists of few like numbers, so that rows depend on each other and inequalities are close.
    """
    plain = rng.random() < 1 / 3
    count = int(rng.integers(2, 8))
    masses = rng.choice([1.0, 2.0], count) if plain else 10.0 ** rng.uniform(-3, 3, count)
    forces = np.column_stack([np.zeros(count), -GRAVITY * masses])
    pulled = rng.random(count) < 0.5
    forces[pulled] += (rng.normal(size=(count, 2)) * (GRAVITY * masses)[:, None])[pulled]
    blocks = Blocks(masses, forces)
    undecided = int(rng.integers(1, most + 1))
    twos = int(rng.integers(0, two_state + 1))
    for number in range(undecided):
        block = number % count
        if rng.random() < 0.15:
            blocks.guide(block, unit(_angle(rng, plain)), _coefficients(rng, plain), 0.0, written=rng.random() < 0.5)
        else:
            under = int(rng.integers(0, block)) if block and rng.random() < 0.4 else -1
            right = float(rng.normal()) if rng.random() < 0.1 and not plain else 0.0
            blocks.contact(block, under, unit(_angle(rng, plain)), _coefficients(rng, plain), right=right)
    for _ in range(twos):
        _two_state(rng, blocks, plain, sliding)
    return blocks


def _two_state(rng: np.random.Generator, blocks: Blocks, plain: bool, sliding: bool) -> None:
    count = len(blocks.masses)
    block, other = (int(k) for k in rng.choice(count, 2, replace=False))
    kind = rng.choice(["rope", "rope", "smooth", "sliding", "guide"] if sliding else ["rope", "smooth"])
    speed = float(rng.choice([-1.0, 1.0]))
    if kind == "rope":
        along = _angle(rng, plain) + np.pi / 2
        beyond = along + np.pi if plain else rng.uniform(0, 6)
        blocks.rope({block: unit(along), other: unit(beyond)}, slack=rng.random() < 0.8)
    elif kind == "smooth":
        blocks.contact(block, other, unit(_angle(rng, plain)), (0.0, 0.0))
    elif kind == "sliding":
        blocks.contact(block, -1, unit(_angle(rng, plain)), _coefficients(rng, plain), speed)
    else:
        blocks.guide(block, unit(_angle(rng, plain)), _coefficients(rng, plain), speed, written=rng.random() < 0.5)


def _angle(rng: np.random.Generator, plain: bool) -> float:
    return float(rng.choice([np.pi / 2, np.pi / 2, np.pi / 3, np.pi]) if plain else np.pi / 2 + 0.6 * rng.normal())


def _coefficients(rng: np.random.Generator, plain: bool) -> tuple[float, float]:
    static = float(rng.choice([0.2, 0.5, 1.0]) if plain else 10.0 ** rng.uniform(-1.5, 0.3))
    return static, static * float(rng.choice([1.0, 0.5]) if plain else rng.choice([1.0, rng.uniform(0.3, 1)]))


# --- brute force ------------------------------------------------------------------------------------------------------


@dataclass
class BruteState:
    """Accelerations, what forces can be at least and at most, and whether forces that are open move the system."""

    udot: np.ndarray
    least: np.ndarray
    most: np.ndarray
    moves: bool = False


def brute_force(blocks: Blocks) -> list[BruteState]:
    """Return all states under the rule for two coefficients; distinct by accelerations and by unique forces."""
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


def _states(blocks: Blocks, mu: np.ndarray) -> list[tuple[BruteState, frozenset[int]]]:
    """Return the states with given coefficients and which parts at rest slip in each."""
    M, _, H, C, D, gamma = blocks.mechanical()
    n, found = len(M), []
    scale_z = np.sqrt(1.0 / np.maximum((C * C / M).sum(axis=1), 1e-300))
    scale_z[~C.any(axis=1)] = 1.0
    scale = np.concatenate([1.0 / np.sqrt(M), scale_z])
    sides, slips = _labels(blocks)
    for first in range(0, len(sides), 1024):
        side, slip = sides[first : first + 1024], slips[first : first + 1024]
        matrix, right = _systems(blocks, mu, side, slip)
        matrix *= scale
        lengths = np.linalg.norm(matrix, axis=2)
        for k, y, idle in _all_solved(matrix / lengths[:, :, None], right / lengths):
            laws = _Inequalities(blocks, mu, side[k], slip[k], scale)
            if len(idle):
                y = laws.somewhere(y, idle)
            if y is None or not laws.hold(y):
                continue
            udot, z = y[:n] * scale[:n], y[n:] * scale[n:]
            least, most, moves = laws.ranges(y, idle) if len(idle) else (z, z, False)
            a = H @ udot + D @ z - gamma
            slipping = {p for p, part in enumerate(blocks.parts) if _slips(part, side[k], a, H, udot)}
            found.append((BruteState(udot, least, most, moves), frozenset(slipping)))
    return found


def _systems(blocks: Blocks, mu: np.ndarray, side: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the equations of modes for (udot, z)."""
    M, f, H, C, D, gamma = blocks.mechanical()
    n, m = len(M), len(gamma)
    matrix, right = np.zeros((len(side), n + m, n + m)), np.zeros((len(side), n + m))
    matrix[:, :n, :n], matrix[:, :n, n:], right[:, :n] = np.diag(M), -C.T, f
    for k, law in enumerate(blocks.laws):
        holds = np.ones(len(side), dtype=bool)
        if isinstance(law, Unilateral):
            holds = side[:, k] > 0
        elif isinstance(law, Friction):
            (normal,) = blocks.parts[law.part].normals
            touches = side[:, normal] != 0
            holds = touches & (slip[:, law.part] == 0)
            slides = touches & ~holds
            matrix[slides, n + k, n + normal] = (mu[law.part] * slip[:, law.part] * side[:, normal])[slides]
        matrix[holds, n + k, :n], matrix[holds, n + k, n:], right[holds, n + k] = H[k], D[k], gamma[k]
        matrix[~holds, n + k, n + k] = 1.0
    return matrix, right


def _slips(part: FrictionLaw, side: np.ndarray, a: np.ndarray, H: np.ndarray, udot: np.ndarray) -> bool:
    (row,), (normal,) = part.rows, part.normals
    moves = abs(a[row]) > 1e-8 * (np.abs(H[row]) @ np.abs(udot) + GRAVITY)
    return not any(part.velocity) and bool(side[normal]) and bool(moves)


def _all_solved(matrix: np.ndarray, right: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Yield the number, a solution and the null vectors of each system that has one."""
    diagonal = np.abs(np.diagonal(np.linalg.qr(matrix, mode="r"), axis1=1, axis2=2))
    regular = diagonal.min(axis=1) > 1e-9
    if regular.any():
        solutions = np.linalg.solve(matrix[regular], right[regular][:, :, None])[:, :, 0]
        yield from ((int(k), y, np.zeros((0, len(y)))) for k, y in zip(np.flatnonzero(regular), solutions, strict=True))
    for k in np.flatnonzero(~regular):
        u, s, v = np.linalg.svd(matrix[k])
        kept = s > 1e-10 * s[0]
        y = v[kept].T @ ((u.T @ right[k])[kept] / s[kept])
        if np.abs(matrix[k] @ y - right[k]).max() <= 1e-9 * max(np.abs(y).max(), np.abs(right[k]).max()):
            yield int(k), y, v[~kept]


class _Inequalities:
    """All inequalities of a mode as g y >= g0, y = (udot, z) scaled, with what rounding may leave of each."""

    def __init__(self, blocks: Blocks, mu: np.ndarray, side: np.ndarray, slip: np.ndarray, scale: np.ndarray) -> None:
        M, _, H, _, D, gamma = blocks.mechanical()
        n, m = len(M), len(gamma)
        self.n, self.scale = n, scale
        rows: list[tuple[np.ndarray, float, bool]] = []
        force, gap = np.hstack([np.zeros((m, n)), np.eye(m)]), np.hstack([H, D])
        for k, law in enumerate(blocks.laws):
            if isinstance(law, Unilateral):
                rows += [(force[k], 0.0, True), (gap[k], gamma[k], False)]
        for number, part in enumerate(blocks.parts):
            (row,), (normal,) = part.rows, part.normals
            if not side[normal]:
                continue
            rows.append((side[normal] * force[normal], 0.0, True))
            if slip[number] and not any(part.velocity):
                rows.append((slip[number] * gap[row], slip[number] * gamma[row], False))
            elif not slip[number]:
                limit = mu[number] * side[normal] * force[normal]
                rows += [(limit + force[row], 0.0, True), (limit - force[row], 0.0, True)]
        self.g = np.array([g for g, _, _ in rows]).reshape(-1, n + m) * scale
        self.g0 = np.array([g0 for _, g0, _ in rows])
        self.of_force = np.array([of_force for _, _, of_force in rows], dtype=bool)

    def allowed(self, y: np.ndarray) -> np.ndarray:
        terms = np.abs(self.g) @ np.abs(y) + np.abs(self.g0)
        largest = float(np.abs(y[self.n :] * self.scale[self.n :]).max(initial=0.0))
        return 1e-9 * (terms + np.where(self.of_force, largest, GRAVITY))

    def hold(self, y: np.ndarray) -> bool:
        return bool((self.g @ y - self.g0 >= -self.allowed(y)).all())

    def somewhere(self, y: np.ndarray, idle: np.ndarray) -> np.ndarray | None:
        """Return where the inequalities hold among the solutions y + idle^T t."""
        if self.hold(y):
            return y
        size = self._size(y, idle)
        found = self._best(np.zeros(len(idle)), y / size, idle, size)
        return None if found is None else y + size * (idle.T @ found)

    def _size(self, y: np.ndarray, idle: np.ndarray) -> float:
        """Return how large what is open is: the forces of light blocks are small beside those of heavy ones."""
        open_ = np.abs(idle).max(axis=0) > 1e-9
        return float(np.abs(y[open_]).max(initial=0.0)) or 1.0

    def ranges(self, y: np.ndarray, idle: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """Return the least and the largest forces, and whether udot changes with what is open."""
        z = y[self.n :] * self.scale[self.n :]
        least, most, size = z.copy(), z.copy(), self._size(y, idle)
        slopes = idle[:, self.n :] * self.scale[self.n :]
        for k in np.flatnonzero(np.abs(slopes).max(axis=0) > 1e-9 * np.abs(slopes).max()):
            for sense, bound in ((1.0, least), (-1.0, most)):
                t = self._best(sense * slopes[:, k] / np.abs(slopes[:, k]).max(), y / size, idle, size)
                if t is not None:
                    bound[k] = z[k] + size * (slopes[:, k] @ t)
        way = idle[:, : self.n] @ np.random.default_rng(1).normal(size=self.n)
        if np.abs(way).max() < 1e-9:
            return least, most, False
        ends = [self._best(sense * way, y / size, idle, size) for sense in (1.0, -1.0)]
        moved = [float(way @ t) for t in ends if t is not None]
        return least, most, len(moved) == 2 and abs(moved[1] - moved[0]) > 1e-6

    def _best(self, cost: np.ndarray, y: np.ndarray, idle: np.ndarray, size: float) -> np.ndarray | None:
        room = self.g @ y - self.g0 / size + 1e-10 * np.abs(self.g).max(axis=1)
        if len(idle) == 1:
            return self._end(float(cost[0]), room, self.g @ idle[0])
        found = linprog(cost, A_ub=-self.g @ idle.T, b_ub=room, bounds=[(-1e3, 1e3)] * len(idle), method="highs")
        return found.x if found.status == 0 else None

    def _end(self, cost: float, room: np.ndarray, slopes: np.ndarray) -> np.ndarray | None:
        """Return the t of least cost t with room + slopes t >= 0."""
        steep = np.abs(slopes) > 1e-12
        ends = -room[steep] / slopes[steep]
        low = max(-1e3, float(ends[slopes[steep] > 0].max(initial=-1e3)))
        high = min(1e3, float(ends[slopes[steep] < 0].min(initial=1e3)))
        if low > high or (room[~steep] < 0).any():
            return None
        return np.array([low if cost > 0 else high if cost < 0 else (low + high) / 2])
