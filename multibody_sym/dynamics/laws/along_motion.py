"""Directions in which slip from rest in space begins, found together with the motion that they are those of.

    x = C^T S(e) zeta,   A_k x + D_k S zeta = r_k,   e = a_t/|a_t| with a_t = A_t x - r_t

by Newton's method for x and zeta. Just beyond the limit of rest accelerations are so small that any error of a
direction makes larger ones: Newton's method for the directions has to begin as close to them as that. Those of x belong
to one motion from the first, whose size is no matter.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.mode_solve import active_rows, forces_of
from multibody_sym.dynamics.laws.problem import STICKS
from multibody_sym.dynamics.laws.scaled import Flags, Modes, Part, Places, Scaled
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass

_STEPS: Final = 40
_TURN: Final = 0.7
"""By how much (rad) an acceleration may turn in a step."""
_LEAST: Final = 0.3
"""The part of itself that is left of it along itself at least."""
_SHORTER: Final = 0.8
_SETTLED: Final = 1e-6
"""A step that changes all accelerations by less than this part of them leaves its square."""


def along_motion(
    problem: Scaled, mode: Modes, mu: Floats, carrying: Flags, near: tuple[Floats, Floats]
) -> Modes | None:
    """Return the mode with the directions in which its own motion goes, from x (n) and z (m) that are near.

    None where nothing slips from rest in space, or nothing settles.
    """
    slips = _slipping(problem, mode, mu, carrying)
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


def _slipping(problem: Scaled, mode: Modes, mu: Floats, carrying: Flags) -> list[Part]:
    """Return the parts that slip from rest in space, and rub."""
    touching = problem.pressed_parts(mode.sides)
    begun = (p for p in problem.parts if p.in_space and p.rests and touching[p.number] and mu[p.number])
    return [p for p in begun if mode.slips[p.number] != STICKS and carrying[p.normals].any() and not p.norm]


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
    slips: list[Part]
    active: Places
    free: Places

    def accelerations(self, mode: Modes, x: Floats, zeta: Floats) -> Floats:
        z = forces_of(self.problem, mode, self.mu, self.free, {}) @ zeta
        return np.asarray(self.problem.A @ x + self.problem.D @ z - self.problem.r, dtype=float)

    def turned(self, mode: Modes, x: Floats, zeta: Floats) -> Modes | None:
        """Return the mode with slip along a motion's accelerations; None where one has no direction."""
        found, a = mode.copy(), self.accelerations(mode, x, zeta)
        for part in self.slips:
            size = float(np.linalg.norm(a[part.rows]))
            if not size > 0.0:
                return None
            found.direction(part)[:] = a[part.rows] / size
        return found

    def step(self, mode: Modes, x: Floats, zeta: Floats) -> tuple[Floats, Floats]:
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
