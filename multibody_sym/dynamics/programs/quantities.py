"""Quantities of the moving system that outputs and questions name: positions, reactions, tensions, momenta.

And the Program of events, in whose expressions they may stand: conditions that stop a run, kinks of declared forces and
inputs, ends of a mode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.programs.momenta import (
    SECTIONS,
    Exertion,
    Momentum,
    angular_momentum,
    body_momenta,
    centre_of_mass,
    exertions,
    generalized_momenta,
    jacobi_integral,
    momentum,
    resultant,
)
from multibody_sym.dynamics.programs.reactions import (
    LawForces,
    SwitchingValues,
    pulley_reactions,
    reactions,
    ropes,
    switchings,
    tensions_by_name,
)
from multibody_sym.errors import ModelError
from multibody_sym.mechanics import points
from multibody_sym.mechanics.energy import (
    body_kinetic_energy,
    kinetic_energy,
    potential_energy,
    split,
    stored_energy,
    weight_energy,
)
from multibody_sym.mechanics.forces import place, span, span_rate
from multibody_sym.mechanics.load_records import PlacePotential, PointPull
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, accelerations
from multibody_sym.mechanics.points import NO_WRENCH
from multibody_sym.mechanics.ropes import wrap_angle, wrap_between
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.mechanics.state import arrays
from multibody_sym.model.bodies import COM, Pose
from multibody_sym.model.contacts_and_impacts import without_number
from multibody_sym.model.fields import AXES
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate, sqrt
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, apply, dot, subtract
from multibody_sym.text.parser import OWN_CENTRE, SYSTEM
from multibody_sym.text.printer import COMPONENTS


@dataclass(frozen=True)
class Instant:
    """A state with its accelerations and multipliers, on which all quantities depend."""

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
    def momenta(self) -> list[Momentum]:
        """The momenta of all bodies."""
        return body_momenta(self.motion)

    @cached_property
    def generalized_momenta(self) -> list[S]:
        """dT/du (nu)."""
        return generalized_momenta(self.motion)

    @cached_property
    def exertions(self) -> list[Exertion]:
        """The effects of all elements."""
        return exertions(self.motion, self.udot, self.rows, self.multipliers)

    def exerted_by(self, name: str) -> list[Exertion]:
        """Return the effects of the element of a name: of a force before a constraint, contact, mass flow or joint."""
        found: dict[str, list[Exertion]] = {}
        declared = [x for x in self.exertions if x.path[1] == name]
        for each in declared or (x for x in self.exertions if name in (x.contact, without_number(x.path[1]))):
            found.setdefault(each.path[0], []).append(each)
        return next((found[section] for section in SECTIONS if section in found), [])

    @cached_property
    def tensions(self) -> Mapping[str, S]:
        """All tensions of ropes, by their names in questions."""
        return tensions_by_name(self.motion, self.multipliers)


def quantities(motion: Motion, udot: Sequence[S], multipliers: Sequence[S], asked: Iterable[Node]) -> dict[Node, S]:
    """Return the values of `quantity` leaves over the motion's scalar; their names were verified with the model."""
    instant = Instant(motion, udot, multipliers)
    return {leaf: _QUANTITIES[leaf.data[0]](instant, *leaf.data[1]) for leaf in asked}


@dataclass(frozen=True)
class Sources:
    """The sources of quantities over Nodes: Programs to call, and the bodies' motion in a trace."""

    state_derivative: Program
    energy: Program
    motion: Callable[[Trace], Motion]


def forces_of(mechanism: Mechanism) -> Array:
    """Return the input that stands for the multipliers of a mechanism's rows."""
    return Array("multipliers", (len(mechanism.rows),))


def with_quantities(trace: Trace, sources: Sources, declared: Sequence[Node]) -> list[Node]:
    """Return expressions with the values of their quantities, in slots.

    Quantities that depend on accelerations or multipliers call the state derivative, energies their own Program.
    """
    asked = leaves(declared, "quantity")
    if not asked:
        return list(declared)
    given = [trace[a.name] for a in sources.energy.inputs]
    (kinetic,), (potential,) = trace.call(sources.energy, given)
    energies = {"kinetic_energy": kinetic, "potential_energy": potential, "total_energy": kinetic + potential}
    found = {leaf: energies[leaf.data[0]] for leaf in asked if leaf.data[0] in energies and not leaf.data[1]}
    others = [leaf for leaf in asked if leaf not in found]
    if others:
        _, udot, multipliers, _ = trace.call(sources.state_derivative, given)
        found |= quantities(sources.motion(trace), udot, multipliers, others)
    return evaluate(declared, lambda leaf: found.get(leaf, leaf))


def events(mechanism: Mechanism, sources: Sources) -> Program | None:
    """Return (t, q, u, ...) -> values: stops, kinks, fades, switching functions of a mode; None where there are none.

    With a mode its multipliers (ns,) are one more input. A stop's value becomes positive where its condition holds, a
    mode's where it ends; a kink's or a fade's value changes its sign.
    """
    asked, switching = [*mechanism.stops.values(), *mechanism.kinks, *mechanism.fades], switchings(mechanism)
    if not asked and not switching:
        return None
    trace = Trace("events", (*arrays(mechanism), *([forces_of(mechanism)] if switching else [])))
    values = with_quantities(trace, sources, asked)
    if switching:
        values += map(as_node, SwitchingValues(sources.motion(trace), trace["multipliers"]).values(switching))
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


# Each quantity by its name in expressions (`_QUANTITIES`), for the words of its arguments.


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


def _place_of(instant: Instant, name: str, axis: str) -> S:
    loads = instant.motion.mechanism.loads
    found = next(load for load in loads if isinstance(load, PlacePotential) and load.name == name)
    return _component(place(found, instant.motion), axis)


def _reaction(instant: Instant, element: str, component: str) -> S:
    if element in instant.motion.mechanism.joint_names:
        return instant.reactions[element][component]
    if component not in COMPONENTS:
        return LawForces(instant.motion, instant.multipliers).component(element, component)
    return instant.pulleys[element][component] if element in instant.pulleys else 0


def _tension(instant: Instant, name: str) -> S:
    return instant.tensions[name] if name in instant.tensions else _multiplier(instant, name)


def _multiplier(instant: Instant, name: str) -> S:
    """Return a multiplier; zero where no motion goes along its row, which is left out in the plane."""
    rows = {row.name: k for k, row in enumerate(instant.motion.mechanism.rows)}
    return instant.multipliers[rows[name]] if name in rows else 0


def _wrap(instant: Instant, name: str, pulley: str) -> S:
    """Return the angle of a wheel on which a run of rope lies, at its end with the run behind it."""
    every = list(ropes(instant.motion.mechanism))
    row = next(row for row in every if row.name == name)
    if row.path[-1].pulley == pulley:
        after = next(x for x in every if x.rope == row.rope and x.path[0].pulley == pulley)
        return wrap_between(instant.motion, row, after)
    return wrap_angle(instant.motion, row, next(k for k, bend in enumerate(row.path) if bend.pulley == pulley))


def _parts(instant: Instant, whole: str) -> list[Momentum]:
    """Return the momenta of a body, or of all where the word for the system is no body's name."""
    names = [body.name for body in instant.motion.mechanism.bodies]
    if whole == SYSTEM and whole not in names:
        return instant.momenta
    return [part for name, part in zip(names, instant.momenta, strict=True) if name == whole]


def _center_of_mass(instant: Instant, axis: str) -> S:
    return _component(centre_of_mass(instant.momenta), axis)


def _momentum(instant: Instant, *asked: str) -> S:
    return _component(momentum(_parts(instant, asked[0] if len(asked) > 1 else SYSTEM)), asked[-1])


def _angular_momentum(instant: Instant, *asked: str) -> S:
    parts = _parts(instant, asked[0] if len(asked) > 1 else SYSTEM)
    about = ZERO_VECTOR
    if len(asked) > 2:
        is_own_centre = asked[1] == OWN_CENTRE and OWN_CENTRE not in instant.motion.mechanism.markers
        marker = None if is_own_centre else _marker(instant, asked[1])
        about = centre_of_mass(parts) if marker is None else points.position(instant.motion, marker)
    return _component(angular_momentum(parts, about), asked[-1])


def _generalized_momentum(instant: Instant, freedom: str) -> S:
    """Return dT/du for a speed, or for the rate of a coordinate."""
    named = f"generalized_momentum({freedom})"
    return instant.generalized_momenta[_speed(instant, freedom, named)]


def _speed(instant: Instant, freedom: str, named: str) -> int:
    """Return the place of a speed, or of the speed that is a coordinate's rate. Raises ModelError where it has none."""
    place = instant.motion.mechanism.speed_place(freedom)
    if place is None:
        raise ModelError(f"{named}: {freedom!r} is no speed here, and its rate is none", number="M112")
    return place


def _rate(instant: Instant, speed: str) -> S:
    return instant.udot[_speed(instant, speed, f"{speed}'")]


def _second_rate(instant: Instant, coordinate: str) -> S:
    return instant.udot[_speed(instant, coordinate, f"{coordinate}''")]


def _kinetic(instant: Instant, *whole: str) -> S:
    motion = instant.motion
    names = [body.name for body in motion.mechanism.bodies]
    if not whole or (whole[0] == SYSTEM and SYSTEM not in names):
        return kinetic_energy(motion)
    index = names.index(whole[0])
    return body_kinetic_energy(motion.bodies[index], motion.masses[index])


def _potential(instant: Instant, *store: str) -> S:
    """Return V, of all, of the weight of a body, or of the springs of one force."""
    motion = instant.motion
    names = [body.name for body in motion.mechanism.bodies]
    if not store or (store[0] == SYSTEM and SYSTEM not in names):
        return potential_energy(motion)
    if store[0] in names:
        index = names.index(store[0])
        return weight_energy(motion.poses[index], motion.masses[index], motion.gravity)
    own = [load for load in split(motion.mechanism.loads)[0] if load.name == store[0]]
    return sum((stored_energy(load, motion) for load in own), 0)


def _total(instant: Instant) -> S:
    return _kinetic(instant) + _potential(instant)


def _jacobi(instant: Instant) -> S:
    return jacobi_integral(instant.motion)


def _power(instant: Instant, name: str) -> S:
    return sum((each.power for each in instant.exerted_by(name)), 0)


def force_on(instant: Instant, *asked: str) -> S:
    """Return the component of an element's force on all bodies together, or on one."""
    whole = asked[1] if len(asked) > 2 else SYSTEM
    names = [body.name for body in instant.motion.mechanism.bodies]
    found: Vec = ZERO_VECTOR
    for each in instant.exerted_by(asked[0]):
        if whole == SYSTEM and SYSTEM not in names:
            own = each.of_body
        else:
            own = [w if name == whole else NO_WRENCH for name, w in zip(names, each.of_body, strict=True)]
        found = add(found, resultant(instant.motion, own)[0])
    return _component(found, asked[-1])


_QUANTITIES: Final[dict[str, Callable[..., S]]] = {
    "position": _position,
    "velocity": _velocity,
    "acceleration": _acceleration,
    "angular_velocity": _angular_velocity,
    "angular_acceleration": _angular_acceleration,
    "distance": _distance,
    "'": _rate,
    "''": _second_rate,
    "span": _span,
    "span_rate": _span_rate,
    "place": _place_of,
    "reaction": _reaction,
    "tension": _tension,
    "wrap": _wrap,
    "multiplier": _multiplier,
    "total_energy": _total,
    "kinetic_energy": _kinetic,
    "potential_energy": _potential,
    "center_of_mass": _center_of_mass,
    "momentum": _momentum,
    "angular_momentum": _angular_momentum,
    "generalized_momentum": _generalized_momentum,
    "jacobi_integral": _jacobi,
    "power": _power,
    "work": _power,
    "impulse": force_on,
}
"""What adds up along a run, work and impulses, is answered with its rate here: power and force."""
