"""Hints: what a declaration says that is allowed, and that its author may not have meant.

They need no mechanism, so that every command has them. A hint names its element, the cause and what to write.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from multibody_sym.checking.hint import Hint, first_at_each_place
from multibody_sym.checking.odd_numbers import EXACT, Values, known_values, number_hints
from multibody_sym.dynamics.start.undefined import value_or_none
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.constraints import Gear, Pulley, Rope
from multibody_sym.model.declaration.contacts import copies
from multibody_sym.model.declaration.forces import Drag, Motor, Torque
from multibody_sym.model.declaration.joints import Prismatic, Revolute
from multibody_sym.model.declaration.system import System, expressions, states_gravity
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.traversal import leaves

_NEARLY: Final = math.radians(20.0)


def declared_hints(system: System) -> list[Hint]:
    """Return what the declaration alone suggests was forgotten or confused."""
    known = known_values(system)
    return [
        *_bodies(system),
        *_gravity(system),
        *_unused(system),
        *number_hints(system, known),
        *_without_effect(system),
        *_slow_sides(system, known),
        *_oblique_ropes(system, known),
        *_doubled_joints(system),
        *first_at_each_place(_doubled_contacts(system)),
        *_nearly_parallel(system, known),
        *first_at_each_place(_pulled_off(system, known)),
    ]


def _bodies(system: System) -> Iterator[Hint]:
    if not set(system.bodies) - {GROUND}:
        yield Hint("no body is declared, and nothing moves; write bodies: {bob: {mass: 1 kg}} or the like", "bodies")


def _gravity(system: System) -> Iterator[Hint]:
    if not states_gravity(system) and any(_has_mass(body) for body in system.bodies.values()):
        told = "no gravity is declared; write gravity: [0, -9.81, 0] or the like, [0, 0, 0] if there is none"
        yield Hint(told, "gravity")


def _has_mass(body: Body) -> bool:
    return body.mass is not None or body.shape is not None


def _pulled_off(system: System, known: Values) -> Iterator[Hint]:
    """Yield contacts with planes of the ground off which gravity pulls what nothing else acts on."""
    gravity = [value_or_none(x, known) for x in system.gravity]
    ends = (getattr(force, "on", None) for force in system.forces.values())
    pushed = {body_part(end, system.bodies)[0] for end in ends if isinstance(end, str)}
    for declared, _, contact in copies(system.contacts):
        first, second = contact.between
        body, part = body_part(second, system.bodies)
        surface = system.bodies[body].surfaces.get(part) if body == GROUND and body in system.bodies else None
        if surface is None or surface.plane is None or contact.open:
            continue
        normal = [value_or_none(x, known) for x in surface.normal]
        if None in (*gravity, *normal) or body_part(first, system.bodies)[0] in pushed:
            continue
        along = sum((a or 0.0) * (b or 0.0) for a, b in zip(gravity, normal, strict=True))
        if along > EXACT * math.hypot(*(a or 0.0 for a in gravity)):
            yield Hint(
                f"gravity pulls {first} off {second}: its normal points out of its body, to where the other one is; if "
                "the ramp is to carry it turn the normal round, as in normal: [-sin(a), cos(a), 0]",
                "contacts",
                declared,
            )


def _unused(system: System) -> Iterator[Hint]:
    """Yield parameters, inputs and pulleys that nothing uses, and bodies without mass where one is needed."""
    named = {
        leaf.data
        for path, node, _ in expressions(system)
        for leaf in leaves([node], "symbol")
        if path[:2] != ("parameters", leaf.data)
    }
    for section, what in (("parameters", "parameter"), ("inputs", "input")):
        unused = (name for name in getattr(system, section) if name not in named)
        yield from (Hint(f"{what} {name} is not used", section, name) for name in unused)
    ropes = [step for c in system.constraints.values() if isinstance(c, Rope) for step in c.path]
    idle = (name for name in system.pulleys if name not in ropes)
    yield from (Hint(f"no rope runs over pulley {name}", "pulleys", name) for name in idle)
    joints = system.joints.values()
    carriers = [joint.parent for joint in joints]
    driven = {body_part(x.child, system.bodies)[0] for x in joints if x.steps and not x.free_steps}
    for name, body in system.bodies.items():
        turns_only = body.inertia is not None and body.com is None
        if name == GROUND or _has_mass(body) or turns_only or name in driven:
            continue
        if not any(parent == name or parent.startswith(f"{name}.") for parent in carriers):
            told = f"body {name} has no mass; give it one (mass: 1 kg), or a shape with a mass"
            yield Hint(told, "bodies", name)


def _without_effect(system: System) -> Iterator[Hint]:
    """Yield a mass of ground, drag without coefficients, forces and rods within a body."""
    ground = system.bodies.get(GROUND)
    if ground is not None and _has_mass(ground):
        told = "ground does not move by forces, so that its mass changes nothing; what moves is a body of another name"
        yield Hint(told, "bodies", GROUND, "mass" if ground.shape is None else "shape")
    for section, elements in (("forces", system.forces), ("constraints", system.constraints)):
        for name, element in elements.items():
            ends = {body_part(end, system.bodies)[0] for end in getattr(element, "between", None) or ()}
            if len(ends) == 1:
                told = f"{name} acts between two points of {ends.pop()} and moves nothing"
                yield Hint(told, section, name, "between")
            if isinstance(element, Drag) and element.linear is element.quadratic is ZERO:
                yield Hint(f"{name} has no coefficient; give linear, quadratic or both", section, name)


def _slow_sides(system: System, known: Values) -> Iterator[Hint]:
    """Yield the torque that alone drives a gear, if it does at the joint that turns slower."""
    driven = {f.joint: name for name, f in system.forces.items() if isinstance(f, (Torque, Motor)) and f.joint}
    for gear_name, gear in system.constraints.items():
        ratio = abs(value_or_none(gear.ratio, known) or 1.0) if isinstance(gear, Gear) else 1.0
        if not isinstance(gear, Gear) or ratio == 1.0:
            continue
        fast, slow = gear.joints if ratio > 1.0 else reversed(gear.joints)
        if slow in driven and fast not in driven:
            times = max(ratio, 1.0 / ratio)
            told = (
                f"{driven[slow]} acts on joint {slow}, the slow side of gear {gear_name}: joint {fast} turns "
                f"{times:.6g} times as fast; if a motor drives that one: joint: {fast}"
            )
            yield Hint(told, "forces", driven[slow], "joint")


def _oblique_ropes(system: System, known: Values) -> Iterator[Hint]:
    """Yield ends of ropes that slide beside the rims of the wheels from which they hang."""
    for name, rope in system.constraints.items():
        if not isinstance(rope, Rope):
            continue
        for end, step in ((rope.path[0], rope.path[1]), (rope.path[-1], rope.path[-2])):
            wheel = None if end in system.pulleys else system.pulleys.get(step)
            beside = wheel and _beside_the_rim(end, wheel, system, known)
            if beside:
                told = (
                    f"rope {name} hangs obliquely from {step} to {end}, whose way passes the axis of {step} at {beside}"
                    " m, not at its radius; if the rope is to hang straight, shift the body's joint or its points so "
                    "far"
                )
                yield Hint(told, "constraints", name, "path")


def _beside_the_rim(end: str, wheel: Pulley, system: System, known: Values) -> str:
    """Return how far from the axis of a wheel on ground an end passes that slides there, if that is not its radius."""
    body, part = body_part(end, system.bodies)
    joint = next((j for j in system.joints.values() if j.child == body), None)
    held, centre = body_part(wheel.at or "", {GROUND: Body(), **system.bodies}) if wheel.at else ("", "")
    ground = system.bodies.get(GROUND)
    if not isinstance(joint, Prismatic) or joint.parent != GROUND or held != GROUND or ground is None:
        return ""
    place = system.bodies[body].points.get(part) if part else system.bodies[body].com
    nodes = [*joint.axis, *(place or (ZERO,) * 3), *ground.points.get(centre, ()), *wheel.axis, wheel.radius]
    numbers = [value_or_none(x, known) for x in nodes]
    if len(numbers) != 13 or None in numbers:
        return ""
    along, start, middle, axle = (np.array(numbers[k : k + 3], dtype=float) for k in range(0, 12, 3))
    across = np.cross(axle, along)
    radius, size = float(numbers[12] or 0.0), float(np.linalg.norm(across))
    passes = abs(float(across @ (start - middle))) / size if size else radius
    return "" if not radius or abs(passes - radius) <= EXACT * radius or passes > 2.0 * radius else f"{passes:.6g}"


def _doubled_joints(system: System) -> Iterator[Hint]:
    """Yield two joints between the same two bodies, of which none is marked as the one that closes a loop."""
    between: dict[tuple[str, str], list[str]] = {}
    for name, joint in system.joints.items():
        if not joint.cut:
            ends = tuple(body_part(end, system.bodies)[0] for end in (joint.parent, joint.child))
            between.setdefault((min(ends), max(ends)), []).append(name)
    for (one, other), names in between.items():
        if len(names) > 1:
            told = (
                f"joints {' and '.join(names)} both join {one} to {other}: together they hold what any of them holds; "
                "if that is meant, mark those that close the loop with cut: true"
            )
            yield Hint(told, "joints", names[1])


def _doubled_contacts(system: System) -> Iterator[Hint]:
    """Yield contacts between the same parts of the same bodies as one before."""
    found: dict[tuple[str, ...], str] = {}
    for declared, name, contact in copies(system.contacts):
        ends = tuple(sorted(_touching_part(end, system) for end in contact.between))
        first = found.setdefault(ends, name)
        if first != name:
            told = (
                f"contacts {first} and {name} are both between {' and '.join(ends)}: both press, and the forces of one "
                "contact are shared by two; leave one out"
            )
            yield Hint(told, "contacts", declared)


def _touching_part(end: str, system: System) -> str:
    """Return an end of a contact with the surface that a body without shape touches with, if it has only one."""
    body, part = body_part(end, system.bodies)
    declared = system.bodies.get(body, Body())
    if part or declared.shape is not None:
        return end
    plain = "point" if body == GROUND else "plane"
    solid = [name for name, surface in declared.surfaces.items() if surface.kind != plain]
    return f"{body}.{solid[0]}" if len(solid) == 1 else end


def _nearly_parallel(system: System, known: Values) -> Iterator[Hint]:
    """Yield hinges of a loop whose axes are nearly parallel, where no frame turns them."""
    if len(system.joints) <= len(system.bodies.keys() - {GROUND}):
        return
    axes: dict[tuple[float, ...], str] = {}
    for name, joint in system.joints.items():
        if not isinstance(joint, Revolute):
            return
        ends = [body_part(end, system.bodies) for end in (joint.parent, joint.child)]
        if any(part in system.bodies[body].frames for body, part in ends if body in system.bodies):
            return
        axis = [value_or_none(x, known) for x in joint.axis]
        if None in axis:
            return
        axes.setdefault(tuple(x or 0.0 for x in axis), name)
    for (a, one), (b, other) in combinations(axes.items(), 2):
        angle = _between(a, b)
        if EXACT < angle < _NEARLY:
            told = (
                f"the axes of joints {one} and {other} differ by {math.degrees(angle):.3g} deg: hinges of a plane loop "
                "have parallel axes"
            )
            yield Hint(told, "joints", other, "axis")


def _between(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the angle between two lines."""
    (ax, ay, az), (bx, by, bz) = a, b
    across = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    return math.atan2(across, abs(ax * bx + ay * by + az * bz))
