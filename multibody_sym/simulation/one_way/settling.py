"""What a switch does before forces are asked: what touches, positions on their rows, speeds of what stops at zero."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import coordinate_rates
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.least_norm import solve_lists
from multibody_sym.numerics.rank import SWITCHED, least_squares
from multibody_sym.simulation.one_way.facts import Facts

_ROUNDING: Final = 1e-15
"""The part of the model's size, and of its largest speed, that is not put back."""
_FEW: Final = 8
"""Rows that are put back as they come."""
_INDEPENDENT: Final = 1e-3
"""The part of a row that others leave then."""
_COARSER: Final = (SWITCHED, 1e-7, 1e-5, 1e-3)
"""Tolerances of rows that bring to rest what hardly moves, until they change speeds slightly: near a dead centre what
stands still holds nothing else, and a crank does not stop for a slider that does."""
_NO_WAY: Final = 1e-9
"""The part of the model's size that is no way to slide."""
_SLIGHT: Final = 1e-6
"""The part of the largest speeds by which these may change: a thousand times that up to which slip counts as rest."""


def moved(facts: Facts, *, q: Floats | None = None, u: Floats | None = None) -> Facts:
    """Return what holds at other coordinates or speeds; the same where they are None."""
    if q is None and u is None:
        return facts
    there = facts.q if q is None else q, facts.u if u is None else u
    return facts.laws.at(facts.t, *there, facts.scale)


def named(facts: Facts, names: Collection[str]) -> list[OneWay]:
    """Return the elements of these names."""
    return facts.laws.named(names)


def closing(facts: Facts, touching: Collection[str]) -> list[OneWay]:
    """Return what closes with a speed."""
    return [x for x in named(facts, touching) if facts.sense(x) < 0]


def _kept(facts: Facts, touching: Collection[str]) -> list[int]:
    """Return the places of the rows that hold: constraints and the normals of what touches."""
    mechanism = facts.laws.mechanism
    return [facts.place(row) for row in (*mechanism.rows, *(x.normals[0] for x in named(facts, touching)))]


def onto_rows(facts: Facts, touching: Collection[str]) -> Floats | None:
    """Return the coordinates put onto closed gaps, taut ropes and constraints; None if they are there."""
    places = _kept(facts, touching)
    phi = facts.known["phi"][places]
    if not np.abs(phi).max(initial=0.0) > _ROUNDING * facts.scale.length:
        return None
    there = np.flatnonzero(phi)
    rows, wanted = facts.by_mass[places][there], -phi[there]
    change = _least_change(facts, rows, wanted)
    if change is None:
        change = facts.speeds(least_squares(rows, wanted, SWITCHED))
    rates = coordinate_rates(facts.laws.mechanism, facts.q.tolist(), change.tolist())
    onto: Floats = facts.q + np.array(rates, dtype=float)
    return onto


def at_rest(facts: Facts, touching: Collection[str]) -> Floats | None:
    """Return the speeds with what touches and does not slide at rest in its rows to the last bit; None if it is.

    Friction that is always enough stops little slip at once.
    """
    problem = facts.posed(touching)
    places, little = _kept(facts, touching), _SLIGHT * facts.scale.speed
    for part, law in zip(problem.parts, problem.problem.parts, strict=True):
        if law.rests or (law.enough and float(np.abs(law.velocity).max()) <= little):
            places += [facts.place(row) for row in part.rows]
    speeds = facts.known["phidot"][places]
    if not np.abs(speeds).max(initial=0.0) > _ROUNDING * facts.scale.speed:
        return None
    sizes = facts.laws.slides * facts.scale.speed + (1.0 - facts.laws.slides) * facts.scale.turning
    for change in _changes(facts, places, -speeds):
        if (np.abs(change) <= _SLIGHT * sizes).all():
            return facts.u + change
    return None


def slid_out(facts: Facts, touching: Collection[str], udot: Floats) -> Floats | None:
    """Return the speeds with all that touches at rest, where accelerations (nu,) end slip at once; None elsewhere.

    It would get no further than a billionth of the model's size.
    """
    slips = [facts.place(row) for part in facts.posed(touching).parts for row in part.rows]
    speeds = facts.known["phidot"][slips]
    slower, size = -float(speeds @ facts.accelerations(slips, udot)), float(np.linalg.norm(speeds))
    if not 0.0 < size**3 <= 2.0 * slower * _NO_WAY * facts.scale.length:
        return None
    places = [*_kept(facts, touching), *slips]
    return facts.u + next(_changes(facts, places, -facts.known["phidot"][places]))


def _least_change(facts: Facts, rows: Floats, wanted: Floats) -> Floats | None:
    """Return the least change of speeds that changes rows as wanted; None where rows are many or nearly dependent.

    `turns.c` gives the same bits.
    """
    if len(rows) > _FEW:
        return None
    x, _, (rank, least, _) = solve_lists(rows.tolist(), wanted.tolist(), rows.shape[1], len(rows))
    if not (rank == len(rows) and least > _INDEPENDENT):
        return None
    return facts.inverse.in_order(np.array(x))


def _changes(facts: Facts, places: Sequence[int], wanted: Floats) -> Iterator[Floats]:
    """Yield changes of speeds (nu,) that change rows as wanted, by ever fewer of the rows."""
    rows = facts.by_mass[places]
    change = _least_change(facts, rows, wanted)
    if change is not None:
        yield change
    yield from (facts.speeds(least_squares(rows, wanted, independent)) for independent in _COARSER)
