"""Islands of a problem of laws: rows that share no weighted coordinate and no law with the others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, reduce
from typing import TypeVar

import numpy as np

from multibody_sym.dynamics.laws.problem import Friction, FrictionLaw, Law, LawMode, LawProblem, LawState, Round
from multibody_sym.numerics.connected import connected
from multibody_sym.records import dataclass

_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class Island:
    """Some `rows` and `parts` of a problem, by number, and the problem that they make, whatever all others do."""

    rows: Sequence[int]
    parts: Sequence[int]
    problem: LawProblem

    def mode(self, of: LawMode) -> LawMode:
        """Return what a mode of the whole is here."""
        return LawMode(_at(self.rows, of.sides), _at(self.parts, of.slips), _at(self.parts, of.directions))

    def state(self, of: LawState) -> LawState:
        """Return what is needed here of a state of the whole, to find it again: its mode and its rounds."""
        rounds = tuple(map(self._round, of.rounds))
        return LawState(self.mode(of.mode), of.x, of.z[self.rows], of.a[self.rows], rounds=rounds)

    def _round(self, of: Round) -> Round:
        places, numbers = self._places, self._numbers
        kinetic = frozenset(numbers[k] for k in of.kinetic if k in numbers)
        return Round(kinetic, self.mode(of.mode), tuple(places[k] for k in of.carrying if k in places))

    @cached_property
    def _places(self) -> Mapping[int, int]:
        return {row: k for k, row in enumerate(self.rows)}

    @cached_property
    def _numbers(self) -> Mapping[int, int]:
        return {part: k for k, part in enumerate(self.parts)}


def islands(problem: LawProblem) -> list[Island]:
    """Return the islands of a problem."""
    acts = (problem.matrix != 0.0) | (problem.exerted != 0.0)
    joined = acts @ acts.T | (problem.coupling != 0.0)
    for part in problem.parts:
        joined[part.rows[0], [*part.rows, *part.normals]] = True
    return [_alone(problem, rows) for rows in connected(joined)]


def _alone(problem: LawProblem, rows: Sequence[int]) -> Island:
    places = {row: k for k, row in enumerate(rows)}
    kept = [k for k, part in enumerate(problem.parts) if part.rows[0] in places]
    numbers = {k: number for number, k in enumerate(kept)}
    alone = LawProblem(
        problem.matrix[rows],
        problem.exerted[rows],
        problem.coupling[np.ix_(rows, rows)],
        problem.right[rows],
        tuple(_numbered(problem.laws[row], numbers) for row in rows),
        tuple(_placed(problem.parts[k], places) for k in kept),
    )
    return Island(rows, kept, alone)


def _numbered(law: Law, numbers: Mapping[int, int]) -> Law:
    return replace(law, part=numbers[law.part]) if isinstance(law, Friction) else law


def _placed(part: FrictionLaw, places: Mapping[int, int]) -> FrictionLaw:
    rows, normals = (tuple(places[k] for k in of) for of in (part.rows, part.normals))
    return replace(part, rows=rows, normals=normals)


def together(apart: Sequence[Island], states: Sequence[LawState]) -> LawState:
    """Return the state of the whole that states of all its islands make."""
    each = list(zip(apart, states, strict=True))
    z, a = (np.zeros(sum(len(island.rows) for island in apart)) for _ in range(2))
    for island, state in each:
        z[island.rows], a[island.rows] = state.z, state.a
    return LawState(
        _mode([(island, state.mode) for island, state in each]),
        reduce(np.add, (state.x for state in states)),
        z,
        a,
        _kinetic((island, state.kinetic) for island, state in each),
        _rows((island, state.not_unique) for island, state in each),
        _rows((island, state.at_limit) for island, state in each),
        tuple(_round(each, k) for k in range(max(len(state.rounds) for state in states))),
    )


def _round(each: Sequence[tuple[Island, LawState]], k: int) -> Round:
    """Return a round of the whole: an island that has no more of its own stays at its last one."""
    now = [(island, state.rounds[min(k, len(state.rounds) - 1)]) for island, state in each if state.rounds]
    return Round(
        _kinetic((island, of.kinetic) for island, of in now),
        _mode([(island, of.mode) for island, of in now]),
        _rows((island, of.carrying) for island, of in now),
    )


def _mode(each: Sequence[tuple[Island, LawMode]]) -> LawMode:
    sides = _placed_at((island.rows, mode.sides) for island, mode in each)
    slips = _placed_at((island.parts, mode.slips) for island, mode in each)
    return LawMode(sides, slips, _placed_at((island.parts, mode.directions) for island, mode in each))


def _kinetic(each: Iterable[tuple[Island, frozenset[int]]]) -> frozenset[int]:
    return frozenset(island.parts[k] for island, parts in each for k in parts)


def _rows(each: Iterable[tuple[Island, Iterable[int]]]) -> tuple[int, ...]:
    return tuple(sorted(island.rows[k] for island, rows in each for k in rows))


def _at(places: Sequence[int], values: Sequence[_T]) -> tuple[_T, ...]:
    return tuple(values[k] for k in places)


def _placed_at(each: Iterable[tuple[Sequence[int], Sequence[_T]]]) -> tuple[_T, ...]:
    """Return values in the order of the places that are given with them."""
    found = sorted(((k, x) for places, values in each for k, x in zip(places, values, strict=True)), key=_first)
    return tuple(x for _, x in found)


def _first(pair: tuple[int, object]) -> int:
    return pair[0]
