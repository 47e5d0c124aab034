"""Linear complementarity problems by Lemke's method: w = M z + q, 0 <= w, 0 <= z, w z = 0.

Ties of the ratio test are broken lexicographically, by rows of [B^-1 q, B^-1 p, B^-1] with a p without any pattern, so
that the method ends where rows depend on each other, which is normal where things rest on each other. (The first two
columns nearly always tell rows apart: q + epsilon p is not degenerate.) It ends on a ray
where it finds nothing; for a copositive M with the right q that proves that there is nothing.

Source: Cottle, Pang, Stone, The Linear Complementarity Problem (1992), 4.4, 4.9.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.contact_laws.problem import IN_SPACE, Flags, ModeArrays, Scaled, ScaledFriction
from multibody_sym.contact_laws.solve_mode import Reduced
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.pivoted_qr import blas
from multibody_sym.scalars.rank import least_squares

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
    """Places of the unknowns: normals, N- of two-sided ones, then b and s of each part at rest."""

    def __init__(self, problem: Scaled, mu: Floats, fine: Fans) -> None:
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


def propose(problem: Scaled, small: Reduced, mu: Floats, pressing: dict[int, Floats], fine: Fans = NO_FANS) -> Proposal:
    """Return the mode of a solution for coefficients mu (p) and directions of pressing forces, by part.

    Parts with `fine` directions have these as edges too.
    """
    unknowns = _Unknowns(problem, mu, fine)
    f0, F = _forces(problem, small, mu, unknowns, pressing)
    q, M = _rows(problem, small, mu, unknowns, pressing, (f0, F))
    sizes = np.maximum(np.abs(M).max(axis=1, initial=0.0), 1e-12)
    found = lemke(M / sizes[:, None], q / sizes)
    return _read_mode(problem, small, unknowns, found, f0 + F @ found.z)


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


def _pressing_force(
    part: ScaledFriction, small: Reduced, unknowns: _Unknowns, pressing: dict[int, Floats]
) -> tuple[float, Floats, Floats]:
    """Return N = n0 + n_f . f + n_y . y."""
    n0, of_forces, of_unknowns = 0.0, np.zeros(len(small.own)), np.zeros(unknowns.count)
    weights = part.weights(np.ones(len(small.z0)), pressing)
    for k, weight in zip(part.normals.tolist(), weights, strict=True):
        n0 += weight * small.z0[k]
        of_forces += weight * small.Z[k]
        if k in unknowns.negative:
            of_unknowns[unknowns.negative[k]] += 2.0 * weight
    return n0, of_forces, of_unknowns


def _forces(
    problem: Scaled, small: Reduced, mu: Floats, unknowns: _Unknowns, pressing: dict[int, Floats]
) -> tuple[Floats, Floats]:
    """Return f = f0 + F y: forces of all rows but equalities."""
    place = small.place
    f0: Floats = np.zeros(len(small.own))
    F: Floats = np.zeros((len(small.own), unknowns.count))
    for k, i in unknowns.normal.items():
        F[place[k], i] = 1.0
    for number, columns in unknowns.edges.items():
        part = problem.parts[number]
        F[place[part.rows], columns] = unknowns.ways[number].T
    implied = np.eye(len(small.own))
    for part in unknowns.sliding:
        n0, of_forces, of_unknowns = _pressing_force(part, small, unknowns, pressing)
        against = -mu[part.number] * part.moving
        rows = place[part.rows]
        f0[rows] += against * n0
        F[rows] += np.outer(against, of_unknowns)
        implied[rows] -= np.outer(against, of_forces)
    if unknowns.sliding:
        both = least_squares(implied, np.column_stack([f0, F]))
        return np.asarray(both[:, 0], dtype=float), np.asarray(both[:, 1:], dtype=float)
    return f0, F


def _rows(
    problem: Scaled,
    small: Reduced,
    mu: Floats,
    unknowns: _Unknowns,
    pressing: dict[int, Floats],
    forces: tuple[Floats, Floats],
) -> tuple[Floats, Floats]:
    """Return q and M of w = M y + q."""
    f0, F = forces
    a0, A = small.a0 + small.K @ f0, small.K @ F
    z0, Z = small.z0 + small.Z @ f0, small.Z @ F
    q, M = np.zeros(unknowns.count), np.zeros((unknowns.count, unknowns.count))
    normals = list(unknowns.normal)
    q[: len(normals)], M[: len(normals)] = a0[normals], A[normals]
    for k, i in unknowns.negative.items():
        q[i], M[i] = z0[k], Z[k]
        M[i, i] += 1.0
    for number, columns in unknowns.edges.items():
        part, slack = problem.parts[number], unknowns.slack[number]
        ways = unknowns.ways[number]
        q[columns], M[columns] = ways @ a0[part.rows], ways @ A[part.rows]
        M[columns, slack] += 1.0
        n0, of_forces, of_unknowns = _pressing_force(part, small, unknowns, pressing)
        q[slack] = mu[number] * (n0 + of_forces @ f0)
        M[slack] = mu[number] * (of_forces @ F + of_unknowns)
        M[slack, columns] -= 1.0
    return q, M


def _read_mode(problem: Scaled, small: Reduced, unknowns: _Unknowns, found: Complementary, f: Floats) -> Proposal:
    """Return the mode of a solution: basic unknowns act."""
    y, basic = found.z, found.basic
    z, a = small.z0 + small.Z @ f, small.a0 + small.K @ f
    parts = len(problem.parts)
    mode = ModeArrays(np.zeros(problem.count, dtype=np.intp), np.zeros(parts, dtype=np.intp), np.zeros((parts, 3)))
    carrying = np.zeros(problem.count, dtype=bool)
    carrying[problem.kinematic] = carrying[problem.defining] = True
    for k, i in unknowns.normal.items():
        mode.sides[k] = carrying[k] = basic[i]
    mode.sides[problem.both] = np.where(z[problem.both] < 0.0, -1, 1)
    for k, i in unknowns.negative.items():
        mode.sides[k] = -1 if basic[i] else 1
    for part in problem.parts:
        if not part.rests:
            mode.slips[part.number] = IN_SPACE if part.in_space else int(np.sign(part.velocity[0]))
        elif part.number in unknowns.edges:  # it slips where its slack s is basic, against the force
            columns = unknowns.edges[part.number]
            pushing = basic[columns]
            if part.held or not basic[unknowns.slack[part.number]] or (not part.in_space and pushing.all()):
                carrying[part.rows] = pushing.any() if not part.in_space else True
                continue
            force = y[columns] @ unknowns.ways[part.number]
            if not force.any():
                force = -a[part.rows]
            if part.in_space:
                mode.slips[part.number] = IN_SPACE
                mode.direction(part)[:] = -force / (float(np.linalg.norm(force)) or 1.0)
            else:
                mode.slips[part.number] = 1 if force[0] < 0.0 else -1
    return Proposal(mode, carrying, small.x0 + small.X @ f, z, found.ray, found.spent)
