"""How well the general theorems hold along a run, in differential and in integral form.

In each state rates are compared with their causes; from event to event the changes of momentum, angular momentum and
kinetic energy with the impulses of all forces and their work. What is missed is told beside the sum of absolute values
of the terms, with the time. Impacts, at events, are between the stretches.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from multibody_sym.analysis.theorems.program import INTEGRAL, THEOREMS, theorems_program
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.simulation.along.fine import Stretch, integral, lasting


@dataclass(frozen=True)
class Miss:
    """By how much a theorem is missed at worst, relative to the sum of absolute terms, and at which time."""

    relative: float
    t: float


def verified(stretches: Sequence[Stretch], backend: Backend | None = None) -> dict[str, Miss]:
    """Return the largest miss of each theorem along a run, by name: three at each instant, three as integrals."""
    worst = {name: Miss(0.0, 0.0) for name in (*THEOREMS, *INTEGRAL.values())}
    programs: dict[int, Compiled] = {}
    for stretch in lasting(stretches):
        key = id(stretch.mechanism)
        if key not in programs:
            made = {"theorems": theorems_program(stretch.mechanism)}
            programs[key] = load(made, backend=backend or stretch.compiled.likewise)
        for name, miss in _of_stretch(stretch, programs[key]):
            if not miss.relative <= worst[name].relative:
                worst[name] = miss
    return worst


def _of_stretch(stretch: Stretch, program: Compiled) -> Iterator[tuple[str, Miss]]:
    fine = stretch.fine()
    found = program.map("theorems", *fine.arguments, *fine.derivative[1:3])
    value, left, right, size, content = found
    adding, scales = integral(right, fine.t), integral(size, fine.t)
    ends = slice(None, None, 4)
    changed = value[ends] - value[0]
    for name, own in THEOREMS.items():
        yield name, _worst(left[:, own] - right[:, own], (size + content)[:, own], fine.t)
        scale = (scales + content[ends] + content[0])[:, own]
        yield INTEGRAL[name], _worst(changed[:, own] - adding[:, own], scale, fine.t[ends])


def _worst(missed: Floats, size: Floats, t: Floats) -> Miss:
    """Return the largest of |missed| (times, components) beside the largest component's size; 0/0 is 0."""
    most, of = np.abs(missed).max(axis=1), size.max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(most == 0.0, 0.0, most / of)
    k = int(np.argmax(np.where(np.isnan(relative), np.inf, relative)))
    return Miss(float(relative[k]), float(t[k]))
