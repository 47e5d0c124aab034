"""What friction took in a run, at each part and from each body, and what loads gave: power, integrated by stretches."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.dynamics.programs.friction_power import friction_power_program
from multibody_sym.kinematics.energy import split
from multibody_sym.model.mechanism.every_mode import friction_parts
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import STICKS
from multibody_sym.model.mechanism.rows import VelocityRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Compiled
from multibody_sym.simulation.along.fine import Stretch, integral, with_program
from multibody_sym.simulation.runs.modes import EnergyAccount, FrictionWork

_SETTLED: Final = 1e-9
"""Part of the work in a run by which half as many places may change it: Boole's rule is 64 times nearer."""
_SHORT: Final = 1e-14
"""The part of a time of which nothing is left to halve."""
_MOST_CUTS: Final = 60
"""How often stretches are parted in all where places are too far apart."""
_MOSTLY: Final = 0.5
"""Part of what half as many places change that stands in one piece, where a power jumps there."""
_UNKNOWN: Final = 1e-3
"""Part of the work in a run by which half as many places change it where it is not told at all."""
_LITTLE: Final = 1e-7
"""Part of the kinetic energy that counts as work always: what sticks does work of rounding, and none else."""
_MOST_STEPS: Final = 100_000
"""Steps of all the stretches that are parted: each is run twice more for that."""


@dataclass(frozen=True)
class _Work:
    """The work in a stretch: of friction parts (p), of these on each body (p, bodies), of loads (1).

    `size` is the integral of absolute powers, `unsure` what half as many places change, `kinetic` the largest energy.
    `cuts` are the times at which the stretch is parted to be surer.
    """

    friction: Floats
    shares: Floats
    loads: Floats
    size: float
    unsure: float
    kinetic: float
    cuts: tuple[float, ...]


def energy_account(stretches: Sequence[Stretch], mechanism: Mechanism) -> EnergyAccount:
    """Return the work of the friction and of the loads of a run; nan where powers change faster than places tell."""
    parts = friction_parts(mechanism)
    names = [body.name for body in mechanism.bodies]
    found = {part.name: FrictionWork() for _, part in parts}
    told = [any(not isinstance(row, VelocityRow) for row in part.rows) for _, part in parts]
    account = EnergyAccount(found)
    works = list(_works(stretches))
    if sum(one.unsure for one in works) > _UNKNOWN * _size(works):
        return EnergyAccount({part.name: FrictionWork(math.nan) for _, part in parts}, math.nan)
    for one in works:
        account.loads += float(one.loads[0])
        for k, (_, part) in enumerate(parts):
            work = found[part.name]
            work.total += float(one.friction[k])
            for body, share in zip(names, one.shares[k].tolist(), strict=True):
                if told[k] and (share != 0.0 or body in work.bodies):
                    work.bodies[body] = work.bodies.get(body, 0.0) + share
    return account


def _size(works: Sequence[_Work]) -> float:
    """Return the size (J) beside which work that is unsure counts."""
    return sum(one.size for one in works) + _LITTLE * max((one.kinetic for one in works), default=0.0)


def _works(stretches: Sequence[Stretch]) -> Iterator[_Work]:
    """Yield the work in each stretch, or in parts of it: friction that jams grows without bound at its very end.

    What is least sure is parted first, in the middle. Where a power jumps, as between points that meet, it is cut out.
    """
    working = [stretch for stretch in stretches if _may_work(stretch.mechanism)]
    each = [(x, program, _work(x, program)) for x, program in with_program(working, friction_power_program)]
    total, left, steps = _size([work for *_, work in each]), _MOST_CUTS, _MOST_STEPS
    while each and left:
        place = max(range(len(each)), key=lambda k: each[k][2].unsure)
        stretch, program, work = each[place]
        if work.unsure <= _SETTLED * total or stretch.steps > steps:
            break
        left, steps = left - 1, steps - stretch.steps
        parts = [(part, program, _work(part, program)) for part in stretch.cut(*work.cuts)]
        total += sum(part.size for *_, part in parts) - work.size
        each[place : place + 1] = parts
    yield from (work for *_, work in each)


def _work(stretch: Stretch, program: Compiled) -> _Work:
    fine = stretch.fine()
    values = program.map("friction_power", *fine.arguments, fine.derivative[2])[2:]
    friction, shares, loads = (integral(value, fine.t)[-1] for value in values)
    powers = np.column_stack([values[0], values[2]])
    size = float(integral(np.abs(powers), fine.t)[-1].sum())
    kinetic = float(fine.evaluated("energy")[0].max())
    if (len(fine.t) - 1) % 8:  # samples are missing at the end, before which no step leads near enough
        unsure = size if stretch.duration > _SHORT * abs(stretch.until) else 0.0
        return _Work(friction, shares, loads, size, unsure, kinetic, (stretch.middle,))
    fewer = integral(powers[::2], fine.t[::2])
    unsure = float(np.abs(fewer[-1] - np.append(friction, loads)).sum())
    changes = np.abs(np.diff(integral(powers, fine.t)[::2] - fewer, axis=0)).sum(axis=1)
    return _Work(friction, shares, loads, size, unsure, kinetic, _cuts(changes, fine.t[::8]) or (stretch.middle,))


def _cuts(changes: Floats, ends: Floats) -> tuple[float, ...]:
    """Return both ends of the piece with most of the changes (n), by the `ends` (n + 1) of all pieces.

    None of a piece at an end of the stretch, where a power may grow without bound, nor where no piece has most.
    """
    worst = int(changes.argmax()) if len(changes) else 0
    jumps = 0 < worst < len(changes) - 1 and changes[worst] > _MOSTLY * changes.sum()
    return (float(ends[worst]), float(ends[worst + 1])) if jumps else ()


def _may_work(mechanism: Mechanism) -> bool:
    """Tell whether friction or loads may do work in a mode: not where nothing slides and nothing moves."""
    assert mechanism.mode is not None
    slides = any(slip != STICKS for slip in mechanism.mode.slips.values())
    moves = slides or len(mechanism.held) < len(mechanism.speeds)
    return moves and bool(friction_parts(mechanism) or split(mechanism.loads)[1])
