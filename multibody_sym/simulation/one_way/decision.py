"""What happens at a switch: positions, impacts, speeds, and the state that follows, each by the laws of what holds."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.assemble import PosedLaws
from multibody_sym.dynamics.laws.problem import Found, LawState
from multibody_sym.kinematics.motion import coordinate_rates
from multibody_sym.model.mechanism.one_way import INACTIVE, Mode, OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import SWITCHED, least_squares
from multibody_sym.simulation.one_way.basic import basic_mode
from multibody_sym.simulation.one_way.facts import Facts, posed
from multibody_sym.simulation.one_way.impact import Blow, Bounces, low_bounce, struck

_ROUNDING: Final = 1e-15
"""The part of the model's size, and of its largest speed, that is not put back."""
_COARSER: Final = (SWITCHED, 1e-7, 1e-5, 1e-3)
"""Tolerances of rows that bring to rest what hardly moves, until they change speeds slightly: near a dead centre what
stands still holds nothing else, and a crank does not stop for a slider that does."""
_SLIGHT: Final = 1e-6
"""The part of the largest speeds by which these may change: a thousand times that up to which slip counts as rest."""
_SOON: Final = (1e-7, 1e-5, 1e-3)
"""Parts of the time in which the fastest passes the model's size: so soon it shows how forces at a limit change."""


@dataclass(frozen=True, eq=False)
class Decided:
    """How a run goes on from an instant: with the coordinates and speeds of `facts`, in a mode.

    `found` are the states that are possible, of which `state` was taken, None if there is none; `blow` what an
    impact did, None without one; `late` how much longer (s) what rests now would still have bounced.
    """

    facts: Facts
    mode: Mode | None
    state: LawState | None
    found: Found
    posed: PosedLaws
    blow: Blow | None = None
    late: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Before:
    """The mode in which a run came to a switch, its accelerations (nu,) there, a mode that may follow, what bounces."""

    mode: Mode
    udot: Floats
    guess: Mode | None
    bounces: Bounces

    def late(self, facts: Facts, closing: Iterable[OneWay], touching: Collection[str]) -> dict[str, float]:
        """Return how much longer (s) each element would bounce that comes to rest now, or collapses with others."""
        alone = len(touching) == 1
        left = {x.name: self.bounces.remaining(facts, x, facts.falling(x, self.udot), alone) for x in closing}
        ending = dict.fromkeys(self.bounces.collapsing(facts.t, len(facts.laws.unilateral)), 0.0)
        return ending | {name: time for name, time in left.items() if time is not None}


def decided(
    facts: Facts, closed: Collection[str], before: Before | None = None, *, beyond: Collection[str] = ()
) -> Decided:
    """Return how a run goes on from an instant at which the unilateral elements named `closed` touch.

    Others that touch there count as well, but for those that have got `beyond` an edge, however near they still are.
    Several events at once are one. `before` is None at the start.
    """
    touching = [name for name in _touching(facts, closed) if name not in beyond]
    facts = _moved(facts, q=_onto_rows(facts, touching))
    closing = _closing(facts, touching)
    late = before.late(facts, closing, touching) if before is not None else {}
    blow = struck(facts, touching, late) if closing else None
    if blow is not None:
        facts = _moved(facts, u=facts.u + blow.jump)
        touching = [x.name for x in _named(facts, touching) if not _leaves(facts, x, before if late else None)]
    facts = _moved(facts, u=_at_rest(facts, touching))
    problem = posed(facts, touching)
    found = _found(problem, None if before is None else before.guess or before.mode)
    state = found.states[0] if found.states else None
    mode = None if state is None else basic_mode(problem, state)
    limit = mode is None or before is None or mode == before.mode or _between(facts, mode, before.mode)
    if before is not None and blow is None and limit:
        state, mode = _ahead(facts, touching, before, state, mode)
    return Decided(facts, mode, state, found, problem, blow, late)


def _leaves(facts: Facts, element: OneWay, before: Before | None) -> bool:
    """Return whether an element leaves after an impact; not where others rest, `before`, if it hardly gets off."""
    low = before is not None and low_bounce(facts, element, facts.falling(element, before.udot), facts.rate(element))
    return facts.standing(element) == "leaving" and not low


def _between(facts: Facts, mode: Mode, before: Mode) -> bool:
    """Tell whether a reaction that pressed on one side presses on none: it is about to press on the other.

    Components of a vector whose length presses have no sides.
    """
    two_sided = [x for x in facts.laws.mechanism.one_way if not x.unilateral]
    sided = [(x, x.normals[k]) for x in two_sided for part in x.frictions if not part.norm for k in part.normals]
    names = [row.name if len(x.normals) > 1 else x.name for x, row in sided]
    return any(before.sides.get(name, INACTIVE) and not mode.sides.get(name, INACTIVE) for name in names)


def _moved(facts: Facts, *, q: Floats | None = None, u: Floats | None = None) -> Facts:
    """Return what holds at other coordinates or speeds; the same where they are None."""
    if q is None and u is None:
        return facts
    there = facts.q if q is None else q, facts.u if u is None else u
    return facts.laws.at(facts.t, *there, facts.scale)


def _found(problem: PosedLaws, previous: Mode | None) -> Found:
    """Return the states that are possible: all at the start of a run, later the one next to its mode."""
    from multibody_sym.dynamics.laws.search import find  # brings scipy, which a run without laws does not need

    return find(problem.problem, None if previous is None else problem.law_mode(previous), every=previous is None)


def _ahead(
    facts: Facts, touching: Collection[str], before: Before, state: LawState | None, mode: Mode | None
) -> tuple[LawState | None, Mode | None]:
    """Return the state, with its mode, in which a run goes on that is at the limit of its mode: that found soon after.

    It is the same where nothing else is found; on the way there the forces of the mode go on to change.
    """
    mechanism = facts.laws.mechanism
    rates = np.array(coordinate_rates(mechanism, facts.q.tolist(), facts.u.tolist()), dtype=float)
    for soon in (part * facts.scale.length / facts.scale.speed for part in _SOON):
        later = facts.laws.at(facts.t + soon, facts.q + soon * rates, facts.u + soon * before.udot, facts.scale)
        there = posed(later, touching)
        found = _found(there, before.mode).states
        following = basic_mode(there, found[0]) if found else mode
        if following != mode:
            return found[0], following
    return state, mode


def _touching(facts: Facts, closed: Collection[str]) -> list[str]:
    """Return the unilateral elements that touch: those named, unless they leave, and those that stand so."""
    found = []
    for element in facts.laws.mechanism.one_way:
        if element.unilateral:
            standing = facts.standing(element)
            if standing in ("touching", "closing") or (element.name in closed and standing != "leaving"):
                found.append(element.name)
    return found


def _named(facts: Facts, names: Collection[str]) -> list[OneWay]:
    return [element for element in facts.laws.mechanism.one_way if element.name in names]


def _closing(facts: Facts, touching: Collection[str]) -> list[OneWay]:
    """Return what closes with a speed."""
    return [x for x in _named(facts, touching) if facts.rate(x) < -facts.allowed_speed(x.normals[0])]


# --- moves ------------------------------------------------------------------------------------------------------------


def _least(matrix: Floats, wanted: Floats) -> Floats:
    """Return the x of least norm with matrix x = wanted, as far as dependent rows allow."""
    return least_squares(matrix, wanted, SWITCHED)


def _kept(facts: Facts, touching: Collection[str]) -> list[int]:
    """Return the places of the rows that hold: constraints and the normals of what touches."""
    mechanism = facts.laws.mechanism
    return [facts.place(row) for row in (*mechanism.rows, *(x.normals[0] for x in _named(facts, touching)))]


def _onto_rows(facts: Facts, touching: Collection[str]) -> Floats | None:
    """Return the coordinates put onto closed gaps, taut ropes and constraints; None if they are there."""
    places = _kept(facts, touching)
    phi = facts.known["phi"][places]
    if not np.abs(phi).max(initial=0.0) > _ROUNDING * facts.scale.length:
        return None
    there = np.flatnonzero(phi)
    change = facts.speeds(_least(facts.known["matrix"][places][there], -phi[there])).tolist()
    moved: Floats = facts.q + np.array(coordinate_rates(facts.laws.mechanism, facts.q.tolist(), change), dtype=float)
    return moved


def _at_rest(facts: Facts, touching: Collection[str]) -> Floats | None:
    """Return the speeds with what touches and does not slide at rest in its rows to the last bit; None if it is."""
    problem = posed(facts, touching)
    places = _kept(facts, touching)
    laws = zip(problem.parts, problem.problem.parts, strict=True)
    places += [facts.place(row) for part, law in laws if law.rests for row in part.rows]
    speeds = facts.known["phidot"][places]
    if not np.abs(speeds).max(initial=0.0) > _ROUNDING * facts.scale.speed:
        return None
    sizes = facts.laws.slides * facts.scale.speed + (1.0 - facts.laws.slides) * facts.scale.turning
    for independent in _COARSER:
        change = facts.speeds(least_squares(facts.known["matrix"][places], -speeds, independent))
        if (np.abs(change) <= _SLIGHT * sizes).all():
            return facts.u + change
    return None
