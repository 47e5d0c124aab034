"""Hints about numbers: values that are allowed, and that their author may have meant in another unit or sense."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from multibody_sym.checking.hint import Hint
from multibody_sym.dynamics.start.undefined import value_or_none
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.tokens import plain_number
from multibody_sym.expressions.units import Turning
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.forces import Friction
from multibody_sym.model.declaration.joint import MovingJoint
from multibody_sym.model.declaration.steps import is_upright
from multibody_sym.model.declaration.system import System, expressions
from multibody_sym.model.resolution.plane import moves_in_plane
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import postorder

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
EXACT: Final = 1e-9
_ABOUT_AN_END: Final = {4.0 / 3.0: 1.0 / 3.0, **{ratio: ratio for ratio in (3.0 / 2.0, 2.0, 7.0 / 5.0, 5.0 / 3.0)}}
"""Moments about the end of a rod and the rims of disc, ring, sphere and shell in m*c^2, c to the centre; as written."""

Values = Mapping[Node, float]


def number_hints(system: System, known: Values) -> Iterator[Hint]:
    """Yield what the values of a declaration suggest was confused."""
    yield from _gravity_upwards(system, known)
    yield from _gravity_across(system, known)
    yield from _angles(system, known)
    yield from _degrees(system)
    yield from _degrees_of_parameters(system, known)
    yield from _coefficients(system, known)
    yield from _driving(system, known)
    yield from _diameters(system)
    yield from _masses(system, known)
    yield from _millimetres(system, known)
    for name, body in system.bodies.items():
        yield from _inertia(name, body, known)
        yield from _beside_the_rod(name, body, known)


def known_values(system: System) -> dict[Node, float]:
    """Return the values of parameters, as far as they follow from each other."""
    known: dict[Node, float] = {}
    waiting = {symbol(name): parameter.value for name, parameter in system.parameters.items()}
    while found := {leaf: x for leaf, node in waiting.items() if (x := value_or_none(node, known)) is not None}:
        known.update(found)
        waiting = {leaf: node for leaf, node in waiting.items() if leaf not in found}
    return known


def _gravity_upwards(system: System, known: Values) -> Iterator[Hint]:
    values = [value_or_none(x, known) for x in system.gravity]
    if values[0] or values[2] or not values[1] or values[1] < 0:
        return
    name = next((x.data for x in postorder([system.gravity[1]]) if x.op == "symbol" and known.get(x, 1.0) < 0), None)
    up = "gravity points along +y, which is upwards in figures"
    if name is None:
        yield Hint(f"{up}; downwards it is [0, -g, 0], with a positive g", "gravity")
    else:
        yield Hint(f"{name} is negative, so that {up}; write it positive", "parameters", name)


def _gravity_across(system: System, known: Values) -> Iterator[Hint]:
    x, y, z = (value_or_none(part, known) for part in system.gravity)
    planes = (x for body in system.bodies.values() for x in body.surfaces.values() if x.plane is not None)
    rubs = any(isinstance(force, Friction) for force in system.forces.values())
    if rubs or any(is_upright(plane.normal) for plane in planes):
        return  # weight presses there
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
    """Yield for each angle that joints and frames state what it is, as it was written, and the path to it."""
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
    """Return what a field of an element was given, as a list, as it was written."""
    given = None if element is None else element.given(name)
    return [] if given is None else list(given) if isinstance(given, (list, tuple)) else [given]


def _masses(system: System, known: Values) -> Iterator[Hint]:
    """Yield masses without a unit that are too heavy for the size of the model."""
    masses = {body.mass if body.shape is None else body.shape.mass for body in system.bodies.values()}
    heavy = {
        name: value
        for name, parameter in system.parameters.items()
        if parameter.dimension is None and parameter.value.op == "number" and symbol(name) in masses
        and (value := known.get(symbol(name), 0.0)) >= _HEAVY
    }
    size = max((abs(x) for x in _lengths(system, known)), default=0.0) if heavy else 0.0
    for name, value in heavy.items():
        if size and value >= _DENSE * size * size * size:
            told = f"mass {name} = {value:g} has no unit and counts as {value:g} kg; if grams are meant: {value:g} g"
            yield Hint(told, "parameters", name)


def _millimetres(system: System, known: Values) -> Iterator[Hint]:
    """Yield lengths of bodies without a unit that are too long for the masses of the model."""
    masses = [body.mass if body.shape is None else body.shape.mass for body in system.bodies.values()]
    heaviest = max((value_or_none(x, known) or 0.0 for x in masses if isinstance(x, Node)), default=0.0)
    lengths = dict.fromkeys(
        x.data for path, node, unit in expressions(system) if unit == "m" and path[0] == "bodies"
        for x in postorder([node]) if x.op == "symbol"
    )  # fmt: skip
    for name in lengths:
        parameter, value = system.parameters.get(name), known.get(symbol(name), 0.0)
        plain = parameter is not None and parameter.dimension is None and parameter.value.op == "number"
        if plain and value >= _LONG and 0.0 < heaviest < value:
            counts = f"length {name} = {value:g} has no unit and counts as {value:g} m"
            yield Hint(f"{counts}; if millimetres are meant: {value:g} mm", "parameters", name)


def _degrees(system: System) -> Iterator[Hint]:
    """Yield sines and the like of plain numbers above a turn: these are radians."""
    for path, node, _ in expressions(system):
        for part in postorder([node]) if node.args else ():
            number = part.args[0] if part.op in ("sin", "cos", "tan") else None
            if number is not None and number.op == "number" and abs(float(number.data)) > _TURN:
                degrees = text(number)
                told = f"{part.op}({degrees}) takes {degrees} rad; if degrees are meant: {part.op}({degrees}*pi/180)"
                yield Hint(told, *path)


def _degrees_of_parameters(system: System, known: Values) -> Iterator[Hint]:
    """Yield parameters without a unit above a turn that are the argument, or a term of it, of sines and the like."""
    told: dict[str, tuple[Node, float]] = {}
    for _, node, _ in expressions(system):
        for part in postorder([node]) if node.args else ():
            for name in _terms(part.args[0]) if part.op in ("sin", "cos", "tan") else ():
                if turns := _turns(name, system, known):
                    told.setdefault(name, (part, turns * _TURN))
    for name, (part, value) in told.items():
        counts = f"parameter {name} has no unit and counts as {value:g} rad in {text(part)}"
        yield Hint(f"{counts}; if degrees are meant: {name}: {value:g} deg", "parameters", name)


def _terms(node: Node) -> Iterator[str]:
    """Yield the names that are an expression or terms of its sum; those in products, such as rates, are none."""
    waiting = [node]
    while waiting:
        last = waiting.pop()
        if last.op in ("add", "neg"):
            waiting.extend(last.args)
        elif last.op == "symbol":
            yield last.data


def _coefficients(system: System, known: Values) -> Iterator[Hint]:
    """Yield coefficients of friction that are angles or percentages."""
    for path, node, _ in expressions(system):
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


def _driving(system: System, known: Values) -> Iterator[Hint]:
    """Yield stiffness and damping below zero: such a spring pushes away, such a damper drives."""
    for path, node, _ in expressions(system):
        does = _OPPOSED.get(path[-1]) if path[0] == "forces" else None
        value = value_or_none(node, known) if does else None
        if value is not None and value < 0.0:
            yield Hint(f"{path[-1]} {value:g} is negative: {does}; if that is not meant, leave the minus out", *path)


def _diameters(system: System) -> Iterator[Hint]:
    """Yield radii that are named as diameters."""
    for path, node, _ in expressions(system):
        of_round = path[-1] in _ROUND or (path[-1] == "0" and path[-2] in _ROUND)
        if of_round and node.op == "symbol" and node.data in _DIAMETERS:
            yield Hint(f"{node.data} stands for a radius here; if it is the diameter: {node.data}/2", *path)


def _lengths(system: System, known: Values) -> Iterator[float]:
    """Yield the lengths that bodies and the start of sliders tell."""
    for path, node, unit in expressions(system):
        if unit == "m" and path[0] in ("bodies", "constraints", "pulleys"):
            yield value_or_none(node, known) or 0.0
    for joint in system.joints.values():
        if isinstance(joint, MovingJoint) and joint.initial is not None:
            units = joint.coordinate_units
            for unit, start in zip(units, joint.initial.values("q", len(units)), strict=False):
                if unit == "m" and start is not None:
                    yield value_or_none(start, known) or 0.0


def _inertia(name: str, body: Body, known: Values) -> Iterator[Hint]:
    """Yield a moment of inertia that is that of a common shape about its end or rim, not about its centre."""
    if body.inertia is None or body.com is None or not isinstance(body.mass, Node):
        return
    mass = value_or_none(body.mass, known)
    centre = [value_or_none(x, known) for x in body.com]
    for axis, key in enumerate(("Ixx", "Iyy", "Izz")):
        moment = value_or_none(body.inertia[axis], known)
        across = [x for k, x in enumerate(centre) if k != axis]
        if not mass or not moment or None in across:
            continue
        arm = math.hypot(*(x or 0.0 for x in across)) or math.inf
        ratio = moment / mass / arm / arm
        for about_end, written in _ABOUT_AN_END.items():
            if abs(ratio - about_end) < EXACT and _factor(body.inertia[axis]) in (None, written):
                told = (
                    f"{key} of body {name} would be that about an end or a rim; the inertia of a body is about its "
                    "centre of mass, such as m*l^2/12 of a rod, and the joint adds the rest"
                )
                yield Hint(told, "bodies", name, "inertia", key)


def _factor(node: Node) -> float | None:
    """Return the number in front of a product of symbols; None of a plain number."""
    if node.op == "number":
        return None
    return next((float(x.data) for x in node.args if x.op == "number"), 1.0)


def _beside_the_rod(name: str, body: Body, known: Values) -> Iterator[Hint]:
    """Yield points half a length before a rod, which begins at the body's origin."""
    if body.shape is None or body.shape.kind != "rod":
        return
    length = value_or_none(body.shape.sizes[0], known)
    for point, place in body.points.items():
        x, y, z = (value_or_none(component, known) for component in place)
        if length and x is not None and abs(x + length / 2) < EXACT * length and y == z == 0.0:
            told = (
                f"point {name}.{point} lies half a length before the rod: a rod begins at the origin of its body and "
                "runs along x, its middle is at [l/2, 0, 0]"
            )
            yield Hint(told, "bodies", name, "points", point)


