"""Impacts of plane contacts by brute force: Routh's integration of one, all modes of several at once.

Speeds v = (v_n, v_t) of k contacts change by K p, p = (p_n, p_t) their impulses: normals first, then tangents.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.optimize import linprog

SLOW = 1e-9
"""The speed (m/s) up to which nothing moves."""
SEEN = 1e-7
"""The speed (m/s) by which several answers of an impact differ: states of runs are compared to ten times as much."""


class SeveralError(Exception):
    """The law has several answers, or none."""


class NotUniqueError(SeveralError):
    """Several answers fulfil the laws, each by its own numbers, and differ."""


@dataclass
class Blow:
    """Impacts of k contacts in turn: speeds v (2 k,), impulses p (2 k,), coefficients of friction and restitution.

    Impulses of `unsure` contacts are not unique, or may not be.
    """

    K: np.ndarray
    v: np.ndarray
    static: np.ndarray
    kinetic: np.ndarray
    restitution: np.ndarray
    p: np.ndarray = field(init=False)
    counts: dict[int, int] = field(default_factory=dict)
    unsure: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.k = len(self.static)
        self.p = np.zeros(2 * self.k)
        size = np.sqrt(np.diag(self.K))
        size[size == 0] = 1.0
        near = np.abs(self.K / np.outer(size, size)) > 1e-12
        k = self.k
        joined = near[:k, :k] | near[:k, k:] | near[k:, :k] | near[k:, k:] | np.eye(k, dtype=bool)
        self.joined = np.linalg.matrix_power(joined.astype(float), k) > 0
        self.rubs = bool(self.static.any())

    def strike(self) -> None:
        """Strike until nothing closes: one by one if something bounces, else at once."""
        one_by_one = bool(self.restitution.any())
        while (self.v[: self.k] < -SLOW).any():
            v = self.v[: self.k]
            fastest = int(np.argmin(v))
            cluster = np.flatnonzero(self.joined[fastest])
            first = int(cluster[0])
            self.counts[first] = self.counts.get(first, 0) + 1
            if self.counts[first] > 100 + 20 * len(cluster):
                if self.counts[first] > 2 * (100 + 20 * len(cluster)):
                    raise SeveralError("impacts do not end")
                self.restitution[cluster] = 0.0
                self._together(cluster)
                continue
            if one_by_one:
                rows = [j for j in cluster if v[j] <= (1 - 1e-9) * v[fastest]]
                rows += [j for j in cluster if abs(v[j]) <= SLOW and not self.restitution[j]]
            else:
                rows = [j for j in cluster if v[j] <= SLOW]
            if len(rows) == 1:
                self._alone(rows[0])
            else:
                self._together(np.array(sorted(rows)))

    # --- one contact

    def _alone(self, j: int) -> None:
        e, mu_s, mu_k = self.restitution[j], self.static[j], self.kinetic[j]
        knn, knt, ktt = self.K[j, j], self.K[j, j + self.k], self.K[j + self.k, j + self.k]
        if not knn > 1e-12:
            raise SeveralError("what closes cannot move")
        vn, vt = self.v[j], self.v[j + self.k]
        pn = pt = 0.0
        goal = None  # the impulse at which restitution ends
        while True:
            pull, slow = self._pull(vt, mu_s, mu_k, knt, ktt)
            rate, turn = knn + knt * pull, knt + ktt * pull
            end = np.inf
            if goal is not None:
                end = goal - pn
            elif rate > 0:
                end = -vn / rate
            stop = -vt / turn if abs(vt) > slow and vt * turn < 0 else np.inf
            dp = min(end, stop)
            if not np.isfinite(dp):
                raise SeveralError("an impact has no end")
            pn, pt, vn = pn + dp, pt + pull * dp, vn + rate * dp
            vt = 0.0 if stop <= end or (abs(vt) <= slow and pull == -knt / (ktt or 1.0)) else vt + turn * dp
            if end <= stop:
                if goal is not None or not e:
                    break
                goal, vn = (1 + e) * pn, 0.0
        self._add(np.array([j]), np.array([pn, pt]))

    def _pull(self, vt: float, mu_s: float, mu_k: float, knt: float, ktt: float) -> tuple[float, float]:
        """Return p_t' per p_n, and the slip that counts as none."""
        slow = 1e-10 * float(np.abs(self.v).max())
        if not mu_s:
            return 0.0, np.inf
        if abs(vt) > slow:
            return -mu_k * np.sign(vt), slow
        if abs(knt) <= mu_s * ktt:
            return -knt / ktt, slow
        return -mu_k * np.sign(knt), slow

    def _add(self, rows: np.ndarray, p: np.ndarray) -> None:
        both = np.concatenate([rows, rows + self.k])
        self.p[both] += p
        self.v = self.v + self.K[:, both] @ p

    # --- several at once

    def _together(self, rows: np.ndarray) -> None:
        e = self.restitution[rows]
        both = np.concatenate([rows, rows + self.k])
        v, none = self.v[both], np.zeros(len(rows))
        apart = both if self.rubs else rows
        if np.linalg.matrix_rank(self.K[np.ix_(apart, apart)], tol=1e-9) < len(apart):
            self.unsure |= set(rows.tolist())
        if not self.rubs:
            self._add(rows, self._solved(rows, v, none, -e * np.minimum(v[: len(rows)], 0))[0])
            return
        K = self.K[np.ix_(both, both)]
        p = self._poisson(rows, v, e)
        gain = p @ v + p @ K @ p / 2
        if gain > 1e-12 * (np.abs(p) @ np.abs(v) + p @ K @ p / 2) and len(set(e.tolist())) > 1:
            self.restitution[rows] = e.min()
            p = self._poisson(rows, v, np.full(len(rows), e.min()))
        self._add(rows, p)

    def _poisson(self, rows: np.ndarray, v: np.ndarray, e: np.ndarray) -> np.ndarray:
        """Return the impulses of compression and restitution; each that compression may have, is followed."""
        k, none = len(rows), np.zeros(len(rows))
        both = np.concatenate([rows, rows + self.k])
        K, ends = self.K[np.ix_(both, both)], list[np.ndarray]()
        for p in self._solved(rows, v, none, none):
            more = [np.zeros(2 * k)]
            if (e * p[:k] > 0).any():
                more = self._solved(rows, v + K @ p, e * np.maximum(p[:k], 0), none)
            ends += [p + x for x in more]
        apart = max(np.abs(K @ (p - ends[0])).max() for p in ends)
        if apart > SEEN:
            raise NotUniqueError(
                f"{len(ends)} restitutions of compressions that fulfil the laws: {apart:.3g} m/s apart"
            )
        return ends[0]

    def _solved(self, rows: np.ndarray, v: np.ndarray, given: np.ndarray, wanted: np.ndarray) -> list[np.ndarray]:
        """Return all p with p_n >= given complementary to v_n >= wanted, |p_t| <= mu p_n against the slip at the end.

        They lead to the same speeds. Raises SeveralError.
        """
        both = np.concatenate([rows, rows + self.k])
        K, slips = self.K[np.ix_(both, both)], frozenset[int]()
        while True:
            mu = np.array([self.kinetic[j] if i in slips else self.static[j] for i, j in enumerate(rows)])
            found = _modes(K, v, given, wanted, mu)
            if not found:
                raise SeveralError("no impulses fulfil the laws of an impact")
            after = [v + K @ p for p in found]
            self._verify_alike(rows, v, (given, wanted), found)
            new = {
                i for i in range(len(rows)) if abs(after[0][len(rows) + i]) > SLOW and mu[i] != self.kinetic[rows[i]]
            }
            if not new - slips:
                return found
            slips |= new

    def _verify_alike(
        self, rows: np.ndarray, v: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], found: list[np.ndarray]
    ) -> None:
        """Raise SeveralError if impulses lead to different speeds, as not unique if two such fulfil all laws."""
        both = np.concatenate([rows, rows + self.k])
        K = self.K[np.ix_(both, both)]
        if max(np.abs(K @ (p - found[0])).max() for p in found) <= SEEN:
            return
        mu = self.static[rows], self.kinetic[rows]
        good = [p for p in found if missed(K, v, bounds, mu, p) < 1e-9]
        apart = max((np.abs(K @ (p - good[0])).max() for p in good), default=0.0)
        if apart > SEEN:
            worst = max(missed(K, v, bounds, mu, p) for p in good)
            raise NotUniqueError(f"{len(good)} impacts fulfil the laws to {worst:.1g}: {apart:.3g} m/s apart")
        raise SeveralError("several impulses fulfil the laws of an impact")


def missed(
    K: np.ndarray,
    v: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    mu: tuple[np.ndarray, np.ndarray],
    p: np.ndarray,
) -> float:
    """Return by how much impulses p miss the laws at worst, as parts of the largest impulse and speed.

    p_n >= given, v_n >= wanted of `bounds`, one of both equal; what sticks is within its cone by the first of `mu`,
    what slips on it by the second, against the slip.
    """
    k, (given, wanted), (static, kinetic) = len(v) // 2, bounds, mu
    after = v + K @ p
    more, faster = (p[:k] - given) / np.abs(p).max(), (after[:k] - wanted) / np.abs(v).max()
    slips = np.abs(after[k:]) > SLOW
    cone = np.where(slips, np.abs(p[k:] + kinetic * p[:k] * np.sign(after[k:])), np.abs(p[k:]) - static * p[:k])
    both = np.minimum(np.abs(more), np.abs(faster))
    return float(max(-more.min(), -faster.min(), both.max(), (cone / np.abs(p).max()).max()))


def _modes(K: np.ndarray, v: np.ndarray, given: np.ndarray, wanted: np.ndarray, mu: np.ndarray) -> list[np.ndarray]:
    """Return the impulses of all modes that fulfil the laws."""
    k, found = len(given), list[np.ndarray]()
    ways = [[(n, s) for n in (0, 1) for s in ((0, 1, -1) if mu[i] and (n or given[i]) else (2,))] for i in range(k)]
    for mode in product(*ways):
        A, b = np.zeros((2 * k, 2 * k)), np.zeros(2 * k)
        for i, (presses, slip) in enumerate(mode):
            if presses:
                A[i], b[i] = K[i], wanted[i] - v[i]
            else:
                A[i, i], b[i] = 1.0, given[i]
            if slip == 0:
                A[k + i], b[k + i] = K[k + i], -v[k + i]
            else:
                A[k + i, k + i], A[k + i, i] = 1.0, (mu[i] * slip if slip in (1, -1) else 0.0)
        slides = np.array([s if s in (1, -1) else 0 for _, s in mode])
        one, cone = np.eye(2 * k), np.diag(mu)
        G = np.vstack(
            [one[:k], np.hstack([cone, np.eye(k)]), np.hstack([cone, -np.eye(k)]), K[:k], slides[:, None] * K[k:]]
        )
        g = np.concatenate([-given, np.zeros(2 * k), v[:k] - wanted, slides * v[k:]])
        p = somewhere(A, b, G, g)
        if p is not None:
            found.append(p)
    return found


def somewhere(A: np.ndarray, b: np.ndarray, G: np.ndarray, g: np.ndarray) -> np.ndarray | None:
    """Return x with A x = b and G x + g >= 0, None where there is none; by a linear program if A has no inverse."""
    found = affine(A, b)
    if found is None:
        return None
    x, idle = found
    if least_room(G, g, x) >= 0.0 or not len(idle):
        return x if least_room(G, g, x) >= 0.0 else None
    x, _ = roomiest(G, g, x, idle)
    return x if least_room(G, g, x) >= 0.0 else None


def affine(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the shortest x with A x = b, and what may be added to it (j, n); None where there is none."""
    if not len(b):
        return np.zeros(0), np.zeros((0, 0))
    U, s, V = np.linalg.svd(A)
    rank = int((s > 1e-10 * s[0]).sum())
    x = V[:rank].T @ ((U.T[:rank] @ b) / s[:rank])
    missing = np.abs(A @ x - b).max()
    return None if missing > 1e-9 * (np.abs(b).max() + 1e-9) else (x, V[rank:])


def least_room(G: np.ndarray, g: np.ndarray, x: np.ndarray) -> float:
    """Return the least G x + g beside what rounding leaves of it, negative where that is not enough."""
    if not len(g):
        return 0.0
    size = np.abs(x).max(initial=0.0)
    allowed = 1e-9 * (np.abs(G) @ np.abs(x) + np.abs(g)) + 1e-10 * np.abs(G).max(axis=1, initial=0.0) * size + 1e-13
    return float((G @ x + g + allowed).min())


def roomiest(G: np.ndarray, g: np.ndarray, x: np.ndarray, idle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the x + idle^T y at which the least of G x + g, where y moves it, is largest; and G x + g, there that."""
    slopes = G @ idle.T
    moved = np.abs(slopes).max(axis=1, initial=0.0) > 1e-9 * np.abs(G).max(axis=1, initial=0.0)
    if not moved.any():
        return x, G @ x + g
    size = np.abs(x).max() + 1e-9
    left = np.column_stack([-slopes[moved], np.ones(int(moved.sum()))])
    bounds = [(-30.0, 30.0)] * len(idle) + [(None, 1.0)]
    right = (G[moved] @ x + g[moved]) / size
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    best = linprog([0.0] * len(idle) + [-1.0], left, right, bounds=bounds, options=options)
    if not best.status:
        x = x + size * best.x[:-1] @ idle
    room = G @ x + g
    return x, np.where(moved, room[moved].min(), room)
