"""Forces that are not unique, as of a box on two corners: a basic solution, which a run follows until it ends.

Rows that depend on others are let go: what touches may carry nothing, what rests may exert nothing or be at its static
limit. Others then have unique forces, and where these leave their bounds another basic solution is taken, or the state
is another. In space, where limits are circles, all rows are kept instead, and share what they carry (`laws.shares`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.assemble import PosedLaws
from multibody_sym.dynamics.laws.problem import LawState
from multibody_sym.dynamics.laws.shares import shared
from multibody_sym.model.mechanism.one_way import STICKS, FrictionPart, Mode, OneWay
from multibody_sym.numerics.rank import SWITCHED, least_squares, rank
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import most, sliding

_ALLOWED: Final = 1e-9
"""The part of the largest force by which bounds may be missed."""
_MOST: Final = 4
"""Parts at rest whose limits are tried in all combinations."""


@dataclass(frozen=True)
class _Part:
    """A friction part that rests or slides, the places of its rows and normals, its coefficient then, its element."""

    part: FrictionPart
    element: OneWay
    rows: tuple[int, ...]
    normals: tuple[int, ...]
    limit: float


@dataclass(frozen=True, eq=False)
class _Acting:
    """What acts in a mode: places of constraints, of normals by element, and what rests or slides."""

    problem: PosedLaws
    mode: Mode
    state: LawState

    def elements(self) -> list[OneWay]:
        return [x for x in self.problem.elements if x.unilateral and self.mode.sides.get(x.name)]

    def place(self, element: OneWay) -> int:
        return self.problem.places[element.normals[0].name]

    def bilateral(self) -> list[int]:
        return [self.problem.places[row.name] for row in self.problem.mechanism.rows]

    def parts(self, *, resting: bool) -> list[_Part]:
        laws = {part.name: law for part, law in zip(self.problem.parts, self.problem.problem.parts, strict=True)}
        return [
            _Part(part, x, law.rows, law.normals, law.static if resting else law.kinetic)
            for x in self.elements()
            for part in x.frictions
            if (law := laws.get(part.name)) and (self.mode.slips.get(part.name, STICKS) == STICKS) == resting
        ]


def basic_mode(problem: PosedLaws, state: LawState) -> Mode:
    """Return the mode of a state; where its forces are not unique, with a basic solution that keeps its bounds.

    In space, and without one that is found, with shares of all rows. Where reactions in joints press, friction in
    joints is let go alone.
    """
    mode = problem.mode(state)
    acting = _Acting(problem, mode, state)
    resting = acting.parts(resting=True)
    rows = acting.bilateral() + [acting.place(x) for x in acting.elements()]
    rows += [place for one in resting for place in one.rows]
    if problem.problem.coupling.any():
        return _with_joints(acting)
    if _rank(problem, rows) == len(rows):
        return mode
    if any(len(one.rows) > 1 for one in (*resting, *acting.parts(resting=False))):
        return shared(problem, mode, state)
    kept, idle, loose = _kept(acting, resting)
    for how in _ways(acting, loose):
        if _fits(acting, kept, idle, loose, how):
            return replace(mode, idle=idle, carried={one.part.name: s for one, s in zip(loose, how, strict=True)})
    return shared(problem, mode, state)


def _with_joints(acting: _Acting) -> Mode:
    """Return the mode in which what rests exerts nothing, or its limit, where other rows hold it at rest as well.

    Which parts hold is tried in turn: at a corner of what the laws allow all others exert their limit.
    """
    from multibody_sym.dynamics.laws.judgement import fulfils
    from multibody_sym.dynamics.laws.mode_solve import solve_mode
    from multibody_sym.dynamics.laws.scaled import Modes, scaled
    from multibody_sym.dynamics.laws.search import modes_of

    posed, law = acting.problem, acting.problem.problem
    mu = np.array([part.static if part.rests else part.kinetic for part in law.parts])
    problem = scaled(law)
    begun: Modes = modes_of(problem, acting.state.mode)
    kept, idle = _pressed(acting)
    unpressed = [acting.place(x) for x in acting.elements() if x.name in idle]
    unpressed += [row for one in acting.parts(resting=True) if one.element.name in idle for row in one.rows]
    for always, first in product((True, False), range(len(law.parts))):
        loose = _loose(acting, kept, idle, first, always)
        if not loose and not idle:
            break
        lines = [number for number in loose if len(law.parts[number].rows) == 1]
        beside = {posed.names[row]: 0 for number in loose if number not in lines for row in loose[number]}
        for how in product(*(_exerting(acting, number, k < _MOST) for k, number in enumerate(lines))):
            carrying, modes = np.ones(len(law.laws), dtype=bool), begun.copy()
            carrying[unpressed + [row for rows in loose.values() for row in rows]] = False
            modes.slips[lines] = how
            if fulfils(problem, solve_mode(problem, modes, mu, carrying)):
                names = (posed.parts[number].name for number in lines)
                return replace(acting.mode, idle=idle, carried=dict(zip(names, how, strict=True)) | beside)
    return acting.mode


def _exerting(acting: _Acting, number: int, tried: bool) -> tuple[int, ...]:
    """Return what a loose part along one row may exert: nothing, or its limit if it has one and these are `tried`."""
    posed = acting.problem
    sense = -1 if float(acting.state.z[posed.problem.parts[number].rows[0]]) > 0.0 else 1
    unilateral = any(x.unilateral for x in posed.elements if posed.parts[number] in x.frictions)
    if not tried or posed.problem.parts[number].enough:
        return (0,)
    return (sense, 0, -sense) if unilateral else (0, sense, -sense)


def _loose(
    acting: _Acting, carrying: Sequence[int], idle: Sequence[str], first: int, enough: bool
) -> dict[int, list[int]]:
    """Return the rows of parts at rest that depend on others, by the numbers of these parts, but no `idle` elements.

    Friction that is always `enough` holds first, if that is said, then the part of number `first` before the others.
    """
    posed, parts = acting.problem, acting.problem.problem.parts
    resting = {one.part.name for one in acting.parts(resting=True) if one.element.name not in idle}
    always = {part.name for x in posed.elements if not x.unilateral for part in x.frictions}
    kept = list(carrying)
    loose: dict[int, list[int]] = {}
    order = (*range(first, len(parts)), *range(first))
    for number in sorted(order, key=lambda k: enough and not parts[k].enough):
        part, law = posed.parts[number], parts[number]
        sticks = law.rests and acting.state.mode.slips[number] == STICKS
        if not sticks or part.name not in resting | always:
            continue
        for row in law.rows:
            if _rank(posed, [*kept, row]) > _rank(posed, kept):
                kept.append(row)
            else:
                loose.setdefault(number, []).append(row)
    return loose


def _rank(problem: PosedLaws, places: Sequence[int]) -> int:
    return rank(problem.problem.matrix[list(places)], SWITCHED) if len(places) else 0


def _kept(acting: _Acting, resting: Sequence[_Part]) -> tuple[list[int], tuple[str, ...], list[_Part]]:
    """Return independent rows, those of the largest forces first; elements that carry nothing; parts let loose."""
    (kept, idle), z, loose = _pressed(acting), acting.state.z, []
    for one in sorted(resting, key=lambda x: -most(x.limit, float(np.abs(z[list(x.normals)]).sum()))):
        independent = _rank(acting.problem, [*kept, *one.rows]) == _rank(acting.problem, kept) + len(one.rows)
        if independent and one.element.name not in idle:
            kept += one.rows
        else:
            loose.append(one)
    return kept, idle, loose


def _pressed(acting: _Acting) -> tuple[list[int], tuple[str, ...]]:
    """Return rows of joints and independent normals, those of the largest forces first; elements that carry nothing."""
    z, kept, idle = acting.state.z, acting.bilateral(), []
    for element in sorted(acting.elements(), key=lambda x: -z[acting.place(x)]):
        place = acting.place(element)
        if _rank(acting.problem, [*kept, place]) > _rank(acting.problem, kept):
            kept.append(place)
        else:
            idle.append(element.name)
    return kept, tuple(idle)


def _ways(acting: _Acting, loose: Sequence[_Part]) -> Iterator[tuple[int, ...]]:
    """Yield what each part that was let loose may exert: nothing, or its limit, the way in which it pulls first."""
    choices = []
    for k, one in enumerate(loose):
        own = -1 if float(acting.state.z[one.rows[0]]) > 0.0 else 1
        plain = len(one.rows) > 1 or k >= _MOST
        choices.append((0,) if plain else (own, 0, -own))
    yield from product(*choices)


def _fits(
    acting: _Acting, kept: Sequence[int], idle: Sequence[str], loose: Sequence[_Part], how: Sequence[int]
) -> bool:
    """Tell whether forces of the kept rows, with these of the loose ones, make the motion and keep their bounds."""
    problem, exerted = acting.problem.problem, acting.problem.problem.exerted.copy()
    slips = [(one, slip) for one, slip in zip(loose, how, strict=True) if one.element.name not in idle]
    slips += [(one, acting.mode.slips[one.part.name]) for one in acting.parts(resting=False)]
    for one, slip in slips:
        if slip in (1, -1):
            exerted[one.normals[0]] += sliding(one.limit, [slip])[0] * problem.exerted[one.rows[0]]
    places = list(kept)
    forces = least_squares(exerted[places].T, acting.state.x)
    z = np.zeros(len(problem.laws))
    z[places] = forces
    allowed = _ALLOWED * float(np.abs(acting.state.z).max(initial=0.0))
    missed = exerted[places].T @ forces - acting.state.x
    if float(np.abs(missed).max(initial=0.0)) > _ALLOWED * max(float(np.abs(acting.state.x).max(initial=0.0)), 1e-300):
        return False
    if any(z[acting.place(x)] < -allowed for x in acting.elements()):
        return False
    bound = [one for one in acting.parts(resting=True) if one not in loose and not one.part.enough]
    return all(
        float(np.linalg.norm(z[list(one.rows)])) <= most(one.limit, float(z[list(one.normals)].sum())) + allowed
        for one in bound
    )
