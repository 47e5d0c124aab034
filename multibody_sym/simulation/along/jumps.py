"""The general theorems through impacts: what the impulses of all rows make of momenta and energy.

    P+ - P- = sum of impulses,    L+ - L- = sum of their moments,    T+ - T- = b du - what was lost - sum z_k dphi_k/dt

The right sides come from the impulses z of the rows that struck: M du = C^T z gives the speeds that they lead to, by
composite bodies, where the run went on from those of its law solver in weighted coordinates. What moves as prescribed
does work too: with b = dT/du at u = 0, the momenta that it gives, and the rates dphi/dt that it gives the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.programs.momenta import angular_momentum, body_momenta, generalized_momenta
from multibody_sym.dynamics.programs.quantities import quantities
from multibody_sym.kinematics.energy import kinetic_energy
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.every_mode import every_row
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import ROUNDED, least_squares
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node

if TYPE_CHECKING:
    from multibody_sym.simulation.one_way.impact import ImpactOutcome


@dataclass(frozen=True, eq=False)
class Passed:
    """An impact at time t, of P, L about the origin and T (7): how they `changed`, and how they should have.

    `expected` follows from the impulses, `size` is the sum of absolute terms before, after and of what changed them.
    """

    t: float
    changed: Floats
    expected: Floats
    size: Floats


def passed(mechanism: Mechanism, blow: ImpactOutcome) -> Passed:
    """Return both sides of the theorems at an impact."""
    struck = tuple(row for row in every_row(mechanism) if blow.rows.get(row.name))
    before = _motion(replace(mechanism, rows=struck), blow, blow.u)
    rows, z = row_motions(before), [blow.rows[row.name] for row in struck]
    forces = np.array([row.forces for row in rows], dtype=float).reshape(len(rows), len(blow.u))
    led = blow.u + least_squares(np.array(mass_matrix(before), dtype=float), forces.T @ np.array(z), ROUNDED)
    after, reached = (_motion(mechanism, blow, u) for u in (blow.u + blow.jump, led))
    (m0, size0), (m1, size1), (m2, _) = (_momenta(motion) for motion in (before, after, reached))
    T0, T1 = (float(kinetic_energy(motion)) for motion in (before, after))
    prescribed = generalized_momenta(_motion(mechanism, blow, np.zeros_like(blow.u)))
    given = [float(b * du) for b, du in zip(prescribed, blow.jump.tolist(), strict=True)]
    given += [-x * _driven(row, blow.u) for x, row in zip(z, rows, strict=True)]
    lost = sum(blow.lost.values())
    energy = T0 + T1 + abs(lost) + sum(map(abs, given))
    return Passed(
        blow.t,
        np.array([*(m1 - m0), T1 - T0]),
        np.array([*(m2 - m0), sum(given) - lost]),
        np.array([*(size0 + size1), energy]),
    )


def added(mechanism: Mechanism, blow: ImpactOutcome, leaves: Sequence[Node]) -> Floats:
    """Return what an impact adds to work and impulses (leaves).

    Forces are linear in accelerations and multipliers: du and the impulses in their place give impulses, and work at
    the mean of the speeds before and after (Thomson and Tait). Of several impacts in turn, each element has lost what
    the laws tell; the mean of all speeds shares the same sum otherwise.
    """
    whole = replace(mechanism, rows=every_row(mechanism))
    mean = _motion(whole, blow, blow.u + blow.jump / 2.0)
    z = [blow.rows.get(row.name, 0.0) for row in whole.rows]
    struck = quantities(mean, blow.jump.tolist(), z, leaves)
    beside = quantities(mean, [0.0] * len(blow.u), [0.0] * len(z), leaves)
    mended = _lost_in_turn(whole, mean, blow, z)
    work = [mended.get(leaf.data[1][0], 0.0) if leaf.data[0] == "work" else 0.0 for leaf in leaves]
    found: Floats = np.array([float(struck[leaf] - beside[leaf]) for leaf in leaves]) + np.array(work)
    return found


def _lost_in_turn(whole: Mechanism, mean: Motion, blow: ImpactOutcome, z: Sequence[float]) -> dict[str, float]:
    """Return by how much the work of what is declared, by name, differs from that at the mean of all speeds (J)."""
    rows = row_motions(mean)
    taken = {
        row.name: x * (float(np.array(own.forces, dtype=float) @ mean.state.u) + _driven(own, np.array(mean.state.u)))
        for row, own, x in zip(whole.rows, rows, z, strict=True)
        if x
    }
    found: dict[str, float] = {}
    for element in whole.one_way:
        if element.name in blow.lost:
            off = -blow.lost[element.name] - sum(taken.get(row.name, 0.0) for row in element.rows)
            found[element.path[1]] = found.get(element.path[1], 0.0) + off
    return found


def _motion(mechanism: Mechanism, blow: ImpactOutcome, u: Floats) -> Motion:
    given = blow.t, blow.q.tolist(), u.tolist(), blow.parameters.tolist()
    return motion_of(mechanism, state_of(mechanism, float, *given))


def _momenta(motion: Motion) -> tuple[Floats, Floats]:
    """Return P and L about the origin (6), and the sums of the lengths of their terms."""
    parts = body_momenta(motion)
    values = [[*part.momentum, *angular_momentum([part])] for part in parts]
    linear, spin, com = (
        np.linalg.norm(np.array([getattr(part, of) for part in parts], dtype=float).reshape(-1, 3), axis=1)
        for of in ("momentum", "spin", "com")
    )
    angular = spin + com * linear
    sizes = np.repeat([linear.sum(), angular.sum()], 3)
    return np.array(values, dtype=float).reshape(-1, 6).sum(axis=0), sizes


def _driven(row: RowMotion, u: Floats) -> float:
    """Return the rate of a row that time alone gives it; none of friction in joints, all whose work counts as lost."""
    if row.exerts is not None or not row.kinematic:
        return 0.0
    return float(row.phidot) - float(np.array(row.jacobian, dtype=float) @ u)
