"""Masses that vary: what they lose or take in, and the bodies that this makes them: rockets, wagons, belts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.model.bodies import Body
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.forces import Friction
from multibody_sym.model.joints import Fixed, Joint, Prismatic
from multibody_sym.model.system import t
from multibody_sym.pictures.scene.items import Item, Polyline, Symbol, Vector, across, unit, vector
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
            found = _jet_letter(body) if sign.kind == "jet" else ""
            path = ("bodies", name, "mass")
            yield Item("flow", name, "", path, stage.number_of(name), sign, letters=found)


def _flow(stage: PlacedSystem, name: str, body: Body) -> Symbol | None:
    """Return the sign of a flow: a jet, a leak, what a hopper pours, mist, or the heap of which a chain is taken."""
    varying, down = body.varying, _down(stage, name)
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


def _jet_letter(body: Body) -> str:
    """Return the letter of the speed of what a rocket loses."""
    assert body.varying is not None
    given = [node for node in body.varying.relative_velocity or () if node.shadow != 0]
    return letters(given[0]) if len(given) == 1 else ""


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


def _down(stage: PlacedSystem, name: str) -> Vector:
    """Return the direction of gravity in the axes of a body at the start."""
    return unit(stage.gravity @ stage.poses[stage.number_of(name)][:, :3])


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
    rubs = any(isinstance(force, Friction) and force.joint == own for force in stage.system.forces.values())
    free = not rubs and not carries and jet_of(stage, name, body) is None
    return "wheels" if free and (varying is not None or _swings(stage, name)) else ""


def rubbing_length(stage: PlacedSystem, joint: Joint) -> float:
    """Return how far apart the pads are by which a slider rubs, zero of one without."""
    rubbing = [force for force in stage.system.forces.values() if isinstance(force, Friction)]
    mine = [force for force in rubbing if stage.system.joints.get(force.joint) is joint]
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
