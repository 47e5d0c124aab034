"""Forms that masses tell: rockets, wagons and belts by what they lose or take in, tops, boxes and rods by moments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.model.bodies import Body, mass_of
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.joints import Fixed, Joint, Prismatic, Spherical
from multibody_sym.model.system import t
from multibody_sym.pictures.scene.items import (
    Block,
    ConeBody,
    Disc,
    Form,
    Item,
    Polyline,
    Sphere,
    Symbol,
    Vector,
    across,
    unit,
    vector,
)
from multibody_sym.pictures.scene.letters import driven_by, letters, steady_speed
from multibody_sym.pictures.scene.stage import PlacedSystem
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol

_UPRIGHT, _LEVEL = 0.9, 0.1
"""The cosine of the angle to gravity from which a way is upright, and up to which it is level."""
_ROCKET: Final = ((-1.0, -0.5), (-0.45, -0.3), (0.5, -0.3), (0.8, -0.18), (1.0, 0.0))
"""Half of the outline of a rocket, from its fins to its nose: ways along its axis in half lengths, across in widths."""
_SLENDER: Final = 0.3
"""The width of a rocket at its fins, in its length."""


def rocket_outline(length: float, width: float) -> Floats:
    """Return the outline (n, 2) of a rocket about its middle, the nose along the first axis."""
    half = np.array(_ROCKET) * (length / 2.0, width)
    return np.vstack([half, half[-2::-1] * (1.0, -1.0)])


def flow_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield what each body whose mass varies loses or takes in."""
    for name, body in stage.system.bodies.items():
        sign = _flow(stage, name, body)
        if sign is not None:
            lost = () if sign.kind != "jet" or body.varying is None else body.varying.relative_velocity or ()
            given = [node for node in lost if node.shadow != 0]
            found = letters(given[0]) if len(given) == 1 else ""  # the letter of the speed of what a rocket loses
            path = ("bodies", name, "mass")
            yield Item("flow", name, "", path, stage.number_of(name), sign, letters=found)


def _flow(stage: PlacedSystem, name: str, body: Body) -> Symbol | None:
    """Return the sign of a flow: a jet, a leak, what a hopper pours, mist, or the heap of which a chain is taken."""
    varying, down = body.varying, unit(stage.gravity @ stage.poses[stage.number_of(name)][:, :3])
    if varying is None:
        return None
    grows, place = _rate(stage, varying.value) > 0.0, stage.centre(name)
    if not grows:
        gas = jet_of(stage, name, body)
        if gas is not None:
            return Symbol("jet", _exit(stage, name, body), along=gas)
        rests = varying.relative_velocity is not None and not leads_on(stage, body)
        return Symbol("leak", place, along=down) if rests else None
    if any(node.shadow != 0 for node in varying.absolute_velocity or varying.relative_velocity or ()):
        return None
    if leads_on(stage, body):
        return Symbol("heap", vector(2.0 * np.array(place)), along=down)
    joint = stage.carrying(name)
    if isinstance(joint, Fixed) or joint is None:
        return None
    upright = abs(_steepness(stage, joint)) if isinstance(joint, Prismatic) else 1.0
    return Symbol("mist" if upright > _LEVEL else "hopper", place, along=down)


def jet_of(stage: PlacedSystem, name: str, body: Body) -> Vector | None:
    """Return the direction, in its axes, in which what a body loses leaves it; None where it drops off or joins."""
    varying = body.varying
    if varying is None or varying.relative_velocity is None or _rate(stage, varying.value) >= 0.0:
        return None
    way = np.array(stage.vector(varying.relative_velocity))
    if varying.frame is not None:
        place = stage.place(varying.frame)
        way = stage.turned(place.body, place.turned(way)) @ stage.poses[stage.number_of(name)][:, :3]
    return unit(way) if np.any(way) else None


def rocket(stage: PlacedSystem, name: str, body: Body) -> Symbol | Polyline | None:
    """Return the rocket that a jet drives: as long as from its nozzle to its centre of mass and on, else a sign."""
    gas, centre = jet_of(stage, name, body), np.array(stage.centre(name))
    if gas is None:
        return None
    reach = float((np.array(_exit(stage, name, body)) - centre) @ gas)
    if reach <= 0.0:
        return Symbol("rocket", vector(centre), along=vector(-np.array(gas)))
    ahead, side = -np.array(gas), np.array(across(gas))
    outline = rocket_outline(2.0 * reach, _SLENDER * 2.0 * reach)
    return Polyline(tuple(vector(centre + x * ahead + y * side) for x, y in outline), closed=True)


def _exit(stage: PlacedSystem, name: str, body: Body) -> Vector:
    """Return where what a body loses leaves it: at a point of its, else at its centre of mass."""
    at = None if body.varying is None else body.varying.at
    if at is None:
        return stage.centre(name)
    return stage.place(f"{name}.{at}" if at in body.points else at).point


def leads_on(stage: PlacedSystem, body: Body) -> bool:
    """Return whether the centre of mass of a body moves in it with coordinates, as that of a chain that runs on."""
    own = {symbol(each.name) for each in stage.mechanism.coordinates}
    return body.com is not None and not own.isdisjoint(leaves(body.com, "symbol"))


def _rate(stage: PlacedSystem, mass: Node) -> float:
    """Return the rate of a mass in time, else along the first coordinate on which it depends."""
    for leaf in (t, *(symbol(each.name) for each in stage.mechanism.coordinates)):
        rate = stage.number(derivative(mass, leaf))
        if rate:
            return rate
    return 0.0


# ----------------------------------------------------------------------------------------------------------------------
# What carries others or a flow along a level way on ground: wagons, belts, vehicles.


def ride_of(stage: PlacedSystem, name: str) -> str:
    """Return on what a body that runs along level ground rides: wheels, the rollers of a belt, or nothing.

    A belt moves steadily and takes something along or in. Wheels have vehicles whose motion is given, if something
    lies on them, and what runs freely and carries a pendulum or loses or takes in mass.
    """
    joint, body = stage.carrying(name), stage.declared(name)
    if not isinstance(joint, Prismatic) or not stage.is_ground(joint.parent):
        return ""
    if not np.any(stage.gravity) or abs(_steepness(stage, joint)) > _LEVEL:
        return ""
    (own,) = (key for key, each in stage.system.joints.items() if each is joint)
    motion, varying = driven_by(stage, own), body.varying
    ends = {end for _, _, contact in copies(stage.system.contacts) for end in contact.between}
    carries = any(f"{name}.{word}" in ends for word, surface in body.surfaces.items() if surface.kind == "plane")
    if motion is not None:
        takes_in = varying is not None and _rate(stage, varying.value) > 0.0
        belt = (carries or takes_in) and bool(steady_speed(stage, motion))
        return "belt" if belt else "wheels" if carries or _swings(stage, name) else ""
    rubs = any(friction.joint == own for friction in stage.system.frictions.values())
    free = not rubs and not carries and jet_of(stage, name, body) is None
    return "wheels" if free and (varying is not None or _swings(stage, name)) else ""


def rubbing_length(stage: PlacedSystem, joint: Joint) -> float:
    """Return how far apart the pads are by which a slider rubs, zero of one without."""
    mine = [x for x in stage.system.frictions.values() if stage.system.joints.get(x.joint) is joint]
    return max((stage.number(force.length) for force in mine if force.length is not None), default=0.0)


def is_upright(stage: PlacedSystem, joint: Prismatic) -> bool:
    """Return whether a slider goes up and down, on the page where there is no gravity."""
    place = stage.place(joint.parent)
    way = stage.turned(place.body, stage.axis(place, joint.steps[0].slides[0]))
    return abs(_steepness(stage, joint) if np.any(stage.gravity) else float(way[1])) > _UPRIGHT


def _swings(stage: PlacedSystem, name: str) -> bool:
    """Return whether a body carries a pendulum: one on a hinge that nothing else holds."""
    joints = stage.system.joints.values()

    def of(body: str) -> list[Any]:
        return [joint for joint in joints if body in map(stage.body, (joint.parent, joint.child))]

    hung = [joint for joint in of(name) if joint.kind == "revolute" and stage.body(joint.parent) == name]
    loops = any(joint.cut for joint in joints)
    return bool(hung) and len(of(name)) == 1 + len(hung) and not loops


def _steepness(stage: PlacedSystem, joint: Prismatic) -> float:
    """Return the cosine of the angle between the way of a slider and gravity."""
    place, size = stage.place(joint.parent), float(np.linalg.norm(stage.gravity))
    way = stage.turned(place.body, stage.axis(place, joint.steps[0].slides[0]))
    return float(way @ stage.gravity) / size if size else 0.0


# ----------------------------------------------------------------------------------------------------------------------
# The forms that the moments of inertia of a body without a shape tell: tops, boxes, discs, balls, rods.


_THIN: Final = 0.05
"""Below this part of its moment across, the moment about its axis is that of a rod."""
_THINNEST: Final = 0.03
_ALIKE: Final = 0.02
"""A rod with the moment of a body ends at a joint that is nearer to its end than this part of its length."""
_LUMP: Final = 0.15
"""A body whose radius of gyration is below this part of its arm is a lump at its end."""
_ECCENTRIC: Final = 0.2
"""The centre of mass of a wheel is nearer to its axle than this part of its radius of gyration."""
_UNIT: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def top(stage: PlacedSystem, name: str, body: Body) -> ConeBody | None:
    """Return the cone of a top: it stands on a point of its axis, about which it turns freely, and is no thin rod.

    Its centre of mass is at three quarters of its height, its radius that of a cone with its moment about the axis.
    """
    joint, mass = stage.carrying(name), stage.number(mass_of(body).mass)
    if joint is None or not isinstance(joint, Spherical) or not stage.is_ground(joint.parent) or body.inertia is None:
        return None
    moments = _tensor(stage, body)
    tip, centre = np.array(stage.place(joint.child).point), np.array(stage.centre(name))
    height = float(np.linalg.norm(centre - tip))
    if height == 0.0 or mass <= 0.0:
        return None
    axis = (centre - tip) / height
    if float(stage.turned(stage.number_of(name), axis) @ stage.gravity) >= 0.0:  # it hangs
        return None
    about, across = float(axis @ moments @ axis), (float(np.trace(moments)) - float(axis @ moments @ axis)) / 2.0
    round_ = np.allclose(moments, across * np.eye(3) + (about - across) * np.outer(axis, axis), atol=1e-9 * across)
    if not round_ or about < _THIN * across:
        return None
    radius = float(np.clip(np.sqrt(10.0 / 3.0 * about / mass), 0.3 * height, 1.2 * height))
    return ConeBody(vector(tip), vector(axis), radius, 4.0 / 3.0 * height)


def at_its_centre(stage: PlacedSystem, name: str, body: Body) -> Block | Disc | None:
    """Return the box with the moments of a body that flies in space, the disc with that of one that spins there."""
    joint, mass = stage.carrying(name), stage.number(mass_of(body).mass)
    if joint is None or body.inertia is None or mass <= 0.0 or moves_in_plane(stage.system):
        return None
    moments = np.array([stage.number(node) for node in body.inertia[:3]])
    centre, size = stage.centre(name), stage.lengths.get("size", 1.0)
    if joint.kind == "free" and any(moments):
        squares = 6.0 * (moments.sum() - 2.0 * moments) / mass
        largest = float(np.sqrt(max(squares)))
        sizes = np.sqrt(np.maximum(squares, (_THINNEST * largest) ** 2))
        return Block(centre, _UNIT, (float(sizes[0]), float(sizes[1]), float(sizes[2])))
    if joint.kind == "revolute":
        axis = stage.axis(stage.place(joint.child), joint.steps[0].turns[0])
        radius = float(np.sqrt(2.0 * float(moments @ np.square(axis)) / mass))
        return Disc(centre, axis, radius) if _THINNEST * size < radius < size else None
    return None


def on_an_arm(stage: PlacedSystem, name: str, body: Body, place: Vector, *, whole: bool) -> Iterator[Form]:
    """Yield the forms of a body that one place holds: a wheel out of balance, a ball on its arm, else a rod.

    The rod goes through its centre of mass and has its moment; it begins at its place, or behind it where that is
    within the rod. One that is not `whole` ends at its centre.
    """
    centre, joint = np.array(stage.centre(name)), stage.carrying(name)
    arm = float(np.linalg.norm(centre - place))
    mass, axis = stage.number(mass_of(body).mass), (centre - place) / arm
    moments = _tensor(stage, body)
    about = float(axis @ moments @ axis)
    across = float(moments[2, 2]) if moves_in_plane(stage.system) else (float(np.trace(moments)) - about) / 2.0
    gyration = float(np.sqrt(max(across, 0.0) / mass)) if mass > 0.0 else 0.0
    if arm < _ECCENTRIC * gyration and joint is not None and joint.kind == "revolute":
        axle = stage.axis(stage.place(joint.child), joint.steps[0].turns[0])
        large = stage.is_ground(joint.parent)  # one on a mass without a size has none
        yield Disc(place, axle, float(np.sqrt(2.0) * gyration)) if large else Symbol("rotor", place, axle)
        return
    radius = float(np.sqrt(2.5) * gyration)
    if across > 0.0 and np.allclose(moments, across * np.eye(3), atol=1e-9 * across) and radius < arm:
        yield Polyline((place, vector(centre - radius * axis)))
        yield Sphere(vector(centre), radius)
        return
    half = float(np.sqrt(3.0) * gyration)
    slender = moves_in_plane(stage.system) or about < _THIN * across
    is_rod = whole and slender and _LUMP * arm < half
    far = centre + half * axis if is_rod else centre
    within = is_rod and half > (1.0 + _ALIKE) * arm
    yield Polyline((vector(centre - half * axis) if within else place, vector(far)))


def rod_beyond(stage: PlacedSystem, name: str, body: Body, places: Sequence[Vector]) -> list[Vector]:
    """Return the places of a body, and the free end of the uniform rod that it is: it begins at one of them.

    In the plane, where all of them are on its line through the centre of mass.
    """
    mass, centre = stage.number(mass_of(body).mass), np.array(stage.centre(name))
    ways = np.array(places) - centre
    reach = np.linalg.norm(ways, axis=1)
    first = int(np.argmax(reach))
    if body.inertia is None or mass <= 0.0 or reach[first] == 0.0 or not moves_in_plane(stage.system):
        return [*places]
    half, axis = float(np.sqrt(3.0 * max(stage.number(body.inertia[2]), 0.0) / mass)), ways[first] / reach[first]
    on_line = float(np.abs(np.cross(ways, axis)).max()) < _ALIKE * half
    is_rod = on_line and abs(reach[first] - half) < _ALIKE * half
    bare = min(float((ways @ axis).min()) + half, half) > _ALIKE * half
    return [*places, vector(centre - half * axis)] if is_rod and bare else [*places]


def _tensor(stage: PlacedSystem, body: Body) -> Floats:
    """Return the moments of inertia of a body about its centre of mass (3, 3), in its axes."""
    assert body.inertia is not None
    xx, yy, zz, xy, xz, yz = (stage.number(node) for node in body.inertia)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
