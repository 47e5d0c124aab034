"""Quantities of the moving system that outputs and questions name: positions, reactions, tensions, momenta.

And the Program of events, in whose expressions they may stand: conditions that stop a run, kinks of declared forces and
inputs, ends of a mode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.formalisms.composite_body import joint_wrenches, wrench_sum
from multibody_sym.dynamics.programs.reactions import (
    LawForces,
    SwitchingValues,
    pulley_reactions,
    reactions,
    ropes,
    switchings,
    tensions,
    wrenches_on_bodies,
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
from multibody_sym.mechanics.forces import applied_forces, carried_energy, carried_momentum, place, span, span_rate
from multibody_sym.mechanics.load_records import MassFlow, PlacePotential, PointPull
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, accelerations, arrays
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, generalized_forces, to_parent
from multibody_sym.mechanics.ropes import wrap_angle, wrap_between
from multibody_sym.mechanics.row_kinematics import RowMotion, along_reactions, row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import COM, Pose
from multibody_sym.model.contacts_and_impacts import without_number
from multibody_sym.model.fields import AXES, QUATERNION
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import atan2, evaluate, sqrt, where
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    S,
    Vec,
    add,
    apply,
    cross,
    dot,
    negate,
    rotation_quaternion,
    scale,
    subtract,
)
from multibody_sym.text.parser import OWN_CENTRE, SYSTEM, WEIGHT
from multibody_sym.text.printer import COMPONENTS

MOMENTA: Final = "momenta"
"""The array of Programs of momenta that stands where others have u."""



def column(values: Iterable[S]) -> tuple[tuple[int], list[Node]]:
    """Return values as an output of a Program."""
    nodes = [as_node(x) for x in values]
    return (len(nodes),), nodes


def choose(number: Node, yes: S, no: S) -> Node:
    """Return one of two values by a number that is not 0, or 0."""
    return as_node(where(number, as_node(yes), as_node(no)))


# ----------------------------------------------------------------------------------------------------------------------
# Momenta of bodies and of speeds, and Jacobi's integral, over any scalar.
#
#     P = sum m v_C        L_A = sum (J omega + (r_C - r_A) x m v_C)        p_k = dT/du_k        h = sum p_k u_k - T + V
#
# L_A about any point A has the velocities that the world sees, whether A moves or not: dL_A/dt = M_A - v_A x P.


@dataclass(frozen=True)
class Momentum:
    """A body's `mass`, the place of its centre of mass, its momentum and its `spin` J omega, in world axes."""

    mass: S
    com: Vec
    momentum: Vec
    spin: Vec


def body_momenta(motion: Motion) -> list[Momentum]:
    """Return the momenta of all bodies, in tree order."""
    found = []
    for index, (moved, mass) in enumerate(zip(motion.bodies, motion.masses, strict=True)):
        R, p = motion.poses[index]
        momentum = apply(R, scale(mass.mass, add(moved.v_WB, cross(moved.w_WB, mass.com))))
        spin = apply(R, apply(mass.inertia, moved.w_WB))
        found.append(Momentum(mass.mass, add(p, apply(R, mass.com)), momentum, spin))
    return found


def momentum(parts: Iterable[Momentum]) -> Vec:
    """Return P of some bodies together."""
    return total(part.momentum for part in parts)


def angular_momentum(parts: Iterable[Momentum], about: Vec = ZERO_VECTOR) -> Vec:
    """Return L of some bodies together about a place (world axes)."""
    return total(add(part.spin, cross(subtract(part.com, about), part.momentum)) for part in parts)


def centre_of_mass(parts: Sequence[Momentum]) -> Vec:
    """Return the centre of mass of some bodies together, sum(m r)/sum(m)."""
    x, y, z = total(scale(part.mass, part.com) for part in parts)
    mass = sum(part.mass for part in parts)
    return x / mass, y / mass, z / mass


def total(vectors: Iterable[Vec]) -> Vec:
    found = ZERO_VECTOR
    for vector in vectors:
        found = add(found, vector)
    return found


def generalized_momenta(motion: Motion) -> list[S]:
    """Return p_k = dT/du_k (nu): the bodies' momenta along their partial velocities."""
    momenta: list[Wrench] = []  # with the angular momentum about the body's origin, in its axes
    for moved, mass in zip(motion.bodies, motion.masses, strict=True):
        linear = scale(mass.mass, add(moved.v_WB, cross(moved.w_WB, mass.com)))
        momenta.append((linear, add(apply(mass.inertia, moved.w_WB), cross(mass.com, linear))))
    return generalized_forces(motion, momenta)


def jacobi_integral(motion: Motion) -> S:
    """Return h = sum p_k u_k - T + V, which is T + V where nothing moves as prescribed.

    T = T2 + T1 + T0 by powers of the speeds, so that h = T2 - T0 + V, and sum p_k u_k = 2 T2 + T1.
    """
    along = sum((p * u for p, u in zip(generalized_momenta(motion), motion.state.u, strict=True)), 0)
    return along - kinetic_energy(motion) + potential_energy(motion)


# ----------------------------------------------------------------------------------------------------------------------
# The wrenches of each element on each body, and its power: forces, the weight, constraints, contacts and joints.
#
# The wrenches on a body together are the rate of its momentum, and all powers that of the kinetic energy; so mass that
# leaves or joins a body exerts its reactive force and the momentum that it takes along or brings. A joint has the power
# of its prescribed motion; motors, springs and friction in it have their own, though its wrench holds them too.


SECTIONS: Final = ("gravity", "forces", "constraints", "contacts", "bodies", "joints")
"""Where elements are declared; of several with one name, the first in this order counts."""
Path = tuple[str, str]


@dataclass(frozen=True)
class Exertion:
    """The effect of an element declared at `path`: wrenches `of_body` (body axes, about its origin), and its `power`.

    `from_outside`: it is the weight, a load or a row, or a joint on ground; wrenches of inner joints cancel. `contact`:
    the name of a row's contact, which is not that of `path` where contacts repeat. `points`: where it acts, as far as
    it has points; `row`: the place of a row among those of the mechanism.
    """

    path: Path
    of_body: Sequence[Wrench]
    power: S
    from_outside: bool = True
    contact: str = ""
    points: tuple[Marker, ...] = ()
    row: int | None = None


def exertions(
    motion: Motion, udot: Sequence[S], rows: Sequence[RowMotion], multipliers: Sequence[S]
) -> list[Exertion]:
    """Return the effects of all elements at a state with its accelerations (nu) and multipliers (ns)."""
    weighed = applied_forces(motion, ()).of_body
    found = [Exertion(("gravity", WEIGHT), weighed, power_of(motion, weighed))]
    for load in motion.mechanism.loads:
        forces = applied_forces(motion, [load], weight=False)
        along = sum((force * u for force, u in zip(forces.of_speed, motion.state.u, strict=True)), 0)
        of_body, power = list(forces.of_body), power_of(motion, forces.of_body) + along
        if isinstance(load, MassFlow):  # the mass takes along or brings momentum and kinetic energy
            of_body[load.body] = wrench_sum(of_body[load.body], carried_momentum(motion, load.body))
            power = power + carried_energy(motion, load.body)
        found.append(Exertion(load.path, of_body, power, points=load.points))
    beside = {k: row.beside for k, row in enumerate(rows) if row.beside}
    pushing = along_reactions([row.forces for row in rows], beside, multipliers)
    for k, (row, multiplier) in enumerate(zip(rows, multipliers, strict=True)):
        of_body = [
            w if w is NO_WRENCH else (scale(multiplier, w[0]), scale(multiplier, w[1])) for w in row.of_body
        ]
        by_bodies = generalized_forces(motion, row.of_body)
        along = sum((pushing[k][j] - by_bodies[j]) * u for j, u in enumerate(motion.state.u))
        power = power_of(motion, of_body) + multiplier * along
        path = motion.mechanism.row_path(k)
        contact = motion.mechanism.rows[k].name.partition(".")[0] if path[0] == "contacts" else ""
        found.append(
            Exertion(path, of_body, power, contact=contact, points=motion.mechanism.rows[k].points, row=k)
        )
    transmitted = joint_wrenches(motion, udot, wrenches_on_bodies(motion, rows, multipliers))
    for index, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        force, moment = transmitted[index]
        of_body = [NO_WRENCH] * len(motion.bodies)
        of_body[index] = transmitted[index]
        if body.parent >= 0:
            back, turning_back = to_parent(moved, transmitted[index])
            of_body[body.parent] = (negate(back), negate(turning_back))
        power = dot(moved.given_linear, force) + dot(moved.given_angular, moment)
        name = body.joint_name
        points = Marker(name, index, body.frame_on_body), Marker(name, body.parent, body.frame_on_parent)
        found.append(Exertion(("joints", name), of_body, power, body.parent < 0, points=points))
    return found


def power_of(motion: Motion, of_body: Sequence[Wrench]) -> S:
    """Return the power of wrenches on the bodies: F . v + M . omega."""
    power: S = 0
    for moved, wrench in zip(motion.bodies, of_body, strict=True):
        if wrench is not NO_WRENCH:
            power = power + dot(moved.v_WB, wrench[0]) + dot(moved.w_WB, wrench[1])
    return power


def resultant(motion: Motion, of_body: Sequence[Wrench]) -> tuple[Vec, Vec]:
    """Return the sum of wrenches on the bodies, and of their moments about the origin, in world axes."""
    total: Wrench = ZERO_VECTOR, ZERO_VECTOR
    for index, wrench in enumerate(of_body):
        if wrench is not NO_WRENCH:
            total = wrench_sum(total, in_world(motion, index, wrench))
    return total


def in_world(motion: Motion, index: int, wrench: Wrench) -> Wrench:
    """Return a wrench on a body (body axes, about its origin) in world axes, about the origin."""
    R, p = motion.poses[index]
    force = apply(R, wrench[0])
    return force, add(apply(R, wrench[1]), cross(p, force))


# ----------------------------------------------------------------------------------------------------------------------
# A state with all that follows from its accelerations and multipliers.


@dataclass(frozen=True)
class StateQuantities:
    """A state with its accelerations and multipliers, on which all quantities depend."""

    motion: Motion
    udot: Sequence[S]
    multipliers: Sequence[S]

    @cached_property
    def bodies(self) -> list[tuple[Vec, Vec]]:
        return accelerations(self.motion, self.udot)

    @cached_property
    def rows(self) -> list[RowMotion]:
        return row_motions(self.motion)

    @cached_property
    def reactions(self) -> Mapping[str, dict[str, S]]:
        return reactions(self.motion, self.udot, self.rows, self.multipliers)

    @cached_property
    def pulleys(self) -> Mapping[str, dict[str, S]]:
        """The reactions of all massless pulleys that ropes run over."""
        return pulley_reactions(self.motion, self.multipliers)

    @cached_property
    def momenta(self) -> list[Momentum]:
        return body_momenta(self.motion)

    @cached_property
    def generalized_momenta(self) -> list[S]:
        """dT/du (nu)."""
        return generalized_momenta(self.motion)

    @cached_property
    def exertions(self) -> list[Exertion]:
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
        found: dict[str, S] = {}
        for row in ropes(self.motion.mechanism):  # the rope, or `rope.1`, `rope.2`, ... along its path
            found |= zip(row.asked, tensions(self.motion, self.multipliers, row), strict=True)
        return found


def quantities(motion: Motion, udot: Sequence[S], multipliers: Sequence[S], asked: Iterable[Node]) -> dict[Node, S]:
    """Return the values of `quantity` leaves over the motion's scalar; their names were verified with the model."""
    instant = StateQuantities(motion, udot, multipliers)
    return {leaf: _QUANTITIES[leaf.data[0]](instant, leaf.data[0], *leaf.data[1]) for leaf in asked}


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
    return trace.finish({"values": column(values)})


# ----------------------------------------------------------------------------------------------------------------------
# Quantities by family: each function takes the quantity's name and the words of its arguments.


def _axis_component(vector: Vec, axis: str) -> S:
    return vector[AXES.index(axis)]


def point_named(mechanism: Mechanism, name: str) -> Marker:
    """Return the point that a name stands for; a body alone stands for its centre of mass."""
    body, _, own = name.rpartition(".") if name not in mechanism.markers else (name, "", COM)
    return (centre_marker(mechanism, body) if own == COM else None) or mechanism.markers[body]


def centre_marker(mechanism: Mechanism, body: str) -> Marker | None:
    """Return the centre of mass of a body, None of ground and of what is no body."""
    marker = mechanism.markers.get(body)
    if marker is None or marker.body < 0 or mechanism.bodies[marker.body].name != body:
        return None
    return Marker(f"{body}.{COM}", marker.body, Pose(mechanism.bodies[marker.body].mass.com))


def _motion_of_point(instant: StateQuantities, quantity: str, point: str, axis: str) -> S:
    marker = point_named(instant.motion.mechanism, point)
    if quantity == "acceleration":
        return _axis_component(points.acceleration(instant.motion, marker, instant.bodies), axis)
    motion_of_point = points.position if quantity == "position" else points.velocity
    return _axis_component(motion_of_point(instant.motion, marker), axis)


def _turning_of_body(instant: StateQuantities, quantity: str, body: str, axis: str) -> S:
    index, local = instant.motion.mechanism.body_index(body), ZERO_VECTOR
    if index >= 0:
        is_velocity = quantity == "angular_velocity"
        local = instant.motion.bodies[index].w_WB if is_velocity else instant.bodies[index][1]
    return _axis_component(apply(instant.motion.rotation(index), local), axis)


def _orientation(instant: StateQuantities, quantity: str, frame: str, *asked: str) -> S:
    motion = instant.motion
    R = points.axes(motion, motion.mechanism.markers[frame])
    if quantity == "quaternion":
        return rotation_quaternion(R)[QUATERNION.index(asked[0])]
    k, *column = map(AXES.index, asked)
    if quantity == "rotation":
        return R[k][column[0]]
    j, k = (k + 1) % 3, (k + 2) % 3
    return atan2(R[k][j], R[j][j])


def _distance(instant: StateQuantities, _quantity: str, a: str, b: str) -> S:
    first, second = (points.position(instant.motion, point_named(instant.motion.mechanism, name)) for name in (a, b))
    difference = subtract(second, first)
    return sqrt(dot(difference, difference))


def _span_of_load(instant: StateQuantities, quantity: str, name: str) -> S:
    loads = instant.motion.mechanism.loads
    ends = next(load for load in loads if isinstance(load, PointPull) and load.name == name).ends
    length, direction = span(instant.motion, ends)
    return length if quantity == "span" else span_rate(instant.motion, ends, direction)


def _place_of_load(instant: StateQuantities, _quantity: str, name: str, axis: str) -> S:
    loads = instant.motion.mechanism.loads
    load = next(load for load in loads if isinstance(load, PlacePotential) and load.name == name)
    return _axis_component(place(load, instant.motion), axis)


def _reaction(instant: StateQuantities, _quantity: str, element: str, component: str) -> S:
    if element in instant.motion.mechanism.joint_names:
        return instant.reactions[element][component]
    if component not in COMPONENTS:
        return LawForces(instant.motion, instant.multipliers).component(element, component)
    return instant.pulleys[element][component] if element in instant.pulleys else 0


def _multiplier(instant: StateQuantities, quantity: str, name: str) -> S:
    """Return a tension or multiplier; zero where no motion goes along its row, which is left out in the plane."""
    if quantity == "tension" and name in instant.tensions:
        return instant.tensions[name]
    rows = {row.name: k for k, row in enumerate(instant.motion.mechanism.rows)}
    return instant.multipliers[rows[name]] if name in rows else 0


def _wrap(instant: StateQuantities, _quantity: str, name: str, pulley: str) -> S:
    """Return the angle of a wheel on which a run of rope lies, at its end with the run behind it."""
    every = list(ropes(instant.motion.mechanism))
    row = next(row for row in every if row.name == name)
    if row.path[-1].pulley == pulley:
        after = next(x for x in every if x.rope == row.rope and x.path[0].pulley == pulley)
        return wrap_between(instant.motion, row, after)
    return wrap_angle(instant.motion, row, next(k for k, bend in enumerate(row.path) if bend.pulley == pulley))


def _momentum(instant: StateQuantities, quantity: str, *asked: str) -> S:
    """Return a component of P or L of a body, or of all where the word for the system is no body's name."""
    if quantity == "center_of_mass":
        return _axis_component(centre_of_mass(instant.momenta), asked[-1])
    whole = asked[0] if len(asked) > 1 else SYSTEM
    names = [body.name for body in instant.motion.mechanism.bodies]
    parts = instant.momenta
    if whole != SYSTEM or whole in names:
        parts = [part for name, part in zip(names, parts, strict=True) if name == whole]
    if quantity == "momentum":
        return _axis_component(momentum(parts), asked[-1])
    about = ZERO_VECTOR
    if len(asked) > 2:
        is_own_centre = asked[1] == OWN_CENTRE and OWN_CENTRE not in instant.motion.mechanism.markers
        marker = None if is_own_centre else point_named(instant.motion.mechanism, asked[1])
        about = centre_of_mass(parts) if marker is None else points.position(instant.motion, marker)
    return _axis_component(angular_momentum(parts, about), asked[-1])


def _of_speed(instant: StateQuantities, quantity: str, freedom: str) -> S:
    """Return dT/du or udot of a speed, or of the speed that is a coordinate's rate; of a state its rate."""
    rates = {c.name: c.rate for c in instant.motion.mechanism.coordinates if c.rate is not None}
    if quantity == "'" and freedom in rates:
        return instant.motion.state.values([rates[freedom]])[0]
    named = f"generalized_momentum({freedom})" if quantity == "generalized_momentum" else f"{freedom}{quantity}"
    place = instant.motion.mechanism.speed_place(freedom)
    if place is None:
        raise ModelError(f"{named}: {freedom!r} is no speed here, and its rate is none", number="M112")
    return instant.generalized_momenta[place] if quantity == "generalized_momentum" else instant.udot[place]


def _energy(instant: StateQuantities, quantity: str, *store: str) -> S:
    """Return T of all or of a body, V of all, of the weight of a body or of the springs of one force, or T + V."""
    motion = instant.motion
    if quantity == "total_energy":
        return _energy(instant, "kinetic_energy") + _energy(instant, "potential_energy")
    names = [body.name for body in motion.mechanism.bodies]
    is_kinetic = quantity == "kinetic_energy"
    if not store or (store[0] == SYSTEM and SYSTEM not in names):
        return kinetic_energy(motion) if is_kinetic else potential_energy(motion)
    if is_kinetic or store[0] in names:
        index = names.index(store[0])
        if is_kinetic:
            return body_kinetic_energy(motion.bodies[index], motion.masses[index])
        return weight_energy(motion.poses[index], motion.masses[index], motion.gravity)
    own = [load for load in split(motion.mechanism.loads)[0] if load.name == store[0]]
    return sum((stored_energy(load, motion) for load in own), 0)


def _power(instant: StateQuantities, _quantity: str, name: str) -> S:
    return sum((each.power for each in instant.exerted_by(name)), 0)


def _force(instant: StateQuantities, _quantity: str, *asked: str) -> S:
    """Return the component of an element's force on all bodies together, or on one."""
    whole = asked[1] if len(asked) > 2 else SYSTEM
    names = [body.name for body in instant.motion.mechanism.bodies]
    total: Vec = ZERO_VECTOR
    for each in instant.exerted_by(asked[0]):
        if whole == SYSTEM and SYSTEM not in names:
            own = each.of_body
        else:
            own = [w if name == whole else NO_WRENCH for name, w in zip(names, each.of_body, strict=True)]
        total = add(total, resultant(instant.motion, own)[0])
    return _axis_component(total, asked[-1])


_QUANTITIES: Final[dict[str, Callable[..., S]]] = {
    **dict.fromkeys(("position", "velocity", "acceleration"), _motion_of_point),
    **dict.fromkeys(("angular_velocity", "angular_acceleration"), _turning_of_body),
    **dict.fromkeys(("rotation", "quaternion", "angle"), _orientation),
    "distance": _distance,
    **dict.fromkeys(("'", "''", "generalized_momentum"), _of_speed),
    **dict.fromkeys(("span", "span_rate"), _span_of_load),
    "place": _place_of_load,
    "reaction": _reaction,
    **dict.fromkeys(("tension", "multiplier"), _multiplier),
    "wrap": _wrap,
    **dict.fromkeys(("total_energy", "kinetic_energy", "potential_energy"), _energy),
    **dict.fromkeys(("center_of_mass", "momentum", "angular_momentum"), _momentum),
    "jacobi_integral": lambda instant, _: jacobi_integral(instant.motion),
    **dict.fromkeys(("power", "work"), _power),
    "impulse": _force,
}
"""Work and impulses add up along a run: their values here are their rates, power and force."""
