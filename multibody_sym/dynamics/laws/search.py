"""The states in which all laws hold at an instant: none, one or several, with what was searched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.enumeration import MOST
from multibody_sym.dynamics.laws.islands import Island, islands, together
from multibody_sym.dynamics.laws.judgement import labelled, slipping
from multibody_sym.dynamics.laws.mode_solve import Trial, solve_mode
from multibody_sym.dynamics.laws.problem import (
    IN_SPACE,
    STICKS,
    Drift,
    Found,
    LawMode,
    LawProblem,
    LawState,
    Round,
    Verdict,
)
from multibody_sym.dynamics.laws.scaled import Flags, Modes, Scaled, scaled
from multibody_sym.dynamics.laws.states import Near, States, either_side, same
from multibody_sym.dynamics.laws.ties import Ties, rate_problem, tied, with_rates
from multibody_sym.dynamics.laws.uniqueness import undetermined
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

_MOST_TOGETHER: Final = 64
"""The most states of the whole, where several islands have several each."""


def find(
    problem: LawProblem,
    previous: LawState | LawMode | None = None,
    *,
    every: bool = True,
    drift: Drift | None = None,
    left: Mapping[int, float] | None = None,
    most: int = MOST,
) -> Found:
    """Return the states that fulfil all laws, from a previous state or mode where that is still near.

    With `every` all modes of each island are tried as long as there are no more than `most`; without it one state is
    enough, they are tried only where none is found, and forces that are not unique are not told. Of two coefficients
    the static one holds for what does not slip: parts at rest have it first, those that slip then get the kinetic one,
    until no more slip. Where two modes fit at the limit, `left` decides, where exact numbers tell what is left there,
    too little for floats: by rows, z of what touches, and for friction (under its part's first row) mu N - |z_t|. Else
    rates do, which `drift` gives.
    Raises NoSolutionError for rows that are not finite.
    """
    _verify_finite(problem)
    if not every and ((found := _of_all(problem, previous, every, drift, left, most)).states or found.proved):
        return found
    apart = islands(problem)
    alone = _of_islands(apart, previous, every, drift, left or {}, most) if len(apart) > 1 else None
    if alone is not None:
        return alone
    return _of_all(problem, previous, every, drift, left, most) if every else found


def _of_islands(
    apart: Sequence[Island],
    previous: LawState | LawMode | None,
    every: bool,
    drift: Drift | None,
    left: Mapping[int, float],
    most: int,
) -> Found | None:
    """Return the states by those of each island; None where rates of the whole are to tell modes at limits apart."""
    found = list[Found]()
    for island in apart:
        own = island.state(previous) if isinstance(previous, LawState) else previous and island.mode(previous)
        known = {k: left[row] for k, row in enumerate(island.rows) if row in left}
        found.append(_of_all(island.problem, own, every, None, known, most))
    if none := [each for each in found if not each.states]:
        return next((each for each in none if each.proved), none[0])
    if drift is not None and any(state.at_limit for each in found for state in each.states):
        return None
    states = list(islice(product(*(each.states for each in found)), _MOST_TOGETHER + 1))
    several = any(each.verdict == "several" for each in found)
    return Found(
        tuple(together(apart, state) for state in states[:_MOST_TOGETHER]),
        "several" if several else "one",
        ", ".join(dict.fromkeys(each.searched for each in found)),
        all(each.proved for each in found) and len(states) <= _MOST_TOGETHER,
        tuple(sorted(island.rows[k] for island, each in zip(apart, found, strict=True) for k in each.free)),
    )


def _of_all(
    problem: LawProblem,
    previous: LawState | LawMode | None,
    every: bool,
    drift: Drift | None,
    left: Mapping[int, float] | None,
    most: int,
) -> Found:
    search = _Search(scaled(problem), every, drift, left or {}, most)
    ends = search.run(*_begin(search.problem, previous))
    told = tuple(search.told(end) for end in ends)
    free = np.flatnonzero(np.any([end.labels.moving for end in ends], axis=0)) if ends else ()
    verdict: Verdict = "none" if not told else "one" if len(told) == 1 and not len(free) else "several"
    return Found(told, verdict, search.words(verdict), search.states.proved, tuple(int(k) for k in free))


def _verify_finite(problem: LawProblem) -> None:
    rows = np.column_stack([problem.matrix, problem.exerted, problem.coupling, problem.right])
    wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(wrong):
        raise NoSolutionError(
            f"row {wrong[0]} among those of contacts, ropes and constraints is not finite here: a direction has no "
            "value, or a mass is zero; start from another position",
            number="N105",
        )


Rounds = tuple[tuple[frozenset[int], Near], ...]
"""Parts that have the kinetic coefficient, and a solution with it, from static coefficients on."""


@dataclass(frozen=True)
class _Labels:
    """The mode by what moves, rows at a limit, and (m) which forces are not unique, and which of these move things."""

    mode: Modes
    at_limit: tuple[int, ...]
    unsure: Flags
    moving: Flags


@dataclass(frozen=True)
class _End:
    """A state in which no more parts slip than have the kinetic coefficient, and the rounds on the way to it."""

    trial: Trial
    labels: _Labels
    kinetic: frozenset[int]
    rounds: Rounds


class _Search:
    def __init__(
        self,
        problem: Scaled,
        every: bool,
        drift: Drift | None = None,
        left: Mapping[int, float] | None = None,
        most: int = MOST,
    ) -> None:
        self.problem, self.drift, self.left = problem, drift, left or {}
        self.exact = every or drift is not None
        self.states = States(problem, every, most)

    def run(self, near: list[Near], known: Rounds = ()) -> list[_End]:
        """Return the states, from those with static coefficients on to those in which no more parts slip.

        Modes `known` for some of the coefficients are tried before those that are near.
        """
        waiting: list[tuple[frozenset[int], list[Near], Rounds]] = [(frozenset(), near, ())]
        begun, ends = set[frozenset[int]](), list[_End]()
        while waiting:
            kinetic, near, rounds = waiting.pop(0)
            if kinetic in begun:
                continue
            begun.add(kinetic)
            near = [place for parts, place in known if parts == kinetic] + near
            for trial in self.states.at(self._coefficients(kinetic), near):
                labels = self._labels(trial, kinetic)
                slips = slipping(self.problem, labels.mode)
                new = {k for k in slips - kinetic if self.problem.parts[k].kinetic != self.problem.parts[k].static}
                to_here = (*rounds, (kinetic, self._basic(trial)))
                if new:
                    waiting.append((kinetic | new, [Near(trial.mode), Near(labels.mode)], to_here))
                else:
                    self._end(ends, _End(trial, labels, kinetic | slips, to_here))
        return ends

    def _end(self, ends: list[_End], new: _End) -> None:
        """Add a state, unless it is one that is there already, whose forces are not unique then."""
        for k, end in enumerate(ends):
            unsure = end.labels.unsure | new.labels.unsure
            if same(self.problem, new.trial, end.trial, unsure):
                ends[k] = replace(end, labels=replace(end.labels, unsure=unsure))
                return
        ends.append(new)

    def _basic(self, trial: Trial) -> Near:
        carrying = np.zeros(self.problem.count, dtype=bool)
        carrying[trial.basic] = True
        return Near(trial.mode, carrying)

    def _coefficients(self, kinetic: frozenset[int]) -> Floats:
        parts = self.problem.parts
        values = [p.kinetic if not p.rests or p.number in kinetic else p.static for p in parts]
        return np.array(values, dtype=float).reshape(len(parts))

    def _labels(self, trial: Trial, kinetic: frozenset[int]) -> _Labels:
        mode = labelled(self.problem, trial)
        none = np.zeros(self.problem.count, dtype=bool)
        if not self.exact:
            return _Labels(mode, (), none, none)
        unsure, moving = none.copy(), none.copy()
        moved = solve_mode(self.problem, mode, trial.mu)
        sided = list(either_side(self.problem, moved))
        for here in [moved] if len(sided) == 1 else (solve_mode(self.problem, one, trial.mu) for one in sided):
            open_ = undetermined(self.problem, here, trial)
            unsure, moving = unsure | open_[0], moving | open_[1]
        limit = tied(self.problem, trial, mode, unsure)
        for changes in (self._left, self._rates):
            if not limit or (change := changes(limit, self._state(trial, mode, kinetic))) is None:
                continue
            rates = rate_problem(self.problem, trial, mode, limit, *change)
            ends = _Search(rates.problem, every=True).run([])
            if len(ends) == 1:
                after = ends[0].trial, ends[0].labels.mode
                mode, limit = with_rates(self.problem, (trial, mode, limit), rates, after)
        return _Labels(mode, limit.rows(self.problem), unsure, moving)

    def _left(self, limit: Ties, state: LawState) -> tuple[Floats, Floats] | None:
        """Return what is left at limits, to the largest, and no rates; None where exact numbers tell nothing."""
        known = {k: self.left[k] * self.problem.sizes[k] for k in limit.rows(self.problem) if k in self.left}
        largest = max((abs(value) for value in known.values()), default=0.0)
        if not largest:
            return None
        left = np.zeros(self.problem.count)
        left[list(known)] = np.array(list(known.values())) / largest
        return np.zeros(self.problem.count), left

    def _rates(self, limit: Ties, state: LawState) -> tuple[Floats, Floats] | None:
        if self.drift is None:
            return None
        return self.drift(state) / self.problem.lengths, np.zeros(self.problem.count)

    # --- what is told -------------------------------------------------------------------------------------------------

    def told(self, end: _End) -> LawState:
        state = self._state(end.trial, end.labels.mode, end.kinetic)
        return LawState(
            state.mode,
            state.x,
            state.z,
            state.a,
            end.kinetic,
            tuple(int(k) for k in np.flatnonzero(end.labels.unsure)),
            end.labels.at_limit,
            tuple(self._round(kinetic, place) for kinetic, place in end.rounds),
        )

    def _state(self, trial: Trial, mode: Modes, kinetic: frozenset[int]) -> LawState:
        """Return a state in the units of the problem."""
        return LawState(
            self._told(mode), trial.x, trial.z / self.problem.sizes, trial.a * self.problem.lengths, kinetic
        )

    def _round(self, kinetic: frozenset[int], place: Near) -> Round:
        carrying = () if place.carrying is None else tuple(np.flatnonzero(place.carrying).tolist())
        return Round(kinetic, self._told(place.mode), carrying)

    def _told(self, mode: Modes) -> LawMode:
        ways = [mode.direction(part) for part in self.problem.parts]
        directions = tuple(tuple(way.tolist()) if way.any() else None for way in ways)
        return LawMode(tuple(int(k) for k in mode.sides), tuple(int(k) for k in mode.slips), directions)

    def words(self, verdict: Verdict) -> str:
        """Return what was searched."""
        states = self.states
        if states.proved and states.tried:
            return f"all {states.tried} modes"
        if states.proved:
            return "a contradiction by Lemke's method" if verdict == "none" else "least constraint: there is no other"
        if verdict == "none":
            near = "the modes near the last one and near that of Lemke's method (they are too many for all)"
            ways = "directions of slip and of forces from a few starts"
            return f"all {states.tried} modes, {ways}" if states.tried else near
        return f"{verdict if verdict == 'several' else 'one state'} found, others not searched"


def _begin(problem: Scaled, previous: LawState | LawMode | None) -> tuple[list[Near], Rounds]:
    """Return where to begin, and the modes that coefficients led to before."""
    if isinstance(previous, LawState):
        return _begin(problem, previous.mode)[0], tuple((x.kinetic, _near(problem, x)) for x in previous.rounds)
    return [] if previous is None else [Near(modes_of(problem, previous))], ()


def _near(problem: Scaled, previous: Round) -> Near:
    carrying = np.zeros(problem.count, dtype=bool)
    carrying[list(previous.carrying)] = True
    return Near(modes_of(problem, previous.mode), carrying)


def modes_of(problem: Scaled, previous: LawMode) -> Modes:
    """Return a mode by numbers; what moves slips as it does, and what has no direction to slip in sticks."""
    sides, slips = np.array(previous.sides, dtype=np.intp), np.array(previous.slips, dtype=np.intp)
    directions = np.zeros((len(slips), 3))
    for part in problem.parts:
        directions[part.number, : len(part.rows)] = previous.directions[part.number] or 0.0
        if not part.rests:
            slips[part.number] = IN_SPACE if part.in_space else int(np.sign(part.velocity[0]))
        elif part.in_space and slips[part.number] and not directions[part.number].any():
            slips[part.number] = STICKS
    return Modes(sides, slips, directions)
