"""A mode proposed by Lemke's method: Stewart's and Trinkle's unknowns for friction at rest.

    w_n = a_n,  w_j = e_j . a_t + s,  w_s = mu N - sum b_j,   0 <= w, 0 <= (z_n, b_j, s),   z_t = sum e_j b_j

with the edges e_j: both senses of a line, 8 directions in a plane, 14 in space. A two-sided normal presses with
N = N+ + N-, N+ - N- = z: w = N+ = z + N- beside N- >= 0. What slides already exerts -mu N along its velocity.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.problem import IN_SPACE, STICKS
from multibody_sym.dynamics.laws.reduction import Reduced
from multibody_sym.dynamics.laws.scaled import Flags, Modes, Part, Scaled
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.complementarity import Complementary, lemke
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass

EDGES: Final = 8
LINE: Final = np.array([[1.0], [-1.0]])
CIRCLE: Final = np.array([[np.cos(k), np.sin(k)] for k in 2.0 * np.pi * np.arange(EDGES) / EDGES])
_CORNERS: Final = np.array(list(product((1.0, -1.0), repeat=3))) / np.sqrt(3.0)
SPHERE: Final = np.vstack([np.eye(3), -np.eye(3), _CORNERS])
Fans = Mapping[int, Floats]
"""Directions (k, 2) of further edges, by part."""
NO_FANS: Final[Fans] = {}
_CLOSER: Final = 4.0
"""By how much edges are closer each time."""


@dataclass(frozen=True)
class Proposal:
    """A mode, the rows (m) that carry force in it, x (n), forces z (m), and whether the search ended on a ray."""

    mode: Modes
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
                self.ways[part.number] = np.vstack([edges(part), *([fine[part.number]] if part.number in fine else [])])
                count += (size := len(self.ways[part.number])) + 1
                self.edges[part.number], self.slack[part.number] = slice(count - size - 1, count - 1), count - 1
        self.count = count
        self.sliding = [p for p in rubbing if not p.rests]


def edges(part: Part) -> Floats:
    return {1: LINE, 2: CIRCLE, 3: SPHERE}[len(part.rows)]


def propose(problem: Scaled, small: Reduced, mu: Floats, pressing: dict[int, Floats], fine: Fans = NO_FANS) -> Proposal:
    """Return the mode of a solution for coefficients mu (p) and directions of pressing forces, by part.

    Parts with `fine` directions have these as edges too.
    """
    unknowns = _Unknowns(problem, mu, fine)
    f0, F = _forces(problem, small, mu, unknowns, pressing)
    q, M = _rows(problem, small, mu, unknowns, pressing, (f0, F))
    sizes = np.maximum(np.abs(M).max(axis=1, initial=0.0), 1e-12)
    found = lemke(M / sizes[:, None], q / sizes)
    return _read(problem, small, unknowns, found, f0 + F @ found.z)


def fans(problem: Scaled, mu: Floats, proposal: Proposal, times: int) -> Fans:
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


def _pressed(
    part: Part, small: Reduced, unknowns: _Unknowns, pressing: dict[int, Floats]
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
        n0, of_forces, of_unknowns = _pressed(part, small, unknowns, pressing)
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
        n0, of_forces, of_unknowns = _pressed(part, small, unknowns, pressing)
        q[slack] = mu[number] * (n0 + of_forces @ f0)
        M[slack] = mu[number] * (of_forces @ F + of_unknowns)
        M[slack, columns] -= 1.0
    return q, M


def _read(problem: Scaled, small: Reduced, unknowns: _Unknowns, found: Complementary, f: Floats) -> Proposal:
    """Return the mode of a solution: basic unknowns act."""
    y, basic = found.z, found.basic
    z, a = small.z0 + small.Z @ f, small.a0 + small.K @ f
    parts = len(problem.parts)
    mode = Modes(np.zeros(problem.count, dtype=np.intp), np.zeros(parts, dtype=np.intp), np.zeros((parts, 3)))
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
        elif part.number in unknowns.edges:
            _read_part(part, mode, carrying, a, (y, basic), unknowns)
    return Proposal(mode, carrying, small.x0 + small.X @ f, z, found.ray, found.spent)


def _read_part(
    part: Part,
    mode: Modes,
    carrying: Flags,
    a: Floats,
    solution: tuple[Floats, Flags],
    unknowns: _Unknowns,
) -> None:
    """Set how a part at rest slips: it does where its slack s is basic, against the force."""
    y, basic = solution
    columns, number = unknowns.edges[part.number], part.number
    pushing = basic[columns]
    if part.held or not basic[unknowns.slack[number]] or (not part.in_space and pushing.all()):
        mode.slips[number] = STICKS
        carrying[part.rows] = pushing.any() if not part.in_space else True
        return
    force = y[columns] @ unknowns.ways[number]
    if not force.any():
        force = -a[part.rows]
    if part.in_space:
        mode.slips[number] = IN_SPACE
        mode.direction(part)[:] = -force / (float(np.linalg.norm(force)) or 1.0)
    else:
        mode.slips[number] = 1 if force[0] < 0.0 else -1
