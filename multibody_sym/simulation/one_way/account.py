"""What friction took in a run, at each part and from each body, and what loads gave: power, integrated by stretches."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.dynamics.programs.friction_power import friction_power_program
from multibody_sym.kinematics.energy import split
from multibody_sym.model.mechanism.every_mode import friction_parts
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import STICKS
from multibody_sym.model.mechanism.rows import VelocityRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Compiled
from multibody_sym.simulation.along.fine import PIECES, FineLeg, integral, with_program
from multibody_sym.simulation.one_way.impact import ImpactOutcome
from multibody_sym.simulation.runs.modes import EnergyAccount, FrictionWork

_SETTLED: Final = 1e-10
"""Part of the work in a run by which half as many places may change it: Boole's rule is 64 times nearer."""
_SHORT: Final = 1e-14
"""The part of a time of which nothing is left to divide."""
_FEW_STEPS: Final = 1000
"""Of a run that is looked at in steps as short as places are apart: several times as many."""
_FINER: Final = 4
"""How many times as near places are where they are too far apart."""
_MOST_ROUNDS: Final = 30
"""How often that may happen one inside the other."""
_MOST_PARTS: Final = 100_000
"""Parts that are looked at in nearer places, in all."""
_UNKNOWN: Final = 1e-3
"""Part of the work in a run by which half as many places change it where it is not told at all."""
_LAST: Final = 3e-3
"""Part of the work in a run at the very end of a stretch that energy tells: friction that jams grows without bound."""
_LITTLE: Final = 1e-7
"""Part of the kinetic energy that counts as work always: what sticks does work of rounding, and none else."""


Ends = Mapping[float, tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class _Work:
    """The work in parts (n) of a stretch: of friction (n, p), of it on each body (n, p, bodies), of loads (n, 1).

    `sizes` (n) are integrals of absolute powers, `unsure` (n) what half as many places change; `kinetic` is the largest
    energy. `begins` are the states (t, q, u) in which parts begin, with the `energies`, of as many as were `asked`;
    where no step leads near enough to the end, the last ones count as one, of which nothing is known but the powers
    `last` (friction, shares, loads) before it. `missed` is by how much another energy was reached when places were
    farther apart: a run may step over a blow.
    """

    stretch: FineLeg
    program: Compiled
    begins: tuple[Floats, Floats, Floats]
    energies: Floats
    asked: int
    friction: Floats
    shares: Floats
    loads: Floats
    sizes: Floats
    unsure: Floats
    kinetic: float
    missed: float
    last: tuple[Floats, Floats, Floats] | None

    @classmethod
    def of(cls, stretch: FineLeg, program: Compiled, asked: int, reaches: float | None = None) -> _Work:
        """Return the work in a stretch from at least that many parts of it."""
        fine = stretch.fine(2 * asked)
        powers, *others = program.map("friction_power", *fine.arguments, fine.derivative[2])[2:]
        values = np.where(_stick(stretch.mechanism), 0.0, powers), *others
        powers = np.column_stack([values[0], values[2]])
        kinetic, potential = fine.evaluated("energy")
        places = (len(fine.t) - 1) // 8
        whole, begins = slice(8 * places + 1), slice(None, 8 * places + 1, 8)
        t = fine.t[whole]
        friction, shares, loads = (_parts(value[whole], t) for value in values)
        sizes = _parts(np.abs(powers[whole]), t).sum(axis=1)
        fewer = np.diff(integral(powers[whole][::2], t[::2]), axis=0)
        unsure = np.abs(fewer - np.column_stack([friction, loads])).sum(axis=1)
        if places:
            asked = round(stretch.duration / (t[8] - t[0]))
        last = None
        if places < asked:
            last = values[0][8 * places], values[1][8 * places], values[2][8 * places]
            rest = stretch.until - t[-1]
            left = max(float(sizes.sum()), rest * float(np.abs(powers[8 * places]).sum()))
            left = left if rest > _SHORT * abs(stretch.until) else 0.0
            friction, shares, loads, sizes = (_with(x, 0.0) for x in (friction, shares, loads, sizes))
            unsure = _with(unsure, left)
        energies = (kinetic + potential)[begins]
        missed = 0.0 if reaches is None else abs(float(energies[-1]) - reaches)
        most = float(kinetic.max())
        states = fine.t[begins], fine.q[begins], fine.u[begins]
        found = friction, shares, loads, sizes, unsure
        return cls(stretch, program, states, energies, asked, *found, most, missed, last)

    def finer(self, limit: float) -> Iterator[_Work]:
        """Yield the work in what is sure up to a limit, and in the rest from parts that are shorter."""
        rough = self.unsure > limit
        if not rough.any():
            yield self
            return
        of_all = self.friction, self.shares, self.loads, self.sizes, self.unsure
        friction, shares, loads, sizes, unsure = (_without(values, rough) for values in of_all)
        last = None if rough[-1] else self.last
        yield replace(self, friction=friction, shares=shares, loads=loads, sizes=sizes, unsure=unsure, last=last)
        t, q, u = self.begins
        for first, end in np.flatnonzero(np.diff(np.concatenate([[0], rough, [0]]))).reshape(-1, 2).tolist():
            known = end < len(t)
            until, count = (float(t[end]), end - first) if known else (self.stretch.until, self.asked - first)
            part = replace(self.stretch.part(float(t[first]), until, q[first], u[first]), near=True)
            reached = float(self.energies[end]) if known else None
            for smooth in part.smooth_parts(2 * _FINER * count):
                asked = math.ceil(_FINER * count * smooth.duration / part.duration)
                yield _Work.of(smooth, self.program, asked, reached if smooth.until == until else None)


    def ended(self, size: float, ends: Ends) -> _Work:
        """Return the work of which a little, at the end of its stretch, is known by the energy in the state there."""
        until, begin = self.stretch.until, float(self.begins[0][-1])
        if self.last is None or until not in ends or not 0.0 < self.unsure[-1] <= _LAST * size:
            return self
        friction, shares, loads = self.last
        state = np.array([until]), *(x[None] for x in ends[until])
        kinetic, potential = self.stretch.sampled(*state).evaluated("energy")
        given = (until - begin) * loads
        taken = float(kinetic[0] + potential[0] - self.energies[-1]) - float(given.sum())
        if abs(taken) > _LAST * size:  # more than friction takes there: something struck
            return self
        part = taken / (float(friction.sum()) or 1.0)
        added = (part * friction, part * shares, given, part * np.abs(friction).sum() + np.abs(given).sum(), 0.0)
        of_all = (self.friction, self.shares, self.loads, self.sizes, self.unsure)
        found = (np.concatenate([x[:-1], np.asarray(y)[None]]) for x, y in zip(of_all, added, strict=True))
        friction, shares, loads, sizes, unsure = found
        return replace(self, friction=friction, shares=shares, loads=loads, sizes=sizes, unsure=unsure, last=None)


def _parts(values: Floats, t: Floats) -> Floats:
    """Return the integrals (n, ...) of values (8 n + 1, ...) over each eight of the times."""
    return np.diff(integral(values, t)[::2], axis=0)


def _with(values: Floats, last: float) -> Floats:
    return np.concatenate([values, np.full((1, *values.shape[1:]), last)])


def _without(values: Floats, places: npt.NDArray[np.bool_]) -> Floats:
    values = values.copy()
    values[places] = 0.0
    return values


def energy_account(
    stretches: Sequence[FineLeg], mechanism: Mechanism, blows: Sequence[ImpactOutcome] = ()
) -> EnergyAccount:
    """Return the work of the friction and of the loads of a run with these blows.

    It is nan where powers change faster than places tell.
    """
    parts = friction_parts(mechanism)
    names = [body.name for body in mechanism.bodies]
    found = {part.name: FrictionWork() for _, part in parts}
    told = [any(not isinstance(row, VelocityRow) for row in part.rows) for _, part in parts]
    account = EnergyAccount(found)
    works = _works(stretches, _ends(stretches, blows))
    if _unsure(works) + sum(one.missed for one in works) > _UNKNOWN * _size(works):
        return EnergyAccount({part.name: FrictionWork(math.nan) for _, part in parts}, math.nan)
    for one in works:
        account.loads += float(one.loads.sum())
        shares = one.shares.sum(axis=0)
        for k, (_, part) in enumerate(parts):
            work = found[part.name]
            work.total += float(one.friction[:, k].sum())
            for body, share in zip(names, shares[k].tolist(), strict=True):
                if told[k] and (share != 0.0 or body in work.bodies):
                    work.bodies[body] = work.bodies.get(body, 0.0) + share
    return account


def _ends(stretches: Sequence[FineLeg], blows: Sequence[ImpactOutcome]) -> Ends:
    """Return the states in which stretches end, before what strikes then or, by rounding, sooner."""
    ends = {stretch.until: (after.problem.q0, after.problem.u0) for stretch, after in pairwise(stretches)}
    untils = [stretch.until for stretch in stretches]
    for blow in reversed(blows):
        place = bisect_left(untils, blow.t)
        if place < len(stretches) and stretches[place].problem.start < blow.t:
            ends[untils[place]] = blow.q, blow.u
    return ends


def _size(works: Sequence[_Work]) -> float:
    """Return the size (J) beside which work that is unsure counts."""
    return float(sum(one.sizes.sum() for one in works)) + _LITTLE * max((one.kinetic for one in works), default=0.0)


def _unsure(works: Sequence[_Work]) -> float:
    return float(sum(one.unsure.sum() for one in works))


def _works(stretches: Sequence[FineLeg], ends: Ends) -> list[_Work]:
    """Return the work in stretches and parts of them.

    Where places are too far apart there are nearer ones: friction that jams grows without bound at the very end of a
    stretch, and a power jumps at kinks and where points meet. `ends` are the states at the ends of stretches.
    """
    working = [stretch for stretch in stretches if _may_work(stretch.mechanism)]
    few = sum(stretch.steps for stretch in working) <= _FEW_STEPS
    looked_at = [replace(stretch, near=few, per_step=PIECES if few else 2) for stretch in working]
    works = [_Work.of(x, program, x.pieces // 2) for x, program in with_program(looked_at, friction_power_program)]
    left = _MOST_PARTS
    for _ in range(_MOST_ROUNDS):
        size = _size(works)
        works = [one.ended(size, ends) for one in works]
        settled = _SETTLED * _size(works)
        if _unsure(works) <= settled:
            break
        changes = np.sort(np.concatenate([one.unsure for one in works]))
        known = int(np.searchsorted(np.cumsum(changes), settled / 2))
        left -= _FINER * (len(changes) - known)
        if left < 0:
            break
        limit = float(changes[known - 1]) if known else 0.0
        works = [part for work in works for part in work.finer(limit)]
    return works


def _stick(mechanism: Mechanism) -> list[bool]:
    """Tell of each friction part whether it sticks in a mode: its power is of rounding, which no places resolve."""
    assert mechanism.mode is not None
    return [mechanism.mode.slips.get(part.name) == STICKS for _, part in friction_parts(mechanism)]


def _may_work(mechanism: Mechanism) -> bool:
    """Tell whether friction or loads may do work in a mode: not where nothing slides and nothing moves."""
    assert mechanism.mode is not None
    slides = any(slip != STICKS for slip in mechanism.mode.slips.values())
    moves = slides or len(mechanism.held) < len(mechanism.speeds)
    return moves and bool(friction_parts(mechanism) or split(mechanism.loads)[1])
