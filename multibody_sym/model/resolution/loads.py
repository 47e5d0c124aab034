"""What the declared forces are as loads on the bodies and speeds of the tree."""

from __future__ import annotations

from dataclasses import replace
from functools import singledispatch

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.bodies import Body, VariableMass
from multibody_sym.model.declaration.fields import Element
from multibody_sym.model.declaration.forces import (
    Coulomb,
    Damper,
    Drag,
    Force,
    Friction,
    Gravitation,
    Motor,
    Potential,
    Pull,
    SpringDamper,
    Torque,
)
from multibody_sym.model.mechanism.loads import (
    BodyTorque,
    JointForce,
    JointSpring,
    Load,
    MassFlow,
    PointDrag,
    PointForce,
    PointSpring,
)
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Pose, mass_of
from multibody_sym.model.resolution.potentials.loads import (
    coulomb_load,
    gravitation_load,
    potential_loads,
    pull_load,
)
from multibody_sym.model.resolution.references import References
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.traversal import leaves


def loads(references: References) -> list[Load]:
    """Return the loads of all declared forces."""
    made: list[Load | None] = []
    for name, element in references.system.forces.items():
        with at("forces", name):
            found = _load(element, name, references)
            made += found if isinstance(found, list) else [found]
    return [*(load for load in made if load is not None), *mass_flows(references)]


def mass_flows(references: References) -> list[Load]:
    """Return what leaves or joins bodies whose mass varies."""
    made: list[Load] = []
    for name, body in references.system.bodies.items():
        if body.varying is not None:
            with at("bodies", name, *(("mass",) if body.shape is None else ("shape", "mass"))):
                made.append(_flow(name, body, body.varying, references))
    return made


def _flow(name: str, body: Body, varying: VariableMass, references: References) -> Load:
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
    return MassFlow(name, references.numbers[name], velocity, relative is not None, axes, marker)


@singledispatch
def _load(element: Element, name: str, references: References) -> Load | list[Load] | None:
    raise TypeError(f"no load for {type(element).__name__}")


@_load.register
def _(element: Friction, name: str, references: References) -> None:
    """Return nothing: its force follows from the laws of what holds one way only."""


@_load.register
def _(element: Force, name: str, references: References) -> Load:
    axes, value = references.along(element.frame, element.value)
    return PointForce(name, _force_point(element, references), value, axes)


@_load.register
def _(element: Torque, name: str, references: References) -> Load:
    if isinstance(element.value, Node):
        freedom = references.freedom(element.joint or "", element.freedom)
        return JointForce(name, freedom.joint, freedom.rate, element.value)
    with at("on"):
        body = references.marker(element.on or "").body
        references.verify_turns(body)
    axes, value = references.along(element.frame, element.value)
    return BodyTorque(name, body, value, axes)


@_load.register
def _(element: Motor, name: str, references: References) -> Load:
    freedom = references.freedom(element.joint, element.freedom)
    per_current = element.gear * element.constant
    current = (element.voltage - per_current * freedom.rate) / element.resistance
    return JointForce(name, freedom.joint, freedom.rate, per_current * current)


@_load.register
def _(element: Drag, name: str, references: References) -> Load:
    return PointDrag(name, _force_point(element, references), element.linear, element.quadratic)


@_load.register
def _(element: Pull, name: str, references: References) -> Load:
    return pull_load(element, name, references)


@_load.register
def _(element: Potential, name: str, references: References) -> list[Load]:
    return potential_loads(element, name, references)


@_load.register
def _(element: Gravitation, name: str, references: References) -> Load:
    return gravitation_load(element, name, references)


@_load.register
def _(element: Coulomb, name: str, references: References) -> Load:
    return coulomb_load(element, name, references)


@_load.register
def _(element: SpringDamper, name: str, references: References) -> Load:
    return _spring(element, name, references, element.stiffness, element.length)


@_load.register
def _(element: Damper, name: str, references: References) -> Load:
    return _spring(element, name, references, ZERO, ZERO)


def _spring(
    element: SpringDamper | Damper, name: str, references: References, stiffness: Node, rest: Node
) -> Load:
    if element.joint is None:
        return PointSpring(name, references.pair(element.between or ()), stiffness, element.damping, rest)
    freedom = references.freedom(element.joint, element.freedom)
    if freedom.coordinate is None:
        with at("freedom"):
            raise ModelError(f"{element.freedom} has no coordinate that a spring or damper could act on")
    return JointSpring(name, freedom.joint, freedom.coordinate, freedom.rate, stiffness, element.damping, rest)


def _force_point(element: Force | Drag, references: References) -> Marker:
    with at("on"):
        marker = references.marker(element.on)
    if element.at is None:
        body = references.system.bodies.get(element.on)
        return marker if body is None else replace(marker, pose=Pose(mass_of(body).com))
    with at("at"):
        return references.own_marker(element.on, element.at)
