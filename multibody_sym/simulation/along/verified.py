"""How well the general theorems hold along a run, in differential and in integral form.

In each state rates are compared with their causes; from the start of the run on the changes of momentum, angular
momentum and kinetic energy with the impulses of all forces and their work, those of impacts too. What is missed is told
beside the sum of absolute values of the terms, with the time. Each impact is looked at by itself as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.theorems.program import INTEGRAL, THEOREMS, theorems_program
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.simulation.along.fine import MOST_PIECES, FineLeg, integral, with_program
from multibody_sym.simulation.along.jumps import Passed

_FINER: Final = 4
"""How many times as fine a stretch is looked at where its integrals are not settled, twice at most."""
_SETTLED: Final = 1e-10
"""Relative change of integrals by half as many places up to which they are settled: Boole's rule is 64 times nearer."""


_MOST_HALVINGS: Final = 40
"""How often a run's stretches are halved in all, where places too far apart could make a miss."""


@dataclass(frozen=True)
class Miss:
    """By how much a theorem is missed at worst, relative to the sum of absolute terms, and at which time."""

    relative: float
    t: float


@dataclass
class _Since:
    """Values (7) at the start of a run, and what impulses and work have been since, with the sums of absolute terms."""

    start: Floats | None = None
    content: Floats = field(default_factory=lambda: np.zeros(7))
    total: Floats = field(default_factory=lambda: np.zeros(7))
    size: Floats = field(default_factory=lambda: np.zeros(7))
    halvings: int = 0


def verified(
    stretches: Sequence[FineLeg], backend: Backend | None = None, jumps: Iterable[Passed] = ()
) -> dict[str, Miss]:
    """Return the largest miss of each theorem along a run, by name: three at each instant, three as integrals.

    `jumps` are the impacts of the run in the order of time, which come before the stretches that begin then.
    """
    worst = {name: Miss(0.0, 0.0) for name in (*THEOREMS, *INTEGRAL.values())}
    for name, miss in _missed(stretches, iter(jumps), backend):
        if not miss.relative <= worst[name].relative:
            worst[name] = miss
    return worst


def _missed(
    stretches: Sequence[FineLeg], jumps: Iterator[Passed], backend: Backend | None
) -> Iterator[tuple[str, Miss]]:
    since, waiting = _Since(), next(jumps, None)
    for stretch, program in with_program(stretches, theorems_program, backend):
        while waiting is not None and waiting.t <= stretch.problem.start:
            yield from _of_jump(waiting, since)
            waiting = next(jumps, None)
        for part in stretch.smooth_parts():
            yield from _of_stretch(part, program, since)
    for jump in (waiting, *jumps):
        if jump is not None:
            yield from _of_jump(jump, since)


def _of_jump(jump: Passed, since: _Since) -> Iterator[tuple[str, Miss]]:
    if since.start is not None:
        since.total, since.size = since.total + jump.expected, since.size + jump.size
    for name, own in THEOREMS.items():
        missed = (jump.changed - jump.expected)[None, own]
        yield INTEGRAL[name], _worst(missed, jump.size[None, own], np.array([jump.t]))


def _of_stretch(stretch: FineLeg, program: Compiled, since: _Since) -> Iterator[tuple[str, Miss]]:
    finer = 1
    while True:
        fine = stretch.fine(finer * stretch.pieces)
        value, left, right, size, content = program.map("theorems", *fine.arguments, *fine.derivative[1:3])
        adding, scales = integral(right, fine.t), integral(size, fine.t)
        finest = finer >= _FINER**2 or len(fine.t) > 4 * MOST_PIECES
        if finest or _is_settled(right, scales[-1] + content[-1] + content[0], adding[-1], fine.t):
            break
        finer *= _FINER
    if since.start is None:
        since.start, since.content = value[0], content[0]
    ends = slice(None, None, 4)
    missed = value[ends] - since.start - (since.total + adding)
    whole = (since.size + scales + content[ends] + since.content)[_a_step_on(len(scales), stretch.steps)]
    if since.halvings < _MOST_HALVINGS and _is_doubtful(missed, whole, right, adding, fine.t):
        since.halvings += 1
        for half in stretch.halves():
            yield from _of_stretch(half, program, since)
        return
    for name, own in THEOREMS.items():
        yield name, _worst(left[:, own] - right[:, own], (size + content)[:, own], fine.t)
        yield INTEGRAL[name], _worst(missed[:, own], whole[:, own], fine.t[ends])
    since.total, since.size = since.total + adding[-1], since.size + scales[-1]


def _a_step_on(count: int, steps: int) -> npt.NDArray[np.intp]:
    """Return for each of evenly spaced times the number of that a mean step later, at most the last.

    Between the ends of a step samples are as near as it is long; what began at rest is next to nothing at first.
    """
    return np.minimum(np.arange(count) + math.ceil(count / max(steps, 1)), count - 1)


def _is_settled(values: Floats, size: Floats, found: Floats, t: Floats) -> bool:
    """Return whether half as many places give the same integrals (7), beside the terms' size."""
    count = 8 * ((len(t) - 1) // 8) + 1
    if count < len(t):
        return True  # a sample is missing at the end: there is nothing to compare with
    changed = np.abs(integral(values[::2], t[::2])[-1] - found)
    return bool(np.all(changed <= _SETTLED * size))


def _is_doubtful(missed: Floats, whole: Floats, values: Floats, found: Floats, t: Floats) -> bool:
    """Return whether the largest miss of an integral (7) may be one of its places: half as many change it by as much.

    What dies out soon after the start of a long stretch is not seen by integrals over all of it.
    """
    for own in THEOREMS.values():
        most, of = np.abs(missed[::2, own]).max(axis=1), whole[::2, own].max(axis=1)
        rates = np.divide(most, of, out=np.zeros(len(most)), where=of > 0.0)
        k = int(np.argmax(rates))
        changed = np.abs(integral(values[::2, own], t[::2])[: len(most)] - found[: 2 * len(most) : 2, own])
        if rates[k] > _SETTLED and k < len(changed) and changed[k].max() >= most[k]:
            return True
    return False


def _worst(missed: Floats, size: Floats, t: Floats) -> Miss:
    """Return the largest of |missed| (times, components) beside the largest component's size; 0/0 is 0."""
    most, of = np.abs(missed).max(axis=1), size.max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(most == 0.0, 0.0, most / of)
    k = int(np.argmax(np.where(np.isnan(relative), np.inf, relative)))
    return Miss(float(relative[k]), float(t[k]))
