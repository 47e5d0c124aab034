"""The states at given coefficients: from a mode that is near, from one that Lemke's method proposes, or among all."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import product
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.along_motion import along_motion
from multibody_sym.dynamics.laws.enumeration import candidates, count_modes
from multibody_sym.dynamics.laws.judgement import flipped, fulfils, holds_equations, labelled, violations
from multibody_sym.dynamics.laws.mode_solve import Trial, press, roughly, solve_mode
from multibody_sym.dynamics.laws.problem import STICKS
from multibody_sym.dynamics.laws.proposals import Proposal, fans, propose
from multibody_sym.dynamics.laws.reduction import Reduced, reduced
from multibody_sym.dynamics.laws.scaled import Flags, Modes, Scaled
from multibody_sym.dynamics.laws.uniqueness import SEEN, admissible
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

FLIPS: Final = 10
SAME: Final = 1e-8
"""States whose accelerations differ by less than this part of the largest are one."""
SIDED: Final = 6
FINER: Final = 3
"""How often edges are put closer: by 4^3 at last."""
PASSES: Final = 30
ROUGH: Final = 0.01
"""Part of the largest by which directions in space that some passes have brought near may still miss."""


_NEAR, _TURNED = 1e-2, 1e-13
"""Directions of pressing forces that move less from pass to pass are near enough to look for a state; or settled."""
_STEEP: Final = 1e3
"""A coefficient of friction beyond which rounding may lead Lemke's method astray."""


@dataclass(frozen=True)
class Near:
    """A mode that may hold, the rows (m) that carry force in it, and how many flips are worth a try.

    `motion`: x and z near which the directions of its slip from rest in space are looked for.
    """

    mode: Modes
    carrying: Flags | None = None
    flips: int = FLIPS
    motion: tuple[Floats, Floats] | None = None


class States:
    """One problem being searched: how many modes were tried, and whether nothing was left out."""

    def __init__(self, problem: Scaled, every: bool, most: int) -> None:
        self.problem, self.every, self.most = problem, every, most
        self.proved, self.tried = True, 0

    @cached_property
    def small(self) -> Reduced:
        return reduced(self.problem)

    def at(self, mu: Floats, near: list[Near]) -> list[Trial]:
        """Return the distinct states with these coefficients, or one of them."""
        found = list[Trial]()
        modes = [replace(place, flips=0) for place in near[:-1]] + near[-1:]
        one = next((trial for place in modes if (trial := self._locally(mu, place)) is not None), None)
        contradicts = False
        if one is None:
            one, contradicts = self._proposed(mu)
        if one is not None:
            found.append(one)
            if not self.every or self._is_convex(mu):
                self.proved &= self._is_convex(mu)
                return found
        count = count_modes(self.problem, mu)
        if count > self.most:
            self.proved &= contradicts and self._copositive(mu)
            return found
        self.tried += count
        for mode, open_ in candidates(self.problem, self.small, mu):
            for trial in self._tried(mode, mu, found) if open_ else self._basic(mode, mu):
                if not any(same(self.problem, trial, other) for other in found):
                    found.append(trial)
        self.proved &= bool(found) or not self._turns_anywhere(mu)
        return found

    def _turns_anywhere(self, mu: Floats) -> bool:
        """Return whether directions of slip or of pressing forces have to be iterated: there may be more of them."""
        rough = [p for p in self.problem.parts if mu[p.number] and not (p.held and p.rests)]
        return any((p.in_space and p.rests) or (p.norm and len(p.normals) > 1) for p in rough)

    def _basic(self, mode: Modes, mu: Floats) -> Iterator[Trial]:
        trial = solve_mode(self.problem, mode, mu)
        if fulfils(self.problem, trial):
            yield trial

    def _tried(self, mode: Modes, mu: Floats, found: list[Trial]) -> Iterator[Trial]:
        """Yield states of a mode that leaves forces open, with both sides of two-sided normals that stick.

        Where these forces do not move the system, its motion fits or does not, and may be known already.
        """
        for sided in _both_sides(self.problem, mode):
            if mode.directions.any() and self._is_hopeless(roughly(self.problem, sided, mu), found):
                continue
            trial = solve_mode(self.problem, sided, mu)
            if fulfils(self.problem, trial):
                yield trial
                continue
            if not trial.idle.shape[1] or not holds_equations(self.problem, trial):
                continue
            if not self._open_motion(trial):
                wrong = any(v.kind in ("gap", "slip") for v in violations(self.problem, trial))
                if wrong or (not self._open_sides(trial) and any(moves_alike(self.problem, trial, t) for t in found)):
                    continue
            other = admissible(self.problem, trial)
            if other is not None and fulfils(self.problem, other):
                yield other

    def _is_hopeless(self, trial: Trial, found: list[Trial]) -> bool:
        """Return whether a mode with rough directions in space is far from any state, or near one that is known."""
        if not trial.solved or self._open_motion(trial):
            return not trial.solved
        if any(v.kind in ("gap", "slip") and v.by > ROUGH for v in violations(self.problem, trial)):
            return True
        return not self._open_sides(trial) and any(moves_alike(self.problem, trial, t, ROUGH) for t in found)

    def _open_motion(self, trial: Trial) -> bool:
        """Return whether forces that are open move the system."""
        forces = np.abs(trial.forces @ trial.idle).max(initial=0.0)
        return float(np.abs(trial.moved).max(initial=0.0)) > SEEN * float(forces)

    def _open_sides(self, trial: Trial) -> bool:
        """Return whether forces that are open press a joint."""
        changes = np.abs(trial.forces @ trial.idle).max(axis=1, initial=0.0)
        return bool((changes[self.problem.both] > SEEN * float(changes.max(initial=0.0))).any())

    def _is_convex(self, mu: Floats) -> bool:
        """Return whether nothing rubs: the motion is that of least constraint, and there is one."""
        return not mu.any() and bool(np.array_equal(self.problem.A, self.problem.C))

    def _copositive(self, mu: Floats) -> bool:
        """Return whether a ray means that there is no state: contacts at rest alone rub."""
        parts = [p for p in self.problem.parts if mu[p.number]]
        two_sided = self.problem.two_sided
        rest = all(p.rests and not p.norm and not p.in_space and not two_sided[p.normals].any() for p in parts)
        return rest and bool(np.array_equal(self.problem.A, self.problem.C))

    def _locally(self, mu: Floats, near: Near) -> Trial | None:
        """Return a state in a mode, or in one that few flips lead to."""
        mode, carrying, seen = near.mode, near.carrying, set[bytes]()
        if near.motion is not None and carrying is not None:
            mode = along_motion(self.problem, mode, mu, carrying, near.motion) or mode
        for _ in range(near.flips + 1):
            trial = solve_mode(self.problem, mode, mu, carrying)
            if fulfils(self.problem, trial):
                return trial
            if carrying is not None:
                carrying, trial = None, solve_mode(self.problem, mode, mu)
                if fulfils(self.problem, trial):
                    return trial
            broken = sorted(violations(self.problem, trial), key=lambda v: -v.by) if np.isfinite(trial.z).all() else []
            if near.flips and trial.idle.shape[1] and holds_equations(self.problem, trial):
                other = admissible(self.problem, trial)
                if other is not None and fulfils(self.problem, other):
                    return other
            seen.add(mode.sides.tobytes() + mode.slips.tobytes())
            turned = (flipped(self.problem, trial, v) for v in broken)
            mode_ = next((m for m in turned if m.sides.tobytes() + m.slips.tobytes() not in seen), None)
            if mode_ is None:
                return None
            mode = mode_
        return None

    def _proposed(self, mu: Floats) -> tuple[Trial | None, bool]:
        """Return a state that Lemke's method leads to, and whether it ended on a ray, which no rounding explains.

        Coefficients that stand for all that is needed are beyond its digits: lower ones propose a mode then.
        """
        found, ray = self._proposed_by(mu, mu)
        if found is None and (mu > _STEEP).any():
            return self._proposed_by(mu, np.minimum(mu, _STEEP))[0], False
        return found, ray

    def _proposed_by(self, mu: Floats, coefficients: Floats) -> tuple[Trial | None, bool]:
        """Return a state with coefficients mu that Lemke's method leads to with others, and whether it met a ray."""
        norms = [p for p in self.problem.parts if p.norm and mu[p.number]]
        pressing: dict[int, Floats] = {}
        ray, turned = False, 1.0 if norms else 0.0
        for k in range(PASSES if norms else 1):
            proposal = propose(self.problem, self.small, coefficients, pressing)
            ray, used = proposal.ray and not proposal.spent, dict(pressing)
            near, turned = turned < _NEAR or k == PASSES - 1, press(norms, proposal.z, pressing)
            trial = self._refined(mu, used, proposal) if (near or turned < _TURNED) and not proposal.ray else None
            if trial is not None:
                return trial, False
            if turned < _TURNED:
                break
        return None, ray

    def _refined(self, mu: Floats, pressing: dict[int, Floats], proposal: Proposal) -> Trial | None:
        """Return a state that a proposal leads to, or one with ever more edges close to its friction in space."""
        for times in range(FINER + 1):
            motion = proposal.x, proposal.z
            trial = self._locally(mu, Near(proposal.mode, proposal.carrying, 0 if times else FLIPS, motion))
            trial = trial or self._moving_so(mu, proposal)
            if trial is not None:
                return trial
            fine = fans(self.problem, mu, proposal, times + 1)
            if not fine:
                return None
            proposal = propose(self.problem, self.small, mu, pressing, fine)
            if proposal.ray:
                return None
        return None

    def _moving_so(self, mu: Floats, proposal: Proposal) -> Trial | None:
        """Return the state in which all presses, sticks and slips as it moves in a proposal, whose forces are few."""
        moving = solve_mode(self.problem, proposal.mode, mu, proposal.carrying)
        if not np.isfinite(moving.x).all():
            return None
        trial = solve_mode(self.problem, labelled(self.problem, moving), mu)
        if trial.idle.shape[1] and holds_equations(self.problem, trial):
            trial = admissible(self.problem, trial) or trial
        return trial if fulfils(self.problem, trial) else None


def _both_sides(problem: Scaled, mode: Modes) -> Iterator[Modes]:
    """Yield the mode with each choice of sides of normals of parts that stick."""
    stuck = [p for p in problem.parts if p.rests and mode.slips[p.number] == STICKS and not p.norm]
    yield from _with_sides(mode, {int(k) for p in stuck for k in p.normals if problem.two_sided[k]})


def either_side(problem: Scaled, trial: Trial) -> Iterator[Modes]:
    """Yield a trial's mode with each choice of sides of two-sided normals that have no force, but may have others.

    Of the first `SIDED` of them, so that there are not too many.
    """
    changes = np.abs(trial.forces @ trial.idle).max(axis=1, initial=0.0)
    open_ = (trial.mode.sides == 0) & (changes > SEEN * changes.max(initial=0.0))
    free = problem.both[open_[problem.both]]
    pressing = {int(k) for part in problem.parts if not part.norm for k in part.normals}
    yield from _with_sides(trial.mode, [int(k) for k in free if int(k) in pressing][:SIDED])


def _with_sides(mode: Modes, chosen_rows: Collection[int]) -> Iterator[Modes]:
    rows = sorted(chosen_rows)
    for sides in product((1, -1), repeat=len(rows)):
        chosen = mode.copy()
        chosen.sides[rows] = sides
        yield chosen


def same(problem: Scaled, one: Trial, other: Trial, unsure: Flags | None = None) -> bool:
    """Return whether two states have the same accelerations and press the same sides of joints that rub.

    Of sides that are `unsure` (m) nothing is asked: there the forces are not unique.
    """
    if not moves_alike(problem, one, other):
        return False
    unsure = np.zeros(problem.count, dtype=bool) if unsure is None else unsure
    if np.array_equal(labelled(problem, one).sides, labelled(problem, other).sides):
        return True
    largest = max(float(np.abs(trial.z).max(initial=0.0)) for trial in (one, other))
    sure = problem.both[~unsure[problem.both]]
    return bool((np.abs(one.z[sure] - other.z[sure]) <= SAME * largest).all())


def moves_alike(problem: Scaled, one: Trial, other: Trial, part: float = SAME) -> bool:
    """Return whether two states have the same accelerations, to a part of the largest."""
    scale = max(float(np.abs(trial.x).max(initial=0.0)) for trial in (one, other))
    scale = max(scale, float(np.abs(problem.r).max(initial=0.0)))
    return float(np.abs(one.x - other.x).max(initial=0.0)) <= part * scale
