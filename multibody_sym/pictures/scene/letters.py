"""The letters of the problem: of masses, stiffnesses, coefficients; what is asked; what is given, with its numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.model.bodies import mass_of
from multibody_sym.model.constraints import PrescribedMotion
from multibody_sym.model.fields import fields_tree
from multibody_sym.model.forces import Damper, Friction, Motor, SpringDamper
from multibody_sym.model.joints import Joint, Prismatic
from multibody_sym.model.parameters import DimensionField
from multibody_sym.model.settings import Settings
from multibody_sym.model.steps import Curve
from multibody_sym.model.system import System, t
from multibody_sym.pictures.page.picture import typeset_unit
from multibody_sym.pictures.scene.items import ZERO, Anchor, AngleMark, unit, vector
from multibody_sym.pictures.scene.stage import PlacedSystem
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO as NOTHING
from multibody_sym.scalars.node import Node, nodes_among
from multibody_sym.text.printer import is_word, read_parts, text

_LONGEST: Final = 9
"""The longest expression (characters) that is written at a length; longer ones, unless names, are read in the model."""
_LONGEST_VALUE, _LONGEST_CURVE = 12, 16
"""The same for the value of a force."""
_IDENTIFIER: Final = re.compile(r"[A-Za-z_]\w*")
_RAISED: Final = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_PIN: Final = re.compile(r"[A-Z][0-9]?'?")
"""The name of a pin or of a roller in a book."""
_PINS: Final = ("revolute", "spherical", "roller", "contact")
_TURNED: Final = re.compile(r"-?(?:(.+)\*)?(cos|sin)\(([^()]+)\)(?:\*(.+))?")
"""A component of what is turned by an angle."""


def letters(node: Node) -> str:
    """Return how a length is named in a figure: its expression if that names parameters and is short, else nothing."""
    if not leaves([node], "symbol"):
        return ""
    found = text(node).removeprefix("-")
    if found.isidentifier():
        return found
    return found if len(found) <= _LONGEST and "(" not in found else ""


def letter_of(node: Node) -> str:
    """Return the one symbol, or nothing, that an expression or its negative always equals: h of h - a/2 + a/2."""
    symbols = leaves([node], "symbol")
    if not symbols or leaves([node], "slot"):
        return ""
    tried = [{each: 1.0 + math.sin(7.0 * k + shift) / 2 for k, each in enumerate(symbols)} for shift in (0.3, 1.9)]
    try:
        values = [evaluate([node], each, float)[0] for each in tried]
    except UNDEFINED:
        return ""
    near = (s for s in symbols if all(abs(abs(v) - each[s]) < 1e-12 for v, each in zip(values, tried, strict=True)))
    return next((letters(each) for each in near), "")


def mass_letters(stage: PlacedSystem, name: str) -> str:
    """Return the letters of a body's mass and moments of inertia, such as m, J; nothing for numbers."""
    body = stage.declared(name)
    mass = mass_of(body).mass
    found = ["" if mass.shadow == 0 else letters(mass)]
    moments = () if body.inertia is None else body.inertia[:3]
    named = [letter for node in moments if (letter := letters(node)).isidentifier()]
    found += [letter for letter in named if is_letter(stage.system, letter)]
    return ", ".join(dict.fromkeys(filter(None, found)))


def law_letters(element: Any) -> str:
    """Return the letters of a spring, a damper, friction in a joint or a motor; nothing for numbers."""
    if isinstance(element, Friction):
        arms = map(letters, nodes_among((element.radius, element.length)))
        return ", ".join(filter(None, (coefficients(element.static, element.kinetic), *arms)))
    nodes: list[Node] = []
    if isinstance(element, SpringDamper):
        nodes = [element.stiffness, element.damping]
    elif isinstance(element, Damper):
        nodes = [element.damping]
    elif isinstance(element, Motor):
        nodes = [element.voltage]
    return ", ".join(dict.fromkeys(found for node in nodes if (found := letters(node))))


def short_formula(node: Node, inputs: Mapping[str, Any]) -> str:
    """Return a value as it stands at an arrow: short, without powers, one of `inputs` as declared; else nothing."""
    given = inputs.get(text(node).removeprefix("-"))
    for value in nodes_among((given, node)):
        found = text(value).removeprefix("-")
        if len(found) <= _LONGEST_VALUE and "^" not in found and leaves([value], "symbol"):
            return found
    return ""


def coefficients(static: Node | str | None, kinetic: Node | None, restitution: Node | None = None) -> str:
    """Return the letters of coefficients of friction and restitution, mu and e for those that are numbers."""
    rough = [static, kinetic] if nodes_among([static]) and static is not kinetic else [kinetic or static]
    names = ("mu_s", "mu_k") if len(rough) == 2 else ("mu",)
    entries = [*zip(names, rough, strict=True), ("e", restitution)]
    return ", ".join(dict.fromkeys(found for name, node in entries if (found := _coefficient(name, node))))


def _coefficient(name: str, node: Node | str | None) -> str:
    if node is None or isinstance(node, str) or node is NOTHING:
        return ""
    return letters(node) if node.shadow is None else f"{name} = {node.shadow:.3g}"


def is_titled(element: Any, name: str, kind: str) -> bool:
    """Return whether a figure in letters names an element: one with a label, and pins or rollers such as A."""
    return bool(getattr(element, "label", None)) or (kind in _PINS and bool(_PIN.fullmatch(name)))


# ----------------------------------------------------------------------------------------------------------------------
# What is asked and what is given.


@dataclass(frozen=True)
class Given:
    """A parameter: its `name`, the `letter` of the book, and its number with a unit.

    The number is empty where it has none, and, unless a question contains it, of words and of what follows from others;
    of what follows from others and is sought it would be the answer.
    """

    name: str
    letter: str
    value: str


def is_letter(system: System, name: str) -> bool:
    """Return whether a book would write a name: one letter with indices, capitals such as AB, or what has a label."""
    parameter = system.parameters.get(name)
    labelled = parameter is not None and parameter.label is not None
    return labelled or name.isupper() or not is_word(read_parts(name)[0])


def asked_names(system: System) -> frozenset[str]:
    """Return the names that the questions of a model contain: of parameters, coordinates and elements."""
    return frozenset(names_in(fields_tree(system).get("ask", {})))


def names_in(tree: Any) -> Iterator[str]:
    """Yield the words of a tree of fields, keys included."""
    if isinstance(tree, str):
        yield from _IDENTIFIER.findall(tree)
    for key, value in tree.items() if isinstance(tree, Mapping) else ():
        yield key
        yield from names_in(value)
    for value in tree if isinstance(tree, (list, tuple)) else ():
        yield from names_in(value)


def givens(stage: PlacedSystem, book: Mapping[str, str]) -> tuple[Given, ...]:
    """Return the parameters of a model with their numbers."""
    found, asked = [], asked_names(stage.system)
    questions = fields_tree(stage.system).get("ask", {}).values()
    sought = {each.get("find") for each in questions if isinstance(each, Mapping)}
    for name, parameter in stage.system.parameters.items():
        follows = bool(leaves([parameter.value], "symbol"))
        told = (name in asked and not (follows and name in sought)) or (not follows and is_letter(stage.system, name))
        number = stage.number(parameter.value, math.nan)
        unit = "" if parameter.dimension is None else DimensionField().tree(parameter.dimension)
        shown = f"{_number(math.degrees(number))}°" if unit == "rad" else f"{_number(number)} {_set(unit)}".rstrip()
        found.append(Given(name, book.get(name, name), shown if told and math.isfinite(number) else ""))
    return tuple(found)


def _number(value: float) -> str:
    """Return a number as a book sets it: 1.4·10⁹, not 1.4e+09."""
    digits, _, power = f"{value:.4g}".partition("e")
    return (f"{digits}·10{str(int(power)).translate(_RAISED)}" if power else digits).replace("-", "−")


def _set(unit: str) -> str:
    """Return a unit as a book sets it: kg m⁴/s², s²/(kg m²)."""
    above, *below = unit.split("/")
    return typeset_unit("/".join([above, *([f"({'*'.join(below)})"] if len(below) > 1 else below)]))


def is_static(system: System) -> bool:
    """Return whether nothing of a model says that it moves: no run is declared and no speed at the start."""
    speeds = [getattr(getattr(joint, "initial", None), "u", None) or () for joint in system.joints.values()]
    return system.simulation == Settings() and not any(u is not None and u.shadow != 0 for each in speeds for u in each)


# ----------------------------------------------------------------------------------------------------------------------
# Angles that are no coordinates: of slopes, by the normal of a plane or by gravity, and of forces.


class Turned(NamedTuple):
    """A vector F*cos(a), F*sin(a): the `angle` and the `size` as text, and the axes of the cosine and the sine."""

    angle: str
    size: str
    cosine: int
    sine: int


def turned_by(value: Any) -> Turned | None:
    """Return by which angle a declared vector is turned from an axis, None for another one."""
    return _turned([text(node) if node.shadow != 0 else "" for node in value]) if isinstance(value, tuple) else None


def circle_of(curve: Curve) -> Turned | None:
    """Return the size and the axes of a curve that is a circle R*cos(s), R*sin(s), None for another one."""
    tree = fields_tree(curve)
    return _turned([str(tree.get(axis, "")) for axis in "xyz"])


def semi_axes(curve: Curve) -> Iterator[tuple[int, str]]:
    """Yield the axes and letters of a curve that is an ellipse a*cos(s), b*sin(s) about the origin."""
    tree = fields_tree(curve)
    found = [_TURNED.fullmatch(str(tree.get(axis, ""))) for axis in "xy"]
    if all(each is not None and each[3] == curve.parameter for each in found):
        yield from ((k, each[1]) for k, each in enumerate(found) if each is not None and each[1])


def curve_equation(curve: Curve) -> str:
    """Return a curve as an equation of coordinates, y = x^2/(2*p), if that is short; else nothing."""
    tree = fields_tree(curve)
    given = [(axis, str(tree[axis])) for axis in "xyz" if axis in tree]
    if curve.parameter is not None or len(given) != 1 or len(given[0][1]) > _LONGEST_CURVE:
        return ""
    return " = ".join(given[0])


def _turned(texts: Sequence[str]) -> Turned | None:
    given = [k for k, each in enumerate(texts) if each]
    found = [_TURNED.fullmatch(texts[k]) for k in given]
    if len(found) != 2 or found[0] is None or found[1] is None:
        return None
    (*sizes, first, angle), (*other_sizes, second, other_angle) = (
        (each[1], each[4], each[2], each[3]) for each in found if each is not None
    )
    if sizes != other_sizes or angle != other_angle or first == second:
        return None
    return Turned(angle, "*".join(filter(None, sizes)), *(given if first == "cos" else given[::-1]))


def slopes(stage: PlacedSystem) -> Iterator[AngleMark]:
    """Yield the angles of planes whose normals, of sliders whose axes and of figures whose gravity have a letter."""
    for name, body in stage.system.bodies.items():
        for word, surface in body.surfaces.items():
            turned = turned_by(surface.normal) if surface.kind == "plane" else None
            if turned is None or surface.plane is None:
                continue
            normal, way = stage.vector(surface.normal), np.zeros(3)
            way[turned.sine], way[turned.cosine] = normal[turned.cosine], -normal[turned.sine]
            way = way if way[turned.cosine] > 0.0 else -way  # uphill
            at = Anchor(stage.number_of(name), stage.vector(surface.plane))
            yield _slope(f"{name}.{word}", turned.angle, at, turned.sine, way)
    for name, joint in stage.system.joints.items():
        turned = turned_by(joint.axis) if isinstance(joint, Prismatic) else None
        place = stage.place(joint.parent)
        if turned is not None and isinstance(joint, Prismatic) and np.allclose(place.rotation, np.eye(3)):
            way = np.array(unit(stage.vector(joint.axis)))
            way = way if way[turned.sine] > 0.0 else -way
            yield _slope(name, turned.angle, place.anchor, turned.cosine, way)
    gravity, turned = np.array(unit(stage.gravity)), turned_by(stage.system.gravity)
    if turned is not None:
        way = np.zeros(3)
        way[turned.sine] = -np.sign(gravity[turned.sine])  # uphill along the axis of the plane
        level = way - float(way @ gravity) * gravity
        ends = Anchor(-1, unit(level)), Anchor(-1, vector(way))
        yield AngleMark("gravity", turned.angle, Anchor(-1, ZERO), *ends, ZERO, coordinate=False)


def _slope(name: str, letter: str, at: Anchor, axis: int, way: Floats) -> AngleMark:
    """Return the angle at a place of a body between an axis and the way uphill, in the axes of the body."""
    level = vector(np.copysign(1.0, way[axis]) * np.eye(3)[axis])
    return AngleMark(name, letter, at, Anchor(at.body, level), Anchor(at.body, vector(way)), ZERO, coordinate=False)


def start_letter(stage: PlacedSystem, joint: Joint) -> str:
    """Return the letter at which the last coordinate of a joint starts, nothing where it has none."""
    initial = getattr(joint, "initial", None)
    node = initial.q[-1] if initial is not None and initial.q else None
    if node is None or text(node).startswith("-"):
        return ""
    found = letters(node)
    return found if found.isidentifier() and is_letter(stage.system, found) else ""


def start_angle(stage: PlacedSystem, joint: Joint) -> tuple[str, float]:
    """Return the letter of the angle from a half or quarter turn at which a joint starts, and that turn (rad)."""
    initial = getattr(joint, "initial", None)
    node = initial.q[-1] if initial is not None and initial.q else None
    if node is None:
        return "", 0.0
    for quarters in (0, 2, 1, -1):
        turn = quarters * math.pi / 2
        found = letter_of(node - turn)
        if found and is_letter(stage.system, found):
            return found, turn
    return "", 0.0


def driven_by(stage: PlacedSystem, name: str) -> Node | None:
    """Return the motion that a joint of one freedom is given, None where it is free."""
    motion = getattr(stage.system.joints[name], "motion", None)
    given = [*motion] if motion is not None else []
    given += [e.value for e in stage.system.constraints.values() if isinstance(e, PrescribedMotion) and e.joint == name]
    return given[0] if len(given) == 1 else None


def steady_rate(motion: Node) -> Node | None:
    """Return the constant speed of a motion, None of another one and of what stands still."""
    rate = derivative(motion, t)
    return None if rate.shadow == 0 or t in leaves([rate], "symbol") else rate


def steady_speed(stage: PlacedSystem, motion: Node | None) -> str:
    """Return the letter of the constant speed of a motion, nothing of another one."""
    rate = None if motion is None else steady_rate(motion)
    return "" if rate is None else speed_letter(stage, rate)


def speed_letter(stage: PlacedSystem, speed: Node) -> str:
    """Return the letter of a speed, nothing for a number or a word."""
    found = letters(speed)
    return found if not found.isidentifier() or is_letter(stage.system, found) else ""


def given_motion(stage: PlacedSystem, name: str) -> str:
    """Return the short expression by which a hinge is driven, at a steady speed where it starts; else nothing."""
    motion = driven_by(stage, name)
    if motion is None or getattr(stage.system.joints[name], "motion", None) is None:
        return ""
    if steady_speed(stage, motion):
        motion = evaluate([motion], lambda leaf: NOTHING if leaf is t else leaf)[0]
        return letters(motion)
    found = text(motion)
    return found if len(found) <= _LONGEST and "^" not in found else ""
