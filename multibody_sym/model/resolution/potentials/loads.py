"""The loads of potentials: their energy, and its slopes, which are the force."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.forces import Coulomb, Gravitation, Potential, Pull
from multibody_sym.model.mechanism.loads import (
    JointPotential,
    Load,
    PlacePotential,
    PointPull,
    place_leaves,
    span_leaves,
)
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import Pose, centre_moves, mass_of
from multibody_sym.model.resolution.references import BARE, References, moving_centre
from multibody_sym.model.resolution.spanning_tree import body_part, coordinate_names, speed_names
from multibody_sym.scalars.antiderivatives import antiderivative
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import ZERO, Node, symbol
from multibody_sym.scalars.traversal import leaves

_ELSEWHERE: Final = {
    "between": "the distance of the points; give one of coordinates in its joint (joint: ..)",
    "on": "the place x, y, z of the point; give one of coordinates in its joint (joint: ..)",
    "joint": "the coordinates of its joints; name the joints of the others too (joints: [..])",
}


def pull_load(element: Pull, name: str, references: References) -> Load:
    """Return a pull; of a law of the distance and parameters alone with its potential, where a rule finds one."""
    distance = span_leaves(name)[0]
    known = all(
        leaf is distance or (leaf.op == "slot" and leaf.data[0] == "parameters")
        for leaf in leaves([element.value], "slot", "quantity", "symbol")
    )
    potential = antiderivative(element.value, distance) if known else None
    return PointPull(name, references.pair(element.between), element.value, potential=potential)


def potential_loads(element: Potential, name: str, references: References) -> list[Load]:
    """Return the loads of a potential: one, or one for each joint that it is of."""
    if element.on is not None:
        return [_of_place(element, name, references)]
    if element.between is not None:
        _verify_names(element, "between", set(), references)
        return [_between(name, references.pair(element.between), element.value)]
    return _in_joints(element, name, references)


def gravitation_load(element: Gravitation, name: str, references: References) -> Load:
    """Return Newton's attraction of two bodies."""
    ends, masses = _centres(element.between, references), element.masses
    if masses is None:
        masses = tuple(_mass(i, reference, references) for i, reference in enumerate(element.between))
    strength = element.constant * masses[0] * masses[1]
    return _between(name, ends, -(strength / span_leaves(name)[0]))


def coulomb_load(element: Coulomb, name: str, references: References) -> Load:
    """Return the force between two charges."""
    strength = element.constant * element.charges[0] * element.charges[1]
    return _between(name, _centres(element.between, references), strength / span_leaves(name)[0])


def _between(name: str, ends: tuple[Marker, Marker], energy: Node) -> PointPull:
    return PointPull(name, ends, derivative(energy, span_leaves(name)[0]), potential=energy)


def _centres(between: tuple[str, ...], references: References) -> tuple[Marker, Marker]:
    """Return the markers of two points; of a body alone its centre of mass."""
    first, second = references.pair(between)
    return _centre(first, between[0], references), _centre(second, between[1], references)


def _centre(marker: Marker, reference: str, references: References) -> Marker:
    body = references.system.bodies.get(reference)
    if body is None:
        return marker
    if centre_moves(body, references.system.parameters):
        raise moving_centre(reference)
    return replace(marker, pose=Pose(mass_of(body).com))


def _mass(index: int, reference: str, references: References) -> Node:
    name, _ = body_part(reference, references.system.bodies)
    mass = mass_of(references.system.bodies.get(name, BARE)).mass
    if mass is ZERO:
        with at("between", index):
            raise ModelError(
                f"{name!r} has no mass that could attract; give both masses here, masses: [m1, m2]", number="M118"
            )
    return mass


# --- of a place -------------------------------------------------------------------------------------------------------


def _of_place(element: Potential, name: str, references: References) -> PlacePotential:
    _verify_names(element, "on", set(), references)
    with at("frame"):
        frame = references.marker(element.frame or "ground")
    x, y, z = (derivative(element.value, leaf) for leaf in place_leaves(name))
    return PlacePotential(name, _point(element, references), frame, element.value, (x, y, z))


def _point(element: Potential, references: References) -> Marker:
    """Return the point on which a potential depends: the centre of mass of a body where none is named."""
    on = element.on or ""
    with at("on"):
        marker = references.marker(on)
    if element.at is None:
        return _centre(marker, on, references)
    with at("at"):
        return references.own_marker(on, element.at)


# --- in joints --------------------------------------------------------------------------------------------------------


def _in_joints(element: Potential, name: str, references: References) -> list[Load]:
    names = (element.joint,) if element.joint is not None else element.joints or ()
    freedoms = {}
    for i, joint in enumerate(names):
        with at(*(("joint",) if element.joint is not None else ("joints", i))):
            freedoms[joint] = references.freedoms(joint)
    coordinates = {x.coordinate for each in freedoms.values() for x in each.values() if x.coordinate is not None}
    _verify_names(element, "joint", coordinates, references)
    found: list[Load] = []
    for joint, each in freedoms.items():
        slopes = [
            (x.rate, derivative(element.value, x.coordinate)) for x in each.values() if x.coordinate is not None
        ]
        own = tuple((rate, slope) for rate, slope in slopes if slope is not ZERO)
        found.append(JointPotential(name, joint, ZERO if found else element.value, own))
    return found


def _verify_names(element: Potential, place: str, own: set[Node], references: References) -> None:
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
