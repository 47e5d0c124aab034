"""Which loads are the declared forces, and what do they exert on the bodies and speeds of the tree?"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache, singledispatch
from typing import Final

from multibody_sym.errors import ModelError, NoSolutionError, Where, at
from multibody_sym.mechanics import load_records as records
from multibody_sym.mechanics.load_records import Load, arc_leaf, place_leaves, span_leaves
from multibody_sym.mechanics.mechanism import TIME, Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, State, coordinate_rates, pose
from multibody_sym.mechanics.points import (
    Wrench,
    Wrenches,
    add_force,
    add_force_at,
    add_pair,
    generalized_forces,
    position,
    velocity,
)
from multibody_sym.mechanics.references import BARE, References, moving_centre
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.mechanics.spanning_tree import body_part, coordinate_names, speed_names
from multibody_sym.model import forces as declared
from multibody_sym.model.bodies import GROUND, Body, Mass, Pose, VariableMass, centre_moves, mass_of
from multibody_sym.model.fields import AXES, Element, Point
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import antiderivative, derivative, gradient, tangents
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import absolute, evaluate, is_zero, sqrt, substitute
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    combination,
    cross,
    dot,
    negate,
    product,
    scale,
    subtract,
    symmetric,
)

# ----------------------------------------------------------------------------------------------------------------------
# Loads of declared forces. Those of potentials have an energy, and its slopes, which are the force.

_ELSEWHERE: Final = {
    "between": "the distance of the points; give one of coordinates in its joint (joint: ..)",
    "on": "the place x, y, z of the point; give one of coordinates in its joint (joint: ..)",
    "joint": "the coordinates of its joints; name the joints of the others too (joints: [..])",
}


def _distance_potential(name: str, ends: tuple[Marker, Marker], energy: Node) -> records.PointPull:
    return records.PointPull(name, ends, derivative(energy, span_leaves(name)[0]), potential=energy)


def _centres(between: tuple[str, ...], references: References) -> tuple[Marker, Marker]:
    first, second = references.pair(between)
    return _centre(first, between[0], references), _centre(second, between[1], references)


def _centre(marker: Marker, reference: str, references: References, *, fixed: bool = True) -> Marker:
    """Return the centre of mass of a body, or the point or frame that a reference names; `fixed`: it may not move."""
    body = references.system.bodies.get(reference)
    if body is None:
        return marker
    if fixed and centre_moves(body, references.system.parameters):
        raise moving_centre(reference)
    return replace(marker, pose=Pose(mass_of(body).com))


def _verify_names(element: declared.Potential, place: str, own: set[Node], references: References) -> None:
    """Raise ModelError where V names coordinates that are not its own, or speeds."""
    system = references.system
    coordinates = {q: n for n, joint in system.joints.items() for q in coordinate_names(n, joint)}
    speeds = {u for n, joint in system.joints.items() for u in speed_names(n, joint)}
    named = {references.slots.get(symbol(word), symbol(word)): word for word in (*coordinates, *speeds)}
    for leaf in leaves([element.value], "slot", "symbol"):
        word = named.get(leaf)
        if word is None or leaf in own:
            continue
        with at("value"):
            if word in speeds:
                raise ModelError(
                    f"{word!r} is a speed; a potential depends on places, inputs and the time alone", number="M113"
                )
            balls = place == "joint" and coordinates[word] in (element.joint, *(element.joints or ()))
            if balls:
                raise ModelError(
                    f"{word!r} has no speed of its own; give the potential by a point (on: .., at: ..)", number="M113"
                )
            other = f"{word!r} is a coordinate of joint {coordinates[word]!r}"
            raise ModelError(f"{other}; this is a potential of {_ELSEWHERE[place]}", number="M113")


def loads(references: References) -> list[Load]:
    """Return the loads of all declared forces, then the flows of bodies whose mass varies."""
    made: list[Load | None] = []
    for name, element in references.system.forces.items():
        with at("forces", name):
            found = _load(element, name, references)
            made += found if isinstance(found, list) else [found]
    for name, body in references.system.bodies.items():
        if body.varying is not None:
            with at("bodies", name, *(("mass",) if body.shape is None else ("shape", "mass"))):
                made.append(_mass_flow(name, body, body.varying, references))
    return [load for load in made if load is not None]


def _mass_flow(name: str, body: Body, varying: VariableMass, references: References) -> Load:
    if name == GROUND:
        raise ModelError("ground moves as prescribed, whatever its mass: give it none that varies", number="M118")
    relative, absolute = varying.relative_velocity, varying.absolute_velocity
    given = absolute if relative is None else relative
    assert given is not None
    axes, velocity = references.along(varying.frame or (GROUND if relative is None else name), given)
    marker = None
    if varying.at is not None:
        with at("at"):
            marker = references.own_marker(name, varying.at, chosen=False)
        mass = mass_of(body)
        moving = leaves([mass.mass, *mass.com, *mass.inertia], "slot", "symbol")
        if any(leaf.op == "symbol" or leaf.data[0] == "q" for leaf in moving):
            raise ModelError(
                "what all passes one point flows through the body, which is known of masses that vary with the time "
                "alone: leave out at, where a coordinate tells how much there is",
                number="M118",
            )
    return records.MassFlow(name, references.numbers[name], velocity, relative is not None, axes, marker)


@singledispatch
def _load(element: Element, name: str, references: References) -> Load | list[Load] | None:
    raise TypeError(f"no load for {type(element).__name__}")


@_load.register
def _(element: declared.Friction, name: str, references: References) -> None:
    """Return nothing: friction is an element with a law."""


@_load.register
def _(element: declared.Force, name: str, references: References) -> Load:
    axes, value = references.along(element.frame, element.value)
    return records.PointForce(name, _point_on(element.on, element.at, references, fixed=False), value, axes)


@_load.register
def _(element: declared.Distributed, name: str, references: References) -> Load:
    ends = []
    for k, point in enumerate(element.between):
        with at("between", k):
            ends.append(references.own_marker(element.on, point))
    way = subtract(ends[1].pose.position, ends[0].pose.position)
    along = [x for x in way if x is not ZERO]
    if not along:
        with at("between"):
            raise ModelError("both points are at the same place; name both ends of the line", number="M118")
    length = absolute(along[0]) if len(along) == 1 else sqrt(dot(way, way))
    axes, value = references.along(element.frame, element.value)
    forces, moments = (_integrals(value, arc_leaf(name), factor) for factor in (ONE, arc_leaf(name)))
    return records.LineLoad(name, (ends[0], ends[1]), value, axes, forces, moments, length)


def _integrals(value: Point, s: Node, factor: Node) -> Point:
    """Return the integrals of factor*value from 0 to s, component by component."""
    found = []
    for k, component in enumerate(value):
        whole = antiderivative(component * factor, s)
        if whole is None:
            with at("value", k):
                raise ModelError(
                    "no rule finds the integral of this over s; give a polynomial in s, or sines of s", number="M118"
                )
        found.append(whole - substitute(whole, {s: ZERO}))
    return found[0], found[1], found[2]


@_load.register
def _(element: declared.Torque, name: str, references: References) -> Load:
    if element.on_body is None:
        freedom = references.freedom(element.joint or "", element.freedom)
        return records.JointForce(name, freedom.joint, freedom.rate, as_node(element.value))
    with at("on"):
        body = references.marker(element.on or "").body
        references.verify_turns(body)
    axes, value = references.along(element.frame, element.on_body)
    marker = None
    if element.at is not None:
        with at("at"):
            marker = references.own_marker(element.on or "", element.at)
    return records.BodyTorque(name, body, value, axes, marker)


@_load.register
def _(element: declared.Motor, name: str, references: References) -> Load:
    freedom = references.freedom(element.joint, element.freedom)
    per_current = element.gear * element.constant
    current = (element.voltage - per_current * freedom.rate) / element.resistance
    return records.JointForce(name, freedom.joint, freedom.rate, per_current * current)


@_load.register
def _(element: declared.Drag, name: str, references: References) -> Load:
    point = _point_on(element.on, element.at, references, fixed=False)
    return records.PointDrag(name, point, element.linear, element.quadratic)


@_load.register
def _(element: declared.Pull, name: str, references: References) -> Load:
    """Return a pull; of a law of the distance and parameters alone with its potential, where a rule finds one."""
    distance = span_leaves(name)[0]
    known = all(
        leaf is distance or (leaf.op == "slot" and leaf.data[0] == "parameters")
        for leaf in leaves([element.value], "slot", "quantity", "symbol")
    )
    potential = antiderivative(element.value, distance) if known else None
    return records.PointPull(name, references.pair(element.between), element.value, potential=potential)


@_load.register
def _(element: declared.Potential, name: str, references: References) -> list[Load]:
    """Return the loads of a potential: one, or one for each joint that it is of."""
    if element.on is not None:
        _verify_names(element, "on", set(), references)
        with at("frame"):
            frame = references.marker(element.frame or "ground")
        point = _point_on(element.on, element.at, references)
        x, y, z = (derivative(element.value, leaf) for leaf in place_leaves(name))
        return [records.PlacePotential(name, point, frame, element.value, (x, y, z))]
    if element.between is not None:
        _verify_names(element, "between", set(), references)
        return [_distance_potential(name, references.pair(element.between), element.value)]
    names = (element.joint,) if element.joint is not None else element.joints or ()
    freedoms = {}
    for i, joint in enumerate(names):
        with at(*(("joint",) if element.joint is not None else ("joints", i))):
            freedoms[joint] = references.freedoms(joint)
    coordinates = {x.coordinate for each in freedoms.values() for x in each.values() if x.coordinate is not None}
    _verify_names(element, "joint", coordinates, references)
    found: list[Load] = []
    for joint, each in freedoms.items():
        slopes = [(x.rate, derivative(element.value, x.coordinate)) for x in each.values() if x.coordinate is not None]
        own = tuple((rate, slope) for rate, slope in slopes if slope is not ZERO)
        found.append(records.JointPotential(name, joint, ZERO if found else element.value, own))
    return found


@_load.register
def _(element: declared.Gravitation, name: str, references: References) -> Load:
    """Return Newton's attraction of two bodies."""
    ends, masses = _centres(element.between, references), element.masses
    if masses is None:
        found = []
        for index, reference in enumerate(element.between):
            body, _ = body_part(reference, references.system.bodies)
            found.append(mass_of(references.system.bodies.get(body, BARE)).mass)
            if found[-1] is ZERO:
                message = f"{body!r} has no mass that could attract; give both masses here, masses: [m1, m2]"
                with at("between", index):
                    raise ModelError(message, number="M118")
        masses = tuple(found)
    strength = element.constant * masses[0] * masses[1]
    return _distance_potential(name, ends, -(strength / span_leaves(name)[0]))


@_load.register
def _(element: declared.Coulomb, name: str, references: References) -> Load:
    """Return the force between two charges."""
    strength = element.constant * element.charges[0] * element.charges[1]
    return _distance_potential(name, _centres(element.between, references), strength / span_leaves(name)[0])


@_load.register
def _(element: declared.SpringDamper, name: str, references: References) -> Load:
    return _spring_load(element, name, references, element.stiffness, element.length)


@_load.register
def _(element: declared.Damper, name: str, references: References) -> Load:
    return _spring_load(element, name, references, ZERO, ZERO)


def _spring_load(
    element: declared.SpringDamper | declared.Damper, name: str, references: References, stiffness: Node, rest: Node
) -> Load:
    if element.joint is None:
        return records.PointSpring(name, references.pair(element.between or ()), stiffness, element.damping, rest)
    freedom = references.freedom(element.joint, element.freedom)
    if freedom.coordinate is None:
        with at("freedom"):
            raise ModelError(f"{element.freedom} has no coordinate that a spring or damper could act on")
    return records.JointSpring(name, freedom.joint, freedom.coordinate, freedom.rate, stiffness, element.damping, rest)


def _point_on(on: str, point: str | None, references: References, *, fixed: bool = True) -> Marker:
    """Return the point `at` of what stands under `on`, or its centre of mass."""
    with at("on"):
        marker = references.marker(on)
    if point is None:
        return _centre(marker, on, references, fixed=fixed)
    with at("at"):
        return references.own_marker(on, point)


# ----------------------------------------------------------------------------------------------------------------------
# The names of their own in laws: `distance`, `distance_rate` of pulls; x, y, z of a place; s along a line.

_DISTANCE = (symbol("distance"), symbol("distance_rate"))
_ARC = symbol("s")
_AND_NOT_JOINTS = "; rename the latter"
_OR_IN_JOINT = "; rename the latter, or give the potential in the joint (joint: ..) where its coordinates are meant"


def with_own_names(system: System, names: Mapping[str, str]) -> System:
    """Return the system with the own names in laws of forces replaced by the leaves that stand for them.

    Raises ModelError where the model calls something else so too.
    """
    changed: dict[str, Element] = {}
    for name, element in system.forces.items():
        if not isinstance(element, (declared.Pull, declared.Potential, declared.Distributed)):
            continue
        # the leaf of each name that the element's law has for itself
        if isinstance(element, declared.Distributed):
            own = {_ARC: arc_leaf(name)}
        elif isinstance(element, declared.Pull):
            own = dict(zip(_DISTANCE, span_leaves(name), strict=True))
        elif element.between is not None:
            own = {_DISTANCE[0]: span_leaves(name)[0]}
        elif element.on is not None:
            own = dict(zip(map(symbol, AXES), place_leaves(name), strict=True))
        else:
            own = {}
        placed = isinstance(element, declared.Potential) and element.on is not None
        along = isinstance(element, declared.Distributed)
        laws = element.value if isinstance(element, declared.Distributed) else (element.value,)
        for leaf in leaves(laws, "symbol"):
            if leaf in own and leaf.data in names:
                with at("forces", name, "value"):
                    also, advice = names[leaf.data], _OR_IN_JOINT if placed else _AND_NOT_JOINTS
                    what = "the distance from the first point" if along else f"that of the point{'' if placed else 's'}"
                    raise ModelError(f"{leaf.data!r} is {what} here and {also} too{advice}", number="M113")
        meant = {leaf: own.get(leaf, leaf) for leaf in leaves(laws, "symbol", "slot", "quantity")}
        values = evaluate(laws, meant)
        changed[name] = element.with_fields({"value": tuple(values) if along else values[0]})
    return replace(system, forces={**system.forces, **changed}) if changed else system


# ----------------------------------------------------------------------------------------------------------------------
# What loads exert, as wrenches on bodies and forces on speeds.

TINY: Final = 1e-300
"""The term beside v^2 with which |v| has a derivative at v = 0; everywhere else it is rounded away."""


@dataclass(frozen=True)
class AppliedForces:
    """Applied forces: a wrench for each body (body axes, about its origin) and a force for each speed."""

    of_body: list[Wrench]
    of_speed: list[S]


def applied_forces(motion: Motion, loads: Iterable[Load] | None = None, *, weight: bool = True) -> AppliedForces:
    """Return the wrenches and forces of loads (default: all), and of weight if asked for, at a state."""
    wrenches = Wrenches(len(motion.bodies))
    of_speed: list[S] = [0] * len(motion.state.u)
    for load in motion.mechanism.loads if loads is None else loads:
        with at(*load.path):
            exert(load, motion, wrenches, of_speed)
    for index, (moved, mass) in enumerate(zip(motion.bodies, motion.masses, strict=True) if weight else ()):
        force = scale(mass.mass, moved.gravity)
        wrenches.add(index, force, cross(mass.com, force))
    return AppliedForces(wrenches.of_body, of_speed)


def applied_generalized_forces(motion: Motion, forces: AppliedForces) -> list[S]:
    """Return the generalised forces of applied wrenches and joint forces together (nu)."""
    projected = generalized_forces(motion, forces.of_body)
    return [a + b for a, b in zip(projected, forces.of_speed, strict=True)]


@singledispatch
def exert(load: Load, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    raise TypeError(f"no force law for {type(load).__name__}")


@exert.register
def _(load: records.PointForce, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    add_force(wrenches, motion, load.at, apply(motion.rotation(load.axes), motion.state.vector(load.value)))


@exert.register
def _(load: records.LineLoad, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    """Add its resultant and moment as two forces at its ends: F - G/L and G/L, with F and G its integrals over L."""
    (length,) = motion.state.values([load.length])
    force, moment = line_integrals(load, motion, length)
    far = scale(1 / length, moment)
    add_force(wrenches, motion, load.ends[0], subtract(force, far))
    add_force(wrenches, motion, load.ends[1], far)


def line_integrals(load: records.LineLoad, motion: Motion, s: S) -> tuple[Vec, Vec]:
    """Return the integrals of a load and of s times it from 0 to s (N and N m), in world axes."""
    known = {arc_leaf(load.name): s}
    x, y, z, mx, my, mz = motion.state.values([*load.forces, *load.moments], known)
    turned = motion.rotation(load.axes)
    return apply(turned, (x, y, z)), apply(turned, (mx, my, mz))


@exert.register
def _(load: records.BodyTorque, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    world = apply(motion.rotation(load.axes), motion.state.vector(load.value))
    wrenches.add(load.body, ZERO_VECTOR, apply_transposed(motion.rotation(load.body), world))


@exert.register
def _(load: records.JointForce, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    add_drive(motion, load.rate, motion.state.values([load.value])[0], of_speed)


@exert.register
def _(load: records.JointSpring, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    stiffness, damping, rest = motion.state.values([load.stiffness, load.damping, load.rest])
    coordinate, rate = motion.state.values([load.coordinate, load.rate])
    add_drive(motion, load.rate, -(stiffness * (coordinate - rest) + damping * rate), of_speed)


def add_drive(motion: Motion, rate: Node, force: S, of_speed: list[S]) -> None:
    """Add a generalised force on a rate that is linear in the speeds: force d(rate)/du_k on each of them."""
    speeds = [leaf for leaf in leaves([rate], "slot") if leaf.data[0] == "u"]
    for leaf, slope in zip(speeds, motion.state.values(gradient(rate, speeds)), strict=True):
        of_speed[leaf.data[1]] = of_speed[leaf.data[1]] + slope * force


@exert.register
def _(load: records.PointSpring, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    stiffness, damping, rest = motion.state.values([load.stiffness, load.damping, load.length])
    if load.length is ZERO and load.damping is ZERO:  # F = k d, which has a value where the points coincide
        add_pair(wrenches, motion, load.ends, scale(stiffness, apart(motion, load.ends)))
        return
    length, direction = span(motion, load.ends, load.straight)
    pull = stiffness * (length - rest) + damping * span_rate(motion, load.ends, direction)
    add_pair(wrenches, motion, load.ends, scale(pull, direction))


@exert.register
def _(load: records.PointPull, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    length, direction = span(motion, load.ends, load.straight)
    known = zip(span_leaves(load.name), (length, span_rate(motion, load.ends, direction)), strict=True)
    (pull,) = motion.state.values([load.value], dict(known))
    add_pair(wrenches, motion, load.ends, scale(pull, direction))


@exert.register
def _(load: records.JointPotential, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    for rate, slope in load.slopes:
        add_drive(motion, rate, -motion.state.values([slope])[0], of_speed)


@exert.register
def _(load: records.PlacePotential, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    x, y, z = motion.state.values(load.slopes, own_leaves(load, motion))
    force = apply(_axes_of(motion, load.frame), scale(-1, (x, y, z)))
    add_force(wrenches, motion, load.at, force)
    add_force_at(wrenches, motion, load.frame.body, position(motion, load.at), negate(force))


def own_leaves(load: Load, motion: Motion) -> dict[Node, S]:
    """Return the values of the leaves that a potential has of its own: a distance, a place."""
    if isinstance(load, records.PointPull):
        return {span_leaves(load.name)[0]: span(motion, load.ends, load.straight)[0]}
    if isinstance(load, records.PlacePotential):
        return dict(zip(place_leaves(load.name), place(load, motion), strict=True))
    return {}


def place(load: records.PlacePotential, motion: Motion) -> Vec:
    """Return the place of the point on which a potential depends, in its frame."""
    return apply_transposed(_axes_of(motion, load.frame), apart(motion, (load.frame, load.at)))


def _axes_of(motion: Motion, frame: Marker) -> Mat:
    return product(motion.rotation(frame.body), pose(motion.state, frame.pose)[0])


@exert.register
def _(load: records.PointDrag, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    linear, quadratic = motion.state.values([load.linear, load.quadratic])
    v = velocity(motion, load.at)
    if load.quadratic is ZERO:
        factor = linear
    else:  # |v| with the derivative zero where v is zero
        parts = [x for x in v if not is_zero(x)]
        single = absolute(parts[0]) if parts else 0
        factor = linear + quadratic * (single if len(parts) < 2 else sqrt(dot(v, v) + TINY))
    add_force(wrenches, motion, load.at, scale(-factor, v))


@exert.register
def _(load: records.MassFlow, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    wrenches.add(load.body, *flow_wrench(load, motion))


def span_rate(motion: Motion, ends: tuple[Marker, Marker], direction: Vec) -> S:
    """Return the rate of the distance of two markers, given the unit vector from the first to the second."""
    return dot(direction, subtract(velocity(motion, ends[1]), velocity(motion, ends[0])))


def span(motion: Motion, ends: tuple[Marker, Marker], straight: Point | None = None) -> tuple[S, Vec]:
    """Return the distance of two markers and the unit vector from the first to the second (world axes).

    `straight` is that vector where it is known and constant.
    """
    difference = apart(motion, ends)
    if straight is not None:
        direction = motion.state.vector(straight)
        return dot(direction, difference), direction
    length = sqrt(dot(difference, difference))
    return length, (difference[0] / length, difference[1] / length, difference[2] / length)


def apart(motion: Motion, ends: tuple[Marker, Marker]) -> Vec:
    """Return the vector from the first marker to the second (world axes)."""
    return subtract(position(motion, ends[1]), position(motion, ends[0]))


# ----------------------------------------------------------------------------------------------------------------------
# What a wire exerts on its bead across itself.


def force_across(body: TreeBody, state: State, force: Vec) -> S | None:
    """Return the part of a joint's force (axes of its frame on the parent) across the curve on which it guides, if any.

    Of a curve in its x-y plane the component along the normal, z x tangent: to the left of the way; of one in space the
    size of the force across it.
    """
    step = body.steps[0].curve if body.steps else None
    if step is None:
        return None
    (s,) = [state.q[body.q[0]]] if step.motion is None else state.values([step.motion])
    axes = [(x, y, z) for x, y, z in (state.values(axis) for axis in step.axes)]
    if step.place[2] is ZERO:
        cosine, sine = state.values(step.tangent, {step.leaf: s})
        return cosine * dot(axes[1], force) - sine * dot(axes[0], force)
    way = combination(axes, state.values(step.rates.s, {step.leaf: s}))
    across = subtract(force, scale(dot(way, force) / dot(way, way), way))
    return sqrt(dot(across, across))


# ----------------------------------------------------------------------------------------------------------------------
# How does mass that leaves or joins a body act on it (Meshchersky)? The body moves like the rigid one of the instant.
#
#     m a_C = F + Phi,    J omega' + omega x J omega = M_C + M_Phi
#
# a_C is the acceleration of the body's point at which the centre of mass is, m and J are those of the instant. Where
# each particle leaves or joins where the declared mass loses or gains it, Phi = m' u, with the moment (m c)' x u about
# the origin, u the relative velocity; at rest in space, or at any velocity a of its own, u = a - v of each particle's
# place.
#
# Where all of it passes one point P, what is lost elsewhere flows there: with d = P - c and p = m c' - m' d, the
# momentum of that flow in the body (control volume; no swirl about the centre of mass),
#
#     Phi = m' u - 2 omega x p - p',    M_Phi = d x m' u + m' d x (omega x d) - J' omega - c' x p
#
# of which the second and the third term of the moment are the jet damping of a rocket; primes are rates in body axes.
# Source: Meshchersky 1897 for Phi; the control volume is Reynolds' transport theorem on force and moment of momentum.


# ----------------------------------------------------------------------------------------------------------------------
# How fast a body's mass, centre of mass and inertia change, and momentum and energy by that alone.

Spatial = tuple[Vec, Vec]
"""(linear, angular) in body axes, about the body's origin."""
_ONCE: Final = 1


@dataclass(frozen=True)
class MassRates:
    """Rates in body axes: of the mass `m`, of m c (`static`), of the centre of mass c and of the inertia about it."""

    mass: S
    static: Vec
    centre: Vec
    inertia: Mat


def varies(body: TreeBody) -> bool:
    """Return whether a body's mass, centre of mass or inertia changes along a motion."""
    return bool(body.mass.moving_leaves)


def varies_with_time(body: TreeBody) -> bool:
    """Return whether they change though nothing moves."""
    return TIME in body.mass.moving_leaves


def verify_kept(mechanism: Mechanism) -> None:
    """Raise NoSolutionError where a mass changes with the time: nothing is at rest for long then."""
    for body in filter(varies_with_time, mechanism.bodies):
        raise NoSolutionError(
            f"the mass of {body.name} changes with the time, so that what rests at t = 0 may not go on resting; find "
            "equilibria with a constant mass, or one that depends on coordinates alone",
            where=Where(path=("bodies", body.name)),
            number="N110",
        )


def mass_rates(motion: Motion, index: int) -> MassRates:
    """Return the rates of a body's mass at a state."""
    mechanism = motion.mechanism
    mass = mechanism.bodies[index].mass
    named = mass.moving_leaves
    along: dict[Node, Node] = {TIME: ONE} if TIME in named else {}  # the rates of the time and of coordinates in slots
    if any(leaf.data[0] == "q" for leaf in named):
        q = [slot("q", k) for k in range(len(mechanism.coordinates))]
        u = [slot("u", k) for k in range(len(mechanism.speeds))]
        rates = map(as_node, coordinate_rates(mechanism, q, u))
        along.update((leaf, rate) for leaf, rate in zip(q, rates, strict=True) if leaf in named)
    m, sx, sy, sz, cx, cy, cz, *J = motion.state.values(_rates(mass, tuple(along.items()), _ONCE))
    return MassRates(m, (sx, sy, sz), (cx, cy, cz), symmetric(J))


@lru_cache(maxsize=1024)
def _rates(mass: Mass, along: tuple[tuple[Node, Node], ...], times: int) -> tuple[Node, ...]:
    """Return time derivatives of m, m c, c and the inertia, given the rates of the leaves that they name."""
    found = [mass.mass, *(mass.mass * x for x in mass.com), *mass.com, *mass.inertia]
    for _ in range(times):
        found = tangents(found, dict(along))
    return tuple(found)


def carried_momentum(motion: Motion, index: int) -> Spatial:
    """Return the rate at which the momentum of a body, and that about its origin, change with its mass alone.

    That is (dI/dt) V of the spatial inertia I, the velocities V held.
    """
    rates, mass, moved = mass_rates(motion, index), motion.masses[index], motion.bodies[index]
    w, v_com = moved.w_WB, add(moved.v_WB, cross(moved.w_WB, mass.com))
    force = add(scale(rates.mass, v_com), scale(mass.mass, cross(w, rates.centre)))
    turning = add(apply(rates.inertia, w), scale(mass.mass, cross(rates.centre, v_com)))
    return force, add(turning, cross(mass.com, force))


def carried_energy(motion: Motion, index: int) -> S:
    """Return the rate at which the kinetic energy of a body changes with its mass alone: V . (dI/dt) V / 2."""
    moved, (linear, angular) = motion.bodies[index], carried_momentum(motion, index)
    return (dot(moved.v_WB, linear) + dot(moved.w_WB, angular)) / 2


def carried_by_flows(motion: Motion, loads: Iterable[Load]) -> S:
    """Return the rate at which T + V change with the masses of bodies alone, of those loads that are flows of mass."""
    flows = [load.body for load in loads if isinstance(load, records.MassFlow)]
    return sum((carried_energy(motion, k) + carried_weight(motion, k) for k in flows), 0)


def carried_weight(motion: Motion, index: int) -> S:
    """Return the rate at which the potential energy of a body's weight changes with its mass alone."""
    rates, (R, p) = mass_rates(motion, index), motion.poses[index]
    return -dot(motion.gravity, add(scale(rates.mass, p), apply(R, rates.static)))


def flow_wrench(flow: records.MassFlow, motion: Motion) -> Spatial:
    """Return force and moment (body axes, about the origin) of mass that leaves or joins a body."""
    velocity = motion.state.vector(flow.velocity)
    if flow.axes != flow.body:
        world = apply(motion.rotation(flow.axes), velocity)
        velocity = apply_transposed(motion.rotation(flow.body), world)
    if flow.at is not None:
        return _wrench_through(flow.at, velocity, flow.relative, motion)
    rates = mass_rates(motion, flow.body)
    force, moment = scale(rates.mass, velocity), cross(rates.static, velocity)
    if flow.relative:
        return force, moment
    carried = carried_momentum(motion, flow.body)
    return subtract(force, carried[0]), subtract(moment, carried[1])


def _wrench_through(at: Marker, velocity: Vec, relative: bool, motion: Motion) -> Spatial:
    rates, mass, moved = mass_rates(motion, at.body), motion.masses[at.body], motion.bodies[at.body]
    w, point = moved.w_WB, motion.point(at)
    u = velocity if relative else subtract(velocity, add(moved.v_WB, cross(w, point)))
    d = subtract(point, mass.com)
    inner = subtract(rates.static, scale(rates.mass, point))
    declared = motion.mechanism.bodies[at.body].mass  # it varies with the time alone
    mass_rate_2, x, y, z, *_ = motion.state.values(_rates(declared, ((TIME, ONE),), _ONCE + 1))
    growing = subtract((x, y, z), scale(mass_rate_2, point))
    thrust = scale(rates.mass, u)
    force = subtract(subtract(thrust, scale(2, cross(w, inner))), growing)
    damping = subtract(scale(rates.mass, cross(d, cross(w, d))), apply(rates.inertia, w))
    about_com = subtract(add(cross(d, thrust), damping), cross(rates.centre, inner))
    return force, add(about_com, cross(mass.com, force))
