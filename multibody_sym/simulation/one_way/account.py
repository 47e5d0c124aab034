"""What friction took in a run, at each part and from each body, and what loads gave: power, integrated by stretches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.programs.friction_power import friction_power_program
from multibody_sym.dynamics.programs.law_rows import friction_parts
from multibody_sym.kinematics.energy import split
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import STICKS
from multibody_sym.model.mechanism.rows import VelocityRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.chain import Leg
from multibody_sym.runtime.integration import integrate
from multibody_sym.runtime.loading import load
from multibody_sym.simulation.one_way.modes import ModeProgram
from multibody_sym.simulation.parts import Part

_NEVER: Final = 1e300
"""A margin that no switching function exceeds."""
_LEAST: Final = 8
_BOOLE: Final = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
"""Weights of Boole's rule on five equal places."""


@dataclass
class FrictionWork:
    """The work of one friction part in J: on all bodies together, negative, and on each that it acts on, by name.

    Of friction in a joint only the first is known: its force is the joint's own.
    """

    total: float = 0.0
    bodies: dict[str, float] = field(default_factory=dict)


@dataclass
class EnergyAccount:
    """The work of each friction part by name, and that of the loads that the potential energy does not hold, in J."""

    friction: dict[str, FrictionWork]
    loads: float = 0.0


def energy_account(stretches: Sequence[tuple[ModeProgram, Leg]], mechanism: Mechanism) -> EnergyAccount:
    """Return the work of the friction and of the loads of a run."""
    parts = friction_parts(mechanism)
    names = [body.name for body in mechanism.bodies]
    found = {part.name: FrictionWork() for _, part in parts}
    told = [any(not isinstance(row, VelocityRow) for row in part.rows) for _, part in parts]
    account = EnergyAccount(found)
    for stretch in _worked(stretches):
        account.loads += float(stretch["loads"][0])
        for k, (_, part) in enumerate(parts):
            work = found[part.name]
            work.total += float(stretch["power"][k])
            for body, share in zip(names, stretch["share"][k].tolist(), strict=True):
                if told[k] and (share != 0.0 or body in work.bodies):
                    work.bodies[body] = work.bodies.get(body, 0.0) + share
    return account


def _worked(stretches: Sequence[tuple[ModeProgram, Leg]]) -> Iterator[Mapping[str, Floats]]:
    """Yield the integrals of power, share and the loads' power over each stretch in which something may do work."""
    for program, leg in stretches:
        duration = leg.until - leg.problem.start
        works = friction_parts(program.mechanism) or split(program.mechanism.loads)[1]
        if duration > 0.0 and works and not _still(program):
            yield _integrals(program, leg, duration)


def _still(program: ModeProgram) -> bool:
    """Tell whether nothing slides and nothing moves."""
    mode = program.mechanism.mode
    assert mode is not None
    slides = any(slip != STICKS for slip in mode.slips.values())
    return not slides and len(program.mechanism.held) == len(program.mechanism.speeds)


def _integrals(program: ModeProgram, leg: Leg, duration: float) -> Mapping[str, Floats]:
    """Return the integrals over a stretch, which is run once more with places in every step."""
    problem, pieces = leg.problem, max(_LEAST, 2 * leg.steps)
    again = replace(
        problem,
        t0=problem.start,
        t_end=leg.until,
        begun=None,
        samples=4 * pieces + 1,
        margins=(_NEVER,) * len(problem.margins),
        limiting=0,
    )
    run = integrate(again)
    part = Part(program.mechanism, program.compiled, problem.parameters, run.t, run.q, run.u)
    rubbing = load({"friction_power": friction_power_program(program.mechanism)}, backend=program.compiled.likewise)
    values = rubbing.map("friction_power", *part.arguments, part.derivative[2])
    pieces = (len(run.t) - 1) // 4
    named = zip(("power", "share", "loads"), values[2:], strict=True)
    return {name: _integral(value, pieces, duration) for name, value in named}


def _integral(values: Floats, pieces: int, duration: float) -> Floats:
    """Return the integral of values (4 pieces + 1, ...) over evenly spaced times."""
    first = np.stack([values[k : 4 * pieces + k : 4] for k in range(4)] + [values[4 : 4 * pieces + 1 : 4]])
    total: Floats = np.tensordot(_BOOLE, first, axes=1).sum(axis=0) * (duration / pieces)
    return total
