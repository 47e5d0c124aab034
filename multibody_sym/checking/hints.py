"""Hints: what a declaration says that is allowed, and that its author may not have meant.

They need no mechanism, so that every command has them. A hint names its element, the cause and what to write.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, Final

from multibody_sym.dynamics.start.undefined import value_or_none
from multibody_sym.expressions.tokens import plain_number
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.constraints import Rope
from multibody_sym.model.declaration.joint import MovingJoint
from multibody_sym.model.declaration.joints import Revolute
from multibody_sym.model.declaration.system import System, expressions, states_gravity
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import leaves

_TURN: Final = 2.0 * math.pi
_HEAVY: Final = 100.0
_DENSE: Final = 2000.0
"""kg and kg/m^3: a mass without a unit that is more than both, of its model's size, may be in grams."""
_NEARLY: Final = math.radians(20.0)
_EXACT: Final = 1e-9
_ABOUT_AN_END: Final = {4.0 / 3.0: 1.0 / 3.0, **{ratio: ratio for ratio in (3.0 / 2.0, 2.0, 7.0 / 5.0, 5.0 / 3.0)}}
"""Moments about the end of a rod and the rims of disc, ring, sphere and shell in m*c^2, c to the centre; as written."""

Values = Mapping[Node, float]


def declared_hints(system: System) -> list[str]:
    """Return what the declaration alone suggests was forgotten or confused."""
    known = _values(system)
    return [
        *_gravity(system),
        *_unused(system),
        *_angles(system, known),
        *_masses(system, known),
        *(hint for name, body in system.bodies.items() for hint in _inertia(name, body, known)),
        *(hint for name, body in system.bodies.items() for hint in _beside_the_rod(name, body, known)),
        *_doubled_joints(system),
        *_nearly_parallel(system, known),
    ]


def _values(system: System) -> dict[Node, float]:
    """Return the values of parameters, as far as they follow from each other."""
    known: dict[Node, float] = {}
    waiting = {symbol(name): parameter.value for name, parameter in system.parameters.items()}
    while found := {leaf: x for leaf, node in waiting.items() if (x := value_or_none(node, known)) is not None}:
        known.update(found)
        waiting = {leaf: node for leaf, node in waiting.items() if leaf not in found}
    return known


def _gravity(system: System) -> Iterator[str]:
    if not states_gravity(system) and any(_has_mass(body) for body in system.bodies.values()):
        yield "no gravity is declared; write gravity: [0, -9.81, 0] or the like, [0, 0, 0] if there is none"


def _has_mass(body: Body) -> bool:
    return body.mass is not None or body.shape is not None


def _unused(system: System) -> Iterator[str]:
    """Yield parameters, inputs and pulleys that nothing uses, and bodies without mass that carry nothing."""
    named = {
        leaf.data
        for path, node, _ in expressions(system)
        for leaf in leaves([node], "symbol")
        if path[:2] != ("parameters", leaf.data)
    }
    for section, what in (("parameters", "parameter"), ("inputs", "input")):
        yield from (f"{what} {name} is not used" for name in getattr(system, section) if name not in named)
    ropes = [step for c in system.constraints.values() if isinstance(c, Rope) for step in c.path]
    yield from (f"no rope runs over pulley {name}" for name in system.pulleys if name not in ropes)
    carriers = [joint.parent for joint in system.joints.values()]
    for name, body in system.bodies.items():
        turns_only = body.inertia is not None and body.com is None
        if name == GROUND or _has_mass(body) or turns_only:
            continue
        if not any(parent == name or parent.startswith(f"{name}.") for parent in carriers):
            yield f"body {name} has no mass"


def _angles(system: System, known: Values) -> Iterator[str]:
    """Yield angles of more than a turn that were written without a unit: they count as radians."""
    for name, joint in system.joints.items():
        if not isinstance(joint, MovingJoint):
            continue
        units = joint.coordinate_units
        given = _texts(joint.initial, "q")
        pairs = zip(given, units, strict=False) if len(given) == len(units) else ()
        found = [(f"joint {name} starts at", x) for x, unit in pairs if unit == "rad"]
        if units == ("rad",):
            limits = [(key, x) for key in ("lower", "upper") for x in _texts(joint.limits, key)]
            found += [(f"the {key} limit of joint {name} is", x) for key, x in limits]
        yield from (_radians(what, x, turns) for what, x in found if (turns := _turns(x, system, known)))
    for body_name, body in system.bodies.items():
        for frame_name, frame in body.frames.items():
            for turn in frame.rotate:
                for x in _texts(turn, "angle"):
                    if turns := _turns(x, system, known):
                        yield _radians(f"frame {body_name}.{frame_name} turns by", x, turns)


def _radians(what: str, text: str, turns: float) -> str:
    radians = f"{turns * _TURN:g} rad, {turns:.3g} turns"
    return f"{what} {text}, which counts as {radians}; if degrees are meant, write the unit: {text} deg"


def _turns(text: Any, system: System, known: Values) -> float | None:
    """Return how many turns a plain number, or a parameter that is one, has in radians; None up to one."""
    if not isinstance(text, str):
        return None
    parameter = system.parameters.get(text.strip().removeprefix("-"))
    plain = plain_number(text.strip().removeprefix("-"))
    if parameter is not None and parameter.dimension is None and parameter.value.op == "number":
        value: float | None = known.get(symbol(text.strip().removeprefix("-")))
    else:
        value = None if plain is None else float(plain)
    return None if value is None or value <= _TURN else value / _TURN


def _texts(element: Any, name: str) -> list[Any]:
    """Return what a field of an element was given, as a list, as it was written."""
    given = None if element is None else element.given(name)
    return [] if given is None else list(given) if isinstance(given, (list, tuple)) else [given]


def _masses(system: System, known: Values) -> Iterator[str]:
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
            yield f"mass {name} = {value:g} has no unit and counts as {value:g} kg; if grams are meant: {value:g} g"


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


def _inertia(name: str, body: Body, known: Values) -> Iterator[str]:
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
            if abs(ratio - about_end) < _EXACT and _factor(body.inertia[axis]) in (None, written):
                yield (
                    f"{key} of body {name} is that about an end or a rim; the inertia of a body is about its centre of "
                    f"mass, such as m*l^2/12 of a rod; the joint adds the rest"
                )


def _factor(node: Node) -> float | None:
    """Return the number in front of a product of symbols; None of a plain number."""
    if node.op == "number":
        return None
    return next((float(x.data) for x in node.args if x.op == "number"), 1.0)


def _beside_the_rod(name: str, body: Body, known: Values) -> Iterator[str]:
    """Yield points half a length before a rod, which begins at the body's origin."""
    if body.shape is None or body.shape.kind != "rod":
        return
    length = value_or_none(body.shape.sizes[0], known)
    for point, place in body.points.items():
        x, y, z = (value_or_none(component, known) for component in place)
        if length and x is not None and abs(x + length / 2) < _EXACT * length and y == z == 0.0:
            yield (
                f"point {name}.{point} lies half a length before the rod: a rod begins at the origin of its body and "
                "runs along x, its middle is at [l/2, 0, 0]"
            )


def _doubled_joints(system: System) -> Iterator[str]:
    """Yield two joints between the same two bodies, of which none is marked as the one that closes a loop."""
    between: dict[tuple[str, str], list[str]] = {}
    for name, joint in system.joints.items():
        if not joint.cut:
            ends = tuple(body_part(end, system.bodies)[0] for end in (joint.parent, joint.child))
            between.setdefault((min(ends), max(ends)), []).append(name)
    for (one, other), names in between.items():
        if len(names) > 1:
            yield (
                f"joints {' and '.join(names)} both join {one} to {other}: together they hold what any of them holds; "
                "if that is meant, mark those that close the loop with cut: true"
            )


def _nearly_parallel(system: System, known: Values) -> Iterator[str]:
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
        if _EXACT < angle < _NEARLY:
            yield (
                f"the axes of joints {one} and {other} differ by {math.degrees(angle):.3g} deg: hinges of a plane loop "
                "have parallel axes"
            )


def _between(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the angle between two lines."""
    (ax, ay, az), (bx, by, bz) = a, b
    across = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    return math.atan2(across, abs(ax * bx + ay * by + az * bz))
