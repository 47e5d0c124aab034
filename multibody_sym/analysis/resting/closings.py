"""Rest of what holds one way only: searched with each set of contacts, ropes and stops closed, held to their laws.

A position counts where all that is closed in the set presses or pulls, and all else is open, or touches without force.
Friction is left out: where it holds, positions beside such a one rest as well.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from math import comb
from typing import Final

import numpy as np

from multibody_sym.analysis.places import Mask
from multibody_sym.analysis.resting.search import SECONDS, Found, Search, found_from, search_from
from multibody_sym.dynamics.constraints.closing import closed_near
from multibody_sym.dynamics.laws.assemble import Scale, one_way_rows
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import placed, rows_at, started
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import ACTIVE, Mode, OneWay
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.native import linear_program
from multibody_sym.numerics.rank import SLOPES, leading_columns
from multibody_sym.records import dataclass

_MANY: Final = 6
"""With more that may close only what is closed at the start, one element at a time, or nothing is tried closed."""
_FRUITLESS: Final = 3
"""How many guesses on end must find nothing with one set closed before its search ends, but for that of the start."""
_PRESSES: Final = 1e-9
"""The part of the largest force of a row that what is closed exerts at least: less is rounding."""

Closed = tuple[str, ...]


@dataclass(frozen=True)
class Rest:
    """A position of rest (nq,): what presses or pulls in it, what else touches, and which coordinates are `free`.

    `search` is that of the mechanism in which all that is `closed` is so.
    """

    q: Floats
    closed: Closed
    touching: Closed
    free: Mask
    search: Search

    @property
    def stable(self) -> bool | None:
        """Whether it is stable; None where it is indifferent, or what touches without force might decide."""
        found = self.search.stable(self.q)
        return found if found or not self.touching else None


@dataclass(frozen=True)
class Rests:
    """All positions that were found, after so many `guesses`, and whether the search was `cut_short`.

    `first` is the search with the same closed as at the start; `sets`: how many sets were tried closed, and how many
    there are of no more elements than there are speeds, since more of them depend on each other.
    """

    found: tuple[Rest, ...]
    first: Search
    guesses: int
    cut_short: bool
    sets: tuple[int, int]


def rests(resolved: Mechanism, begin: Start, formalism: str | None, *, project: bool) -> Rests:
    """Return the positions of rest of a mechanism from its start. Raises NoSolutionError where there is no start.

    Where curves touch, whose points of contact are coordinates, nothing is tried closed.
    """
    if not any(x.unilateral for x in resolved.one_way) or any(body.is_foot for body in resolved.bodies):
        search = search_from(resolved, begin, formalism)
        found = found_from(search, np.array(begin.q, dtype=float))
        kept = tuple(Rest(q, (), (), free, search) for q, free in zip(found.positions, found.free, strict=True))
        return Rests(kept, search, found.guesses, found.cut_short, (1, _all_sets(resolved)))
    own = begin if resolved.relative is None else start(resolved.relative, project=project)
    return _Closings(resolved, begin, own, formalism).rests()


@dataclass(frozen=True)
class _Closings:
    """The search of a mechanism that `begin`s somewhere, with sets of elements closed; `own`: that start in joints."""

    resolved: Mechanism
    begin: Start
    own: Start
    formalism: str | None

    def rests(self) -> Rests:
        """Return the positions of rest, those with the same closed as at the start first.

        Each of the other sets is searched before, for its share of half the time: with what is closed at the start a
        search may go on and on from position to position in which something would have to pull.
        """
        until = time.process_time() + SECONDS
        closed, *others = self._sets()
        closed = self._independent(closed, np.array(self.begin.q, dtype=float))
        founds: list[tuple[Closed, Found]] = []
        for number, names in enumerate(others):
            share = (until - 0.5 * SECONDS - time.process_time()) / (len(others) - number)
            if share <= 0.0:
                break
            search = self.search(names)
            found = found_from(search, np.array(search.places.start), share, _FRUITLESS, falls=False)
            founds.append((names, found))
        first = self.search(closed)
        left = until - time.process_time()
        founds.insert(0, (closed, found_from(first, np.array(first.places.start), left)))
        kept = list[Rest]()
        for names, found in founds:
            for q in found.positions:
                rest = self._rest(q, names)
                if rest is not None and not any(_one(rest, x) for x in kept):
                    kept.append(rest)
        tried, guesses = len(founds), sum(found.guesses for _, found in founds)
        cut_short = tried <= len(others) or any(found.cut_short for _, found in founds)
        return Rests(tuple(kept), first, guesses, cut_short, (tried, max(tried, _all_sets(self.resolved))))

    @cached_property
    def elements(self) -> dict[str, OneWay]:
        """What may close, by name."""
        return {x.name: x for x in self.resolved.one_way if x.unilateral}

    def _sets(self) -> list[Closed]:
        """Return the sets of what may be closed: that at the start, then small ones first."""
        rows = rows_at(self.resolved, self.begin)
        closed = tuple(name for name, x in self.elements.items() if rows.standing(x) not in ("open", "inside"))
        most = min(len(self.elements), len(self.resolved.speeds)) if len(self.elements) <= _MANY else 1
        every = (each for size in range(most + 1) for each in combinations(self.elements, size))
        return [closed, *(each for each in every if each != closed)]

    @cached_property
    def _scale(self) -> Scale:
        """The sizes at the start: in a position all may be at the origin."""
        return rows_at(self.resolved, self.begin).scale

    @cached_property
    def declared(self) -> Mechanism:
        """The mechanism without friction."""
        return _smooth(self.resolved)

    @cached_property
    def _searches(self) -> dict[Closed, Search]:
        return {}

    def search(self, closed: Closed) -> Search:
        """Return the search in the mechanism in which some elements are closed, from the start or one beside it."""
        if closed not in self._searches:
            mechanism = placed(self.declared, Mode(dict.fromkeys(closed, ACTIVE)))
            begun = started(mechanism, self.declared.relative or self.declared, self.own)
            search = search_from(mechanism, begun, self.formalism)
            near = closed_near(search.rows, np.array(begun.q, dtype=float))
            self._searches[closed] = (
                search if near is None else replace(search, places=replace(search.places, start=near))
            )
        return self._searches[closed]

    def _rest(self, q: Floats, closed: Closed) -> Rest | None:
        """Return a position as one of rest, None where something is inside of another, or does not press or pull."""
        there = replace(self.begin, q=tuple(q.tolist()), u=(0.0,) * len(self.begin.u))
        rows = rows_at(self.resolved, there, self._scale)
        standing = {name: rows.standing(x) for name, x in self.elements.items()}
        if "inside" in standing.values() or any(standing[name] == "open" for name in closed):
            return None
        touching = tuple(name for name, how in standing.items() if how == "touching")
        pressing = next((names for names in (touching, closed) if self._presses(q, names)), None)
        if pressing is None:
            return None
        closed = pressing
        search = self.search(self._independent(closed, q))
        return Rest(q, closed, tuple(name for name in touching if name not in closed), search.free(q), search)

    def _independent(self, closed: Closed, q: Floats) -> Closed:
        """Return as many of a set as hold the same at a position: where rows depend on each other slopes are noise."""
        search = self.search(closed)
        names = [row.name for row in search.mechanism.rows]
        own = [names.index(self.elements[name].normals[0].name) for name in closed]
        others = [k for k in range(len(names)) if k not in own]
        leading = leading_columns(search.flow.jacobian(q)[[*others, *own]].T, SLOPES) if own else []
        return tuple(name for k, name in enumerate(closed) if len(others) + k in leading)

    def _presses(self, q: Floats, closed: Closed) -> bool:
        """Return whether forces hold a position with which all of a set press or pull; they need not be unique."""
        search = self.search(closed)
        names = [row.name for row in search.mechanism.rows]
        places = [names.index(self.elements[name].normals[0].name) for name in closed]
        try:
            forces, jacobian = search.flow.multipliers(q), search.flow.jacobian(q)
        except UNDEFINED:
            return False
        size = float(np.abs(forces).max(initial=0.0))
        return bool((forces[places] > _PRESSES * size).all()) or _least(jacobian, forces, places) > _PRESSES * size


def _all_sets(mechanism: Mechanism) -> int:
    """Return how many sets there are of what may close, of no more elements than there are speeds."""
    count = sum(x.unilateral for x in mechanism.one_way)
    return sum(comb(count, size) for size in range(min(count, len(mechanism.speeds)) + 1))


def _least(jacobian: Floats, forces: Floats, places: Sequence[int]) -> float:
    """Return how large the least of some rows' forces can be, where other forces (nr) of all do the same; at most 1."""
    size = float(np.abs(forces).max(initial=0.0)) or 1.0
    equal = np.hstack([jacobian.T, np.zeros((jacobian.shape[1], 1))])
    below = np.zeros((len(places), len(forces) + 1))
    below[range(len(places)), places], below[:, -1] = -1.0, 1.0
    found = linear_program(
        np.append(np.zeros(len(forces)), -1.0),
        [*[(None, None)] * len(forces), (None, 1.0)],
        below=(below, np.zeros(len(places))),
        equal=(equal, jacobian.T @ forces / size),
    )
    return float(found.x[-1]) * size if found.status == 0 else -np.inf


def stands(search: Search, q: Floats) -> bool:
    """Return whether in a position of rest all is open or closed as in the mode of the mechanism, and none pulls."""
    mechanism = search.mechanism
    if mechanism.mode is None:
        return True
    scale = one_way_rows(mechanism, search.places.motion(search.places.start)).scale
    rows = one_way_rows(mechanism, search.places.motion(q), scale)
    names = [row.name for row in mechanism.rows]
    try:
        forces = search.flow.multipliers(q)
    except UNDEFINED:
        return False
    least = -_PRESSES * float(np.abs(forces).max(initial=0.0))
    for element in (x for x in mechanism.one_way if x.unilateral):
        closed = mechanism.mode.acts(element)
        how, row = rows.standing(element), element.normals[0].name
        if how == "inside" or (closed and (how == "open" or (row in names and not forces[names.index(row)] >= least))):
            return False
    return True


def _smooth(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism without friction; what rolls goes on rolling."""
    relative = None if mechanism.relative is None else _smooth(mechanism.relative)
    elements = tuple(x if _rolls(x) else replace(x, frictions=()) for x in mechanism.one_way if x.unilateral)
    return replace(mechanism, one_way=elements, relative=relative)


def _rolls(element: OneWay) -> bool:
    return element.kind == "contact" and element.path[0] == "constraints"


def _one(rest: Rest, other: Rest) -> bool:
    """Return whether two positions are one, or of one family."""
    return other.search.places.same(rest.q, other.q, other.free)
