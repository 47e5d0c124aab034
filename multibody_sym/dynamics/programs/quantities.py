"""Quantities of the moving system that outputs and questions name: positions, reactions, tensions, momenta.

And the Program of what may end a step, in which they may stand: conditions that stop a run, and kinks of declared
forces and inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.programs.pulleys import pulley_reactions
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.programs.switching import SwitchingValues, switchings
from multibody_sym.dynamics.programs.tensions import tensions_by_name
from multibody_sym.kinematics import points
from multibody_sym.kinematics.energy import kinetic_energy, potential_energy
from multibody_sym.kinematics.loads import span, span_rate
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import arrays
from multibody_sym.model.declaration.values import AXES
from multibody_sym.model.mechanism.loads import PointPull
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import COM, Pose
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import evaluate, sqrt
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, apply, cross, dot, scale, subtract


@dataclass(frozen=True)
class Instant:
    """A state with its accelerations and multipliers: all that a quantity may depend on."""

    motion: Motion
    udot: Sequence[S]
    multipliers: Sequence[S]

    @cached_property
    def bodies(self) -> list[tuple[Vec, Vec]]:
        """The bodies' accelerations."""
        return accelerations(self.motion, self.udot)

    @cached_property
    def rows(self) -> list[RowMotion]:
        """The rows at this state."""
        return row_motions(self.motion)

    @cached_property
    def reactions(self) -> Mapping[str, dict[str, S]]:
        """The reactions of all joints."""
        return reactions(self.motion, self.udot, self.rows, self.multipliers)

    @cached_property
    def pulleys(self) -> Mapping[str, dict[str, S]]:
        """The reactions of all massless pulleys that ropes run over."""
        return pulley_reactions(self.motion, self.multipliers)

    @cached_property
    def tensions(self) -> Mapping[str, S]:
        """All tensions of ropes, by what they are asked by."""
        return tensions_by_name(self.motion, self.multipliers)


def quantities(motion: Motion, udot: Sequence[S], multipliers: Sequence[S], asked: Iterable[Node]) -> dict[Node, S]:
    """Return the values of `quantity` leaves over the motion's scalar; their names were verified with the model."""
    instant = Instant(motion, udot, multipliers)
    return {leaf: _QUANTITIES[leaf.data[0]](instant, *leaf.data[1]) for leaf in asked}


@dataclass(frozen=True)
class Sources:
    """What quantities over Nodes are made from: Programs to call, and what gives the bodies' motion in a trace."""

    state_derivative: Program
    energy: Program
    motion: Callable[[Trace], Motion]


def answered(trace: Trace, sources: Sources, declared: Sequence[Node]) -> list[Node]:
    """Return expressions in slots with their quantities answered.

    What depends on accelerations or multipliers calls the state derivative, energies their own Program.
    """
    asked = leaves(declared, "quantity")
    if not asked:
        return list(declared)
    given = [trace[a.name] for a in trace.inputs]
    (kinetic,), (potential,) = trace.call(sources.energy, given)
    energies = {"kinetic_energy": kinetic, "potential_energy": potential, "total_energy": kinetic + potential}
    found = {leaf: energies[leaf.data[0]] for leaf in asked if leaf.data[0] in energies}
    others = [leaf for leaf in asked if leaf not in found]
    if others:
        _, udot, multipliers, _ = trace.call(sources.state_derivative, given)
        found |= quantities(sources.motion(trace), udot, multipliers, others)
    return evaluate(declared, lambda leaf: found.get(leaf, leaf))


def events(mechanism: Mechanism, sources: Sources) -> Program | None:
    """Return (t, q, u, ...) -> values: stops, then kinks and fades, then those of a mode; None where there are none.

    A stop's value becomes positive where its condition holds, a mode's where it ends; a kink's or a fade's value
    changes its sign.
    """
    asked, switching = [*mechanism.stops.values(), *mechanism.kinks, *mechanism.fades], switchings(mechanism)
    if not asked and not switching:
        return None
    trace = Trace("events", arrays(mechanism))
    values = answered(trace, sources, asked)
    if switching:
        _, _, multipliers, _ = trace.call(sources.state_derivative, [trace[a.name] for a in trace.inputs])
        values += [as_node(x) for x in SwitchingValues(sources.motion(trace), multipliers).of(switching)]
    return trace.finish({"values": ((len(values),), values)})


def _component(vector: Vec, axis: str) -> S:
    return vector[AXES.index(axis)]


def _marker(instant: Instant, name: str) -> Marker:
    """Return the point that a name stands for; a body alone stands for its centre of mass."""
    mechanism = instant.motion.mechanism
    body, _, own = name.rpartition(".") if name not in mechanism.markers else (name, "", COM)
    marker = mechanism.markers[body]
    if own != COM or marker.body < 0 or mechanism.bodies[marker.body].name != body:
        return marker
    return Marker(name, marker.body, Pose(mechanism.bodies[marker.body].mass.com))


def _position(instant: Instant, point: str, axis: str) -> S:
    return _component(points.position(instant.motion, _marker(instant, point)), axis)


def _velocity(instant: Instant, point: str, axis: str) -> S:
    return _component(points.velocity(instant.motion, _marker(instant, point)), axis)


def _acceleration(instant: Instant, point: str, axis: str) -> S:
    return _component(points.acceleration(instant.motion, _marker(instant, point), instant.bodies), axis)


def _turning(instant: Instant, body: str, axis: str, vectors: Callable[[int], Vec]) -> S:
    index = instant.motion.mechanism.body_index(body)
    local = vectors(index) if index >= 0 else ZERO_VECTOR
    return _component(apply(instant.motion.rotation(index), local), axis)


def _angular_velocity(instant: Instant, body: str, axis: str) -> S:
    return _turning(instant, body, axis, lambda index: instant.motion.bodies[index].w_WB)


def _angular_acceleration(instant: Instant, body: str, axis: str) -> S:
    return _turning(instant, body, axis, lambda index: instant.bodies[index][1])


def _distance(instant: Instant, a: str, b: str) -> S:
    first, second = (points.position(instant.motion, _marker(instant, name)) for name in (a, b))
    difference = subtract(second, first)
    return sqrt(dot(difference, difference))


def _span(instant: Instant, load: str) -> S:
    return span(instant.motion, _ends(instant, load))[0]


def _span_rate(instant: Instant, load: str) -> S:
    ends = _ends(instant, load)
    return span_rate(instant.motion, ends, span(instant.motion, ends)[1])


def _ends(instant: Instant, name: str) -> tuple[Marker, Marker]:
    found = (load for load in instant.motion.mechanism.loads if isinstance(load, PointPull) and load.name == name)
    return next(found).ends


def _reaction(instant: Instant, joint: str, component: str) -> S:
    if joint in instant.motion.mechanism.joint_names:
        return instant.reactions[joint][component]
    return instant.pulleys[joint][component] if joint in instant.pulleys else 0


def _tension(instant: Instant, name: str) -> S:
    return instant.tensions[name] if name in instant.tensions else _multiplier(instant, name)


def _multiplier(instant: Instant, name: str) -> S:
    rows = {row.name: k for k, row in enumerate(instant.motion.mechanism.rows)}
    return instant.multipliers[rows[name]]


def _center_of_mass(instant: Instant, axis: str) -> S:
    """Return a component of the centre of mass of all bodies, sum(m r)/sum(m)."""
    masses, total = [body.mass for body in instant.motion.masses], ZERO_VECTOR
    for mass, (r, _) in zip(masses, _momenta(instant.motion), strict=True):
        total = add(total, scale(mass, r))
    return _component(total, axis) / sum(masses)


def _momentum(instant: Instant, axis: str) -> S:
    return _component(_sum(p for _, p in _momenta(instant.motion)), axis)


def _angular_momentum(instant: Instant, axis: str) -> S:
    motion, total = instant.motion, ZERO_VECTOR
    momenta = zip(motion.bodies, motion.masses, _momenta(motion), strict=True)
    for index, (moved, mass, (r, p)) in enumerate(momenta):
        spin = apply(motion.rotation(index), apply(mass.inertia, moved.w_WB))
        total = add(total, add(spin, cross(r, p)))
    return _component(total, axis)


def _momenta(motion: Motion) -> list[tuple[Vec, Vec]]:
    """Return each body's centre of mass and momentum, in world axes."""
    found = []
    for index, mass in enumerate(motion.masses):
        com = Marker("", index, Pose(motion.mechanism.bodies[index].mass.com))
        found.append((points.position(motion, com), scale(mass.mass, points.velocity(motion, com))))
    return found


def _sum(vectors: Iterable[Vec]) -> Vec:
    total = ZERO_VECTOR
    for vector in vectors:
        total = add(total, vector)
    return total


def _kinetic(instant: Instant) -> S:
    return kinetic_energy(instant.motion)


def _potential(instant: Instant) -> S:
    return potential_energy(instant.motion)


def _total(instant: Instant) -> S:
    return _kinetic(instant) + _potential(instant)


_QUANTITIES: Final[dict[str, Callable[..., S]]] = {
    "position": _position,
    "velocity": _velocity,
    "acceleration": _acceleration,
    "angular_velocity": _angular_velocity,
    "angular_acceleration": _angular_acceleration,
    "distance": _distance,
    "span": _span,
    "span_rate": _span_rate,
    "reaction": _reaction,
    "tension": _tension,
    "multiplier": _multiplier,
    "total_energy": _total,
    "kinetic_energy": _kinetic,
    "potential_energy": _potential,
    "center_of_mass": _center_of_mass,
    "momentum": _momentum,
    "angular_momentum": _angular_momentum,
}
