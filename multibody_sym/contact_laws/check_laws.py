"""Whether the solution of a mode fulfils all laws, what to flip where it does not, and its labels by motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.contact_laws.problem import (
    IN_SPACE,
    STICKS,
    ModeArrays,
    Scaled,
    ScaledFriction,
    limits_of,
    over_parts,
)
from multibody_sym.contact_laws.solve_mode import ModeSolution, across_slip
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats
from multibody_sym.scalars.limits import Kind

ACCEPTED: Final = 1e-10
"""Inequalities hold to this part of the terms of their row, and of the largest force."""
TIED: Final = 1e-12
"""What is left of terms is zero below this part of them: some thousand roundings."""


@dataclass(frozen=True)
class Violation:
    """An inequality that does not hold: which (`place` is the number of a row, or of a part), and by how much."""

    kind: Kind
    place: int
    by: float


def gap_tolerance(trial: ModeSolution, part: float) -> Floats:
    """Return (m) what of a counts as zero: a part of each row's terms, and rounding of the largest ones."""
    return np.asarray(part * trial.terms + trial.rounding + 1e-300, dtype=float)


def force_tolerance(trial: ModeSolution, part: float) -> float:
    """Return what of z counts as zero: a part of the largest, and rounding of what the forces come from."""
    return part * trial.largest + 100.0 * EPSILON * trial.problem.wanted + 1e-300


def fulfils(trial: ModeSolution) -> bool:
    return holds_equations(trial) and next(violations(trial), None) is None


def holds_equations(trial: ModeSolution) -> bool:
    """Return whether a = 0 wherever the mode says so, dependent rows too."""
    if not trial.solved or not np.isfinite(trial.x).all():
        return False
    return bool((np.abs(trial.a) <= gap_tolerance(trial, ACCEPTED))[trial.active].all())


def violations(trial: ModeSolution) -> Iterator[Violation]:
    """Yield the inequalities that do not hold, sizes relative to what is largest of their kind."""
    problem, force, gap = trial.problem, force_tolerance(trial, ACCEPTED), gap_tolerance(trial, ACCEPTED)
    table = problem.table
    of_parts = over_parts(np.maximum, gap[table.rows], table.first)
    of_kinds = {"gap": gap[problem.unilateral], "slip": of_parts}
    for limits in limits_of(problem, trial.mode, trial.mu, trial.z, trial.a):
        allowed = of_kinds[limits.kind] if limits.kind in of_kinds else np.full(len(limits.places), force)
        for k in (limits.asked & (limits.values < -allowed)).nonzero()[0]:
            yield Violation(limits.kind, int(limits.places[k]), float(-limits.values[k] / (allowed[k] / ACCEPTED)))
        for number in np.flatnonzero(limits.asked & (table.sizes > 1)) if limits.kind == "slip" else ():
            part = problem.parts[number]
            across, size = across_slip(part, trial), float(np.linalg.norm(trial.a[part.rows]))
            if across > ACCEPTED * size + of_parts[number]:
                yield Violation("slip", part.number, across / size)


def flip(problem: Scaled, trial: ModeSolution, found: Violation) -> ModeArrays:
    """Return the mode in which the violated inequality gives way to its complement."""
    mode = trial.mode.copy()
    if found.kind in ("force", "gap"):
        mode.sides[found.place] = 1 - mode.sides[found.place]
    elif found.kind == "side":
        mode.sides[found.place] = -1 if mode.sides[found.place] >= 0 else 1
    elif found.kind == "slip":
        mode.slips[found.place] = STICKS
    else:
        part = problem.parts[found.place]
        force = trial.z[part.rows]
        if part.in_space:
            mode.slips[found.place] = IN_SPACE
            mode.direction(part)[:] = -force / np.linalg.norm(force)
        else:
            mode.slips[found.place] = -1 if force[0] > 0 else 1
        for k in part.normals:
            if k in problem.both:
                mode.sides[k] = -1 if trial.z[k] < 0 else 1
    return mode


# --- labels -----------------------------------------------------------------------------------------------------------


def label_by_motion(trial: ModeSolution) -> ModeArrays:
    """Return the mode by what moves: closed, stick and taut wherever a = 0; else what a and v_t say."""
    problem, mode = trial.problem, trial.mode.copy()
    tolerance = gap_tolerance(trial, TIED)
    still = np.abs(trial.a) <= tolerance
    unilateral = problem.unilateral
    mode.sides[unilateral] = (trial.mode.sides[unilateral] > 0) | still[unilateral]
    force = force_tolerance(trial, TIED)
    mode.sides[problem.both] = np.where(np.abs(trial.z[problem.both]) <= force, 0, np.sign(trial.z[problem.both]))
    touching = problem.pressed_parts(mode.sides)
    turned = problem.pressed_parts(trial.mode.sides)
    stands = touching & problem.table.rests & (trial.mode.slips == STICKS) & turned
    stands |= touching & problem.table.rests & problem.of_all_rows(still)
    mode.slips[:], mode.directions[:] = STICKS, 0.0
    for number in np.flatnonzero(touching & ~(stands & (trial.mu != 0.0))):
        part = problem.parts[number]
        mode.slips[number], mode.direction(part)[:] = _slip(part, trial, bool(stands[number]), bool(turned[number]))
    sticks = touching & problem.table.rests & (mode.slips == STICKS)
    mode.sides[problem.table.rows] = np.repeat(sticks, problem.table.sizes)
    return mode


def _slip(part: ScaledFriction, trial: ModeSolution, stands: bool, turned: bool) -> tuple[int, Floats]:
    """Return how a part slips, and its direction from rest in space; what is smooth never sticks.

    `turned`: it touches in the trial's mode, so that its direction there was found.
    """
    nowhere = np.zeros(len(part.rows))
    if part.held and part.rests:
        return STICKS, nowhere
    if not part.rests:
        return (IN_SPACE, nowhere) if part.in_space else (int(np.sign(part.velocity[0])), nowhere)
    a = trial.a[part.rows]
    if part.in_space:
        # The direction that was found has more digits than a small a_t.
        known = trial.mode.direction(part) * turned
        first = np.eye(len(part.rows))[0]
        return IN_SPACE, known.copy() if known.any() else first if stands else a / np.linalg.norm(a)
    return (1 if stands or a[0] > 0 else -1), nowhere
