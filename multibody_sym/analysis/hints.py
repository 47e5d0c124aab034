"""Hints: declarations that are allowed, and that their author may not have meant.

In: a System; they need no mechanism, so that every command has them. Out: Hints, each with its element, the cause and
the cure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations
from typing import Any, Final, Self

import numpy as np

from multibody_sym.dynamics.start.parameters import known_values, value_or_none
from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.mechanics.spanning_tree import body_part, coordinate_names, letters_of
from multibody_sym.model.bodies import GROUND, Body, mass_of
from multibody_sym.model.constraints import Gear, Pulley, Rope
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.forces import Distributed, Drag, Motor, Torque
from multibody_sym.model.joints import MovingJoint, Prismatic, Revolute
from multibody_sym.model.steps import is_upright
from multibody_sym.model.system import System, expressions, states_gravity
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.node import ZERO, Node, nodes_among, symbol
from multibody_sym.text.printer import read_parts, text
from multibody_sym.text.tokens import plain_number
from multibody_sym.text.units import Turning

_TURN: Final = 2.0 * math.pi
_HEAVY: Final = 100.0
_DENSE: Final = 2000.0
"""kg and kg/m^3: a mass without a unit that is more than both, of its model's size, may be in grams."""
_LONG: Final = 100.0
"""m: a length without a unit that is more, and more than the kg of the heaviest body, may be in millimetres."""
_ROUGHEST: Final = 3.0
"""Coefficients of friction above this are rarely meant."""
_COEFFICIENTS: Final = ("static", "kinetic")
_OPPOSED: Final = {
    "stiffness": "such a spring pushes away",
    **dict.fromkeys(("damping", "linear", "quadratic"), "such a damper drives"),
}
_DIAMETERS: Final = ("d", "D", "dia", "diameter")
_ROUND: Final = ("radius", "disc", "ring", "sphere", "shell", "cylinder")
"""Keys, or the keys above the first of several sizes, under which a radius stands."""
_EXACT: Final = 1e-9
_ABOUT_AN_END: Final = {4.0 / 3.0: 1.0 / 3.0, **{ratio: ratio for ratio in (3.0 / 2.0, 2.0, 7.0 / 5.0, 5.0 / 3.0)}}
"""Moments about the end of a rod and the rims of disc, ring, sphere and shell in m*c^2, c to the centre; as written."""
_NEARLY: Final = math.radians(20.0)

Values = Mapping[Node, float]


class Hint(str):
    """The text of a hint; `path` is the part of the model that it is about."""

    path: tuple[str, ...]

    def __new__(cls, told: str, *path: str) -> Self:
        hint = super().__new__(cls, told)
        hint.path = path
        return hint


def first_at_each_place(hints: Iterable[Hint]) -> list[Hint]:
    """Return the first hint about each part of the model: repeated elements have the same about all copies."""
    found: dict[tuple[str, ...], Hint] = {}
    for hint in hints:
        found.setdefault(hint.path, hint)
    return list(found.values())


def declared_hints(system: System) -> list[Hint]:
    """Return what the declaration alone suggests was forgotten or confused."""
    known = known_values(system)
    hints: list[Hint] = []
    if not set(system.bodies) - {GROUND}:
        told = "no body is declared, and nothing moves; write bodies: {bob: {mass: 1 kg}} or the like"
        hints.append(Hint(told, "bodies"))
    heavy = any(_has_mass(body) for body in system.bodies.values())
    if heavy and not states_gravity(system) and not any(ask.is_of_vibrations for ask in system.ask.values()):
        told = "no gravity is declared; write gravity: [0, -9.81, 0] or the like, [0, 0, 0] if there is none"
        hints.append(Hint(told, "gravity"))
    return [
        *hints,
        *_unused_names(system),
        *_like_letters(system),
        *_gravity(system, known),
        *_angles(system, known),
        *_degrees(system, known),
        *_coefficients(system, known),
        *_units(system, known),
        *_bodies(system, known),
        *_without_effect(system),
        *_parting(system, known),
        *_slow_sides(system, known),
        *_oblique_ropes(system, known),
        *first_at_each_place(_doubles(system)),
        *_nearly_parallel(system, known),
        *first_at_each_place(_pulled_off(system, known)),
    ]


# --- values that may be meant in another unit or sense ---------------------------------------------------------------


def _gravity(system: System, known: Values) -> Iterator[Hint]:
    """Yield a gravity upwards in figures, or across the plane in which all moves, where no weight presses."""
    x, y, z = (value_or_none(part, known) for part in system.gravity)
    if not x and not z and y and y >= 0:
        negative = (n for n in postorder([system.gravity[1]]) if n.op == "symbol" and known.get(n, 1.0) < 0)
        name = next((n.data for n in negative), None)
        up = "gravity points along +y, which is upwards in figures"
        if name is None:
            yield Hint(f"{up}; downwards it is [0, -g, 0], with a positive g", "gravity")
        else:
            yield Hint(f"{name} is negative, so that {up}; write it positive", "parameters", name)
    planes = (x for body in system.bodies.values() for x in body.surfaces.values() if x.plane is not None)
    if system.frictions or any(is_upright(plane.normal) for plane in planes):
        return
    if x == 0.0 and y == 0.0 and z and system.joints and moves_in_plane(system):
        told = "gravity points along z, and all that moves does so in the plane z = 0, where it acts on nothing"
        yield Hint(f"{told}; downwards in a figure it is [0, -g, 0]", "gravity")


def _angles(system: System, known: Values) -> Iterator[Hint]:
    """Yield angles of more than a turn that were written without a unit: they count as radians."""
    for what, x, *path in _written_angles(system):
        if turns := _turns(x, system, known):
            radians = f"{turns * _TURN:g} rad, {abs(turns):.3g} turns"
            number = turns * _TURN
            name = x.strip().removeprefix("-")
            sign = -1.0 if name != x.strip() else 1.0
            written = f"{name}: {sign * number:g} deg" if name in system.parameters else f"{x} deg"
            yield Hint(f"{what} {x}, which counts as {radians}; if degrees are meant, write the unit: {written}", *path)


def _written_angles(system: System) -> Iterator[tuple[Any, ...]]:
    """Yield each angle of joints and frames: what it is, its text as written, and the path to it."""
    for name, joint in system.joints.items():
        if not isinstance(joint, MovingJoint):
            continue
        units = joint.coordinate_units
        given = _texts(joint.initial, "q")
        for k, (x, unit) in enumerate(zip(given, units, strict=False) if len(given) == len(units) else ()):
            if unit == "rad":
                at = (str(k),) if given[1:] else ()
                yield (f"joint {name} starts at", x, "joints", name, "initial", "q", *at)
        for key in ("lower", "upper") if units == ("rad",) else ():
            for x in _texts(joint.limits, key):
                yield (f"the {key} limit of joint {name} is", x, "joints", name, "limits", key)
    for body_name, body in system.bodies.items():
        for frame_name, frame in body.frames.items():
            for k, turn in enumerate(frame.rotate):
                for x in _texts(turn, "angle"):
                    place = ("bodies", body_name, "frames", frame_name, "rotate", str(k), "angle")
                    yield (f"frame {body_name}.{frame_name} turns by", x, *place)


def _turns(text: Any, system: System, known: Values) -> float | None:
    """Return how many turns a plain number, or a parameter that is one, has in radians; None up to one."""
    if not isinstance(text, str):
        return None
    unsigned = text.strip().removeprefix("-")
    parameter, plain = system.parameters.get(unsigned), plain_number(unsigned)
    if parameter is not None and parameter.dimension is None and parameter.value.op == "number":
        value: float | None = known.get(symbol(unsigned))
    else:
        value = None if plain is None else float(plain)
    if value is None or abs(value) <= _TURN:
        return None
    return value / _TURN if unsigned == text.strip() else -value / _TURN


def _texts(element: Any, name: str) -> list[Any]:
    """Return the declared values of a field of an element as a list, as they were written."""
    given = None if element is None else element.given(name)
    return [] if given is None else list(given) if isinstance(given, (list, tuple)) else [given]


def _units(system: System, known: Values) -> Iterator[Hint]:
    """Yield masses and lengths without a unit that are too large for each other: grams, millimetres."""

    def is_plain(name: str) -> bool:
        parameter = system.parameters.get(name)
        return parameter is not None and parameter.dimension is None and parameter.value.op == "number"

    masses = [body.mass if body.shape is None else body.shape.mass for body in system.bodies.values()]
    values = {name: known.get(symbol(name), 0.0) for name in system.parameters}
    heavy = [x for x in values if is_plain(x) and symbol(x) in set(masses) and values[x] >= _HEAVY]
    sizes = []
    for path, node, unit in expressions(system) if heavy else ():
        if unit == "m" and path[0] in ("bodies", "constraints", "pulleys"):
            sizes.append(node)
    for joint in system.joints.values() if heavy else ():
        if isinstance(joint, MovingJoint) and joint.initial is not None:
            units = joint.coordinate_units
            starts = zip(units, joint.initial.values("q", len(units)), strict=False)
            sizes += [start for unit, start in starts if unit == "m" and start is not None]
    size = max((abs(value_or_none(node, known) or 0.0) for node in sizes), default=0.0)
    for name in heavy:
        value = values[name]
        if size and value >= _DENSE * size * size * size:
            told = f"mass {name} = {value:g} has no unit and counts as {value:g} kg; if grams are meant: {value:g} g"
            yield Hint(told, "parameters", name)
    heaviest = max((value_or_none(x, known) or 0.0 for x in nodes_among(masses)), default=0.0)
    lengths = dict.fromkeys(
        x.data for path, node, unit in expressions(system) if unit == "m" and path[0] == "bodies"
        for x in postorder([node]) if x.op == "symbol"
    )  # fmt: skip
    for name in lengths:
        value = known.get(symbol(name), 0.0)
        if is_plain(name) and value >= _LONG and 0.0 < heaviest < value:
            counts = f"length {name} = {value:g} has no unit and counts as {value:g} m"
            yield Hint(f"{counts}; if millimetres are meant: {value:g} mm", "parameters", name)


def _degrees(system: System, known: Values) -> Iterator[Hint]:
    """Yield arguments of sines and the like above a turn: plain numbers, and parameters without a unit in a sum."""
    waves = [
        (path, part)
        for path, node, _ in expressions(system)
        for part in (postorder([node]) if node.args else ())
        if part.op in ("sin", "cos", "tan")
    ]
    for path, part in waves:
        number = part.args[0]
        if number.op == "number" and abs(float(number.data)) > _TURN:
            degrees = text(number)
            told = f"{part.op}({degrees}) takes {degrees} rad; if degrees are meant: {part.op}({degrees}*pi/180)"
            yield Hint(told, *path)
    radians: dict[str, tuple[Node, float]] = {}
    for _, part in waves:
        waiting = [part.args[0]]
        while waiting:
            term = waiting.pop()
            if term.op in ("add", "neg"):
                waiting.extend(term.args)
            elif term.op == "symbol" and (turns := _turns(term.data, system, known)):
                radians.setdefault(term.data, (part, turns * _TURN))
    for name, (part, value) in radians.items():
        counts = f"parameter {name} has no unit and counts as {value:g} rad in {text(part)}"
        yield Hint(f"{counts}; if degrees are meant: {name}: {value:g} deg", "parameters", name)


def _coefficients(system: System, known: Values) -> Iterator[Hint]:
    """Yield coefficients of friction that are angles or percentages, negative springs and dampers, and diameters."""
    declared = list(expressions(system))
    for path, node, _ in declared:
        if path[-1] not in _COEFFICIENTS:
            continue
        parameter = system.parameters.get(node.data) if node.op == "symbol" else None
        value = value_or_none(node, known) or 0.0
        written = text(node)
        if parameter is not None and isinstance(parameter.dimension, Turning):
            yield Hint(f"{written} is an angle; a coefficient of friction is its tangent, tan({written})", *path)
        elif value > _ROUGHEST:
            told = f"{value:g} is above coefficients of friction of dry bodies; {value:g} % is {value / 100:g}"
            yield Hint(told, *(path if parameter is None else ("parameters", written)))
    for path, node, _ in declared:
        does = _OPPOSED.get(path[-1]) if path[0] == "forces" else None
        negative = value_or_none(node, known) if does else None
        if negative is not None and negative < 0.0:
            yield Hint(f"{path[-1]} {negative:g} is negative: {does}; if that is not meant, leave the minus out", *path)
    for path, node, _ in declared:
        of_round = path[-1] in _ROUND or (path[-1] == "0" and path[-2] in _ROUND)
        if of_round and node.op == "symbol" and node.data in _DIAMETERS:
            yield Hint(f"{node.data} stands for a radius here; if it is the diameter: {node.data}/2", *path)


def _bodies(system: System, known: Values) -> Iterator[Hint]:
    """Yield moments of inertia about an end or rim, and points half a length before a rod that begins at its origin."""
    for name, body in system.bodies.items():
        yield from _moments(name, body, known)
        if body.shape is None or body.shape.kind != "rod":
            continue
        length = value_or_none(body.shape.sizes[0], known)
        for point, place in body.points.items():
            x, y, z = (value_or_none(component, known) for component in place)
            if length and x is not None and abs(x + length / 2) < _EXACT * length and y == z == 0.0:
                told = (
                    f"point {name}.{point} lies half a length before the rod: a rod begins at the origin of its body "
                    "and runs along x, its middle is at [l/2, 0, 0]"
                )
                yield Hint(told, "bodies", name, "points", point)


def _moments(name: str, body: Body, known: Values) -> Iterator[Hint]:
    """Yield a moment of inertia that is that of a common shape about its end or rim, not about its centre."""
    if body.inertia is None or body.com is None or body.varying is not None:
        return
    mass = value_or_none(mass_of(body).mass, known)
    centre = [value_or_none(x, known) for x in body.com]
    for axis, key in enumerate(("Ixx", "Iyy", "Izz")):
        node = body.inertia[axis]
        moment = value_or_none(node, known)
        across = [x for k, x in enumerate(centre) if k != axis]
        if not mass or not moment or None in across:
            continue
        arm = math.hypot(*(x or 0.0 for x in across)) or math.inf
        ratio = moment / mass / arm / arm
        factor = next((float(x.data) for x in node.args if x.op == "number"), 1.0)
        for about_end, written in _ABOUT_AN_END.items():
            if abs(ratio - about_end) < _EXACT and (node.op == "number" or factor == written):
                told = (
                    f"{key} of body {name} would be that about an end or a rim; the inertia of a body is about its "
                    "centre of mass, such as m*l^2/12 of a rod, and the joint adds the rest"
                )
                yield Hint(told, "bodies", name, "inertia", key)


# --- elements without effect, or twice the same ----------------------------------------------------------------------


def _has_mass(body: Body) -> bool:
    return body.mass is not None or body.shape is not None


def _pulled_off(system: System, known: Values) -> Iterator[Hint]:
    """Yield contacts with planes of the ground off which gravity pulls a body on which nothing else acts."""
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
        if along > _EXACT * math.hypot(*(a or 0.0 for a in gravity)):
            yield Hint(
                f"gravity pulls {first} off {second}: its normal points out of its body, to where the other one is; if "
                "the ramp is to carry it turn the normal round, as in normal: [-sin(a), cos(a), 0]",
                "contacts",
                declared,
            )


def _unused_names(system: System) -> Iterator[Hint]:
    """Yield parameters, inputs and pulleys that nothing uses, and bodies without mass where one is needed."""
    named = {
        leaf.data
        for path, node, _ in expressions(system)
        for leaf in leaves([node], "symbol")
        if path[:2] != ("parameters", leaf.data)
    }
    for section, what in (("parameters", "parameter"), ("inputs", "input")):
        unused = [name for name in getattr(system, section) if name not in named]
        if unused:
            told = f"s {', '.join(unused)} are" if unused[1:] else f" {unused[0]} is"
            yield Hint(f"{what}{told} not used", section, unused[0])
    ropes = [step for c in system.constraints.values() if isinstance(c, Rope) for step in c.route]
    idle = (name for name in system.pulleys if name not in ropes)
    yield from (Hint(f"no rope runs over pulley {name}", "pulleys", name) for name in idle)
    joints = system.joints.values()
    carriers = [joint.parent for joint in joints]
    driven = {body_part(x.child, system.bodies)[0] for x in joints if x.steps and not x.free_steps}
    beams = {body_part(x.section, system.bodies)[0] for x in system.ask.values() if x.section is not None}
    kinematic = bool(system.ask and driven) and all(question.is_kinematic for question in system.ask.values())
    structure = bool(system.constraints or system.contacts) and not any(map(_has_mass, system.bodies.values()))
    needs_mass = not kinematic and not structure
    for name, body in system.bodies.items() if needs_mass else ():
        turns_only = body.inertia is not None and body.com is None
        if name == GROUND or _has_mass(body) or turns_only or name in driven or name in beams:
            continue
        if not any(parent == name or parent.startswith(f"{name}.") for parent in carriers):
            told = f"body {name} has no mass; give it one (mass: 1 kg), or a shape with a mass"
            yield Hint(told, "bodies", name)


def _like_letters(system: System) -> Iterator[Hint]:
    """Yield parameters and coordinates that formulas and figures write alike, such as th and theta."""
    letters, seen = letters_of(system), dict[tuple[str, ...], str]()
    places = {name: ("parameters", name) for name in system.parameters}
    places |= {x: ("joints", name) for name, joint in system.joints.items() for x in coordinate_names(name, joint)}
    for name, path in places.items():
        other = seen.setdefault(tuple(read_parts(letters.get(name, name))), name)
        if other != name:
            key = "label" if path[0] == "parameters" else "q_label"
            yield Hint(f"formulas and figures write {other} and {name} alike; give {name} a {key}", *path)


def _without_effect(system: System) -> Iterator[Hint]:
    """Yield a mass of ground, drag without coefficients, forces and rods within a body."""
    ground = system.bodies.get(GROUND)
    if ground is not None and _has_mass(ground):
        told = "ground does not move by forces, so that its mass changes nothing; what moves is a body of another name"
        yield Hint(told, "bodies", GROUND, "mass" if ground.shape is None else "shape")
    for section, elements in (("forces", system.forces), ("constraints", system.constraints)):
        for name, element in elements.items():
            ends = {body_part(end, system.bodies)[0] for end in getattr(element, "between", None) or ()}
            if len(ends) == 1 and not isinstance(element, Distributed):
                told = f"{name} acts between two points of {ends.pop()} and moves nothing"
                yield Hint(told, section, name, "between")
            if isinstance(element, Drag) and element.linear is element.quadratic is ZERO:
                yield Hint(f"{name} has no coefficient; give linear, quadratic or both", section, name)


def _parting(system: System, known: Values) -> Iterator[Hint]:
    """Yield impacts between points that give nothing back, where nothing holds the points together afterwards."""
    strikes = {} if system.impact is None else system.impact.strikes
    if any(impact.begins for impact in strikes.values()):
        return
    for name, impact in strikes.items():
        plastic = impact.restitution is None or value_or_none(impact.restitution, known) == 0.0
        if system.impact is not None and impact.between is not None and plastic:
            first, second = impact.between
            told = (
                f"{first} and {second} have one speed along the normal after the impact, and nothing holds them "
                "together in the motion that follows; bodies that stick have a joint with cut: true, and impact: "
                "{begins: JOINT}"
            )
            yield Hint(told, *system.impact.path(name))


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
        for end, step in ((rope.route[0], rope.route[1]), (rope.route[-1], rope.route[-2])):
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
    """Return how far from the axis of a wheel on ground a sliding end passes, if that is not its radius; else empty."""
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
    return "" if not radius or abs(passes - radius) <= _EXACT * radius or passes > 2.0 * radius else f"{passes:.6g}"


def _doubles(system: System) -> Iterator[Hint]:
    """Yield second joints of two bodies where none is marked as closing a loop, and second contacts of two parts."""
    between: dict[tuple[str, str], list[str]] = {}
    for name, joint in system.joints.items():
        if not joint.cut:
            first, second = (body_part(end, system.bodies)[0] for end in (joint.parent, joint.child))
            between.setdefault((min(first, second), max(first, second)), []).append(name)
    for (one, other), names in between.items():
        if len(names) > 1:
            told = (
                f"joints {' and '.join(names)} both join {one} to {other}: together they hold what any of them holds; "
                "if that is meant, mark those that close the loop with cut: true"
            )
            yield Hint(told, "joints", names[1])
    touching: dict[tuple[str, ...], str] = {}
    for declared, name, contact in copies(system.contacts):
        ends = tuple(sorted(_touching_part(end, system) for end in contact.between))
        earlier = touching.setdefault(ends, name)
        if earlier != name:
            told = (
                f"contacts {earlier} and {name} are both between {' and '.join(ends)}: both press, and the forces of "
                "one contact are shared by two; leave one out"
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
        (ax, ay, az), (bx, by, bz) = a, b
        across = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
        angle = math.atan2(across, abs(ax * bx + ay * by + az * bz))
        if _EXACT < angle < _NEARLY:
            told = (
                f"the axes of joints {one} and {other} differ by {math.degrees(angle):.3g} deg: hinges of a plane loop "
                "have parallel axes"
            )
            yield Hint(told, "joints", other, "axis")
