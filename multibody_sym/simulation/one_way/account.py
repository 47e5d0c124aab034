"""What friction took in a run, at each part and from each body, and what loads gave: power, integrated by stretches."""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.dynamics.programs.friction_power import friction_power_program
from multibody_sym.dynamics.programs.law_rows import friction_parts
from multibody_sym.kinematics.energy import split
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import STICKS
from multibody_sym.model.mechanism.rows import VelocityRow
from multibody_sym.simulation.along.fine import Stretch, integral, with_program
from multibody_sym.simulation.runs.modes import EnergyAccount, FrictionWork


def energy_account(stretches: Sequence[Stretch], mechanism: Mechanism) -> EnergyAccount:
    """Return the work of the friction and of the loads of a run."""
    parts = friction_parts(mechanism)
    names = [body.name for body in mechanism.bodies]
    found = {part.name: FrictionWork() for _, part in parts}
    told = [any(not isinstance(row, VelocityRow) for row in part.rows) for _, part in parts]
    account = EnergyAccount(found)
    working = [stretch for stretch in stretches if _works(stretch.mechanism)]
    for stretch, program in with_program(working, friction_power_program):
        fine = stretch.fine()
        values = program.map("friction_power", *fine.arguments, fine.derivative[2])[2:]
        power, shares, loads = (integral(value, fine.t)[-1] for value in values)
        account.loads += float(loads[0])
        for k, (_, part) in enumerate(parts):
            work = found[part.name]
            work.total += float(power[k])
            for body, share in zip(names, shares[k].tolist(), strict=True):
                if told[k] and (share != 0.0 or body in work.bodies):
                    work.bodies[body] = work.bodies.get(body, 0.0) + share
    return account


def _works(mechanism: Mechanism) -> bool:
    """Tell whether friction or loads may do work in a mode: not where nothing slides and nothing moves."""
    assert mechanism.mode is not None
    slides = any(slip != STICKS for slip in mechanism.mode.slips.values())
    moves = slides or len(mechanism.held) < len(mechanism.speeds)
    return moves and bool(friction_parts(mechanism) or split(mechanism.loads)[1])
