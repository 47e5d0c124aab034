"""General theorems as self-checks at a state: power, momentum, angular momentum.

    dT/dt + dV/dt = power of the forces outside V, of the rows and of prescribed motion
    d/dt sum m v_C = resultant of the external forces, the ground's reactions included
    d/dt sum (r_C x m v_C + J omega) = their resultant moment about the origin

The left sides are exact derivatives of T, V and the momenta; the right sides come from forces and reactions.
Source: Wittenburg, Dynamics of Multibody Systems, chapter 3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.composite_body import composite_body, joint_wrenches
from multibody_sym.dynamics.formalisms.constrained import Accelerations, forward_dynamics
from multibody_sym.dynamics.programs.quantities import Momentum, angular_momentum, body_momenta, exertions, in_world
from multibody_sym.dynamics.programs.reactions import reactions, wrenches_on_bodies
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import MultibodyError
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy, split
from multibody_sym.mechanics.forces import applied_forces, carried_by_flows, carried_momentum
from multibody_sym.mechanics.load_records import MassFlow
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    arrays,
    motion_of,
    pose,
    qdot_of,
    rates_of_state,
    slot_state,
    state_of,
)
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, generalized_forces, position
from multibody_sym.mechanics.row_kinematics import RowMotion, along_reactions, row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative, gradient, tangents
from multibody_sym.scalars.functions import absolute, evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, Node, as_node, named_nodes, slot
from multibody_sym.scalars.vectors import S, dot
from multibody_sym.text.printer import COMPONENTS

NEGLIGIBLE: Final = 1e-9
"""Rates below this part of the sum of what could cause them are rounding."""
_LOADS_TIME: Final = slot("t", 1)


@dataclass(frozen=True)
class EnergyRates:
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


def rates_of(mechanism: Mechanism) -> EnergyRates:
    """Return the derivatives of energies and momenta of a mechanism."""
    motion = motion_of(mechanism, slot_state(mechanism))
    stored = []
    for load in split(mechanism.loads)[0]:  # their time is a leaf of its own, which the kinematics does not know
        nodes = named_nodes(vars(load))
        timed = evaluate(nodes.values(), lambda leaf: _LOADS_TIME if leaf is TIME else leaf)
        stored.append(replace(load, **dict(zip(nodes, timed, strict=True))))
    changing = replace(motion.state, slots={**motion.state.slots, _LOADS_TIME: _LOADS_TIME})
    T = as_node(kinetic_energy(motion))
    V = as_node(potential_energy(replace(motion, state=changing, mechanism=replace(mechanism, loads=tuple(stored)))))
    qdot = [as_node(rate) for rate in qdot_of(motion.state, mechanism)]
    udot = [slot("udot", k) for k in range(len(mechanism.speeds))]
    leaves, rates = [*motion.state.q, *motion.state.u, TIME], [*qdot, *udot, ONE]
    momenta = [as_node(x) for part in _momenta_of(body_momenta(motion)) for x in part]
    along = dict(zip(leaves, rates, strict=True))
    return EnergyRates(
        [g * rate for g, rate in zip(gradient(T, leaves), rates, strict=True)],
        [g * rate for g, rate in zip(gradient(V, leaves), rates, strict=True)],
        derivative(V, _LOADS_TIME),
        momenta,
        tangents(momenta, along),
    )


def _momenta_of(parts: Iterable[Momentum]) -> list[list[S]]:
    return [[*part.momentum, *angular_momentum([part])] for part in parts]


@dataclass(frozen=True)
class BalanceTerms:
    """Both sides of the theorems at a state, term by term.

    `kinetic` T; `energy` the terms of dT/dt + dV/dt but `given`, which is dV/dt from springs that change in time;
    `powers` those of the loads outside V, of the rows and of prescribed motion. First momentum, then angular momentum:
    `momenta` and `changes` (2 x bodies x 3), and their `causes`, external forces without pairs that cancel
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


def balance_terms(mechanism: Mechanism, rates: EnergyRates, state: State, dynamics: Accelerations) -> BalanceTerms:
    """Return both sides of the theorems at a state over floats with its accelerations."""
    motion = motion_of(mechanism, state)
    slots = {**state.slots, **{slot("udot", k): x for k, x in enumerate(dynamics.udot.tolist())}}
    slots[_LOADS_TIME] = slots[TIME]
    parts = (rates.kinetic, rates.potential, [rates.given], rates.momenta, rates.changes)
    values = np.array(evaluate_float([x for part in parts for x in part], slots), dtype=float)
    kinetic, potential, given, *momenta = np.split(values, np.cumsum([len(part) for part in parts])[:-1])
    now, changes = (x.reshape(-1, 2, 3).transpose(1, 0, 2) for x in momenta)
    rows, multipliers = row_motions(motion), dynamics.multipliers.tolist()
    given_wrenches = wrenches_on_bodies(motion, rows, multipliers)
    transmitted = joint_wrenches(motion, dynamics.udot.tolist(), given_wrenches)
    powers = _powers(motion, rows, multipliers, transmitted)
    causes = _causes(motion, given_wrenches, transmitted)
    far = max((float(np.linalg.norm(np.array(p, dtype=float))) for _, p in motion.poses), default=0.0)
    fastest = max((float(np.linalg.norm(np.array(moved.v_WB, dtype=float))) for moved in motion.bodies), default=0.0)
    levers = np.concatenate([far * np.abs(causes[0]), fastest * np.abs(now[0])])
    rates_of_energy = np.concatenate([kinetic, potential])
    about = float(kinetic_energy(motion)), rates_of_energy, float(given[0]), powers
    return BalanceTerms(*about, now, changes, causes, levers)


def terms_at_states(
    mechanism: Mechanism, states: Sequence[State], dynamics: Sequence[Accelerations]
) -> list[BalanceTerms]:
    rates = rates_of(mechanism)
    return [balance_terms(mechanism, rates, state, x) for state, x in zip(states, dynamics, strict=True)]


def theorems(states: Iterable[BalanceTerms]) -> dict[str, float]:
    """Return each theorem's worst residual over states, relative to the sum of absolute values of its terms."""
    worst = dict.fromkeys(("power", "momentum", "angular_momentum"), 0.0)
    for at in states:
        residuals = (
            _residual(at.energy[:, None], at.powers[:, None], np.array(at.kinetic)),
            _residual(at.changes[0], at.causes[0], at.momenta[0]),
            _residual(at.changes[1], at.causes[1], np.concatenate([at.momenta[1], at.levers])),
        )
        worst = {name: max(x, y) for (name, x), y in zip(worst.items(), residuals, strict=True)}
    return worst


def _residual(left: Floats, right: Floats, content: Floats) -> float:
    """Return |sum left - sum right| relative to the largest component of the terms' absolute values; 0/0 is 0.

    Where all rates cancel, as of a body that only turns or a bicycle that rolls on, they are compared with the
    `content` that changes: momenta or energy, and forces times the farthest body's distance.
    """
    size = float((np.abs(left).sum(axis=0) + np.abs(right).sum(axis=0)).max())
    size += float(np.abs(content).sum())
    difference = float(np.abs(left.sum(axis=0) - right.sum(axis=0)).max())
    return 0.0 if difference == 0.0 else difference / size


def _powers(
    motion: Motion, rows: Sequence[RowMotion], multipliers: Sequence[float], transmitted: Sequence[Wrench]
) -> Floats:
    """Return the power of each load outside V, of each row, and of each joint's prescribed motion."""
    u = np.array(motion.state.u, dtype=float)
    _, working = split(motion.mechanism.loads)
    loads = [applied_forces(motion, [load], weight=False) for load in working]
    powers = [_power(motion, forces.of_body) + np.array(forces.of_speed, dtype=float) @ u for forces in loads]
    powers.append(carried_by_flows(motion, working))
    beside = {k: row.beside for k, row in enumerate(rows) if row.beside}
    exerted = along_reactions([row.forces for row in rows], beside, multipliers)
    for row, pushing, multiplier in zip(rows, exerted, multipliers, strict=True):
        on_speeds = np.array(pushing, dtype=float) - np.array(generalized_forces(motion, row.of_body), dtype=float)
        powers.append(multiplier * (_power(motion, row.of_body) + on_speeds @ u))
    for moved, (force, moment) in zip(motion.bodies, transmitted, strict=True):
        powers.append(dot(moved.given_linear, force) + dot(moved.given_angular, moment))
    return np.array(powers, dtype=float)


def _power(motion: Motion, of_body: Sequence[Wrench]) -> float:
    pairs = zip(motion.bodies, of_body, strict=True)
    return float(sum(dot(moved.v_WB, force) + dot(moved.w_WB, moment) for moved, (force, moment) in pairs))


def _causes(motion: Motion, given: Sequence[Wrench], transmitted: Sequence[Wrench]) -> Floats:
    """Return the forces on all bodies and their moments about the origin (2 x terms x 3).

    They are `given` by loads, weight and rows, `transmitted` by joints on ground, or the momentum of flows of mass.
    """
    on_ground = [k for k, body in enumerate(motion.mechanism.bodies) if body.parent < 0]
    flows = [load.body for load in motion.mechanism.loads if isinstance(load, MassFlow)]
    brought = [(k, carried_momentum(motion, k)) for k in flows]
    acting = (*enumerate(given), *((k, transmitted[k]) for k in on_ground), *brought)
    every = [in_world(motion, index, wrench) for index, wrench in acting]
    return np.array(every, dtype=float).reshape(-1, 2, 3).transpose(1, 0, 2)


# ----------------------------------------------------------------------------------------------------------------------
# Components of the reactions of joints on ground that are always zero: their letters would stand for zero.
#
# A component counts as zero that is zero to rounding at several random states and parameters.


_STATES: Final = 3
_TRIES: Final = 10
_ROUNDING: Final = 1e-10
"""The part of the largest force or moment on bodies below which one is rounding."""

Idle = frozenset[tuple[str, int]]
"""Pairs of a joint's name and a component: forces along ground's axes 0 to 2, moments about them 3 to 5."""


def idle_reactions(mechanism: Mechanism) -> Idle:
    """Return the components of the reactions of joints on ground, moments about the origin, that are always zero."""
    base = mechanism.relative or mechanism
    joints = [body.joint_name for body in base.bodies if body.parent < 0]
    rng, found, acting = np.random.default_rng(0), list[Floats](), 0.0
    for _ in range(_TRIES):
        if len(found) == _STATES:
            break
        try:
            exerted, largest = _random_reactions(base, rng)
        except (*UNDEFINED, MultibodyError):
            continue
        if np.isfinite(exerted).all():
            found.append(exerted)
            acting = max(acting, largest)
    if len(found) < _STATES:
        return frozenset()
    sizes = np.abs(np.array(found)).max(axis=0)
    idle = sizes <= _ROUNDING * sizes.max(initial=acting)
    return frozenset((joint, k) for joint, row in zip(joints, idle.tolist(), strict=True) for k in range(6) if row[k])


def _random_reactions(mechanism: Mechanism, rng: np.random.Generator) -> tuple[Floats, float]:
    """Return force and moment (joints on ground, 6) about the origin, in ground's axes, at a random state.

    The second result is the largest force or moment of loads there.
    """
    given = np.array(parameter_values(mechanism, {}), dtype=float)
    factors, others = rng.uniform(0.5, 1.5, len(given)), rng.uniform(0.5, 1.5, len(given))
    parameters = np.where(given == 0.0, others, given * factors).tolist()
    q, u = (rng.uniform(-1.0, 1.0, len(of)).tolist() for of in (mechanism.coordinates, mechanism.speeds))
    state = state_of(mechanism, float, float(rng.uniform(0.1, 1.0)), q, u, parameters)
    dynamics = composite_body(mechanism, state)
    solved, motion = forward_dynamics(dynamics), motion_of(mechanism, state)
    of_joints = reactions(motion, solved.udot.tolist(), dynamics.rows, solved.multipliers.tolist())
    found = []
    for k, body in enumerate(mechanism.bodies):
        if body.parent < 0:
            turned = np.array(pose(state, body.frame_on_parent)[0], dtype=float)
            values = np.array([float(of_joints[body.joint_name][component]) for component in COMPONENTS])
            force, moment = turned @ values[:3], turned @ values[3:]
            at = np.array(position(motion, Marker("", k, body.frame_on_body)), dtype=float)
            found.append(np.concatenate([force, moment + np.cross(at, force)]))
    acting = [abs(float(x)) for wrench in applied_forces(motion).of_body for vector in wrench for x in vector]
    return np.array(found).reshape(len(found), len(COMPONENTS)), max(acting, default=0.0)


# ----------------------------------------------------------------------------------------------------------------------
# The Program of the general theorems: both sides in each state of a run.
#
#     dP/dt = sum F        dL/dt = sum M about the origin        dT/dt = sum of all powers


THEOREMS: Final = {"momentum": slice(0, 3), "angular_momentum": slice(3, 6), "power": slice(6, 7)}
"""The places of each theorem's components among the seven."""

INTEGRAL: Final = {"momentum": "impulse", "angular_momentum": "angular_impulse", "power": "work"}
"""What each theorem is called in integral form."""


def theorems_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, ..., udot (nu), multipliers (ns)) -> value, left, right, size, content, each (7).

    P, L and T; their rates; the causes of these; the sums of absolute values of both sides' terms, and those of the
    values, body by body. Moments count with the levers' lengths, as terms that cancel in r x F are rounded too. So does
    angular momentum: J omega and r x m v of a ball that spins backwards may cancel.
    """
    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    trace = Trace("theorems", (*arrays(mechanism), *unknown))
    motion = motion_of(mechanism, slot_state(mechanism))
    momenta = body_momenta(motion)
    parts = _momenta_of(momenta)
    flat = [as_node(x) for part in parts for x in part]
    T = as_node(kinetic_energy(motion))
    rates = [as_node(x) for x in tangents([*flat, T], rates_of_state(mechanism))]
    causes: list[list[S]] = []
    lever: S = 0  # the sum of |r| |F|
    powers = []
    for each in exertions(motion, trace["udot"], row_motions(motion), trace["multipliers"]):
        powers.append(as_node(each.power))
        for index, wrench in enumerate(each.of_body if each.from_outside else ()):
            if wrench is not NO_WRENCH:
                force, moment = in_world(motion, index, wrench)
                causes.append([*force, *moment])
                lever = lever + _sum(map(absolute, motion.poses[index][1])) * _sum(map(absolute, force))
    moments = []  # the sums of the terms of each body's angular momentum (3)
    for part in momenta:
        arm = _sum(map(absolute, part.com)) * _sum(map(absolute, part.momentum))
        moments.append([absolute(spin) + arm for spin in part.spin])
    of_body = [rates[6 * k : 6 * k + 6] for k in range(len(parts))]
    left_size = [*_sums(of_body, absolute), absolute(rates[-1])]
    right_size = [*_sums(causes, absolute), _sum(map(absolute, powers))]
    size = [_sum(pair) for pair in zip(left_size, right_size, strict=True)]
    columns = {
        "value": [*_sums(parts), T],
        "left": [*_sums(of_body), rates[-1]],
        "right": [*_sums(causes), _sum(powers)],
        "size": [*size[:3], *(x + lever for x in size[3:6]), size[6]],
        "content": [*_sums(parts, absolute)[:3], *(_sum(row[k] for row in moments) for k in range(3)), T],
    }
    return trace.finish({name: ((7,), [as_node(x) for x in values]) for name, values in columns.items()})


def _sums(rows: Iterable[Sequence[S]], of: Callable[[S], S] | None = None) -> list[S]:
    """Return the sums of six columns, or of their absolute values."""
    return [_sum(row[k] if of is None else of(row[k]) for row in rows) for k in range(6)]


def _sum(terms: Iterable[S]) -> S:
    return sum(terms, 0)
