"""The Program of what friction does in a mode: forces, and power on all and on each body; and the power of loads.

The normal force N, the force l_t along each of the rows, its power l_t v_t, and that on each body alone: on two blocks
that stick together these are opposite. Loads: those whose work the potential energy does not hold.
"""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.dynamics.programs.switching import SwitchingValues
from multibody_sym.kinematics.energy import split
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.masses.rates import carried_by_flows
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.every_mode import friction_parts
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import ZERO, Node, as_node
from multibody_sym.scalars.vectors import S, dot


def friction_power_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, ..., multipliers (ns)) -> normal (parts), force (parts, 2), power (parts), share, loads.

    `share` is (parts, bodies), `loads` the one power of what the potential energy does not hold. For all friction parts
    of a mechanism in a mode, those of `friction_parts`; zero where one does not act.
    """
    trace = Trace("friction_power", (*arrays(mechanism), Array("multipliers", (len(mechanism.rows),))))
    values = SwitchingValues(motion_of(mechanism, slot_state(mechanism)), trace["multipliers"])
    found = [_of_part(values, element, part) for element, part in friction_parts(mechanism)]
    count, bodies = len(found), len(mechanism.bodies)

    def flat(rows: Sequence[Sequence[S]]) -> list[Node]:
        return [as_node(x) for row in rows for x in row]

    return trace.finish(
        {
            "normal": ((count,), [as_node(N) for N, *_ in found]),
            "force": ((count, 2), flat([(*forces, ZERO)[:2] for _, forces, _, _ in found])),
            "power": ((count,), [as_node(power) for _, _, power, _ in found]),
            "share": ((count, bodies), flat([share for *_, share in found])),
            "loads": ((1,), [as_node(_of_loads(values.motion))]),
        }
    )


def _of_part(values: SwitchingValues, element: OneWay, part: FrictionPart) -> tuple[S, Sequence[S], S, Sequence[S]]:
    """Return N, the forces along the rows, the power and that on each body."""
    forces, rows = values.friction(part), [values.row(row) for row in part.rows]
    return values.pressing(element, part), forces, _power(forces, rows), _shares(values.motion, forces, rows)


def _power(forces: Sequence[S], rows: Sequence[RowMotion]) -> S:
    return sum((force * row.phidot for force, row in zip(forces, rows, strict=True)), start=ZERO)


def _of_loads(motion: Motion) -> S:
    """Return the power of the loads that do work instead of storing energy, that of masses that come and go too."""
    loads = split(motion.mechanism.loads)[1]
    forces = applied_generalized_forces(motion, applied(motion, loads, weight=False))
    gained = as_node(carried_by_flows(motion, loads))
    return sum((force * speed for force, speed in zip(forces, motion.state.u, strict=True)), start=gained)


def _shares(motion: Motion, forces: Sequence[S], rows: Sequence[RowMotion]) -> list[S]:
    """Return the power on each body."""
    found: list[S] = [ZERO] * len(motion.bodies)
    for force, row in zip(forces, rows, strict=True):
        for k, ((f, m), body) in enumerate(zip(row.of_body, motion.bodies, strict=True)):
            found[k] = found[k] + force * (dot(f, body.v_WB) + dot(m, body.w_WB))
    return found
