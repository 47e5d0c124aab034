"""Ties: where two modes fit an instant, their rates decide.

On pairs that are both zero, and with A, C and D as they are,

    a' = A y + D z' + g,   y = C^T z'      (g: how a changes while z does not)

is a problem of the same kind: 0 <= a_n' beside 0 <= z_n'; 0 <= mu N' + s z_t' beside s a_t' >= 0 where friction is at
its limit mu N = -s z_t (in space along z_t; across it a_t' = 0); Coulomb's law of z_t' where N = 0. All else of the
mode stays as it is: active rows have a' = 0, what slides follows its normals.

Where exact numbers tell what is left at a limit, too little for floats, the same problem has g = 0 and 0 <= d + z_n',
0 <= d + mu N' + s z_t' with that d: its changes z' are those that the forces need to be within their limits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from multibody_sym.dynamics.laws.judgement import TIED, force_tolerance, gap_tolerance
from multibody_sym.dynamics.laws.mode_solve import Trial, sticking
from multibody_sym.dynamics.laws.problem import IN_SPACE, STICKS
from multibody_sym.dynamics.laws.scaled import Flags, Modes, Part, Places, Scaled, beyond
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import ROUNDED, null_space
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Ties:
    """Rows of closed contacts and taut ropes without force; parts that stick with all the friction there can be."""

    normals: tuple[int, ...]
    parts: tuple[int, ...]

    def __bool__(self) -> bool:
        return bool(self.normals or self.parts)

    def rows(self, problem: Scaled) -> tuple[int, ...]:
        return tuple(sorted((*self.normals, *(int(problem.parts[k].rows[0]) for k in self.parts))))


def tied(problem: Scaled, trial: Trial, mode: Modes, unsure: Flags) -> Ties:
    """Return what is at its limit: a and z are both zero, of forces that are unique."""
    force = force_tolerance(problem, trial.z, TIED)
    gap = gap_tolerance(problem, trial.x, trial.z, TIED)
    closed = problem.unilateral[mode.sides[problem.unilateral] > 0]
    still = (np.abs(trial.z[closed]) <= force) & (np.abs(trial.a[closed]) <= gap[closed]) & ~unsure[closed]
    table = problem.table
    stuck = problem.of_all_rows(sticking(problem, mode, trial.mu) & ~unsure) & ~table.held
    pressed, size = problem.pressed(trial.z), problem.rubbing(trial.z)
    left = np.abs(beyond(size, pressed, trial.mu))
    limit = left <= 10.0 * TIED * np.maximum(size, trial.mu * pressed) + force
    parts = np.flatnonzero(stuck & (np.minimum(trial.mu, 1.0) * pressed > force) & limit)
    known = [int(k) for k in parts if not unsure[problem.parts[k].normals].any()]
    return Ties(tuple(int(k) for k in closed[still]), tuple(known))


@dataclass(frozen=True)
class RateProblem:
    """The problem of rates, and of which parts its parts are; rows of parts at their limit are along the slip."""

    problem: Scaled
    parts: tuple[int, ...]


def rate_problem(problem: Scaled, trial: Trial, mode: Modes, ties: Ties, g: Floats, left: Floats) -> RateProblem:
    """Return the problem of rates; its rows are those of the problem, without laws where the mode keeps them out.

    `left` (m) is what is left at limits of forces, negative where they are beyond.
    """
    made = _Rates(problem, trial, mode, ties)
    for part in problem.parts:
        made.take(part)
    active = mode.sides[problem.unilateral] > 0
    loose = np.isin(problem.unilateral, ties.normals)
    held, one_way = np.array(made.held, dtype=np.intp), np.array(made.one_way, dtype=np.intp)
    kinematic = np.concatenate([problem.kinematic, problem.unilateral[active & ~loose], held])
    unilateral = np.concatenate([problem.unilateral[loose], one_way])
    asked = replace(
        problem,
        A=made.A,
        C=made.C,
        D=made.D,
        r=made.A @ (made.C.T @ left) + made.D @ left - made.along_slip(g),
        kinematic=np.sort(kinematic).astype(np.intp),
        unilateral=np.sort(unilateral).astype(np.intp),
        both=np.zeros(0, dtype=np.intp),
        parts=tuple(replace(part, number=k) for k, part in enumerate(made.parts)),
    )
    return RateProblem(asked, tuple(part.number for part in made.parts))


class _Rates:
    """The rows of the problem of rates, while parts are taken into them one by one."""

    def __init__(self, problem: Scaled, trial: Trial, mode: Modes, ties: Ties) -> None:
        self.problem, self.trial, self.mode, self.ties = problem, trial, mode, ties
        self.A, self.C, self.D = problem.A.copy(), problem.C.copy(), problem.D.copy()
        self.turned = list[tuple[Places, Floats]]()
        self.held, self.one_way = list[int](), list[int]()
        self.parts = list[Part]()
        self.stuck = sticking(problem, mode, trial.mu)

    def take(self, part: Part) -> None:
        """Let a part slide with its normals, hold it, or leave its friction to be found."""
        z, slip = self.trial.z, int(self.mode.slips[part.number])
        mu = self.trial.mu[part.number]
        if not mu or not self.problem.pressed_parts(self.mode.sides)[part.number]:
            return
        if slip != STICKS:
            moving = part.moving if not part.rests else self._begun(part, slip)
            self._follow(part, -mu * moving)
        elif set(part.normals.tolist()) <= set(self.ties.normals) and not part.in_space:
            self.parts.append(replace(part, static=mu, kinetic=mu))
        elif part.number in self.ties.parts:
            way = against(z[part.rows])
            self._follow(part, -mu * way)
            self._turn(part.rows, way)
            self.one_way.append(int(part.rows[0]))
            self.held += part.rows[1:].tolist()
        else:
            self.held += part.rows.tolist()

    def _begun(self, part: Part, slip: int) -> Floats:
        return self.mode.direction(part) if part.in_space else np.array([float(slip)])

    def _turn(self, rows: Places, way: Floats) -> None:
        """Let the first of a part's rows be along a unit vector, the others across it."""
        frame = np.vstack([way, null_space(way[None], ROUNDED).T])
        self.A[rows], self.C[rows] = frame @ self.A[rows], frame @ self.C[rows]
        self.D[:, rows] = self.D[:, rows] @ frame.T
        self.D[rows] = frame @ self.D[rows]
        self.turned.append((rows, frame))

    def along_slip(self, a: Floats) -> Floats:
        """Return what rows (m) have, along and across the slip of parts at their limits."""
        a = a.copy()
        for rows, frame in self.turned:
            a[rows] = frame @ a[rows]
        return a

    def _follow(self, part: Part, exerts: Floats) -> None:
        """Let the normals exert the part's friction too."""
        z = self.trial.z
        weights = part.weights(z, {part.number: part.along(z)})
        for normal, weight in zip(part.normals, weights, strict=True):
            self.C[normal] += weight * exerts @ self.C[part.rows]
            self.D[:, normal] += weight * self.D[:, part.rows] @ exerts


def against(friction: Floats) -> Floats:
    """Return the unit vector in which a part begins to slip at the limit of its friction."""
    return np.asarray(-friction / np.linalg.norm(friction), dtype=float)


def with_rates(
    problem: Scaled, before: tuple[Trial, Modes, Ties], rates: RateProblem, after: tuple[Trial, Modes]
) -> tuple[Modes, Ties]:
    """Return the mode that the rates say, from the state without them and theirs, and what they leave tied."""
    old, mode, ties = before
    trial, labels = after
    mode = mode.copy()
    gap = gap_tolerance(rates.problem, trial.x, trial.z, TIED)
    still = (np.abs(trial.a) <= gap) & (np.abs(trial.z) <= force_tolerance(rates.problem, trial.z, TIED))
    for k in ties.normals:
        mode.sides[k] = labels.sides[k]
    for number in ties.parts:
        part = problem.parts[number]
        if not labels.sides[part.rows[0]]:
            _slips(mode, part, against(old.z[part.rows]))
    for k, number in enumerate(rates.parts):
        if labels.slips[k] != STICKS:
            _slips(mode, problem.parts[number], np.array([float(labels.slips[k])]))
    parts = [k for k in ties.parts if still[problem.parts[k].rows[0]]]
    return mode, Ties(tuple(k for k in ties.normals if still[k]), tuple(parts))


def _slips(mode: Modes, part: Part, way: Floats) -> None:
    """Let a part slip along a unit vector."""
    mode.slips[part.number] = IN_SPACE if part.in_space else int(way[0])
    if part.in_space:
        mode.direction(part)[:] = way
    mode.sides[part.rows] = 0
