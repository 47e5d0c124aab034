"""A mode of an impact at once, by sweeps over its contacts: each obeys its own law beside the impulses of the others.

Nearly sure where directions of slip in space make proposals miss, and sooner than trying all modes: what they come near
is solved exactly, and judged, by the search for modes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.judgement import fulfils, holds_equations
from multibody_sym.dynamics.laws.mode_solve import solve_mode
from multibody_sym.dynamics.laws.problem import IN_SPACE, STICKS, LawMode, LawProblem
from multibody_sym.dynamics.laws.proposals import SPHERE
from multibody_sym.dynamics.laws.reduction import Reduced, reduced
from multibody_sym.dynamics.laws.scaled import Part, Places, Scaled, scaled
from multibody_sym.dynamics.laws.search import modes_of
from multibody_sym.dynamics.laws.uniqueness import admissible
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import most

MOST: Final = 2000
_TURNS: Final = 2.0 * np.pi * np.arange(24) / 24
WAYS: Final = {2: np.column_stack([np.cos(_TURNS), np.sin(_TURNS)]), 3: SPHERE}
"""Directions that are tried for each slip in space beside the one that sweeps were at."""
SETTLED: Final = 1e-13
"""Part of the largest impulse by which none changes in a sweep any more."""
CARRIES: Final = 1e-9
"""Part of the largest impulse below which there is none, and of the largest speed below which nothing slips."""


def settled(problem: LawProblem) -> LawMode:
    """Return the mode that sweeps come to, or are at when there were too many; static friction holds."""
    system = scaled(problem)
    small = reduced(system)
    parts = [_own(part, small) for part in system.parts]
    f = np.zeros(len(small.own))
    for _ in range(MOST):
        before = f.copy()
        _sweep(system, small, parts, f)
        if float(np.abs(f - before).max(initial=0.0)) <= SETTLED * float(np.abs(f).max(initial=0.0)):
            break
    return _mode(system, small, f)


def turned(problem: LawProblem, mode: LawMode) -> LawMode | None:
    """Return a mode with one of its slips in space turned, in which static friction holds; None where none does."""
    system = scaled(problem)
    mu = np.array([part.static for part in system.parts], dtype=float)
    return next((other for other in _ways_off(mode) if _may_hold(system, other, mu)), None)


def _ways_off(mode: LawMode) -> Iterator[LawMode]:
    for k, slip in enumerate(mode.directions):
        for way in () if slip is None else WAYS[len(slip)]:
            other = tuple(float(x) for x in way)
            yield replace(mode, directions=(*mode.directions[:k], other, *mode.directions[k + 1 :]))


def _may_hold(system: Scaled, mode: LawMode, mu: Floats) -> bool:
    """Return whether a mode fulfils the laws, with other impulses than those of a basic solution if need be."""
    trial = solve_mode(system, modes_of(system, mode), mu)
    if fulfils(system, trial) or not trial.idle.shape[1] or not holds_equations(system, trial):
        return fulfils(system, trial)
    other = admissible(system, trial)
    return other is not None and fulfils(system, other)


@dataclass(frozen=True)
class _Own:
    """A friction part, where its own impulses are among all, and the most that one of them changes its speed."""

    part: Part
    places: Places
    stiff: float


def _own(part: Part, small: Reduced) -> _Own:
    places = small.place[part.rows]
    return _Own(part, places, float(np.linalg.norm(small.K[np.ix_(part.rows, places)], 2)))


def _sweep(system: Scaled, small: Reduced, parts: list[_Own], f: Floats) -> None:
    """Let each contact take the impulses that its law wants beside all others."""
    for k in system.unilateral:
        i = small.place[k]
        if small.K[k, i] > 0.0:
            f[i] = max(0.0, f[i] - (small.a0[k] + small.K[k] @ f) / small.K[k, i])
    for own in parts:
        if own.stiff > 0.0:
            rows = own.part.rows
            wanted = f[own.places] - (small.a0[rows] + small.K[rows] @ f) / own.stiff
            size = math.hypot(*wanted)
            f[own.places] = wanted * min(1.0, _limit(own.part, small, f) / size) if size else 0.0


def _limit(part: Part, small: Reduced, f: Floats) -> float:
    return float(most(part.static, part.pressed(small.z0 + small.Z @ f)))


def _mode(system: Scaled, small: Reduced, f: Floats) -> LawMode:
    z, a = small.z0 + small.Z @ f, small.a0 + small.K @ f
    force, speed = CARRIES * float(np.abs(z).max(initial=0.0)), CARRIES * float(np.abs(system.r).max(initial=0.0))
    sides = np.ones(system.count, dtype=int)
    sides[system.unilateral] = z[system.unilateral] > force
    sides[system.both] = np.where(z[system.both] < 0.0, -1, 1)
    slips, directions = list[int](), list[tuple[float, ...] | None]()
    for part in system.parts:
        slip = a[part.rows]
        moves = float(np.linalg.norm(slip)) > speed and not part.enough
        sides[part.rows] = not moves
        slips.append((IN_SPACE if part.in_space else int(np.sign(slip[0]))) if moves else STICKS)
        e = slip / np.linalg.norm(slip) if moves else slip
        directions.append(tuple(float(x) for x in e) if moves and part.in_space else None)
    return LawMode(tuple(int(k) for k in sides), tuple(slips), tuple(directions))
