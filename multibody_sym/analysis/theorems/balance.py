"""General theorems as self-checks at a state: power, momentum, angular momentum.

    dT/dt + dV/dt = power of the forces outside V, of the rows and of prescribed motion
    d/dt sum m v_C = resultant of the external forces, the ground's reactions included
    d/dt sum (r_C x m v_C + J omega) = their resultant moment about the origin

The left sides are exact derivatives of T, V and the momenta; the right sides come from forces and reactions.
Source: Wittenburg, Dynamics of Multibody Systems, chapter 3.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.forward_dynamics import Accelerations
from multibody_sym.dynamics.formalisms.inverse_dynamics import joint_wrenches
from multibody_sym.dynamics.programs.reactions import acting
from multibody_sym.kinematics.energy import kinetic_energy, potential_energy, split
from multibody_sym.kinematics.joint_forces import along_reactions
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.masses.rates import carried_by_flows, carried_momentum
from multibody_sym.kinematics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State, slot_state
from multibody_sym.kinematics.wrenches import Wrench, generalized_forces
from multibody_sym.model.mechanism.loads import Load, MassFlow
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative, gradient, tangents
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, Node, as_node, slot
from multibody_sym.scalars.vectors import Vec, add, apply, cross, dot, scale

NEGLIGIBLE: Final = 1e-9
"""Rates below this part of the sum of what could cause them are rounding."""
_LOADS_TIME: Final = slot("t", 1)


@dataclass(frozen=True)
class Rates:
    """Energies and momenta along any motion, over Nodes in slots and `udot`.

    `kinetic` and `potential`: the terms of dT/dt and of dV/dt, one for each coordinate, each speed and prescribed
    motion; `given` dV/dt from springs that change in time; for each body, in world axes, `momenta` (momentum, angular
    momentum about the origin) and `changes`, their time derivatives.
    """

    kinetic: list[Node]
    potential: list[Node]
    given: Node
    momenta: list[Node]
    changes: list[Node]


def rates_of(mechanism: Mechanism) -> Rates:
    """Return the energies' and momenta's derivatives of a mechanism."""
    motion = motion_of(mechanism, slot_state(mechanism))
    stored = tuple(_timed(load) for load in split(mechanism.loads)[0])
    changing = replace(motion.state, slots={**motion.state.slots, _LOADS_TIME: _LOADS_TIME})
    T = as_node(kinetic_energy(motion))
    V = as_node(potential_energy(replace(motion, state=changing, mechanism=replace(mechanism, loads=stored))))
    qdot = [as_node(rate) for rate in coordinate_rates(mechanism, motion.state.q, motion.state.u)]
    udot = [slot("udot", k) for k in range(len(mechanism.speeds))]
    leaves, rates = [*motion.state.q, *motion.state.u, TIME], [*qdot, *udot, ONE]
    momenta = [as_node(x) for index in range(len(motion.bodies)) for v in _momenta(motion, index) for x in v]
    along = dict(zip(leaves, rates, strict=True))
    return Rates(
        [g * rate for g, rate in zip(gradient(T, leaves), rates, strict=True)],
        [g * rate for g, rate in zip(gradient(V, leaves), rates, strict=True)],
        derivative(V, _LOADS_TIME),
        momenta,
        tangents(momenta, along),
    )


def _timed(load: Load) -> Load:
    """Return a load whose expressions call the time by a name of their own, which the kinematics does not know."""
    nodes = {name: x for name, x in vars(load).items() if isinstance(x, Node)}
    changed = evaluate(nodes.values(), lambda leaf: _LOADS_TIME if leaf is TIME else leaf)
    return replace(load, **dict(zip(nodes, changed, strict=True)))


def _momenta(motion: Motion, index: int) -> tuple[Vec, Vec]:
    """Return a body's momentum and its angular momentum about the origin, in world axes."""
    moved, mass, (R, p) = motion.bodies[index], motion.masses[index], motion.poses[index]
    momentum = apply(R, scale(mass.mass, add(moved.v_WB, cross(moved.w_WB, mass.com))))
    spin = apply(R, apply(mass.inertia, moved.w_WB))
    return momentum, add(spin, cross(add(p, apply(R, mass.com)), momentum))


@dataclass(frozen=True)
class Instant:
    """Both sides of the theorems at a state, term by term.

    `kinetic` T; `energy` the terms of dT/dt + dV/dt but `given`, which is dV/dt from springs that change in time;
    `powers` those of the loads outside V, of the rows and of prescribed motion. First momentum, then angular momentum:
    `momenta` and `changes` (2 x bodies x 3), and what acts from outside, besides pairs that cancel: `causes`
    (2 x terms x 3); `levers` are bounds of |r| |F| in moments r x F, and of |v| |p| in r' x p, in which components
    cancel (terms x 3).
    """

    kinetic: float
    energy: Floats
    given: float
    powers: Floats
    momenta: Floats
    changes: Floats
    causes: Floats
    levers: Floats


def instant_of(mechanism: Mechanism, rates: Rates, state: State, found: Accelerations) -> Instant:
    """Return both sides of the theorems at a state over floats with its accelerations."""
    motion = motion_of(mechanism, state)
    slots = {**state.slots, **{slot("udot", k): x for k, x in enumerate(found.udot.tolist())}}
    slots[_LOADS_TIME] = slots[TIME]
    parts = (rates.kinetic, rates.potential, [rates.given], rates.momenta, rates.changes)
    values = np.array(evaluate_float([x for part in parts for x in part], slots), dtype=float)
    kinetic, potential, given, *momenta = np.split(values, np.cumsum([len(part) for part in parts])[:-1])
    now, changes = (x.reshape(-1, 2, 3).transpose(1, 0, 2) for x in momenta)
    powers, causes = _powers(motion, found), _from_outside(motion, found)
    far = max((float(np.linalg.norm(np.array(p, dtype=float))) for _, p in motion.poses), default=0.0)
    fastest = max((float(np.linalg.norm(np.array(moved.v_WB, dtype=float))) for moved in motion.bodies), default=0.0)
    levers = np.concatenate([far * np.abs(causes[0]), fastest * np.abs(now[0])])
    rates_of_energy = np.concatenate([kinetic, potential])
    about = float(kinetic_energy(motion)), rates_of_energy, float(given[0]), powers
    return Instant(*about, now, changes, causes, levers)


def instants_of(mechanism: Mechanism, states: Sequence[State], found: Sequence[Accelerations]) -> list[Instant]:
    """Return both sides at several states."""
    rates = rates_of(mechanism)
    return [instant_of(mechanism, rates, state, x) for state, x in zip(states, found, strict=True)]


def theorems(instants: Iterable[Instant]) -> dict[str, float]:
    """Return each theorem's worst residual over states, relative to the sum of absolute values of its terms."""
    worst = dict.fromkeys(("power", "momentum", "angular_momentum"), 0.0)
    for at in instants:
        residuals = (
            _unbalanced(at.energy[:, None], at.powers[:, None], np.array(at.kinetic)),
            _unbalanced(at.changes[0], at.causes[0], at.momenta[0]),
            _unbalanced(at.changes[1], at.causes[1], np.concatenate([at.momenta[1], at.levers])),
        )
        worst = {name: max(x, y) for (name, x), y in zip(worst.items(), residuals, strict=True)}
    return worst


def _unbalanced(left: Floats, right: Floats, content: Floats) -> float:
    """Return |sum left - sum right| relative to the largest component of the terms' absolute values; 0/0 is 0.

    Where all rates cancel, as of a body that only turns or a bicycle that rolls on, they are compared with the
    `content` that changes, momenta or energy, itself, and moments with forces times the farthest body's distance.
    """
    size = float((np.abs(left).sum(axis=0) + np.abs(right).sum(axis=0)).max())
    size += float(np.abs(content).sum())
    difference = float(np.abs(left.sum(axis=0) - right.sum(axis=0)).max())
    return 0.0 if difference == 0.0 else difference / size


def _powers(motion: Motion, found: Accelerations) -> Floats:
    """Return the power of each load outside V, of each row, and of each joint's prescribed motion."""
    u = np.array(motion.state.u, dtype=float)
    _, working = split(motion.mechanism.loads)
    loads = [applied(motion, [load], weight=False) for load in working]
    powers = [_power(motion, forces.of_body) + np.array(forces.of_speed, dtype=float) @ u for forces in loads]
    powers.append(carried_by_flows(motion, working))
    rows = row_motions(motion)
    beside = {k: row.beside for k, row in enumerate(rows) if row.beside}
    exerted = along_reactions([row.forces for row in rows], beside, found.multipliers.tolist())
    for row, pushing, multiplier in zip(rows, exerted, found.multipliers, strict=True):
        on_speeds = np.array(pushing, dtype=float) - np.array(generalized_forces(motion, row.of_body), dtype=float)
        powers.append(multiplier * (_power(motion, row.of_body) + on_speeds @ u))
    for moved, (force, moment) in zip(motion.bodies, _transmitted(motion, found), strict=True):
        powers.append(dot(moved.given_linear, force) + dot(moved.given_angular, moment))
    return np.array(powers, dtype=float)


def _power(motion: Motion, of_body: Sequence[Wrench]) -> float:
    """Return the power of wrenches on the bodies: F . v + M . omega."""
    pairs = zip(motion.bodies, of_body, strict=True)
    return float(sum(dot(moved.v_WB, force) + dot(moved.w_WB, moment) for moved, (force, moment) in pairs))


def _transmitted(motion: Motion, found: Accelerations) -> list[Wrench]:
    """Return the wrench of each joint on its child."""
    given = acting(motion, row_motions(motion), found.multipliers.tolist())
    return joint_wrenches(motion, found.udot.tolist(), given)


def _from_outside(motion: Motion, found: Accelerations) -> Floats:
    """Return the forces on all bodies and their moments about the origin: loads, weight, rows, ground's joints.

    With the momentum that comes and goes with masses.
    """
    given = acting(motion, row_motions(motion), found.multipliers.tolist())
    transmitted = _transmitted(motion, found)
    on_ground = [k for k, body in enumerate(motion.mechanism.bodies) if body.parent < 0]
    flows = [load.body for load in motion.mechanism.loads if isinstance(load, MassFlow)]
    brought = [(k, carried_momentum(motion, k)) for k in flows]
    pairs = [*enumerate(given), *((k, transmitted[k]) for k in on_ground), *brought]
    in_world = np.array([_in_world(motion, index, wrench) for index, wrench in pairs], dtype=float)
    return in_world.reshape(-1, 2, 3).transpose(1, 0, 2)


def _in_world(motion: Motion, index: int, wrench: Wrench) -> tuple[Vec, Vec]:
    R, p = motion.poses[index]
    force = apply(R, wrench[0])
    return force, add(apply(R, wrench[1]), cross(p, force))
